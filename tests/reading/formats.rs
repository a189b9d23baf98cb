//! Valid problems and measurements, and the values read from them.

#![expect(clippy::float_cmp, reason = "these conversions are exact")]

use std::f64::consts::FRAC_PI_2;
use std::fs;
use std::path::Path;

use flexcal::measurement::{Measurements, Split};
use flexcal::problem::{
    Effect, Equilibrium, FreeLength, Freedom, HeldOut, JointKind, Problem, Quantities,
};
use nalgebra::Vector3;

use crate::common::arms::parse;
use crate::common::reading::{assert_says, read_table, read_tables, table_error, try_table};

const CASES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cases");

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * b.abs().max(1.0)
}

#[test]
fn the_example_case_is_read_from_its_folder() {
    let problem = Problem::read(Path::new(CASES)).unwrap();
    assert_eq!(problem.name, "lunar-sampler");
    assert_eq!(problem.gravity, Vector3::new(0.0, 0.0, -9.80665));
    assert_eq!(problem.joints.len(), 4);
    assert!(close(problem.joints[1].alpha, FRAC_PI_2));
    assert_eq!(problem.joints[1].stiffness, Some(5.2e4));
    assert_eq!(problem.joints[0].stiffness, None);
    let beam = problem.joints[3].beam.as_ref().unwrap();
    assert_eq!((beam.name.as_str(), beam.gj), ("B", Some(1.15e4)));
    assert_eq!(beam.masses[0].position, Vector3::new(1.15, 0.0, 0.11));
    let hoist = beam.hoist.as_ref().unwrap();
    assert_eq!((hoist.force, hoist.direction), (62.0, Vector3::z()));
    assert_eq!(problem.tool.payload_at, problem.tool.target);
    assert_eq!(problem.data.files, [Path::new(CASES).join("a-none.csv")]);
    assert_eq!(problem.data.position_sigma, Some(5e-5));
    assert_eq!(problem.data.held_out, Some(HeldOut::Column("split".into())));
    let patterns: Vec<_> = problem.parameters.iter().map(|rule| rule.pattern.as_str()).collect();
    assert_eq!(patterns[..3], ["joint*.alpha", "joint*.a", "joint*.theta"]);
    assert_eq!(patterns[5..], ["joint*.stiffness", "A.*", "B.*", "tool.*"]);
    assert_eq!(problem.parameters[0].location.line, Some(70));

    let (measurements, warnings) = Measurements::read(&problem.data.files, &problem).unwrap();
    assert_eq!(warnings, []);
    assert_eq!(measurements.len(), 78);
    assert_eq!(measurements.origin[0], (0, 2));
    assert!(close(measurements.configuration(0)[1], 17.984_805_f64.to_radians()));
    assert!(close(measurements.positions[1].y, 2.425_252_2));
    assert_eq!(measurements.payload.as_ref().unwrap()[1], 0.5);
    assert_eq!(measurements.approach.as_ref().unwrap()[..4], [-1.0, -1.0, -1.0, 1.0]);
    assert_eq!((measurements.time[1], measurements.time_measured), (136.0, true));
    let split = Split::new(&problem, &measurements).unwrap();
    assert_eq!((split.identification.len(), split.held_out.len()), (28, 50));
}

#[test]
fn several_files_follow_each_other() {
    let problem = Problem::read(&Path::new(CASES).join("problem.toml")).unwrap();
    let files = ["a-none.csv", "h-none-large.csv"].map(|name| Path::new(CASES).join(name));
    let (measurements, _) = Measurements::read(&files, &problem).unwrap();
    assert_eq!(measurements.len(), 378);
    assert_eq!(measurements.origin[78], (1, 2));
    assert_eq!(measurements.session.names, [""]);
    assert_eq!(measurements.session.of_row.len(), 378);
}

