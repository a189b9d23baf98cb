//! Replicas of the paper's experiment: results, reproducibility, and agreement with docs/paper.md.

use flexcal::results::{Document as _, MisprintResult};
use flexcal::study::{MisprintStudy, ReplicaResults, Request, Spread, replicate};

use crate::common::arms::path;
use crate::common::program::{Folder, assert_contains, run};
use crate::common::schema;

const FILE: &str = "problems/lunar-sampler/MISPRINTS.toml";

fn study() -> MisprintStudy {
    match Request::read(&path(FILE)).unwrap() {
        Request::Misprints(study) => *study,
        Request::Fits(_) => unreachable!("it says kind = \"misprints\""),
    }
}

/// Returns the mean ratio of the error of a reading to that of the rigid fit.
fn ratio(found: &ReplicaResults, name: &str, stage: usize) -> f64 {
    let place = found.readings.iter().position(|reading| reading.name == name).unwrap();
    let ratios =
        found.replicas.iter().map(|replica| replica.ratio(replica.reading_error(place, stage)));
    Spread::of(ratios).unwrap().mean
}

#[test]
fn replicas_repeat_and_tell_readings_and_stages_apart() {
    let mut study = study();
    study.specimens = 2;
    study.cases.truncate(1);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| replicate(&study, || {}).unwrap())
    };
    let found = on(1);
    let json = |found| MisprintResult::new(&study, found).to_json();
    let again = on(3);
    assert_eq!(json(&found), json(&again));
    schema::assert_valid(&MisprintResult::schema(), &json(&found));
    for replica in &found.replicas {
        assert!((replica.rigid.unwrap().mean.norm / study.rigid_leaves - 1.0).abs() < 1e-3);
    }
    let [known, declared, positions, differences] =
        [0, 1, 2, 3].map(|stage| ratio(&found, "corrected", stage));
    println!(
        "corrected: known {known:.3}, declared {declared:.3}, positions {positions:.3}, differences {differences:.3}"
    );
    assert!(known < 0.1 && differences < 0.1, "{known} {differences}");
    assert!(declared > 1.5 * known && positions > 5.0 * differences, "{declared} {positions}");
    let side = ratio(&found, "link-side", 0);
    println!("eq. 21 as printed: {side:.3}");
    assert!(side > 4.0 * known, "{side}");
}

#[test]
fn mistakes_in_a_study_of_misprints_are_named() {
    let text = std::fs::read_to_string(path(FILE)).unwrap();
    let text = text
        .replace("\"problem.toml\"", &format!("\"{}\"", path("problems/lunar-sampler").display()));
    let cases = [
        ("\"misprints\"", "\"mistakes\"", "kind: \"mistakes\" is none of fits, misprints"),
        ("specimens = 8", "specimens = 0", "specimens"),
        ("specimens = 8", "specimen = 8", "specimens: missing"),
        ("rigid_leaves_mm = 3.9673", "rigid_leaves_mm = 0", "rigid_leaves_mm"),
        ("[0.25, 1.0, 4.0]", "[0.25, 0.0]", "links_over_joints[2]"),
        ("payload_kg = 0.0\nhoist_N = 80.0", "", "second_load.payload_kg: missing"),
        ("seed = 1", "seed = 1\nrepetitions = 5", "repetitions: unknown key"),
    ];
    for (from, to, expected) in cases {
        assert!(text.contains(from), "{from}");
        let folder = Folder::with([("STUDY.toml", &text.replacen(from, to, 1))]);
        let run = folder.flexcal("study .").code(2);
        assert_contains(&run.stderr, &[expected]);
        assert!(!folder.has("out"));
    }
    let file = path(FILE);
    for arguments in ["--shard 1/2", "merge"] {
        let run = Folder::new().flexcal(&format!("study {arguments} {} --out out", file.display()));
        assert_contains(&run.code(2).stderr, &["runs in one piece"]);
    }
}

/// Takes minutes without optimisation: `cargo test --release --test study -- --ignored the_page`.
#[test]
#[ignore = "half a minute in a release build"]
fn the_page_on_the_paper_shows_what_the_study_prints() {
    let folder = Folder::new();
    let out = folder.path("").display().to_string();
    let printed = run(path(""), &format!("study {FILE} --out {out}")).success().stdout;
    let (printed, _) = printed.split_once("\nWritten to").unwrap();
    let page = path("docs/paper.md");
    let text = std::fs::read_to_string(&page).unwrap();
    let mark = "<!-- misprints -->\n```text\n";
    let (before, after) = text.split_once(mark).unwrap();
    let (shown, after) = after.split_once("\n```").unwrap();
    let drawn = folder.read("figures/misprints.svg");
    if std::env::var_os("FLEXCAL_REFILL").is_some() {
        std::fs::write(&page, format!("{before}{mark}{}\n```{after}", printed.trim_end())).unwrap();
        std::fs::write(path("docs/misprints.svg"), &drawn).unwrap();
        return;
    }
    assert_eq!(shown, printed.trim_end(), "FLEXCAL_REFILL=1 fills it anew");
    let shapes = |svg: &str| svg.replace(|c: char| c.is_ascii_digit() || c == '.', "");
    let kept = std::fs::read_to_string(path("docs/misprints.svg")).unwrap();
    assert_eq!(shapes(&kept), shapes(&drawn), "FLEXCAL_REFILL=1 draws it anew");
}
