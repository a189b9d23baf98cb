//! Views that leave the pose of a camera or a marker open, and views that determine it.

use std::fmt::Write as _;

use flexcal::fit::{FindingCode, Identification, Options, identify};
use flexcal::results::{Document as _, IdentificationResult};
use nalgebra::DVector;

use crate::cameras::{measured_with, split};
use crate::common::arms::parse;
use crate::common::made::model_of;
use crate::common::program::{Folder, assert_contains};
use crate::common::reading::read_table;

/// Gantry of three axes, whose hand does not turn.
const GANTRY: &str = "joint = [{ kind = \"prismatic\" }, { kind = \"prismatic\", alpha_deg = -90, \
                      theta_deg = 90 }, { kind = \"prismatic\", alpha_deg = 90 }]";
/// Three joints with parallel axes, whose hand turns about the vertical alone.
const SCARA: &str = "joint = [{ d_m = 0.5 }, { a_m = 0.3 }, { a_m = 0.3, alpha_deg = 180 }]";
/// Shoulder, elbow and wrist, whose hand turns about every axis.
const WRIST: &str = "joint = [{ d_m = 0.4 }, { alpha_deg = -90 }, { alpha_deg = 90, d_m = 0.3 }]";
/// Rules that free the poses of camera and marker.
const POSES: &str = r#"
"camera*.x" = { free = true }
"camera*.y" = { free = true }
"camera*.z" = { free = true }
"camera*.r*" = { free = true }
"marker*" = { free = true }
"#;