#[test]
fn the_example_of_the_format_is_valid() {
    // The example shows one joint of several; the others and a beam length complete it.
    let text = fs::read_to_string(Path::new(CASES).join("every-key.toml")).unwrap();
    let text = text.replacen("[joint.beam]", "a_m = 1.95\n[joint.beam]", 1);
    let problem = parse(&text.replacen("[tool]", "[[joint]]\n[[joint]]\n[tool]", 1));
    assert_eq!(problem.statics.equilibrium, Equilibrium::Deflected);
    assert_eq!(problem.effects[0].effect, Effect::JointHarmonic { joint: 3, orders: vec![1] });
    let Freedom::Free { sigma, min, max } = &problem.parameters[1].freedom else {
        panic!("joint*.a is free")
    };
    assert_eq!(sigma.length, Some(0.03));
    assert_eq!((min.length, max.length), (Some(-0.05), Some(0.05)));
    assert!(matches!(problem.parameters.last().unwrap().freedom, Freedom::Fixed));
}

#[test]
fn what_is_left_out_has_its_default() {
    let problem = parse("name = 'arm'\n[[joint]]\n");
    assert_eq!(problem.title, "arm");
    assert_eq!(problem.gravity, Vector3::new(0.0, 0.0, -9.80665));
    assert_eq!(problem.statics.beam_elements, 1);
    assert_eq!(
        (problem.joints[0].name.as_str(), problem.joints[0].kind),
        ("joint 1", JointKind::Revolute)
    );
    assert_eq!(problem.tool.target, Vector3::zeros());
    assert!(
        problem.parameters.is_empty()
            && problem.data.files.is_empty()
            && problem.data.held_out.is_none()
    );
}

#[test]
fn either_unit_of_a_kind_will_do() {
    let degrees = parse(
        "name = 'arm'\n[[joint]]\nalpha_deg = 90\na_mm = 1500\n[tool]\ntarget_mm = [1, 2, 3]\n\
         [base]\nrotation_rad = [0, 0, 1.5]\n[parameters]\n'joint*' = { sigma_rad = 1, sigma_m = 1, min_mm = -1 }\n\
         [data]\nposition_sigma_m = 1e-5\n",
    );
    let radians = parse("name = 'arm'\n[[joint]]\nalpha_rad = 1.5707963267948966\na_m = 1.5\n");
    assert!(close(degrees.joints[0].alpha, radians.joints[0].alpha));
    assert!(close(degrees.joints[0].a, radians.joints[0].a));
    assert_eq!(degrees.tool.target, Vector3::new(1e-3, 2e-3, 3e-3));
    assert_eq!(degrees.base.rotation, Vector3::new(0.0, 0.0, 1.5));
    assert_eq!(degrees.data.position_sigma, Some(1e-5));
    let Freedom::Free { sigma, min, .. } = &degrees.parameters[0].freedom else {
        panic!("joint* is free")
    };
    assert_eq!(*sigma, Quantities { angle: Some(1.0), length: Some(1.0), ..Quantities::default() });
    assert_eq!(min.length, Some(-1e-3));
}

#[test]
fn rules_say_what_is_free() {
    let rule = |text: &str| {
        let text = format!("name = 'arm'\n[[joint]]\n[parameters]\n'tool.*' = {text}\n");
        parse(&text).parameters.remove(0).freedom
    };
    assert!(matches!(rule("{ fixed = true }"), Freedom::Fixed));
    assert!(matches!(rule("{ free = false }"), Freedom::Fixed));
    for free in [
        "{ free = true }",
        "{ fixed = false }",
        "{ min_mm = 0, max_mm = 0 }",
        "{ free = true, sigma_mm = 1 }",
    ] {
        assert!(matches!(rule(free), Freedom::Free { .. }), "{free}");
    }
}

