//! Grammar of laws: formulas that the catalogue does not contain are composed and compared at one
//! site, such as the coordinate of a joint.
//!
//! A law is a sum of up to three terms, and a term is a product of up to three factors, which are
//! functions of recorded quantities ([`dictionary`]). W is the Gram matrix of the site's lever in
//! all poses, with the fit projected out ([`site`]). The columns F of formulas then have the Gram
//! matrix FᵀWF and the product Fᵀp with the residual. The work does not grow with the number of
//! measured coordinates.
//!
//! Sums grow by a beam search ([`beam`]). Each has a description-length prior, in which every
//! choice costs the logarithm of the number of alternatives. Formulas whose predictions noise does
//! not distinguish form one class with one probability, represented by the simplest of them
//! ([`classes`]). The laws found are hypotheses of the evidence, in addition to the catalogue and
//! the functions without a law.

mod beam;
mod classes;
mod dictionary;
mod factor;
mod quantities;
mod refinement;
mod site;
mod terms;
mod written;

pub(super) use classes::ln_prior;
pub(super) use classes::{Proposal, proposals};
pub(super) use factor::FormulaSite;
pub(super) use quantities::Quantities;
pub(super) use site::{Noise, WhitenedSite};
pub(super) use written::Written;

/// Maximum number of poses on which formulas are searched. The formulas found are then evaluated on
/// all poses of the evidence.
pub(super) const MAX_POSES: usize = 160;
