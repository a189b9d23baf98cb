//! Export of identified geometry.

use flexcal::mechanics::Arm;
use flexcal::urdf::{
    Chain, MountedLink, Robot, YamlFormat, describe, export, export_with_links, joint_origins,
    mounted_links, yaml,
};
use nalgebra::{DVector, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::common::arms::{parse, path};
use super::common::made::{draw, model_of};
use super::{apart, problem_of, robot, tips};
use flexcal::measurement::Dataset;
use flexcal::problem::{Joint, JointKind, Problem};

/// Returns the text without the contents of its `<origin>`s, and without origins on separate lines.
fn without_origins(text: &str) -> String {
    let mut kept = String::new();
    for (k, part) in text.split("<origin").enumerate() {
        kept.push_str(if k == 0 { part } else { part.split_once("/>").unwrap().1 });
    }
    let lines: Vec<&str> =
        kept.lines().map(str::trim_end).filter(|line| !line.trim().is_empty()).collect();
    lines.join("\n")
}

/// Returns random configurations, with 0 for fixed joints.
fn configurations(problem: &Problem, count: usize, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    let mut value = |joint: &Joint| match joint.kind {
        JointKind::Fixed => 0.0,
        _ => rng.random_range(-2.0..2.0),
    };
    (0..count).map(|_| problem.joints.iter().map(&mut value).collect()).collect()
}

#[test]
fn exported_origins_have_the_identified_pose_and_nothing_else_moves() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let original = robot("odd.urdf");
    let chain = Chain::new(&original, None, Some("tool")).unwrap();
    let mut problem = problem_of(&chain);
    // Every parameter is free, including base and tool.
    problem.parameters.retain(|rule| !matches!(rule.freedom, flexcal::problem::Freedom::Fixed));
    let configurations = configurations(&problem, 100, &mut rng);
    let model = model_of(&problem, &Dataset::poses(&configurations).measurements().unwrap());
    let arm_only = |x: &DVector<f64>| {
        DVector::from_iterator(
            x.len(),
            x.iter()
                .zip(&model.parameters)
                .map(|(x, parameter)| if parameter.name.starts_with("joint") { *x } else { 0.0 }),
        )
    };
    let x = arm_only(&draw(&model, |_| 0.0, &mut rng));
    let exported = export(&chain, &problem, &model.arm(|k| x[k])).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("moved.urdf");
    std::fs::write(&file, &exported.text).unwrap();
    let moved = Robot::read(&file).unwrap();
    let again = problem_of(&Chain::new(&moved, None, Some("tool")).unwrap());
    let nominal = DVector::zeros(
        model_of(&again, &Dataset::poses(&configurations).measurements().unwrap()).parameters.len(),
    );
    let off = apart(&tips(&problem, &configurations, &x), &tips(&again, &configurations, &nominal));
    assert!(off < 1e-9, "{off:e}");
    let text = std::fs::read_to_string(path("tests/urdf/odd.urdf")).unwrap();
    assert_eq!(without_origins(&text), without_origins(&exported.text));
    assert!(
        exported.text.contains("<!-- the comment stays -->")
            && exported.text.contains("    <origin xyz=\"")
    );
    let names: Vec<&str> = exported.moved.iter().map(|origin| origin.joint.as_str()).collect();
    assert_eq!(names, ["stand", "rail", "shoulder", "elbow", "level", "wrist", "flange"]);

    // Without identification nothing moves, except by rounding in the file.
    let same = export(&chain, &problem, &Arm::nominal(&problem)).unwrap();
    let rounded: Vec<&str> = same.moved.iter().map(|origin| origin.joint.as_str()).collect();
    assert_eq!(rounded, ["stand", "flange"]);
    assert!(
        same.moved.iter().all(|origin| origin.distance < 3e-6 && origin.angle < 4e-6),
        "{:?}",
        same.moved
    );
    let mut other = problem.clone();
    other.joints[3].a += 1e-3;
    let error = export(&chain, &other, &Arm::nominal(&other)).unwrap_err().to_string();
    assert!(
        error.contains("differs from the URDF at joint \"elbow\" by 0.000° and 1.00 mm"),
        "{error}"
    );
    other = problem.clone();
    other.joints[3].name = "knee".to_owned();
    assert!(
        export(&chain, &other, &Arm::nominal(&other))
            .unwrap_err()
            .to_string()
            .contains("the problem rail, shoulder, knee")
    );
}

