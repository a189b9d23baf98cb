//! Errors in fixtures and their rows, and quantities that such rows cannot determine.

use std::path::Path;

use flexcal::fit::{FindingCode, Identification, Options, identify};
use flexcal::least_squares::UnidentifiableCombination;
use flexcal::rig::Truth;

use crate::bench::{ARM, AROUND, Bench, LINE, problem, true_arm};
use crate::common::arms::parse;
use crate::common::program::assert_contains;
use crate::common::reading::{assert_says, problem_error, read_dataset, try_dataset};

fn table(more: &str, rows: &str) -> String {
    try_dataset(&problem(more), rows).unwrap_err().to_string()
}

#[test]
fn sections() {
    for (more, words) in [
        ("[[point]]\n", "point[1].name: missing"),
        ("[[point]]\nname = \"a b\"\n", "cannot name a fixture"),
        ("[[point]]\nname = \"a\"\n[[point]]\nname = \"a\"\n", "another point is called \"a\""),
        ("[[point]]\nname = \"a\"\nat_mm = [1, 2]\n", "a vector has 3 numbers"),
        ("[[anchor]]\nname = \"a\"\nat = [1, 2, 3]\n", "needs a unit"),
        ("[[surface]]\nname = \"a\"\n", "surface[1].kind: missing"),
        ("[[surface]]\nname = \"a\"\nkind = \"cone\"\n", "none of plane, sphere"),
        ("[[surface]]\nname = \"a\"\nkind = \"plane\"\nnormal = [0, 0, 0]\n", "has no direction"),
        ("[[surface]]\nname = \"a\"\nkind = \"sphere\"\nradius_mm = 0\n", "not above zero"),
        (
            "[[point]]\nname = \"a\"\n[[distance]]\nbetween = [\"a\", \"b\"]\nmm = 50\n",
            "no point is called \"b\"",
        ),
        (
            "[[point]]\nname = \"a\"\n[[distance]]\nbetween = [\"a\", \"a\"]\nmm = 50\n",
            "two different points",
        ),
        (
            "[[point]]\nname = \"a\"\n[[point]]\nname = \"b\"\n[[distance]]\nbetween = [\"a\", \"b\"]\n",
            "distance[1].mm: missing",
        ),
    ] {
        let text = format!("{ARM}{more}");
        assert_says(&problem_error(&text), &[words, "problem.toml:"]);
    }
}

#[test]
fn rows() {
    let q = "0.1,0.2,0.3,0.4,0.5,0.6";
    for (columns, cells, words) in [
        (
            "point",
            "middle",
            ":2: column point: no point is called \"middle\"; there are left, right, top",
        ),
        ("anchor,distance_mm", "C,800", ":2: column anchor: no anchor is called \"C\""),
        ("surface", "wall", ":2: column surface: no surface is called \"wall\""),
        ("anchor,distance_mm", "A,", ":2: column anchor: an anchor without a distance"),
        ("anchor,distance_mm", ",800", ":2: column distance_mm: a distance without an anchor"),
        ("anchor,distance_mm", "A,-3", ":2: column distance_mm: -0.003 is not above zero"),
        ("distance_mm", "800", ":1: column anchor: missing"),
        ("offset_mm", "800", ":1: column surface: missing"),
        ("point", "", ":2: nothing is measured in this row"),
        ("point,x_mm,y_mm,z_mm", ",1,2,", ":2: column z_mm: the cell is empty"),
        ("point", "left", ":2: column point: the point \"left\" is measured by 1 row only"),
        (
            "anchor,distance_mm",
            "A,800",
            ":2: column anchor: the anchor \"A\" is measured by 1 row only",
        ),
    ] {
        let text = format!("q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,{columns}\n{q},{cells}\n");
        let around = AROUND.replace(
            "[[distance]]\nbetween = [\"left\", \"right\"]\nmm = 593.717104\nsigma_mm = 0.01\n",
            "",
        );
        let error = table(&around, &text);
        assert!(error.contains(words), "{columns} {cells}: {error}");
    }
    // A word of an undeclared kind, together with declared ones and alone.
    let surface =
        "[[surface]]\nname = \"table\"\nkind = \"plane\"\n[data]\nsurface_sigma_mm = 0.05\n";
    for (around, location) in [(surface, ":2: column point"), ("", ":1: column point")] {
        let text = format!("q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,point,surface\n{q},left,\n");
        let error = table(around, &text);
        assert!(error.contains(location) && error.contains("[[point]]"), "{error}");
    }
    let two = format!(
        "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,point,anchor,distance_mm\n{q},left,A,800\n"
    );
    let error = table(&AROUND.replace("distance_sigma_mm = 0.05\n", ""), &two);
    assert!(error.contains("write distance_sigma_mm in [data]"), "{error}");
}

