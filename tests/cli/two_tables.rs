//! Commands on a tracker table and a controller's log with decimal commas, joined by name.

use crate::common::program::{Folder, assert_contains, number};

/// Beginning of a day to which the seconds of the table are added.
fn stamp(seconds: &str) -> String {
    let seconds: u32 = seconds.parse().unwrap();
    format!("2026-03-11 {:02}:{:02}:{:02}", 8 + seconds / 3600, seconds / 60 % 60, seconds % 60)
}

/// Rows of the lunar sampler's table as a controller writes them, with the columns `kept`.
fn log(folder: &Folder, kept: &[&str], rows: usize) -> String {
    let table = folder.table("a-none.csv");
    let name = |column: &str| match column {
        "pose" => "Name".to_owned(),
        "time_s" => "Stamp".to_owned(),
        joint if joint.starts_with('q') => format!("A{}", &joint[1..2]),
        other => other.to_owned(),
    };
    let mut text = kept.iter().map(|column| name(column)).collect::<Vec<_>>().join(";") + "\n";
    for row in table.rows.iter().take(rows) {
        let cell = |column: &&str| match (&row[table.place(column)], *column) {
            (seconds, "time_s") => stamp(seconds),
            (cell, "pose") => format!("P{cell}"),
            (cell, _) => cell.replace('.', ","),
        };
        text += &(kept.iter().map(cell).collect::<Vec<_>>().join(";") + "\n");
    }
    text
}

const JOINTS: [&str; 5] = ["pose", "q1_deg", "q2_deg", "q3_deg", "q4_deg"];
const CONDITIONS: [&str; 3] = ["payload_kg", "hoist_N", "temperature_C"];
const POSITION: [&str; 3] = ["x_mm", "y_mm", "z_mm"];

/// The lunar sampler in two tables.
fn two_tables() -> Folder {
    let folder = Folder::with_lunar_sampler();
    folder.edit(
        "problem.toml",
        "files = [\"a-none.csv\"]",
        "files = [\"tracker.csv\"]\njoints = { files = [\"sub/../log.csv\"], by = \"name\" }",
    );
    folder.write("sub/empty", "");
    folder.map("problem.toml", |text| {
        let joints: Vec<String> = (1..=4).map(|k| format!("A{k} = 'q{k}_deg'\n")).collect();
        let joints = joints.concat();
        format!(
            "{text}[data.columns]\nName = 'pose'\nStamp = 'time'\n{joints}[data.format]\ndecimal = ','\n"
        )
    });
    let kept = [&JOINTS[..], &CONDITIONS, &["time_s"]].concat();
    folder.write("log.csv", log(&folder, &kept, usize::MAX));
    let tracker = log(&folder, &[&["pose", "split"], &POSITION[..]].concat(), usize::MAX);
    folder.write("tracker.csv", tracker.replace(',', ".").replace(';', "\t"));
    folder
}

#[test]
fn every_command_reads_two_tables_and_what_flexcal_writes_for_them() {
    let folder = two_tables();
    let run = folder.flexcal("identify . --out fitted").success();
    assert!(!run.stderr.contains("Stamp"), "{run:?}");
    for command in ["identify", "loop"] {
        let other = folder.flexcal(&format!("{command} . --joints other.csv --out other")).code(2);
        assert_contains(&other.stderr, &["other.csv", "no such file"]);
    }
    // A plan lacks what the log has; the next command says so, and runs once it is added.
    let candidates = log(&folder, &[&JOINTS[..], &CONDITIONS[..2]].concat(), 30);
    folder.write("candidates.csv", candidates);
    let effects = "'gear-ratio = { joint = 1 }' 'joint-harmonic = { joint = 1, orders = [1] }'";
    let plan = format!("plan . --poses 4 --candidates candidates.csv --separate {effects} --out p");
    let said = folder.flexcal(&plan).words();
    let added = "add the columns x_mm, y_mm, z_mm and time, temperature_C, which the measurements at hand have, then flexcal loop . --data";
    assert_contains(&said, &[added, "tracker.csv p/plan.csv"]);
    let lacking = folder.flexcal("identify . --data tracker.csv p/plan.csv --out more").code(2);
    assert_contains(&lacking.stderr, &["p/plan.csv"]);
    folder.map_rows("p/plan.csv", |line, row| {
        Some(format!("{row},1840.7,-792.4,-1280.1,20,2026-03-12 08:00:{line:02}"))
    });
    folder.map("p/plan.csv", |text| {
        let (header, rows) = text.split_once('\n').unwrap();
        format!("{header},x_mm,y_mm,z_mm,temperature_C,time\n{rows}")
    });
    let both = folder.flexcal("identify . --data tracker.csv p/plan.csv --out more");
    assert!(both.status < 2, "{both:?}");
    // Paths in records have no detours.
    folder.flexcal("accept . --out signed");
    let record = folder.json("signed/acceptance.json");
    let files = record["inputs"].as_array().unwrap().iter();
    let files: Vec<&str> = files.map(|input| input["file"].as_str().unwrap()).collect();
    assert!(files.contains(&"log.csv") || files.contains(&"./log.csv"), "{files:?}");
}

#[test]
fn tables_to_judge_may_lack_times_and_commands_look_like_targets() {
    let folder = two_tables();
    folder.flexcal("identify . --out fitted").success();
    let estimate = "--estimate fitted/estimate.json";
    let later = log(&folder, &[&JOINTS[..], &POSITION, &CONDITIONS].concat(), 6);
    folder.write("later.csv", later);
    for command in ["predict", "watch"] {
        let run = folder.flexcal(&format!("{command} . {estimate} --data later.csv --out judged"));
        assert!(run.status != 2, "{command}: {run:?}");
    }
    // What a fit needs is still missed.
    folder.edit("later.csv", "A2", "B2");
    let run = folder.flexcal(&format!("watch . {estimate} --data later.csv --out judged")).code(2);
    assert_contains(&run.stderr, &["q2"]);
    folder.edit("later.csv", "B2", "A2");
    let compensate = format!("compensate . {estimate} --data later.csv --out c");
    let run = folder.flexcal(&compensate);
    assert!(run.status < 2, "{run:?}");
    let commands = folder.read("c/commands.csv");
    let mut lines = commands.lines();
    assert!(lines.next().unwrap().starts_with("pose;A1;A2;A3;A4;x_mm;"), "{commands}");
    let first: Vec<&str> = lines.next().unwrap().split(';').collect();
    assert_eq!((first[0], first[5]), ("P1", "1840,7678"), "{commands}");
    let back = format!("predict . {estimate} --data c/commands.csv --out back --json");
    let errors = folder.flexcal(&back).json();
    assert!(number(&errors["all"]["max_mm"]["norm"]) < 0.01, "{errors}");
    // Targets without a start: names of words are not proposed as commands.
    folder.write("targets.csv", "name;x_mm;y_mm;z_mm\nT1;1840,7;-792,4;-1280,1\n");
    let run =
        folder.flexcal(&format!("compensate . {estimate} --data targets.csv --out c2")).code(2);
    assert_contains(&run.stderr, &["column q1: missing", "the command to start from"]);
    assert!(!run.stderr.contains("\"name\" ="), "{run:?}");
}
