//! Effects of the rig: none at zero, a displacement otherwise, and the displacement of their law.

use flexcal::problem::{Effect, PoseConditions, Problem};
use flexcal::rig::{Cause, Shape, TrueEffect};
use nalgebra::Vector3;

use super::bench::{effect, position};
use super::common::arms::golden_problem;
use super::common::effects::{Strong, of_lunar_sampler};
use super::common::golden::golden_rows;

/// Returns the lunar sampler as FORMAT declares it, with a rigid link, and a pose in which every
/// effect acts.
fn bench() -> (Problem, PoseConditions) {
    let mut arm = golden_problem();
    arm.joints[1].a = 0.3;
    let mut conditions = golden_rows("equilibrium.csv")[0].conditions();
    conditions.temperature = Some(28.0);
    conditions.approach = Some(vec![1.0, -1.0, 1.0, -1.0]);
    (conditions.time, conditions.elapsed) = (900.0, 840.0);
    (arm, conditions)
}

/// Returns every effect of the catalogue with a value, except equilibrium, which the rig always
/// has.
fn catalogue() -> Vec<Strong> {
    of_lunar_sampler()
        .into_iter()
        .filter(|(effect, _)| *effect != Effect::DeflectedEquilibrium)
        .collect()
}

#[test]
fn every_effect_is_inert_at_zero_and_moves_positions_when_it_is_not() {
    let (arm, conditions) = bench();
    let without = position(&arm, Vec::new(), &conditions);
    for (cause, strength) in catalogue() {
        let zero = effect(&arm, cause.clone(), &vec![0.0; strength.len()]);
        assert!((position(&arm, vec![zero], &conditions) - without).norm() < 1e-15, "{cause:?}");
        let moved = (position(&arm, vec![effect(&arm, cause.clone(), &strength)], &conditions)
            - without)
            .norm();
        println!("{:6.3} mm  {cause:?}", moved * 1e3);
        assert!(moved > 1e-5, "{cause:?} moves the target by {moved} m");
        // Each value has an effect by itself.
        for (k, value) in strength.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            if matches!(cause, Effect::UnmodelledMass { .. }) && k == 1 {
                continue;
            }
            let mut alone = vec![0.0; strength.len()];
            alone[k] = *value;
            if matches!(cause, Effect::UnmodelledMass { .. }) {
                alone[1] = strength[1];
            }
            let moved = (position(&arm, vec![effect(&arm, cause.clone(), &alone)], &conditions)
                - without)
                .norm();
            assert!(moved > 1e-7, "value {k} of {cause:?} moves the target by {moved} m");
        }
    }
}

#[test]
fn the_wrong_number_of_values_is_refused() {
    let (arm, _) = bench();
    for (cause, values) in catalogue() {
        let keys = TrueEffect::keys(&Cause::Catalogued(cause.clone()), &arm.joints);
        assert_eq!(keys.len(), values.len());
        let more = [values.as_slice(), &[1.0]].concat();
        assert!(TrueEffect::new(Cause::Catalogued(cause), &more, &arm.joints).is_err());
    }
}

/// Checks that an effect equals a change of the arm or of the conditions.
fn check(cause: &Effect, values: &[f64], change: impl Fn(&mut Problem, &mut PoseConditions)) {
    let (arm, conditions) = bench();
    let with = position(&arm, vec![effect(&arm, cause.clone(), values)], &conditions);
    let (mut changed, mut set) = (arm, conditions);
    change(&mut changed, &mut set);
    let expected = position(&changed, Vec::new(), &set);
    assert!((with - expected).norm() < 1e-11, "{cause:?}: {} m", (with - expected).norm());
}

#[test]
fn errors_of_a_joint_are_errors_of_its_angle() {
    let turn = |joint: usize, error: fn(f64) -> f64| {
        move |_: &mut Problem, set: &mut PoseConditions| {
            set.configuration[joint - 1] += error(set.configuration[joint - 1]);
        }
    };
    check(&Effect::GearRatio { joint: 3 }, &[4e-4], turn(3, |q| 4e-4 * q));
    check(
        &Effect::JointHarmonic { joint: 2, orders: vec![1, 3] },
        &[1e-4, 2e-4, 3e-4, 4e-4],
        turn(2, |q| {
            1e-4 * q.sin() + 2e-4 * q.cos() + 3e-4 * (3.0 * q).sin() + 4e-4 * (3.0 * q).cos()
        }),
    );
    check(&Effect::Backlash { joint: 2 }, &[6e-4], turn(2, |_| -3e-4));
    check(&Effect::JointThermalDrift { joint: 1 }, &[1e-5], turn(1, |_| 8e-5));
    check(&Effect::JointCoupling { joint: 4, from: 3 }, &[3e-4], |_, set| {
        set.configuration[3] += 3e-4 * set.configuration[2];
    });
    let (arm, conditions) = bench();
    for (shape, error) in [(Shape::Bump, (-0.5_f64 * 0.25).exp()), (Shape::Step, 0.5_f64.tanh())] {
        let centre = conditions.configuration[1] - 0.1;
        let outside =
            TrueEffect::new(Cause::Outside { joint: 2, shape }, &[1e-3, centre, 0.2], &arm.joints)
                .unwrap();
        let mut set = conditions.clone();
        set.configuration[1] += 1e-3 * error;
        let difference =
            position(&arm, vec![outside], &conditions) - position(&arm, Vec::new(), &set);
        assert!(difference.norm() < 1e-11);
    }
}

