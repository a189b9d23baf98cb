//! Effects: what an arm and its measurement may do that its declared parameters do not say.
//!
//! One family a file. A family says where in the model its parameters enter (a
//! [`ParameterSite`](crate::model::parameter::ParameterSite)), what each is multiplied by there (a
//! [`Regressor`](crate::model::parameter::Regressor)), which effects of its kind are conceivable on an
//! arm, and what the search for effects has to know of it. The laws themselves are physics and live
//! in `mechanics`, once, generic over the scalar; every effect is inert at zero, so that its
//! derivatives exist before it is fitted.
//!
//! To add a family: a line with its name and arguments in the table of `problem/effect.rs`, a file
//! like `gear_ratio.rs` here, a line in [`FAMILIES`]; if it enters at a new place, a site and its
//! law in `mechanics` (docs/effects.md walks through it). An effect of one's own needs none of
//! this: it implements [`CustomEffect`].

mod backlash;
mod base_compliance;
mod catalogue;
mod covariate;
mod coverage;
mod custom;
mod deflected_equilibrium;
mod family;
mod frame_strain;
mod gear_ratio;
mod gravity_compensator;
mod gravity_direction;
mod hoist_direction;
mod hoist_force;
mod joint_compliance;
mod joint_coupling;
mod joint_harmonic;
mod joint_hysteresis;
mod joint_lateral_compliance;
mod joint_nonlinear_stiffness;
mod joint_thermal_drift;
mod joint_wave;
mod link_bending;
mod link_thermal_bending;
mod link_thermal_expansion;
mod payload_backlash;
mod payload_mass;
mod place;
mod slide_bending;
mod station_move;
mod station_shift;
mod thermal_lag;
mod tracker_drift;
mod tracker_scale;
mod tracker_settling;
mod twist_bending;
mod unmodelled_mass;

pub use catalogue::{FAMILIES, candidates, parameters};
pub use coverage::{Columns, DataCoverage, NO_REFERENCE, NO_TEMPERATURE};
pub use custom::CustomEffect;
pub use family::{Candidate, Family, Term};
pub(crate) use joint_harmonic::HIGHEST_ORDER;
