//! Search for the change of one place of the model from a row on that explains a residual best.
//!
//! With the fit linearised as r + J d and columns D of the changed place, 0 before the row, the
//! smallest cost of priors and residuals falls from S₀ to
//!
//! S = S₀ − gᵀ (DᵀD − DᵀJ A⁻¹ JᵀD)⁻¹ g,  g = Dᵀr − DᵀJ A⁻¹ b,  A = JᵀJ + P,  b = Jᵀr + P x
//!
//! with the precisions P of the priors and the deviations x from nominal.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::checked_fit::CheckedFit;
use crate::least_squares::jacobian_and_residual;

/// Minimum number of rows before and after a change.
pub(super) const MIN_ROWS: usize = 4;
/// Number of evenly spaced rows of an order at which a change of all unknowns is tried. One try
/// takes a time that grows with the cube of the number of unknowns.
const ARM_ROWS: usize = 12;
/// Maximum number of divisions of the poses between two values of some unknowns.
const PASSES: usize = 20;

/// Place of the model that may change between two rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Place {
    /// Target with an index.
    Target(usize),
    /// Zero position of a joint with an index.
    Zero(usize),
    /// Base with an index.
    Base(usize),
    /// Pose of a camera or marker with an index.
    Fixture(usize),
    /// All unknowns.
    Arm,
}

/// Columns of the unknowns of each place.
pub(super) type Places = BTreeMap<Place, Vec<usize>>;

/// Linearised fit: sums from which the cost of each change follows.
pub(super) struct Linear {
    /// Jacobian of the whitened residuals, rows of one pose together.
    jacobian: DMatrix<f64>,
    residual: DVector<f64>,
    /// Triangular factor L of A = LLᵀ.
    lower: DMatrix<f64>,
    /// L⁻¹Jᵀ, shape = (unknowns, residuals).
    reduced: DMatrix<f64>,
    /// L⁻¹b.
    slope: DVector<f64>,
    /// Smallest cost without a change: S₀.
    pub cost: f64,
    /// Number of measured coordinates beyond the unknowns.
    pub freedom: f64,
    /// Number of residuals of a pose.
    coordinates: usize,
    /// Precisions of the difference between two arms of the same priors.
    difference: DVector<f64>,
}

/// Change that explains the residual best in an order of the rows.
#[derive(Debug, Clone)]
pub(super) struct Step {
    pub place: Place,
    /// Place in the order of the first row after the change.
    pub first: usize,
    /// Smallest cost with the change.
    pub cost: f64,
    /// Changes of the unknowns of the place.
    pub change: DVector<f64>,
    /// Number of coordinates that the change moves.
    pub columns: usize,
}

/// Sums of the normal equations of a linearised fit: A, b, the cost at the fit, and the number of
/// measured coordinates beyond the unknowns.
struct Sums {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    cost: f64,
    freedom: f64,
}

/// Sums over the rows after a change, for one place.
struct PlaceSums {
    place: Place,
    columns: Vec<usize>,
    /// DᵀD.
    normal: DMatrix<f64>,
    /// L⁻¹JᵀD.
    crossed: DMatrix<f64>,
    /// Dᵀr.
    right: DVector<f64>,
    /// True if a row was added since the cost of a change of this place was last computed.
    is_new: bool,
}

/// Sums over the rows after a change of all unknowns.
#[derive(Clone)]
struct ArmSums {
    /// Place in the order of the first row in the sums.
    first: usize,
    /// DᵀD, which is JᵀD, too.
    normal: DMatrix<f64>,
    /// Dᵀr.
    right: DVector<f64>,
}

impl Linear {
    /// Linearises the fit at its end, with the declared noise.
    pub fn of(fit: &CheckedFit) -> Option<Self> {
        let stage = fit.fitting.with_declared_noise().whole();
        let residuals = stage.residuals(&fit.end.x);
        let (jacobian, residual) =
            jacobian_and_residual(&residuals, &residuals.unknowns_in(&fit.end.x));
        let coordinates = stage.coordinates();
        let sigmas = stage.prior_sigmas();
        let x = stage.unknowns_in(&fit.end.x);
        let precisions = sigmas.iter().map(|sigma| sigma.map_or(0.0, |sigma| sigma.powi(-2)));
        let precision = DVector::from_iterator(sigmas.len(), precisions);
        let mut matrix = jacobian.tr_mul(&jacobian);
        let mut right = jacobian.tr_mul(&residual);
        let mut cost = residual.norm_squared();
        for k in 0..precision.len() {
            matrix[(k, k)] += precision[k] + f64::EPSILON * matrix[(k, k)];
            right[k] += precision[k] * x[k];
            cost += precision[k] * x[k] * x[k];
        }
        let freedom = stage.count().saturating_sub(precision.len()).max(1) as f64;
        let sums = Sums { matrix, right, cost, freedom };
        Self::solved((jacobian, residual), sums, (coordinates, 0.5 * precision))
    }

