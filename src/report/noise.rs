//! Sentences about outliers, influential rows, the size of the residual relative to the declared σ,
//! and whether a fit is to be trusted.

use std::path::Path;

use serde_json::Value;

use super::document::{Block, first_of, joined};
use super::errors::{brief, row_noun, test_rows_word, unit, with_unit};
use super::prior::contradiction;
use super::remainder::{HELD_OUT, PredictionAccuracy, exceed};
use crate::fit::{FindingCode, Identification, Noise, Outlier, TypicalScatter, size_of_kind};
use crate::problem::Problem;
use crate::quantity::format::{counted, decimals, mm, number};
use crate::results::{ResidualSize, Trust, exceeds_noise, raised_variance, rows_in};

/// Maximum number of outliers that a text lists.
const MAX_SHOWN_OUTLIERS: usize = 20;
/// Maximum number of influential rows that a text names.
const MAX_SHOWN_INFLUENTIAL: usize = 3;
/// Largest χ²/ν that noise alone gives in 99.9 % of cases, up to which a χ²/ν within the interval
/// shows that the model explains the data.
const MAX_TELLING_CHANCE: f64 = 1.8;
/// First word on a fit without errors that something contradicts beyond chance.
const CONVERGED: &str = "Converged";
/// Name of the file that contains all outliers and influential rows.
const RESULT_FILE: &str = "estimate.json";

/// States the size of the residual relative to the declared noise.
pub(super) fn noise(problem: &Problem, found: &Identification) -> String {
    if let Some(words) = raised_sigma(found) {
        return words;
    }
    match ResidualSize::of(found) {
        ResidualSize::Undeclared(sigma) => format!(
            "No σ is declared; the scatter of the residual is {} per coordinate, model errors \
             included.",
            with_unit(&found.fitted.identification, sigma)
        ),
        ResidualSize::Unknown => "No σ is declared, and the fit leaves no degree of freedom to \
                                  estimate it: there are no standard errors."
            .to_owned(),
        ResidualSize::TooFewPoses => {
            "There are too few different poses to judge the declared σ, or the model.".to_owned()
        }
        ResidualSize::TooFewRows => {
            "There are too few measurements to judge the declared σ.".to_owned()
        }
        ResidualSize::Contradicted(chi2) => format!(
            "Reduced χ² (χ²/ν) is {}; {}.\n{}",
            format_chi2(chi2),
            expected_interval(found),
            other_sigma(problem, found)
        ),
        ResidualSize::Expected(chi2) => {
            let (aside, of) = found
                .finding(FindingCode::RowsSetAside)
                .and_then(|finding| Some((finding.value("rows")?.as_u64()?, finding.number("of")?)))
                .map_or((0, 0.0), |(rows, of)| (rows, of));
            let explained = if aside > 0 {
                let kept = of - aside as f64;
                format!(
                    "the {kept:.0} rows that the robust loss keeps scatter as the declared σ says; \
                     {aside} of {of:.0} rows are set aside"
                )
            } else if found.chance.is_some_and(|(_, high)| high > MAX_TELLING_CHANCE) {
                "so few measurements do not contradict the declared σ".to_owned()
            } else {
                "the model explains the data to the declared σ".to_owned()
            };
            let holds = |(low, high): &(f64, f64)| (*low..=*high).contains(&chi2);
            let within = found.chance.filter(holds).map_or_else(String::new, |(low, high)| {
                format!(", within {} to {} (99.9 %)", number(low, 2), number(high, 2))
            });
            format!("Reduced χ² (χ²/ν) is {}{within}: {explained}.", number(chi2, 2))
        }
        ResidualSize::Unclear(chi2) => {
            let (size, what, are) = if chi2 > 1.0 {
                ("larger", "explains", "small")
            } else {
                ("smaller", "predicts", "large")
            };
            let reason = if !found.is_trusted() {
                "because another σ would not mend what the warnings name".to_owned()
            } else if found.prior.is_some() {
                format!("which a fit with a prior does not change: they are too {are}")
            } else {
                "because no other σ is clearly more probable".to_owned()
            };
            format!(
                "Reduced χ² (χ²/ν) is {}; {}: the residual is {size} than the declared σ {what}.\n\
                 Standard errors assume the declared σ, {reason}.",
                format_chi2(chi2),
                expected_interval(found),
            )
        }
    }
}

