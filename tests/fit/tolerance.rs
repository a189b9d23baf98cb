//! A tolerance is passed or failed with a stated risk of being wrong.

use std::path::Path;

use assert_cmd::Command;
use flexcal::fit::{Options, Tolerance, Verdict, identify};
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use flexcal::rig::{Truth, simulate};
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use crate::common::arms::path;
use crate::common::program::{Folder, assert_contains};

/// Arms that are identified from measurements of the rig.
const ARMS: u64 = 20;
/// Poses of each arm from which held-out ones are drawn.
const POOL: usize = 1000;
/// Draws of held-out poses of each arm, and poses of each draw.
const DRAWS: [usize; 2] = [200, 50];

fn read(problem: &Problem, truth: &Truth, (poses, seed): (usize, u64)) -> Dataset {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rows.csv");
    std::fs::write(&file, simulate(problem, truth, poses, seed).unwrap().csv()).unwrap();
    Dataset::read_files(&[file], problem).unwrap().0
}

/// Poses drawn from an arm of which slightly fewer than 90 % are within a tolerance pass in at most
/// 5 % of the draws; of an arm with slightly more of them, at most 5 % fail.
#[test]
#[ignore = "20 identifications and 20 000 simulated poses take minutes"]
fn wrong_verdicts_are_no_more_frequent_than_the_risk() {
    let problem = Problem::read(&path("tests/cases/problem.toml")).unwrap();
    let truth = Truth::read(&path("tests/cases/truth.toml"), &problem).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (share, risk) = (0.9, 0.05);
    let mut wrong = [0, 0];
    for seed in 0..ARMS {
        let found =
            identify(&problem, &read(&problem, &truth, (78, 7000 + seed)), &Options::default())
                .unwrap();
        let rows = read(&problem, &truth, (POOL, 8000 + seed)).measurements;
        let predicted = found.predict(&problem, &rows).unwrap();
        let errors = rows.positions.iter().zip(&predicted).map(|(at, to)| (at - to).norm());
        let mut errors: Vec<f64> = errors.collect();
        errors.sort_by(f64::total_cmp);
        let last = POOL * 9 / 10 - 1;
        // 899 and 900 of 1000 poses are within these.
        let [too_small, large_enough] = [last - 1, last].map(|place| errors[place]);
        for _ in 0..DRAWS[0] {
            errors.shuffle(&mut rng);
            let verdict =
                |length| Tolerance { length, share, risk }.test(&errors[..DRAWS[1]]).verdict;
            wrong[0] += usize::from(verdict(too_small) == Verdict::Pass);
            wrong[1] += usize::from(verdict(large_enough) == Verdict::Fail);
        }
    }
    let shares = wrong.map(|count| count as f64 / (ARMS as f64 * DRAWS[0] as f64));
    println!("wrong passes {:.4}, wrong fails {:.4}", shares[0], shares[1]);
    assert!(shares.iter().all(|share| *share <= risk), "{shares:?}");
}

fn accepted(words: &str, out: &Path) -> (Option<i32>, Value) {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
    let arguments = format!("accept {} --json", path("problems/lunar-sampler").display());
    let arguments = arguments.split_whitespace().chain(words.split_whitespace());
    let output = command.args(arguments).arg("--out").arg(out).output().unwrap();
    (output.status.code(), serde_json::from_slice(&output.stdout).unwrap())
}

#[test]
fn accept_tests_a_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let (status, plain) = accepted("", out);
    assert_eq!((status, &plain["tolerance"]), (Some(0), &Value::Null));
    assert!(plain["bound"]["coverage"].as_f64().unwrap() > 0.8, "{}", plain["bound"]);
    let (status, passed) = accepted("--tolerance-mm 100 --share 0.5", out);
    let tested = &passed["tolerance"];
    assert_eq!((status, &tested["verdict"]), (Some(0), &"pass".into()), "{tested}");
    assert_eq!((&tested["poses"], &tested["beyond"]), (&passed["poses"], &0.into()));
    let page = std::fs::read_to_string(out.join("acceptance.html")).unwrap();
    assert!(page.contains("Pass: at least 50 % of the poses err by no more than 100"));
    assert!(page.contains(">Pass</span><span class=\"label\">at most 100"));
    let (status, failed) = accepted("--tolerance-mm 0.0001", out);
    assert_eq!((status, &failed["tolerance"]["verdict"]), (Some(1), &"fail".into()));
    let (status, open) = accepted("--tolerance-mm 100 --share 0.999 --risk 0.05", out);
    assert_eq!((status, &open["tolerance"]["verdict"]), (Some(1), &"undecided".into()));
    // 0.999²⁹⁹⁴ = 0.05002 and 0.999²⁹⁹⁵ = 0.04997.
    assert_eq!(open["tolerance"]["poses_to_pass"], 2995);
}

#[test]
fn poses_that_are_fitted_too_decide_nothing() {
    let folder = Folder::with_lunar_sampler();
    let table = folder.read("a-none.csv");
    let fitted = table.lines().filter(|line| line.contains(",identification,"));
    // The copies are measured anew, 0.02 mm apart.
    let copies = fitted.clone().map(|line| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        cells[1] = "validation".to_owned();
        cells[6] = format!("{:.4}", cells[6].parse::<f64>().unwrap() + 0.02);
        cells.join(",")
    });
    let rows: Vec<String> =
        table.lines().take(1).chain(fitted.clone()).map(str::to_owned).chain(copies).collect();
    folder.write("a-none.csv", rows.join("\n") + "\n");
    let run = folder.flexcal("accept . --tolerance-mm 100 --out out").code(1);
    assert_contains(&run.stdout, &["Undecided: the arm was fitted to the poses that are held out"]);
    assert_contains(&run.stdout, &["Next: hold out poses that are not fitted"]);
    assert!(!run.stdout.contains("took part in no fit"), "{run:?}");
}
