//! Linear least squares in a box: active-set guess, interior-point solver, polish.

use nalgebra::{DMatrix, DVector};

use super::interior::{HalfSpace, interior_point};
use super::{AtBound, Factor};

/// Distance to a bound, relative to the box problem's size, below which the interior point is at the bound.
const NEAR: f64 = 1e-6;
/// Corrections of the active set allowed to a polish.
const CORRECTIONS: usize = 30;
/// Rounding allowed in the optimality conditions.
const ROUNDING: f64 = 1e-12;

/// min ½‖B q + c‖² + ½λ‖q‖² subject to lower ≤ q ≤ upper, with q = 0 in the box.
pub(super) struct BoxProblem<'a> {
    factor: &'a Factor,
    gradient: DVector<f64>,
    lower: DVector<f64>,
    upper: DVector<f64>,
    guess: Vec<Option<AtBound>>,
}

/// A minimiser and the bounds it rests on.
#[derive(Debug, Clone)]
pub(super) struct BoxSolution {
    pub(super) q: DVector<f64>,
    pub(super) active: Vec<Option<AtBound>>,
}

impl<'a> BoxProblem<'a> {
    pub(super) fn new(
        factor: &'a Factor,
        lower: DVector<f64>,
        upper: DVector<f64>,
        guess: Vec<Option<AtBound>>,
    ) -> Self {
        Self { factor, gradient: factor.gradient(), lower, upper, guess }
    }

    /// ‖Bᵀc‖.
    pub(super) fn gradient_norm(&self) -> f64 {
        self.gradient.norm()
    }

    /// The minimiser for damping λ, exact on its active set.
    pub(super) fn solve(&mut self, lambda: f64) -> BoxSolution {
        let solution = self
            .polish(self.guess.clone(), lambda, 2)
            .or_else(|| {
                let interior = self.interior_point(lambda)?;
                self.polish(self.near(&interior), lambda, CORRECTIONS).or_else(|| Some(self.clamped(interior)))
            })
            .unwrap_or_else(|| self.clamped(DVector::zeros(self.lower.len())));
        self.guess.clone_from(&solution.active);
        solution
    }

    /// Solves on an active set and corrects it until the optimality conditions hold, within `corrections` rounds.
    ///
    /// Each round frees the bounds whose multiplier has the wrong sign and adds those that are passed.
    fn polish(&self, mut active: Vec<Option<AtBound>>, lambda: f64, corrections: usize) -> Option<BoxSolution> {
        for _ in 0..corrections {
            let q = self.on_active_set(&active, lambda);
            let corrected = self.corrected(&active, &q, lambda);
            if corrected == active {
                let mut q = q;
                (0..q.len()).for_each(|j| q[j] = q[j].clamp(self.lower[j], self.upper[j]));
                return Some(BoxSolution { q, active });
            }
            active = corrected;
        }
        None
    }

    fn corrected(&self, active: &[Option<AtBound>], q: &DVector<f64>, lambda: f64) -> Vec<Option<AtBound>> {
        // Multipliers w = Bᵀ(B q + c) + λ q: w ≥ 0 at a lower bound, w ≤ 0 at an upper one.
        let multipliers = self.factor.matrix().tr_mul(&self.factor.image(q)) + &self.gradient + lambda * q;
        let force = ROUNDING * (self.gradient.amax() + lambda * q.amax());
        let slack = ROUNDING * q.amax();
        (0..q.len())
            .map(|j| match active[j] {
                _ if self.lower[j] >= self.upper[j] => Some(AtBound::Lower),
                Some(AtBound::Lower) if multipliers[j] < -force => None,
                Some(AtBound::Upper) if multipliers[j] > force => None,
                Some(bound) => Some(bound),
                None if q[j] < self.lower[j] - slack => Some(AtBound::Lower),
                None if q[j] > self.upper[j] + slack => Some(AtBound::Upper),
                None => None,
            })
            .collect()
    }

    fn bound(&self, active: &[Option<AtBound>], j: usize) -> f64 {
        match active[j] {
            Some(AtBound::Lower) => self.lower[j],
            Some(AtBound::Upper) => self.upper[j],
            None => 0.0,
        }
    }