/// States the size of the residual if the fit took a larger σ than the declared one because of its
/// prior; `None` if it did not.
fn raised_sigma(found: &Identification) -> Option<String> {
    let (chi2, ratio) = (found.reduced_chi2?, raised_variance(found)?);
    let reason = if found.prior.as_ref().is_some_and(|prior| prior.has_raised_sigma) {
        "the new rows contradict the prior"
    } else {
        "the earlier estimate was fitted with it"
    };
    Some(format!(
        "Reduced χ² (χ²/ν) is {} with the declared σ and {} with the σ that the fit assumes; {}.\n\
         Fit and standard errors assume {} × the declared σ, because {reason}.",
        format_chi2(chi2 * ratio),
        format_chi2(chi2),
        expected_interval(found),
        number(ratio.sqrt(), 1)
    ))
}

/// States the interval that contains χ²/ν with 99.9 % probability if only noise is left.
pub(super) fn expected_interval(found: &Identification) -> String {
    match found.chance {
        Some((low, high)) => format!(
            "expected {} to {} (99.9 %) if only noise is left",
            number(low, 2),
            number(high, 2)
        ),
        None => "1 is expected if only noise is left".to_owned(),
    }
}

/// States the σ that the fit assumed because residuals and priors contradict the declared one, and
/// the probable cause.
fn other_sigma(problem: &Problem, found: &Identification) -> String {
    let misses = [FindingCode::OrientationMisfit, FindingCode::MissesMeasurements];
    if found.names_mistake() || misses.iter().any(|code| found.has(*code)) {
        return "Standard errors mean nothing before the mistake that the warnings name is \
                corrected."
            .to_owned();
    }
    let errors = &found.fitted.identification;
    let sigma = problem.data.position_sigma.filter(|_| errors.kind == "position");
    let declared = sigma.map_or_else(String::new, |sigma| {
        format!(" ({} mm)", mm(sigma, decimals(sigma * 1e3, 12).max(4)))
    });
    let is_larger = found.noise_factor > 1.0;
    let size = number(found.noise_factor.sqrt(), if is_larger { 1 } else { 3 });
    // Several kinds of rows may have several units: one factor holds for all of them.
    let assumed = if found.kinds.is_empty() {
        format!("σ = {} {}", brief(errors, found.sigma_taken), unit(errors))
    } else {
        format!("every declared σ times {size}")
    };
    let cause = match &found.influential_rows {
        _ if !is_larger && found.reduced_chi2.is_some_and(|chi2| chi2 > 1.0) => {
            "but χ² is too large: some rows, or one kind of rows, fit badly; -v lists them"
                .to_owned()
        }
        _ if is_larger && found.has(FindingCode::PriorContradicted) => {
            "because of the prior whose σ the data refute".to_owned()
        }
        _ if !is_larger => "so the declared σ is too large".to_owned(),
        Some(influential) => {
            let cause = match influential.is_one() {
                _ if others_agree_with_sigma(found) => "with gross errors",
                true => "that stands out from the others",
                false => "that stand out from the others",
            };
            let rows = influential.counted(row_noun(found));
            format!("mostly because of {rows} {cause}")
        }
        None if rests_on_limits(found) => {
            "so the declared σ is too small, a limit is wrong, or the model lacks something"
                .to_owned()
        }
        None => "so the declared σ is too small or the model lacks something".to_owned(),
    };
    format!(
        "The σ estimated from residuals and priors is {size} × the declared one{declared}, {cause}. Fit and standard errors assume \
         {assumed}."
    )
}

/// Returns true if a bound or a constraint holds a parameter of the fit.
fn rests_on_limits(found: &Identification) -> bool {
    !found.active_constraints.is_empty()
        || found.estimates.iter().any(|estimate| estimate.at_bound.is_some())
}

/// Formats χ²/ν with two decimals, or with two significant digits if it is small.
pub(super) fn format_chi2(chi2: f64) -> String {
    number(chi2, decimals(chi2, 6).clamp(2, 6))
}

