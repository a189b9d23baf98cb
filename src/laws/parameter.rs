//! Parameters inside formulas.

/// Named parameter inside the formulas of a law, such as a time constant.
#[derive(Debug, Clone, PartialEq)]
pub struct LawParameter {
    /// Name in formulas.
    pub name: String,
    /// Value at which the fit starts, SI.
    pub start: f64,
    /// Smallest value, SI; `None` for no limit.
    pub min: Option<f64>,
    /// Largest value, SI; `None` for no limit.
    pub max: Option<f64>,
    /// Standard deviation (1 σ) of a Gaussian prior about the start value, SI; `None` for no prior.
    pub sigma: Option<f64>,
}
