//! Check of the order of the rows: does something differ from a certain row on?
//!
//! A reflector that is put into another nest, a station that is moved, or a joint that loses its
//! zero position changes one place of the model between two rows. With the fit linearised as r + J d
//! and columns D of the changed place, 0 before the row, the smallest cost of priors and residuals
//! falls from S₀ to
//!
//! S = S₀ − gᵀ (DᵀD − DᵀJ A⁻¹ JᵀD)⁻¹ g,  g = Dᵀr − DᵀJ A⁻¹ b,  A = JᵀJ + P,  b = Jᵀr + P x
//!
//! with the precisions P of the priors and the deviations x from nominal. All places and rows are
//! compared, in the order of the table and, to see whether the order counts, in others.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rand::seq::SliceRandom as _;
use serde_json::json;
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::checked_fit::{Check, CheckedFit};
use super::finding::{Finding, FindingCode};
use crate::fit::uncertainty::noise::Noise;
use crate::least_squares::{Loss, jacobian_and_residual};
use crate::measurement::Measurements;
use crate::model::parameter::{JointField, Parameter, ParameterSite, Regressor};
use crate::problem::{JointKind, Problem};
use crate::random;

/// Smallest ratio of the noise variance that the fit assumed to the declared one, at which the order
/// of the rows is examined.
const MIN_NOISE_FACTOR: f64 = 4.0;
/// Smallest share of the misfit beyond the declared noise that a change explains.
const MIN_EXPLAINED: f64 = 0.8;
/// Largest probability of a reported change by chance (F test), times the number of tries.
const MAX_CHANCE_PROBABILITY: f64 = 1e-6;
/// Smallest ratio of the residual that a change leaves in another order of the rows, or that a drift
/// over the rows leaves, to that in the order of the table.
const MIN_OTHER_RATIO: f64 = 2.0;
/// Minimum number of rows before and after a change.
const MIN_ROWS: usize = 4;
/// Largest number of rows and of unknowns for which the order is examined: the time grows with the
/// product of the number of rows and the square of the number of unknowns.
const MAX_SIZE: [usize; 2] = [4000, 150];
/// Number of random orders of the rows.
const RANDOM_ORDERS: usize = 19;
/// Seed of the random orders.
const SEED: u64 = 1;

/// Checks that no place of the model is different from a certain row on.
pub(super) struct RowsStayAlike;

impl Check for RowsStayAlike {
    fn check(&self, fit: &CheckedFit) -> Vec<Finding> {
        let kinds = fit.kinds();
        let positions = kinds.iter().all(|kind| kind.observation.is_position());
        let is_asked = fit.noise == Noise::Declared
            && fit.noise_factor >= MIN_NOISE_FACTOR
            && fit.has_further_fits
            && fit.fitting.loss == Loss::Squares
            && fit.fitting.earlier.is_none();
        if !positions || !is_asked {
            return Vec::new();
        }
        changed(fit).into_iter().collect()
    }
}

/// Place of the model that may change between two rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Place {
    /// Target with an index.
    Target(usize),
    /// Zero position of a joint with an index.
    Zero(usize),
    /// Base with an index.
    Base(usize),
    /// All unknowns.
    Arm,
}

impl Place {
    /// Returns the place to which a parameter belongs; `None` for other parameters of the arm.
    fn of(parameter: &Parameter, fit: &CheckedFit) -> Option<Self> {
        match parameter.site {
            ParameterSite::Target { target, .. } => Some(Self::Target(target)),
            ParameterSite::Base { base, .. } => Some(Self::Base(base)),
            ParameterSite::Joint { joint, field }
                if matches!(parameter.regressor, Regressor::Constant | Regressor::Unit)
                    && Some(field) == zero_field(fit.problem, joint) =>
            {
                Some(Self::Zero(joint))
            }
            _ => None,
        }
    }
}

/// Returns the field of a joint that holds its zero position; `None` for a joint without commands.
fn zero_field(problem: &Problem, joint: usize) -> Option<JointField> {
    match problem.joints.get(joint)?.command_kind() {
        JointKind::Revolute => Some(JointField::Theta),
        JointKind::Prismatic => Some(JointField::D),
        JointKind::Fixed => None,
    }
}

