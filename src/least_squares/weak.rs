//! Combinations of unknowns that the data see too weakly for an estimate, and fits that leave them
//! where they are.

use nalgebra::{DMatrix, DVector};

use super::identifiability::UnidentifiableCombination;
use super::inverse::inverse_rows;
use super::singular::SingularValues;
use super::{Block, Linearisation, Objective, Triangle};

/// A combination is weak if moving it by its own size changes all measured coordinates together by
/// less than this many σ.
///
/// An estimate of it would then have a standard error above a fifth of that size: it may lie
/// anywhere. What an arm really deviates by, at most a hundredth of its size, moves no position by
/// more than 0.05 σ along it.
pub const WEAK_BELOW: f64 = 5.0;
/// Parts of a combination below this are rounding.
const NEGLIGIBLE: f64 = 1e-6;

/// Combinations of unknowns that are seen too weakly to be estimated.
#[derive(Debug, Clone, PartialEq)]
pub struct Weak {
    /// Rows that span them, as strong as what is seen best, shape = (combinations, n) [1 / unit of
    /// x].
    pub rows: DMatrix<f64>,
    /// Each by itself: weights in units of the unknowns' sizes, and the σ by which all data move
    /// with it.
    pub combinations: Vec<UnidentifiableCombination>,
    /// Part of each unknown that lies outside of them, 0…1.
    pub visible: Vec<f64>,
}

impl Weak {
    /// Those of the problem with triangular factor `triangle` (n × n): priors are part of it, and
    /// rows of what is held anyhow.
    ///
    /// `sizes` holds how far each unknown may plausibly go: of those without one (a prior keeps
    /// them, or they may be anywhere) nothing is asked, they follow the others. With R = [R₁ R₂; 0
    /// R₃], the others first, the σ by which data move with S w is ‖R₃ S w‖, S = diag(sizes).
    pub fn of(triangle: &DMatrix<f64>, sizes: &[Option<f64>]) -> Option<Self> {
        let n = triangle.ncols();
        let sized: Vec<(usize, f64)> =
            sizes.iter().enumerate().filter_map(|(j, size)| Some((j, (*size)?))).collect();
        if sized.is_empty() {
            return None;
        }
        // ‖R₃⁻¹‖ of the scaled unknowns, from the rows of R⁻¹.
        let inverse = inverse_rows(triangle, sized.iter().map(|&(j, size)| (j, size.recip())));
        if inverse.is_some_and(|squares| squares.sqrt() * WEAK_BELOW < 1.0) {
            return None;
        }
        let others: Vec<usize> = (0..n).filter(|&j| sizes[j].is_none()).collect();
        let first = others.len();
        let mut block = Block::zeros(triangle.nrows(), n);
        for (place, &j) in others.iter().enumerate() {
            block.column_mut(place).copy_from_slice(triangle.column(j).as_slice());
        }
        for (place, &(j, size)) in sized.iter().enumerate() {
            let scaled = triangle.column(j) * size;
            block.column_mut(first + place).copy_from_slice(scaled.as_slice());
        }
        let mut reduced = Triangle::new(n);
        reduced.absorb(&mut block);
        let seen = reduced
            .into_linearisation()
            .triangle
            .view((first, first), (sized.len(), sized.len()))
            .into_owned();
        if seen.iter().any(|value| !value.is_finite()) || is_strong(&seen) {
            return None;
        }
        let strongest = sized
            .iter()
            .map(|&(j, size)| triangle.column(j).norm() * size)
            .fold(WEAK_BELOW, f64::max);
        let SingularValues { values, right } = SingularValues::of(&seen);
        let strong = values.iter().filter(|value| **value >= WEAK_BELOW).count();
        let spanned = super::identifiability::complement(&right.columns(0, strong).into_owned());
        let mut rows = DMatrix::zeros(spanned.nrows(), n);
        let mut visible = vec![1.0; n];
        for (place, &(j, size)) in sized.iter().enumerate() {
            visible[j] = (1.0 - spanned.column(place).norm_squared()).clamp(0.0, 1.0);
            rows.set_column(j, &(spanned.column(place) * (strongest / size)));
        }
        let combination = |row: nalgebra::RowDVector<f64>| {
            let sign = row
                .iter()
                .find(|weight| weight.abs() > NEGLIGIBLE)
                .map_or(1.0, |weight| weight.signum());
            let weights = row.iter().enumerate().filter(|(_, weight)| weight.abs() > NEGLIGIBLE);
            let weights = weights.map(|(place, weight)| (sized[place].0, sign * weight)).collect();
            UnidentifiableCombination { weights, singular_value: (&seen * row.transpose()).norm() }
        };
        let combinations = spanned.row_iter().map(|row| combination(row.into_owned())).collect();
        (strong < sized.len()).then_some(Self { rows, combinations, visible })
    }
}