/// Cameras on two joints, on the last frame and on the base, and a marker whose link exists.
const MOUNTED: &str = r#"
[[camera]]
name = "eye"
on = "shoulder"
at_m = [0.1, 0.2, 0.3]
rotation_deg = [10, -20, 30]
focal_px = [900, 900]
centre_px = [640, 360]
pixel_sigma = 0.2
[[camera]]
name = "wrist"
on = "level"
at_m = [0.01, -0.02, 0.03]
rotation_deg = [0, 90, 0]
focal_px = [900, 900]
centre_px = [640, 360]
pixel_sigma = 0.2
[[camera]]
name = "end"
on = "tool"
at_m = [0.05, 0, 0.02]
rotation_deg = [5, 0, 80]
focal_px = [900, 900]
centre_px = [640, 360]
pixel_sigma = 0.2
[[marker]]
name = "tag"
on = "base"
at_m = [0.4, 0.1, 0.2]
rotation_deg = [0, 0, 45]
points_mm = [[0, 0, 0]]
"#;

/// Asserts that the links of an exported URDF have the poses of cameras and markers of a problem
/// with the parameters `x`, in all configurations.
fn assert_links(
    moved: &Robot,
    base: &str,
    mounted: &[MountedLink],
    (problem, configurations, x): (&Problem, &[Vec<f64>], &DVector<f64>),
) {
    for mounted in mounted.iter().filter(|mounted| mounted.carrier > 0) {
        let of_link = problem_of(&Chain::new(moved, Some(base), Some(&mounted.link)).unwrap());
        let of_link_q: Vec<Vec<f64>> = configurations
            .iter()
            .map(|q| {
                let value = |name: &str| problem.joints.iter().position(|joint| joint.name == name);
                of_link
                    .joints
                    .iter()
                    .map(|joint| value(&joint.name).map_or(0.0, |k| q[k]))
                    .collect()
            })
            .collect();
        let rows = Dataset::poses(&of_link_q).measurements().unwrap();
        let nominal = DVector::zeros(model_of(&of_link, &rows).parameters.len());
        let mut carrier = problem.clone();
        carrier.tool.joint = mounted.carrier - 1;
        let seen = tips(&carrier, configurations, x);
        let expected: Vec<[Vector3<f64>; 3]> = seen
            .iter()
            .map(|&[origin, x, z]| {
                let axes = [x, z.cross(&x), z];
                let turned = |v: &Vector3<f64>| axes[0] * v.x + axes[1] * v.y + axes[2] * v.z;
                let [of_x, _, of_z] = &mounted.pose.axes;
                [origin + turned(&mounted.pose.origin), turned(of_x), turned(of_z)]
            })
            .collect();
        let off = apart(&expected, &tips(&of_link, &of_link_q, &nominal));
        assert!(off < 1e-9, "{}: {off:e}", mounted.link);
    }
}