/// Linearised fit: sums from which the cost of each change follows.
struct Linear {
    /// Jacobian of the whitened residuals, rows of one pose together.
    jacobian: DMatrix<f64>,
    residual: DVector<f64>,
    /// L⁻¹Jᵀ with A = LLᵀ, shape = (unknowns, residuals).
    reduced: DMatrix<f64>,
    /// L⁻¹b.
    slope: DVector<f64>,
    /// Smallest cost without a change: S₀.
    cost: f64,
    /// Number of measured coordinates beyond the unknowns.
    freedom: f64,
    /// Number of residuals of a pose.
    of_pose: usize,
    /// Precisions of the difference between two arms of the same priors.
    difference: Vec<f64>,
}

/// Change that explains the residual best in an order of the rows.
#[derive(Debug, Clone)]
struct Step {
    place: Place,
    /// Place in the order of the first row after the change.
    first: usize,
    /// Smallest cost with the change.
    cost: f64,
    /// Changes of the unknowns of the place.
    change: DVector<f64>,
    /// Number of coordinates that the change moves.
    columns: usize,
}

impl Linear {
    /// Linearises the fit at its end, with the declared noise.
    fn of(fit: &CheckedFit) -> Option<Self> {
        let stage = fit.fitting.with_declared_noise().whole();
        let residuals = stage.residuals(&fit.end.x);
        let (jacobian, residual) =
            jacobian_and_residual(&residuals, &residuals.unknowns_in(&fit.end.x));
        let of_pose = stage.coordinates();
        let sigmas = stage.prior_sigmas();
        let x = stage.unknowns_in(&fit.end.x);
        let precision: Vec<f64> =
            sigmas.iter().map(|sigma| sigma.map_or(0.0, |sigma| sigma.powi(-2))).collect();
        let mut matrix = jacobian.tr_mul(&jacobian);
        let mut right = jacobian.tr_mul(&residual);
        let mut cost = residual.norm_squared();
        for k in 0..precision.len() {
            matrix[(k, k)] += precision[k] + f64::EPSILON * matrix[(k, k)];
            right[k] += precision[k] * x[k];
            cost += precision[k] * x[k] * x[k];
        }
        let factor = Cholesky::new(matrix)?;
        let lower = factor.l();
        let reduced = lower.solve_lower_triangular(&jacobian.transpose())?;
        let slope = lower.solve_lower_triangular(&right)?;
        let difference = precision.iter().map(|precision| 0.5 * precision).collect();
        let cost = cost - slope.norm_squared();
        let freedom = stage.count().saturating_sub(precision.len()).max(1) as f64;
        let linear =
            Self { jacobian, residual, reduced, slope, cost, freedom, of_pose, difference };
        (cost.is_finite() && cost > 0.0).then_some(linear)
    }

    /// Returns the best change in an order of the rows: from one of the rows on, at which
    /// `may_begin` is true, one of the places has another value.
    fn best(
        &self,
        places: &BTreeMap<Place, Vec<usize>>,
        order: &[usize],
        may_begin: impl Fn(usize) -> bool,
    ) -> Option<Step> {
        let n = self.jacobian.ncols();
        let mut normal = DMatrix::zeros(n, n);
        let mut crossed = DMatrix::zeros(n, n);
        let mut right = DVector::zeros(n);
        let mut best: Option<Step> = None;
        for first in (MIN_ROWS..order.len()).rev() {
            let from = self.of_pose * order[first];
            let rows = self.jacobian.rows(from, self.of_pose);
            normal += rows.tr_mul(&rows);
            crossed += self.reduced.columns(from, self.of_pose) * rows;
            right += rows.tr_mul(&self.residual.rows(from, self.of_pose));
            if order.len() - first < MIN_ROWS || !may_begin(first) {
                continue;
            }
            for (place, columns) in places {
                let of_arm = *place == Place::Arm;
                let after = order.len() - first;
                if of_arm && self.of_pose * after.min(first) < 2 * columns.len() {
                    continue;
                }
                let explained = self.explained((&normal, &crossed, &right), columns, of_arm);
                let Some((gain, change)) = explained else { continue };
                let step = Step {
                    place: *place,
                    first,
                    cost: self.cost - gain,
                    change,
                    columns: columns.len(),
                };
                if best.as_ref().is_none_or(|best| self.size(&step) < self.size(best)) {
                    best = Some(step);
                }
            }
        }
        best
    }

