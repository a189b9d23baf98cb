//! Parameters of effects.

use super::expression::Parsed;
use super::family::{At, Prior};
use super::parameter::LawParameter;

/// Parameter of an effect before it is resolved on an arm.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectTerm {
    /// Part of its name after the dot.
    pub name: String,
    /// Site of the model where it enters.
    pub at: At,
    /// Formula that multiplies it there; `None` if it is itself the quantity of its site.
    pub formula: Option<Parsed>,
    /// Rule for 1 σ of its prior.
    pub prior: Prior,
    /// Value at which the effect vanishes; `None` for 0.
    pub nominal: Option<Prior>,
    /// True if a negative value is physically impossible.
    pub never_negative: bool,
    /// Parameter inside formulas that this is, with its bounds; `None` for a coefficient.
    pub inner: Option<LawParameter>,
}
