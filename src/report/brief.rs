//! Result of the command `identify` on one screen.

use super::document::Block;
use super::errors::row_noun;
use super::identify::estimate_head;
use super::noise::includes_orientation;
use super::parameters::correlated;
use super::prior::summary;
use super::remainder::PredictionAccuracy;
use super::render::text;
use super::row_kinds::unsteady_points;
use crate::fit::{Finding, FindingCode, Identification, size_of_kind};
use crate::least_squares::UnidentifiableCombination;
use crate::problem::Problem;
use crate::quantity::format::{counted, number, two_digits};
use crate::results::Knowledge;

/// Returns a summary of a fit for one screen, ending in a line break: errors, size of the residual,
/// parameters and remarks.
pub fn estimate_brief(
    problem: &Problem,
    found: &Identification,
    accuracy: Option<PredictionAccuracy>,
) -> String {
    let mut blocks = estimate_head(problem, found, accuracy);
    blocks.extend(found.prior.as_ref().map(|comparison| Block::Text(summary(found, comparison))));
    blocks.push(Block::Lines(parameter_counts(found), remarks(found)));
    text(&blocks)
}

/// Returns true if the data determine no parameter of the fit well.
pub fn determines_nothing(found: &Identification) -> bool {
    let constraints = &found.active_constraints;
    !found.estimates.iter().any(|estimate| Knowledge::of(estimate, constraints).is_identified())
}

/// States how many parameters the data determine well, in part, or hardly, and how many limits
/// decide.
fn parameter_counts(found: &Identification) -> String {
    let Identification { estimates, active_constraints, .. } = found;
    let count = |is: fn(Knowledge) -> bool| {
        let knowledge = |estimate| Knowledge::of(estimate, active_constraints);
        estimates.iter().filter(|estimate| is(knowledge(estimate))).count()
    };
    let is_hardly = |knowledge| matches!(knowledge, Knowledge::Hardly | Knowledge::NotAtAll);
    let others = [
        (count(|knowledge| knowledge == Knowledge::InPart), "in part"),
        (count(is_hardly), "hardly or not at all"),
    ];
    let others = others.iter().filter(|part| part.0 > 0).map(|(n, how)| format!(", {n} {how}"));
    let limited = match count(Knowledge::is_limited) {
        0 => String::new(),
        n => format!("; a bound or constraint alone decides {n}"),
    };
    let fixed = match count(|knowledge| knowledge == Knowledge::NotFitted) {
        0 => String::new(),
        n => format!("; {n} not fitted"),
    };
    format!(
        "Of {} the data determine {} well{}{limited}{fixed}; -v lists them.",
        counted(estimates.len(), "parameter"),
        count(Knowledge::is_identified),
        others.collect::<String>()
    )
}

/// Returns true if every parameter of a combination that the data leave open has a prior.
fn rests_on_priors(found: &Identification, combination: &UnidentifiableCombination) -> bool {
    let has_prior = |name: &String| {
        let estimate = found.estimates.iter().find(|estimate| estimate.name == *name);
        estimate.is_some_and(|estimate| estimate.prior_sigma.is_some())
    };
    combination.weights.iter().all(|(k, _)| found.unknowns.get(*k).is_some_and(has_prior))
}

/// Smallest deviation of an angle or length of the arm, in standard deviations of its estimate under
/// the prior, that is remarked. Of 30 parameters, one in a dozen fits has such a deviation by chance.
const MIN_REMARKED_SIGMAS: f64 = 3.0;
/// Smallest identified share of a parameter that is remarked.
const MIN_REMARKED_SHARE: f64 = 0.25;

