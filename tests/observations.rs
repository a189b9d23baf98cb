//! Rows that measure contacts with points and surfaces, distances to anchors, or tilts.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]
#![expect(clippy::print_stdout, reason = "figures for those who ask with --nocapture")]

mod common;

#[path = "observations/arms.rs"]
mod arms;
#[path = "observations/bad.rs"]
mod bad;
#[path = "observations/bench.rs"]
mod bench;
#[path = "observations/camera_plans.rs"]
mod camera_plans;
#[path = "observations/cameras.rs"]
mod cameras;
#[path = "observations/derivatives.rs"]
mod derivatives;
#[path = "observations/lens_laws.rs"]
mod lens_laws;
#[path = "observations/moved.rs"]
mod moved;
#[path = "observations/named.rs"]
mod named;
#[path = "observations/open_poses.rs"]
mod open_poses;
#[path = "observations/overstated.rs"]
mod overstated;
#[path = "observations/recovery.rs"]
mod recovery;
#[path = "observations/results.rs"]
mod results;
#[path = "observations/shutter.rs"]
mod shutter;
#[path = "observations/view_readings.rs"]
mod view_readings;
#[path = "observations/views.rs"]
mod views;
