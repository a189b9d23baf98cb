//! Studies: identical results after interruption, sharding and threading; meaningful statistics;
//! input errors.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

mod common;

#[path = "study/misprints.rs"]
mod misprints;

use std::fs;
use std::process::{Command as Process, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use flexcal::results::{Document as _, StudyResult, study_csv, study_parameters_csv};
use flexcal::study::{Results, Shard, Store, Study, collect, pending, run};

use common::program::{Folder, assert_contains, items, number};
use common::schema;

/// Problem of three rigid joints with few parameters, whose fit is fast.
const ARM: &str = r#"
name = "small"
[[joint]]
d_m = 0.3
[[joint]]
alpha_deg = 90.0
[[joint]]
a_m = 0.6
[tool]
target_m = [0.5, 0.05, 0.0]
[parameters]
"joint*.theta" = { sigma_deg = 0.5 }
"joint3.a" = { sigma_mm = 3.0 }
"tool.x" = { sigma_mm = 3.0 }
[data]
position_sigma_mm = 0.1
"#;

const STUDY: &str = r#"
name = "small-study"
problem = "problem.toml"
seed = 7
repetitions = 120
position_sigma_mm = [0.05, 0.2]
identification_poses = [8]
held_out_poses = 10
strategies = ["joint"]
solvers = ["auto", "gauss-newton"]
[poses]
q1_deg = [-120, 120]
q2_deg = [-40, 80]
q3_deg = [-120, -10]
"#;

/// Number of cells; parts have at most 50 fits.
const CELLS: usize = 4;
const PARTS: usize = 12;

/// Result files that have to repeat exactly.
const RESULTS: [&str; 3] = ["study.csv", "study.json", "parameters.csv"];

/// Returns a folder with a study.
fn bench() -> Folder {
    Folder::with([("problem.toml", ARM), ("STUDY.toml", STUDY)])
}

fn read_study(folder: &Folder) -> Study {
    Study::read(&folder.path("STUDY.toml")).unwrap()
}

/// Returns the texts of the results in a folder.
fn results(folder: &Folder, out: &str) -> Vec<String> {
    RESULTS.iter().map(|name| folder.read(format!("{out}/{name}"))).collect()
}

/// Returns the number of finished parts in a folder of results.
fn parts(folder: &Folder, out: &str) -> usize {
    let Ok(entries) = fs::read_dir(folder.path(out).join("cells")) else { return 0 };
    entries
        .filter(|entry| entry.as_ref().unwrap().path().extension().is_some_and(|e| e == "json"))
        .count()
}

/// Runs the pending parts of a shard on a number of threads.
fn run_on(threads: usize, study: &Study, store: &Store, shard: Shard) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let open = pending(study, store, shard).unwrap();
    pool.install(|| run(study, store, &open, || ())).unwrap();
}

fn texts(study: &Study, results: &Results) -> [String; 3] {
    [
        study_csv(study, results),
        StudyResult::new(study, results).to_json(),
        study_parameters_csv(study, results),
    ]
}

#[test]
fn names_with_a_comma_stay_one_cell() {
    let bench = bench();
    bench.edit(
        "problem.toml",
        "[parameters]",
        "[[effect]]\njoint-coupling = { joint = 3, from = 2 }\n[parameters]",
    );
    bench.edit("STUDY.toml", "repetitions = 120", "repetitions = 3");
    bench.flexcal("study . --out out --quiet").success();
    bench.table("out/study.csv").place("largest_bias_of");
    let parameters = bench.table("out/parameters.csv");
    let names = parameters.column("parameter");
    assert!(names.contains(&"joint-coupling[3,2].factor"), "{names:?}");
}