/// Without a known length the scale is unidentifiable, without a tracker the base: both are named.
#[test]
fn what_contacts_cannot_tell_is_named() {
    let free = AROUND.replace(
        "[[distance]]\nbetween = [\"left\", \"right\"]\nmm = 593.717104\nsigma_mm = 0.01\n",
        "",
    );
    let text = format!("\"base.*\" = {{ free = true }}\n{free}");
    let problem = problem(&text);
    let (arm, _) = true_arm(&problem, 2);
    let found = identify(
        &problem,
        &read_dataset(&problem, &Bench::new(arm, 7).table(&["point"], 90)),
        &Options::default(),
    )
    .unwrap();
    assert!(found.is_trusted(), "{:?}", found.findings);
    for name in ["base.x", "base.y", "base.z", "base.rx", "base.ry", "base.rz"] {
        assert_eq!(found.estimate(name).unwrap().std_error, None, "{name}");
    }
    assert!(found.identifiability().unidentifiable.len() >= 6);
}

/// Distances to anchors on a line leave a rotation of the base about the line unidentifiable, for
/// any position of the anchors.
#[test]
fn collinear_anchors_leave_a_turn_of_the_base_open() {
    let at = |(name, [x, y, z]): &(&str, [f64; 3])| {
        format!("[[anchor]]\nname = \"{name}\"\nat_m = [{x}, {y}, {z}]\n")
    };
    let around: String = LINE.iter().map(at).collect();
    let held_out = "held_out = { fraction = 0.2, seed = 1 }";
    let text = format!(
        "\"base.*\" = {{ free = true }}\n{around}[data]\ndistance_sigma_mm = 0.05\n{held_out}\n"
    );
    let problem = problem(&text);
    let (arm, _) = true_arm(&problem, 2);
    let data = read_dataset(&problem, &Bench::new(arm, 7).table(&["distance on a line"], 150));
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let named = |combination: &UnidentifiableCombination| {
        combination.weights.iter().map(|&(k, _)| found.unknowns[k].clone()).collect::<Vec<String>>()
    };
    let all: Vec<Vec<String>> = found.identifiability().unidentifiable.iter().map(named).collect();
    let of_base = |names: &&Vec<String>| names.iter().all(|name| name.starts_with("base."));
    let open: Vec<&Vec<String>> = all.iter().filter(of_base).collect();
    assert!(open.len() == 1 && open[0].contains(&"base.ry".to_owned()), "{all:?}");
    assert_eq!(found.estimate("base.ry").unwrap().std_error, None);
}

#[test]
fn what_nobody_knows_is_neither_held_nor_about_zero() {
    for rule in ["{ fixed = true }", "{ sigma_mm = 2 }"] {
        let problem = problem(&format!("\"anchor[A].x\" = {rule}\n{AROUND}"));
        let data = read_dataset(&problem, &Bench::new(problem.clone(), 7).table(&["distance"], 40));
        let error =
            identify(&problem, &data, &Options::default()).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("the place of anchor[A].x is") && error.contains("at_m"), "{error}");
    }
}

/// Names exchanged in some rows leave residuals that noise cannot explain. A single point that the
/// nominal arm places millimetres apart is no reason for a warning.
#[test]
fn exchanged_names_are_not_trusted() {
    let alone = "[[point]]\nname = \"left\"\n[data]\npoint_sigma_mm = 0.05\nheld_out = { fraction = 0.2, seed = 1 }\n";
    for (kind, around, exchanged) in [
        ("point", AROUND, Some(["left", "right"])),
        ("distance", AROUND, Some(["A", "B"])),
        ("tilt", AROUND, Some(["flange", "roll"])),
        ("point", alone, None),
    ] {
        let problem = problem(around);
        let (arm, _) = true_arm(&problem, 3);
        let text = Bench::new(arm, 5).table(&[kind], 120);
        let rows = text.lines().enumerate().filter(|(_, line)| {
            around != alone || !line.contains("right,") && !line.contains("top,")
        });
        let row = |(k, line): (usize, &str)| match exchanged {
            Some([one, other]) if k > 0 && k % 12 < 3 => {
                let cell = |cell: &str| match cell {
                    cell if cell == one => other.to_owned(),
                    cell if cell == other => one.to_owned(),
                    cell => cell.to_owned(),
                };
                line.split(',').map(cell).collect::<Vec<_>>().join(",") + "\n"
            }
            _ => format!("{line}\n"),
        };
        let found = identify(
            &problem,
            &read_dataset(&problem, &rows.map(row).collect::<String>()),
            &Options::default(),
        )
        .unwrap();
        if exchanged.is_some() {
            let error = found.first_error().unwrap();
            assert_eq!(
                (error.code, error.word("kind")),
                (FindingCode::MissesMeasurements, Some(kind)),
                "{error:?}"
            );
            continue;
        }
        assert!(found.is_trusted(), "{:?}", found.findings);
        let asked = found.has(FindingCode::NominalFarOff);
        assert!(!asked, "{:?}", found.findings);
    }
}

