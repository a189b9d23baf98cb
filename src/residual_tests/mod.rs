//! Whether structure is left in the residual of a fit: statistical tests, each with its bounds
//! under chance.
//!
//! A fitted residual r = (I − H) ε is neither independent nor equally scattered from pose to pose.
//! So the residual of each pose is studentised by its own leverage, and the tests of order and
//! dependence learn from permuted residuals, fitted again, what chance does.
//!
//! - `fit_residual`, `leverage`: what is tested; studentised residuals, poses left out.
//! - `size`, `outliers`, `statistic`: how large the residuals are and how they scatter, whether
//!   they follow one another or a covariate.
//! - `chance`, `permutation`: what each statistic does by chance. `judgement`, `outcome`: the
//!   verdict of all, and words for it.

mod chance;
mod covariate;
mod fit_residual;
mod judgement;
mod leverage;
mod outcome;
mod outliers;
mod permutation;
mod size;
mod statistic;
mod test;

pub use covariate::Covariate;
pub use fit_residual::{CovariateValues, FitResidual};
pub use outcome::{Findings, Outcome, ResidualTest, Sequence, Test, Untestable};
pub use test::test_residual;
