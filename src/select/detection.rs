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

/// Smallest sizes at which measurements in some poses would show each effect of the catalogue.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// Probability that an effect of the stated size is found (power of the test).
    pub power: f64,
    /// Probability of a false alarm: that noise makes any effect significant.
    pub level: f64,
    /// Effects that the poses can test, in the order of the catalogue, with their detectable sizes.
    pub effects: Vec<Detectable>,
    /// Effects that the poses cannot test, with the reason.
    pub untestable: Vec<(Effect, &'static str)>,
    /// True if the poses have no times; one minute is then assumed between consecutive poses.
    pub times_assumed: bool,
    /// True if the rows are measured without times; their numbers then stand for times, and speeds
    /// are per row.
    pub times_are_rows: bool,
}

/// Smallest sizes at which an effect is found.
#[derive(Debug, Clone, PartialEq)]
pub struct Detectable {
    /// Effect whose detectable size is computed.
    pub effect: Effect,
    /// Detectable sizes of the effect's parameters; parameters with the same unit form one entry.
    pub sizes: Vec<Size>,
}

/// Smallest size at which some parameters of an effect are found, all others being zero.
///
/// The size of one parameter is its absolute value. The size of several is their norm √(Σ p²),
/// which for a harmonic is its amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct Size {
    /// Names of the parameters of the effect, such as `joint-harmonic[3].sin1`.
    pub parameters: Vec<String>,
    /// Unit of the effect's parameters.
    pub unit: Unit,
    /// Largest 1 σ of the catalogue's priors on the parameters, SI. Real effects are rarely much
    /// larger.
    pub prior: f64,
    /// Size in the direction (phase, axis) that is hardest to detect, SI. `None` if the fitted
    /// parameters can reproduce it completely, or if hardly any degrees of freedom remain.
    pub worst: Option<f64>,
    /// Size in the direction (phase, axis) that is easiest to detect, SI; `None` as for `worst`.
    pub best: Option<f64>,
}

impl Size {
    /// Returns the size with a speed in units per row instead of per second, for times that are row
    /// numbers.
    fn per_row(self) -> Self {
        Self { unit: self.unit.per_row(), ..self }
    }

    /// Returns true if effects as large as the prior σ are found in at least one direction.
    pub fn is_within_prior(&self) -> bool {
        self.best.is_some_and(|best| best <= self.prior)
    }
}

/// Computes the smallest size at which a scan of the catalogue would find each effect with the
/// probability [`Detection::power`], if `poses` were measured.
///
/// The computation is linear about the nominal arm. Let C be the columns of an effect's parameters
/// p, with the free parameters projected out as a fit with priors does. An effect of size p has the
/// noncentrality λ = pᵀ CᵀC p. It is found if F on k and ν − k degrees of freedom is significant at
/// level / (tries × families). Planned poses without times are assumed to be a minute apart; rows already
/// measured without times keep their row numbers as times.
///
/// # Errors
/// Returns an error if rules of `[parameters]` do not match the arm.
pub fn detectable(problem: &Problem, poses: &Measurements) -> Result<Detection, InputError> {
    let keeps_times = poses.time_measured || poses.position_measured;
    let times_are_rows = keeps_times && !poses.time_measured;
    let poses = if keeps_times { poses.clone() } else { with_assumed_times(poses) };
    let Candidates { testable, untestable } = candidates(problem, &poses);
    let (tries, families) = tries(&testable, problem);
    let effects = with_linear(problem, &poses, &testable, |linearised, linear| {
        let sizes = |(effect, tries): (&Effect, f64)| Detectable {
            sizes: sizes(problem, linearised, linear, effect, tries * families as f64)
                .into_iter()
                .map(|size| if times_are_rows { size.per_row() } else { size })
                .collect(),
            effect: effect.clone(),
        };
        testable.par_iter().zip(tries).map(sizes).collect()
    })?;
    Ok(Detection {
        power: POWER,
        level: SelectionRules::DEFAULT.level,
        effects,
        untestable,
        times_assumed: !keeps_times,
        times_are_rows,
    })
}

/// Returns the poses, with times a minute apart if they have none.
pub(super) fn with_assumed_times(poses: &Measurements) -> Measurements {
    let mut poses = poses.clone();
    if !poses.time_measured {
        poses.time =
            (0_u32..).take(poses.len()).map(|row| f64::from(row) * ASSUMED_TIME_STEP).collect();
        poses.time_measured = true;
    }
    poses
}

/// Returns the effects of the catalogue that these poses can show, and the others with the reason.
pub(super) fn candidates(problem: &Problem, poses: &Measurements) -> Candidates {
    let split = Split { identification: (0..poses.len()).collect(), held_out: Vec::new() };
    Candidates::new(
        problem,
        &Data::new(problem, &Dataset::new(poses.clone(), split), &SelectionRules::DEFAULT),
    )
}

/// Calls `with` with the nominal arm linearised at these poses, and with its linear neighbourhood,
/// in which all free parameters are fitted and the residual is zero.
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

/// Returns the detectable sizes of an effect, one for each unit of its parameters. Parameters that
/// do not vanish with the effect, such as the position of a mass, are left out.
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
