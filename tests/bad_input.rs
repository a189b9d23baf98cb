//! Mistakes in the input: each message names file, line and key, and no input makes the reader panic.

#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test that fails may panic")]

use std::fs;
use std::path::{Path, PathBuf};

use flexcal::error::InputError;
use flexcal::measurement::{Measurements, Split};
use flexcal::problem::Problem;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

const CASES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cases");
const ARM: &str = "name = 'arm'\n[[joint]]\n";

fn problem(text: &str) -> Result<Problem, InputError> {
    Problem::parse(text, Path::new("problem.toml"))
}

/// Checks that a message is one line that holds every word.
fn check(error: &InputError, mistake: &str, words: &[&str]) {
    let message = error.to_string();
    assert!(!message.contains('\n'), "{mistake}: {message}");
    for word in words {
        assert!(message.contains(word), "{mistake}: no `{word}` in: {message}");
    }
}

/// Checks that each piece of text, put below the first joint, is a mistake whose message holds the words.
fn check_problems(mistakes: &[(&str, &[&str])]) {
    for (text, words) in mistakes {
        let error = problem(&format!("{ARM}{text}\n")).expect_err(text);
        check(&error, text, &["problem.toml:"]);
        check(&error, text, words);
    }
}

/// Reads one table from a file and divides its rows.
fn table(problem_text: &str, table: &[u8]) -> Result<Split, InputError> {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("rows.csv");
    fs::write(&file, table).unwrap();
    let problem = problem(problem_text)?;
    let (measurements, _) = Measurements::read(&[file], &problem)?;
    Split::new(&problem, &measurements)
}

#[test]
fn whole_problems() {
    let mistakes: [(&str, &[&str]); 13] = [
        ("", &["problem.toml:1: name: missing"]),
        ("name = ''", &[":1: name: empty"]),
        ("name = 'a/b'", &[":1: name: ", "cannot name a folder"]),
        ("name = '..'", &[":1: name: "]),
        ("name = 3", &[":1: name: expected text", "found a number"]),
        ("name = 'arm'", &["joint: ", "at least one joint"]),
        ("name = 'arm'\njoint = []", &["joint: ", "at least one joint"]),
        ("name = 'arm'\n[joint]\na_m = 1", &[":2: joint: ", "double brackets"]),
        ("name = 'arm'\nname = 'leg'", &[":2: not valid TOML: duplicate key, near `name`"]),
        ("name = 'arm'\n\n[[joint]", &[":3: not valid TOML"]),
        ("name = 'arm", &[":1: not valid TOML"]),
        ("name = 'arm'\nmass_kg = 3\n[[joint]]", &[":2: mass_kg: unknown key", "gravity_m_s2"]),
        ("name = 'arm'\ngravity = [0, 0, 1]\n[[joint]]", &[":2: gravity: ", "needs a unit", "gravity_m_s2"]),
    ];
    for (text, words) in mistakes {
        check(&problem(text).expect_err(text), text, words);
    }
}

#[test]
fn files_that_cannot_be_read() {
    let folder = TempDir::new().unwrap();
    let error = Problem::read(folder.path()).unwrap_err();
    check(&error, "no problem.toml", &["problem.toml: no such file"]);
    let file = folder.path().join("elsewhere.toml");
    check(&Problem::read(&file).unwrap_err(), "no file", &["elsewhere.toml: no such file"]);
    fs::write(&file, b"name = 'arm'\ntitle = '\xff'\n").unwrap();
    check(&Problem::read(&file).unwrap_err(), "binary", &["elsewhere.toml:2: not UTF-8"]);

    let read = |text: &str| {
        let problem = problem(text).unwrap();
        Measurements::read(&problem.data.files, &problem).unwrap_err()
    };
    let named = format!("{ARM}[data]\nfiles = ['nowhere.csv']");
    check(&read(&named), "missing data file", &["problem.toml:4: data.files: no such file: nowhere.csv"]);
    check(&read(&format!("{ARM}[data]")), "no files", &["problem.toml:3: data: no measurements"]);
    check(&read(ARM), "no data", &["problem.toml: data: no measurements"]);

    let problem = problem(ARM).unwrap();
    let other = PathBuf::from("other.csv");
    let error = Measurements::read(std::slice::from_ref(&other), &problem).unwrap_err();
    check(&error, "missing file", &["other.csv: no such file"]);
    let error = Measurements::read(&[folder.path().to_owned()], &problem).unwrap_err();
    check(&error, "a folder", &["cannot be read"]);
}

