//! Distinction of two effects by poses that are not measured yet.

use nalgebra::DMatrix;

use super::candidates::Candidates;
use super::detection::{Size, candidates, sizes, with_assumed_times, with_linear};
use super::neighbourhood::{LinearNeighbourhood, tries};
use super::power::ScanTest;
use super::rules::SelectionRules;
use crate::error::InputError;
use crate::measurement::Measurements;
use crate::problem::{Effect, Problem};
use crate::select::settings::POWER;

/// Angle between two effects \[rad\] below which no measurement distinguishes them: 0.05°. Rounding
/// alone makes angles of less than a thousandth of that.
const MAX_ALIKE_ANGLE: f64 = 8.7e-4;

/// Measure of how well some poses distinguish two effects.
#[derive(Debug, Clone, PartialEq)]
pub struct Separation {
    /// Largest principal angle \[rad\] between the displacements by the two effects, with all free
    /// parameters projected out: 0 if they are equal, π/2 if they are orthogonal. `None` if one of
    /// them has no effect.
    pub angle: Option<f64>,
    is_alike: bool,
    /// Detectability of the first effect given the second, and of the second given the first.
    pub sides: [Side; 2],
}

impl Separation {
    /// Returns true if the poses do not distinguish the effects at all.
    pub fn is_alike(&self) -> bool {
        self.is_alike
    }
}

/// Detectability of one of two effects.
#[derive(Debug, Clone, PartialEq)]
pub struct Side {
    /// Smallest size at which a scan of the whole catalogue finds the effect. It is the size of the
    /// parameters that have the unit of the first parameter.
    pub found: Size,
    /// Smallest size of the effect at which the other effect alone is rejected as the cause, at the
    /// significance level [`SelectionRules::level`].
    pub told: Size,
    test: Option<ScanTest>,
}

impl Side {
    /// Returns the expected p-value of the effect, given the other one, at a size \[SI\] in the
    /// direction that is hardest to distinguish. It is 1 if nothing distinguishes the effects.
    pub fn expected_p(&self, size: f64) -> f64 {
        let told =
            self.test.and_then(|test| Some((test, test.noncentrality(POWER)?, self.told.worst?)));
        told.map_or(1.0, |(test, needed, least)| test.expected_p(needed * (size / least).powi(2)))
    }
}

/// Computes how well `poses` would distinguish two effects, linear about the nominal arm as in
/// [`super::detectable`].
///
/// # Errors
/// Returns an error if rules of `[parameters]` do not match the arm.
pub fn separation(
    problem: &Problem,
    poses: &Measurements,
    [one, other]: [&Effect; 2],
) -> Result<Separation, InputError> {
    let poses = with_assumed_times(poses);
    let Candidates { mut testable, .. } = candidates(problem, &poses);
    for effect in [one, other] {
        if !testable.contains(effect) {
            testable.push(effect.clone());
        }
    }
    let (tries, families) = tries(&testable, problem);
    let tries_of = |effect: &Effect| {
        let index = testable.iter().position(|other| other == effect);
        index.map_or(1.0, |index| tries[index] * families as f64)
    };
    let pair = [one.clone(), other.clone()];
    with_linear(problem, &poses, &pair, |linearised, linear| {
        let side = |effect: &Effect, beside: &Effect| {
            let both = linear.with(&linearised.columns(beside));
            let score = both.score(&linearised.columns(effect));
            Side {
                found: first_size(sizes(problem, linearised, linear, effect, tries_of(effect))),
                told: first_size(sizes(problem, linearised, &both, effect, 1.0)),
                test: ScanTest::new(
                    score.rank(),
                    both.expected_freedom(),
                    SelectionRules::DEFAULT.level,
                    1.0,
                ),
            }
        };
        let columns = [one, other].map(|effect| linearised.columns(effect));
        let angle = linear.angle(&columns[0], &columns[1]);
        let is_alike = add_the_same(linear, [&columns[0], &columns[1]]);
        Separation { angle, is_alike, sides: [side(one, other), side(other, one)] }
    })
}

/// Returns true if none of `poses` distinguishes two effects that the problem does not declare: for
/// this arm, they are one cause with two names.
pub(super) fn are_alike(problem: &Problem, poses: &Measurements, pair: &[Effect; 2]) -> bool {
    let are_alike = with_linear(problem, &with_assumed_times(poses), pair, |linearised, linear| {
        let [one, other] = pair.each_ref().map(|effect| linearised.columns(effect));
        add_the_same(linear, [&one, &other])
    });
    are_alike.unwrap_or(false)
}

/// Returns true if two sets of columns add the same directions to a fit. A set that adds more
/// directions than the other one is not the same.
fn add_the_same(linear: &LinearNeighbourhood, [one, other]: [&DMatrix<f64>; 2]) -> bool {
    let [rank, other_rank] = [one, other].map(|columns| linear.score(columns).rank());
    rank == other_rank && linear.angle(one, other).is_some_and(|angle| angle < MAX_ALIKE_ANGLE)
}

/// Returns the first of an effect's sizes, that for the unit of its first parameter; an empty one
/// if there is none.
fn first_size(sizes: Vec<Size>) -> Size {
    let none = Size {
        parameters: Vec::new(),
        unit: crate::quantity::Unit::Number,
        prior: 0.0,
        worst: None,
        best: None,
    };
    sizes.into_iter().next().unwrap_or(none)
}
