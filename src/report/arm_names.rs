//! Names of the arms whose errors headlines, tables and figures compare.

/// Name of the nominal arm, with base and tool fitted if these are free.
pub(super) const NOMINAL_ARM: &str = "nominal arm";
/// Name of the fitted arm of the declared problem.
pub(super) const DECLARED_ARM: &str = "as declared, fitted";
/// Name of the arm of the extended problem.
pub(super) const EXTENDED_ARM: &str = "with what was found";