#[test]
fn cameras_and_markers_on_the_arm_become_links() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let existing = "<link name=\"eye_optical_frame\"/>\n<joint name=\"eye_mount\" type=\"fixed\">\
                    <parent link=\"upper\"/><child link=\"eye_optical_frame\"/></joint>\n";
    let text = std::fs::read_to_string(path("tests/urdf/odd.urdf")).unwrap();
    let text = text.replace("</robot>", &format!("{existing}</robot>"));
    let original = Robot::parse(&text, std::path::Path::new("odd.urdf")).unwrap();
    let chain = Chain::new(&original, None, Some("tool")).unwrap();
    let described = describe(&chain).unwrap().text;
    let (before, after) = described.split_at(described.find("[parameters]").unwrap());
    let problem = parse(&format!("{before}{MOUNTED}{after}"));
    let configurations = configurations(&problem, 20, &mut rng);
    let model = model_of(&problem, &Dataset::poses(&configurations).measurements().unwrap());
    let mut x = draw(&model, |_| 0.0, &mut rng);
    for (x, parameter) in x.iter_mut().zip(&model.parameters) {
        *x *= f64::from(u8::from(parameter.name.starts_with("joint")));
    }
    let mounted = mounted_links(&problem, &model, x.as_slice());
    let names: Vec<&str> = mounted.iter().map(|mounted| mounted.link.as_str()).collect();
    let links = ["eye_optical_frame", "wrist_optical_frame", "end_optical_frame", "tag_marker"];
    assert_eq!(names, links);
    let exported = export_with_links(&chain, &problem, &model.arm(|k| x[k]), &mounted).unwrap();
    assert!(exported.elsewhere.is_empty());
    assert!(exported.moved.iter().any(|origin| origin.joint == "eye_mount"));
    let moved = Robot::parse(&exported.text, std::path::Path::new("moved.urdf")).unwrap();
    assert_links(&moved, "world", &mounted, (&problem, &configurations, &x));
    // A bracket between the arm and the link of its camera stays.
    let bracket = "<parent link=\"bracket\"/><child link=\"eye_optical_frame\"/><origin \
                   xyz=\"1 2 3\"/></joint>\n<link name=\"bracket\"/><joint name=\"stay\" \
                   type=\"fixed\"><parent link=\"upper\"/><child link=\"bracket\"/><origin \
                   xyz=\"0.1 0 0\" rpy=\"0 0 1\"/></joint>";
    let old = "<parent link=\"upper\"/><child link=\"eye_optical_frame\"/></joint>";
    let held = Robot::parse(&text.replace(old, bracket), std::path::Path::new("odd.urdf")).unwrap();
    let chain = Chain::new(&held, None, Some("tool")).unwrap();
    let exported = export_with_links(&chain, &problem, &model.arm(|k| x[k]), &mounted).unwrap();
    let origins = &exported.moved;
    assert!(exported.elsewhere.is_empty() && !origins.iter().any(|of| of.joint == "stay"));
    let moved = Robot::parse(&exported.text, std::path::Path::new("moved.urdf")).unwrap();
    assert_links(&moved, "world", &mounted, (&problem, &configurations, &x));
    // The camera on the upper arm cannot move to another parent.
    let other = text.replace("<parent link=\"upper\"/><child", "<parent link=\"fore\"/><child");
    let other = Robot::parse(&other, std::path::Path::new("odd.urdf")).unwrap();
    let chain = Chain::new(&other, None, Some("tool")).unwrap();
    let exported = export_with_links(&chain, &problem, &model.arm(|k| x[k]), &mounted).unwrap();
    assert_eq!(exported.elsewhere, ["eye_optical_frame"]);
}

/// A marker on each arm of the torso, on the last joint and before it.
const ON_BOTH_ARMS: &str = r#"
[[marker]]
name = "left"
on = "left wrist"
at_m = [0.1, 0.02, 0.03]
rotation_deg = [10, -20, 30]
points_mm = [[0, 0, 0]]
[[marker]]
name = "right"
on = "right forearm"
at_m = [0.05, 0, 0.02]
rotation_deg = [5, 0, 80]
points_mm = [[0, 0, 0]]
"#;

/// Joints of the torso with two arms in a URDF: name, parent and child link, origin.
const TWO_ARMS: [[&str; 5]; 12] = [
    ["waist", "pelvis", "hip", "0 0 0.4", "0 0 0"],
    ["chest", "hip", "torso", "0 0 0", "1.5707963267948966 -1.5707963267948966 0"],
    ["left mount", "torso", "l0", "0.45 0 -0.2", "3.141592653589793 0 0"],
    ["left shoulder", "l0", "l1", "0 0 0", "0 0 0"],
    ["left elbow", "l1", "l2", "0.3 -0.04330127018922193 0.025", "1.0471975511965976 0 0"],
    ["left wrist", "l2", "left_hand", "0.28 0 0", "-1.5707963267948966 0 0"],
    ["right mount", "torso", "r0", "0.45 0 0.2", "0 0 0"],
    ["right shoulder", "r0", "r1", "0 0 0", "0 0 0"],
    ["right elbow", "r1", "r2", "0.3 0.04330127018922193 0.025", "-1.0471975511965976 0 0"],
    ["right forearm", "r2", "r3", "0 -0.25 0", "1.5707963267948966 0 0"],
    ["right wrist", "r3", "r4", "0.05 0 0", "-1.5707963267948966 0 0"],
    ["right flange", "r4", "right_hand", "0 0 0", "0 0 0"],
];