#[test]
fn declared_effects_are_drawn_and_found_again() {
    let bench = bench();
    let effects = "[[effect]]\ngear-ratio = { joint = 2 }\n[[effect]]\njoint-harmonic = { joint = 3, orders = [1, 3] }\n[parameters]";
    bench.edit("problem.toml", "[parameters]", effects);
    bench.edit("STUDY.toml", "repetitions = 120", "repetitions = 40");
    bench.edit("STUDY.toml", "identification_poses = [8]", "identification_poses = [30]");
    bench.edit("STUDY.toml", "position_sigma_mm = [0.05, 0.2]", "position_sigma_mm = [0.05]");
    for source in ["model", "rig"] {
        bench.edit("STUDY.toml", "\n[poses]", &format!("\ndata = '{source}'\n[poses]"));
        bench.flexcal(&format!("study . --out {source} --quiet")).success();
        bench.edit("STUDY.toml", &format!("\ndata = '{source}'"), "");
        let table = bench.table(format!("{source}/parameters.csv"));
        let mut seen = 0;
        for row in &table.rows {
            let name = &row[table.place("parameter")];
            if !name.contains('[') {
                continue;
            }
            let number = |column: &str| row[table.place(column)].parse::<f64>().unwrap();
            // Values are drawn from priors of 1e-2 (gear ratio) and 1e-3: a fit of 30 poses is more
            // accurate, and reports how much.
            let (fits, rms, coverage) = (number("fits"), number("rms_error"), number("coverage"));
            assert!(
                fits > 35.0 && rms > 0.0 && rms < 9e-4 && coverage > 0.8,
                "{source} {name}: {row:?}"
            );
            seen += 1;
        }
        assert_eq!(seen, 2 * 5, "{source}: five parameters of effects by two solvers");
    }
    // An effect that the poses cannot show is an error at the effect.
    bench.edit("problem.toml", "gear-ratio = { joint = 2 }", "joint-thermal-drift = { joint = 2 }");
    bench.edit("problem.toml", "[data]", "[data]\nreference_temperature_C = 20");
    let run = bench.flexcal("study .").code(2);
    assert_contains(&run.stderr, &["problem.toml:", "temperature_C = [from, to] in [poses]"]);
}

#[test]
fn an_effect_of_loads_or_temperature_is_studied_as_the_loop_declares_it() {
    let bench = bench();
    let problem = include_str!("cases/problem.toml");
    let effect = "[[effect]]\nlink-thermal-bending = { link = \"A\" }\n[parameters]";
    bench.write("problem.toml", problem.replacen("[parameters]", effect, 1));
    let (before, _) = STUDY.split_once("[poses]").unwrap();
    let study = before
        .replace("repetitions = 120", "repetitions = 2")
        .replace("[8]", "[30]")
        .replace(", \"gauss-newton\"", "");
    let poses = "[poses]\nq1_deg = [-90, 90]\nq2_deg = [-65, 15]\nq3_deg = [15, 130]\nq4_deg = [-95, 75]\ntemperature_C = [15, 30]\n";
    bench.write("STUDY.toml", study + poses);
    bench.flexcal("study . --out out --quiet").success();
    let rows = bench.read("out/parameters.csv");
    let fitted = rows
        .lines()
        .filter(|row| row.contains("link-thermal-bending[A].about_") && row.contains(",2,"));
    assert_eq!(fitted.count(), 4, "{rows}");
}

#[test]
fn folders_to_merge_from_are_there() {
    let bench = bench();
    bench.edit("STUDY.toml", "repetitions = 120", "repetitions = 3");
    bench.flexcal("study . --out one --quiet").success();
    bench.flexcal("study merge . --out all --from one").success();
    let run = bench.flexcal("study merge . --out all --from one tow").code(2);
    assert_contains(&run.stderr, &["--from tow: no such folder"]);
}