/// States which angle or length of a joint deviates most for its prior, and the whole deviation if
/// others act alike. `None` if no deviation is remarkable.
fn farthest_for_its_prior(found: &Identification) -> Option<String> {
    let farthest = found.estimates.iter().filter_map(|estimate| {
        // Names of effects begin with "joint-".
        let rest = estimate.name.strip_prefix("joint")?;
        let is_of_joint =
            rest.starts_with(|c: char| c.is_ascii_digit()) && !estimate.unit.is_relative();
        let sigma = estimate.prior_sigma.filter(|_| is_of_joint)?;
        let share = Some(estimate.identified).filter(|share| *share >= MIN_REMARKED_SHARE)?;
        let deviation = estimate.estimate - estimate.nominal;
        Some((estimate, share, deviation.abs() / (sigma * share.sqrt())))
    });
    let farthest = farthest.max_by(|a, b| a.2.total_cmp(&b.2))?;
    let (estimate, share, sigmas) = farthest;
    let alike: Vec<String> = found
        .strong_correlations()
        .into_iter()
        .filter_map(|(a, b, _)| match &estimate.name {
            name if *name == a => Some(b),
            name if *name == b => Some(a),
            _ => None,
        })
        .collect();
    let unit = estimate.unit.display(estimate.nominal);
    let deviation = estimate.estimate - estimate.nominal;
    let shown = |of: f64| format!("{} {}", two_digits(of * unit.factor, 3), unit.symbol);
    let shared = if alike.is_empty() {
        String::new()
    } else {
        format!("; with {}, acting alike, {} in all", alike.join(" and "), shown(deviation / share))
    };
    (sigmas > MIN_REMARKED_SIGMAS).then(|| {
        format!(
            "farthest from nominal for its prior: {} by {} ({} times what the prior expects{shared})",
            estimate.name,
            shown(deviation),
            number(sigmas, 1)
        )
    })
}

/// Returns short remarks on what the full text explains, such as orientation errors, outliers,
/// undetermined combinations and active constraints.
fn remarks(found: &Identification) -> Vec<String> {
    let mut points = Vec::new();
    if let Some(orientation) = &found.orientation {
        let mean = |of: &crate::fit::Errors| number(of.held_out.mean.norm.to_degrees(), 4);
        points.push(format!(
            "orientation: {} ° before, {} ° after, mean error of the held-out poses",
            mean(&orientation.registered),
            mean(&orientation.fitted)
        ));
    }
    let farthest = found.outliers.iter().max_by(|a, b| a.distance.total_cmp(&b.distance));
    points.extend(farthest.map(|outlier| {
        let n = counted(found.outliers.len(), row_noun(found));
        let (stand, farthest) = match found.outliers.len() {
            1 => ("stands", ""),
            _ => ("stand", ", the farthest"),
        };
        if includes_orientation(found, outlier.kind) {
            return format!(
                "{n} {stand} out by position and orientation together{farthest}: {}, {} × the \
                 typical scatter",
                outlier.location,
                number(outlier.distance, 1)
            );
        }
        format!(
            "{n} {stand} out{farthest}: {}, {}",
            outlier.location,
            size_of_kind(outlier.kind, outlier.error.norm(), 3)
        )
    }));
    points.extend(unsteady_points(found.spreads.iter().map(|spread| &spread.1)));
    points.extend(farthest_for_its_prior(found).filter(|_| found.is_trusted()));
    let unidentifiable = &found.identifiability().unidentifiable;
    let rest_on_priors =
        unidentifiable.iter().filter(|combination| rests_on_priors(found, combination)).count();
    let parameters = counted(found.unknowns.len(), "parameter");
    let open = format!(
        "of the {parameters} cannot be identified: hold parameters or give them priors (see -v)"
    );
    let is = if rest_on_priors == 1 { "is" } else { "are" };
    let by_priors = format!("of the {parameters} {is} known from the priors alone (see -v)");
    let counts = [
        (unidentifiable.len() - rest_on_priors, "combination", open.as_str()),
        (rest_on_priors, "combination", by_priors.as_str()),
        (found.weak.len(), "combination", "determined too weakly"),
        (correlated(found).len(), "pair", "correlated by more than 0.9"),
    ];
    let counts = counts.into_iter().filter(|part| part.0 > 0);
    points.extend(counts.map(|(n, noun, what)| format!("{} {what}", counted(n, noun))));
    let active = found.active_constraints.iter().map(|active| active.words.as_str());
    let active: Vec<&str> = active.collect();
    points.extend((!active.is_empty()).then(|| {
        format!("{} at the limit: {}", counted(active.len(), "constraint"), active.join("; "))
    }));
    let is_open = |finding: &&Finding| finding.code == FindingCode::NotToldApart;
    points.extend(found.findings.iter().filter(is_open).map(ToString::to_string));
    points
}