#[test]
fn every_effect_has_its_arguments() {
    let effects = [
        ("joint-compliance = { joint = 1 }", Effect::JointCompliance { joint: 1 }),
        (
            "joint-harmonic = { joint = 2, orders = [1, 3] }",
            Effect::JointHarmonic { joint: 2, orders: vec![1, 3] },
        ),
        ("joint-wave = { joint = 1, order = 7.37 }", Effect::JointWave { joint: 1, order: 7.37 }),
        ("gear-ratio = { joint = 1 }", Effect::GearRatio { joint: 1 }),
        ("backlash = { joint = 1 }", Effect::Backlash { joint: 1 }),
        ("joint-nonlinear-stiffness = { joint = 1 }", Effect::JointNonlinearStiffness { joint: 1 }),
        ("joint-lateral-compliance = { joint = 1 }", Effect::JointLateralCompliance { joint: 1 }),
        (
            "gravity-compensator = { joint = 1, anchor_mm = [-50, 400], lever_m = [0.5, 0], free_length_mm = 250 }",
            Effect::GravityCompensator {
                joint: 1,
                anchor: [-0.05, 0.4],
                lever: [0.5, 0.0],
                free_length: FreeLength(0.25),
            },
        ),
        ("joint-thermal-drift = { joint = 1 }", Effect::JointThermalDrift { joint: 1 }),
        (
            "joint-hysteresis = { joint = 1, distance_rad = 0.5 }",
            Effect::JointHysteresis { joint: 1, distance: 0.5 },
        ),
        (
            "joint-thermal-drift-lag = { joint = 1, time_constant_s = 90 }",
            Effect::JointThermalDriftLag { joint: 1, time_constant: 90.0 },
        ),
        (
            "link-thermal-bending-lag = { link = 'A', time_constant_s = 90 }",
            Effect::LinkThermalBendingLag { link: "A".into(), time_constant: 90.0 },
        ),
        (
            "link-thermal-expansion-lag = { link = 'A', time_constant_s = 90 }",
            Effect::LinkThermalExpansionLag { link: "A".into(), time_constant: 90.0 },
        ),
        ("joint-coupling = { joint = 1, from = 2 }", Effect::JointCoupling { joint: 1, from: 2 }),
        ("link-bending = { joint = 1 }", Effect::LinkBending { joint: 1 }),
        ("slide-bending = { joint = 3 }", Effect::SlideBending { joint: 3 }),
        ("twist-bending = { link = 'A' }", Effect::TwistBending { link: "A".into() }),
        ("link-thermal-bending = { link = 'A' }", Effect::LinkThermalBending { link: "A".into() }),
        (
            "link-thermal-expansion = { link = 'A' }",
            Effect::LinkThermalExpansion { link: "A".into() },
        ),
        ("arm-thermal-expansion = true", Effect::ArmThermalExpansion),
        ("unmodelled-mass = { link = 'A' }", Effect::UnmodelledMass { link: "A".into() }),
        ("payload-mass = {}", Effect::PayloadMass),
        ("hoist-force = true", Effect::HoistForce),
        ("hoist-direction = {}", Effect::HoistDirection),
        ("base-compliance = {}", Effect::BaseCompliance),
        ("gravity-direction = {}", Effect::GravityDirection),
        ("deflected-equilibrium = {}", Effect::DeflectedEquilibrium),
        ("tracker-scale = {}", Effect::TrackerScale),
        ("frame-strain = {}", Effect::FrameStrain),
        ("payload-backlash = { joint = 1 }", Effect::PayloadBacklash { joint: 1 }),
        (
            "tracker-settling = { time_constant_s = 600 }",
            Effect::TrackerSettling { time_constant: 600.0 },
        ),
        ("tracker-drift = {}", Effect::TrackerDrift),
        ("station-shift = { at_time_s = 60 }", Effect::StationShift { at_time: 60.0 }),
        ("station-move = { at_time_s = 60 }", Effect::StationMove { at_time: 60.0 }),
    ];
    let tables: Vec<_> = effects.iter().map(|(line, _)| format!("[[effect]]\n{line}\n")).collect();
    let text = format!(
        "name = 'arm'\nstatics.equilibrium = 'undeflected'\ndata.reference_temperature_C = 20\n[[joint]]\na_m = 1\n\
         beam.name = 'A'\nbeam.hoist.at_m = [0.5, 0, 0]\n[[joint]]\n[[joint]]\nkind = 'prismatic'\n{}",
        tables.concat()
    );
    let problem = parse(&text);
    let declared: Vec<_> =
        problem.effects.iter().map(|declaration| declaration.effect.clone()).collect();
    assert_eq!(declared, effects.map(|(_, effect)| effect));
    // Effects are written in the form in which they are read.
    let bare = parse(text.split("[[effect]]").next().unwrap());
    for effect in declared.iter().filter(|effect| effect.name() != "gravity-compensator") {
        assert_eq!(bare.effect(&effect.declaration(), Path::new("again")).unwrap().effect, *effect);
    }
    let alone = bare.with_effect(Effect::JointCompliance { joint: 1 });
    let compensator =
        declared.iter().find(|effect| effect.name() == "gravity-compensator").unwrap();
    assert_eq!(
        alone.effect(&compensator.declaration(), Path::new("again")).unwrap().effect,
        *compensator
    );
    let error = |problem: &Problem| {
        problem.effect(&compensator.declaration(), Path::new("again")).unwrap_err().to_string()
    };
    assert!(
        error(&bare).contains("joint 1 is rigid, so a compensator has no effect"),
        "{}",
        error(&bare)
    );
    let twice = alone.with_effect(compensator.clone());
    assert!(error(&twice).contains("has a compensator already"), "{}", error(&twice));
}