/// Returns true if the declared σ explains the residual of the rows that are not influential. The
/// influential rows may then be called gross errors.
fn others_agree_with_sigma(found: &Identification) -> bool {
    found.influential_rows.as_ref().is_some_and(|influential| {
        let expected = influential.reduced_chi2.zip(found.chance);
        expected.is_some_and(|(chi2, (_, highest))| chi2 <= highest)
    })
}

/// Lists the rows whose residual is too large to be noise; `None` if there are none.
pub(super) fn outliers<'a>(problem: &Problem, found: &Identification) -> Option<Block<'a>> {
    let treatment = if problem.robust.is_some() {
        "the robust loss limits their influence; flexcal loop looks for a cause"
    } else {
        "they count in full; a section [robust] would limit them, flexcal loop looks for a cause"
    };
    let known_distances =
        found.outliers.iter().filter(|outlier| outlier.kind == "known distance").count();
    let (n, all) =
        (found.outliers.len(), rows_in(found, |errors| errors.identification) + known_distances);
    let point = |outlier: &Outlier| {
        let from = |size: f64, source: &str| {
            format!(" ({}, from {source})", size_of_kind(outlier.kind, size, 3))
        };
        let note = if outlier.kind == "known distance" { " (known distance)" } else { "" };
        format!(
            "{}{note}: {}, {} × the typical scatter{}",
            outlier.location,
            size_of_kind(outlier.kind, outlier.error.norm(), 3),
            number(outlier.distance, 1),
            match outlier.scatter {
                Some(_) if includes_orientation(found, outlier.kind) => {
                    " of position and orientation together".to_owned()
                }
                Some(TypicalScatter::Median(size)) => from(size, "the median"),
                Some(TypicalScatter::Declared(size)) => from(size, "the σ that the fit assumes"),
                None => String::new(),
            }
        )
    };
    let points = first_of(found.outliers.iter().map(point), MAX_SHOWN_OUTLIERS, RESULT_FILE);
    let is_influential = |outlier: &Outlier| {
        found.influential_rows.as_ref().is_none_or(|influential| {
            influential.rows.iter().any(|influential| influential.row == outlier.row)
        })
    };
    let noun = row_noun(found);
    let acts_in = if noun == "row" { "rows" } else { "poses" };
    let are_gross = others_agree_with_sigma(found) && found.outliers.iter().all(is_influential);
    let have = match (are_gross, n) {
        (true, 1) => "has a gross error".to_owned(),
        (true, _) => "have gross errors".to_owned(),
        (false, 1) => {
            format!(
                "stands out from the others: a gross error, or an effect that acts in few {acts_in}"
            )
        }
        (false, _) => {
            format!(
                "stand out from the others: gross errors, or an effect that acts in few {acts_in}"
            )
        }
    };
    let words = format!("{n} of {} {have} ({treatment}):", counted(all, noun));
    (n > 0).then_some(Block::Lines(words, points))
}

/// Returns true if the distance of an outlier of a kind includes its error of orientation, so that
/// the typical scatter is no length.
pub(super) fn includes_orientation(found: &Identification, kind: &str) -> bool {
    found.orientation.is_some() && kind == "position"
}

/// Names the influential rows and states the size of the residual without them; `None` if there are
/// none.
pub(super) fn influential_rows<'a>(found: &Identification) -> Option<Block<'a>> {
    let influential = found.influential_rows.as_ref()?;
    let (cause, them) = if influential.is_one() { ("causes", "it") } else { ("cause", "them") };
    let row = |row: &Outlier| {
        format!("{} ({})", row.location, size_of_kind(row.kind, row.error.norm(), 3))
    };
    let places = match influential.views.len() {
        0 => joined(influential.rows.iter().map(row), MAX_SHOWN_INFLUENTIAL, ", "),
        _ => format!(
            "{}, as if the arm had moved or the joints were of another image",
            joined(influential.places(), MAX_SHOWN_INFLUENTIAL, ", ")
        ),
    };
    let errors = &found.fitted.identification;
    let comparison = match (influential.reduced_chi2, found.reduced_chi2) {
        (Some(without), Some(with)) => {
            format!("χ²/ν is {} instead of {}", format_chi2(without), format_chi2(with))
        }
        _ => format!(
            "the scatter is {} instead of {}",
            with_unit(errors, influential.sigma_taken),
            with_unit(errors, found.sigma_taken)
        ),
    };
    Some(Block::Text(format!(
        "{} {cause} most of the residual: {places}. Without {them} {comparison}.",
        influential.counted(row_noun(found)),
    )))
}

