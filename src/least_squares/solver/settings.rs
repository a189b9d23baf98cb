//! Tolerances and limits common to all solvers.

/// When to stop, and how boldly to start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest cosine between residual and derivatives at a minimum; default 1e-10.
    pub gradient_tolerance: f64,
    /// Smallest relative reduction of the cost worth a step; default 1e-12.
    pub cost_tolerance: f64,
    /// Smallest step worth taking, relative to x, both scaled; default 1e-10.
    pub step_tolerance: f64,
    /// Singular values of the scaled Jacobian up to this fraction of the largest count as zero;
    /// default 1e-12.
    pub rank_tolerance: f64,
    /// First radius as a multiple of ‖D x‖ (of 1 where x = 0), but no less than ‖r‖; default 100.
    ///
    /// Where x is near zero its size says nothing; ‖r‖ is the length that orthogonal columns would
    /// need.
    pub initial_radius: f64,
    /// Largest number of steps tried, taken or not; default 500.
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

/// A length within this fraction of the radius fills it [Moré 1978].
pub(super) const RADIUS_SLACK: f64 = 0.1;
