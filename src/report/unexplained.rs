//! What `loop` says of structure whose law is not known.

use std::fmt::Write as _;

use super::document::code;
use super::errors::{shown, with_unit};
use super::quantity::{number, p_value};
use super::trace::EVEN;
use crate::model::effect::NO_REFERENCE;
use crate::model::parameter::holds_all;
use crate::problem::{Effect, JointKind, Problem};
use crate::residual_tests::Covariate;
use crate::select::{
    Claims, ClosedLoop, Correction, HELD_FIXED, Hypothesis, HypothesisKind, REFUSED, Site,
    Unexplained,
};

/// The correction of structure without a law, if there is one.
pub(super) fn correction(closure: &ClosedLoop) -> Option<&Correction> {
    closure.unexplained.iter().find_map(|left| left.correction.as_ref())
}

/// The residual in units of the declared σ, where its size is all that is left to explain.
pub(super) fn size_alone(closure: &ClosedLoop) -> Option<f64> {
    let nowhere = closure.unexplained.iter().all(|left| left.site.is_none());
    closure.findings.size_alone().filter(|_| nowhere && !closure.unexplained.is_empty())
}

/// Where structure is.
pub(super) fn place(left: &Unexplained) -> String {
    left.site.map_or_else(|| "nowhere in particular".to_owned(), |part| part.to_string())
}

