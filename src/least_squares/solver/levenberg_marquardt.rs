//! Levenberg–Marquardt without constraints: the minimiser of the linearised problem in a sphere.

use nalgebra::{DMatrix, DVector};

use super::{Factor, Settings, Step, Subproblem};
use crate::least_squares::{Linearisation, MANY_UNKNOWNS};

/// Subproblem of a step within a sphere ‖D p‖ ≤ Δ: Levenberg–Marquardt in trust-region form.
///
/// min ‖J p + r‖ subject to ‖D p‖ ≤ Δ, that is `(JᵀJ + λD²) p = −Jᵀr` with λ ≥ 0          [Moré
/// 1978]
///
/// It works with the n × n factor of J alone. Redundant unknowns are allowed: combinations of
/// unknowns that the data do not determine do not change. With many unknowns, steps whose gain
/// differs from the prediction get a geodesic acceleration [Transtrum & Sethna 2012].
#[derive(Debug, Clone, Default)]
pub struct Unconstrained {
    model: Option<Model>,
    /// Last step p without geodesic acceleration.
    unaccelerated: DVector<f64>,
}

/// Linearised problem in scaled unknowns q = D p, with matrix B = R D⁻¹.
#[derive(Debug, Clone)]
pub(super) struct Model {
    pub(super) factor: Factor,
    pub(super) scale: DVector<f64>,
}

impl Model {
    /// Scales and prepares a linearised problem; `scale` is the diagonal of D.
    pub(super) fn new(
        linearisation: &Linearisation,
        scale: &DVector<f64>,
        settings: &Settings,
    ) -> Self {
        let matrix = scaled_triangle(linearisation, scale);
        let factor = Factor::new(matrix, linearisation.projected.clone(), settings.rank_tolerance);
        Self { factor, scale: scale.clone() }
    }

    /// Returns the problem with ½ D⁻¹ `acceleration` added to its gradient Bᵀc, where
    /// `acceleration` is Jᵀ r″. Returns `None` if B lacks rank.
    pub(super) fn with_acceleration(&self, acceleration: &DVector<f64>) -> Option<Factor> {
        let gradient = 0.5 * acceleration.component_div(&self.scale);
        let shift = self.factor.matrix().tr_solve_upper_triangular(&gradient)?;
        if !shift.iter().all(|value| value.is_finite()) {
            return None;
        }
        Some(Factor::new(
            self.factor.matrix().clone(),
            self.factor.projected() + shift,
            self.factor.tolerance(),
        ))
    }

    /// Returns the step p = D⁻¹ q within the radius, without constraints, and its predicted
    /// reductions.
    ///
    /// With `(BᵀB + λ) q = −Bᵀc`, the slope is −gᵀp = ‖B q‖² + λ‖q‖², free of cancellation.
    pub(super) fn unbounded_step(&mut self, x: &DVector<f64>, radius: f64) -> Step {
        let (q, damping) = self.factor.limited(radius);
        let image = self.factor.image(&q).norm_squared();
        let slope = image + damping * q.norm_squared();
        let point = x + q.component_div(&self.scale);
        Step { point, length: q.norm(), slope, predicted: slope - 0.5 * image, damping }
    }
}

/// Returns B = R D⁻¹.
fn scaled_triangle(linearisation: &Linearisation, scale: &DVector<f64>) -> DMatrix<f64> {
    let mut matrix = linearisation.triangle.clone();
    for (mut column, d) in matrix.column_iter_mut().zip(scale.iter()) {
        column /= *d;
    }
    matrix
}

impl Subproblem for Unconstrained {
    fn name(&self) -> &'static str {
        "Levenberg–Marquardt"
    }

    fn admit_start(&self, _start: &mut DVector<f64>) -> bool {
        true
    }

    fn prepare(
        &mut self,
        _x: &DVector<f64>,
        linearisation: &Linearisation,
        scale: &DVector<f64>,
        settings: &Settings,
    ) {
        self.model = Some(Model::new(linearisation, scale, settings));
    }

    fn free_gradient(&self, _x: &DVector<f64>, _j: usize, gradient: f64) -> f64 {
        gradient
    }

    fn accelerates_unconstrained(&self) -> bool {
        // An acceleration takes derivatives of all rows, but no reduction of them.
        self.model.as_ref().is_some_and(|model| model.scale.len() >= MANY_UNKNOWNS)
    }

    fn accelerated(
        &mut self,
        x: &DVector<f64>,
        acceleration: &DVector<f64>,
        damping: f64,
    ) -> Option<DVector<f64>> {
        let Model { factor, scale } = self.model.as_ref()?;
        let change = factor.response(&(0.5 * acceleration.component_div(scale)), damping)?;
        Some(x + &self.unaccelerated + change.component_div(scale))
    }

    fn step(&mut self, x: &DVector<f64>, radius: f64) -> Step {
        match &mut self.model {
            Some(model) => {
                let step = model.unbounded_step(x, radius);
                self.unaccelerated = &step.point - x;
                step
            }
            None => Step::none(x),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accelerations_are_added_to_the_gradient() {
        let triangle = DMatrix::from_row_slice(2, 2, &[3.0, 0.4, 0.0, 0.7]);
        let projected = DVector::from_vec(vec![1.0, -0.6]);
        let (scale, x) = (DVector::from_vec(vec![2.0, 0.5]), DVector::from_vec(vec![7.0, -4.0]));
        let acceleration = DVector::from_vec(vec![0.3, -1.1]);
        let gradient = triangle.tr_mul(&projected) + 0.5 * &acceleration;
        let linearisation =
            Linearisation { cost: 1.0, triangle: triangle.clone(), projected: projected.clone() };
        let model = Model::new(&linearisation, &scale, &Settings::default());
        let found = model.with_acceleration(&acceleration).unwrap().gradient();
        assert!((found.component_mul(&scale) - &gradient).amax() < 1e-12);
        let lacking = Linearisation { triangle: DMatrix::zeros(2, 2), ..linearisation.clone() };
        let lacking = Model::new(&lacking, &scale, &Settings::default());
        assert!(lacking.with_acceleration(&acceleration).is_none());

        // (JᵀJ + λ D²) p = −Jᵀr − ½ Jᵀr″ with the damping λ of the step.
        let mut subproblem = Unconstrained::default();
        subproblem.prepare(&x, &linearisation, &scale, &Settings::default());
        for radius in [0.2, 100.0] {
            let step = subproblem.step(&x, radius);
            assert_eq!(step.damping > 0.0, radius < 1.0);
            let point = subproblem.accelerated(&x, &acceleration, step.damping).unwrap();
            let damped = triangle.tr_mul(&triangle)
                + DMatrix::from_diagonal(&scale.component_mul(&scale)) * step.damping;
            let force = damped * (point - &x) + &gradient;
            assert!(force.amax() < 1e-12 * (1.0 + step.damping), "{force}");
        }
    }
}
