//! Runs of many cases.

use std::collections::BTreeMap;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use super::case::Case;
use super::fitted::{Fitted, write};
use super::sight::Sight;
use super::{checks, commands, elastic, exports, mistakes, noise, program, repeats};

/// Every so manieth case is fitted again, with other threads and in another order.
const REPEAT_EACH: u64 = 8;
/// Every so manieth case is given to the program too.
const PROGRAM_EACH: u64 = 20;
/// Every so manieth case is spoilt by a mistake.
const MISTAKE_EACH: u64 = 5;

/// One in so many cases has elastic links.
const ELASTIC_EACH: u64 = 12;

/// Judges case `k` in a folder of its own; returns how trusted the fit is, or the disagreement.
fn judged(k: u64, folder: &Path) -> Result<&'static str, String> {
    if k % ELASTIC_EACH == ELASTIC_EACH - 1 {
        return elastic::judged(k, folder);
    }
    let case = Case::new(k);
    let path = write(folder, &case.problem, &case.table);
    let fit = match Fitted::new(&path) {
        Ok(fit) => fit,
        Err(error) => return Err(format!("no fit: {error}")),
    };
    let ranks: Vec<usize> = case.rows.iter().map(|row| row.sight.rank()).collect();
    checks::rows_are_read(&case, &fit)?;
    checks::numbers_are_finite(&fit)?;
    checks::summaries_are_of_residuals(&ranks, &fit)?;
    let world = checks::identified(&case, &fit)?;
    checks::kinematics_agree(&case, &fit, &world)?;
    checks::prediction_repeats_the_fit(&ranks, &fit)?;
    checks::exact_data_are_met(&case, &fit)?;
    if !case.is_tree {
        exports::exports_agree(&case, &fit, &world)?;
    }
    let has_positions = case.rows.iter().all(|row| row.sight == Sight::Position);
    if has_positions {
        commands::commands_reach(&case, &fit, &world)?;
    }
    noise::noise_is_left(&case, &fit)?;
    if k.is_multiple_of(REPEAT_EACH) {
        repeats::threads_change_nothing(&fit)?;
        repeats::order_changes_nothing(k, &case, &fit, folder)?;
    }
    if has_positions && k.is_multiple_of(PROGRAM_EACH) {
        write(folder, &case.problem, &case.table);
        program::files_agree(&fit, folder)?;
    }
    if k.is_multiple_of(MISTAKE_EACH) {
        mistakes::mistakes_are_told(k, &case, folder)?;
    }
    Ok(if fit.found.is_trusted() { "trusted" } else { "not trusted" })
}

/// Runs `count` cases from `from` on, and keeps the files of those that disagree.
fn run(from: u64, count: u64) {
    let folder = tempfile::tempdir().unwrap();
    let mut tally: BTreeMap<&'static str, u64> = BTreeMap::new();
    let mut disagreements = Vec::new();
    let clock = Instant::now();
    let mut slowest = (Duration::ZERO, from);
    for k in from..from + count {
        let start = Instant::now();
        let judged = catch_unwind(AssertUnwindSafe(|| judged(k, folder.path())));
        slowest = slowest.max((start.elapsed(), k));
        match judged.unwrap_or_else(|_| Err("panics".to_owned())) {
            Ok(word) => *tally.entry(word).or_default() += 1,
            Err(words) => {
                let kept = std::env::temp_dir().join(format!("flexcal-case-{k}"));
                fs::create_dir_all(&kept).unwrap();
                for name in ["problem.toml", "rows.csv"] {
                    let _ = fs::copy(folder.path().join(name), kept.join(name));
                }
                let words = format!("case {k}: {words}\nkept in {}", kept.display());
                eprintln!("{words}");
                disagreements.push(words);
            }
        }
        let done = k - from + 1;
        if done.is_multiple_of(1000) {
            eprintln!(
                "{done} of {count} in {:.0?}: {tally:?}, {} disagree",
                clock.elapsed(),
                disagreements.len()
            );
        }
    }
    println!(
        "{count} cases from {from}: {tally:?}, {} disagree; {:.1?}, slowest {:.2?} (case {})",
        disagreements.len(),
        clock.elapsed(),
        slowest.0,
        slowest.1
    );
    assert!(
        disagreements.is_empty(),
        "{} of {count} cases, the first:\n{}",
        disagreements.len(),
        disagreements[0]
    );
}

#[test]
fn a_few_cases_agree() {
    run(0, 60);
}

#[test]
#[ignore = "takes from minutes to hours; FLEXCAL_STRUCTURED says how many cases, FLEXCAL_STRUCTURED_FROM from which on"]
fn many_cases_agree() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
    run(
        number("FLEXCAL_STRUCTURED_FROM").unwrap_or(0),
        number("FLEXCAL_STRUCTURED").unwrap_or(1000),
    );
}
