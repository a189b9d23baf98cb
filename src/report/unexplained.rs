//! Sentences of the command `loop` about structure whose law is unknown.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::document::{MIN_PROBABLE, code, percent};
use crate::fit::{Identification, Noise};
use crate::model::effect::NO_REFERENCE;
use crate::model::parameter::are_all_fixed;
use crate::problem::{Effect, JointKind, Problem};
use crate::quantity::format::{number, p_value};
use crate::residual_tests::Covariate;
use crate::results::{LoopResult, Structure, Summary, at_place};
use crate::select::{ClosedLoop, Correction, HELD_FIXED, HypothesisKind, REFUSED, Status};

/// Returns the empirical correction of structure without a law; `None` if none was accepted.
fn correction(closure: &ClosedLoop) -> Option<&Correction> {
    closure.unexplained.iter().find_map(|left| left.correction.as_ref())
}

/// Returns the reason why an effect was not tried. If [parameters] holds the effect's parameters
/// fixed, that is the reason, even if a reference temperature is missing too.
fn reason_untried(problem: &Problem, (effect, reason): &(Effect, &'static str)) -> &'static str {
    let is_held = *reason == NO_REFERENCE && are_all_fixed(problem, &effect.parameters(problem));
    if is_held { HELD_FIXED } else { reason }
}

/// Lists what the problem should declare before the causes are interpreted: a reference
/// temperature, masses, σ, or a wider limit.
pub(super) fn to_declare(
    problem: &Problem,
    closure: &ClosedLoop,
    result: &LoopResult,
) -> Vec<String> {
    let mut declarations = Vec::new();
    if lacks_masses(result) {
        declarations.push(format!(
            "Declare the masses: gravity acts, and the problem declares none. Give each link {} and \
             {} in {}, and each compliant joint or link its stiffness or {}. Rough guesses of unknown \
             masses will do for predictions, because fitted compliances make up for them; which part \
             gives way is then less sure than stated.",
            code("mass_kg"),
            code("com_m"),
            code("[[joint.body]]"),
            code("joint-compliance"),
        ));
    }
    if closure
        .before
        .untestable
        .iter()
        .any(|untested| reason_untried(problem, untested) == NO_REFERENCE)
    {
        declarations.push(format!(
            "Declare {} in [data], the temperature at which the arm is as declared; the mean of the column will do, because fitted parameters make \
             up for it. Without it no law of the measured temperatures was tried.",
            code("reference_temperature_C")
        ));
    }
    declarations.extend(missing_sigma(&closure.before.fit));
    declarations.extend(missing_sides(closure));
    let limits = result.structures().filter_map(|left| {
        let probability = left.claims.as_ref().map_or(0.0, |claims| claims.law.probability);
        Some((left.limit.as_deref()?, probability))
    });
    let wrong_limits = limits.filter(|(_, probability)| *probability >= MIN_PROBABLE);
    declarations.extend(wrong_limits.map(|(limit, probability)| {
        format!(
            "Check the limit {limit}, at which the fit stops: with probability {} it is wrong, or it restrains a parameter that stands \
             in for something the model lacks. Widen it if it may be wrong.",
            percent(probability)
        )
    }));
    declarations
}

/// Returns the advice to record directions of approach, if the law of an effect that depends on
/// them is not sure and the rows lack them; `None` otherwise.
fn missing_sides(closure: &ClosedLoop) -> Option<String> {
    let unsure = closure.effects.iter().filter(|found| found.status == Status::Located);
    let unsure = unsure.filter(|_| !closure.after.has_approach);
    let joints: BTreeSet<usize> = unsure.flat_map(|found| found.effect.sided_joints()).collect();
    let columns: Vec<String> =
        joints.iter().map(|joint| code(&format!("approach{}", joint + 1))).collect();
    (!columns.is_empty()).then(|| {
        format!(
            "Add to the table {} (1, −1, or 0 where it is unknown), the direction in which the joint last moved before the pose: it \
             tells play from friction. A joint table with every stop of the arm, measured or not, gives it, too.",
            columns.join(", ")
        )
    })
}

/// Describes the places of all structure whose law is unknown, with their probabilities; each place
/// once.
pub(super) fn structure_places(result: &LoopResult) -> Vec<String> {
    let mut places: Vec<(&str, String)> = Vec::new();
    for left in result.structures() {
        if places.iter().all(|(place, _)| *place != left.place) {
            let claims = left.claims.as_ref();
            let mut words = at_place(&left.place);
            if let Some(claims) = claims {
                let _ = write!(words, ", probability {}", percent(claims.place.probability));
            }
            if let (Some(limit), Some(claims)) = (&left.limit, claims) {
                let _ = write!(
                    words,
                    "; the limit {limit} is involved, probability {}",
                    percent(claims.law.probability)
                );
            }
            places.push((&left.place, words));
        }
    }
    places.into_iter().map(|(_, words)| words).collect()
}

/// Describes all structure whose law is unknown, its correction, and effects that were not tried,
/// one sentence each. Empty if there is no such structure.
pub(super) fn structure_sentences(
    problem: &Problem,
    closure: &ClosedLoop,
    result: &LoopResult,
) -> Vec<String> {
    if result.unexplained.is_none() {
        return Vec::new();
    }
    if let Some(size) = result.size_alone() {
        return vec![format!(
            "Only the size of the residual is significant ({} × the declared σ). The declared σ may be too small, \
             some rows may have gross errors, or a cause may act that these poses do not locate.",
            number(size, 1)
        )];
    }
    let mut sentences: Vec<String> = Vec::new();
    for words in result.structures().map(structure_sentence) {
        if !sentences.contains(&words) {
            sentences.push(words);
        }
    }
    // If all structure is due to wrong limits, the sentences about laws do not apply. A remainder
    // corrects structure with a law that is not sure.
    let has_law =
        |left: &Structure| left.claims.as_ref().is_some_and(|claims| claims.law.value.is_some());
    if result.structures().all(|left| left.limit.is_some() || has_law(left)) {
        return sentences;
    }
    let mut catalogue =
        "No effect of the catalogue explains it better than a function of unknown law".to_owned();
    for (why, words) in [
        (HELD_FIXED, "[parameters] holds them fixed"),
        (REFUSED, "[parameters] gives them another unit"),
        (NO_REFERENCE, NO_REFERENCE),
    ] {
        match closure
            .before
            .untestable
            .iter()
            .filter(|untested| reason_untried(problem, untested) == why)
            .count()
        {
            0 => {}
            1 => {
                let words = words.replace("them", "it");
                _ = write!(catalogue, "; one was not tried because {words}");
            }
            count => _ = write!(catalogue, "; {count} were not tried because {words}"),
        }
    }
    sentences.push(catalogue + ".");
    match correction(closure) {
        None => sentences.push(no_correction(closure).to_owned()),
        Some(correction) => sentences.extend(correction_sentences(problem, closure, correction)),
    }
    sentences
}

/// States why no empirical correction is given: it was not tried, or it gains too little.
fn no_correction(closure: &ClosedLoop) -> &'static str {
    let kinds =
        || closure.unexplained.iter().filter_map(|left| Some(&left.claims.as_ref()?.law.0.kind));
    let is_function = |kind: &&HypothesisKind| {
        !matches!(kind, HypothesisKind::PerPose | HypothesisKind::Limit(_))
    };
    if kinds().next().is_none() {
        "No smooth correction was tried, because the place of the structure is not known."
    } else if kinds().find(is_function).is_none() {
        "No smooth correction was tried, because an error that varies from pose to pose cannot be \
         predicted."
    } else if !closure.after.is_trusted() {
        "No smooth correction was tried, because the fit is not to be trusted."
    } else if closure.after.fitted.is_left_out {
        "No smooth correction was tried, because no poses are held out to judge it."
    } else {
        "No smooth correction of this structure is given: none could be fitted that reduces the \
         error of left-out poses by 5 % or more."
    }
}

/// Returns true if the loop found deflections under weights that the problem does not declare.
pub(crate) fn lacks_masses(result: &LoopResult) -> bool {
    result.structures().any(is_sag)
}

/// Returns true if the structure is the deflection under a weight that is not declared.
fn is_sag(structure: &Structure) -> bool {
    structure.law.as_deref() == Some("sag")
}

/// Describes one structure: its place, the quantities that it depends on, and their probabilities.
fn structure_sentence(structure: &Structure) -> String {
    let (place, inputs) = (&structure.place, structure.depends_on.join(", "));
    let Some(claims) = &structure.claims else {
        let inputs = if inputs.is_empty() { inputs } else { format!(", dependent on {inputs}") };
        return format!(
            "Structure is left {}{inputs} (p {}).",
            at_place(place),
            p_value(structure.p_value)
        );
    };
    let chance = format!(
        "if only noise were left, such structure would have p at most {}",
        p_value(structure.p_value)
    );
    let law = percent(claims.law.probability);
    if let Some(limit) = &structure.limit {
        return format!(
            "The limit {limit}, which is active, is wrong, or it restrains a parameter that stands in for something the model lacks: \
             probability {law} ({chance})."
        );
    }
    if is_sag(structure) {
        let what = if place == "arm" { "the arm" } else { place };
        return format!("Undeclared weight deflects {what}: probability {law} ({chance}).");
    }
    let at = percent(claims.place.probability);
    if claims.law.value.is_some() {
        return format!(
            "An error acts {} (probability {at}); its law is not sure. The most probable one \
             tried has a probability of {law}: {}.",
            at_place(place),
            claims.description
        );
    }
    if inputs.is_empty() {
        return format!(
            "An error acts {} (probability {at}); its inputs and its law are not known ({chance}).",
            at_place(place)
        );
    }
    format!(
        "An error acts {} (probability {at}) and depends on {inputs} (probability {}); its law is \
         not known ({chance}).",
        at_place(place),
        percent(claims.depends_on.probability)
    )
}

/// States the errors without and with an empirical correction, and the ranges of its inputs in
/// which it is valid.
fn correction_sentences(
    problem: &Problem,
    closure: &ClosedLoop,
    correction: &Correction,
) -> Vec<String> {
    let Correction { ranges, beyond, cross_validated: (without, with), held_out, .. } = correction;
    let ([mean, rms, _], unit) = Summary::of(held_out).norms();
    let ([mean_before, rms_before, _], _) = Summary::of(&closure.after.fitted.held_out).norms();
    let improves = if rms < rms_before { "improves" } else { "does not improve" };
    let [without, with] = [*without, *with].map(|error| held_out.in_unit(error));
    let show = |value: f64| number(value, 4);
    let mut sentences = vec![format!(
        "A smooth function fitted at this place alone {improves} the prediction of held-out poses: mean {} to {} {unit}, rms {} to {} \
         {unit}. For identification poses left out in turn the rms changes from {} to {} {unit}. The function shows how much of the \
         error lies there; it is not the remainder.",
        show(mean_before),
        show(mean),
        show(rms_before),
        show(rms),
        show(without),
        show(with),
    )];
    let range = |(covariate, range): &(Covariate, (f64, f64))| {
        let (factor, unit) = unit_of(problem, covariate);
        let [low, high] = [range.0, range.1].map(|value| number(value * factor, 2));
        format!("{covariate} from {low} to {high}{unit}")
    };
    let ranges: Vec<String> =
        ranges.iter().filter(|(of, _)| *of != Covariate::Position).map(range).collect();
    if !ranges.is_empty() {
        sentences.push(format!(
            "It is valid for {}, the range of the identification poses; outside, it keeps its last value ({beyond} of {} \
             held-out poses).",
            ranges.join(", "),
            held_out.n
        ));
    }
    sentences
}

/// Returns the factor from SI units to the displayed unit of a quantity, and that unit after a
/// space.
fn unit_of(problem: &Problem, covariate: &Covariate) -> (f64, &'static str) {
    match covariate {
        Covariate::Temperature => (1.0, " °C"),
        Covariate::Time => (1.0 / 3600.0, " h"),
        Covariate::Payload => (1.0, " kg"),
        Covariate::Hoist => (1.0, " N"),
        Covariate::Command(joint) if problem.joints[*joint].kind == JointKind::Prismatic => {
            (1e3, " mm")
        }
        Covariate::Command(_) => (180.0 / std::f64::consts::PI, " °"),
        _ => (1.0, ""),
    }
}

/// Asks for σ of the measurements, without which the size of the residual cannot be judged; `None` if
/// it is declared.
pub(super) fn missing_sigma(fit: &Identification) -> Option<String> {
    (fit.noise != Noise::Declared).then(|| {
        format!(
            "Declare {} in [data], 1 σ of a measured coordinate. Without it the size of the \
             residual cannot be judged.",
            code("position_sigma_mm")
        )
    })
}
