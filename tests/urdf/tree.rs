//! One problem for several tips of a URDF.

use std::path::Path;

use flexcal::mechanics::Arm;
use flexcal::problem::{JointKind, Problem};
use flexcal::urdf::{Chain, Robot, describe, describe_measured, export_with_links};
use nalgebra::DVector;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::common::arms::parse;
use super::common::made::model_of;
use super::{apart, tips};
use flexcal::measurement::Dataset;

/// Name, parent, child, xyz and rpy of each joint of a torso with a head, an arm and a plate.
const TORSO: [[&str; 5]; 9] = [
    ["waist", "pelvis", "t1", "0 0 0.2", "0 0 0.3"],
    ["bow", "t1", "t2", "0.1 0 0.3", "-1.4 0.2 0"],
    ["pan", "t2", "h1", "0.3 0.1 0.02", "1.5707963267948966 0.4 0"],
    ["tilt", "h1", "h2", "0.05 0 0.1", "-1.5707963267948966 0 0.1"],
    ["eye mount", "h2", "eye", "0.02 0.03 0.04", "0.3 0 1"],
    ["shoulder", "t2", "a1", "-0.2 0.3 0", "0 0.7 0"],
    ["elbow", "a1", "a2", "0.3 0 0.01", "0 0 0.2"],
    ["hand mount", "a2", "hand", "0.2 0 0.1", "0.2 0.1 0"],
    ["plate mount", "a2", "plate", "0.1 0.1 0", "0 0 0.4"],
];

fn torso() -> Robot {
    let joint = |[name, parent, child, xyz, rpy]: [&str; 5]| {
        let kind = if name.ends_with("mount") { "fixed" } else { "continuous" };
        format!(
            "<link name=\"{child}\"><inertial><mass value=\"2\"/><origin xyz=\"0.1 0 0.05\"/></inertial></link>\n\
             <joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/>\
             <child link=\"{child}\"/><origin xyz=\"{xyz}\" rpy=\"{rpy}\"/>\
             <axis xyz=\"0 0 1\"/></joint>\n"
        )
    };
    let joints: String = TORSO.into_iter().map(joint).collect();
    let text = format!("<robot name=\"torso\"><link name=\"pelvis\"/>\n{joints}</robot>\n");
    Robot::parse(&text, Path::new("torso.urdf")).unwrap()
}

/// Returns configurations of a problem from coordinates of the joints by their names.
fn configurations(problem: &Problem, coordinates: &[[f64; 6]]) -> Vec<Vec<f64>> {
    let names = ["waist", "bow", "pan", "tilt", "shoulder", "elbow"];
    let of = |q: &[f64; 6]| {
        let value = |joint: &flexcal::problem::Joint| {
            let place = names.iter().position(|name| *name == joint.name);
            place.filter(|_| joint.kind != JointKind::Fixed).map_or(0.0, |place| q[place])
        };
        problem.joints.iter().map(value).collect()
    };
    coordinates.iter().map(of).collect()
}

#[test]
fn several_tips_make_one_tree_with_the_joints_of_the_trunk_once() {
    let robot = torso();
    let chain = |tip: &str| Chain::new(&robot, None, Some(tip)).unwrap();
    let (eye, further) = (chain("eye"), [chain("hand"), chain("plate")]);
    let tree = parse(&describe_measured(&eye, &further, None).unwrap().text);
    let moving = tree.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
    let names: Vec<&str> = moving.map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["waist", "bow", "pan", "tilt", "shoulder", "elbow"]);

    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let coordinates: Vec<[f64; 6]> =
        (0..20).map(|_| std::array::from_fn(|_| rng.random_range(-2.0..2.0))).collect();
    let zeros = |problem: &Problem, rows: &[Vec<f64>]| {
        let rows = Dataset::poses(rows).measurements().unwrap();
        DVector::zeros(model_of(problem, &rows).parameters.len())
    };
    for (target, tip) in tree.targets.iter().zip(["eye", "hand", "plate"]) {
        assert_eq!(target.name, tip);
        let alone = parse(&describe(&chain(tip)).unwrap().text);
        let mut of_tip = tree.clone();
        of_tip.targets.clear();
        of_tip.tool.joint = target.joint;
        let frames = |problem: &Problem| {
            let rows = configurations(problem, &coordinates);
            tips(problem, &rows, &zeros(problem, &rows))
        };
        let off = apart(&frames(&alone), &frames(&of_tip));
        assert!(off < 1e-9, "{tip}: {off:e}");
    }
    let mass = |problem: &Problem| -> f64 {
        let bodies = problem.joints.iter().flat_map(|joint| &joint.bodies);
        bodies.map(|body| body.mass).sum()
    };
    assert!((mass(&tree) - 18.0).abs() < 1e-12, "{}", mass(&tree));

    let same = export_with_links(&eye, &tree, &Arm::nominal(&tree), &[]).unwrap();
    assert!(same.moved.is_empty(), "{:?}", same.moved);
}

#[test]
fn a_camera_on_one_branch_sees_a_board_on_another() {
    let robot = torso();
    let chain = |tip: &str| Chain::new(&robot, None, Some(tip)).unwrap();
    let board = Some(([3, 2], 25.0, false));
    let text = describe_measured(&chain("eye"), &[chain("hand")], board).unwrap().text;
    let tree = parse(&text);
    let carriers: Vec<Option<usize>> =
        tree.fixtures.iter().map(|fixture| fixture.carrier.map(|joint| joint - 1)).collect();
    let end = |name: &str| tree.joints.iter().position(|joint| joint.name == name);
    assert_eq!(carriers, [end("eye"), end("hand")], "{text}");
    assert!(text.contains("\"joint1.*\" = { fixed = true }"), "{text}");
    let notes = describe(&chain("eye")).unwrap().notes.join("\n");
    assert!(notes.contains("--tip eye --tip hand"), "{notes}");
    let error = Chain::new(&robot, Some("eye"), Some("hand")).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("write --tip eye --tip hand"), "{error}");
}
