//! Problems created from URDF.

use std::path::Path;

use flexcal::problem::JointKind::{self, Fixed, Prismatic, Revolute};
use flexcal::problem::Mimic;
use flexcal::urdf::{Chain, Robot, describe};
use nalgebra::{DVector, Vector3};

use super::{apart, problem_of, robot, tips};
use crate::common::arms::parse;

/// Coordinates of rail, shoulder, elbow and wrist \[m, rad\], then origin, x and z axis of the link
/// `tool` in `world`, computed by pinocchio 3 with π/2 for 1.5708.
const STORED: [([f64; 4], [[f64; 3]; 3]); 6] = [
    (
        [0.009, 1.802, -1.423, 1.795],
        [
            [0.2017871955709, -0.781804088926, 1.0471085635423],
            [-0.4388998397467, -0.4172382679114, 0.7957883879906],
            [-0.1395538366066, -0.8432495708066, -0.5190904430086],
        ],
    ),
    (
        [-0.151, -0.307, 1.311, -0.363],
        [
            [0.0513355444123, 0.1085124096279, 0.0856282268359],
            [0.969087949395, 0.0820941873284, -0.2326565940269],
            [-0.1059110140058, -0.7132750926067, -0.6928358386943],
        ],
    ),
    (
        [0.04, -1.89, 1.014, 0.153],
        [
            [0.1337027887222, -0.7574290191265, 0.2783657988285],
            [0.6731455138749, 0.6027179465367, 0.4284929335155],
            [-0.2237630201342, -0.3862605584796, 0.894836796172],
        ],
    ),
    (
        [-0.136, 1.154, -0.787, -0.186],
        [
            [0.1686320916898, -0.2207626516267, 1.5812628365141],
            [0.8845605063745, 0.3219395477283, 0.3375020565433],
            [-0.1752832964762, -0.4411089066728, 0.880169698655],
        ],
    ),
    (
        [-0.293, -0.388, -1.186, -0.951],
        [
            [0.0715502296943, 0.5550428897441, 0.8185820885096],
            [0.7383004245782, 0.4011642933934, 0.5421989420626],
            [-0.5176533411678, 0.8523646367232, 0.0742263055896],
        ],
    ),
    (
        [0.2, -0.878, -0.059, 1.923],
        [
            [-0.3471388082945, 0.3094184960346, -0.040506954864],
            [-0.4118773277534, -0.8575515390813, 0.3081597389376],
            [-0.3483428765785, -0.1643183452031, -0.9228524918787],
        ],
    ),
];

/// Positions of centres of mass in the first of these configurations, from the same program.
const MASSES: [(&str, f64, [f64; 3]); 3] = [
    ("camera", 0.4, [0.1094887249301, -0.708911820063, 1.1047579046006]),
    ("upper", 3.25, [0.0636153491049, -0.2344837820206, 0.8978169531132]),
    ("carriage", 5.5, [0.0930016666093, -0.2, 0.4001599886669]),
];

