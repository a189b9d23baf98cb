//! The program on mutated inputs: exit status, time, memory, JSON, finite numbers, no output after
//! bad input, and the same results for any number of threads.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use flexcal::error::is_hidden;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use super::arms::{Texts, texts};
use super::mutation::mutated;
use super::run::{LONGEST, Ran, files, flexcal};

/// Commands with the files that each reads; the first file is mutated most often.
const COMMANDS: [(&str, &[&str]); 18] = [
    ("identify .", &["problem.toml", "rows.csv"]),
    ("identify . --strategy sequential", &["problem.toml", "rows.csv"]),
    ("identify . --strategy stiffness-only --solver bounded", &["problem.toml", "rows.csv"]),
    ("identify . --strategy rigid", &["problem.toml", "rows.csv"]),
    ("identify . --solver gauss-newton", &["rows.csv", "problem.toml"]),
    ("identify . --solver pseudo-inverse", &["rows.csv", "problem.toml"]),
    ("trace .", &["rows.csv", "problem.toml"]),
    ("loop .", &["rows.csv", "problem.toml"]),
    ("compare . --paper", &["rows.csv", "problem.toml"]),
    (
        "compensate . --estimate estimate.json --data targets.csv",
        &["targets.csv", "estimate.json", "problem.toml"],
    ),
    ("compensate . --estimate estimate.json --data targets.csv", &["estimate.json", "targets.csv"]),
    (
        "predict . --estimate estimate.json --data rows.csv",
        &["rows.csv", "estimate.json", "problem.toml"],
    ),
    ("check .", &["rows.csv", "problem.toml"]),
    ("check . --truth TRUTH.toml --poses 12", &["TRUTH.toml", "problem.toml"]),
    ("plan . --truth TRUTH.toml --poses 8", &["problem.toml", "TRUTH.toml"]),
    ("plan . --candidates rows.csv --poses 6 --criterion D", &["rows.csv", "problem.toml"]),
    ("simulate . --truth TRUTH.toml --poses 12 --seed 3", &["TRUTH.toml", "problem.toml"]),
    ("study .", &["STUDY.toml", "problem.toml", "TRUTH.toml"]),
];

/// Both arms with the files that commands make of them.
struct Arms([Texts; 2]);

impl Arms {
    fn new(folder: &Path) -> Self {
        Self([false, true].map(|elastic| {
            let mut texts = texts(elastic);
            let place = folder.join(if elastic { "elastic" } else { "rigid" });
            fs::create_dir(&place).unwrap();
            write(&place, &texts);
            let run = |arguments: &str| {
                let ran = flexcal(&place, &arguments.split(' ').collect::<Vec<_>>(), 2);
                assert_eq!(ran.status, Some(0), "{arguments}: {}{}", ran.out, ran.err);
            };
            run("simulate . --truth TRUTH.toml --poses 40 --seed 1 --out made");
            fs::copy(place.join("made/measurements.csv"), place.join("rows.csv")).unwrap();
            run("identify . --out fitted");
            texts.push(("rows.csv", fs::read(place.join("rows.csv")).unwrap()));
            texts.push(("estimate.json", fs::read(place.join("fitted/estimate.json")).unwrap()));
            texts
        }))
    }
}

fn write(folder: &Path, texts: &Texts) {
    for (name, text) in texts {
        fs::write(folder.join(name), text).unwrap();
    }
}

/// Runs a command on input k and returns its status and time, or a description of the failure.
fn tried(k: u64, arms: &Arms, place: &Path) -> Result<(i32, Duration), String> {
    let mut random = ChaCha8Rng::seed_from_u64(k);
    let (command, reads) = COMMANDS[random.random_range(0..COMMANDS.len())];
    let mut texts = arms.0[random.random_range(0..2)].clone();
    let which = if random.random::<f64>() < 0.6 { 0 } else { random.random_range(0..reads.len()) };
    for (name, text) in &mut texts {
        if *name == reads[which] || random.random::<f64>() < 0.05 {
            *text = mutated(text, &mut random);
        }
    }
    let _ = fs::remove_dir_all(place);
    fs::create_dir(place).unwrap();
    write(place, &texts);
    let json = random.random::<bool>();
    let mut arguments: Vec<&str> = command.split(' ').chain(["--out", "out"]).collect();
    if json {
        arguments.push("--json");
    }
    let ran = flexcal(place, &arguments, 2);
    let said = |what: &str| {
        format!(
            "input {k}: flexcal {}: {what}\n{:.600}\n{:.600}",
            arguments.join(" "),
            ran.err,
            ran.out
        )
    };
    let status = match ran.status {
        Some(status @ 0..=2) => status,
        None => {
            return Err(said(&format!(
                "is ended from outside: more than {LONGEST} s of the processors, or aborted"
            )));
        }
        Some(other) => return Err(said(&format!("exit status {other}"))),
    };
    if ran.err.contains("panicked") {
        return Err(said("panics"));
    }
    let written: Vec<PathBuf> = files(&place.join("out"))
        .into_iter()
        .filter(|path| !path.parent().is_some_and(|folder| folder.ends_with("cells")))
        .collect();
    if status == 2 && !written.is_empty() {
        return Err(said("writes on bad input"));
    }
    if json && status < 2 && serde_json::from_str::<Value>(&ran.out).is_err() {
        return Err(said("prints no JSON"));
    }
    if let Some(word) = not_finite(&ran.out).or_else(|| not_finite(&ran.err)) {
        return Err(said(&format!("prints {word}")));
    }
    if [&ran.out, &ran.err]
        .into_iter()
        .any(|text| text.chars().any(|letter| letter != '\n' && is_hidden(letter)))
    {
        return Err(said("prints what is not seen"));
    }
    for path in &written {
        let text = fs::read_to_string(path)
            .map_err(|error| said(&format!("{}: {error}", path.display())))?;
        if let Some(word) = not_finite(&text) {
            return Err(said(&format!("writes {word} to {}", path.display())));
        }
        if path.extension().is_some_and(|extension| extension == "json")
            && serde_json::from_str::<Value>(&text).is_err()
        {
            return Err(said(&format!("writes no JSON to {}", path.display())));
        }
    }
    if json && status < 2 && random.random::<f64>() < 0.1 {
        let again = flexcal(place, &[&arguments[..], &["--force"]].concat(), 1);
        if again.status != Some(status) || timeless(&again) != timeless(&ran) {
            return Err(said("does something else with one thread"));
        }
    }
    Ok((status, ran.time))
}