#[test]
fn joints_and_beams() {
    const BEAM: &str = "a_m = 1\n[joint.beam]\nname = 'A'\n";
    let beam = |text: &str| format!("{BEAM}{text}");
    let below: [(&str, &[&str]); 11] = [
        ("mass_kg = -1", &[":6: joint[1].beam.mass_kg: -1 is below zero"]),
        ("EA_N = 0", &[":6: joint[1].beam.EA_N: 0 is not above zero"]),
        ("EI_N_m2 = 1e4", &[":6: joint[1].beam.EI_N_m2: unknown key (did you mean EIy_N_m2?); known here: "]),
        ("EA = 1", &[":6: joint[1].beam.EA: ", "EA_N"]),
        ("mass = 1", &[":6: joint[1].beam.mass: a mass needs a unit; write mass_kg"]),
        ("[[joint.beam.mass]]\nmass_kg = 1", &[":6: joint[1].beam.mass[1].at: missing", "at_m or at_mm"]),
        ("[[joint.beam.mass]]\nat_m = [0, 0, 0]", &[":6: joint[1].beam.mass[1].mass_kg: missing"]),
        ("[joint.beam.hoist]\nforce_N = 1", &[":6: joint[1].beam.hoist.at: missing"]),
        ("hoist = { at_m = [0, 0, 0], direction = [0, 0, 0] }", &[":6: joint[1].beam.hoist.direction: "]),
        ("hoist = { at_m = [0, 0, 0], rope = 3 }", &[":6: joint[1].beam.hoist.rope: unknown key; known here: "]),
        ("[[joint]]\na_m = 1\nbeam.name = 'A'", &[":8: joint[2].beam.name: ", "another beam"]),
    ];
    for (text, words) in below {
        check_problems(&[(&beam(text), words)]);
    }
    check_problems(&[
        ("alpha = 90", &["problem.toml:3: joint[1].alpha: an angle needs a unit; write alpha_deg or alpha_rad"]),
        ("d = 1", &[":3: joint[1].d: a length needs a unit; write d_m or d_mm"]),
        ("a_deg = 1", &[":3: joint[1].a_deg: a length is not given in deg"]),
        ("a_m = 1\n\na_mm = 1000", &[":5: joint[1].a_mm: given already as a_m"]),
        ("a_m = nan", &[":3: joint[1].a_m: nan is not a finite number"]),
        ("a_m = -inf", &[":3: joint[1].a_m: -inf is not a finite number"]),
        ("a_m = 1e999", &[":3: joint[1].a_m: 1e999 is not a finite number"]),
        ("a_m = '1'", &[":3: joint[1].a_m: expected a number, found text"]),
        ("stiffness_N_m_per_rad = 0", &[":3: joint[1].stiffness_N_m_per_rad: 0 is not above zero"]),
        ("kind = 'spherical'", &[":3: joint[1].kind: \"spherical\" is none of revolute, prismatic, fixed"]),
        ("length_m = 1", &[":3: joint[1].length_m: unknown key"]),
        ("beam.name = 'A'", &[":3: joint[1].beam: ", "a_m or a_mm"]),
        ("a_m = 1\nbeam.mass_kg = 1", &[":4: joint[1].beam.name: missing"]),
        ("a_m = 1\nbeam.name = 'A.B'", &[":4: joint[1].beam.name: ", "cannot name a beam"]),
        ("a_m = 1\nbeam.name = 'tool'", &[":4: joint[1].beam.name: ", "other parameters"]),
        ("a_m = 1\nbeam.name = 'joint2'", &[":4: joint[1].beam.name: ", "other parameters"]),
        ("[[joint.body]]\nmass_kg = -0.5", &[":4: joint[1].body[1].mass_kg: -0.5 is below zero"]),
        ("[[joint.body]]\nmass_kg = 1\nat_m = [0, 0, 0]", &[":5: joint[1].body[1].at_m: unknown key", "com_m"]),
        ("[[joint]]\n[[joint.body]]", &[":4: joint[2].body[1].mass_kg: missing"]),
    ]);
}