#[test]
fn a_chain_with_everything_is_as_another_program_has_it() {
    let robot = robot("odd.urdf");
    let chain = Chain::new(&robot, None, Some("tool")).unwrap();
    let problem = problem_of(&chain);
    let kinds: Vec<(&str, JointKind)> =
        problem.joints.iter().map(|joint| (joint.name.as_str(), joint.kind)).collect();
    let expected = [
        ("mounting", Fixed),
        ("rail", Prismatic),
        ("shoulder", Revolute),
        ("elbow", Revolute),
        ("level", Revolute),
        ("wrist", Revolute),
        ("tool", Fixed),
    ];
    assert_eq!(kinds, expected);
    assert_eq!(problem.joints[4].mimic, Some(Mimic { joint: 2, ratio: -0.5 }));
    assert!(
        (problem.joints[2].limits.1 - 2.5).abs() < 1e-8
            && (problem.joints[1].limits.0 + 0.4).abs() < 1e-12
    );
    let turn = std::f64::consts::PI;
    assert_eq!(
        problem.joints[3].limits,
        (-turn, turn),
        "a continuous joint is planned within a turn"
    );
    let all = |[rail, shoulder, elbow, wrist]: [f64; 4]| {
        vec![0.0, rail, shoulder, elbow, 0.0, wrist, 0.0]
    };
    let configurations: Vec<Vec<f64>> = STORED.iter().map(|(q, _)| all(*q)).collect();
    let stored: Vec<[Vector3<f64>; 3]> =
        STORED.iter().map(|(_, frame)| frame.map(Vector3::from)).collect();
    let free = super::common::made::model_of(
        &problem,
        &flexcal::measurement::Dataset::poses(&configurations).measurements().unwrap(),
    );
    let nominal = DVector::zeros(free.parameters.len());
    let off = apart(&tips(&problem, &configurations, &nominal), &stored);
    assert!(off < 1e-9, "{off:e}");

    // Centres of mass are compared as targets of the arm that ends at their joint.
    assert_eq!(
        problem.joints.iter().flat_map(|joint| &joint.bodies).count(),
        4,
        "fore is the fourth; the base carries itself"
    );
    for (name, mass, at) in MASSES {
        let carrier = problem
            .joints
            .iter()
            .position(|joint| joint.bodies.iter().any(|body| body.name == name))
            .unwrap();
        let body = problem.joints[carrier].bodies.iter().find(|body| body.name == name).unwrap();
        let mut cut = problem.clone();
        cut.parameters.clear();
        cut.joints.truncate(carrier + 1);
        let frames = tips(&cut, &[all(STORED[0].0)[..=carrier].to_vec()], &DVector::zeros(0));
        let [origin, x, z] = frames[0];
        let place =
            origin + x * body.position.x + z.cross(&x) * body.position.y + z * body.position.z;
        assert!(
            (place - Vector3::from(at)).norm() < 1e-9 && (body.mass - mass).abs() < 1e-12,
            "{name}: {place}"
        );
    }
}

#[test]
fn a_problem_frees_what_positions_tell_apart_and_says_what_was_rounded() {
    let robot = robot("odd.urdf");
    let description = describe(&Chain::new(&robot, Some("base"), Some("tool")).unwrap()).unwrap();
    assert!(
        description.notes.iter().any(|note| note.starts_with("1.5708 rad at ")),
        "{:?}",
        description.notes
    );
    let text = description.text;
    let held = |name: &str| text.contains(&format!("\"{name}\" = {{ fixed = true }}"));
    assert!(held("joint*.beta") && text.contains("base = \"base\""), "{text}");
    let problem = parse(&text);
    let q = vec![vec![0.0; problem.joints.len()]];
    let model = super::common::made::model_of(
        &problem,
        &flexcal::measurement::Dataset::poses(&q).measurements().unwrap(),
    );
    // Six of the base, three of the target, four between revolute axes; the position of one
    // prismatic joint does not matter.
    assert!(model.parameters.len() < 35, "{}", model.parameters.len());
    let chain = |base, tip| {
        Chain::new(&robot, base, tip).err().map(|error| error.to_string()).unwrap_or_default()
    };
    assert!(
        chain(None, None).contains("tool (5 moving joints), camera (4 moving joints)"),
        "{}",
        chain(None, None)
    );
    assert!(chain(None, Some("tol")).contains("(did you mean tool?)"));
    assert!(
        chain(Some("hand"), Some("camera"))
            .contains("is not below link \"hand\"; above it are plate, fore")
    );
    assert!(chain(Some("world"), Some("base")).contains("no joint moves"));
}

