//! Derivatives of effects by dual numbers, compared with extrapolated differences.

use flexcal::fit::Placement;
use flexcal::least_squares::{check_jacobian, jacobian};
use flexcal::measurement::Measurements;
use flexcal::model::{Model, PoseResiduals};
use flexcal::problem::{Effect, Equilibrium, Joint, Problem};
use flexcal::quantity::Unit;
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::catalogue::{declared, lunar, odd, of_effects, poses, strengths, tree};
use crate::common::arms::path;
use crate::common::effects::{Strong, compensator};
use crate::common::made::{labels, model_of};

/// Largest allowed difference of a column of the Jacobian, relative to its norm.
const WORST: f64 = 1e-7;

/// Returns the difference steps: three times a realistic value, or the variation of the arm's
/// parameters.
fn steps(model: &Model, values: &[f64]) -> DVector<f64> {
    let of_arm = |unit| match unit {
        Unit::Angle | Unit::Length => 0.1,
        _ => 0.5,
    };
    let mut step = DVector::from_iterator(
        model.parameters.len(),
        model.parameters.iter().map(|parameter| of_arm(parameter.unit())),
    );
    for (k, value) in of_effects(model).into_iter().zip(values) {
        let parameter = &model.parameters[k];
        let size = if parameter.nominal == 0.0 { value.abs() } else { 0.1 };
        step[k] = 3.0 * size.max(1e-3 * parameter.sigma.unwrap_or(0.0));
    }
    step
}

/// Checks the columns of `unknowns` at `x`; exactly the parameters in `silent` must have no effect.
fn check_at(
    what: &str,
    problem: &Problem,
    rows: &Measurements,
    (x, step): (&DVector<f64>, &DVector<f64>),
    unknowns: &[usize],
    silent: &[&str],
) {
    let model = model_of(problem, rows);
    let all: Vec<usize> = (0..rows.len()).collect();
    let poses = Placement::of(rows).poses(rows, &all, 1e-3);
    let residuals = PoseResiduals::new(&model, poses, unknowns.to_vec(), x.clone());
    let (at, step) = (residuals.unknowns_in(x), residuals.unknowns_in(step));
    let exact = jacobian(&residuals, &at);
    let mut without = Vec::new();
    for (j, column) in check_jacobian(&residuals, &at, &step).columns.iter().enumerate() {
        let name = model.parameters[unknowns[j]].name.as_str();
        if exact.column(j).norm() * step[j] < 1e-9 {
            without.push(name);
            continue;
        }
        assert!(column.relative_error < WORST, "{what}: {name} is off: {column:?}");
    }
    assert_eq!(without, silent, "{what}: parameters without effect");
}

/// Checks effects one at a time or together, at zero and away from it.
fn check(
    what: &str,
    arm: &Problem,
    effects: &[Strong],
    rows: &Measurements,
    everything: bool,
    silent: &[&str],
) {
    let kinds: Vec<Effect> = effects.iter().map(|(effect, _)| effect.clone()).collect();
    let values: Vec<f64> = effects.iter().flat_map(|(_, values)| values.clone()).collect();
    let problem = declared(arm, &kinds);
    let model = model_of(&problem, rows);
    let unknowns =
        if everything { (0..model.parameters.len()).collect() } else { of_effects(&model) };
    let step = steps(&model, &values);
    let zero = DVector::zeros(model.parameters.len());
    let mut silent_at_zero: Vec<&str> = unknowns
        .iter()
        .map(|&k| model.parameters[k].name.as_str())
        .filter(|name| name.ends_with("].at"))
        .collect();
    silent_at_zero.extend(silent);
    check_at(
        &format!("{what}, {kinds:?} at zero"),
        &problem,
        rows,
        (&zero, &step),
        &unknowns,
        &silent_at_zero,
    );
    let mut strong = strengths(&model, &values);
    // Play that moments take up changes sign within 1 N·m, so the parameters of the arm
    // stay fixed there.
    for k in unknowns.iter().filter(|k| !of_effects(&model).contains(k)) {
        strong[*k] = 0.01;
    }
    check_at(&format!("{what}, {kinds:?}"), &problem, rows, (&strong, &step), &unknowns, silent);
}

