//! Least-squares fits of an identification: strategies and their stages, solvers, registration of
//! bases and targets, start values of fixtures, and noise models.

pub(super) mod active_limits;
pub(super) mod alternation;
mod camera_start;
pub(super) mod constraints;
pub(super) mod custom_solver;
pub(super) mod earlier_data;
pub(super) mod fitting;
pub(super) mod fixture_location;
pub(super) mod gauge;
mod marker_pose;
pub(super) mod noise_model;
pub(super) mod parameter_size;
pub(super) mod placement;
pub(super) mod progress;
pub(super) mod registration;
pub(super) mod single_views;
pub(super) mod solver_choice;
pub(super) mod stage;
pub(super) mod strategy;
pub(super) mod unmoved;
mod unpredictable;
