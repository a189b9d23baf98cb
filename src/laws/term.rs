//! Parameters of effects.

use super::expression::Parsed;
use super::family::{At, Prior};
use super::parameter::LawParameter;

/// Parameter of an effect before it is placed on an arm.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectTerm {
    /// Name after the dot.
    pub name: String,
    /// Where it enters.
    pub at: At,
    /// Formula that multiplies it there; `None`: it is itself the quantity of its site.
    pub formula: Option<Parsed>,
    /// 1 σ of its prior.
    pub prior: Prior,
    /// Value where the effect has no size; `None`: 0.
    pub nominal: Option<Prior>,
    /// True if nature knows no negative values.
    pub never_negative: bool,
    /// The parameter inside of formulas that it is, with its bounds.
    pub inner: Option<LawParameter>,
}