const MIXED: &str =
    "name = 'arm'\n[[joint]]\nkind = 'fixed'\n[[joint]]\n[[joint]]\nkind = 'prismatic'\n";

#[test]
fn fixed_joints_take_no_column() {
    let problem = parse(MIXED);
    let by_number = read_table(&problem, "q2_deg,q3_mm,x_m,y_m,z_m\n90,250,1,2,3\n");
    let by_order =
        read_table(&problem, "q1_rad,q2_m,x_mm,y_m,z_m\n1.5707963267948966,0.25,1000,2,3\n");
    for measurements in [by_number, by_order] {
        assert!(close(measurements.configuration(0)[1], FRAC_PI_2));
        assert_eq!(measurements.configuration(0)[2], 0.25);
        assert_eq!(measurements.configuration(0)[0], 0.0);
        assert_eq!(measurements.positions[0], Vector3::new(1.0, 2.0, 3.0));
    }
}

#[test]
fn columns_nobody_knows_are_passed_over_with_a_warning() {
    let problem = parse(MIXED);
    let table = "q1_deg,q2_deg,q3_mm,x_m,y_m,z_m,time,operator,payloud_kgs,yy_m\n1,2,3,4,5,6,noon,Ada,1,1\n";
    let (measurements, warnings) = try_table(&problem, table).unwrap();
    assert!(!measurements.time_measured);
    let warnings: Vec<_> = warnings.iter().map(ToString::to_string).collect();
    let words = [
        ["q1_deg", "joint 1"],
        ["operator", "unknown column; ignored"],
        ["payloud_kgs", "(did you mean payload_kg?); ignored"],
        // A suggested column that already exists is not meant.
        ["yy_m", "unknown column; ignored"],
        ["time", "time_s"],
    ];
    assert_eq!(warnings.len(), words.len());
    for (warning, words) in warnings.iter().zip(words) {
        assert!(
            warning.contains("rows.csv:1: column ")
                && words.iter().all(|word| warning.contains(word)),
            "{warning}"
        );
    }
}

