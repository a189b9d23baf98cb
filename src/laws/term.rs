//! Parameters of effects, and parameters inside formulas.

use super::expression::Parsed;
use super::family::{At, Prior};

/// Parameter of an effect before it is resolved on an arm.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectTerm {
    /// Last part of the parameter's name, after the dot.
    pub name: String,
    /// Site of the model at which the parameter acts.
    pub at: At,
    /// Formula that multiplies the parameter; `None` if the parameter replaces the quantity at its
    /// site.
    pub formula: Option<Parsed>,
    /// Rule for 1 σ of the parameter's prior.
    pub prior: Prior,
    /// Rule for the nominal value, at which the effect vanishes; `None` for 0.
    pub nominal: Option<Prior>,
    /// True if a negative value is physically impossible.
    pub never_negative: bool,
    /// Declaration and bounds of a parameter inside formulas; `None` for a coefficient.
    pub inner: Option<LawParameter>,
}

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