#[test]
fn threads_shares_and_order_change_nothing() {
    let bench = bench();
    let study = read_study(&bench);
    assert_eq!((study.cells.len(), study.parts().len()), (CELLS, PARTS));
    let whole = Store::new(&bench.path("whole"));
    run_on(1, &study, &whole, Shard::WHOLE);
    let expected = texts(&study, &collect(&study, std::slice::from_ref(&whole)).unwrap());
    schema::assert_valid(&StudyResult::schema(), &expected[1]);
    assert_eq!(expected[0].lines().count(), 1 + CELLS);
    assert_eq!(expected[2].lines().count(), 1 + CELLS * study.parameters.len());
    for (threads, shares) in [(2, 1), (3, 3), (2, 5), (1, 20)] {
        let folder = |i: usize| bench.path(format!("{shares}-{i}"));
        let stores: Vec<Store> = (1..=shares).map(|i| Store::new(&folder(i))).collect();
        for i in (1..=shares).rev() {
            run_on(threads, &study, &stores[i - 1], Shard::new(i, shares).unwrap());
        }
        let found = texts(&study, &collect(&study, &stores).unwrap());
        assert_eq!(found, expected, "{threads} threads, {shares} shares");
        if shares > 1 {
            let message = collect(&study, &stores[1..]).unwrap_err().to_string();
            assert_contains(&message, &["of 12 parts of the study are missing"]);
        }
    }
}

#[test]
fn finished_parts_are_kept_and_no_others_used() {
    let bench = bench();
    let store = Store::new(&bench.path("out"));
    let fits = |study: &Study| {
        let count = AtomicUsize::new(0);
        let open = pending(study, &store, Shard::WHOLE).unwrap();
        run(study, &store, &open, || _ = count.fetch_add(1, Ordering::Relaxed)).unwrap();
        count.into_inner()
    };
    let study = read_study(&bench);
    assert_eq!(fits(&study), CELLS * 120);
    let first = texts(&study, &collect(&study, std::slice::from_ref(&store)).unwrap());
    assert_eq!(fits(&study), 0, "everything is there");
    // One more noise level keeps the parts of the others.
    bench.edit("STUDY.toml", "[0.05, 0.2]", "[0.1, 0.05, 0.2]");
    assert_eq!(fits(&read_study(&bench)), 2 * 120);
    // More repetitions keep full parts; the last one of 20 is replaced by one of 50.
    bench.edit("STUDY.toml", "repetitions = 120", "repetitions = 150");
    assert_eq!(fits(&read_study(&bench)), 6 * 50);
    // Other arms, poses or noise keep no part.
    for (file, from, to) in [
        ("STUDY.toml", "seed = 7", "seed = 8"),
        ("STUDY.toml", "held_out_poses = 10", "held_out_poses = 11"),
        ("STUDY.toml", "q3_deg = [-120", "q3_deg = [-110"),
        ("problem.toml", "0.5 }", "0.4 }"),
    ] {
        bench.edit(file, from, to);
        assert_eq!(fits(&read_study(&bench)), 6 * 150, "{to}");
    }
    // The original study finds its parts again.
    bench.write("STUDY.toml", STUDY);
    bench.write("problem.toml", ARM);
    assert_eq!(fits(&read_study(&bench)), 0);
    assert_eq!(texts(&study, &collect(&study, std::slice::from_ref(&store)).unwrap()), first);
}