#[test]
fn other_sections() {
    check_problems(&[
        ("[statics]\nequilibrium = 'bent'", &[":4: statics.equilibrium: \"bent\" is none of deflected, undeflected"]),
        ("[statics]\nbeam_elements = 0", &[":4: statics.beam_elements: 0 is not a whole number"]),
        ("[statics]\nbeam_elements = 1.5", &[":4: statics.beam_elements: 1.5 is not a whole number"]),
        ("[statics]\nbeam_elements = 1_000_000", &[":4: statics.beam_elements: 1000000 is too large"]),
        ("[statics]\nelements = 1", &[":4: statics.elements: unknown key (did you mean beam_elements?)"]),
        ("[tool]\ntarget_m = [1, 2]", &[":4: tool.target_m: a vector has 3 numbers, found 2"]),
        ("[tool]\ntarget_m = [\n1,\n2,\nnan]", &[":7: tool.target_m[3]: nan"]),
        ("[tool]\ntarget = [1, 2, 3]", &[":4: tool.target: a length needs a unit"]),
        ("[tool]\npayload_kg = -1", &[":4: tool.payload_kg: -1 is below zero"]),
        ("[tool]\npayload_g = 1", &[":4: tool.payload_g: unknown key"]),
        ("[base]\nrotation_m = [0, 0, 0]", &[":4: base.rotation_m: an angle is not given in m"]),
        ("[base]\nyaw_deg = 1", &[":4: base.yaw_deg: unknown key"]),
        ("[data]\nposition_sigma_mm = 0", &[":4: data.position_sigma_mm: 0 is not above zero"]),
        ("[data]\nposition_sigma_deg = 1", &[":4: data.position_sigma_deg: a length is not given in deg"]),
        ("[data]\nposition_sigma = 1", &[":4: data.position_sigma: a length needs a unit"]),
        ("[data]\nreference_temperature = 1", &[":4: data.reference_temperature: a temperature needs a unit"]),
        ("[data]\nfiles = 'a.csv'", &[":4: data.files: expected a list"]),
        ("[data]\nfiles = [1]", &[":4: data.files[1]: expected text"]),
        ("[data]\nfile = 'a.csv'", &[":4: data.file: unknown key (did you mean files?)"]),
        ("[data]\nheld_out = {}", &[":4: data.held_out: give one of"]),
        ("[data]\nheld_out = { seed = 1 }", &[":4: data.held_out: give one of"]),
        ("[data]\nheld_out = { column = 'a', session = 'b' }", &[":4: data.held_out: give one of"]),
        ("[data]\nheld_out = { fraction = 1 }", &[":4: data.held_out.fraction: 1 is not between 0 and 1"]),
        ("[data]\nheld_out = { fraction = 0.3, seed = -1 }", &[":4: data.held_out.seed: -1 is not a whole number"]),
        ("[data]\nheld_out = { rows = 3 }", &[":4: data.held_out.rows: unknown key"]),
        ("[data]\nheld_out = 'split'", &[":4: data.held_out: expected a table, found text"]),
    ]);
}

#[test]
fn rules_of_parameters() {
    let rules: [(&str, &[&str]); 14] = [
        ("'tool.x' = {}", &[":4: parameters.\"tool.x\": says nothing"]),
        ("'tool.x' = true", &[":4: parameters.\"tool.x\": expected a table"]),
        ("tool.x = { free = true }", &[":4: parameters.tool: ", "in quotes: \"tool.x\""]),
        ("a = { sigma = 1 }", &[":4: parameters.a.sigma: ", "needs a unit", "sigma_mm"]),
        ("a = { sigma_mm = 0 }", &[":4: parameters.a.sigma_mm: 0 is not above zero"]),
        ("a = { sigma_kg = 1 }", &[":4: parameters.a.sigma_kg: unknown key", "sigma_relative"]),
        ("a = { sigma_mm = 1, sigma_m = 1 }", &[":4: parameters.a.sigma_m", "given already as sigma_m"]),
        ("a = { sigma_mm = 'x' }", &[":4: parameters.a.sigma_mm: expected a number"]),
        ("a = { min_mm = 2, max_mm = 1 }", &[":4: parameters.a.min_mm: min 0.002 is above max 0.001"]),
        ("a = { min_relative = 0 }", &[":4: parameters.a.min_relative: 0 is not above zero"]),
        ("a = { sigma_mm = 1, fixed = true }", &[":4: parameters.a: ", "leave out sigma_mm"]),
        ("a = { free = false, fixed = false }", &[":4: parameters.a: ", "leave out fixed"]),
        ("a = { free = 1 }", &[":4: parameters.a.free: expected true or false"]),
        ("a = { free = true }\na = { free = true }", &[":5: not valid TOML: duplicate key"]),
    ];
    for (rule, words) in rules {
        check_problems(&[(&format!("[parameters]\n{rule}"), words)]);
    }
}

