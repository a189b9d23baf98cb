//! Step of the trust-region loop.

use nalgebra::DVector;

/// Step within the radius, with its predictions by the linearised problem.
#[derive(Debug, Clone)]
pub struct Step {
    /// Point x + p that the step reaches.
    pub point: DVector<f64>,
    /// Length ‖D p‖ of the step p, scaled by the diagonal matrix D.
    pub length: f64,
    /// First-order reduction −gᵀp of the cost ½‖r‖² by the step p, with the gradient g.
    pub slope: f64,
    /// Reduction ½‖r‖² − ½‖J p + r‖² of the cost by the step p that the linearised residuals
    /// predict.
    pub predicted: f64,
    /// Damping λ, zero if the radius did not limit the step.
    pub damping: f64,
}

impl Step {
    /// Creates a step of length zero, which stops the solver.
    pub(super) fn none(x: &DVector<f64>) -> Self {
        Self { point: x.clone(), length: 0.0, slope: 0.0, predicted: 0.0, damping: 0.0 }
    }
}