    /// Finds the smallest cost of the unknowns with these sums.
    fn solved(
        (jacobian, residual): (DMatrix<f64>, DVector<f64>),
        Sums { matrix, right, cost, freedom }: Sums,
        (coordinates, difference): (usize, DVector<f64>),
    ) -> Option<Self> {
        let lower = Cholesky::new(matrix)?.unpack();
        let reduced = lower.solve_lower_triangular(&jacobian.transpose())?;
        let slope = lower.solve_lower_triangular(&right)?;
        let cost = cost - slope.norm_squared();
        let linear = Self {
            jacobian,
            residual,
            lower,
            reduced,
            slope,
            cost,
            freedom,
            coordinates,
            difference,
        };
        (cost.is_finite() && cost > 0.0).then_some(linear)
    }

    /// Returns the linearised fit in which the unknowns in `columns` may also have other values in the
    /// poses at `places`: a free change of each is added to the unknowns.
    pub fn with_change(&self, columns: &[usize], places: &[usize]) -> Option<Self> {
        let (n, added) = (self.jacobian.ncols(), columns.len());
        let mut jacobian = self.jacobian.clone().resize_horizontally(n + added, 0.0);
        for &place in places {
            let from = self.coordinates * place;
            let moved = self.jacobian.rows(from, self.coordinates).select_columns(columns);
            jacobian.view_mut((from, n), (self.coordinates, added)).copy_from(&moved);
        }
        let changes = jacobian.columns(n, added).clone_owned();
        let mut matrix = jacobian.tr_mul(&jacobian);
        matrix.view_mut((0, 0), (n, n)).copy_from(&(&self.lower * self.lower.transpose()));
        for k in n..n + added {
            // A change that the unknowns explain themselves has no influence.
            matrix[(k, k)] += 1e-9 * matrix[(k, k)] + f64::MIN_POSITIVE;
        }
        let mut right = (&self.lower * &self.slope).resize_vertically(n + added, 0.0);
        right.rows_mut(n, added).copy_from(&changes.tr_mul(&self.residual));
        let cost = self.cost + self.slope.norm_squared();
        let freedom = (self.freedom - added as f64).max(1.0);
        let sums = Sums { matrix, right, cost, freedom };
        let difference = self.difference.clone().resize_vertically(n + added, 0.0);
        Self::solved((jacobian, self.residual.clone()), sums, (self.coordinates, difference))
    }

    /// Returns the change of the unknowns from the fit to the smallest cost.
    fn solution(&self) -> Option<DVector<f64>> {
        self.lower.tr_solve_lower_triangular(&self.slope).map(|x| -x)
    }

    /// Returns the poses, and the change in them of the unknowns in `columns`, with which poses of two
    /// values of these unknowns are told apart best, and the smallest cost with this change. The
    /// poses that change are fewer than the others.
    pub fn two_values(&self, columns: &[usize]) -> Option<(Vec<usize>, DVector<f64>, f64)> {
        let count = self.jacobian.nrows() / self.coordinates;
        let of_pose = |pose: usize, residual: &DVector<f64>| {
            let from = self.coordinates * pose;
            let moved = self.jacobian.rows(from, self.coordinates).select_columns(columns);
            let residual = residual.rows(from, self.coordinates).clone_owned();
            (moved, residual)
        };
        let residual = &self.residual + &self.jacobian * self.solution()?;
        // The change of the unknowns that each pose asks for by itself.
        let asked: Vec<DVector<f64>> = (0..count)
            .map(|pose| {
                let (moved, residual) = of_pose(pose, &residual);
                let normal = moved.tr_mul(&moved);
                factor(normal).map_or_else(
                    || DVector::zeros(columns.len()),
                    |factor| -factor.solve(&moved.tr_mul(&residual)),
                )
            })
            .collect();
        let mean = asked.iter().sum::<DVector<f64>>() / count as f64;
        let scatter: DMatrix<f64> =
            asked.iter().map(|at| (at - &mean) * (at - &mean).transpose()).sum();
        let eigen = scatter.symmetric_eigen();
        let axis = eigen.eigenvectors.column(eigen.eigenvalues.imax()).clone_owned();
        let mut places: Vec<usize> =
            (0..count).filter(|&pose| (&asked[pose] - &mean).dot(&axis) > 0.0).collect();
        for _ in 0..PASSES {
            if 2 * places.len() > count {
                places = (0..count).filter(|pose| !places.contains(pose)).collect();
            }
            if places.len() < MIN_ROWS {
                return None;
            }
            let changed = self.with_change(columns, &places)?;
            let solution = changed.solution()?;
            let change = solution.rows_range(self.jacobian.ncols()..).clone_owned();
            let unchanged =
                &self.residual + &self.jacobian * solution.rows_range(..self.jacobian.ncols());
            let is_nearer = |pose: &usize| {
                let (moved, residual) = of_pose(*pose, &unchanged);
                (&residual + moved * &change).norm_squared() < residual.norm_squared()
            };
            let nearer: Vec<usize> = (0..count).filter(is_nearer).collect();
            if nearer == places {
                return Some((places, change, changed.cost));
            }
            places = nearer;
        }
        None
    }

