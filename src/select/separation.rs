//! How well poses tell two effects apart, before anyone measures them.

use super::candidates::Candidates;
use super::detection::{Size, candidates, sizes, timed, with_linear};
use super::neighbourhood::tries;
use super::power::ScanTest;
use super::rules::SelectionRules;
use crate::error::InputError;
use crate::measurement::Measurements;
use crate::problem::{Effect, Problem};

/// How well some poses tell two effects apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Separation {
    /// Largest principal angle \[rad\] between what the two do once all parameters have been
    /// fitted: 0 the same, π/2 nothing in common; `None` where one of them does nothing.
    pub angle: Option<f64>,
    /// The first effect beside the second, and the second beside the first.
    pub sides: [Side; 2],
}

/// One of two effects beside the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Side {
    /// From what size on a scan of the whole catalogue finds it; of its parameters, those of the
    /// first one's unit.
    pub found: Size,
    /// From what size on the other in its place is ruled out, at the level of the loop.
    pub told: Size,
    test: Option<ScanTest>,
}

impl Side {
    /// p to be expected of it beside the other, if it has this size \[SI\] in the direction that is
    /// hardest to tell; 1 where nothing tells it.
    pub fn expected_p(&self, size: f64) -> f64 {
        let told = self.test.and_then(|test| {
            Some((test, test.noncentrality(SelectionRules::DEFAULT.power)?, self.told.worst?))
        });
        told.map_or(1.0, |(test, needed, least)| test.expected_p(needed * (size / least).powi(2)))
    }
}

/// How well `poses` would tell two effects apart; linear about the nominal arm, as
/// [`super::detectable`].
///
/// # Errors
/// Rules of `[parameters]` do not fit the arm.
pub fn separation(
    problem: &Problem,
    poses: &Measurements,
    [one, other]: [&Effect; 2],
) -> Result<Separation, InputError> {
    let poses = timed(poses);
    let Candidates { mut testable, .. } = candidates(problem, &poses);
    for effect in [one, other] {
        if !testable.contains(effect) {
            testable.push(effect.clone());
        }
    }
    let (tries, families) = tries(&testable, problem);
    let tries_of = |effect: &Effect| {
        let place = testable.iter().position(|known| known == effect);
        place.map_or(1.0, |place| tries[place] * families as f64)
    };
    let pair = [one.clone(), other.clone()];
    with_linear(problem, &poses, &pair, |linearised, linear| {
        let side = |own: &Effect, beside: &Effect| {
            let both = linear.with(&linearised.columns(beside));
            let score = both.score(&linearised.columns(own));
            Side {
                found: first(sizes(problem, linearised, linear, own, tries_of(own))),
                told: first(sizes(problem, linearised, &both, own, 1.0)),
                test: ScanTest::new(
                    score.rank(&SelectionRules::DEFAULT),
                    both.expected_freedom(),
                    1.0,
                ),
            }
        };
        let angle = linear.angle(&linearised.columns(one), &linearised.columns(other));
        Separation { angle, sides: [side(one, other), side(other, one)] }
    })
}

/// The size of those parameters of an effect that are named first; every effect has one.
fn first(sizes: Vec<Size>) -> Size {
    let none = Size {
        parameters: Vec::new(),
        unit: crate::quantity::Unit::Number,
        prior: 0.0,
        worst: None,
        best: None,
    };
    sizes.into_iter().next().unwrap_or(none)
}