/// States in one line what to do about influential rows, or about rows that a loop excluded from the
/// choice of effects and that spoil its fit; `None` if there are none. `problem` is the path of the
/// problem file.
pub fn influential_rows_advice(found: &Identification, problem: &Path) -> Option<String> {
    let excluded = found.finding(FindingCode::ExcludedRowsFitted);
    let rows: Vec<String> = if let Some(finding) = excluded {
        let place = |row: &Value| Some(format!("{}:{}", row["file"].as_str()?, row["line"]));
        finding.value("rows")?.as_array()?.iter().filter_map(place).collect()
    } else {
        let influential = found.influential_rows.as_ref()?;
        if !influential.views.is_empty() {
            let places = joined(influential.places(), MAX_SHOWN_INFLUENTIAL, ", ");
            let what = if influential.is_one() { "this view" } else { "these views" };
            return Some(format!("leave out {what}, or correct the joints there: {places}"));
        }
        influential.places()
    };
    let rows = joined(rows, MAX_SHOWN_INFLUENTIAL, ", ");
    Some(format!(
        "check {rows}; a section [robust] in {} would limit the influence of such rows",
        problem.display()
    ))
}

/// Returns the size of the residual as a fact of a headline, with the label `term`.
pub(super) fn residual_fact(term: &'static str, found: &Identification) -> (&'static str, String) {
    let size = match (found.noise, found.reduced_chi2) {
        (Noise::Declared, Some(chi2)) => format!("χ²/ν {}", format_chi2(chi2)),
        (Noise::Estimated(sigma), _) => {
            let of = &found.fitted.identification;
            format!("{} {} per coordinate", brief(of, sigma), unit(of))
        }
        _ => "cannot be judged".to_owned(),
    };
    (term, size)
}

/// Returns what contradicts a fit without errors or its predictions, for its headline: held-out rows that
/// the fit made worse, new rows against the prior, other held-out rows, and changes between rows.
pub(super) fn reservations(
    found: &Identification,
    accuracy: Option<&PredictionAccuracy>,
) -> Vec<String> {
    let worse = found.has(FindingCode::HeldOutNotBetter).then(|| {
        "the fit made held-out errors worse than those of the nominal arm, beyond chance".to_owned()
    });
    let prior = found.prior.as_ref().and_then(contradiction);
    let test = accuracy.and_then(|accuracy| accuracy.contradicted);
    let exceeding = test.map(|test| {
        let (beyond, of) = (test.beyond(), test.of);
        format!("{beyond} of {of} {HELD_OUT} {}, beyond chance", exceed(beyond))
    });
    let farther = found.has(FindingCode::HeldOutBeyondPrediction).then(|| {
        "held-out rows are farther from the prediction than the fit expects, beyond chance"
            .to_owned()
    });
    let uncertain = found
        .finding(FindingCode::HeldOutUncertain)
        .filter(|_| accuracy.and_then(|accuracy| accuracy.bound.as_ref()).is_none())
        .map(|finding| format!("{}, so more poses are needed", finding.text));
    let set_up = found.finding(FindingCode::SetUpUndecided).map(|finding| finding.text.clone());
    let outliers = found.finding(FindingCode::HeldOutOutliers).and_then(|finding| {
        let (rows, of) = (finding.count("rows")?, finding.count("of")?);
        let of = counted(of, &format!("held-out {}", row_noun(found)));
        let verb = if rows == 1 { "is" } else { "are" };
        Some(format!("{rows} of {of} {verb} too far off to be noise"))
    });
    let changed = found
        .has(FindingCode::RowsChanged)
        .then(|| "something changed between the rows (see the warnings)".to_owned());
    [worse, prior, exceeding.or(farther).or(outliers).or(uncertain), changed, set_up]
        .into_iter()
        .flatten()
        .collect()
}