/// Whether an upper triangle leaves no vector of length one shorter than [`WEAK_BELOW`], by ‖T⁻¹‖
/// in Frobenius's norm.
fn is_strong(triangle: &DMatrix<f64>) -> bool {
    let n = triangle.ncols();
    if (0..n).any(|j| triangle[(j, j)].abs() < WEAK_BELOW) {
        return false;
    }
    let inverse = triangle.solve_upper_triangular(&DMatrix::identity(n, n));
    inverse.is_some_and(|inverse| inverse.norm() * WEAK_BELOW < 1.0)
}

/// An objective whose linearisation holds, at every iterate, what is seen too weakly there.
///
/// To the linearised problem come rows W p = 0 for the step p; the cost stays as it is.
pub struct Steadied<'a, O> {
    /// What is minimised.
    pub objective: O,
    /// How far each unknown may plausibly go.
    pub sizes: &'a [Option<f64>],
}

impl<O: Objective> Objective for Steadied<'_, O> {
    fn parameters(&self) -> usize {
        self.objective.parameters()
    }

    fn cost(&self, x: &DVector<f64>) -> f64 {
        self.objective.cost(x)
    }

    fn linearise(&self, x: &DVector<f64>) -> Linearisation {
        let found = self.objective.linearise(x);
        match Weak::of(&found.triangle, self.sizes) {
            Some(weak) => found.with_rows(&weak.rows),
            None => found,
        }
    }

    fn curvature(
        &self,
        x: &DVector<f64>,
        within: &dyn Fn(&DVector<f64>) -> bool,
    ) -> Option<DMatrix<f64>> {
        self.objective.curvature(x, within)
    }

    fn reach(&self) -> Vec<Option<f64>> {
        self.objective
            .reach()
            .into_iter()
            .zip(self.sizes)
            .map(|(known, size)| known.or(*size))
            .collect()
    }

    fn bend(&self, x: &DVector<f64>, step: &DVector<f64>) -> Option<DVector<f64>> {
        self.objective.bend(x, step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_moves_the_data_by_less_than_its_level_is_weak() {
        // y = x₀ + x₁ + ε (x₁ − x₂), x₃ alone; 1 is everyone's size but of x₃, which has none.
        let of = |difference: f64| {
            let rows = [
                [1e3, 1e3, 0.0, 1.0],
                [0.0, difference, -difference, 0.0],
                [0.0, 0.0, 1e3, 2.0],
                [0.0, 0.0, 0.0, 1e3],
            ];
            DMatrix::from_fn(4, 4, |i, j| rows[i][j])
        };
        let sizes = [Some(1.0), Some(1.0), Some(1.0), None];
        assert_eq!(Weak::of(&of(20.0), &sizes), None);
        let weak = Weak::of(&of(2.0), &sizes).unwrap();
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
        // What is ten times as large is ten times as well seen.
        assert_eq!(Weak::of(&of(2.0), &[Some(10.0), Some(10.0), Some(10.0), None]), None);
        assert_eq!(Weak::of(&of(0.0), &[None; 4]), None);
    }
}