#[test]
fn robust_loss() {
    check_problems(&[
        ("[robust]", &[":3: robust.loss: missing", "huber"]),
        ("[robust]\nloss = 'cauchy'", &[":4: robust.loss: ", "\"cauchy\" is none of huber, l1"]),
        ("[robust]\nloss = 'l1'\nthreshold_sigma = 0", &[":5: robust.threshold_sigma: 0 is not above zero"]),
        ("[robust]\nloss = 'l1'\nthreshold = 1", &[":5: robust.threshold: unknown key", "threshold_sigma"]),
        ("robust = 'l1'", &[":3: ", "robust"]),
    ]);
}

#[test]
fn constraints() {
    let constraints: [(&str, &[&str]); 11] = [
        ("", &[":3: constraint[1].terms: missing"]),
        ("terms = {}", &[":4: constraint[1].terms: no terms"]),
        ("terms = 1", &[":4: constraint[1].terms: expected a table"]),
        ("terms = { A.EI = 1 }", &[":4: constraint[1].terms.A: ", "in quotes: \"A.EI\""]),
        ("terms = { a = 0 }\nat_least = 0", &[":4: constraint[1].terms.a: a coefficient of 0"]),
        ("terms = { a = 'x' }", &[":4: constraint[1].terms.a: expected a number"]),
        ("terms = { a = 1 }", &[":3: constraint[1]: no limit; write at_least or at_most"]),
        ("terms = { a = 1 }\nat_least = nan", &[":5: constraint[1].at_least: nan is not a finite number"]),
        (
            "terms = { a = 1 }\nat_least = 2\nat_most = 1",
            &[":5: constraint[1].at_least: at_least 2 is above at_most 1"],
        ),
        ("terms = { a = 1 }\nat_least = 2\nat_least_mm = 1", &[":6: constraint[1].at_least_mm: given already"]),
        ("terms = { a = 1 }\nat_least = 2\nabove = 1", &[":6: constraint[1].above: unknown key", "at_most"]),
    ];
    for (constraint, words) in constraints {
        check_problems(&[(&format!("[[constraint]]\n{constraint}"), words)]);
    }
}