/// Why a law was not tried: what its rules say comes before what the problem lacks, for a reference
/// does not free what is held.
fn untried(problem: &Problem, (effect, reason): &(Effect, &'static str)) -> &'static str {
    let is_held = *reason == NO_REFERENCE && holds_all(problem, &effect.parameters(problem));
    if is_held { HELD_FIXED } else { reason }
}

/// What of the table was of no use, and what makes it so.
pub(super) fn not_looked_for(problem: &Problem, closure: &ClosedLoop) -> Option<String> {
    let needs = closure.before.untestable.iter().any(|own| untried(problem, own) == NO_REFERENCE);
    let why = "The table has temperatures, and no law of them was looked for, only functions without one: declare";
    needs.then(|| {
        format!("{why} {}, at which the arm is as declared.", code("reference_temperature_C"))
    })
}

/// Each place where structure is left whose law is not known, once for everything that would be
/// said of it alike.
pub(super) fn places(closure: &ClosedLoop) -> Vec<String> {
    let mut said: Vec<(String, String)> = Vec::new();
    for left in &closure.unexplained {
        let words = located(left);
        if !said.iter().any(|(known, _)| *known == words) {
            said.push((words, place(left)));
        }
    }
    said.into_iter().map(|(_, place)| place).collect()
}

/// Structure whose law is not known.
pub(super) fn unexplained(problem: &Problem, closure: &ClosedLoop) -> Vec<String> {
    if closure.unexplained.is_empty() {
        return Vec::new();
    }
    if let Some(size) = size_alone(closure) {
        return vec![format!(
            "Its size alone is beyond chance ({} × the declared σ): either σ is declared too small, or a cause is at work that these poses show \
             nowhere in particular.",
            number(size, 1)
        )];
    }
    // Functions of several forms may be left at one place.
    let mut sentences: Vec<String> = Vec::new();
    for words in closure.unexplained.iter().map(located) {
        if !sentences.contains(&words) {
            sentences.push(words);
        }
    }
    // A limit that is wrong is no function, and nothing was tried in its place.
    if closure.unexplained.iter().all(|left| wrong_limit(left).is_some()) {
        return sentences;
    }
    let mut catalogue =
        "No effect of the catalogue explains it better than a function without a law".to_owned();
    for (why, words) in [
        (HELD_FIXED, "[parameters] holds them fixed"),
        (REFUSED, "[parameters] speaks of them in another unit"),
        (NO_REFERENCE, NO_REFERENCE),
    ] {
        match closure.before.untestable.iter().filter(|own| untried(problem, own) == why).count() {
            0 => {}
            1 => {
                _ = write!(catalogue, "; one was not tried because {}", words.replace("them", "it"))
            }
            count => _ = write!(catalogue, "; {count} were not tried because {words}"),
        }
    }
    sentences.push(catalogue + ".");
    if closure.unexplained.iter().any(is_sag) {
        sentences.push(format!(
            "The problem declares no mass, and gravity acts: give each link its mass and its centre, {} with {} and {}, and what gives way its \
             stiffness or {}.",
            code("[[joint.body]]"),
            code("mass_kg"),
            code("com_m"),
            code("joint-compliance"),
        ));
    }
    match correction(closure) {
        None => {
            sentences.push(
                "No empirical correction would improve the prediction of poses that it was not fitted to.".to_owned(),
            );
        }
        Some(correction) => sentences.extend(corrected(problem, closure, correction)),
    }
    sentences
}

/// Whether what is left is sag under weight that is not declared.
fn is_sag(left: &Unexplained) -> bool {
    left.claims.as_ref().is_some_and(|claims| claims.law.0.kind == HypothesisKind::Sag)
}

/// The limit of the declared problem that is wrong, in words, by what is left, and how probable
/// that is.
fn wrong_limit(left: &Unexplained) -> Option<(&str, f64)> {
    let Claims {
        law: (Hypothesis { kind: HypothesisKind::Limit(limit), .. }, probability), ..
    } = left.claims.as_ref()?
    else {
        return None;
    };
    Some((limit, *probability))
}

/// Limits of the declared problem that are wrong, each with its probability, where that is more
/// than even.
pub(super) fn wrong_limits(closure: &ClosedLoop) -> impl Iterator<Item = (&str, f64)> {
    closure
        .unexplained
        .iter()
        .filter_map(wrong_limit)
        .filter(|(_, probability)| *probability >= EVEN)
}

/// One finding without a law.
fn located(left: &Unexplained) -> String {
    let on = left.depends_on.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let chance = format!("p-value at most {}", p_value(left.p_value));
    let of = |probability: f64| number(probability, 2);
    if let Some((limit, probability)) = wrong_limit(left) {
        return format!(
            "The limit {limit}, which holds the fit, is wrong or hides a cause, probability {} ({chance}).",
            of(probability)
        );
    }
    match (&left.claims, on.as_str()) {
        (Some(claims), "") => {
            format!(
                "Structure at {}, probability {}; what it depends on is not known ({chance}).",
                place(left),
                of(claims.place.1)
            )
        }
        (Some(claims), _) if is_sag(left) => format!(
            "Under weight that is not declared {} gives way, probability {} ({chance}).",
            if left.site == Some(Site::Arm) { "the arm".to_owned() } else { place(left) },
            of(claims.law.1)
        ),
        (Some(claims), on) => format!(
            "Structure at {}, probability {}, that depends on {on}, probability {}; its law is not known ({chance}).",
            place(left),
            of(claims.place.1),
            of(claims.depends_on.1)
        ),
        (None, "") => format!("Structure is left: {} (p {}).", place(left), p_value(left.p_value)),
        (None, on) => format!(
            "Structure is left: {}, depending on {on} (p {}).",
            place(left),
            p_value(left.p_value)
        ),
    }
}

/// What a correction does, and as far as it reaches.
fn corrected(problem: &Problem, closure: &ClosedLoop, correction: &Correction) -> Vec<String> {
    let before = closure.after.fitted.held_out;
    let Correction { ranges, beyond, cross_validated: (without, with), held_out, .. } = correction;
    let does = if held_out.rms.norm < before.rms.norm { "improves" } else { "does not improve" };
    let mut sentences = vec![format!(
        "A smooth correction there {does} the prediction of held-out poses: mean {} to {}, rms {} to {}; of identification poses \
         left out in turn rms {} to {}. It names no cause and is not part of {}.",
        shown(held_out, before.mean.norm),
        with_unit(held_out, held_out.mean.norm),
        shown(held_out, before.rms.norm),
        with_unit(held_out, held_out.rms.norm),
        shown(held_out, *without),
        with_unit(held_out, *with),
        code("problem.closed.toml"),
    )];
    let range = |(covariate, range): &(Covariate, (f64, f64))| {
        let (factor, unit) = unit(problem, covariate);
        format!(
            "{covariate} from {} to {}{unit}",
            number(range.0 * factor, 2),
            number(range.1 * factor, 2)
        )
    };
    let ranges: Vec<String> =
        ranges.iter().filter(|(of, _)| *of != Covariate::Position).map(range).collect();
    if !ranges.is_empty() {
        sentences.push(format!(
            "It holds for {}, as far as the identification poses reach; beyond, it keeps its last value ({beyond} of {} held-out poses).",
            ranges.join(", "),
            held_out.n
        ));
    }
    sentences
}

/// Factor from SI to the unit in which people read a quantity of the poses.
pub(super) fn unit(problem: &Problem, covariate: &Covariate) -> (f64, &'static str) {
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