#[test]
fn sessions_and_targets_are_words() {
    let problem = parse("name = 'arm'\n[[joint]]\n[data]\nheld_out = { session = 'D' }\n");
    let header = "session,target,pose,q1_deg,x_m,y_m,z_m,rx_deg,sigma_mm,hoist_N,temperature_C\n";
    let first = format!("{header}C, near ,1,0,1,2,3,10,0.1,60,20\nD,far,2,0,1,2,3,10,0.2,60,20\n");
    let second = format!("{header}C,far,,0,1,2,3,10,0.3,61,21\n");
    let measurements = read_tables(&problem, &[("1.csv", first), ("2.csv", second)]).unwrap().0;
    assert_eq!(
        (&*measurements.session.names, &*measurements.session.of_row),
        (&["C".into(), "D".into()][..], &[0, 1, 0][..])
    );
    let target = measurements.target.as_ref().unwrap();
    assert_eq!(
        (&*target.names, &*target.of_row),
        (&["near".into(), "far".into()][..], &[0, 1, 1][..])
    );
    assert_eq!(measurements.sigma.as_ref().unwrap()[1], 2e-4);
    assert_eq!((measurements.time[2], measurements.time_measured), (2.0, false));
    assert_eq!(
        Split::new(&problem, &measurements).unwrap(),
        Split { identification: vec![0, 2], held_out: vec![1] }
    );
}

#[test]
fn line_ends_marks_and_quotes_do_not_matter() {
    let problem = parse("name = 'arm'\n[[joint]]\n");
    let plain = "q1_deg,x_m,y_m,z_m,note\n\n1,2,3,4,a\n5,6,7,8,b\n";
    let variants = [
        plain.to_owned(),
        plain.replace('\n', "\r\n"),
        plain.replace('\n', "\r"),
        plain.trim_end().to_owned(),
        plain.replace('\n', "\r\n").trim_end().to_owned(),
        format!("\u{feff}{plain}"),
        format!("\u{feff}\u{feff}{plain}"),
        plain.replace("q1_deg,x_m", "\"q1_deg\" , x_m").replace("1,2", " 1 ,\"2\""),
    ];
    for variant in variants {
        let measurements = read_table(&problem, &variant);
        assert_eq!(measurements.origin, [(0, 3), (0, 4)], "{variant:?}");
        assert_eq!(measurements.positions[1].x, 6.0);
    }
    let broken = plain.replace(",a", ",\"a\n\nb\"");
    assert_eq!(read_table(&problem, &broken).origin, [(0, 3), (0, 6)]);
}

#[test]
fn a_fraction_keeps_rows_of_one_configuration_together() {
    let problem = |seed: u64| {
        parse(&format!(
            "name = 'arm'\n[[joint]]\n[data]\nheld_out = {{ fraction = 0.3, seed = {seed} }}\n"
        ))
    };
    // Four rows of each configuration, less than a hundredth of a degree apart.
    let angle = |row: i32| f64::from(row % 25) + 0.001 * f64::from(row / 25);
    let rows: Vec<_> = (0..100).map(|row| format!("{},0,0,0\n", angle(row))).collect();
    let table = format!("q1_deg,x_m,y_m,z_m\n{}", rows.concat());
    let measurements = read_table(&problem(1), &table);
    let split = Split::new(&problem(1), &measurements).unwrap();
    assert_eq!(split.held_out.len(), 32);
    assert_eq!(split.identification.len(), 68);
    assert!(split.held_out.is_sorted() && split.identification.is_sorted());
    assert!(split.held_out.iter().all(|row| split.held_out.contains(&((row + 25) % 100))));
    assert_eq!(split, Split::new(&problem(1), &measurements).unwrap());
    assert_ne!(split, Split::new(&problem(2), &measurements).unwrap());
}