#[test]
fn effects() {
    let effects: [(&str, &[&str]); 27] = [
        ("", &[":3: effect[1]: an effect is one key", "found 0"]),
        ("payload-mass = {}\nhoist-force = {}", &[":3: effect[1]: an effect is one key", "found 2"]),
        ("wobble = {}", &[":4: effect[1].wobble: unknown effect; known: ", "backlash"]),
        ("gear_ratios = {}", &[":4: effect[1].gear_ratios: unknown effect (did you mean gear-ratio?)"]),
        ("payload-mass = { joint = 1 }", &[":4: effect[1].payload-mass.joint: unknown key"]),
        ("payload-mass = false", &[":4: effect[1].payload-mass: expected a table"]),
        ("backlash = {}", &[":4: effect[1].backlash.joint: missing"]),
        ("backlash = true", &[":4: effect[1].backlash.joint: missing"]),
        ("backlash = { joint = 2 }", &[":4: effect[1].backlash.joint: no joint 2; the arm has 1"]),
        ("backlash = { joint = 0 }", &[":4: effect[1].backlash.joint: no joint 0"]),
        ("unmodelled-mass = { link = 'A' }", &[":4: effect[1].unmodelled-mass.link: no beam is called \"A\""]),
        ("joint-harmonic = { joint = 1, orders = [] }", &[":4: effect[1].joint-harmonic.orders: no order"]),
        ("joint-harmonic = { joint = 1, orders = [0] }", &[":4: effect[1].joint-harmonic.orders[1]: 0 is not"]),
        ("joint-harmonic = { joint = 1, orders = [1, 1] }", &[":4: effect[1].joint-harmonic.orders[2]: order 1"]),
        (
            "joint-harmonic = { joint = 1, order = 1 }",
            &["orders: missing; write orders = [1], the harmonics (is it order?)"],
        ),
        ("joint-coupling = { joint = 1, from = 1 }", &[":4: effect[1].joint-coupling: ", "gear-ratio"]),
        ("station-shift = { at_time = 3 }", &[":4: effect[1].station-shift.at_time: a time needs a unit"]),
        ("link-bending = { joint = 1 }", &[":4: effect[1].link-bending: joint 1 has no link", "its a is 0"]),
        ("deflected-equilibrium = {}", &[":4: effect[1].deflected-equilibrium: ", "already", "[statics]"]),
        ("hoist-direction = {}", &[":4: effect[1].hoist-direction: no beam has a hoist"]),
        ("joint-thermal-drift = { joint = 1 }", &[":4: effect[1].joint-thermal-drift: ", "reference_temperature_C"]),
        (
            "joint-harmonic = { joint = 1, orders = [1, 2] }\n[[effect]]\njoint-harmonic = { joint = 1, orders = [3, 2] }",
            &[":6: effect[2].joint-harmonic: order 2 of this joint is declared already on line 4"],
        ),
        (
            "gear-ratio = { joint = 2 }\n[[joint]]\nkind = 'fixed'",
            &[":4: effect[1].gear-ratio.joint: joint 2 is fixed"],
        ),
        ("backlash = { joint = 2 }\n[[joint]]\nkind = 'fixed'", &[":4: effect[1].backlash.joint: joint 2 is fixed"]),
        (
            "joint-coupling = { joint = 1, from = 2 }\n[[joint]]\nkind = 'fixed'",
            &[":4: effect[1].joint-coupling.from: joint 2 is fixed"],
        ),
        (
            "joint-harmonic = { joint = 2, orders = [1] }\n[[joint]]\nkind = 'fixed'",
            &[":4: effect[1].joint-harmonic.joint: joint 2 is fixed"],
        ),
        ("hoist-force = {}\n[[effect]]\nhoist-force = {}", &[":6: effect[2].hoist-force: declared already on line 4"]),
    ];
    for (effect, words) in effects {
        check_problems(&[(&format!("[[effect]]\n{effect}"), words)]);
    }
}

#[test]
fn headers() {
    let headers: [(&str, &[&str]); 17] = [
        ("", &["rows.csv:1: the file is empty"]),
        ("\n\n", &["rows.csv:1: the file is empty"]),
        ("q1_deg,x_m,y_m,z_m\n", &["rows.csv:1: no rows below the header"]),
        ("x_m,y_m,z_m\n1,2,3\n", &["rows.csv:1: column q1: missing; add q1_deg or q1_rad"]),
        ("q1_deg,x_m,z_m\n1,2,3\n", &["rows.csv:1: column y: missing; add y_m or y_mm"]),
        ("q1_deg,X_mm,y_m,z_m\n", &["rows.csv:1: column x: missing; add x_m or x_mm (is it column X_mm?)"]),
        ("q1deg,x_m,y_m,z_m\n", &["rows.csv:1: column q1: missing; add q1_deg or q1_rad (is it column q1deg?)"]),
        ("q1,x_m,y_m,z_m\n", &["rows.csv:1: column q1: an angle needs a unit; write q1_deg or q1_rad"]),
        ("q1_mm,x_m,y_m,z_m\n", &["rows.csv:1: column q1_mm: an angle is not given in mm"]),
        ("\nq1_deg,x,y_m,z_m\n", &["rows.csv:2: column x: a length needs a unit"]),
        ("q1_deg,x_m,x_mm,y_m,z_m\n", &["rows.csv:1: column x_mm: given already as column x_m"]),
        ("q1_deg,x_m,y_m,z_m,y_m\n", &["rows.csv:1: column y_m: given already"]),
        ("q1_deg,x_m,y_m,z_m,note,note\n", &["rows.csv:1: column note: given already"]),
        ("q1_deg;x_m;y_m;z_m\n", &["rows.csv:1: columns are set apart by commas, not by ';'"]),
        ("q1_deg,x_m,y_m,z_m,sigma\n", &["rows.csv:1: column sigma: a length needs a unit"]),
        ("q1_deg,x_m,y_m,z_m,sigma_deg\n", &["rows.csv:1: column sigma_deg: a length is not given in deg"]),
        ("q1_deg,x_m,y_m,z_m,rx_mm\n", &["rows.csv:1: column rx_mm: an angle is not given in mm"]),
    ];
    for (text, words) in headers {
        check(&table(ARM, text.as_bytes()).expect_err(text), text, words);
    }
    check(&table(ARM, b"q1_deg,\xff\xfe\n").unwrap_err(), "binary header", &["rows.csv:1: ", "not UTF-8"]);
}

