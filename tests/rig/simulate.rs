//! Simulated measurements: reproducible for a seed, valid as input, and located errors.

use std::path::Path;

use flexcal::measurement::Measurements;
use flexcal::problem::{PoseConditions, Problem};
use flexcal::rig::{Rig, Simulation, Truth, simulate};

use super::bench::ROOT;
use super::common::arms::parse;
use super::common::program::{Folder, assert_contains, items, number};
use super::common::reading::try_table;

fn cases() -> (Problem, Truth) {
    let folder = Path::new(ROOT).join("tests/cases");
    let problem = Problem::read(&folder).unwrap();
    let truth = Truth::read(&folder.join("truth.toml"), &problem).unwrap();
    (problem, truth)
}

fn read(simulation: &Simulation, problem: &Problem) -> Measurements {
    let (measurements, warnings) = try_table(problem, &simulation.csv()).unwrap();
    assert_eq!(warnings, []);
    measurements
}

#[test]
fn a_seed_gives_the_same_rows_on_any_number_of_threads() {
    let (problem, truth) = cases();
    let on = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| simulate(&problem, &truth, 40, seed).unwrap().csv())
    };
    assert_eq!(on(1, 7), on(4, 7));
    assert_ne!(on(1, 7), on(1, 8));
}

#[test]
fn more_poses_leave_the_first_ones_as_they_are() {
    let (problem, truth) = cases();
    let rows = |poses| simulate(&problem, &truth, poses, 3).unwrap().rows;
    let (few, many) = (rows(10), rows(30));
    for (few, many) in few.iter().zip(&many) {
        assert_eq!((&few.conditions, few.position), (&many.conditions, many.position));
    }
}

#[test]
fn what_is_written_is_what_was_measured() {
    let (problem, mut truth) = cases();
    truth.noise_sigma = 0.0;
    let simulation = simulate(&problem, &truth, 30, 5).unwrap();
    let measurements = read(&simulation, &problem);
    assert_eq!(measurements.len(), 30);
    assert_eq!(
        measurements.marked_held_out.as_ref().unwrap().iter().filter(|held_out| **held_out).count(),
        2
    );
    for (k, row) in simulation.rows.iter().enumerate() {
        let set = &row.conditions;
        assert_eq!(measurements.configuration(k), set.configuration);
        assert_eq!(measurements.payload.as_ref().unwrap()[k], set.payload.unwrap());
        assert_eq!(measurements.hoist.as_ref().unwrap()[k], set.hoist.unwrap());
        assert_eq!(measurements.temperature.as_ref().unwrap()[k], set.temperature.unwrap());
        assert_eq!(measurements.time[k], set.time);
        assert_eq!(
            &measurements.approach.as_ref().unwrap()[4 * k..4 * k + 4],
            set.approach.as_deref().unwrap()
        );
        assert!((measurements.positions[k] - row.position).norm() < 1e-9);
    }
}

#[test]
fn noise_has_its_spread_and_deviations_are_given_or_drawn() {
    let (problem, truth) = cases();
    let noisy = simulate(&problem, &truth, 1000, 1).unwrap();
    let exact = simulate(&problem, &Truth { noise_sigma: 0.0, ..truth.clone() }, 1000, 1).unwrap();
    let squares: f64 = noisy
        .rows
        .iter()
        .zip(&exact.rows)
        .map(|(a, b)| (a.position - b.position).norm_squared())
        .sum();
    let sigma = (squares / 3000.0).sqrt() * 1e3;
    assert!((sigma - 0.05).abs() < 0.003, "{sigma} mm");
    let of = |simulation: &Simulation, name: &str| {
        let found = simulation.parameters.iter().find(|parameter| parameter.name == name).unwrap();
        (found.nominal, found.value)
    };
    assert_eq!(of(&noisy, "joint3.a"), (1.95, 1.95 + 0.024));
    assert_eq!(of(&noisy, "tool.x"), (0.22, 0.22));
    let (nominal, value) = of(&noisy, "joint2.stiffness");
    assert!((value / nominal - 1.0).abs() > 1e-3 && value > 0.0);
}

