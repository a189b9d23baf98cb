//! Effects of every family with realistic values on two arms, and poses in which all of them act.

use std::path::Path;

use flexcal::error::Location;
use flexcal::measurement::Measurements;
use flexcal::model::Model;
use flexcal::problem::{
    DeclaredCovariate, Effect, EffectDeclaration, Equilibrium, JointKind, Mount, PoseConditions,
    Problem,
};
use flexcal::rig::{Cause, TrueEffect};
use nalgebra::DVector;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use crate::common::arms::{ODD, TREE, golden_problem, parse};
use crate::common::effects::{Strong, compensator, of_lunar_sampler};
use crate::common::made::{at_random, of_targets};

/// Returns the lunar sampler with an offset before its shoulder that may bend, and all effects that
/// act on it.
pub fn lunar() -> (Problem, Vec<Strong>) {
    let mut arm = golden_problem();
    arm.joints[1].a = 0.3;
    arm.data.reference_temperature = Some(20.0);
    (arm, of_lunar_sampler())
}

/// Returns the arm with every kind of joint, a link along −x and an inclined rope, with effects.
pub fn odd() -> (Problem, Vec<Strong>) {
    let mut arm = parse(ODD);
    arm.data.reference_temperature = Some(20.0);
    arm.data.covariates = covariates(&["tilt_deg", "oil_bar"]);
    let lower = || "lower".to_owned();
    let all = vec![
        (Effect::JointCompliance { joint: 2 }, vec![1e-5]),
        (Effect::JointHarmonic { joint: 4, orders: vec![1, 7] }, vec![1e-4, 2e-4, 3e-4, 4e-4]),
        (Effect::JointWave { joint: 4, order: 12.5 }, vec![2e-4, -3e-4]),
        (Effect::GearRatio { joint: 4 }, vec![4e-3]),
        (Effect::Backlash { joint: 4 }, vec![5e-4]),
        (Effect::Backlash { joint: 5 }, vec![5e-4]),
        (Effect::JointNonlinearStiffness { joint: 4 }, vec![1e-8]),
        (Effect::JointNonlinearStiffness { joint: 3 }, vec![1e-7]),
        (Effect::JointLateralCompliance { joint: 4 }, vec![1e-5, 2e-5]),
        (compensator(3, [-0.2, 0.3], [0.1, 0.25], 0.15), vec![1500.0, 60.0]),
        (compensator(5, [0.15, 0.1], [-0.25, 0.05], 0.0), vec![800.0, -40.0]),
        (Effect::JointThermalDrift { joint: 4 }, vec![2e-5]),
        (Effect::JointThermalDriftLag { joint: 4, time_constant: 130.0 }, vec![2e-5]),
        (Effect::JointHysteresis { joint: 5, distance: 0.6 }, vec![2e-3]),
        (Effect::JointCoupling { joint: 4, from: 3 }, vec![3e-4]),
        (Effect::JointCoupling { joint: 3, from: 4 }, vec![3e-3]),
        (Effect::LinkBending { joint: 2 }, vec![1e-4]),
        (Effect::LinkBending { joint: 5 }, vec![3e-5]),
        (Effect::SlideBending { joint: 4 }, vec![3e-4]),
        (Effect::TwistBending { link: "upper".to_owned() }, vec![2e-5, -3e-5]),
        (Effect::TwistBending { link: lower() }, vec![-4e-5, 2e-5]),
        (Effect::LinkThermalBending { link: lower() }, vec![1e-5, 2e-5]),
        (Effect::LinkThermalBendingLag { link: lower(), time_constant: 400.0 }, vec![-1e-5, 2e-5]),
        (Effect::LinkThermalExpansionLag { link: lower(), time_constant: 70.0 }, vec![12e-6]),
        (Effect::LinkThermalExpansion { link: lower() }, vec![12e-6]),
        (Effect::ArmThermalExpansion, vec![23e-6]),
        (Effect::UnmodelledMass { link: lower() }, vec![1.4, 0.3]),
        (Effect::PayloadMass, vec![0.3]),
        (Effect::PayloadPosition, vec![0.05, 0.02, -0.04]),
        (Effect::HoistForce, vec![0.08]),
        (Effect::HoistDirection, vec![0.05, -0.03, 0.04]),
        (Effect::BaseCompliance, vec![1e-5, 2e-5]),
        (Effect::GravityDirection, vec![0.03, -0.02]),
        (Effect::DeflectedEquilibrium, vec![1.0]),
        (Effect::TrackerScale, vec![5e-4]),
        (Effect::FrameStrain, vec![2e-4, -1e-4, 0.0, 3e-4, 0.0, -2e-4]),
        (Effect::TrackerSettling { time_constant: 300.0 }, vec![2e-4, -1e-4, 3e-4]),
        (Effect::PayloadBacklash { joint: 4 }, vec![4e-4]),
        (Effect::TrackerDrift, vec![1e-7, 0.0, 2e-7]),
        (Effect::StationShift { at_time: 500.0 }, vec![1e-4, 2e-4, 0.0]),
        (Effect::StationMove { at_time: 500.0 }, vec![1e-4, 2e-4, 0.0, 1e-4, -5e-5, 2e-4]),
        (Effect::Covariate { joint: Mount::Joint(4), of: "tilt_deg".to_owned() }, vec![2e-5]),
        (Effect::Covariate { joint: Mount::Joint(3), of: "oil_bar".to_owned() }, vec![3e-6]),
        (
            Effect::Covariate { joint: Mount::Base, of: "tilt_deg".to_owned() },
            vec![2e-3, -1e-3, 3e-3, 1e-4, 2e-4, -3e-4],
        ),
    ];
    (arm, all)
}