#[test]
fn a_joint_without_an_axis_is_said_to_turn_about_x() {
    for (kind, axis, is_said) in
        [("revolute", "", true), ("revolute", "<axis xyz=\"1 0 0\"/>", false), ("fixed", "", false)]
    {
        let text = format!(
            "<robot name=\"r\">\n<link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>\n\
             <joint name=\"i\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/><axis xyz=\"0 0 1\"/></joint>\n\
             <joint name=\"j\" type=\"{kind}\"><parent link=\"b\"/><child link=\"c\"/>{axis}</joint></robot>"
        );
        let robot = Robot::parse(&text, Path::new("r.urdf")).unwrap();
        let notes = describe(&Chain::new(&robot, None, None).unwrap()).unwrap().notes;
        let said = notes.iter().any(|note| note.starts_with("j has no <axis> (r.urdf:4"));
        assert_eq!(said, is_said, "{kind} {axis}: {notes:?}");
    }
}

#[test]
fn limits_that_exclude_each_other_are_said_to_be_none() {
    for (limits, is_said) in
        [("lower=\"1\" upper=\"-1\"", true), ("lower=\"-1\" upper=\"1\"", false), ("", false)]
    {
        let text = format!(
            "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"revolute\"><parent link=\"a\"/>\
             <child link=\"b\"/><limit {limits}/></joint></robot>"
        );
        let robot = Robot::parse(&text, Path::new("r.urdf")).unwrap();
        let described = describe(&Chain::new(&robot, None, None).unwrap()).unwrap();
        let said = described
            .notes
            .iter()
            .any(|note| note.starts_with("j: the limits 1 to -1 exclude each other"));
        assert_eq!(
            (said, !described.text.contains("min_deg = -180")),
            (is_said, limits.contains("\"-1\" upper")),
            "{limits}"
        );
    }
}

#[test]
fn other_units_and_broken_followers_are_noted() {
    let arm = |origin: &str, beside: &str| {
        format!(
            "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><link name=\"c\"/><link name=\"f\"/>\
             <joint name=\"j1\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/>\
             <axis xyz=\"1 0 0\"/></joint>\
             <joint name=\"j2\" type=\"revolute\"><parent link=\"b\"/><child link=\"c\"/><origin {origin}/><axis xyz=\"1 0 0\"/>\
             <limit lower=\"-1\" upper=\"1\"/></joint>\
             <joint name=\"g\" type=\"prismatic\"><parent link=\"a\"/><child link=\"f\"/>{beside}</joint></robot>"
        )
    };
    let misspelt = arm("xyz=\"0.2 0 0\"", "").replace("\"continuous\"", "\"continous\"");
    let robot = Robot::parse(&misspelt, Path::new("r.urdf"));
    let chain = robot.and_then(|robot| Chain::new(&robot, None, Some("c")).map(|_| ()));
    assert!(chain.unwrap_err().to_string().contains("did you mean continuous?"));
    let robot = Robot::parse(&arm("xyz=\"0.2 0 0\"", ""), Path::new("r.urdf")).unwrap();
    let exchanged = Chain::new(&robot, Some("c"), Some("a")).err().unwrap().to_string();
    assert!(exchanged.contains("exchange --base and --tip"), "{exchanged}");
    let notes = |origin: &str, beside: &str| {
        let robot = Robot::parse(&arm(origin, beside), Path::new("r.urdf")).unwrap();
        describe(&Chain::new(&robot, None, Some("c")).unwrap()).unwrap().notes.join("\n")
    };
    let usual = notes("xyz=\"0.2 0 0\" rpy=\"3.1 0 0.2\"", "");
    assert!(
        usual.starts_with("no fixed joint follows the moving joint j2")
            && usual.lines().count() == 1
    );
    let said = notes("xyz=\"0.2 0 0\" rpy=\"90 0 0\"", "");
    assert!(said.contains("j2: rpy holds 90 rad") && said.contains("degrees"), "{said}");
    let said = notes("xyz=\"200 0 0\"", "");
    assert!(said.contains("j2: xyz holds 200 m") && said.contains("millimetres"), "{said}");
    let degrees = arm("xyz=\"0.2 0 0\"", "").replace("-1\" upper=\"1", "-170\" upper=\"170");
    let robot = Robot::parse(&degrees, Path::new("r.urdf")).unwrap();
    let described = describe(&Chain::new(&robot, None, Some("c")).unwrap()).unwrap();
    let said = described.notes.join("\n");
    assert!(said.contains("are taken as none: j2 (-170 to 170); if they are degrees"), "{said}");
    assert_eq!(described.text.matches("\nmax_deg = 180\n").count(), 2, "{}", described.text);
    let mimic = "<mimic joint=\"finger\"/>";
    let said = notes("xyz=\"0.2 0 0\"", mimic);
    assert!(said.contains("g: <mimic>: no joint is called \"finger\""), "{said}");
    let robot = Robot::parse(&arm("xyz=\"0.2 0 0\"", mimic), Path::new("r.urdf")).unwrap();
    let error = Chain::new(&robot, None, Some("f")).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("no joint is called \"finger\""), "needed by the chain: {error}");
}

