//! Laws as data: sites, formulas, families of effects, and the catalogue of families.
//!
//! A law multiplies parameters by formulas of recorded quantities of a pose, and adds the products
//! to a quantity of the arm, its base, or the measurement. `catalogue` has one entry for each
//! family; a `Law` is declared in a problem file. Everything about an effect follows from these
//! data: its parameters and their units, the columns it needs, the candidates of a search, words,
//! and file syntax.

mod argument;
mod catalogue;
mod effect;
pub mod expression;
mod family;
mod law;
mod quantity;
mod site;
mod sizes;
mod term;
mod text;

pub(crate) use argument::quoted;
pub(crate) use argument::{Argument, ArgumentKind};
pub use argument::{FreeLength, Mount};
pub(crate) use catalogue::NAMES;
pub use catalogue::{Effect, FAMILIES};
pub(crate) use effect::{declaration, to_three_digits};
pub(crate) use family::{At, Chance, Family, Need, Only, Prior, RANGE_AXIS, Search};
pub(crate) use law::{FOCAL, LAW};
pub(crate) use law::{Law, LawPrior, LawSite, NamedCamera};
pub use quantity::Quantity;
pub(crate) use site::ArmField;
pub use site::{BeamField, JointField};
pub(crate) use term::EffectTerm;
pub(crate) use term::LawParameter;