#[test]
fn rows() {
    let rows: [(&str, &[&str]); 20] = [
        ("abc,1,2,3,", &["rows.csv:3: column q1_deg: \"abc\" is not a number"]),
        ("1,\"1,5\",2,3,", &["rows.csv:3: column x_mm: \"1,5\" is not a number"]),
        ("1,NaN,2,3,", &["rows.csv:3: column x_mm: NaN is not a finite number"]),
        ("1,1,inf,3,", &["rows.csv:3: column y_mm: inf is not a finite number"]),
        ("1,1,2,-1e999,", &["rows.csv:3: column z_mm: -1e999 is not a finite number"]),
        ("1,,2,3,", &["rows.csv:3: column x_mm: the cell is empty"]),
        ("1,2,3", &["rows.csv:3: the row has 3 fields, the header 5"]),
        ("1,2,3,4,5,6", &["rows.csv:3: the row has 6 fields, the header 5"]),
        ("1,2,3,\"4,5", &["rows.csv:3: a quote is opened and never closed"]),
        ("\0\0\0", &["rows.csv:3: the row has 1 fields"]),
        ("\0,1,2,3,", &["rows.csv:3: column q1_deg: \"\\u{0}\" is not a number"]),
        ("1,1,2,3,train|split", &["rows.csv:3: column split: \"train\" is neither identification nor validation"]),
        ("1,1,2,3,|split", &["rows.csv:3: column split: the cell is empty"]),
        ("1,1,2,3,|session", &["rows.csv:3: column session: the cell is empty"]),
        ("1,1,2,3,|target", &["rows.csv:3: column target: the cell is empty"]),
        ("1,1,2,3,-1|payload_kg", &["rows.csv:3: column payload_kg: -1 is below zero"]),
        ("1,1,2,3,0|sigma_mm", &["rows.csv:3: column sigma_mm: 0 is not above zero"]),
        ("1,1,2,3,0.5|approach1", &["rows.csv:3: column approach1: 0.5 is not a direction"]),
        ("1,1,2,3,x|rx_deg", &["rows.csv:3: column rx_deg: \"x\" is not a number"]),
        ("1,1,2,3,noon|time_s", &["rows.csv:3: column time_s: \"noon\" is not a number"]),
    ];
    let valid = |column: &str| match column {
        "split" => "validation",
        _ => "1",
    };
    for (row, words) in rows {
        let (row, column) = row.split_once('|').unwrap_or((row, "note"));
        let text = format!("q1_deg,x_mm,y_mm,z_mm,{column}\n1,1,2,3,{}\n{row}\n", valid(column));
        check(&table(ARM, text.as_bytes()).expect_err(row), row, words);
    }
    let binary = b"q1_deg,x_mm,y_mm,z_mm,note\r\n1,1,2,3,\r\n1,1,2,\xc3\x28,\r\n";
    check(&table(ARM, binary).unwrap_err(), "binary row", &["rows.csv:3: column z_mm: not UTF-8"]);
    let binary = b"q1_deg,x_mm,y_mm,z_mm,note\r\n1,1,2,3,\xff\r\n";
    check(&table(ARM, binary).unwrap_err(), "binary note", &["rows.csv:2: column note: not UTF-8"]);
}

#[test]
fn files_that_differ() {
    let folder = TempDir::new().unwrap();
    let files = ["1.csv", "2.csv"].map(|name| folder.path().join(name));
    let problem = problem(ARM).unwrap();
    let read = |first: &str, second: &str| {
        fs::write(
            &files[0],
            format!("q1_deg,x_m,y_m,z_m{first}\n0,0,0,0{}\n", if first.is_empty() { "" } else { ",1" }),
        )
        .unwrap();
        fs::write(
            &files[1],
            format!("q1_rad,z_m,y_m,x_m{second}\n0,0,0,0{}\n", if second.is_empty() { "" } else { ",1" }),
        )
        .unwrap();
        Measurements::read(&files, &problem)
    };
    check(&read("", ",session").unwrap_err(), "more", &["2.csv:1: column session: ", "1.csv does not have it"]);
    check(&read(",hoist_N", "").unwrap_err(), "fewer", &["2.csv:1: column hoist_N: ", "1.csv has it"]);
    assert!(read("", "").is_ok() && read(",pose", "").is_ok() && read(",note", "").is_ok());
    let twice = [files[0].clone(), files[0].clone()];
    check(&Measurements::read(&twice, &problem).unwrap_err(), "twice", &["1.csv: named twice"]);
}