#[test]
fn every_effect_on_elastic_arms() {
    for (what, (arm, all)) in [("lunar sampler", lunar()), ("odd arm", odd())] {
        for elements in [1, 3] {
            let mut arm = arm.clone();
            arm.statics.beam_elements = elements;
            for approaches in [true, false] {
                let rows = poses(&arm, 6, approaches, &mut ChaCha8Rng::seed_from_u64(5));
                for equilibrium in [Equilibrium::Deflected, Equilibrium::Undeflected] {
                    arm.statics.equilibrium = equilibrium;
                    for effect in &all {
                        let slides =
                            matches!(effect.0, Effect::Backlash { joint: 4 }) && what == "odd arm";
                        let silent: &[&str] = match &effect.0 {
                            _ if approaches => &[],
                            Effect::Backlash { .. } if slides => &["backlash[4].width"],
                            Effect::PayloadBacklash { joint: 3 } => &["payload-backlash[3].width"],
                            Effect::PayloadBacklash { .. } => &["payload-backlash[4].width"],
                            _ => &[],
                        };
                        check(what, &arm, std::slice::from_ref(effect), &rows, false, silent);
                    }
                }
            }
        }
    }
}

#[test]
fn every_effect_on_a_tree_of_joints_and_all_at_once() {
    let (mut arm, all) = tree();
    let rows = poses(&arm, 10, true, &mut ChaCha8Rng::seed_from_u64(9));
    for equilibrium in [Equilibrium::Deflected, Equilibrium::Undeflected] {
        arm.statics.equilibrium = equilibrium;
        for effect in &all {
            check("tree", &arm, std::slice::from_ref(effect), &rows, false, &[]);
        }
    }
    arm.statics.equilibrium = Equilibrium::Undeflected;
    arm.parameters = crate::common::arms::parse(crate::common::arms::TREE).parameters;
    check("tree", &arm, &all, &rows, true, &[]);
}

#[test]
fn all_effects_at_once_with_everything_else_free_in_two_sessions() {
    for (what, (arm, all)) in [("lunar sampler", lunar()), ("odd arm", odd())] {
        let mut rows = poses(&arm, 10, true, &mut ChaCha8Rng::seed_from_u64(6));
        rows.session = labels((0..10).map(|k| if k < 5 { "A" } else { "B" }));
        check(what, &arm, &all, &rows, true, &[]);
    }
}

#[test]
fn a_spring_with_everything_else_free() {
    // The moment of this spring changes with the joint by a tenth of the joint's stiffness, so a
    // rotation of the joint changes its load.
    let soft = |mut arm: Problem| {
        arm.joints
            .iter_mut()
            .filter_map(|joint| joint.stiffness.as_mut())
            .for_each(|stiffness| *stiffness /= 8.0);
        arm
    };
    let cases = [
        ("lunar sampler", soft(lunar().0), compensator(3, [0.1, -0.25], [0.3, 0.15], 0.2)),
        ("odd arm", soft(odd().0), compensator(3, [-0.2, 0.3], [0.1, 0.25], 0.15)),
        ("tree", soft(tree().0), compensator(2, [-0.2, 0.3], [0.3, 0.05], 0.0)),
    ];
    for (what, mut arm, spring) in cases {
        arm.statics.beam_elements = 2;
        if arm.parameters.is_empty() {
            arm.parameters = crate::common::arms::parse(crate::common::arms::TREE).parameters;
        }
        let Effect::GravityCompensator { joint, .. } = spring else { unreachable!() };
        let more = [
            (spring.clone(), vec![5e3, 100.0]),
            (Effect::GearRatio { joint }, vec![4e-3]),
            (Effect::Backlash { joint }, vec![5e-3]),
            (Effect::JointCompliance { joint }, vec![1e-5]),
            (Effect::JointLateralCompliance { joint }, vec![1e-5, 2e-5]),
        ];
        let rows = poses(&arm, 10, true, &mut ChaCha8Rng::seed_from_u64(11));
        for equilibrium in [Equilibrium::Deflected, Equilibrium::Undeflected] {
            arm.statics.equilibrium = equilibrium;
            check(what, &arm, &more, &rows, true, &[]);
        }
    }
}

