//! Effects of the model compared with those of the rig, which shares no mechanics with it, and at
//! zero.

use std::path::Path;

use flexcal::measurement::Measurements;
use flexcal::problem::{Effect, JointKind, Problem};
use flexcal::rig::Rig;
use nalgebra::{DVector, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::catalogue::{conditions, declared, in_truth, lunar, odd, poses, strengths, tree};
use crate::common::effects::Strong;
use crate::common::made::{model_of, predicted};

/// Allowed relative difference between model and rig.
const PART: f64 = 0.005;
/// Allowed absolute difference between model and rig [m].
const FLOOR: f64 = 1e-6;

fn measured(arm: &Problem, effects: &[Strong], rows: &Measurements) -> Vec<Vector3<f64>> {
    let effects = effects.iter().map(|effect| in_truth(arm, effect)).collect();
    let rig = Rig::new(arm.clone(), effects);
    let word = |row: usize| {
        rows.target.as_ref().map_or("", |targets| targets.names[targets.of_row[row]].as_str())
    };
    (0..rows.len()).map(|row| rig.pose_of(word(row), &conditions(rows, row)).unwrap().0).collect()
}

/// Compares the displacement by an effect: largest displacement, largest difference, and the limit.
fn check(arm: &Problem, effect: &Strong, rows: &Measurements) {
    let with = declared(arm, std::slice::from_ref(&effect.0));
    let x = strengths(&model_of(&with, rows), &effect.1);
    let strong = predicted(&with, rows, &x);
    let rest = predicted(arm, rows, &DVector::zeros(model_of(arm, rows).parameters.len()));
    let (rig_strong, rig_rest) =
        (measured(arm, std::slice::from_ref(effect), rows), measured(arm, &[], rows));
    let (mut change, mut difference) = (0.0_f64, 0.0_f64);
    for row in 0..rows.len() {
        let expected = rig_strong[row] - rig_rest[row];
        let off = (strong[row] - rest[row] - expected).norm();
        assert!(
            off < PART * expected.norm() + FLOOR,
            "{:?}, row {row}: {} m off, the effect is {} m",
            effect.0,
            off,
            expected.norm()
        );
        (change, difference) = (change.max(expected.norm()), difference.max(off));
    }
    println!("{:8.4} mm, off by {:.5} mm  {:?}", change * 1e3, difference * 1e3, effect.0);
    // A moment moves no prismatic joint: without an approach side its play has no effect.
    let slides = |joint: usize| arm.joints[joint - 1].kind == JointKind::Prismatic;
    let silent = match effect.0 {
        Effect::DeflectedEquilibrium => true,
        Effect::Backlash { joint } => slides(joint) && rows.approach.is_none(),
        Effect::PayloadBacklash { .. } => rows.approach.is_none(),
        _ => false,
    };
    assert!(silent || change > 1e-5, "{:?} changes nothing", effect.0);
}

fn check_all((mut arm, all): (Problem, Vec<Strong>), seed: u64) {
    arm.statics.beam_elements = 12;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for approaches in [true, false] {
        let rows = poses(&arm, 8.max(2 * arm.targets.len()), approaches, &mut rng);
        for effect in &all {
            check(&arm, effect, &rows);
        }
    }
}

#[test]
fn effects_on_the_lunar_sampler_are_those_of_the_rig() {
    check_all(lunar(), 1);
}

#[test]
fn effects_on_an_arm_with_every_kind_of_joint_are_those_of_the_rig() {
    check_all(odd(), 2);
}

#[test]
fn effects_on_a_tree_of_joints_are_those_of_the_rig() {
    check_all(tree(), 7);
}

#[test]
fn laws_at_every_site_are_those_of_the_rig() {
    let motions = ["x", "y", "z", "rx", "ry", "rz"];
    let cases = [(lunar(), "joint3", "B", "M3", 1e-4), (odd(), "joint3", "lower", "M2", 1e-3)];
    for ((mut arm, _), joint, link, moment, size) in cases {
        arm.statics.beam_elements = 12;
        let rows = poses(&arm, 8, true, &mut ChaCha8Rng::seed_from_u64(5));
        let moved = |place: &str| motions.map(|motion| format!("{place}.{motion}"));
        let sites = ["base", "tool", joint, &format!("{joint}.after")].map(moved).concat();
        let read = ["x", "y", "z", "range"].map(|axis| format!("measurement.{axis}"));
        let formula = format!("sin(q2)*(1 + T/10) + {moment}/300 + payload*approach2");
        let of_commands = [vec![joint.to_owned()], sites, read.to_vec()].concat();
        let strains = ["curvature_y", "curvature_z", "strain"].map(|of| format!("{link}.{of}"));
        let cases = of_commands.iter().map(|site| (site, formula.as_str()));
        for (site, formula) in cases.chain(strains.iter().map(|site| (site, "T*(1 + payload/5)"))) {
            let text = format!("law = {{ name = 'w', at = '{site}', terms = ['{formula}'] }}");
            let law = arm.effect(&text, Path::new("law")).unwrap().effect;
            check(&arm, &(law, vec![size]), &rows);
        }
    }
}

#[test]
fn several_effects_at_once_are_those_of_the_rig() {
    for (mut arm, mut all) in [lunar(), odd(), tree()] {
        arm.statics.beam_elements = 12;
        all.retain(|(effect, _)| *effect != Effect::DeflectedEquilibrium);
        let rows = poses(&arm, 8, true, &mut ChaCha8Rng::seed_from_u64(3));
        let effects: Vec<Effect> = all.iter().map(|(effect, _)| effect.clone()).collect();
        let values: Vec<f64> = all.iter().flat_map(|(_, values)| values.clone()).collect();
        let with = declared(&arm, &effects);
        let ours = predicted(&with, &rows, &strengths(&model_of(&with, &rows), &values));
        let (theirs, rest) = (measured(&arm, &all, &rows), measured(&arm, &[], &rows));
        for row in 0..rows.len() {
            let (off, change) =
                ((ours[row] - theirs[row]).norm(), (theirs[row] - rest[row]).norm());
            assert!(off < PART * change + FLOOR, "row {row}: {off} m off of {change} m");
        }
    }
}

#[test]
fn every_effect_is_inert_at_zero() {
    for (arm, all) in [lunar(), odd(), tree()] {
        for approaches in [true, false] {
            let rows = poses(&arm, 6, approaches, &mut ChaCha8Rng::seed_from_u64(4));
            for (effect, _) in &all {
                let with = declared(&arm, std::slice::from_ref(effect));
                let mut without = with.clone();
                without.effects.clear();
                let zero = |problem: &Problem| {
                    predicted(
                        problem,
                        &rows,
                        &DVector::zeros(model_of(problem, &rows).parameters.len()),
                    )
                };
                for (one, other) in zero(&with).iter().zip(zero(&without)) {
                    assert!(
                        (one - other).norm() < 1e-12,
                        "{effect:?}: {:e} m",
                        (one - other).norm()
                    );
                }
            }
        }
    }
}

#[test]
fn moments_in_laws_are_those_of_the_loads_with_their_errors() {
    let (arm, _) = lunar();
    let rows = poses(&arm, 20, true, &mut ChaCha8Rng::seed_from_u64(11));
    let link = || "A".to_owned();
    let text = "law = { name = 'm', at = 'joint2', terms = ['M2', 'M3*sin(q1)'] }";
    let law = arm.effect(text, Path::new("law")).unwrap().effect;
    let errors: [Strong; 5] = [
        (Effect::PayloadMass, vec![1.5]),
        (Effect::UnmodelledMass { link: link() }, vec![3.0, 0.7]),
        (Effect::HoistForce, vec![0.2]),
        (Effect::HoistDirection, vec![0.05, 0.03, 0.04]),
        (Effect::GravityDirection, vec![0.03, -0.02]),
    ];
    let size = vec![2e-5, -3e-5];
    for error in &errors {
        // The law's own displacement, with the error of the loads and without it.
        let of_law = |loads: &[Strong]| {
            let with_law = [loads, &[(law.clone(), size.clone())]].concat();
            let model = |effects: &[Strong]| {
                let kinds: Vec<Effect> = effects.iter().map(|effect| effect.0.clone()).collect();
                let values: Vec<f64> = effects.iter().flat_map(|effect| effect.1.clone()).collect();
                let arm = declared(&arm, &kinds);
                predicted(&arm, &rows, &strengths(&model_of(&arm, &rows), &values))
            };
            let (by_model, rest) = (model(&with_law), model(loads));
            let (by_rig, rig_rest) =
                (measured(&arm, &with_law, &rows), measured(&arm, loads, &rows));
            let moved =
                |with: Vec<Vector3<f64>>, without: Vec<Vector3<f64>>| -> Vec<Vector3<f64>> {
                    with.into_iter().zip(without).map(|(with, without)| with - without).collect()
                };
            (moved(by_model, rest), moved(by_rig, rig_rest))
        };
        let (by_model, by_rig) = of_law(std::slice::from_ref(error));
        let (without_error, _) = of_law(&[]);
        let mut change = 0.0_f64;
        for row in 0..rows.len() {
            let off = (by_model[row] - by_rig[row]).norm();
            assert!(off < PART * by_rig[row].norm() + FLOOR, "{:?}, row {row}: {off} m", error.0);
            change = change.max((by_model[row] - without_error[row]).norm());
        }
        assert!(change > 20.0 * FLOOR, "{:?} changes the law by {change} m only", error.0);
    }
}
