//! Sentences about the outcome of a loop: its verdict, and the title of each cause. They claim no
//! more than the status of a cause allows.

use super::document::code;
use super::probability::{EVEN, percent};
use crate::quantity::format::{counted, number};
use crate::results::{FoundEffect, LoopResult, MAX_COEFFICIENTS, NamedEffect};
use crate::select::{Status, Verdict};

/// Probability of a law below which it is not named even as a candidate.
const LEAST_CANDIDATE: f64 = 0.005;

/// States after how many rounds a search ended early.
pub fn interrupted(rounds: usize) -> String {
    let rounds = match rounds {
        0 => "before the first round was done".to_owned(),
        rounds => format!("after {}", counted(rounds, "round")),
    };
    format!("interrupted {rounds}: there may be more to find")
}

/// States the outcome in one to three sentences; `takes_less` says that the fit took a smaller σ
/// than the declared one.
pub(super) fn verdict(result: &LoopResult, takes_less: bool) -> String {
    let rounds = result.steps.len();
    let end = if result.interrupted {
        format!("Search {}. ", interrupted(rounds))
    } else {
        String::new()
    };
    if result.interrupted && rounds == 0 && result.effects.is_empty() {
        return end
            + "The residual was not examined to the end: no cause is named, and none is ruled out.";
    }
    let first = if result.before.misfit_carried_by.is_some() {
        "Check the influential rows first: wrong rows hide causes, and a cause that acts in them alone looks like wrong rows. "
    } else {
        ""
    };
    end + first + &outcome(result, takes_less)
}

/// States how many effects were found, and how many causes are probable.
pub(super) fn counts(result: &LoopResult) -> String {
    let found = result.with_status(Status::Found).count();
    match causes(result).filter(|cause| cause.is_doubted()).count() {
        0 => found.to_string(),
        doubted => format!("{found}, and {doubted} probable"),
    }
}

/// Iterates over the effects that stand for a cause by themselves.
pub(super) fn causes(result: &LoopResult) -> impl Iterator<Item = &FoundEffect> {
    result.effects.iter().filter(|found| !found.is_only_with_others())
}

fn outcome(result: &LoopResult, takes_less: bool) -> String {
    if !result.trusted {
        return "No cause is claimed, because the fit is not to be trusted. Correct first what the warnings name.".to_owned();
    }
    let found = found(result);
    if let (Verdict::Unexplained, Some(size)) = (result.verdict, result.size_alone()) {
        // An interrupted search has not looked everywhere.
        let seen = if result.interrupted { "" } else { ", and no structure is seen in it" };
        return format!(
            "Unexplained: the residual is {} × the declared σ{seen}. {found}.",
            number(size, 1)
        );
    }
    let is_structured = result.unexplained.is_some();
    match (result.verdict, result.tested) {
        (Verdict::Unexplained, _) if is_structured => {
            format!("Unexplained: structure is left in the residual. {found}.")
        }
        (_, false) => format!("{found}; structure in the residual could not be tested."),
        (Verdict::Unexplained, true) => {
            let noise = if result.with_status(Status::Contradicted).next().is_some() {
                ""
            } else {
                " With what is in the model, the residual looks like noise."
            };
            format!("Unexplained: {}.{noise}", lower(&found))
        }
        (Verdict::Explained, true) => {
            format!("Explained: {}, and what is left looks like noise.", lower(&found))
        }
        (Verdict::NothingFound, true) => {
            if let Some(ratio) = result.overstated_sigma() {
                nothing_below(ratio, takes_less)
            } else {
                let apart = match result.set_aside.len() {
                    0 => String::new(),
                    rows => format!("apart from {} with gross errors, ", counted(rows, "pose")),
                };
                format!("Nothing found: {apart}what the declared problem leaves looks like noise.")
            }
        }
    }
}

/// States what was found, in a sentence without its end.
fn found(result: &LoopResult) -> String {
    let found: Vec<&FoundEffect> = result.with_status(Status::Found).collect();
    let doubted: Vec<&FoundEffect> = causes(result).filter(|cause| cause.is_doubted()).collect();
    let first = match found.as_slice() {
        [] => "No effect was found".to_owned(),
        [effect] => format!("One effect was found ({})", effect.effect.description),
        effects => format!("{} effects were found", effects.len()),
    };
    let words = match (doubted.as_slice(), found.is_empty()) {
        ([], _) => first,
        ([cause], true) => match doubt(cause) {
            (true, words) => format!("No effect is sure; the most probable one is {words}"),
            (false, words) => format!("No effect is sure; something acts, {words}"),
        },
        ([cause], false) => match doubt(cause) {
            (true, words) => format!("{first}; one more is probable: {words}"),
            (false, words) => format!("{first}; something more acts, {words}"),
        },
        (causes, true) => {
            format!("No effect is sure; {} are probable, their laws not sure", causes.len())
        }
        (causes, false) => {
            format!("{first}; {} more are probable, their laws not sure", causes.len())
        }
    };
    let contradicted: Vec<&FoundEffect> = result.with_status(Status::Contradicted).collect();
    match contradicted.as_slice() {
        [] => words,
        [one] => {
            format!("{words}; data outside the fit contradict {}", one.effect.description)
        }
        several => format!("{words}; data outside the fit contradict {} causes", several.len()),
    }
}