    /// Returns by how much the cost falls with free changes of some unknowns in the summed rows, and
    /// these changes.
    fn explained(
        &self,
        (normal, crossed, right): (&DMatrix<f64>, &DMatrix<f64>, &DVector<f64>),
        columns: &[usize],
        of_arm: bool,
    ) -> Option<(f64, DVector<f64>)> {
        let seen = crossed.select_columns(columns);
        let mut matrix = normal.select_columns(columns).select_rows(columns);
        matrix -= seen.tr_mul(&seen);
        for (place, column) in columns.iter().enumerate() {
            let entry = normal[(*column, *column)];
            let prior = if of_arm { self.difference[*column] } else { 0.0 };
            // A change that the unknowns explain themselves has no influence.
            matrix[(place, place)] += prior + 1e-9 * entry + f64::MIN_POSITIVE;
        }
        let slope = right.select_rows(columns) - seen.tr_mul(&self.slope);
        let change = factor(matrix)?.solve(&slope);
        let gain = change.dot(&slope);
        gain.is_finite().then_some((gain, -change))
    }

    /// Returns the size by which changes are compared: the logarithm of the cost, with a price for
    /// each coordinate [Schwarz 1978].
    fn size(&self, step: &Step) -> f64 {
        let count = self.residual.len() as f64;
        count * step.cost.max(f64::MIN_POSITIVE).ln() + step.columns as f64 * count.ln()
    }

    /// Returns the smallest cost with a drift of some unknowns that grows evenly over the rows.
    fn cost_of_drift(&self, columns: &[usize], order: &[usize]) -> Option<f64> {
        let mut drifting = self.jacobian.select_columns(columns);
        for (place, &pose) in order.iter().enumerate() {
            let share = place as f64 / order.len() as f64;
            drifting.rows_mut(self.of_pose * pose, self.of_pose).scale_mut(share);
        }
        let seen = &self.reduced * &drifting;
        let mut matrix = drifting.tr_mul(&drifting);
        for place in 0..columns.len() {
            matrix[(place, place)] *= 1.0 + 1e-9;
        }
        matrix -= seen.tr_mul(&seen);
        let slope = drifting.tr_mul(&self.residual) - seen.tr_mul(&self.slope);
        Some(self.cost - factor(matrix)?.solve(&slope).dot(&slope))
    }
}

/// Returns the Cholesky factor of a matrix whose diagonal is positive.
fn factor(matrix: DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    matrix.diagonal().iter().all(|entry| *entry > 0.0).then(|| Cholesky::new(matrix))?
}

/// Returns the finding on a change from a row on; `None` if no change explains most of the misfit.
fn changed(fit: &CheckedFit) -> Option<Finding> {
    let stage = fit.whole;
    let rows = &fit.fitting.split.identification;
    let unknowns: Vec<&Parameter> = stage.parameters().collect();
    if rows.len() > MAX_SIZE[0] || unknowns.len() > MAX_SIZE[1] || rows.len() < 2 * MIN_ROWS {
        return None;
    }
    let mut places: BTreeMap<Place, Vec<usize>> = BTreeMap::new();
    for (column, parameter) in unknowns.iter().enumerate() {
        if let Some(place) = Place::of(parameter, fit) {
            places.entry(place).or_default().push(column);
        }
    }
    places.insert(Place::Arm, (0..unknowns.len()).collect());
    let linear = Linear::of(fit)?;
    let table = fit.fitting.measurements;
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by_key(|&place| rows[place]);
    let step = linear.best(&places, &order, |_| true)?;
    let freedom = (linear.freedom - step.columns as f64).max(1.0);
    let noise = freedom.min(linear.cost);
    let explained = (linear.cost - step.cost) / (linear.cost - noise).max(f64::MIN_POSITIVE);
    if explained < MIN_EXPLAINED {
        return None;
    }
    let ratio = (linear.cost - step.cost) / step.columns as f64 / (step.cost / freedom);
    let chance = FisherSnedecor::new(step.columns as f64, freedom).ok()?.sf(ratio);
    let tries = (places.len() * rows.len()) as f64;
    if chance * tries > MAX_CHANCE_PROBABILITY {
        return None;
    }
    if is_explained_otherwise(&linear, &places, (table, rows, &order), &step) {
        return None;
    }
    Some(finding(fit, &linear, &places, &order, &step))
}