/// Returns the printed output without durations.
fn timeless(ran: &Ran) -> Value {
    fn without(value: &mut Value) {
        match value {
            Value::Object(map) => {
                map.remove("seconds");
                map.values_mut().for_each(without);
            }
            Value::Array(all) => all.iter_mut().for_each(without),
            _ => {}
        }
    }
    let mut value = serde_json::from_str(&ran.out).unwrap_or_default();
    without(&mut value);
    value
}

/// Returns a word for a number that is not finite, as Rust writes it; inputs contain none.
fn not_finite(text: &str) -> Option<&'static str> {
    let is_word = |word: &str| {
        text.match_indices(word).any(|(place, _)| {
            // Quoted words are alternatives that a reader would accept.
            let letter = |c: char| c.is_alphanumeric() || "_`\"".contains(c);
            !text[..place].ends_with(letter) && !text[place + word.len()..].starts_with(letter)
        })
    };
    ["NaN", "inf"].into_iter().find(|word| is_word(word))
}

/// Runs `count` inputs from `from` on in parallel, reports the results, and keeps failed inputs.
fn run(from: u64, count: u64) {
    let folder = tempfile::tempdir().unwrap();
    let arms = Arms::new(folder.path());
    let next = AtomicU64::new(from);
    let tally: Mutex<(BTreeMap<i32, u64>, Duration, Vec<String>)> = Mutex::default();
    let work = |worker: usize| {
        let place = folder.path().join(format!("worker-{worker}"));
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            if k >= from + count {
                return;
            }
            let outcome = tried(k, &arms, &place);
            let mut tally = tally.lock().unwrap();
            match outcome {
                Ok((status, time)) => {
                    *tally.0.entry(status).or_default() += 1;
                    tally.1 = tally.1.max(time);
                }
                Err(what) => {
                    let kept = std::env::temp_dir().join(format!("flexcal-input-{k}"));
                    let _ = fs::remove_dir_all(&kept);
                    let what = match fs::rename(&place, &kept) {
                        Ok(()) => format!("{what}\nkept in {}", kept.display()),
                        Err(_) => what,
                    };
                    eprintln!("{what}\n");
                    tally.2.push(what);
                }
            }
            let done: u64 = tally.0.values().sum::<u64>() + tally.2.len() as u64;
            if done.is_multiple_of(1000) {
                eprintln!(
                    "{done} of {count}: {:?}, slowest {:.1?}, failed {}",
                    tally.0,
                    tally.1,
                    tally.2.len()
                );
            }
        }
    };
    let workers = std::thread::available_parallelism().map_or(2, usize::from).min(8);
    std::thread::scope(|scope| {
        for worker in 0..workers {
            let work = &work;
            scope.spawn(move || work(worker));
        }
    });
    let (statuses, slowest, failed) = tally.into_inner().unwrap();
    println!(
        "{count} inputs from {from}: by exit status {statuses:?}, slowest {slowest:.1?}, failed {}",
        failed.len()
    );
    assert!(
        failed.is_empty(),
        "{} of {count} inputs failed, the first:\n{}",
        failed.len(),
        failed[0]
    );
    assert!(statuses.len() == 3, "mutations that say something: {statuses:?}");
}

#[test]
fn commands_stand_a_few_mutated_inputs() {
    run(0, 120);
}

#[test]
#[ignore = "takes from minutes to hours; FLEXCAL_MUTATIONS says how many inputs, FLEXCAL_MUTATIONS_FROM from which on"]
fn commands_stand_many_mutated_inputs() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
    run(
        number("FLEXCAL_MUTATIONS_FROM").unwrap_or(0),
        number("FLEXCAL_MUTATIONS").unwrap_or(50_000),
    );
}