/// States that nothing was found although the residual is smaller than the declared σ by this
/// ratio.
fn nothing_below(ratio: f64, takes_less: bool) -> String {
    let consequence = if takes_less {
        ", which is too large; causes are judged by the scatter of the residual instead"
    } else {
        "; causes are judged by that σ, and smaller ones may be missed"
    };
    format!(
        "Nothing found: the residual is {} × the declared σ{consequence}.",
        number(ratio, if ratio < 0.1 { 3 } else { 2 })
    )
}

/// Describes a cause whose law is not sure, with probabilities and the best alternative; true if
/// the words name what is most probable.
fn doubt(cause: &FoundEffect) -> (bool, String) {
    let words = &cause.effect.description;
    let Some(claims) = &cause.claims else { return (true, words.clone()) };
    let rival = cause.alternatives.first().map(|other| other.description.as_str());
    let place = (claims.place.value.as_str(), claims.place.probability);
    doubted(place, claims.law.probability, words, rival)
}

fn doubted((place, at): (&str, f64), law: f64, words: &str, rival: Option<&str>) -> (bool, String) {
    let or_else = rival.map_or_else(String::new, |rival| format!(", or else {rival}"));
    let there = format!("an error at {place} ({}) whose law is not known", percent(at));
    let candidate = format!("one candidate law: {words} ({}){or_else}", percent(law));
    match law {
        EVEN.. => (true, format!("{words} ({}){or_else}", percent(law))),
        LEAST_CANDIDATE.. if at >= EVEN => (true, format!("{there}; {candidate}")),
        LEAST_CANDIDATE.. => (false, candidate),
        _ if at >= EVEN => (true, there),
        _ => (false, "neither its place nor its law known".to_owned()),
    }
}

/// Describes an effect, followed by its declaration unless that lists many orders.
pub(super) fn declared(effect: &NamedEffect) -> String {
    match effect.effect.harmonic_orders() {
        Some(orders) if orders.len() > MAX_COEFFICIENTS => effect.description.clone(),
        _ => format!("{}: {}", effect.description, code(&effect.declaration)),
    }
}

/// Returns the title of a cause: its status, what the status allows to claim, and the line that
/// declares it.
pub(super) fn title(found: &FoundEffect) -> String {
    let words = declared(&found.effect);
    let claim = match (found.status, &found.claims) {
        (Status::Probable, Some(claims)) => {
            format!("{words} ({})", percent(claims.law.probability))
        }
        (Status::Located, Some(claims)) => {
            let place = (claims.place.value.as_str(), claims.place.probability);
            located(place, claims.law.probability, &words)
        }
        (Status::Located, None) => {
            format!("only together with the others, not significant by itself; {words}")
        }
        _ => words,
    };
    format!("{}: {claim}", found.status.as_str())
}

/// Returns what may be claimed of a cause whose law is not known.
fn located((place, at): (&str, f64), law: f64, words: &str) -> String {
    let place = if at >= EVEN { place } else { "place" };
    let law_not_known = if at >= EVEN { "law not known" } else { "and law not known" };
    let separator = if at >= EVEN { ", " } else { " " };
    match law {
        LEAST_CANDIDATE.. => format!("{place}{separator}{law_not_known}; one candidate: {words}"),
        _ => format!("{place}{separator}{law_not_known}"),
    }
}

/// Names the effect that stands in the model for a cause whose title names no law.
pub(super) fn stand_in(found: &FoundEffect) -> Option<String> {
    let law = found.claims.as_ref()?.law.probability;
    (law < LEAST_CANDIDATE && found.status != Status::Contradicted)
        .then(|| format!("the model represents it by: {}", declared(&found.effect)))
}

fn lower(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentences_claim_no_more_than_the_probabilities_allow() {
        let words = |at: f64, law: f64| doubted(("joint 2", at), law, "a wave", Some("a drift"));
        let title = |at: f64, law: f64| located(("joint 2", at), law, "a wave");
        assert_eq!(words(0.99, 0.78), (true, "a wave (78 %), or else a drift".to_owned()));
        let candidate = "one candidate law: a wave (39 %), or else a drift";
        let there = "an error at joint 2 (80 %) whose law is not known";
        assert_eq!(words(0.8, 0.39), (true, format!("{there}; {candidate}")));
        assert_eq!(title(0.8, 0.39), "joint 2, law not known; one candidate: a wave");
        assert_eq!(words(0.45, 0.39), (false, candidate.to_owned()));
        assert_eq!(title(0.45, 0.39), "place and law not known; one candidate: a wave");
        assert_eq!(title(0.999, 0.0), "joint 2, law not known");
        assert!(!words(0.2, 0.001).1.contains("wave") && !title(0.2, 0.001).contains("wave"));
    }

    #[test]
    fn an_overstated_sigma_is_said_with_its_number() {
        let (near, far) = (nothing_below(0.94, false), nothing_below(0.012, true));
        assert!(near.starts_with("Nothing found: the residual is 0.94 × the declared σ; causes"));
        let expected = "Nothing found: the residual is 0.012 × the declared σ, which is too large;";
        assert!(far.starts_with(expected), "{far}");
    }
}
