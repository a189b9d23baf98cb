//! Statistical tests of the residual of a fit: does it contain structure that an effect could
//! explain? Each test states the bounds of its statistic under noise alone.
//!
//! A fitted residual r = (I − H) ε is neither independent nor of equal variance from pose to pose.
//! Therefore the residual of each pose is studentised by its leverage. Null distributions of the
//! tests of order and dependence come from permuted residuals that are fitted again.
//!
//! - `fit_residual`, `leverage`: the input, studentised residuals, and fits without some poses.
//! - `size`, `outliers`, `statistic`: size and distribution of the residuals, order, and dependence
//!   on covariates.
//! - `chance`, `permutation`: null distributions.
//! - `judgement`, `outcome`: decision over all tests, its results and their sentences.

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
pub(crate) use fit_residual::MIN_RESIDUAL_SIGMAS;
pub use fit_residual::{CovariateValues, FitResidual};
pub use outcome::{Outcome, ResidualTest, ResidualTests, Sequence, Test, Untestable};
pub use test::test_residual;