#[test]
fn a_fraction_does_not_depend_on_the_order_of_rows() {
    let problem =
        parse("name = 'arm'\n[[joint]]\n[data]\nheld_out = { fraction = 0.3, seed = 1 }\n");
    for columns in ["", ",pose", ",time_s", ",session"] {
        let row = |k: i32| match columns {
            "" => format!("{},{k},0,0\n", k / 2),
            ",session" => format!("{},{k},0,0,{}\n", k / 2, ["A", "B"][usize::from(k > 50)]),
            _ => format!("{},{k},0,0,{}\n", k / 2, 100 - k),
        };
        let held_out = |order: &dyn Fn(i32) -> i32| {
            let rows: String = (0..101).map(|k| row(order(k))).collect();
            let measurements =
                read_table(&problem, &format!("q1_deg,x_m,y_m,z_m{columns}\n{rows}"));
            let rows = Split::new(&problem, &measurements).unwrap().held_out;
            let mut positions: Vec<f64> =
                rows.iter().map(|&row| measurements.positions[row].x).collect();
            positions.sort_by(f64::total_cmp);
            positions
        };
        let plain = held_out(&|k| k);
        assert!((31..=32).contains(&plain.len()), "{columns}: {plain:?}");
        assert_eq!(held_out(&|k| 100 - k), plain, "{columns}");
        assert_eq!(held_out(&|k| k * 37 % 101), plain, "{columns}");
    }
}

#[test]
fn a_column_split_is_used_where_nothing_is_said() {
    let problem = parse("name = 'arm'\n[[joint]]\n");
    let table = "q1_deg,x_m,y_m,z_m,split\n1,2,3,4,validation\n1,2,3,4,identification\n";
    let measurements = read_table(&problem, table);
    assert_eq!(Split::new(&problem, &measurements).unwrap().held_out, [0]);

    let problem = parse("name = 'arm'\n[[joint]]\n[data]\nheld_out = { column = 'use' }\n");
    let table = "q1_deg,x_m,y_m,z_m,split,use\n1,2,3,4,validation,identification\n1,2,3,4,identification,validation\n";
    let (measurements, warnings) = try_table(&problem, table).unwrap();
    assert!(warnings.is_empty());
    assert_eq!(Split::new(&problem, &measurements).unwrap().held_out, [1]);
}

#[test]
fn rows_of_one_configuration_stay_together_across_rounding() {
    let problem = parse(
        "name = 'arm'\n[[joint]]\na_m = 1\n[data]\nfiles = ['rows.csv']\nheld_out = { fraction = 0.5, seed = 3 }\n",
    );
    // Forty configurations, each twice, 0.002° apart on either side of a multiple of 0.005°.
    let mut text = "q1_deg,x_mm,y_mm,z_mm\n".to_owned();
    for k in 0..40 {
        let centre = f64::from(k) + 0.005;
        for q in [centre - 0.001, centre + 0.001] {
            text += &[q.to_string(), ",0,0,0\n".to_owned()].concat();
        }
    }
    let rows = read_table(&problem, &text);
    let split = Split::new(&problem, &rows).unwrap();
    assert_eq!(split.held_out.len(), 40);
    for pair in 0..40 {
        assert_eq!(
            split.held_out.contains(&(2 * pair)),
            split.held_out.contains(&(2 * pair + 1)),
            "pair {pair}"
        );
    }
}