/// Returns a tree of joints with effects on its trunk and several branches.
pub fn tree() -> (Problem, Vec<Strong>) {
    let mut arm = parse(TREE);
    arm.parameters.clear();
    arm.data.reference_temperature = Some(20.0);
    let link = |name: &str| name.to_owned();
    let all = vec![
        (Effect::JointCompliance { joint: 1 }, vec![1e-5]),
        (Effect::JointCompliance { joint: 7 }, vec![2e-4]),
        (Effect::JointHarmonic { joint: 2, orders: vec![1, 3] }, vec![1e-4, 2e-4, 3e-4, 4e-4]),
        (Effect::GearRatio { joint: 8 }, vec![4e-3]),
        (Effect::Backlash { joint: 3 }, vec![5e-4]),
        (Effect::JointNonlinearStiffness { joint: 2 }, vec![1e-7]),
        (Effect::JointLateralCompliance { joint: 2 }, vec![1e-5, 2e-5]),
        (compensator(1, [0.3, 0.0], [0.2, 0.2], 0.1), vec![1200.0, 100.0]),
        (compensator(8, [0.0, -0.1], [0.12, 0.0], 0.05), vec![2500.0, 30.0]),
        (Effect::JointThermalDrift { joint: 9 }, vec![2e-4]),
        (Effect::JointHysteresis { joint: 8, distance: 0.9 }, vec![2e-3]),
        (Effect::LinkThermalBendingLag { link: link("T"), time_constant: 250.0 }, vec![1e-5, 2e-5]),
        (Effect::JointCoupling { joint: 6, from: 3 }, vec![3e-3]),
        (Effect::LinkBending { joint: 6 }, vec![3e-4]),
        (Effect::SlideBending { joint: 4 }, vec![2e-3]),
        (Effect::TwistBending { link: link("L") }, vec![5e-5, -8e-5]),
        (Effect::LinkThermalBending { link: link("T") }, vec![1e-5, 2e-5]),
        (Effect::LinkThermalExpansion { link: link("R") }, vec![12e-6]),
        (Effect::ArmThermalExpansion, vec![23e-6]),
        (Effect::UnmodelledMass { link: link("L") }, vec![1.4, 0.3]),
        (Effect::PayloadMass, vec![0.6]),
        (Effect::PayloadPosition, vec![-0.03, 0.02, 0.06]),
        (Effect::HoistForce, vec![0.08]),
        (Effect::HoistDirection, vec![0.05, -0.03, 0.04]),
        (Effect::BaseCompliance, vec![1e-5, 2e-5]),
        (Effect::GravityDirection, vec![0.03, -0.02]),
        (Effect::DeflectedEquilibrium, vec![1.0]),
        (Effect::TrackerScale, vec![5e-4]),
        (Effect::PayloadBacklash { joint: 8 }, vec![4e-3]),
    ];
    (arm, all)
}