    /// The least-squares solution of the free unknowns with the others at their bounds.
    fn on_active_set(&self, active: &[Option<AtBound>], lambda: f64) -> DVector<f64> {
        let mut q = DVector::from_fn(active.len(), |j, _| self.bound(active, j));
        let free: Vec<usize> = (0..active.len()).filter(|&j| active[j].is_none()).collect();
        if free.is_empty() {
            return q;
        }
        let n = self.factor.matrix().nrows();
        let constant = self.factor.image(&q) + self.factor.constant();
        // The damping as further rows √λ q = 0.
        let root = lambda.sqrt();
        let extra = if lambda > 0.0 { free.len() } else { 0 };
        let mut matrix = DMatrix::zeros(n + extra, free.len());
        matrix.rows_mut(0, n).copy_from(&self.factor.matrix().select_columns(&free));
        matrix.view_mut((n, 0), (extra, extra)).fill_diagonal(root);
        let constant = constant.resize_vertically(n + extra, 0.0);
        let solution = Factor::new(matrix, constant, self.factor.tolerance()).gauss_newton();
        free.iter().zip(solution.iter()).for_each(|(&j, value)| q[j] = *value);
        q
    }

    fn near(&self, q: &DVector<f64>) -> Vec<Option<AtBound>> {
        let size = NEAR * q.amax().max(f64::MIN_POSITIVE);
        (0..q.len())
            .map(|j| {
                if q[j] - self.lower[j] <= size {
                    Some(AtBound::Lower)
                } else if self.upper[j] - q[j] <= size {
                    Some(AtBound::Upper)
                } else {
                    None
                }
            })
            .collect()
    }

    fn clamped(&self, mut q: DVector<f64>) -> BoxSolution {
        (0..q.len()).for_each(|j| q[j] = q[j].clamp(self.lower[j], self.upper[j]));
        let active = (0..q.len())
            .map(|j| match q[j] {
                value if value <= self.lower[j] => Some(AtBound::Lower),
                value if value >= self.upper[j] => Some(AtBound::Upper),
                _ => None,
            })
            .collect();
        BoxSolution { q, active }
    }

    /// The minimiser by the interior-point method; bounds at infinity are left out.
    fn interior_point(&self, lambda: f64) -> Option<DVector<f64>> {
        let side = |bound: &DVector<f64>, sign: f64| -> Vec<HalfSpace> {
            let finite = bound.iter().enumerate().filter(|(_, bound)| bound.is_finite());
            finite.map(|(j, bound)| HalfSpace { normal: vec![(j, sign)], least: sign * bound }).collect()
        };
        interior_point(self.factor, lambda, &[side(&self.lower, 1.0), side(&self.upper, -1.0)].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interior_point_and_polish_agree_on_a_badly_scaled_box() {
        let n = 8;
        let spread = |j: usize| 10.0_f64.powf(0.75 * j as f64);
        let matrix =
            DMatrix::from_fn(
                n,
                n,
                |i, j| if i <= j { spread(j) * ((5 * i + 3 * j + 2 * i * j) as f64).cos() } else { 0.0 },
            );
        let constant = DVector::from_fn(n, |i, _| 1.0 + i as f64);
        let factor = Factor::new(matrix, constant, 1e-13);
        let mut lower = DVector::from_fn(n, |j, _| -0.5 / spread(j));
        let upper = DVector::from_fn(n, |j, _| if j == 1 { f64::INFINITY } else { 0.25 / spread(j) });
        lower[2] = f64::NEG_INFINITY;
        for lambda in [0.0, 1e-3, 10.0] {
            let mut problem = BoxProblem::new(&factor, lower.clone(), upper.clone(), vec![None; n]);
            let interior = problem.interior_point(lambda).unwrap();
            let solution = problem.solve(lambda);
            let cost =
                |q: &DVector<f64>| (factor.image(q) + factor.constant()).norm_squared() + lambda * q.norm_squared();
            assert!((cost(&solution.q) / cost(&interior) - 1.0).abs() < 1e-8, "{lambda}");
            assert!(solution.active.iter().any(Option::is_some));
            let corrected = problem.corrected(&solution.active, &solution.q, lambda);
            assert_eq!(corrected, solution.active);
        }
    }
}
