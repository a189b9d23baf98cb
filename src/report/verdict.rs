//! What a loop came to in a sentence or two, and what it found by name, no surer than it is known.

use super::effect;
use super::quantity::{counted, number};
use super::trace::{EVEN, percent};
use super::unexplained::size_alone;
use crate::select::{Claims, ClosedLoop, Found, Status, Verdict};

/// Probability of a law below which it is not even an example.
const NONE: f64 = 0.005;

/// That the search ended early.
pub fn interrupted(closure: &ClosedLoop) -> String {
    let rounds = match closure.rounds.len() {
        0 => "before the first round was done".to_owned(),
        rounds => format!("after {}", counted(rounds, "round")),
    };
    format!("interrupted {rounds}: there may be more to find")
}

/// The outcome in a sentence or two, after a word that it is not the last one where the search
/// ended early.
pub(super) fn verdict(closure: &ClosedLoop) -> String {
    let end = if closure.interrupted {
        format!("Search {}. ", interrupted(closure))
    } else {
        String::new()
    };
    if closure.interrupted && closure.rounds.is_empty() && closure.effects.is_empty() {
        return end
            + "What the residual holds was not weighed to the end: no cause is named, and none ruled out.";
    }
    let carried = closure.before.fit.influential_rows.is_some() && closure.after.is_trusted();
    let first = if carried {
        "Look first at the rows that carry the misfit: wrong ones hide causes, and a cause that acts in them alone looks like wrong ones. "
    } else {
        ""
    };
    end + first + &came_to(closure)
}

/// What was found, as surely as it is known.
struct Kinds<'a> {
    /// Effects by name.
    named: Vec<&'a Found>,
    /// Causes whose laws are not sure.
    such: Vec<&'a Found>,
    /// What data that took no part speak against.
    contradicted: Vec<&'a Found>,
}

impl<'a> Kinds<'a> {
    fn of(closure: &'a ClosedLoop) -> Self {
        let mut all = Self { named: Vec::new(), such: Vec::new(), contradicted: Vec::new() };
        for found in closure.effects.iter().filter(|found| !is_beside(found)) {
            let own = match found.status {
                Status::Contradicted => &mut all.contradicted,
                Status::Found => &mut all.named,
                Status::Probable | Status::Located => &mut all.such,
            };
            own.push(found);
        }
        all
    }
}

/// Returns true for an effect that is in the model only together with others: no evidence was
/// evaluated for it, and by itself it is not significant.
pub(super) fn is_beside(found: &Found) -> bool {
    found.claims.is_none() && found.status == Status::Located
}

/// How many effects were found, and how many causes whose laws are not sure.
pub(super) fn counts(closure: &ClosedLoop) -> String {
    let Kinds { named, such, .. } = Kinds::of(closure);
    if such.is_empty() {
        named.len().to_string()
    } else {
        format!("{}, and {} probable", named.len(), such.len())
    }
}

fn came_to(closure: &ClosedLoop) -> String {
    if !closure.after.is_trusted() {
        return "Nothing is claimed of causes: the fit is not to be trusted. Mend first what stands below.".to_owned();
    }
    let kinds = Kinds::of(closure);
    let found = found(closure, &kinds);
    if let (Verdict::Unexplained, Some(size)) = (closure.verdict, size_alone(closure)) {
        let size = number(size, 1);
        let beside = if closure.findings.outliers.is_empty() { "" } else { ", outliers left out," };
        // What was interrupted has not looked everywhere.
        let seen = if closure.interrupted { "" } else { ", and no structure is seen in it" };
        return format!(
            "Unexplained: the residual{beside} is {size} × the declared σ{seen}. {found}."
        );
    }
    match (closure.verdict, closure.findings.is_testable()) {
        (Verdict::Unexplained, _) if closure.unexplained.is_empty() => format!("Unexplained: {}.", lower(&found)),
        (Verdict::Unexplained, _) => format!("Unexplained: structure is left in the residual. {found}."),
        (_, false) => format!("{found}; whether structure is left could not be tested."),
        (Verdict::NothingFound, true) => closure.findings.overstated_sigma().map_or_else(
            || match closure.set_aside.len() {
                0 => "Nothing found: what the declared problem leaves looks like noise.".to_owned(),
                some => format!(
                    "Nothing found: but for {} too far off, what the declared problem leaves looks like noise.",
                    counted(some, "pose")
                ),
            },
            |ratio| nothing_below(ratio, closure.after.sigma_scale < 1.0),
        ),
        (Verdict::Explained, true) if kinds.named.is_empty() => {
            format!("{found}. With what is in the model, what is left looks like noise.")
        }
        (Verdict::Explained, true) => format!("Explained: {}, and what is left looks like noise.", lower(&found)),
    }
}

/// What was found, in a sentence without its end.
fn found(closure: &ClosedLoop, kinds: &Kinds) -> String {
    let named = match kinds.named.as_slice() {
        [] => "No effect was found".to_owned(),
        [one] => format!("One effect was found ({})", closure.before.describe(&one.effect)),
        several => format!("{} effects were found", several.len()),
    };
    let found = match (kinds.such.as_slice(), kinds.named.is_empty()) {
        ([], _) => named,
        ([one], true) => match probable(closure, one) {
            (true, words) => format!("No effect is sure; most probable is {words}"),
            (false, words) => format!("No effect is sure; something acts, {words}"),
        },
        ([one], false) => match probable(closure, one) {
            (true, words) => format!("{named}; one more is probable: {words}"),
            (false, words) => format!("{named}; something more acts, {words}"),
        },
        (several, true) => {
            format!("No effect is sure; {} are probable, their laws not sure", several.len())
        }
        (several, false) => {
            format!("{named}; {} more are probable, their laws not sure", several.len())
        }
    };
    match kinds.contradicted.as_slice() {
        [] => found,
        [one] => format!(
            "{found}; {} is contradicted by data that took no part",
            closure.before.describe(&one.effect)
        ),
        several => {
            format!("{found}; {} causes are contradicted by data that took no part", several.len())
        }
    }
}

