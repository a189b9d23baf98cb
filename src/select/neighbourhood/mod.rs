//! Linear neighbourhood of a fit, in which candidates are tested without being fitted.
//!
//! - [`Linearised`]: the model with a column for every site where an effect may enter.
//! - [`LinearNeighbourhood`]: a fit of this linearised model.
//! - `Score`, `Sums`, `Gain`: reduction of the squared residual by additional columns, and its
//!   p-value.
//! - `Scan`: tests of all candidates against one fit.

mod cross_validation;
mod left_out;
mod linear;
mod linearised;
mod orthonormal;
mod scan;
mod score;

pub(super) use left_out::{HatBlocks, PartSquares};
pub(crate) use linear::{LinearNeighbourhood, Unknowns};
pub(super) use linearised::Derivatives;
pub(crate) use linearised::Linearised;
pub(crate) use scan::{Scan, Tried, tries};
pub(super) use score::Score;
