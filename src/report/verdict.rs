//! Sentences about the outcome of a loop: its verdict, and the title of each cause. No sentence
//! claims more than the status of the cause allows.

use std::fmt::Write as _;

use super::document::{MIN_PROBABLE, code, percent};
use crate::quantity::format::{counted, number};
use crate::results::{AlternativeEffect, FoundEffect, LoopResult, NamedEffect};
use crate::select::{Status, Verdict};

/// Smallest probability at which a text names a law as candidate for a cause.
const MIN_CANDIDATE_PROBABILITY: f64 = 0.005;

/// States after how many rounds a search was interrupted.
pub fn interrupted(rounds: usize) -> String {
    let rounds = match rounds {
        0 => "before the first round was done".to_owned(),
        rounds => format!("after {}", counted(rounds, "round")),
    };
    format!("interrupted {rounds}: there may be more to find")
}

/// States the outcome of the loop in one to three sentences. `assumes_smaller_sigma` is true if the
/// fit assumed a smaller σ than the declared one; `reservations` contradict a trusted fit.
pub(super) fn verdict(
    result: &LoopResult,
    assumes_smaller_sigma: bool,
    reservations: &[String],
) -> String {
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
    let caution = if result.is_misfit_of_rows() {
        "Check the influential rows first: wrong rows hide causes, and a cause that acts in them \
         alone looks like wrong rows. "
    } else {
        ""
    };
    let mut outcome = outcome(result, assumes_smaller_sigma, reservations);
    let is_settled = result.verdict != Verdict::Unexplained || result.is_probably_explained();
    if result.trusted && is_settled && !reservations.is_empty() {
        outcome.truncate(outcome.trim_end_matches('.').len());
        let _ = write!(outcome, ", but {}.", reservations.join("; "));
    }
    end + caution + &outcome
}

/// States how many effects were found, and how many other causes are uncertain: "2; 1 not sure".
pub(super) fn effect_counts(result: &LoopResult) -> String {
    let found = result.with_status(Status::Found).count();
    match causes(result).filter(|cause| cause.is_doubted()).count() {
        0 => found.to_string(),
        doubted => format!("{found}; {doubted} not sure"),
    }
}

/// Iterates over the effects except those that are significant only together with others.
pub(super) fn causes(result: &LoopResult) -> impl Iterator<Item = &FoundEffect> {
    result.effects.iter().filter(|found| !found.is_only_with_others())
}

