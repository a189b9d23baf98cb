//! Weakly determined combinations of unknowns, and an objective that keeps them fixed.

use nalgebra::{DMatrix, DVector};

use super::identifiability::UnidentifiableCombination;
use super::inverse::sum_of_inverse_row_squares;
use super::singular::SingularValues;
use super::{Block, Linearisation, Objective, Triangle};

/// Smallest change of all measured coordinates together, in σ, that makes a combination of unknowns
/// estimable. The combination is moved by its plausible size.
///
/// Below it, the standard error of the combination would exceed a fifth of its plausible size. Real
/// deviations of an arm, at most a hundredth of that size, then move no position by more than 0.05
/// σ.
pub const WEAK_THRESHOLD: f64 = 5.0;
/// Largest coefficient of a combination that counts as rounding.
const MAX_ROUNDING_WEIGHT: f64 = 1e-6;

/// Combinations of unknowns that the data determine too weakly for a reliable estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Weak {
    /// Constraint rows W, which keep the combinations fixed by W p = 0 for a step p. Each row is as
    /// long as the longest column of the triangle in units of the plausible sizes. Shape =
    /// (combinations, n) [1 / unit of x].
    pub rows: DMatrix<f64>,
    /// Each combination, with coefficients in units of the plausible sizes, and the change of the
    /// data that it causes \[σ\].
    pub combinations: Vec<UnidentifiableCombination>,
    /// Share of each unknown outside the weak combinations: 1 − squared length of its projection
    /// onto them, 0…1. It is 1 for unknowns without a plausible size.
    pub visible: Vec<f64>,
    /// Change of each unknown where every weak combination moves by its plausible size, as a root
    /// of the sum of squares \[unit of x\]. Unknowns without a plausible size follow the others.
    pub moves: Vec<f64>,
}

impl Weak {
    /// Finds the weak combinations of the problem with triangular factor `triangle`, shape = (n,
    /// n). The factor includes priors and the rows of combinations that are fixed anyway.
    ///
    /// `sizes` holds the plausible size of each unknown. Unknowns without a size are not tested but
    /// follow the others: with R = [R₁ R₂; 0 R₃], those unknowns first, the data change by ‖R₃ S w‖
    /// \[σ\] along S w, S = diag(sizes). Returns `None` if no combination is weak.
    pub fn of(triangle: &DMatrix<f64>, sizes: &[Option<f64>]) -> Option<Self> {
        let n = triangle.ncols();
        let sized: Vec<(usize, f64)> =
            sizes.iter().enumerate().filter_map(|(j, size)| Some((j, (*size)?))).collect();
        if sized.is_empty() {
            return None;
        }
        // The norm ‖R₃⁻¹‖ in scaled unknowns follows from the rows of R⁻¹.
        let inverse =
            sum_of_inverse_row_squares(triangle, sized.iter().map(|&(j, size)| (j, size.recip())));
        if inverse.is_some_and(|squares| squares.sqrt() * WEAK_THRESHOLD < 1.0) {
            return None;
        }
        let unsized_unknowns: Vec<usize> = (0..n).filter(|&j| sizes[j].is_none()).collect();
        let first = unsized_unknowns.len();
        let mut block = Block::zeros(triangle.nrows(), n);
        for (column, &j) in unsized_unknowns.iter().enumerate() {
            block.column_mut(column).copy_from_slice(triangle.column(j).as_slice());
        }
        for (column, &(j, size)) in sized.iter().enumerate() {
            let scaled = triangle.column(j) * size;
            block.column_mut(first + column).copy_from_slice(scaled.as_slice());
        }
        let mut reduced = Triangle::new(n);
        reduced.absorb(&mut block);
        let reduced = reduced.into_linearisation().triangle;
        let conditional = reduced.view((first, first), (sized.len(), sized.len())).into_owned();
        if conditional.iter().any(|value| !value.is_finite()) || has_no_weak_direction(&conditional)
        {
            return None;
        }
        let longest = sized
            .iter()
            .map(|&(j, size)| triangle.column(j).norm() * size)
            .fold(WEAK_THRESHOLD, f64::max);
        let SingularValues { values, right } = SingularValues::of(&conditional);
        let strong = values.iter().filter(|value| **value >= WEAK_THRESHOLD).count();
        let spanned =
            super::identifiability::orthogonal_complement(&right.columns(0, strong).into_owned());
        let mut rows = DMatrix::zeros(spanned.nrows(), n);
        let (mut visible, mut moves) = (vec![1.0; n], vec![0.0; n]);
        for (column, &(j, size)) in sized.iter().enumerate() {
            visible[j] = (1.0 - spanned.column(column).norm_squared()).clamp(0.0, 1.0);
            rows.set_column(j, &(spanned.column(column) * (longest / size)));
            moves[j] = size * spanned.column(column).norm();
        }
        let follow = reduced.view((0, first), (first, sized.len())) * spanned.transpose();
        let follow = reduced.view((0, 0), (first, first)).solve_upper_triangular(&follow);
        for (row, &j) in unsized_unknowns.iter().enumerate() {
            moves[j] = follow.as_ref().map_or(0.0, |follow| follow.row(row).norm());
        }
        let combination = |row: nalgebra::RowDVector<f64>| {
            let sign = row
                .iter()
                .find(|weight| weight.abs() > MAX_ROUNDING_WEIGHT)
                .map_or(1.0, |weight| weight.signum());
            let weights =
                row.iter().enumerate().filter(|(_, weight)| weight.abs() > MAX_ROUNDING_WEIGHT);
            let weights = weights.map(|(k, weight)| (sized[k].0, sign * weight)).collect();
            UnidentifiableCombination {
                weights,
                singular_value: (&conditional * row.transpose()).norm(),
            }
        };
        let combinations = spanned.row_iter().map(|row| combination(row.into_owned())).collect();
        (strong < sized.len()).then_some(Self { rows, combinations, visible, moves })
    }
}

