//! Data of the figure of an effect: the partial residual of each pose over the regressor of the
//! effect, and the fitted law.
//!
//! The partial residual is the residual of the fit plus the fitted displacement by the effect. For
//! an effect on a joint it is converted to the error of the joint coordinate by the lever of each
//! pose. For other effects it is the component along the displacement by the effect.

mod effect;
mod figure;
mod terms;
mod unexplained;
mod view;

pub(super) use effect::{EffectFit, coordinates, of};
pub use figure::Quantity;
pub use figure::{Cause, Point};
pub(super) use unexplained::unexplained;
