//! Messages of the command line on implausible data, and estimates that stay near the arm where
//! possible.

use std::fmt::Write as _;
use std::fs;

use flexcal::measurement::Dataset;
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use crate::common::arms::{parse, path};
use crate::common::made::{at_random, csv, divided, draw, labels, measure, model_of};
use crate::common::program::Folder;
use crate::{judged, runaway, sigma};

/// Free lengths, which absorb a wrong unit.
const LENGTHS: &str =
    "'joint*.a' = { free = true }\n'joint*.d' = { free = true }\n'tool.*' = { free = true }";

/// Output of a command.
struct Told {
    status: i32,
    /// Warnings and report.
    text: String,
    /// Content of estimate.json or loop.json.
    json: Value,
}

impl Told {
    /// Runs a command on a problem, whose last section is `[data]`, and a table.
    fn by(command: &str, problem: &str, table: &str) -> Self {
        let data = "files = ['rows.csv']\nheld_out = { column = 'split' }\n";
        let problem = format!("{problem}{data}");
        let folder = Folder::with([("problem.toml", &problem), ("rows.csv", table)]);
        let run = folder.flexcal(&format!("{command} . --out out"));
        let read =
            |name: &str| fs::read_to_string(folder.path("out").join(name)).unwrap_or_default();
        let json = read(if command == "loop" { "loop.json" } else { "estimate.json" });
        Self {
            status: run.status,
            text: run.stderr + &read("report.md"),
            json: serde_json::from_str(&json).unwrap_or_default(),
        }
    }

    /// Returns name, estimate, nominal value and standard error of each parameter.
    fn parameters(&self) -> impl Iterator<Item = (&str, f64, f64, Option<f64>)> {
        let number = |row: &Value, key: &str| row[key].as_f64();
        self.json["parameters"].as_array().into_iter().flatten().map(move |row| {
            let value = |key| number(row, key).unwrap();
            (
                row["name"].as_str().unwrap(),
                value("estimate"),
                value("nominal"),
                number(row, "std_error"),
            )
        })
    }

    /// Returns the parameters of the arm that moved by more than 0.1 m or rad.
    fn far(&self) -> Vec<String> {
        self.parameters()
            .filter(|(name, estimate, nominal, _)| {
                !name.starts_with("base") && (estimate - nominal).abs() > 0.1
            })
            .map(|(name, estimate, nominal, _)| format!("{name} {nominal} → {estimate}"))
            .collect()
    }

    fn held_out_mm(&self) -> f64 {
        self.json["held_out"]["rms_mm"]["norm"].as_f64().unwrap()
    }
}

/// Case: description, problem, data, exit status, and required message.
type Case = (&'static str, String, Dataset, i32, &'static str);

/// Returns sixty poses of the arm of [`judged`] and thirty held-out ones, with errors added.
fn spoiled(
    name: &'static str,
    parameters: &str,
    status: i32,
    said: &'static str,
    spoil: impl Fn(&mut Dataset),
) -> Case {
    let text = judged::text(parameters);
    let mut data = judged::measured(&parse(&text), 1);
    spoil(&mut data);
    (name, text, data, status, said)
}

fn positions(data: &mut Dataset) -> &mut Vec<Vector3<f64>> {
    &mut data.measurements.positions
}

/// Assigns rows to another session, with another tool if they are held out.
fn session(rows: &'static [usize]) -> impl Fn(&mut Dataset) {
    move |data| {
        let word = |row| if rows.contains(&row) { "B" } else { "A" };
        data.measurements.session = labels((0..90).map(word));
        data.measurements.target = Some(labels((0..90).map(|_| "t")));
    }
}

/// Replaces the first held-out rows by identification rows.
fn copied(count: usize) -> impl Fn(&mut Dataset) {
    move |data| {
        let rows: Vec<usize> = (0..60).chain(0..count).chain(60 + count..90).collect();
        data.measurements = data.measurements.select(&rows);
    }
}

