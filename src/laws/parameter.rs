//! Parameters inside of formulas.

/// Named parameter inside of the formulas of a law.
#[derive(Debug, Clone, PartialEq)]
pub struct LawParameter {
    /// Name in formulas.
    pub name: String,
    /// Value at which the fit starts, SI.
    pub start: f64,
    /// Smallest value.
    pub min: Option<f64>,
    /// Greatest value.
    pub max: Option<f64>,
    /// 1 σ of a prior about the start.
    pub sigma: Option<f64>,
}