#[test]
fn damaged_and_foreign_parts_are_not_used() {
    let bench = bench();
    let study = read_study(&bench);
    let store = Store::new(&bench.path("out"));
    run_on(2, &study, &store, Shard::WHOLE);
    let mut files = fs::read_dir(store.folder()).unwrap().map(|entry| entry.unwrap().path());
    let (one, other) = (files.next().unwrap(), files.next().unwrap());
    fs::copy(&other, &one).unwrap();
    let message = pending(&study, &store, Shard::WHOLE).unwrap_err().to_string();
    assert_contains(&message, &["belongs to other inputs", &one.display().to_string()]);
    let cell = fs::read_to_string(&other).unwrap();
    fs::write(&other, cell.replacen("\"mean\": ", "\"mean\": 1", 1)).unwrap();
    fs::remove_file(&one).unwrap();
    let message = pending(&study, &store, Shard::WHOLE).unwrap_err().to_string();
    assert_contains(&message, &["tally: changed since flexcal wrote it"]);
    let unsealed = format!("{}}}", cell.split(",\n  \"digest\"").next().unwrap());
    let newer = cell.replacen("\"version\": 2", "\"version\": 99", 1).replacen("tally", "sums", 1);
    for (text, expected) in [(unsealed, "digest: changed since"), (newer, "format: version 99")] {
        fs::write(&other, text).unwrap();
        let message = pending(&study, &store, Shard::WHOLE).unwrap_err().to_string();
        assert_contains(&message, &[expected]);
    }
    fs::write(&other, cell).unwrap();
    fs::write(&one, "{").unwrap();
    assert_contains(&bench.flexcal("study STUDY.toml --out out").code(2).stderr, &["damaged"]);
    fs::remove_file(&one).unwrap();
    assert_eq!(pending(&study, &store, Shard::WHOLE).unwrap().len(), 1);
}

#[test]
fn a_killed_study_goes_on_and_ends_alike() {
    let bench = bench();
    // Enough fits to interrupt the study.
    bench.edit("STUDY.toml", "repetitions = 120", "repetitions = 2000");
    let start = || {
        let mut process = Process::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        process.current_dir(bench.path("")).args(["study", ".", "--out", "killed", "--quiet"]);
        process.env("RAYON_NUM_THREADS", "1").stdout(Stdio::null()).spawn().unwrap()
    };
    let mut stopped = 0;
    for wanted in [1, 40] {
        let mut process = start();
        while parts(&bench, "killed") < wanted && process.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        process.kill().unwrap();
        process.wait().unwrap();
        stopped += usize::from(!bench.has("killed/study.csv"));
    }
    assert!(stopped > 0 && parts(&bench, "killed") < 160, "killed before the end");
    bench.flexcal("study . --out killed --quiet").success();
    bench.flexcal("study . --out whole --quiet").success();
    assert_eq!(results(&bench, "killed"), results(&bench, "whole"));
}

#[test]
fn shares_of_the_command_line_merge_to_the_same_bytes() {
    let bench = bench();
    assert_contains(
        &bench.flexcal("study STUDY.toml").success().stdout,
        &[
            "gauss-newton",
            "levenberg-marquardt",
            "held out mean, mm",
            "Written to out/small-study: ",
            "study.csv",
        ],
    );
    for share in ["1/3", "2/3", "3/3"] {
        // All shards in one folder, and each in a separate one.
        let done = format!("done/{}", &share[..1]);
        let study = format!("study STUDY.toml --shard {share}");
        bench.flexcal(&format!("{study} --out shared --done {done}")).success();
        assert_eq!(bench.read(&done), "flexcal study: done\n");
        let folder = format!("own-{}", &share[..1]);
        bench.flexcal(&format!("{study} --out {folder} --quiet")).success();
        assert!(!bench.has("shared/study.csv") && parts(&bench, &folder) == PARTS / 3);
    }
    // Outdated results are removed until they are complete again; other files stay.
    bench.flexcal("study no-such.toml --done done/1").code(2);
    bench.flexcal("study STUDY.toml --done STUDY.toml").code(2);
    assert!(!bench.has("done/1") && bench.has("STUDY.toml"));
    let run = bench.flexcal("study merge STUDY.toml --out own-1").code(2);
    assert_contains(&run.stderr, &["8 of 12 parts of the study are missing"]);
    let merged = bench.flexcal("study merge STUDY.toml --out shared --json").success();
    bench.flexcal("study merge STUDY.toml --out all --from own-1 own-2 own-3 --quiet").success();
    let expected = results(&bench, "out/small-study");
    assert_eq!(results(&bench, "shared"), expected);
    assert_eq!(results(&bench, "all"), expected);
    assert_eq!(merged.stdout, expected[1]);
    assert_eq!(bench.table("all/timing.csv").rows.len(), CELLS);
    bench.edit("STUDY.toml", "seed = 7", "seed = 8");
    let run = bench.flexcal("study merge STUDY.toml --out shared").code(2);
    assert_contains(
        &run.stderr,
        &["12 there are of other inputs, so that the study or its problem"],
    );
}

