//! Levenberg–Marquardt: the step that minimises the linearised problem within a scaled sphere.

use nalgebra::{DMatrix, DVector};

use super::{Factor, Settings, Step, Subproblem, TrustRegion};
use crate::least_squares::{Linearisation, MANY_UNKNOWNS};

/// Levenberg–Marquardt in its trust-region form, for unknowns without bounds.
///
/// min ‖J p + r‖ subject to ‖D p‖ ≤ Δ, that is `(JᵀJ + λD²) p = −Jᵀr` with λ ≥ 0            [Moré
/// 1978]
///
/// Needs an [`Objective`](crate::least_squares::Objective); solved from the n × n factor of J
/// alone. Redundant unknowns are allowed: what the data cannot see does not move. Of many unknowns
/// steps that miss their forecast follow the bend of the way [Transtrum & Sethna 2012].
pub fn levenberg_marquardt(settings: Settings) -> TrustRegion<Unconstrained> {
    TrustRegion::new(Unconstrained::default(), settings)
}

/// The step within a sphere ‖D p‖ ≤ Δ and nothing else.
#[derive(Debug, Clone, Default)]
pub struct Unconstrained {
    model: Option<Model>,
    /// The last step.
    straight: DVector<f64>,
}

/// The linearised problem in scaled unknowns q = D p: B = R D⁻¹.
#[derive(Debug, Clone)]
pub(super) struct Model {
    pub(super) factor: Factor,
    pub(super) scale: DVector<f64>,
}

impl Model {
    pub(super) fn new(
        linearisation: &Linearisation,
        scale: &DVector<f64>,
        settings: &Settings,
    ) -> Self {
        let matrix = scaled_triangle(linearisation, scale);
        let factor = Factor::new(matrix, linearisation.projected.clone(), settings.rank_tolerance);
        Self { factor, scale: scale.clone() }
    }

    /// The problem whose gradient is larger by ½ `bend`.
    pub(super) fn bent(&self, bend: &DVector<f64>) -> Option<Factor> {
        let bend = 0.5 * bend.component_div(&self.scale);
        let shift = self.factor.matrix().tr_solve_upper_triangular(&bend)?;
        if !shift.iter().all(|value| value.is_finite()) {
            return None;
        }
        Some(Factor::new(
            self.factor.matrix().clone(),
            self.factor.constant() + shift,
            self.factor.tolerance(),
        ))
    }

    /// p = D⁻¹ q from x, with what the linearised problem says of it.
    ///
    /// With `(BᵀB + λ) q = −Bᵀc`: −gᵀp = ‖B q‖² + λ‖q‖², free of cancellation.
    pub(super) fn unbounded_step(&mut self, x: &DVector<f64>, radius: f64) -> Step {
        let (q, damping) = self.factor.limited(radius);
        let image = self.factor.image(&q).norm_squared();
        let slope = image + damping * q.norm_squared();
        let point = x + q.component_div(&self.scale);
        Step { point, length: q.norm(), slope, predicted: slope - 0.5 * image, damping }
    }
}

/// B = R D⁻¹.
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

    fn admit(&self, _start: &mut DVector<f64>) -> bool {
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

    fn bends_freely(&self) -> bool {
        // A bend takes derivatives that are not reduced.
        self.model.as_ref().is_some_and(|model| model.scale.len() >= MANY_UNKNOWNS)
    }

    fn bent(
        &mut self,
        x: &DVector<f64>,
        bend: &DVector<f64>,
        damping: f64,
    ) -> Option<DVector<f64>> {
        let Model { factor, scale } = self.model.as_ref()?;
        let turned = factor.response(&(0.5 * bend.component_div(scale)), damping)?;
        Some(x + &self.straight + turned.component_div(scale))
    }

    fn step(&mut self, x: &DVector<f64>, radius: f64) -> Step {
        match &mut self.model {
            Some(model) => {
                let step = model.unbounded_step(x, radius);
                self.straight = &step.point - x;
                step
            }
            None => Step::none(x),
        }
    }
}