#[test]
fn prismatic_and_fixed_joints_have_their_columns() {
    let problem = parse(
        "name = 'gantry'\n[[joint]]\nkind = 'prismatic'\n[[joint]]\nkind = 'fixed'\nalpha_deg = 90\n\
         [[joint]]\na_m = 0.5\n[tool]\ntarget_m = [0.3, 0, 0]\n",
    );
    let text = "[poses]\nq1_mm = [0, 400]\nq3_deg = [-30, 30]\nheld_out = 0\n[[effect]]\n\
                backlash = { joint = 1 }\nwidth_mm = 0.2\n";
    let truth = Truth::parse(text, Path::new("TRUTH.toml"), &problem).unwrap();
    let simulation = simulate(&problem, &truth, 5, 1).unwrap();
    let header = simulation.csv().lines().next().unwrap().to_owned();
    assert_eq!(header, "pose,split,q1_m,q3_deg,x_mm,y_mm,z_mm,time_s,approach1,approach3");
    assert_eq!(read(&simulation, &problem).len(), 5);
    let row = &simulation.rows[0];
    let (q, side) = (row.conditions.configuration[0], row.conditions.approach.as_ref().unwrap()[0]);
    let straight = PoseConditions {
        configuration: vec![0.0, 0.0, row.conditions.configuration[2]],
        ..PoseConditions::default()
    };
    let rest = Rig::new(problem, Vec::new()).position(&straight).unwrap();
    assert!((row.position.z - rest.z - q - 1e-4 * side).abs() < 1e-12);
}

/// Arguments of a simulation of the lunar sampler.
fn simulate_cases(truth: &str, poses: usize) -> String {
    format!("simulate {ROOT}/tests/cases --truth {truth} --poses {poses} --seed 1")
}

#[test]
fn the_command_writes_what_identify_reads() {
    let folder = Folder::new();
    let simulate = simulate_cases(&format!("{ROOT}/tests/cases/truth.toml"), 78);
    let run = folder.flexcal(&simulate).success();
    assert_contains(&run.stdout, &["78 poses: 28 to identify, 50 held out"]);
    let data = "out/lunar-sampler/measurements.csv";
    let first = folder.read(data);
    let told = folder.flexcal(&format!("{simulate} --json")).success().json();
    assert_eq!(first, folder.read(data));
    assert_eq!([&told["poses"], &told["held_out"]], [78, 50]);
    assert!(items(&told["effects"]).is_empty() && folder.has("out/lunar-sampler/truth.json"));
    let run = folder.flexcal(&format!("{simulate} --quiet --out b")).success();
    assert!(run.stdout.is_empty() && folder.has("b/measurements.csv"));

    let fit = folder.flexcal(&format!("identify {ROOT}/tests/cases --data {data} --json"));
    let rms = number(&fit.success().json()["held_out"]["rms_mm"]["norm"]);
    println!("held-out rms of the fitted simulation: {rms:.4} mm (noise alone 0.0866)");
    assert!(rms < 0.14, "{rms}");
}

#[test]
fn mistakes_leave_nothing_behind_and_name_their_place() {
    let folder = Folder::new();
    for (range, expected) in [("[1, 0]", "1 is above 0"), ("12.5", "write [12.5, 12.5]")] {
        folder.write("TRUTH.toml", format!("[poses]\nq1_deg = [0, 1]\nq2_deg = {range}\n"));
        let run = folder.flexcal(&simulate_cases("TRUTH.toml", 5)).code(2);
        assert_contains(&run.stderr, &["TRUTH.toml:3: poses.q2_deg: ", expected]);
    }
    assert!(!folder.has("out"));
}

#[test]
fn measurements_that_nothing_can_be_identified_from_say_so() {
    let folder = Folder::new();
    let poses = "[poses]\nq1_deg = [0, 9]\nq2_deg = [0, 9]\nq3_deg = [0, 9]\nq4_deg = [0, 9]\n";
    for (rule, expected, useful) in [
        ("identification = 5", "no row is held out", false),
        ("held_out = 0", "no row is held out", false),
        ("identification = 4", "", true),
    ] {
        folder.write("TRUTH.toml", format!("{poses}{rule}\n"));
        let run = folder.flexcal(&simulate_cases("TRUTH.toml", 5)).success();
        assert_eq!(run.stdout.contains("Next: flexcal identify"), useful, "{run:?}");
        assert!(run.stderr.is_empty() == useful && run.stderr.contains(expected), "{run:?}");
    }
}

#[test]
fn numbers_of_a_truth_that_mean_something_else_are_asked_about() {
    let folder = Folder::new();
    for (text, status, expected) in [
        ("[noise]\nposition_sigma_m = 0.05", 0, "if 0.05 mm are meant, write position_sigma_mm"),
        (
            "[noise]\nposition_sigma_mm = 0.05\n[parameters]\n'joint2.stiffness' = { relative = -0.2 }",
            2,
            "a multiple of the nominal value, such as 0.8 for one that is 20 % smaller",
        ),
    ] {
        let ranges =
            "[poses]\nq1_deg = [0, 9]\nq2_deg = [0, 9]\nq3_deg = [0, 9]\nq4_deg = [0, 9]\n";
        folder.write("TRUTH.toml", format!("{ranges}{text}\n"));
        let run = folder.flexcal(&simulate_cases("TRUTH.toml", 5)).code(status);
        assert_contains(&run.stderr, &[expected]);
    }
}

