//! Laws that no catalogue holds, written down: a grammar of formulas is searched at the coordinate
//! of a joint.
//!
//! A law is a sum of up to three terms, a term a product of up to three factors of what is known of
//! a pose ([`dictionary`]). With W the Gram matrix of the joint's lever in all poses, everything
//! else projected out ([`site`]), the columns of formulas have Gram matrix FᵀWF and product Fᵀp: no
//! work grows with the number of measured coordinates. Sums grow by a beam search ([`beam`]), each
//! with a description-length prior: every choice costs the logarithm of its alternatives. Formulas
//! whose predictions noise does not tell apart are one class and share its probability, the
//! simplest stands for it ([`classes`]). The laws found are hypotheses of the evidence, beside the
//! catalogue and the functions without a law.

mod beam;
mod classes;
mod dictionary;
mod factor;
mod prior;
mod quantities;
mod refinement;
mod site;
mod terms;
mod written;

pub(super) use classes::{Proposal, proposals};
pub(super) use prior::ln_prior;
pub(super) use quantities::Quantities;
pub(super) use site::{Noise, WhitenedSite};

/// Maximum number of poses on which formulas are searched. The formulas found are then evaluated on
/// all poses of the evidence.
pub(super) const MAX_POSES: usize = 160;