#[test]
fn figures_are_what_they_say() {
    let bench = bench();
    bench.edit("STUDY.toml", "repetitions = 120", "repetitions = 1000");
    let json = bench.flexcal("study . --json").success().json();
    let cells = items(&json["cells"]);
    for cell in cells {
        assert_eq!((number(&cell["fits"]), number(&cell["failed"])), (1000.0, 0.0));
        assert!((number(&cell["reduced_chi2"]) - 1.0).abs() < 0.05, "{}", cell["reduced_chi2"]);
        // Figures of the noise on three axes, and of the estimates.
        let noise = number(&cell["position_sigma_mm"]) * 3.0_f64.sqrt();
        let rms = number(&cell["held_out_mm"]["rms"]);
        assert!(rms > noise && rms < 1.5 * noise, "{rms} against {noise}");
        for parameter in items(&cell["parameters"]) {
            let of = |key: &str| number(&parameter[key]);
            let (bias, spread, claimed) = (of("bias"), of("spread"), of("std_error"));
            // The limit is four standard deviations of each figure.
            assert!(bias.abs() < 4.0 * spread / 1000.0_f64.sqrt(), "{parameter}");
            assert!((spread / claimed - 1.0).abs() < 4.0 / 2000.0_f64.sqrt(), "{parameter}");
            assert!(
                (of("coverage") - 0.95).abs() < 4.0 * (0.95_f64 * 0.05 / 1000.0).sqrt(),
                "{parameter}"
            );
        }
    }
    // The same arms, poses and noise: solvers that find the minimum agree; four times the noise
    // gives nearly four times the scatter.
    let spread = |cell: usize, k: usize| number(&cells[cell]["parameters"][k]["spread"]);
    for k in 0..5 {
        assert!((spread(0, k) / spread(1, k) - 1.0).abs() < 1e-4);
        let ratio = spread(2, k) / spread(0, k);
        assert!(ratio > 3.0 && ratio < 4.01, "{ratio}");
    }
}

#[test]
fn the_rig_measures_what_the_model_lacks() {
    let bench = bench();
    let truth = "[random]\n\"joint*.theta\" = { sigma_deg = 0.5 }\n[[effect]]\njoint-harmonic = { joint = 2, orders = [1] }\n\
                 sin1_deg = 0.1\n[poses]\nq1_deg = [-120, 120]\nq2_deg = [-40, 80]\nq3_deg = [-120, -10]\n";
    bench.write("TRUTH.toml", truth);
    let (before, _) = STUDY.split_once("[poses]").unwrap();
    let study = before.replace("repetitions = 120", "repetitions = 20");
    bench.write("STUDY.toml", format!("{study}truth = \"TRUTH.toml\"\n"));
    assert_contains(&bench.flexcal("study .").code(2).stderr, &["write data = \"rig\""]);
    bench.write("STUDY.toml", format!("{study}truth = \"TRUTH.toml\"\ndata = \"rig\"\n"));
    let json = bench.flexcal("study . --json").success().json();
    let chi2 = number(&json["cells"][0]["reduced_chi2"]);
    assert!(chi2 > 5.0, "a harmonic of 0.1° at 1 m is far above 0.05 mm: χ²/ν {chi2}");
    assert!(number(&json["cells"][0]["coverage"]) < 0.95);
}

#[test]
fn a_folder_without_a_study_is_told_where_to_read() {
    let run = Folder::new().flexcal("study .").code(2);
    assert_contains(&run.message(), &["STUDY.toml: no such file", "docs/study.md"]);
}