/// Returns true if ‖T v‖ ≥ [`WEAK_THRESHOLD`] for every unit vector v, judged by the Frobenius norm
/// of T⁻¹.
fn has_no_weak_direction(triangle: &DMatrix<f64>) -> bool {
    let n = triangle.ncols();
    if (0..n).any(|j| triangle[(j, j)].abs() < WEAK_THRESHOLD) {
        return false;
    }
    let inverse = triangle.solve_upper_triangular(&DMatrix::identity(n, n));
    inverse.is_some_and(|inverse| inverse.norm() * WEAK_THRESHOLD < 1.0)
}

/// Objective whose linearisation keeps weakly determined combinations fixed at every iterate.
///
/// Rows W p = 0 for the step p are added to the linearised problem; the cost stays unchanged.
pub struct StabilisedObjective<'a, O> {
    /// Objective that is minimised.
    pub objective: O,
    /// Plausible size of each unknown, in the unit of the unknown; `None` if it is not known.
    pub sizes: &'a [Option<f64>],
}

impl<O: Objective> Objective for StabilisedObjective<'_, O> {
    fn parameters(&self) -> usize {
        self.objective.parameters()
    }

    fn cost(&self, x: &DVector<f64>) -> f64 {
        self.objective.cost(x)
    }

    fn linearise(&self, x: &DVector<f64>) -> Linearisation {
        let linearisation = self.objective.linearise(x);
        match Weak::of(&linearisation.triangle, self.sizes) {
            Some(weak) => linearisation.with_rows(&weak.rows),
            None => linearisation,
        }
    }

    fn curvature(
        &self,
        x: &DVector<f64>,
        within: &dyn Fn(&DVector<f64>) -> bool,
    ) -> Option<DMatrix<f64>> {
        self.objective.curvature(x, within)
    }

    fn plausible_sizes(&self) -> Vec<Option<f64>> {
        let sizes = self.objective.plausible_sizes().into_iter().zip(self.sizes);
        sizes.map(|(from_prior, size)| from_prior.or(*size)).collect()
    }

    fn acceleration_gradient(&self, x: &DVector<f64>, step: &DVector<f64>) -> Option<DVector<f64>> {
        self.objective.acceleration_gradient(x, step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_moves_the_data_by_less_than_its_level_is_weak() {
        // y = x₀ + x₁ + ε (x₁ − x₂), x₃ separate; all but x₃ have the size 1.
        let triangle = |difference: f64| {
            let rows = [
                [1e3, 1e3, 0.0, 1.0],
                [0.0, difference, -difference, 0.0],
                [0.0, 0.0, 1e3, 2.0],
                [0.0, 0.0, 0.0, 1e3],
            ];
            DMatrix::from_fn(4, 4, |i, j| rows[i][j])
        };
        let sizes = [Some(1.0), Some(1.0), Some(1.0), None];
        assert_eq!(Weak::of(&triangle(20.0), &sizes), None);
        let weak = Weak::of(&triangle(2.0), &sizes).unwrap();
        let [combination] = weak.combinations.as_slice() else { panic!("{weak:?}") };
        assert_eq!(combination.weights.iter().map(|(j, _)| *j).collect::<Vec<_>>()[..2], [0, 1]);
        assert!(
            (combination.weights[0].1 + combination.weights[1].1).abs() < 1e-2
                && combination.weights[0].1 > 0.7
        );
        assert!(
            combination.singular_value < 2.0
                && weak.visible[2] > 0.99
                && (weak.visible[3] - 1.0).abs() < 1e-15
        );
        // A combination with ten times the size has ten times the effect.
        assert_eq!(Weak::of(&triangle(2.0), &[Some(10.0), Some(10.0), Some(10.0), None]), None);
        assert_eq!(Weak::of(&triangle(0.0), &[None; 4]), None);
    }

    #[test]
    fn weak_combinations_are_told_in_plausible_sizes() {
        // In units of the sizes 2 and 3 both unknowns change the data alike: x₀ / 2 = −x₁ / 3.
        let triangle = DMatrix::from_row_slice(
            3,
            3,
            &[-50.0, -100.0 / 3.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0, 1e3],
        );
        let weak = Weak::of(&triangle, &[Some(2.0), Some(3.0), Some(1.0)]).unwrap();
        let [combination] = weak.combinations.as_slice() else { panic!("{weak:?}") };
        let half = 0.5_f64.sqrt();
        let [(0, first), (1, second)] = combination.weights[..] else { panic!("{combination:?}") };
        assert!((first - half).abs() < 1e-4 && (second + half).abs() < 1e-4, "{combination:?}");
        assert!((combination.singular_value - 3e-3 * half).abs() < 1e-6, "{combination:?}");
        // The row is along the combination in the unknowns themselves: (1/2, −1/3, 0).
        assert!(
            (weak.rows[(0, 0)] * 2.0 + weak.rows[(0, 1)] * 3.0).abs() < 1e-3 * weak.rows.amax()
        );
        assert!(weak.rows[(0, 2)].abs() < 1e-9 * weak.rows.amax());
        assert!((weak.visible[0] - 0.5).abs() < 1e-4 && (weak.visible[2] - 1.0).abs() < 1e-9);
    }

    #[test]
    fn unknowns_without_a_size_follow_weak_combinations() {
        // y = x₀ + x₂ and x₁ + ε x₂; only x₁ and x₂ have a size, and x₀ follows x₂.
        let triangle =
            DMatrix::from_row_slice(3, 3, &[1e3, 0.0, 1e3, 0.0, 1e3, 1e1, 0.0, 0.0, 1e-3]);
        let weak = Weak::of(&triangle, &[None, Some(1.0), Some(2.0)]).unwrap();
        assert!((weak.moves[0] - 2.0).abs() < 1e-3, "{:?}", weak.moves);
        assert!((weak.moves[1] - 0.02).abs() < 1e-4, "{:?}", weak.moves);
        assert!((weak.moves[2] - 2.0).abs() < 1e-3, "{:?}", weak.moves);
    }
}