/// States the outcome of a loop, apart from interruption and influential rows.
fn outcome(result: &LoopResult, assumes_smaller_sigma: bool, reservations: &[String]) -> String {
    if !result.trusted {
        return "No cause is claimed, because the fit is not to be trusted. Correct first what the warnings name.".to_owned();
    }
    let found = found_clause(result);
    if result.are_rows_apart() {
        let (rows, verb) = match result.set_aside.len() {
            1 => ("1 pose".to_owned(), "stands"),
            rows => (format!("{rows} poses"), "stand"),
        };
        return format!(
            "Unexplained: {rows} {verb} out (gross errors, or a cause acts there). {found}; the \
             other rows look like noise."
        );
    }
    if let (Verdict::Unexplained, Some(size)) = (result.verdict, result.size_alone()) {
        // An interrupted search cannot state that there is no structure.
        let seen = if result.interrupted { "" } else { ", and no structure is seen in it" };
        return format!(
            "Unexplained: the residual is {} × the declared σ{seen}. {found}.",
            number(size, 1)
        );
    }
    if result.is_probably_explained() {
        return probably_explained(result);
    }
    let is_structured = result.unexplained.is_some();
    match (result.verdict, result.tested) {
        (Verdict::Unexplained, _) if is_structured => {
            format!("Unexplained: structure is left in the residual. {found}.")
        }
        (_, false) => format!("{found}; structure in the residual could not be tested."),
        (Verdict::Unexplained, true) => {
            let failed = result.checks_after.iter().find(|test| test.failed);
            let noise = if result.is_contradicted() {
                let what = match reservations {
                    [] => "see the warnings".to_owned(),
                    said => said.join("; "),
                };
                let among = if causes(result).any(FoundEffect::is_doubted) {
                    ". Probabilities are among the laws tried, none of which explains these rows"
                } else {
                    ""
                };
                format!(" Rows contradict the fit: {what}{among}.")
            } else if result.with_status(Status::Contradicted).next().is_some() {
                String::new()
            } else if let Some(test) = failed {
                format!(
                    " With what is in the model, no structure is seen in the residual, but a \
                     residual test fails: {}.",
                    test.words
                )
            } else {
                match result.effects.len() {
                    0 => " The residual looks like noise, but no cause is sure.".to_owned(),
                    1 => " With it in the model the residual looks like noise, but which law acts \
                          is not sure."
                        .to_owned(),
                    _ => " With them in the model the residual looks like noise, but which laws \
                          act is not sure."
                        .to_owned(),
                }
            };
            format!("Unexplained: {}.{noise}", with_lower_initial(&found))
        }
        (Verdict::Explained, true) => {
            format!("Explained: {}, and the residual looks like noise.", with_lower_initial(&found))
        }
        (Verdict::NothingFound, true) => {
            if let Some(ratio) = result.overstated_sigma_ratio() {
                overstated_sigma_sentence(ratio, assumes_smaller_sigma)
            } else {
                let apart = match result.set_aside.len() {
                    0 => String::new(),
                    1 => "apart from 1 pose that stands out, ".to_owned(),
                    rows => format!("apart from {rows} poses that stand out, "),
                };
                format!(
                    "Nothing found: {apart}the residual of the declared problem looks like noise."
                )
            }
        }
    }
}

/// States the outcome if at least one law is probable and the residual looks like noise: each
/// probable cause with its probability and its most probable alternative.
fn probably_explained(result: &LoopResult) -> String {
    let cause = |found: &FoundEffect| {
        let law = found.claims.as_ref().map(|claims| percent(claims.law.probability));
        // Without a rival, the probability is low because few subsets of the poses show the effect.
        let again = found.stability.filter(|_| found.alternatives.is_empty()).map(|share| {
            let share = number(share * 100.0, 0);
            format!("; found in {share} % of refits on random 80 % subsets of the poses")
        });
        let again = again.unwrap_or_default();
        let law = law.filter(|_| !found.has_two_names());
        let law = law.map_or_else(String::new, |law| format!(" ({law}{again})"));
        let rival = found
            .alternatives
            .first()
            .map_or_else(String::new, |rival| format!(", or else {}", alternative(rival)));
        format!("{}{law}{rival}", found.effect.description)
    };
    let sure: Vec<&FoundEffect> = result.with_status(Status::Found).collect();
    let probable: Vec<String> = result.with_status(Status::Probable).map(cause).collect();
    let sure = match sure.as_slice() {
        [] => String::new(),
        [effect] => format!("{}; and probably ", effect.effect.description),
        effects => format!("{} effects were found, and probably ", effects.len()),
    };
    format!("Probably explained: {sure}{}. The residual looks like noise.", probable.join("; and "))
}

