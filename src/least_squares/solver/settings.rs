//! Tolerances and limits common to all solvers.

/// Stopping tolerances, rank tolerance and initial radius of a solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest cosine between the residual and any derivative column at convergence; default 1e-10.
    pub gradient_tolerance: f64,
    /// Smallest relative reduction of the cost that continues the iteration; default 1e-12.
    pub cost_tolerance: f64,
    /// Smallest step ‖D p‖ relative to ‖D x‖ that continues the iteration; default 1e-10.
    pub step_tolerance: f64,
    /// Singular values of the scaled Jacobian up to this fraction of the largest count as zero;
    /// default 1e-12.
    pub rank_tolerance: f64,
    /// Initial radius as a multiple of ‖D x‖ (of 1 if x = 0), at least ‖r‖; default 100.
    ///
    /// Near x = 0 the size of x is no useful scale; ‖r‖ is the step length that orthogonal columns
    /// would need.
    pub initial_radius: f64,
    /// Maximum number of steps tried, accepted or not; default 500.
    pub max_iterations: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            gradient_tolerance: 1e-10,
            cost_tolerance: 1e-12,
            step_tolerance: 1e-10,
            rank_tolerance: 1e-12,
            initial_radius: 100.0,
            max_iterations: 500,
        }
    }
}

/// Relative deviation of a step length from the radius that is accepted, so that λ needs few
/// iterations [Moré 1978].
pub(super) const MAX_RADIUS_DEVIATION: f64 = 0.1;