#[test]
fn what_drives_the_joints_of_a_rigid_arm() {
    let mut arm = Problem::read(&path("problems/ur10-ipa")).unwrap();
    arm.data.reference_temperature = Some(20.0);
    let effects = [
        (
            Effect::JointHarmonic { joint: 2, orders: vec![1, 2, 30] },
            vec![1e-4, 2e-4, 3e-4, 4e-4, 1e-5, 2e-5],
        ),
        (Effect::JointHarmonic { joint: 2, orders: vec![3] }, vec![1e-4, 2e-4]),
        (Effect::GearRatio { joint: 3 }, vec![4e-4]),
        (Effect::GearRatio { joint: 2 }, vec![4e-4]),
        (Effect::JointCoupling { joint: 5, from: 4 }, vec![3e-4]),
        (Effect::JointThermalDrift { joint: 1 }, vec![1e-5]),
        (Effect::JointThermalDriftLag { joint: 2, time_constant: 300.0 }, vec![1e-5]),
        (Effect::JointHysteresis { joint: 4, distance: 1.3 }, vec![2e-4]),
        (Effect::TrackerScale, vec![5e-5]),
        (Effect::FrameStrain, vec![2e-5, -1e-5, 0.0, 3e-5, 0.0, -2e-5]),
        (Effect::TrackerSettling { time_constant: 300.0 }, vec![2e-4, -1e-4, 3e-4]),
        (Effect::TrackerDrift, vec![1e-7, 0.0, 2e-7]),
        (Effect::StationShift { at_time: 500.0 }, vec![1e-4, 2e-4, 0.0]),
        (Effect::StationMove { at_time: 500.0 }, vec![1e-4, 2e-4, 0.0, 1e-4, -5e-5, 2e-4]),
    ];
    let mut rows = poses(&arm, 16, false, &mut ChaCha8Rng::seed_from_u64(7));
    rows.session = labels((0..16).map(|k| if k < 8 { "A" } else { "B" }));
    for effect in &effects {
        check("UR10", &arm, std::slice::from_ref(effect), &rows, false, &[]);
    }
    check("UR10", &arm, &effects, &rows, false, &[]);
    // With play or compliance the same arm is no longer rigid.
    let soft = [effects.as_slice(), &[(Effect::Backlash { joint: 3 }, vec![5e-4])]].concat();
    rows.approach = poses(&arm, 16, true, &mut ChaCha8Rng::seed_from_u64(8)).approach;
    check("UR10 with play", &arm, &soft, &rows, false, &[]);
}

/// Scales all loads and stiffnesses of an arm and its poses by `factor`: equal deflections under
/// other moments.
fn loaded(arm: &Problem, rows: &Measurements, factor: f64) -> (Problem, Measurements) {
    let (mut arm, mut rows) = (arm.clone(), rows.clone());
    arm.gravity *= factor;
    rows.hoist.iter_mut().flatten().for_each(|force| *force *= factor);
    for joint in &mut arm.joints {
        joint.stiffness.iter_mut().for_each(|stiffness| *stiffness *= factor);
        if let Some(beam) = &mut joint.beam {
            let rigidities = [&mut beam.ea, &mut beam.ei_y, &mut beam.ei_z, &mut beam.gj];
            rigidities.into_iter().flatten().for_each(|rigidity| *rigidity *= factor);
            beam.hoist.iter_mut().for_each(|hoist| hoist.force *= factor);
        }
    }
    (arm, rows)
}

#[test]
fn every_effect_under_any_load() {
    let (arm, all) = lunar();
    let plain = poses(&arm, 4, false, &mut ChaCha8Rng::seed_from_u64(9));
    // Upper bound of the moments: all masses at the end of the outstretched arm.
    let bodies = |joint: &Joint| joint.bodies.iter().map(|body| body.mass).sum::<f64>();
    let beam = |joint: &Joint| joint.beam.iter().map(|segment| segment.mass).sum::<f64>();
    let mass = plain.payload.iter().flatten().fold(0.0_f64, |most, mass| most.max(*mass))
        + arm.joints.iter().map(|joint| bodies(joint) + beam(joint)).sum::<f64>();
    let reach: f64 = arm.joints.iter().map(|joint| joint.a.abs() + joint.d.abs()).sum();
    for moment in [1.0, 1e1, 1e2, 1e3, 1e4] {
        let (arm, rows) = loaded(&arm, &plain, moment / (arm.gravity.norm() * mass * reach));
        for (effect, _) in &all {
            let problem = declared(&arm, std::slice::from_ref(effect));
            let model = model_of(&problem, &rows);
            let unknowns = of_effects(&model);
            let rest = Placement::of(&rows).poses(&rows, &[0, 1, 2, 3], 1.0);
            let x = DVector::zeros(model.parameters.len());
            let residuals = PoseResiduals::new(&model, rest, unknowns.clone(), x);
            let zero = DVector::zeros(unknowns.len());
            let exact = jacobian(&residuals, &zero);
            assert!(
                exact.iter().all(|value| value.is_finite()),
                "{effect:?} at {moment} N·m: {exact}"
            );
            // Steps move the target by a tenth of a millimetre; the position of a zero mass moves
            // nothing.
            let norms: Vec<f64> = exact.column_iter().map(|column| column.norm()).collect();
            let step = DVector::from_iterator(
                norms.len(),
                norms.iter().map(|norm| 1e-4 / norm.max(1e-12)),
            );
            for (column, norm) in
                check_jacobian(&residuals, &zero, &step).columns.iter().zip(&norms)
            {
                assert!(
                    *norm < 1e-12 || column.relative_error < WORST,
                    "{effect:?} at {moment} N·m: {column:?}"
                );
            }
        }
    }
}