#[test]
fn splits() {
    let held_out = |text: &str| format!("{ARM}[data]\nheld_out = {{ {text} }}\n");
    let rows = |column: &str, words: [&str; 2]| {
        format!("q1_deg,x_m,y_m,z_m,{column}\n1,2,3,4,{}\n1,2,3,4,{}\n", words[0], words[1])
    };
    let column = held_out("column = 'split'");
    let session = held_out("session = 'D'");
    let place = "problem.toml:4: data.held_out: ";
    let cases: [(&str, String, &[&str]); 9] = [
        (&column, rows("note", ["", ""]), &["rows.csv:1: column split: missing", "problem.toml:4: data.held_out"]),
        (&column, rows("split", ["validation"; 2]), &[place, "no rows are left to fit", "column split", "validation"]),
        (&column, rows("split", ["identification"; 2]), &[place, "no rows are held out", "column split"]),
        (&session, rows("session", ["A", "B"]), &[place, "no session is called \"D\"; there is A, B"]),
        (&session, rows("note", ["A", "B"]), &[place, "no column session"]),
        (&session, rows("session", ["D", "D"]), &[place, "no rows are left to fit", "session \"D\""]),
        (&held_out("fraction = 0.5"), rows("note", ["", ""]), &[place, "2 rows have 1 joint configurations"]),
        (ARM, rows("note", ["", ""]), &["problem.toml: data: no row is said to be held out"]),
        (ARM, rows("split", ["validation"; 2]), &["problem.toml: data: no rows are left to fit"]),
    ];
    for (problem, rows, words) in cases {
        check(&table(problem, rows.as_bytes()).expect_err(&rows), &rows, words);
    }
}

/// Changes a few bytes, cuts the end off, or doubles a piece.
fn mutate(text: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    const PIECES: [&[u8]; 16] = [
        b"\0",
        b"\xff",
        b"\"",
        b"'",
        b",",
        b"\n",
        b"\r\n",
        b"[",
        b"]",
        b"{",
        b"=",
        b"nan",
        b"-",
        b"1e999",
        b"#",
        b"\xef\xbb\xbf",
    ];
    let mut text = text.to_vec();
    for _ in 0..random.random_range(1..4) {
        let place = random.random_range(0..=text.len());
        match random.random_range(0..4) {
            0 => text.truncate(place),
            1 => {
                let piece = PIECES[random.random_range(0..PIECES.len())];
                text.splice(place..place, piece.iter().copied());
            }
            2 => {
                let end = (place + random.random_range(0..40)).min(text.len());
                text.drain(place..end);
            }
            _ => {
                let end = (place + random.random_range(0..40)).min(text.len());
                let piece = text[place..end].to_vec();
                text.splice(place..place, piece);
            }
        }
    }
    text
}

#[test]
fn no_input_makes_the_reader_panic() {
    let folder = TempDir::new().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(20);
    let valid = Problem::read(Path::new(CASES)).unwrap();
    let rows = fs::read(Path::new(CASES).join("a-none.csv")).unwrap();
    let file = folder.path().join("rows.csv");
    for _ in 0..1500 {
        fs::write(&file, mutate(&rows, &mut random)).unwrap();
        match Measurements::read(std::slice::from_ref(&file), &valid) {
            Ok((measurements, _)) => _ = Split::new(&valid, &measurements),
            Err(error) => check(&error, "mutated rows", &["rows.csv"]),
        }
    }
    let texts = ["problem.toml", "every-key.toml"].map(|name| fs::read(Path::new(CASES).join(name)).unwrap());
    let file = folder.path().join("problem.toml");
    for round in 0..3000 {
        fs::write(&file, mutate(&texts[round % 2], &mut random)).unwrap();
        if let Err(error) = Problem::read(&file) {
            check(&error, "mutated problem", &["problem.toml:"]);
        }
    }
}