/// That nothing was found where the residual is so many times the declared σ, fewer than chance
/// makes it; whether the fit took a smaller σ instead.
fn nothing_below(ratio: f64, takes_less: bool) -> String {
    let against = if takes_less {
        ", which is too large; causes are weighed against what the fit leaves"
    } else {
        "; causes are weighed against that σ, and smaller ones may be missed"
    };
    format!(
        "Nothing found: the residual is {} × the declared σ{against}.",
        number(ratio, if ratio < 0.1 { 3 } else { 2 })
    )
}

/// A cause whose law is not sure, how probable it is, and what it may be instead; whether it is the
/// most probable one.
fn probable(closure: &ClosedLoop, found: &Found) -> (bool, String) {
    let own = closure.before.describe(&found.effect);
    let rival = found.alternatives.first().map(|other| closure.before.describe(other));
    let known = found
        .claims
        .as_ref()
        .map(|claims| (claims.place.0.to_string(), claims.place.1, claims.law.1));
    known.map_or((true, own.clone()), |(place, at, law)| {
        doubted((&place, at, law), &own, rival.as_deref())
    })
}

/// Words for a cause at a place and its law, each with its probability; whether they say what is
/// most probable.
fn doubted((place, at, law): (&str, f64, f64), own: &str, rival: Option<&str>) -> (bool, String) {
    let or_else = rival.map_or_else(String::new, |rival| format!(", or else {rival}"));
    let there = format!("something at {place} ({}) whose law is not known", percent(at));
    let such = format!("such as {own} ({}){or_else}", percent(law));
    match law {
        EVEN.. => (true, format!("{own} ({}){or_else}", percent(law))),
        NONE.. if at >= EVEN => (true, format!("{there}, {such}")),
        NONE.. => (false, such),
        _ if at >= EVEN => (true, there),
        _ => (false, "neither its place nor its law known".to_owned()),
    }
}

/// An effect that was found, as surely as it is known.
pub(super) fn called(closure: &ClosedLoop, found: &Found) -> String {
    let own = effect::both(&found.effect, &closure.before);
    match &found.claims {
        _ if found.status == Status::Contradicted => format!("contradicted: {own}"),
        _ if is_beside(found) => {
            format!("in the model beside the others, not found by itself: {own}")
        }
        Some(claims) if found.status != Status::Found => {
            titled((&claims.place.0.to_string(), claims.place.1, claims.law.1), &own)
        }
        _ => own,
    }
}

/// The title of a cause at a place whose law is not sure, each with its probability.
fn titled((place, at, law): (&str, f64, f64), own: &str) -> String {
    match law {
        EVEN.. => format!("{place}: most probably {own} ({})", percent(law)),
        NONE.. if at >= EVEN => format!("{place}: its law is not known, such as: {own}"),
        NONE.. => format!("place and law not known, such as: {own}"),
        _ if at >= EVEN => format!("{place}: its law is not known"),
        _ => "place and law not known".to_owned(),
    }
}

/// What is in the model for a cause whose law is so little known that its title names none.
pub(super) fn stand_in(closure: &ClosedLoop, found: &Found) -> Option<String> {
    let is_unknown = |claims: &Claims| claims.law.1 < NONE;
    (found.claims.as_ref().is_some_and(is_unknown) && found.status != Status::Contradicted).then(
        || format!("in the model stands for it: {}", effect::both(&found.effect, &closure.before)),
    )
}

fn lower(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_said_surer_than_it_is_known() {
        let words = |at: f64, law: f64| doubted(("joint 2", at, law), "a wave", Some("a drift"));
        let title = |at: f64, law: f64| titled(("joint 2", at, law), "a wave");
        assert_eq!(words(0.99, 0.78), (true, "a wave (78 %), or else a drift".to_owned()));
        assert_eq!(title(0.99, 0.78), "joint 2: most probably a wave (78 %)");
        let such = "something at joint 2 (80 %) whose law is not known, such as a wave (39 %), or else a drift";
        assert_eq!(words(0.8, 0.39), (true, such.to_owned()));
        assert_eq!(title(0.8, 0.39), "joint 2: its law is not known, such as: a wave");
        assert_eq!(words(0.45, 0.39), (false, "such as a wave (39 %), or else a drift".to_owned()));
        assert_eq!(title(0.45, 0.39), "place and law not known, such as: a wave");
        assert_eq!(
            words(0.999, 0.0),
            (true, "something at joint 2 (over 99 %) whose law is not known".to_owned())
        );
        assert_eq!(title(0.999, 0.0), "joint 2: its law is not known");
        assert!(!words(0.2, 0.001).1.contains("wave") && !title(0.2, 0.001).contains("wave"));
    }

    #[test]
    fn an_overstated_sigma_is_said_with_its_number() {
        let (near, far) = (nothing_below(0.94, false), nothing_below(0.012, true));
        assert!(
            near.starts_with("Nothing found: the residual is 0.94 × the declared σ; causes are"),
            "{near}"
        );
        assert!(
            far.starts_with(
                "Nothing found: the residual is 0.012 × the declared σ, which is too large;"
            ),
            "{far}"
        );
    }
}