/// Returns declarations of covariates.
fn covariates(names: &[&str]) -> Vec<DeclaredCovariate> {
    let location = Location::file(Path::new("problem.toml"));
    let declared = |name: &&str| DeclaredCovariate {
        name: (*name).to_owned(),
        meaning: String::new(),
        location: location.clone(),
    };
    names.iter().map(declared).collect()
}

/// Declares effects in an arm; the equilibrium effect needs statics on the rigid arm.
pub fn declared(arm: &Problem, effects: &[Effect]) -> Problem {
    let mut arm = arm.clone();
    if effects.contains(&Effect::DeflectedEquilibrium) {
        arm.statics.equilibrium = Equilibrium::Undeflected;
    }
    let location = Location::file(Path::new("problem.toml"));
    let declare =
        |effect: &Effect| EffectDeclaration { effect: effect.clone(), location: location.clone() };
    arm.effects = effects.iter().map(declare).collect();
    arm
}

/// Returns an effect for the rig.
pub fn in_truth(arm: &Problem, (effect, values): &Strong) -> TrueEffect {
    TrueEffect::new(Cause::Catalogued(effect.clone()), values, &arm.joints).unwrap()
}

/// Draws poses in which every effect may act, with targets in turn and approach sides if requested.
pub fn poses(arm: &Problem, count: usize, approaches: bool, rng: &mut ChaCha8Rng) -> Measurements {
    let mut rows = of_targets(arm, at_random(arm, count, 1.5, rng));
    let n = arm.joints.len();
    rows.payload = Some(
        (0..count).map(|k| if k % 3 == 0 { 0.0 } else { rng.random_range(0.5..3.0) }).collect(),
    );
    rows.hoist = Some((0..count).map(|_| rng.random_range(30.0..60.0)).collect());
    rows.temperature = Some((0..count).map(|_| rng.random_range(10.0..35.0)).collect());
    rows.time = (0..count).map(|k| 60.0 + 90.0 * k as f64).collect();
    rows.time_measured = true;
    rows.covariates =
        (0..count * arm.data.covariates.len()).map(|_| rng.random_range(-3.0..9.0)).collect();
    let side = |k: usize, rng: &mut ChaCha8Rng| match arm.joints[k % n].kind {
        JointKind::Fixed => 0.0,
        _ if rng.random() => 1.0,
        _ => -1.0,
    };
    rows.approach = approaches.then(|| (0..count * n).map(|k| side(k, rng)).collect());
    rows
}

/// Returns the conditions of a row for the rig.
pub fn conditions(rows: &Measurements, row: usize) -> PoseConditions {
    rows.conditions(row)
}

/// Returns the indices of the parameters of effects.
pub fn of_effects(model: &Model) -> Vec<usize> {
    let is_effect = |name: &str| {
        let family = name.split(['[', '.']).next().unwrap();
        family == "law" || flexcal::laws::FAMILIES.iter().any(|known| known.name == family)
    };
    (0..model.parameters.len()).filter(|&k| is_effect(&model.parameters[k].name)).collect()
}

/// Returns the full parameter vector with these effect values and all other parameters nominal.
pub fn strengths(model: &Model, values: &[f64]) -> DVector<f64> {
    let mut x = DVector::zeros(model.parameters.len());
    let places = of_effects(model);
    assert_eq!(places.len(), values.len());
    for (k, value) in places.into_iter().zip(values) {
        x[k] = model.parameters[k].deviation(*value);
    }
    x
}