#[test]
fn elastic_effects_are_softer_joints_and_links() {
    check(&Effect::JointCompliance { joint: 3 }, &[1e-5], |arm, _| {
        arm.joints[2].stiffness = arm.joints[2].stiffness.map(|k| 1.0 / (1.0 / k + 1e-5));
    });
    check(&Effect::LinkBending { joint: 4 }, &[2e-5], |arm, _| {
        let beam = arm.joints[3].beam.as_mut().unwrap();
        for rigidity in [&mut beam.ei_y, &mut beam.ei_z] {
            *rigidity = rigidity.map(|ei| 1.0 / (1.0 / ei + 2e-5));
        }
    });
    check(&Effect::LinkBending { joint: 2 }, &[2e-5], |arm, _| {
        let mut beam = arm.joints[2].beam.clone().unwrap();
        (beam.mass, beam.ea, beam.gj, beam.hoist) = (0.0, None, None, None);
        (beam.ei_y, beam.ei_z) = (Some(5e4), Some(5e4));
        beam.masses.clear();
        arm.joints[1].beam = Some(beam);
    });
}

#[test]
fn effects_on_loads_are_other_loads() {
    check(&Effect::UnmodelledMass { link: "B".to_owned() }, &[0.4, 0.8], |arm, _| {
        let mut body = arm.joints[2].bodies[0].clone();
        (body.mass, body.position) = (0.4, Vector3::new(0.8, 0.0, 0.0));
        arm.joints[3].beam.as_mut().unwrap().masses.push(body);
    });
    check(&Effect::PayloadMass, &[0.1], |_, set| set.payload = set.payload.map(|mass| mass + 0.1));
    check(&Effect::HoistForce, &[0.05], |_, set| set.hoist = set.hoist.map(|force| force * 1.05));
    check(&Effect::HoistDirection, &[0.02, 0.01, 0.0], |arm, _| {
        let hoist = arm.joints[3].beam.as_mut().unwrap().hoist.as_mut().unwrap();
        hoist.direction = Vector3::new(0.02, 0.01, 1.0).normalize();
    });
    check(&Effect::GravityDirection, &[0.01, 0.02], |arm, _| {
        arm.gravity = nalgebra::Rotation3::new(Vector3::new(0.01, 0.02, 0.0)) * arm.gravity;
    });
}

#[test]
fn the_rope_of_a_trolley_leans_with_its_hook() {
    let (arm, conditions) = bench();
    let trolley =
        position(&arm, vec![effect(&arm, Effect::HoistDirection, &[0.0, 0.0, 0.03])], &conditions);
    // The rope leans from the position of the hook on the straight arm; the deflection of 30 mm
    // changes the lean by 0.001.
    let stiff = super::bench::stiffer(arm.clone(), 0.0, 0.0, 0.0);
    let mut hook = stiff.clone();
    hook.joints[3].theta = -conditions.configuration[3];
    (hook.joints[3].d, hook.joints[3].a) = (0.0, 0.95);
    hook.tool.target = Vector3::new(0.0, 0.06, 0.0);
    let hook = position(&hook, Vec::new(), &conditions);
    let lean = effect(&arm, Effect::HoistDirection, &[0.03 * hook.x, 0.03 * hook.y, 0.0]);
    let difference = (position(&arm, vec![lean], &conditions) - trolley).norm();
    let whole = (position(&arm, Vec::new(), &conditions) - trolley).norm();
    assert!(difference < 0.03 * whole, "{difference} of {whole}");
}

#[test]
fn without_approaches_backlash_follows_the_moment() {
    let (arm, mut conditions) = bench();
    conditions.approach = None;
    let without = position(&arm, Vec::new(), &conditions);
    let with =
        position(&arm, vec![effect(&arm, Effect::Backlash { joint: 2 }, &[1e-3])], &conditions);
    assert!(with.z < without.z - 1e-4, "the shoulder drops into its play");
}