#[test]
fn every_branch_of_a_tree_is_exported() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let text = std::fs::read_to_string(path("problems/two-arms/problem.toml")).unwrap();
    let (arm, rest) = text.split_at(text.find("[[target]]").unwrap());
    let rigid = arm.lines().filter(|line| !line.starts_with("stiff") && !line.starts_with("body"));
    let rigid: String = rigid.map(|line| line.to_owned() + "\n").collect();
    let rest = rest[rest.find("[parameters]").unwrap()..].replace("\"joint*.stiff", "# ");
    let rest = rest.replace("[data]", "\"joint*.beta\" = { sigma_deg = 0.2 }\n[data]");
    let problem = parse(&format!("{rigid}{ON_BOTH_ARMS}{rest}"));
    let link = |name: &str| format!("<link name=\"{name}\"/>\n");
    let joint = |[name, parent, child, xyz, rpy]: [&str; 5]| {
        let is_fixed = name.ends_with("mount") || name.ends_with("flange");
        let kind = if is_fixed { "fixed" } else { "continuous" };
        format!(
            "{}<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/>\
             <child link=\"{child}\"/><origin xyz=\"{xyz}\" rpy=\"{rpy}\"/>\
             <axis xyz=\"0 0 1\"/></joint>\n",
            link(child)
        )
    };
    let joints: String = TWO_ARMS.into_iter().map(joint).collect();
    let urdf = format!("<robot name=\"torso\">\n{}{joints}</robot>\n", link("pelvis"));
    let original = Robot::parse(&urdf, std::path::Path::new("torso.urdf")).unwrap();
    let chain = Chain::new(&original, Some("pelvis"), Some("right_hand")).unwrap();
    let configurations = configurations(&problem, 20, &mut rng);
    let model = model_of(&problem, &Dataset::poses(&configurations).measurements().unwrap());
    let mut x = draw(&model, |_| 0.0, &mut rng);
    for (x, parameter) in x.iter_mut().zip(&model.parameters) {
        *x *= f64::from(u8::from(parameter.name.starts_with("joint")));
    }
    let mounted = mounted_links(&problem, &model, x.as_slice());
    let exported = export_with_links(&chain, &problem, &model.arm(|k| x[k]), &mounted).unwrap();
    let moved = Robot::parse(&exported.text, std::path::Path::new("moved.urdf")).unwrap();
    assert_links(&moved, "pelvis", &mounted, (&problem, &configurations, &x));
    assert_eq!(mounted.len(), 2);
    let names: Vec<&str> = exported.moved.iter().map(|origin| origin.joint.as_str()).collect();
    let at = |name| names.iter().filter(|moved| **moved == name).count();
    assert_eq!((at("chest"), at("left elbow"), at("right flange")), (1, 1, 1), "{names:?}");

    let same = export_with_links(&chain, &problem, &Arm::nominal(&problem), &[]).unwrap();
    assert!(same.moved.is_empty(), "{:?}", same.moved);
    let left = Chain::new(&original, Some("pelvis"), Some("l2")).unwrap();
    let error = export(&left, &problem, &Arm::nominal(&problem)).unwrap_err().to_string();
    assert!(error.contains("right wrist"), "{error}");
}

#[test]
fn universal_robots_get_their_six_links() {
    let problem = Problem::read(&path("problems/ur10-ipa")).unwrap();
    let origins =
        joint_origins(&problem, &Arm::nominal(&problem), YamlFormat::UniversalRobots).unwrap();
    let half = std::f64::consts::FRAC_PI_2;
    let expected = [
        ([0.0, 0.0, 0.1273], 0.0),
        ([0.0; 3], half),
        ([-0.612, 0.0, 0.0], 0.0),
        ([-0.5723, 0.0, 0.163_941], 0.0),
        ([0.0, -0.1157, 0.0], half),
        ([0.0, 0.0922, 0.0], -half),
    ];
    for (origin, (xyz, roll)) in origins.iter().zip(expected) {
        let off = (origin.xyz - Vector3::from(xyz)).norm()
            + (origin.rpy - Vector3::new(roll, 0.0, 0.0)).norm();
        assert!(off < 1e-9, "{origin:?}");
    }
    let text = yaml(&origins, YamlFormat::UniversalRobots);
    assert!(
        text.contains("kinematics:\n  shoulder:\n    x: 0.0\n    y: 0.0\n    z: 0.1273\n")
            && text.ends_with("  hash: \"\"\n"),
        "{text}"
    );
    let odd = robot("odd.urdf");
    let other = problem_of(&Chain::new(&odd, None, Some("tool")).unwrap());
    let error = joint_origins(&other, &Arm::nominal(&other), YamlFormat::UniversalRobots)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains(
            "not an arm with the joint layout of Universal Robots: it has 5 moving joints, not 6"
        ),
        "{error}"
    );
    let tree = Problem::read(&path("problems/two-arms")).unwrap();
    let error =
        joint_origins(&tree, &Arm::nominal(&tree), YamlFormat::Ros).unwrap_err().to_string();
    assert!(
        error.contains(":53: joint[7].parent: export to YAML needs a single chain of joints"),
        "{error}"
    );
}
