//! Effects that measurements in given poses would show, and from which size on.

use crate::select::settings::{ASSUMED_TIME_STEP, MIN_NEW_LENGTH, POWER};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::candidates::Candidates;
use super::data::Data;
use super::neighbourhood::{LinearNeighbourhood, Linearised, Unknowns, tries};
use super::power::ScanTest;
use super::rules::SelectionRules;
use crate::error::InputError;
use crate::fit::Placement;
use crate::measurement::{Dataset, Measurements, Split};
use crate::model::Model;
use crate::model::parameter::unit;
use crate::problem::{Effect, Problem};
use crate::quantity::Unit;

/// Sizes from which on measurements in some poses would show each effect of the catalogue.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// Probability with which an effect of the stated size is found.
    pub power: f64,
    /// Probability that chance points to any effect.
    pub level: f64,
    /// Candidates that these poses can test, in the order of the catalogue.
    pub effects: Vec<Detectable>,
    /// Candidates that they cannot test, with the reason.
    pub untestable: Vec<(Effect, &'static str)>,
    /// True if the poses have no times yet and are taken to be measured a minute apart.
    pub times_assumed: bool,
}

/// Sizes from which on an effect is found.
#[derive(Debug, Clone, PartialEq)]
pub struct Detectable {
    /// Effect in question.
    pub effect: Effect,
    /// Sizes of its parameters, those of one unit together.
    pub sizes: Vec<Size>,
}

/// Size from which on some parameters of an effect, all others at zero, are found.
///
/// The size of one parameter is its absolute value, that of several their length √(Σ p²): for a
/// harmonic its amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct Size {
    /// Names of the parameters, such as `joint-harmonic[3].sin1`.
    pub parameters: Vec<String>,
    /// Unit of the parameters.
    pub unit: Unit,
    /// 1 σ of the catalogue's prior, SI: realistic effects are not much larger.
    pub prior: f64,
    /// Size in the direction (phase, axis) that is hardest to see, SI; `None` where the fitted
    /// parameters absorb it or leave hardly any degree of freedom.
    pub worst: Option<f64>,
    /// Size in the direction that is easiest to see, SI.
    pub best: Option<f64>,
}

impl Size {
    /// Returns true if effects as large as the prior are found in some direction.
    pub fn is_within_prior(&self) -> bool {
        self.best.is_some_and(|best| best <= self.prior)
    }
}

/// Computes the size from which on a scan of the catalogue would find each effect, were `poses`
/// measured.
///
/// LinearNeighbourhood about the nominal arm. With the columns C of an effect's parameters p,
/// everything free projected out as a fit with priors does, an effect of size p has the
/// noncentrality λ = pᵀ CᵀC p; it is found if F on k and ν − k degrees of freedom is beyond level /
/// tries. Poses without a time are taken to be a minute apart; of rows that are measured already no
/// more than the order is known then.
///
/// # Errors
/// Rules of `[parameters]` do not fit the arm.
pub fn detectable(problem: &Problem, poses: &Measurements) -> Result<Detection, InputError> {
    let is_known = poses.time_measured || poses.position_measured;
    let poses = if is_known { poses.clone() } else { timed(poses) };
    let Candidates { testable, untestable } = candidates(problem, &poses);
    let (tries, families) = tries(&testable, problem);
    let effects = with_linear(problem, &poses, &testable, |linearised, linear| {
        let sizes = |(effect, tries): (&Effect, f64)| Detectable {
            sizes: sizes(problem, linearised, linear, effect, tries * families as f64),
            effect: effect.clone(),
        };
        testable.par_iter().zip(tries).map(sizes).collect()
    })?;
    Ok(Detection {
        power: POWER,
        level: SelectionRules::DEFAULT.level,
        effects,
        untestable,
        times_assumed: !is_known,
    })
}