/// Two joints of the chain follow each other, the first a joint outside the chain; the names of
/// some joints are those of rows that are no joints.
const FOLLOWERS: &str = r#"<robot name="followers">
<link name="base"/><link name="side"/><link name="one"/><link name="two"/><link name="tip"/>
<joint name="aside" type="revolute"><parent link="base"/><child link="side"/><limit lower="-1" upper="1"/></joint>
<joint name="mounting" type="revolute"><parent link="base"/><child link="one"/><origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1"/><mimic joint="aside" multiplier="2" offset="0.5"/></joint>
<joint name="tip" type="revolute"><parent link="one"/><child link="two"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1"/><mimic joint="mounting" multiplier="-1" offset="0.25"/></joint>
<joint name="end" type="fixed"><parent link="two"/><child link="tip"/><origin xyz="0.1 0.1 0"/></joint>
</robot>"#;

#[test]
fn a_joint_follows_the_nearest_joint_of_the_chain() {
    let robot = Robot::parse(FOLLOWERS, Path::new("followers.urdf")).unwrap();
    let described = describe(&Chain::new(&robot, None, Some("tip")).unwrap()).unwrap();
    let mut problem = parse(&described.text);
    problem.parameters.clear();
    let names: Vec<&str> = problem.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["mounting frame", "mounting", "tip", "tip frame"]);
    assert_eq!(problem.joints[2].mimic, Some(Mimic { joint: 1, ratio: -1.0 }));
    assert_eq!(
        described.notes.iter().filter(|note| note.contains("is not in the chain")).count(),
        1,
        "{:?}",
        described.notes
    );
    // Two rotations about parallel axes: the second by 0.25 − q.
    let [origin, x, _] = tips(&problem, &[vec![0.0, 0.7, 0.0, 0.0]], &DVector::zeros(0))[0];
    let shoulder = nalgebra::Rotation3::from_euler_angles(0.4, 0.5, 0.6);
    let turn = |angle: f64| nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), angle);
    let elbow = Vector3::new(0.1, 0.2, 0.3) + shoulder * (turn(0.7) * Vector3::new(0.3, 0.0, 0.0));
    let last = shoulder * turn(0.7) * turn(0.25 - 0.7);
    assert!((origin - (elbow + last * Vector3::new(0.1, 0.1, 0.0))).norm() < 1e-9, "{origin}");
    assert!((x - last * Vector3::x()).norm() < 1e-9, "{x}");
}

/// Two revolute joints, the second one turned, and a fixed tip.
fn turned(rotation: &str) -> String {
    format!(
        "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><link name=\"c\"/><link name=\"d\"/>\
         <joint name=\"j1\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/><origin xyz=\"0 0 0.3\"/><axis xyz=\"0 0 1\"/>\
         <limit lower=\"-1\" upper=\"1\"/></joint>\
         <joint name=\"j2\" type=\"revolute\"><parent link=\"b\"/><child link=\"c\"/><origin xyz=\"0.2 0.1 0\" {rotation}/>\
         <axis xyz=\"0 1 0\"/><limit lower=\"-1\" upper=\"1\"/></joint>\
         <joint name=\"j3\" type=\"fixed\"><parent link=\"c\"/><child link=\"d\"/><origin xyz=\"0.1 0.2 0.3\"/></joint></robot>"
    )
}

