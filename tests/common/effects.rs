//! Effects of the catalogue with values of realistic size.

use flexcal::problem::{Effect, FreeLength};

/// Effect with its values in SI units.
pub type Strong = (Effect, Vec<f64>);

/// Returns a spring at a joint between two points of the plane across its axis \[m\].
pub fn compensator(joint: usize, anchor: [f64; 2], lever: [f64; 2], free_length: f64) -> Effect {
    Effect::GravityCompensator { joint, anchor, lever, free_length: FreeLength(free_length) }
}

/// Returns an effect of every family on the lunar sampler, whose second, rigid link gets a length.
pub fn of_lunar_sampler() -> Vec<Strong> {
    let link = || "B".to_owned();
    vec![
        (Effect::JointCompliance { joint: 2 }, vec![1e-5]),
        (Effect::JointHarmonic { joint: 2, orders: vec![1, 3] }, vec![1e-4, 2e-4, 3e-4, 4e-4]),
        (Effect::JointWave { joint: 3, order: 7.37 }, vec![2e-4, -1e-4]),
        (Effect::GearRatio { joint: 3 }, vec![4e-4]),
        (Effect::Backlash { joint: 3 }, vec![5e-4]),
        (Effect::JointNonlinearStiffness { joint: 2 }, vec![2e-11]),
        (Effect::JointLateralCompliance { joint: 3 }, vec![1e-6, 2e-6]),
        (compensator(2, [0.1, -0.25], [0.3, 0.15], 0.2), vec![900.0, 80.0]),
        (Effect::JointThermalDrift { joint: 2 }, vec![1e-5]),
        (Effect::JointThermalDriftLag { joint: 3, time_constant: 200.0 }, vec![1e-5]),
        (Effect::JointHysteresis { joint: 2, distance: 0.7 }, vec![3e-4]),
        (Effect::JointCoupling { joint: 4, from: 3 }, vec![3e-4]),
        (Effect::LinkBending { joint: 2 }, vec![1e-5]),
        (Effect::TwistBending { link: link() }, vec![2e-6, -3e-6]),
        (Effect::LinkThermalBending { link: link() }, vec![1e-5, 2e-5]),
        (Effect::LinkThermalExpansion { link: link() }, vec![12e-6]),
        (Effect::ArmThermalExpansion, vec![23e-6]),
        (Effect::LinkThermalBendingLag { link: link(), time_constant: 150.0 }, vec![1e-5, -2e-5]),
        (Effect::LinkThermalExpansionLag { link: link(), time_constant: 400.0 }, vec![12e-6]),
        (Effect::UnmodelledMass { link: link() }, vec![0.4, 0.8]),
        (Effect::BodyMass { joint: 3 }, vec![0.2]),
        (Effect::PayloadMass, vec![0.1]),
        (Effect::PayloadPosition, vec![0.02, -0.03, 0.05]),
        (Effect::HoistForce, vec![0.05]),
        (Effect::HoistDirection, vec![0.02, 0.01, 0.03]),
        (Effect::BaseCompliance, vec![1e-6, 2e-6]),
        (Effect::GravityDirection, vec![0.01, 0.02]),
        (Effect::DeflectedEquilibrium, vec![1.0]),
        (Effect::TrackerScale, vec![5e-5]),
        (Effect::FrameStrain, vec![2e-4, -1e-4, 0.0, 3e-4, 0.0, -2e-4]),
        (Effect::TrackerSettling { time_constant: 300.0 }, vec![2e-4, -1e-4, 3e-4]),
        (Effect::PayloadBacklash { joint: 3 }, vec![4e-4]),
        (Effect::TrackerDrift, vec![1e-7, 0.0, 2e-7]),
        (Effect::StationShift { at_time: 500.0 }, vec![1e-4, 2e-4, 0.0]),
        (Effect::StationMove { at_time: 500.0 }, vec![1e-4, 2e-4, 0.0, 1e-4, -5e-5, 2e-4]),
    ]
}