/// Returns the poses with assumed times.
pub(super) fn timed(poses: &Measurements) -> Measurements {
    let mut poses = poses.clone();
    if !poses.time_measured {
        poses.time =
            (0_u32..).take(poses.len()).map(|row| f64::from(row) * ASSUMED_TIME_STEP).collect();
        poses.time_measured = true;
    }
    poses
}

/// Returns the effects of the catalogue that these poses can show.
pub(super) fn candidates(problem: &Problem, poses: &Measurements) -> Candidates {
    let split = Split { identification: (0..poses.len()).collect(), held_out: Vec::new() };
    Candidates::of(
        problem,
        &Data::new(problem, &Dataset::new(poses.clone(), split), &SelectionRules::DEFAULT),
    )
}

/// Calls `with` with the nominal arm linearised at these poses, and its neighbourhood with all
/// parameters fitted and no residual.
pub(super) fn with_linear<T>(
    problem: &Problem,
    poses: &Measurements,
    effects: &[Effect],
    with: impl FnOnce(&Linearised, &LinearNeighbourhood) -> T,
) -> Result<T, InputError> {
    let placement = Placement::of(poses);
    let model = Model::new(problem, &placement.bases, &placement.targets)?;
    let n = model.parameters.len();
    let (rows, unknowns): (Vec<usize>, Vec<usize>) = ((0..poses.len()).collect(), (0..n).collect());
    let measured = placement.poses(poses, &rows, problem.data.position_sigma.unwrap_or(1.0));
    let linearised = Linearised::new(
        (problem, None),
        &model,
        measured,
        &unknowns,
        &DVector::zeros(n),
        (effects, &[]),
    );
    let columns = linearised.fitted();
    let mut priors: Vec<Option<f64>> =
        model.parameters.iter().map(|parameter| parameter.sigma).collect();
    priors.extend(linearised.relaxed());
    let unknowns =
        Unknowns { x: vec![0.0; priors.len()], priors, active: DMatrix::zeros(0, columns.ncols()) };
    let linear = LinearNeighbourhood::new(
        columns,
        &DVector::zeros(columns.nrows()),
        &unknowns,
        linearised.empty(),
    );
    Ok(with(&linearised, &linear))
}

/// Returns the sizes of an effect for the units of its parameters; parameters whose zero means
/// nothing, as the place of a mass, are left out.
pub(super) fn sizes(
    problem: &Problem,
    linearised: &Linearised,
    linear: &LinearNeighbourhood,
    effect: &Effect,
    tries: f64,
) -> Vec<Size> {
    let score = linear.score(&linearised.columns(effect));
    let test = ScanTest::new(
        score.rank(),
        linear.expected_freedom(),
        SelectionRules::DEFAULT.level,
        tries,
    );
    let needed = test.and_then(|test| test.noncentrality(POWER));
    let parameters = effect.parameters(problem);
    let mut groups: Vec<(Unit, Vec<usize>)> = Vec::new();
    for (k, parameter) in
        parameters.iter().enumerate().filter(|(_, parameter)| parameter.nominal == 0.0)
    {
        let unit_of_parameter = unit(parameter.site, &parameter.regressor);
        match groups.iter_mut().find(|(unit, _)| *unit == unit_of_parameter) {
            Some((_, members)) => members.push(k),
            None => groups.push((unit_of_parameter, vec![k])),
        }
    }
    let size = |(unit, members): (Unit, Vec<usize>)| {
        let gram = score.gram.select_rows(&members).select_columns(&members);
        let longest = members.iter().map(|&k| score.lengths[k]).fold(0.0, f64::max);
        let seen = gram.symmetric_eigenvalues();
        let from = |value: f64| {
            (value > MIN_NEW_LENGTH.powi(2) * longest)
                .then(|| Some((needed? / value).sqrt()))
                .flatten()
        };
        Size {
            parameters: members.iter().map(|&k| parameters[k].name.clone()).collect(),
            unit,
            prior: members.iter().map(|&k| parameters[k].sigma).fold(0.0, f64::max),
            worst: from(seen.min()),
            best: from(seen.max()),
        }
    };
    groups.into_iter().map(size).collect()
}