/// The rig needs no σ of positions if none is measured and no other kind uses it.
#[test]
fn noise_of_what_is_measured() {
    let around =
        "[[anchor]]\nname = \"A\"\nat_m = [1.5, 0.5, 1.2]\n[data]\ntilt_sigma_deg = 0.002\n";
    let problem = problem(around);
    let poses = "[poses]\nq1_deg = [-90, 90]\nq2_deg = [-60, 60]\nq3_deg = [-60, 60]\nq4_deg = [-90, 90]\nq5_deg = [-90, 90]\n\
                 q6_deg = [-90, 90]\ntilts = [\"tool\"]\n";
    for (noise, more, is_enough) in [
        ("distance_sigma_mm = 0.05\ntilt_sigma_deg = 0.01", "", true),
        ("distance_sigma_mm = 0.05\ntilt_sigma_deg = 0.01", "positions = 3\n", false),
        ("tilt_sigma_deg = 0.01", "", false),
    ] {
        let text = format!("[noise]\n{noise}\n{poses}{more}");
        match Truth::parse(&text, Path::new("TRUTH.toml"), &problem) {
            Ok(_) => assert!(is_enough, "{text}"),
            Err(error) => assert!(
                !is_enough && error.to_string().contains("position_sigma_mm: missing"),
                "{error}"
            ),
        }
    }
}

/// Returns true if the fit reports that the rows leave the scale open.
fn is_open(found: &Identification) -> bool {
    found.findings.iter().any(|finding| finding.word("what") == Some("scale"))
}

/// Contacts without a known length leave the scale open, however narrow the priors of the lengths
/// are; a wrong length makes all lengths wrong in proportion.
#[test]
fn the_scale_of_contacts_is_that_of_the_known_length() {
    let known = "[[distance]]\nbetween = [\"left\", \"right\"]\nmm = 593.717104\nsigma_mm = 0.01\n";
    let found = |length: &str| {
        let mut problem = problem(&AROUND.replace(known, length));
        // Moments of known weights would depend on the lengths.
        problem.joints.iter_mut().for_each(|joint| joint.stiffness = None);
        problem.parameters.retain(|rule| !rule.pattern.contains("stiffness"));
        let (arm, _) = true_arm(&problem, 2);
        let data = read_dataset(&problem, &Bench::new(arm, 7).table(&["point"], 90));
        identify(&problem, &data, &Options::default()).unwrap()
    };
    let without = found("");
    assert!(is_open(&without), "{:?}", without.findings);
    let right = found(known);
    assert!(right.is_trusted() && !is_open(&right), "{:?}", right.findings);
    assert!(!right.has(FindingCode::ScaleContradicted), "{:?}", right.findings);
    let wrong = found(&known.replace("593.7", "581.8"));
    let finding = wrong.finding(FindingCode::ScaleContradicted).unwrap().to_string();
    assert_contains(&finding, &["a common factor of 0.98", "% shorter than declared"]);
    assert!(finding.contains("\"left\" to \"right\" is declared 581.817 mm"), "{finding}");
    assert!(!wrong.is_trusted());
}

/// The commands of a sliding joint are lengths, so that contacts determine the scale of an arm that
/// has one.
#[test]
fn the_commands_of_a_slide_give_the_scale() {
    let point = "[[point]]\nname = \"left\"\n[[point]]\nname = \"right\"\n[[point]]\nname = \"top\"\n\
                 [data]\npoint_sigma_mm = 0.05\nheld_out = { fraction = 0.2, seed = 1 }\n";
    for (kind, scale) in [("", true), ("kind = \"prismatic\", ", false)] {
        let arm = ARM.replace("{ name = \"elbow\", ", &format!("{{ name = \"elbow\", {kind}"));
        let mut problem = parse(&format!("{arm}{point}"));
        // Moments of known weights would depend on the lengths.
        problem.joints.iter_mut().for_each(|joint| joint.stiffness = None);
        problem.parameters.retain(|rule| !rule.pattern.contains("stiffness"));
        let (arm, _) = true_arm(&problem, 2);
        let text = Bench::new(arm, 7).table(&["point"], 60);
        let text = if scale { text } else { text.replace("q3_rad", "q3_m") };
        let data = read_dataset(&problem, &text);
        let found = identify(&problem, &data, &Options::default()).unwrap();
        assert_eq!(is_open(&found), scale, "{kind} {:?}", found.findings);
    }
}

/// Two wrong entries among four lengths of an arm are no common factor.
#[test]
fn two_wrong_lengths_are_no_scale() {
    let lengths = ARM.replace("alpha_deg = 90, stiffness", "alpha_deg = 90, a_m = 0.3, stiffness");
    let lengths = lengths.replace("a_m = 0.1, d_m = 0.55", "a_m = 0.3, d_m = 0.55");
    let mut problem = parse(&format!("{lengths}{AROUND}"));
    problem.joints.iter_mut().for_each(|joint| joint.stiffness = None);
    problem.parameters.retain(|rule| !rule.pattern.contains("stiffness"));
    for (others, contradicted) in [(1.0, false), (1.04, true)] {
        let (mut arm, _) = true_arm(&problem, 2);
        arm.joints[1].a *= others;
        arm.joints[3].a *= others;
        arm.joints[2].a *= 1.04;
        arm.joints[3].d *= 1.04;
        let data = read_dataset(&problem, &Bench::new(arm, 7).table(&["point"], 90));
        let found = identify(&problem, &data, &Options::default()).unwrap();
        let scale = found.has(FindingCode::ScaleContradicted);
        assert_eq!(scale, contradicted, "{:?}", found.findings);
    }
}