    /// Returns the best change of one place that is not the whole arm, in an order of the rows:
    /// from one of the rows on, at which `may_begin` is true, the place has another value.
    pub fn best_of_places(
        &self,
        places: &Places,
        order: &[usize],
        may_begin: &dyn Fn(usize) -> bool,
    ) -> Option<Step> {
        let n = self.jacobian.ncols();
        let single = places.iter().filter(|(place, _)| **place != Place::Arm);
        let mut sums: Vec<PlaceSums> = single
            .map(|(place, columns)| PlaceSums {
                place: *place,
                columns: columns.clone(),
                normal: DMatrix::zeros(columns.len(), columns.len()),
                crossed: DMatrix::zeros(n, columns.len()),
                right: DVector::zeros(columns.len()),
                is_new: false,
            })
            .collect();
        let mut best: Option<Step> = None;
        for first in (MIN_ROWS..order.len()).rev() {
            let from = self.coordinates * order[first];
            let rows = self.jacobian.rows(from, self.coordinates);
            let residual = self.residual.rows(from, self.coordinates);
            let is_compared = order.len() - first >= MIN_ROWS && may_begin(first);
            for sums in &mut sums {
                let moved = rows.select_columns(&sums.columns);
                if moved.iter().any(|entry| *entry != 0.0) {
                    sums.normal += moved.tr_mul(&moved);
                    sums.crossed += self.reduced.columns(from, self.coordinates) * &moved;
                    sums.right += moved.tr_mul(&residual);
                    sums.is_new = true;
                }
                // A row that the place does not move changes no sum.
                if !(is_compared && sums.is_new) {
                    continue;
                }
                sums.is_new = false;
                let prior = DVector::zeros(sums.columns.len());
                let explained = self.explained((&sums.normal, &sums.crossed, &sums.right), &prior);
                let Some((gain, change)) = explained else { continue };
                let cost = self.cost - gain;
                let columns = sums.columns.len();
                let step = Step { place: sums.place, first, cost, change, columns };
                best = self.better(best, Some(step));
            }
        }
        best
    }

    /// Returns the rows of an order at which a change of all unknowns is tried: a few evenly spaced
    /// ones of those at which `may_begin` is true and that leave enough rows before and after.
    pub fn arm_rows(&self, count: usize, may_begin: &dyn Fn(usize) -> bool) -> Vec<usize> {
        let least = self.least_arm_rows();
        let rows: Vec<usize> =
            (least..(count + 1).saturating_sub(least)).filter(|&first| may_begin(first)).collect();
        let last = rows.len().saturating_sub(1);
        let mut chosen: Vec<usize> =
            (0..ARM_ROWS).filter_map(|k| rows.get(k * last / (ARM_ROWS - 1)).copied()).collect();
        chosen.dedup();
        chosen
    }

    /// Returns the smallest number of rows on both sides of a change of all unknowns.
    fn least_arm_rows(&self) -> usize {
        MIN_ROWS.max((2 * self.jacobian.ncols()).div_ceil(self.coordinates.max(1)))
    }

    /// Returns the best change of all unknowns in an order of the rows, from one of the rows
    /// `firsts` on.
    pub fn best_of_arm(&self, order: &[usize], firsts: &[usize]) -> Option<Step> {
        self.arm_in(order, firsts).map(|(step, _)| step)
    }

    /// Returns the best change of all unknowns in an order of the rows, from any row on: the best
    /// of the evenly spaced rows, then rows beside it at distances that are halved.
    pub fn best_of_arm_refined(&self, order: &[usize]) -> Option<Step> {
        let firsts = self.arm_rows(order.len(), &|_| true);
        let least = self.least_arm_rows();
        let (mut best, mut sums) = self.arm_in(order, &firsts)?;
        let mut distance = order.len().div_ceil(ARM_ROWS);
        while distance > 1 {
            distance = distance.div_ceil(2);
            let middle = best.first;
            for first in [middle.saturating_sub(distance), middle + distance] {
                if first < least || first + least > order.len() {
                    continue;
                }
                let mut moved = sums.clone();
                self.move_first(&mut moved, order, first);
                if let Some(step) = self.step_of_arm(&moved).filter(|step| step.cost < best.cost) {
                    (best, sums) = (step, moved);
                }
            }
        }
        Some(best)
    }