/// Returns seven poses of three targets, seven of them held out.
fn three_targets() -> Case {
    let text = judged::text(&format!("{}\n'base.*' = {{ free = true }}", judged::PRIORS));
    let problem = parse(&text);
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let poses = at_random(&problem, 14, 2.0, &mut rng);
    let configurations: Vec<Vec<f64>> =
        (0..42).map(|row| poses.configuration(row / 3).to_vec()).collect();
    let mut rows =
        Dataset::builder(configurations, vec![Vector3::zeros(); 42]).measurements().unwrap();
    rows.target = Some(labels((0..42).map(|row| ["left", "right", "top"][row % 3])));
    let truth = draw(&model_of(&problem, &rows), |_| 1e-3, &mut rng);
    measure(&problem, &mut rows, &truth, judged::SIGMA, &mut rng);
    ("points of one pose", text, divided(21, &rows), 0, "7 different poses")
}

fn spoiled_ones() -> Vec<Case> {
    let (priors, free) = (judged::PRIORS, judged::FREE);
    let based = &format!("{priors}\n'base.*' = {{ free = true }}");
    let scaled = |factor: f64| {
        move |data: &mut Dataset| {
            for position in positions(data).iter_mut() {
                *position *= factor;
            }
        }
    };
    let off = |by: f64| move |data: &mut Dataset| positions(data)[77].y += by;
    let gross =
        |data: &mut Dataset| [3, 20, 41].into_iter().for_each(|row| positions(data)[row].x += 2.0);
    let (worse, held_out) = judged::worse_than_none();
    let mut robust =
        spoiled("gross errors that a loss sets aside", priors, 0, "rows.csv:22", gross);
    robust.1 = robust.1.replacen("[parameters]", "[robust]\nloss = 'huber'\n[parameters]", 1);
    // Rz(θ) Tz(d) Tx(a) Rx(α): a and α of a joint belong to the next one.
    let standard = |mut case: Case| {
        let swapped = "[[joint]]\nd_m = 0.4\nalpha_deg = 90\na_m = 0.15\n[[joint]]\na_m = 0.6\n[[joint]]\nalpha_deg = -90\na_m = 0.12\n\
                       [[joint]]\nd_m = 0.62\nalpha_deg = 90\n[[joint]]\n[tool]";
        let (joints, tool) = (case.1.find("[[joint]]").unwrap(), case.1.find("[tool]").unwrap());
        case.1.replace_range(joints..tool + "[tool]".len(), swapped);
        case
    };
    let mistyped = |mut case: Case| {
        case.1 = case.1.replacen("a_m = 0.6\n", "a_m = 0.5\n", 1);
        case
    };
    vec![
        mistyped(spoiled(
            "a mistyped length",
            priors,
            1,
            "(was 600 mm meant, and one digit mistyped?)",
            |_| (),
        )),
        spoiled("nothing wrong", priors, 0, "explains the data", |_| ()),
        spoiled("held-out rows shifted", priors, 1, "held-out", |data| {
            positions(data)[60..].rotate_left(1);
        }),
        spoiled("one wrong held-out row", priors, 0, "rows.csv:79", off(0.3)),
        spoiled("a held-out cell of 1e150", priors, 0, "rows.csv:79", off(1e149)),
        spoiled(
            "held-out rows are identification rows",
            priors,
            1,
            "identification rows again",
            copied(30),
        ),
        spoiled(
            "some of them are",
            priors,
            0,
            "10 of 30 held-out rows are identification rows again",
            copied(10),
        ),
        spoiled("two poses for a base", based, 1, "is not determined", session(&[10, 11])),
        spoiled(
            "two held-out poses for a base",
            based,
            0,
            "6 measured coordinates for 6",
            session(&[70, 71]),
        ),
        spoiled("inches", LENGTHS, 1, "units", scaled(1.0 / 25.4)),
        spoiled("metres for millimetres", LENGTHS, 1, "units", scaled(1e-3)),
        spoiled("millimetres for metres", LENGTHS, 1, "units", scaled(1e3)),
        spoiled("one point everywhere", LENGTHS, 1, "", scaled(0.0)),
        standard(spoiled("another convention", free, 1, "the nominal arm misses", |_| ())),
        robust,
        three_targets(),
        ("worse than no fit", worse, held_out, 1, "held-out"),
    ]
}