/// Returns true if a change in another order of the rows, or a drift, explains the residual about
/// as well as a step: the order of the table is then not what counts.
fn is_explained_otherwise(
    linear: &Linear,
    places: &BTreeMap<Place, Vec<usize>>,
    (table, rows, order): (&Measurements, &[usize], &[usize]),
    step: &Step,
) -> bool {
    let most = MIN_OTHER_RATIO * step.cost;
    let mut columns: Vec<Vec<f64>> = (0..table.joints)
        .map(|joint| order.iter().map(|&place| table.configuration(rows[place])[joint]).collect())
        .collect();
    let optional = [&table.payload, &table.hoist, &table.temperature].into_iter().flatten();
    columns.extend(optional.map(|of| order.iter().map(|&place| of[rows[place]]).collect()));
    let is_other_order = |values: &Vec<f64>| {
        let mut sorted: Vec<usize> = (0..order.len()).collect();
        sorted.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
        let is_new = |first: usize| values[sorted[first]] > values[sorted[first - 1]];
        let poses: Vec<usize> = sorted.iter().map(|&place| order[place]).collect();
        linear.best(places, &poses, is_new).is_some_and(|other| other.cost < most)
    };
    let drifts =
        |columns: &Vec<usize>| linear.cost_of_drift(columns, order).is_some_and(|cost| cost < most);
    let mut random = random::stream(SEED, 0);
    let mut is_by_chance = || {
        let mut shuffled = order.to_vec();
        shuffled.shuffle(&mut random);
        linear.best(places, &shuffled, |_| true).is_some_and(|other| other.cost < most)
    };
    places.get(&step.place).is_some_and(drifts)
        || columns.iter().any(is_other_order)
        || (0..RANDOM_ORDERS).any(|_| is_by_chance())
}

/// Returns the finding on a change that explains most of the misfit.
fn finding(
    fit: &CheckedFit,
    linear: &Linear,
    places: &BTreeMap<Place, Vec<usize>>,
    order: &[usize],
    step: &Step,
) -> Finding {
    let table = fit.fitting.measurements;
    let row = fit.fitting.split.identification[order[step.first]];
    let location = table.location(row).to_string();
    let parameters: Vec<&Parameter> = fit.whole.parameters().collect();
    let columns = &places[&step.place];
    let length = |from: usize| {
        let squares = columns.iter().zip(step.change.iter()).filter(|(column, _)| match parameters
            [**column]
            .site
        {
            ParameterSite::Target { axis, .. } | ParameterSite::Base { axis, .. } => {
                axis / 3 == from
            }
            _ => false,
        });
        squares.map(|(_, change)| change * change).sum::<f64>().sqrt()
    };
    let (what, remedy) = match step.place {
        Place::Target(_) => (
            format!("the target sits {:.1} mm elsewhere in its frame", 1e3 * length(0)),
            "if the reflector was put into another nest, or the tool was changed, give these rows another \
             word in a column target"
                .to_owned(),
        ),
        Place::Base(_) => (
            format!(
                "the base stands elsewhere, by {:.1} mm and {:.2}°",
                1e3 * length(0),
                length(1).to_degrees()
            ),
            "if the instrument or the arm was moved, give these rows another word in a column session"
                .to_owned(),
        ),
        Place::Zero(joint) => {
            let change = step.change.iter().sum::<f64>();
            let by = match zero_field(fit.problem, joint) {
                Some(JointField::D) => format!("{:.2} mm", 1e3 * change),
                _ => format!("{:.3}°", change.to_degrees()),
            };
            (
                format!("the zero position of joint {} is off by {by}", joint + 1),
                "if the joint lost its zero position there (a slipped belt, a new reference run), fit the \
                 rows before and after by themselves"
                    .to_owned(),
            )
        }
        Place::Arm => (
            "the arm is another one".to_owned(),
            "the rows before and after fit by themselves, but not together: check whether they are of one \
             arm with one set-up, and fit them by themselves"
                .to_owned(),
        ),
    };
    let [before, after] = [linear.cost, step.cost].map(|cost| (cost / linear.freedom).sqrt());
    let text = format!(
        "from {location} on ({} of {} rows) {what}: this change leaves a residual of {after:.1} times the \
         declared σ instead of {before:.1}",
        order.len() - step.first,
        order.len()
    );
    let name = match step.place {
        Place::Target(_) => "target",
        Place::Base(_) => "base",
        Place::Zero(_) => "zero",
        Place::Arm => "arm",
    };
    let numbers = [json!(location), json!(name), before.into(), after.into()];
    Finding::new(FindingCode::RowsChanged, numbers, text).with_remedy(remedy)
}