/// States what of the fit is to be trusted, with what contradicts it, the held-out error before and
/// after it, and how much its residual exceeds the declared noise. A fit whose residual cannot
/// contradict it, because priors decide most of it, is not said to be trusted.
pub(super) fn outcome(found: &Identification, accuracy: Option<&PredictionAccuracy>) -> String {
    if let Some(reason) = found.first_error() {
        return format!("Not to be trusted: {reason}.");
    }
    let [before, fitted] = [&found.registered, &found.fitted].map(|errors| &errors.held_out);
    let corrected = accuracy.and_then(|accuracy| accuracy.corrected.as_ref());
    let after = corrected.unwrap_or(fitted);
    let reservations = reservations(found, accuracy);
    let unjudged = found.finding(FindingCode::PriorsDecide).and_then(|few| {
        Some(format!(
            "Not judged, because priors decide most of it ({} for {}, from {})",
            counted(few.count("coordinates")?, "coordinate"),
            counted(few.count("parameters")?, "parameter"),
            counted(few.count("poses")?, "different pose")
        ))
    });
    let larger = larger_residual(found, corrected.is_some()).filter(|_| unjudged.is_none());
    let reserved = if reservations.is_empty() {
        String::new()
    } else {
        format!(", but {}", reservations.join("; "))
    };
    let is_free = !found.unknowns.is_empty();
    let trust = Trust::of(found, accuracy.is_some_and(|of| of.contradicted.is_some()));
    // Where predictions alone are trusted, the verdict states the residual, other ones after it.
    let (alone, beside) = match larger {
        Some(larger) if is_free && trust == Trust::Predictions => (Some(larger), None),
        larger => (None, larger),
    };
    let judged = match &alone {
        Some(larger) => {
            let has_bound = accuracy.is_some_and(|accuracy| accuracy.bound.is_some());
            let what = if has_bound {
                "Predictions are trusted within the error bound below, single parameters are not"
            } else {
                "Converged, but single parameters are not to be trusted"
            };
            format!("{what}: {larger}, and parameters may have absorbed what the model lacks")
        }
        None => unjudged.unwrap_or_else(|| match reserved.as_str() {
            _ if !is_free => "No parameter is free, so that the nominal arm is judged".to_owned(),
            "" => "Trusted".to_owned(),
            _ => CONVERGED.to_owned(),
        }),
    };
    let left = beside.map_or_else(String::new, |words| format!(" Not fully explained: {words}."));
    if !(before.mean.norm.is_finite() && after.mean.norm.is_finite()) {
        return format!("{judged}{reserved}.{left}");
    }
    let without = if corrected.is_some() {
        format!(" ({} without the remainder)", with_unit(fitted, fitted.mean.norm))
    } else {
        String::new()
    };
    let [from, to] = [with_unit(before, before.mean.norm), with_unit(after, after.mean.norm)];
    let change = if from == to {
        format!("stays at {to}")
    } else if after.mean.norm < before.mean.norm {
        format!("falls from {from} to {to}")
    } else {
        format!("rises from {from} to {to}")
    };
    // A colon after "Trusted" makes the change of the error its reason; reservations have others.
    let the = if alone.is_none() && reserved.is_empty() { ": the" } else { ". The" };
    format!(
        "{judged}{reserved}{the} mean {} error {change}{without}.{left}",
        test_rows_word(&found.fitted).replace(' ', "-")
    )
}

/// States how much the residual, that without the remainder if `is_corrected`, exceeds the declared
/// σ; `None` if it does not exceed it.
fn larger_residual(found: &Identification, is_corrected: bool) -> Option<String> {
    let of = if is_corrected { " without the remainder" } else { "" };
    let times = |ratio: f64| format!("{} × the declared σ", number(ratio, 1));
    let size = if !exceeds_noise(found) {
        format!("the fit assumes {}", times(raised_variance(found)?.sqrt()))
    } else if found.noise_factor > 1.0 {
        format!("the residual{of} is {}", times(found.noise_factor.sqrt()))
    } else {
        format!("the residual{of} is larger than the declared σ explains")
    };
    Some(size)
}