/// Returns cases with free offsets along parallel axes and an offset of the measuring frame.
fn running_off() -> Vec<Case> {
    let free =
        format!("{}'joint*.d' = {{ free = true }}\n'tool.*' = {{ free = true }}", runaway::PRIORS);
    let elbow = |name, twist, rules: &str, seed| {
        let text = runaway::text(twist, &format!("{free}{rules}"));
        let data = runaway::measured(&parse(&text), seed);
        (name, text, data, 0, "too weakly")
    };
    let ur10 = || {
        let text = fs::read_to_string(path("problems/ur10-ipa/problem.toml")).unwrap();
        let (arm, _) = text.split_once("[parameters]").unwrap();
        let text = format!("{arm}[parameters]\n{free}\n[data]\nposition_sigma_mm = 0.05\n");
        let data = runaway::measured(&parse(&text), 1);
        ("a UR10", text, data, 0, "too weakly")
    };
    let raised = || {
        let text = runaway::text(0.0, "'joint1.d' = { free = true }");
        let mut data = runaway::measured(&parse(&text), 1);
        for position in positions(&mut data) {
            position.z += 3.0;
        }
        ("a frame three metres above", text, data, 1, "times the arm's own size")
    };
    vec![
        elbow("an elbow arm", 0.0, "", 1),
        elbow("the same, hardly seen", 0.002, "", 2),
        elbow("the same with a bound", 0.0, "\n'joint1.a' = { sigma_mm = 3, min_mm = -50 }", 1),
        elbow(
            "with a bound, hardly seen",
            0.002,
            "\n'joint1.a' = { sigma_mm = 3, min_mm = -50 }",
            3,
        ),
        ur10(),
        raised(),
    ]
}

#[test]
fn what_cannot_be_meant_is_said_and_nothing_trusted_runs_off() {
    let mut wrong = String::new();
    for (name, problem, data, status, said) in spoiled_ones().into_iter().chain(running_off()) {
        let told = Told::by("identify", &problem, &csv(&parse(&problem), &data));
        let far = if told.status == 0 { told.far() } else { Vec::new() };
        if told.status != status || !told.text.contains(said) || !far.is_empty() {
            let _ = writeln!(
                wrong,
                "{name}: status {}, not {status}, and {said:?}; far: {far:?}\n  {:.400}",
                told.status, told.text
            );
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn a_declared_sigma_that_is_wrong_changes_nothing() {
    let mut wrong = String::new();
    for (name, right) in [("a-none", 0.05), ("c-link-thermal-bending", 0.3)] {
        let problem = fs::read_to_string(path("tests/cases/problem.toml")).unwrap();
        let table = fs::read_to_string(path(&format!("tests/cases/{name}.csv"))).unwrap();
        let fit = |sigma: f64| {
            let problem = problem
                .replace("files = [\"a-none.csv\"]\n", "")
                .replace("held_out = { column = \"split\" }\n", "");
            let declared = problem
                .replace("position_sigma_mm = 0.05", &format!("position_sigma_mm = {sigma}"));
            Told::by("identify", &declared, &table)
        };
        let expected = fit(right);
        for factor in [0.01, 0.1, 10.0, 100.0] {
            let told = fit(factor * right);
            let apart = told
                .parameters()
                .zip(expected.parameters())
                .filter_map(|(row, other)| Some((row.1 - other.1).abs() / other.3?))
                .fold(0.0, f64::max);
            let held_out = told.held_out_mm() / expected.held_out_mm();
            let said = told.text.contains("if only noise is left");
            // A σ a hundred times too small is not trusted, and nothing else changes.
            let expected_status = i32::from(factor < 0.05);
            if told.status != expected_status
                || apart > 0.4
                || (held_out - 1.0).abs() > 0.05
                || !said
            {
                let status = told.status;
                let _ = writeln!(
                    wrong,
                    "{name} × {factor}: status {status}, {apart:.2} σ apart, held out × {held_out:.3}, said {said}"
                );
            }
        }
    }
    for (seed, factor) in [(2, 10.0), (2, 100.0), (4, 10.0), (4, 100.0)] {
        let problem = sigma::elbow(0.05 * factor);
        let told = Told::by("loop", &problem, &csv(&parse(&problem), &sigma::simulated(seed)));
        let found: Vec<&Value> = told.json["effects"]
            .as_array()
            .unwrap()
            .iter()
            .map(|effect| &effect["effect"])
            .collect();
        if !found.is_empty() {
            let _ = writeln!(wrong, "seed {seed} × {factor}: finds {found:?}");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}