#[test]
fn readings_stand_beside_commands_and_nests_apart() {
    let text = "name = 'arm'\n[[joint]]\n[[joint]]\na_m = 1\n";
    let table = "time_s,nest,q1_deg,q2_deg,q1_read_deg,q2_read_deg,x_mm,y_mm,z_mm\n0,floor,,,,,1,2,3\n60,,10,20,10.5,20.5,4,5,6\n\
                 120,,30,40,30.5,40.5,7,8,9\n180,floor,,,,,1.5,2,3\n";
    let commanded = parse(text);
    let rows = read_table(&commanded, table);
    assert_eq!((rows.len(), rows.nests.len()), (2, 2));
    assert!(close(rows.configuration(0)[0], 10_f64.to_radians()));
    let nest = &rows.nests[1];
    assert_eq!((nest.name.as_str(), nest.time, nest.after), ("floor", Some(180.0), 2));
    assert!(close(nest.position.x, 1.5e-3));
    let other = rows.with_other_joint_source().unwrap();
    assert!(close(other.configuration(1)[1], 40.5_f64.to_radians()));
    let readings = parse(&format!("{text}[data]\njoints = 'read'\n"));
    let read_rows = read_table(&readings, table);
    assert_eq!(read_rows.configurations, other.configurations);
    // Readings suffice without commands if they are the source, and not otherwise.
    let alone = "q1_read_rad,q2_read_deg,x_m,y_m,z_m\n0.1,2,3,4,5\n";
    assert!(read_table(&readings, alone).with_other_joint_source().is_none());
    assert_says(&table_error(&commanded, alone), &["column q1: missing; add q1_deg or q1_rad"]);
    assert_says(
        &table_error(&readings, "q1_deg,q2_deg,x_m,y_m,z_m\n1,2,3,4,5\n"),
        &["column q1_read: missing; add q1_read_deg or q1_read_rad"],
    );
    table_error(&commanded, "q1_deg,q2_deg,q1_read_mm,x_m,y_m,z_m\n1,2,3,4,5,6\n");
}

#[test]
fn a_last_row_with_too_few_cells_and_no_line_end_is_cut_off() {
    let problem = parse("name = 'arm'\n[[joint]]\na_m = 1\n");
    let header = "q1_deg,x_mm,y_mm,z_mm\n1,2,3,4\n";
    let error = table_error(&problem, &format!("{header}1,2"));
    assert_says(&error, &[":3:", "2 fields, the header 4", "cut off", "export it again"]);
    // With a line end, or above further rows, a cell is missing.
    for rows in ["1,2\n", "1,2\n1,2,3,4"] {
        let text = table_error(&problem, &format!("{header}{rows}")).to_string();
        assert!(text.contains(":3:") && !text.contains("cut off"), "{text}");
    }
}

#[test]
fn a_misspelt_unit_is_asked_for_where_its_column_is_missing() {
    let problem = parse("name = 'arm'\n[[joint]]\na_m = 1\n");
    let error = table_error(&problem, "q1_dge,x_mm,y_mm,z_mm\n1,2,3,4\n");
    assert_says(&error, &[":1: column q1", "add q1_deg or q1_rad", "is it column q1_dge?"]);
}

#[test]
fn a_table_cut_inside_its_last_number_is_warned_of() {
    let problem = parse("name = 'arm'\n[[joint]]\na_m = 1\n");
    let row = |k: i32| format!("{k},{}.25,{k}.5,-{}.125\n", k + 1, k + 2);
    let rows: String = (0..12).map(row).collect();
    let whole = format!("q1_deg,x_mm,y_mm,z_mm\n{rows}");
    let warnings_of = |text: &str| try_table(&problem, text).unwrap().1;
    let cut = &whole[..whole.len() - 2];
    let warnings = warnings_of(cut);
    let says = warnings[0].to_string();
    assert!(says.contains(":13: the file may end inside this row"), "{says}");
    assert_eq!(warnings.len(), 1);
    // No line end alone, a line end behind fewer digits, or few rows prove nothing.
    assert!(warnings_of(&whole[..whole.len() - 1]).is_empty());
    assert!(warnings_of(&format!("{cut}\n")).is_empty());
    let few: String = (0..5).map(row).collect();
    assert!(warnings_of(&format!("q1_deg,x_mm,y_mm,z_mm\n{few}5,1,2,3")).is_empty());
    // Numbers without final zeros: one digit less is chance.
    let varied = whole.replace("-5.125", "-5.0625");
    assert!(warnings_of(&varied[..varied.len() - 2]).is_empty());
    assert_eq!(warnings_of(&varied[..varied.len() - 3]).len(), 1);
}