/// States which effects were found, are in doubt or are contradicted, without the full stop.
fn found_clause(result: &LoopResult) -> String {
    let found: Vec<&FoundEffect> = result.with_status(Status::Found).collect();
    let doubted: Vec<&FoundEffect> = causes(result).filter(|cause| cause.is_doubted()).collect();
    let mut words = match found.as_slice() {
        [] if doubted.is_empty() && result.interrupted => {
            "No effect has been found so far".to_owned()
        }
        [] if doubted.is_empty() => "No effect was found".to_owned(),
        [] => "No effect is sure".to_owned(),
        [effect] => format!("One effect was found ({})", effect.effect.description),
        effects => format!("{} effects were found", effects.len()),
    };
    let in_doubt = match doubted.as_slice() {
        [] => String::new(),
        [cause] => {
            let rival = cause.alternatives.first();
            // Without a place and a law, the alternatives are candidates and no rivals.
            let is_unknown = !has_place(cause) && stand_in_sentence(cause).is_some();
            let or_else = rival.map_or_else(String::new, |rival| {
                let rival = alternative(rival);
                if is_unknown {
                    format!("; the most probable candidate: {rival}")
                } else if is_less_probable(cause) {
                    format!(", more probable: {rival}")
                } else {
                    format!(", or else {rival}")
                }
            });
            format!("; {}{or_else}", claim(cause, &cause.effect.description))
        }
        [first, second] if doubted.iter().all(|cause| cause.status == Status::Probable) => {
            let [first, second] =
                [first, second].map(|cause| claim(cause, &cause.effect.description));
            format!("; {first}; {second}")
        }
        causes => {
            let probable = causes.iter().filter(|cause| cause.status == Status::Probable).count();
            let counts = [
                (probable, "is probable", "are probable"),
                (causes.len() - probable, "has no known law", "have no known law"),
            ];
            let counts = counts.into_iter().filter(|part| part.0 > 0).map(|(n, one, more)| {
                format!("{} {}", counted(n, "cause"), if n == 1 { one } else { more })
            });
            format!("; {}", counts.collect::<Vec<_>>().join(" and "))
        }
    };
    words += &in_doubt;
    let contradicted: Vec<&FoundEffect> = result.with_status(Status::Contradicted).collect();
    match contradicted.as_slice() {
        [] => words,
        [effect] => format!("{words}; {}", claim(effect, &effect.effect.description)),
        effects => format!("{words}; data outside the fit contradict {} causes", effects.len()),
    }
}

/// States that no effect was found, and that the residual is only `ratio` (below 1) times the
/// declared σ. `assumes_smaller_sigma` is true if the fit assumed a smaller σ.
fn overstated_sigma_sentence(ratio: f64, assumes_smaller_sigma: bool) -> String {
    let consequence = if assumes_smaller_sigma {
        ", which is too large; causes are judged by the scatter of the residual instead"
    } else {
        "; causes are judged by that σ, and smaller ones may be missed"
    };
    format!(
        "Nothing found: the residual is {} × the declared σ{consequence}.",
        number(ratio, if ratio < 0.1 { 3 } else { 2 })
    )
}

/// Describes an effect, followed by its declaration.
pub(super) fn declared(effect: &NamedEffect) -> String {
    format!("{}: {}", effect.description, code(&effect.declaration))
}

/// Describes an effect that may act instead of a found one, with its probability unless no pose
/// tells the two apart.
pub(super) fn alternative(other: &AlternativeEffect) -> String {
    if other.alike {
        return format!("{} (no pose tells the two apart)", other.effect.description);
    }
    let probability = percent(other.probability);
    let from = if other.is_undecided() {
        "; poses that are left out do not tell the two apart"
    } else {
        ""
    };
    format!("{} ({probability}{from})", other.effect.description)
}

/// Returns the title of a cause: its status unless that is `found`, what the data allow to claim
/// about it, and the line that declares it.
pub(super) fn title(found: &FoundEffect) -> String {
    match found.status {
        Status::Found => declared(&found.effect),
        _ => claim(found, &declared(&found.effect)),
    }
}

/// States the status of an effect and what the data allow to claim about it; `words` describe the
/// effect.
fn claim(found: &FoundEffect, words: &str) -> String {
    let status = found.status.as_str();
    match (found.status, &found.claims) {
        (Status::Probable, Some(claims)) if !found.has_two_names() => {
            format!("{status}: {words} ({})", percent(claims.law.probability))
        }
        (Status::Located, Some(claims)) => {
            let place = (claims.place.value.as_str(), claims.place.probability);
            let unknown = located(place, claims.law.probability, words);
            if has_place(found) { format!("{status}: {unknown}") } else { unknown }
        }
        (Status::Located, None) => {
            format!("{status}: only together with the others, not significant by itself; {words}")
        }
        _ => format!("{status}: {words}"),
    }
}