#[test]
fn a_rotation_may_be_a_quaternion() {
    let tip = |text: &str| {
        let robot = Robot::parse(text, Path::new("r.urdf")).unwrap();
        let described = describe(&Chain::new(&robot, None, None).unwrap()).unwrap();
        let mut problem = parse(&described.text);
        problem.parameters.clear();
        let moving = |joint: &flexcal::problem::Joint| joint.kind != JointKind::Fixed;
        let mut commands = [0.4, -0.7].into_iter();
        let q: Vec<f64> = problem
            .joints
            .iter()
            .map(|joint| if moving(joint) { commands.next().unwrap() } else { 0.0 })
            .collect();
        tips(&problem, &[q], &DVector::zeros(0))[0]
    };
    for (rpy, quaternion) in [
        ("1.5707963267948966 0 0", "0.7071068 0 0 0.7071068"),
        ("0 1.5707963267948966 0", "0 0.70710678118654752 0 0.70710678118654752"),
        (
            "0.3 -0.4 0.5",
            "0.19050591331489203 -0.15409707606385747 0.2685154702459379 0.9315905916115894",
        ),
    ] {
        let expected = tip(&turned(&format!("rpy=\"{rpy}\"")));
        let found = tip(&turned(&format!("quat_xyzw=\"{quaternion}\"")));
        let off: f64 = expected.iter().zip(&found).map(|(a, b)| (a - b).norm()).sum();
        assert!(off < 1e-12, "{rpy}: {off:e}");
    }
}

#[test]
fn the_tip_is_guessed_where_one_link_is_plainly_meant() {
    let arm = |beside: &str| {
        let joints: Vec<String> = (1..=5)
            .map(|k| {
                format!(
                    "<link name=\"l{k}\"/><joint name=\"j{k}\" type=\"continuous\"><parent link=\"l{}\"/><child link=\"l{k}\"/>\
                     <origin xyz=\"0.1 0 0.2\" rpy=\"0 {} 0\"/><axis xyz=\"0 0 1\"/></joint>",
                    k - 1,
                    0.3 * f64::from(k)
                )
            })
            .collect();
        format!("<robot name=\"r\"><link name=\"l0\"/>{}{beside}</robot>", joints.concat())
    };
    let leaf = |name: &str, parent: &str| {
        format!(
            "<link name=\"{name}\"/><joint name=\"of_{name}\" type=\"fixed\"><parent link=\"{parent}\"/><child link=\"{name}\"/></joint>"
        )
    };
    let side = |parent: &str| leaf("side", parent);
    let text = arm(&side("l1"));
    let robot = Robot::parse(&text, Path::new("r.urdf")).unwrap();
    let notes = describe(&Chain::new(&robot, None, None).unwrap()).unwrap().notes.join("\n");
    assert!(notes.contains("tip l5 taken") && notes.contains("side (1 moving joint)"), "{notes}");
    assert!(notes.contains("no fixed joint follows the moving joint j5"), "{notes}");
    let fixed = describe(&Chain::new(&robot, None, Some("side")).unwrap()).unwrap().notes.join("");
    assert!(!fixed.contains("no fixed joint"), "{fixed}");
    let error = Chain::new(&robot, None, Some("j5")).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("(that is a joint; its link is l5)"), "{error}");
    let text = arm(&side("l4"));
    let robot = Robot::parse(&text, Path::new("r.urdf")).unwrap();
    let error = Chain::new(&robot, None, None).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("l5 (5 moving joints), side (4 moving joints)"), "{error}");
    // A second frame of the base is no end, and hides no link that carries both ends.
    let text = arm(&[leaf("tool0", "l5"), leaf("ee", "l5"), leaf("base", "l0")].concat());
    let robot = Robot::parse(&text, Path::new("r.urdf")).unwrap();
    let error = Chain::new(&robot, None, None).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("with --tip, or l5, which") && !error.contains("base ("), "{error}");
    assert!(Chain::new(&robot, None, Some("l5")).is_ok());
}