#[test]
fn ranges_go_by_the_names_of_joints_as_columns_do() {
    let arm = "name = 'a'\n[[joint]]\nname = 'waist'\n[[joint]]\nname = 'left arm'\nkind = 'prismatic'\n               [[joint]]\nname = 'twin'\n[[joint]]\nname = 'twin'\n[[joint]]\nname = 'hoist'\n";
    let problem = parse(arm);
    let read =
        |text: &str| Truth::parse(&format!("[poses]\n{text}"), Path::new("TRUTH.toml"), &problem);
    let others = "q3_deg = [0, 1]\nq4_deg = [0, 1]\nq5_deg = [0, 1]";
    let named =
        read(&format!("waist_deg = [-10, 20]\n\"left arm_mm\" = [5, 6]\n{others}")).unwrap();
    let numbered = read(&format!("q1_deg = [-10, 20]\nq2_m = [0.005, 0.006]\n{others}")).unwrap();
    assert_eq!(named.poses.joints, numbered.poses.joints);
    for (text, words) in [
        ("waist_deg = [0, 1]\nq1_rad = [0, 1]", "poses.waist_deg: given already as q1_rad"),
        ("waist = [0, 1]", "poses.waist: an angle needs a unit; write waist_deg or waist_rad"),
        ("waist_mm = [0, 1]", "poses.waist_mm: an angle is not given in mm"),
        ("wast_deg = [0, 1]", "poses.q1: missing; write q1_deg or q1_rad = [from, to]"),
        ("q1_deg = [0, 1]\nq2_m = [0, 1]\ntwin_deg = [0, 1]", "poses.q3: missing"),
        (
            "q1_deg = [0, 1]\nq2_m = [0, 1]\nq3_deg = [0, 1]\nq4_deg = [0, 1]\nhoist_deg = [0, 1]",
            "poses.q5: missing",
        ),
    ] {
        let error = read(text).expect_err(text).to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn every_mistake_says_where_it_is() {
    let (problem, _) = cases();
    let poses = "[poses]\nq1_deg = [0, 1]\nq2_deg = [0, 1]\nq3_deg = [0, 1]\nq4_deg = [0, 1]\n";
    let fails = |text: &str, words: &[&str]| {
        let error =
            Truth::parse(text, Path::new("TRUTH.toml"), &problem).expect_err(text).to_string();
        for word in ["TRUTH.toml"].iter().chain(words) {
            assert!(error.contains(word), "no `{word}` in: {error}");
        }
    };
    fails("", &["poses: missing"]);
    fails("[poses]\nq1_deg = [0, 1]", &["poses.q2: missing", "q2_deg or q2_rad"]);
    // The limits of the joints stand in for ranges that are missing.
    let limited = "min_deg = -30, max_deg = 40";
    let arm =
        format!("name = 'arm'\njoint = [{{ d_m = 0.3, {limited} }}, {{ a_m = 0.6, {limited} }}]\n");
    let limited = Problem::parse(&arm, Path::new("problem.toml")).unwrap();
    for (text, first) in [("", -30.0_f64), ("[poses]\nq1_deg = [0, 1]\n", 0.0)] {
        let noise = "[noise]\nposition_sigma_mm = 0.1\n";
        let truth =
            Truth::parse(&(noise.to_owned() + text), Path::new("TRUTH.toml"), &limited).unwrap();
        let [(from, _), (low, high)] = truth.poses.joints[..] else { panic!("two joints") };
        let degrees = [from, low, high].map(f64::to_degrees);
        for (found, expected) in degrees.into_iter().zip([first, -30.0, 40.0]) {
            assert!((found - expected).abs() < 1e-9, "{degrees:?}");
        }
    }
    fails("[poses]\nq1_deg = [0, 1, 2]", &[":2: poses.q1_deg: a range has two numbers", "found 3"]);
    fails("[poses]\nq1_m = [0, 1]", &["poses.q1_m: an angle is not given in m"]);
    fails("[poses]\nq1_deg = 3", &["poses.q1_deg: a range has two numbers", "write [3, 3]"]);
    fails("[poses]\nq1_deg = '3'", &["poses.q1_deg: expected a list"]);
    for (line, words) in [
        ("held_out = 1.5", &["poses.held_out: 1.5 is not between 0 and 1"][..]),
        (
            "held_out = 0.5\nidentification = 3",
            &["poses.identification: given already as held_out"],
        ),
        ("payload_kg = [-1]", &["poses.payload_kg[1]: -1 is below zero"]),
        ("payload_kg = []", &["poses.payload_kg: empty"]),
        ("time_step_s = [5, 2]", &["poses.time_step_s: "]),
        ("time_step_s = -5", &["poses.time_step_s: -5 is below zero"]),
        ("temperature = 5", &["temperature_C"]),
        ("speed = 5", &["poses.speed: unknown key"]),
        (
            "[parameters]\n\"joint9.a\" = { mm = 1 }",
            &["parameters.\"joint9.a\": no such parameter (did you mean joint1.a?)", "joint4.a"],
        ),
        ("[parameters]\ntool.x = { mm = 1 }", &["needs quotes"]),
        (
            "[parameters]\n\"tool.x\" = { deg = 1 }",
            &["parameters.\"tool.x\".deg: unknown key", "mm"],
        ),
        ("[parameters]\n\"tool.x\" = {}", &["missing", "m = … or mm = …"]),
        ("[parameters]\n\"tool.x\" = { m = 1, mm = 1 }", &["given already as m"]),
        ("[parameters]\n\"A.EI\" = { relative = 0 }", &["0 is not above zero"]),
        ("[random]\n\"joint9*\" = { sigma_mm = 1 }", &["matches no parameter"]),
        (
            "[random]\n\"tool.*\" = { sigma_deg = 1 }",
            &["random.\"tool.*\".sigma: missing", "sigma_mm"],
        ),
        ("[random]\n\"tool.*\" = { sigma_mm = -1 }", &["-1 is below zero"]),
        ("[noise]\nposition_sigma_mm = -1", &["noise.position_sigma_mm: -1 is below zero"]),
        ("[noise]", &["noise.position_sigma_mm: missing"]),
        ("[rig]\nsegments = 0", &["rig.segments: 0 is not a whole number"]),
        ("[[effect]]\nerror_relative = 1", &["effect[1]: an effect is one key", "found 0"]),
        (
            "[[effect]]\ngear-ration = { joint = 1 }",
            &["effect[1].gear-ration: unknown effect (did you mean gear-ratio?)"],
        ),
        ("[[effect]]\ngear-ratio = { joint = 1 }", &["no strength; write error_relative"]),
        (
            "[[effect]]\ngear-ratio = { joint = 1 }\nerror = 1",
            &["effect[1].error: a ratio needs a unit"],
        ),
        ("[[effect]]\ngear-ratio = { joint = 1 }\nwidth_deg = 1", &["unknown key"]),
        ("[[effect]]\ngear-ratio = { joint = 7 }\nerror_relative = 1", &["no joint 7"]),
        ("[[effect]]\ngear-ratio = { joint = 1 }\npayload-mass = {}", &["found 2"]),
        (
            "[[effect]]\ndeflected-equilibrium = {}\nlambda_relative = 0.5",
            &["always computes the equilibrium; write 1"],
        ),
        ("[[effect]]\noutside = { joint = 2 }\nheight_deg = 1", &["a width above 0"]),
        ("[[effect]]\noutside = { joint = 0 }\nheight_deg = 1", &["no joint 0"]),
        ("[[effect]]\noutside = { joint = 1, shape = \"x\" }\n", &["none of bump, step"]),
        (
            "[[effect]]\ngravity-compensator = { joint = 1, anchor_m = [0, 1], lever_m = [1, 0], free_length_m = 0 }\nrate_N_per_m = 1",
            &["effect[1].gravity-compensator: joint 1 is rigid"],
        ),
        (
            "[[effect]]\ngravity-compensator = { joint = 2, anchor_m = [0, 1], lever_m = [1, 0], free_length_m = 0 }\nrate_N = 1",
            &["effect[1].rate_N: "],
        ),
        (
            "[[effect]]\njoint-thermal-drift = { joint = 2 }\nrate_deg_per_C = 1",
            &["needs temperatures"],
        ),
    ] {
        fails(&format!("{poses}{line}\n"), words);
    }
}

#[test]
fn too_soft_an_arm_is_an_error_with_its_pose() {
    let problem = parse(
        "name = 'x'\n[[joint]]\nalpha_deg = 90\nstiffness_N_m_per_rad = 1\n[tool]\ntarget_m = [1, 0, 0]\n",
    );
    let text = "[poses]\nq1_deg = [80, 80]\npayload_kg = [1e5]\n";
    let truth = Truth::parse(text, Path::new("TRUTH.toml"), &problem).unwrap();
    let error = simulate(&problem, &truth, 3, 1).unwrap_err().to_string();
    assert!(error.contains("pose 1 of the simulation"), "{error}");
}