/// Returns true if the place of a cause is more probable than not, or if no evidence was evaluated.
pub(super) fn has_place(found: &FoundEffect) -> bool {
    found.claims.as_ref().is_none_or(|claims| claims.place.probability >= MIN_PROBABLE)
}

/// Returns true if the law of a cause is less probable than its first alternative.
pub(super) fn is_less_probable(found: &FoundEffect) -> bool {
    let law = found.claims.as_ref().map_or(1.0, |claims| claims.law.probability);
    found.alternatives.first().is_some_and(|rival| rival.probability > law)
}

/// States the claim about a cause whose law is unknown: its `place` with the probability `at`, and
/// a candidate law with the probability `law`. `words` describe that law.
fn located((place, at): (&str, f64), law: f64, words: &str) -> String {
    let unknown = if at >= MIN_PROBABLE {
        format!("{place} ({}), law not known", percent(at))
    } else {
        "structure of unknown place and law".to_owned()
    };
    match law {
        MIN_CANDIDATE_PROBABILITY.. => {
            format!("{unknown}; one candidate law: {words} ({})", percent(law))
        }
        _ => unknown,
    }
}

/// Names the effect by which the model represents a cause of unknown law; `None` if that effect is
/// at least a candidate for the law.
pub(super) fn stand_in_sentence(found: &FoundEffect) -> Option<String> {
    let law = found.claims.as_ref()?.law.probability;
    (law < MIN_CANDIDATE_PROBABILITY && found.status != Status::Contradicted)
        .then(|| format!("the model represents it by: {}", declared(&found.effect)))
}

/// Returns two remarks on `found`: what is not known of its cause, if the model only represents it
/// by some effect ([`unknown_part`]), and how sure the effect is, if its status is not
/// [`Status::Found`] ([`doubt`]).
pub(super) fn doubts(found: Option<&FoundEffect>) -> (Option<&'static str>, Option<String>) {
    (found.and_then(unknown_part), found.and_then(doubt))
}

/// States what is not known about a cause that the model only represents by some effect: its law, or
/// place and law. `None` if the effect is at least a candidate for the law.
fn unknown_part(found: &FoundEffect) -> Option<&'static str> {
    stand_in_sentence(found)?;
    Some(if has_place(found) { "The law is not known" } else { "Neither place nor law is known" })
}

/// States how sure an effect is that was not found; `None` for one that was.
fn doubt(found: &FoundEffect) -> Option<String> {
    let law = found.claims.as_ref().map(|claims| percent(claims.law.probability));
    let law = law.map_or_else(String::new, |law| format!(" ({law})"));
    Some(match found.status {
        Status::Found => return None,
        Status::Probable => format!("Probable{law}, not sure"),
        Status::Located => format!("A candidate{law}, not sure"),
        Status::Contradicted => "Contradicted by data outside the fit".to_owned(),
    })
}

/// Returns the text with its first letter in lower case.
fn with_lower_initial(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentences_claim_no_more_than_the_probabilities_allow() {
        let words = |at: f64, law: f64| located(("joint 2", at), law, "a wave");
        let candidate = "; one candidate law: a wave (39 %)";
        assert_eq!(words(0.8, 0.39), format!("joint 2 (80 %), law not known{candidate}"));
        assert_eq!(words(0.45, 0.39), format!("structure of unknown place and law{candidate}"));
        assert_eq!(words(0.999, 0.0), "joint 2 (over 99 %), law not known");
        assert_eq!(words(0.2, 0.001), "structure of unknown place and law");
    }

    #[test]
    fn an_overstated_sigma_is_said_with_its_number() {
        let (near, far) =
            (overstated_sigma_sentence(0.94, false), overstated_sigma_sentence(0.012, true));
        assert!(near.starts_with("Nothing found: the residual is 0.94 × the declared σ; causes"));
        let expected = "Nothing found: the residual is 0.012 × the declared σ, which is too large;";
        assert!(far.starts_with(expected), "{far}");
    }
}
