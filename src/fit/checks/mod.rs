//! Checks of a fit: whether its result can be trusted, and what to check in the input.

pub(super) mod cautions;
pub(super) mod held_out;
pub(super) mod judgement;
pub(super) mod kind;
pub(super) mod misread;
pub(super) mod outliers;
pub(super) mod point_spread;
pub(super) mod pose_sufficiency;
pub(super) mod quality;
pub(super) mod required_columns;