#[test]
fn a_study_of_contacts_is_refused() {
    let bench = bench();
    bench.write("problem.toml", format!("{ARM}[[point]]\nname = 'left'\n"));
    let run = bench.flexcal("study .").code(2);
    assert_contains(&run.stderr, &["STUDY.toml:3: problem: a study draws and fits positions"]);
}

#[test]
fn bad_studies_are_named_and_leave_nothing_behind() {
    let cases: &[(&str, &str, &[&str])] = &[
        ("seed = 7", "sed = 7", &["seed", "missing", "(is it sed?)"]),
        (
            "seed = 7",
            "seed = 7\nstrategy = 3",
            &["STUDY.toml:5", "strategy", "unknown key (did you mean strategies?)"],
        ),
        ("repetitions = 120", "repetitions = 0", &["STUDY.toml:5", "repetitions"]),
        ("repetitions = 120", "repetitions = 2000000", &["STUDY.toml:5", "too large"]),
        ("[0.05, 0.2]", "[0.05, 0.0]", &["STUDY.toml:6", "position_sigma_mm[2]", "above zero"]),
        ("[0.05, 0.2]", "[0.05, 0.05]", &["position_sigma_mm[2]", "already"]),
        ("[0.05, 0.2]", "[]", &["STUDY.toml:6", "empty"]),
        ("position_sigma_mm", "position_sigma", &["unit", "position_sigma_mm"]),
        ("[8]", "[8.5]", &["STUDY.toml:7", "identification_poses[1]"]),
        ("\"joint\"", "\"both\"", &["STUDY.toml:9", "strategies[1]", "sequential"]),
        ("\"joint\"", "\"stiffness-only\"", &["STUDY.toml:9", "stiffness-only"]),
        ("\"auto\"", "\"newton\"", &["STUDY.toml:10", "solvers[1]", "pseudo-inverse"]),
        ("\"auto\"", "\"levenberg-marquardt\", \"auto\"", &["solvers[2]", "already"]),
        ("problem.toml", "other.toml", &["STUDY.toml:3", "other.toml"]),
        ("name = \"small-study\"", "name = \"a/b\"", &["STUDY.toml:2", "folder"]),
        ("q3_deg = [-120, -10]", "", &["poses.q3", "missing"]),
        (
            "q3_deg = [-120, -10]",
            "q3_deg = [-120, -10]\nidentification = 8",
            &["poses.identification", "the study sets"],
        ),
        ("[poses]", "truth = \"TRUTH.toml\"\n[poses]", &["STUDY.toml:11", "TRUTH.toml"]),
    ];
    for &(from, to, expected) in cases {
        let bench = bench();
        bench.edit("STUDY.toml", from, to);
        let run = bench.flexcal("study STUDY.toml").code(2);
        assert_contains(&run.stderr, expected);
        assert!(run.stdout.is_empty() && !bench.has("out"), "{to} left something behind");
    }
    let bench = bench();
    bench.edit("problem.toml", "sigma_mm = 3.0 }", "sigma_mm = 3.0, max_mm = 9.0 }");
    let run = bench.flexcal("study STUDY.toml").code(2);
    assert_contains(&run.stderr, &["gauss-newton does not keep the bounds"]);
    for arguments in
        ["study", "study . --shard 0/3", "study . --shard 1/3 --json", "study nowhere.toml"]
    {
        bench.flexcal(arguments).code(2);
    }
}

#[test]
fn poses_that_are_too_few_for_the_parameters_are_no_failure_of_the_solver() {
    let bench = bench();
    bench.edit("STUDY.toml", "repetitions = 120", "repetitions = 3");
    bench.edit("STUDY.toml", "identification_poses = [8]", "identification_poses = [1]");
    bench.flexcal("study . --out out --quiet").success();
    let table = bench.table("out/study.csv");
    assert!(table.column("failed").iter().all(|failed| *failed == "0"));
}