/// Set-up of a camera and a flat marker of nine points on an arm.
struct SetUp {
    arm: &'static str,
    /// Frame that carries the camera and its true pose there.
    camera: [&'static str; 2],
    /// Frame that carries the marker and its true pose there.
    marker: [&'static str; 2],
    /// Ranges of the joints, mean and half width.
    joints: [[f64; 2]; 3],
}

impl SetUp {
    /// Returns the problem with these `rules` of `[parameters]`.
    fn problem(&self, rules: &str) -> String {
        let points: Vec<String> =
            (0..9).map(|k| format!("[{}, {}, 0]", 40 * (k % 3), 40 * (k / 3))).collect();
        let Self { arm, camera: [camera, camera_at], marker: [marker, marker_at], .. } = self;
        format!(
            "name = \"views\"\n{arm}\n[[camera]]\nname = \"eye\"\non = \"{camera}\"\n{camera_at}\n\
             focal_px = [900, 900]\ncentre_px = [640, 480]\npixel_sigma = 0.2\n[[marker]]\n\
             name = \"board\"\non = \"{marker}\"\n{marker_at}\npoints_mm = [{}]\n[parameters]\n\
             \"joint*.*\" = {{ fixed = true }}\n{rules}\n[data]\n\
             held_out = {{ fraction = 0.2, seed = 1 }}\n",
            points.join(", ")
        )
    }

    /// Fits the problem with these `rules` of `[parameters]` to images that the declared arm takes.
    fn fit(&self, rules: &str) -> Identification {
        let problem = parse(&self.problem(rules));
        let slides = self.arm.contains("prismatic");
        let unit = if slides { "m" } else { "rad" };
        let mut table = format!("q1_{unit},q2_{unit},q3_{unit},camera,marker,point,u_px,v_px\n");
        let number = |k: u32| (f64::from(k) * 0.754_877_666).fract() * 2.0 - 1.0;
        for view in 1..=20 {
            let joint = |(k, [at, range]): (u32, [f64; 2])| at + range * number(7 * view + 3 * k);
            let q: Vec<String> =
                (0..).zip(self.joints).map(|of| format!("{:.4}", joint(of))).collect();
            for point in 0..9 {
                writeln!(table, "{},eye,board,{point},1,1", q.join(",")).unwrap();
            }
        }
        let rows = read_table(&problem, &table);
        let model = model_of(&problem, &rows);
        let rows = measured_with(&model, &rows, &DVector::zeros(model.parameters.len()), (1.0, 5));
        assert!(rows.len() > 120, "{} rows in view", rows.len());
        identify(&problem, &split(&problem, rows), &Options::default()).unwrap()
    }
}

/// Returns the kind of movement that the finding names, with its text; `None` without the finding.
fn named(found: &Identification) -> Option<(String, String)> {
    let finding = found.finding(FindingCode::ViewsUndecided)?;
    assert!(!found.is_trusted());
    Some((finding.word("kind").unwrap().to_owned(), finding.to_string()))
}

#[test]
fn a_hand_that_only_translates_or_turns_about_one_axis_leaves_poses_open() {
    let gantry = SetUp {
        arm: GANTRY,
        camera: ["joint3", "at_m = [0, 0, 0.05]\nrotation_deg = [0, 0, 20]"],
        marker: ["world", "at_m = [0.6, 0.1, 0.1]\nrotation_deg = [0, 70, 0]"],
        joints: [[0.1, 0.12]; 3],
    };
    let open = gantry.fit(POSES);
    let (kind, said) = named(&open).unwrap();
    assert_eq!(kind, "translation");
    assert_contains(
        &said,
        &[
            "the views leave the poses of camera[eye] and marker[board] open: they only translate",
            "30° and more about two axes that are not parallel",
        ],
    );
    let text = gantry.problem(POSES);
    let folder = Folder::with([("problem.toml", text.as_str()), ("arm.urdf", "<robot/>")]);
    folder.write("e.json", IdentificationResult::new(&parse(&text), &open).to_json());
    for form in ["--urdf arm.urdf", "--format opencv"] {
        let run = folder.flexcal(&format!("export . --estimate e.json {form}")).code(2);
        assert_contains(&run.message(), &["do not determine x, y, z of camera \"eye\""]);
    }
    // With one of the poses known, as a number or by a prior, the other follows.
    for rules in [
        "\"marker*\" = { free = true }".to_owned(),
        POSES.replace("\"marker*\" = { free = true }", ""),
        POSES.replace(
            "\"marker*\" = { free = true }",
            "\"marker*\" = { sigma_mm = 3, sigma_deg = 1 }",
        ),
    ] {
        let found = gantry.fit(&rules);
        assert_eq!(named(&found), None, "{rules}");
        assert!(found.is_trusted(), "{rules} {:?}", found.findings);
    }
    // Across a board that is seen from the front, the distance follows from the focal length alone.
    let focal = "\"camera*.z\" = { free = true }\n\"camera*.f*\" = { free = true }\n";
    let flat = SetUp {
        marker: ["world", "at_m = [0.6, 0.1, 0.1]\nrotation_deg = [0, 90, 0]"],
        joints: [[0.1, 0.12], [0.1, 0.12], [0.1, 0.0]],
        ..gantry
    };
    let (kind, said) = named(&flat.fit(focal)).unwrap();
    assert_eq!(kind, "frontal");
    assert_contains(&said, &["pose of camera[eye] open", "from the front only", "hold fx and fy"]);

    let scara = SetUp {
        arm: SCARA,
        camera: ["joint3", "at_m = [0.02, 0, 0.05]\nrotation_deg = [0, 0, 20]"],
        marker: ["world", "at_m = [0.45, 0, 0]\nrotation_deg = [0, 0, 0]"],
        joints: [[0.0, 0.3], [0.0, 0.5], [0.0, 1.0]],
    };
    let (kind, said) = named(&scara.fit(POSES)).unwrap();
    assert_eq!(kind, "one-axis");
    assert_contains(&said, &["about one axis only", "from the front only"]);
    // Priors of tilts determine the height within decimetres and more.
    let tilts = scara.fit(&format!("\"joint*.alpha\" = {{ sigma_deg = 0.2 }}\n{POSES}"));
    let (_, said) = named(&tilts).unwrap();
    assert_contains(&said, &["camera[eye] and marker[board] open", "from the front only"]);
    let found = scara.fit(&format!("{POSES}\"camera[eye].z\" = {{ fixed = true }}\n"));
    assert_eq!(named(&found), None);
    assert!(found.is_trusted(), "{:?}", found.findings);
}

#[test]
fn poses_that_the_views_determine_are_not_accused() {
    let free_base = format!("{POSES}\"base.*\" = {{ free = true }}\n");
    let hand = SetUp {
        arm: WRIST,
        camera: ["joint3", "at_m = [0.02, 0, 0.05]\nrotation_deg = [0, 0, 20]"],
        marker: ["world", "at_m = [0.1, -0.05, 1.1]\nrotation_deg = [180, 0, 0]"],
        joints: [[0.0, 0.2], [0.0, 0.25], [0.0, 1.0]],
    };
    let apart = SetUp {
        camera: ["world", "at_m = [0.1, 0, 1.4]\nrotation_deg = [180, 0, 0]"],
        marker: ["joint3", "at_m = [0.02, 0, 0.05]\nrotation_deg = [0, 0, 20]"],
        ..hand
    };
    for set_up in [hand, apart] {
        for rules in [POSES, &free_base] {
            let found = set_up.fit(rules);
            assert_eq!(named(&found), None, "{rules}");
            assert!(found.is_trusted(), "{rules} {:?}", found.findings);
        }
    }
}