    /// Returns the best change of all unknowns from one of the rows `firsts` on, with its sums.
    fn arm_in(&self, order: &[usize], firsts: &[usize]) -> Option<(Step, ArmSums)> {
        let n = self.jacobian.ncols();
        let (normal, right) = (DMatrix::zeros(n, n), DVector::zeros(n));
        let mut sums = ArmSums { first: order.len(), normal, right };
        let mut best: Option<(Step, ArmSums)> = None;
        for &first in firsts.iter().rev() {
            self.move_first(&mut sums, order, first);
            let Some(step) = self.step_of_arm(&sums) else { continue };
            if best.as_ref().is_none_or(|(best, _)| step.cost < best.cost) {
                best = Some((step, sums.clone()));
            }
        }
        best
    }

    /// Adds rows to the sums, or takes rows off, so that they begin at the row `first` of the
    /// order.
    fn move_first(&self, sums: &mut ArmSums, order: &[usize], first: usize) {
        let (range, sign): (Range<usize>, f64) =
            if first < sums.first { (first..sums.first, 1.0) } else { (sums.first..first, -1.0) };
        let count = self.coordinates * range.len();
        let mut rows = DMatrix::zeros(count, self.jacobian.ncols());
        let mut residual = DVector::zeros(count);
        for (place, &pose) in order[range].iter().enumerate() {
            let (to, from) = (self.coordinates * place, self.coordinates * pose);
            rows.rows_mut(to, self.coordinates)
                .copy_from(&self.jacobian.rows(from, self.coordinates));
            residual
                .rows_mut(to, self.coordinates)
                .copy_from(&self.residual.rows(from, self.coordinates));
        }
        sums.right += sign * rows.tr_mul(&residual);
        // The product of matrices is faster than `tr_mul`.
        sums.normal.gemm(sign, &rows.transpose(), &rows, 1.0);
        sums.first = first;
    }

    /// Returns the change of all unknowns with these sums.
    fn step_of_arm(&self, sums: &ArmSums) -> Option<Step> {
        let crossed = self.lower.solve_lower_triangular(&sums.normal)?;
        let of_arm = (&sums.normal, &crossed, &sums.right);
        let (gain, change) = self.explained(of_arm, &self.difference)?;
        let (cost, columns) = (self.cost - gain, change.len());
        Some(Step { place: Place::Arm, first: sums.first, cost, change, columns })
    }

    /// Returns by how much the cost falls with free changes of some unknowns in the summed rows,
    /// and these changes.
    fn explained(
        &self,
        (normal, crossed, right): (&DMatrix<f64>, &DMatrix<f64>, &DVector<f64>),
        prior: &DVector<f64>,
    ) -> Option<(f64, DVector<f64>)> {
        let mut matrix = normal - crossed.transpose() * crossed;
        for k in 0..prior.len() {
            // A change that the unknowns explain themselves has no influence.
            matrix[(k, k)] += prior[k] + 1e-9 * normal[(k, k)] + f64::MIN_POSITIVE;
        }
        let slope = right - crossed.tr_mul(&self.slope);
        let change = factor(matrix)?.solve(&slope);
        let gain = change.dot(&slope);
        gain.is_finite().then_some((gain, -change))
    }

    /// Returns the better one of two changes: that with the smaller logarithm of the cost, with a
    /// price for each coordinate [Schwarz 1978].
    pub fn better(&self, one: Option<Step>, other: Option<Step>) -> Option<Step> {
        let count = self.residual.len() as f64;
        let size = |step: &Step| {
            count * step.cost.max(f64::MIN_POSITIVE).ln() + step.columns as f64 * count.ln()
        };
        match (one, other) {
            (Some(one), Some(other)) => Some(if size(&other) < size(&one) { other } else { one }),
            (one, other) => one.or(other),
        }
    }

    /// Returns the smallest cost with a drift of some unknowns that grows evenly over the rows.
    pub fn cost_of_drift(&self, place: Place, columns: &[usize], order: &[usize]) -> Option<f64> {
        let mut drifting = self.jacobian.select_columns(columns);
        for (row, &pose) in order.iter().enumerate() {
            let share = row as f64 / order.len() as f64;
            drifting.rows_mut(self.coordinates * pose, self.coordinates).scale_mut(share);
        }
        let sums = (
            &drifting.tr_mul(&drifting),
            &(&self.reduced * &drifting),
            &drifting.tr_mul(&self.residual),
        );
        let prior = match place {
            Place::Arm => self.difference.clone(),
            _ => DVector::zeros(columns.len()),
        };
        self.explained(sums, &prior).map(|(gain, _)| self.cost - gain)
    }
}

/// Returns the Cholesky factor of a matrix whose diagonal is positive.
fn factor(matrix: DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    matrix.diagonal().iter().all(|entry| *entry > 0.0).then(|| Cholesky::new(matrix))?
}
