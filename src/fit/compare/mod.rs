//! Comparison of strategies, solvers and the procedure of \[Chen2021\] on one problem.

pub(super) mod baseline;
pub(super) mod comparison;
pub(super) mod procedure;
