//! Complete sweep: `cargo test --release --test sweep -- --ignored --nocapture`.

use std::env;
use std::ops::Range;

use flexcal::select::Verdict;
use rayon::prelude::*;

use crate::bench::{LARGE, SMALL, Size};
use crate::families::{Lacking, catalogue, pairs, triples};
use crate::judged::{LoopVerdict, name};
use crate::outside::{KINDS, Left};

/// Returns the number of sets of each kind, from `FLEXCAL_SWEEP` if given.
pub fn sets(otherwise: u64) -> u64 {
    env::var("FLEXCAL_SWEEP").ok().and_then(|number| number.parse().ok()).unwrap_or(otherwise)
}

/// Returns the first seed, from `FLEXCAL_FIRST` if given.
pub fn first(otherwise: u64) -> u64 {
    env::var("FLEXCAL_FIRST").map_or(otherwise, |seed| seed.parse().unwrap())
}

/// Returns the seeds of the sets, from `from` on.
fn seeds(from: u64, otherwise: u64) -> Range<u64> {
    let from = first(from);
    from..from + sets(otherwise)
}

/// Asserts that most distinguishable effects are named, nearly all named or listed as alternatives,
/// and that noise gives hardly any finding.
fn run(kinds: &[Vec<Lacking>], size: Size, seeds: Range<u64>) {
    let all: Vec<(&Vec<Lacking>, u64)> =
        kinds.iter().flat_map(|kind| seeds.clone().map(move |seed| (kind, seed))).collect();
    let one = |(lacking, seed): (&Vec<Lacking>, u64)| {
        let judged = LoopVerdict::of(lacking, size, seed);
        println!("{}", judged.line(&name(lacking), size, seed));
        let [shown, named, stated] = judged.counts();
        [
            shown,
            named,
            stated,
            usize::from(lacking.is_empty() && judged.closure.verdict != Verdict::NothingFound),
        ]
    };
    let sets = all.len();
    let add = |a: [usize; 4], b: [usize; 4]| [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]];
    let [shown, named, stated, wrong] = all.into_par_iter().map(one).reduce(|| [0; 4], add);
    assert!(10 * named >= 8 * shown && 10 * stated >= 9 * shown, "{named} and {stated} of {shown}");
    // At a rate of 5 %, more than a tenth of 200 occurs once in 1000 times.
    assert!(wrong <= sets.div_ceil(10), "{wrong} of {sets}");
}

#[test]
#[ignore = "minutes"]
fn noise_alone_in_few_poses() {
    run(&[Vec::new()], SMALL, seeds(1000, 200));
}

#[test]
#[ignore = "minutes"]
fn noise_alone_in_many_poses() {
    run(&[Vec::new()], LARGE, seeds(2000, 30));
}

#[test]
#[ignore = "minutes"]
fn one_effect_in_few_poses() {
    run(&catalogue().into_iter().map(|one| vec![one]).collect::<Vec<_>>(), SMALL, seeds(0, 4));
}

#[test]
#[ignore = "minutes"]
fn one_effect_in_many_poses() {
    run(&catalogue().into_iter().map(|one| vec![one]).collect::<Vec<_>>(), LARGE, seeds(100, 2));
}

#[test]
#[ignore = "minutes"]
fn two_effects() {
    run(&pairs(), SMALL, 300..300 + sets(4));
    run(&pairs(), LARGE, 320..320 + sets(4));
}

#[test]
#[ignore = "minutes"]
fn three_effects() {
    run(&triples(), SMALL, 340..340 + sets(4));
    run(&triples(), LARGE, 360..360 + sets(4));
}

#[test]
#[ignore = "minutes"]
fn what_no_catalogue_holds() {
    for (size, first) in [(SMALL, 400), (LARGE, 420)] {
        let all: Vec<_> = KINDS
            .iter()
            .flat_map(|kind| (first..first + sets(4)).map(move |seed| (*kind, seed)))
            .collect();
        let sets = all.len();
        let located = all.into_par_iter().filter(|&(kind, seed)| {
            let left = Left::of(kind, size, seed);
            println!("{}", left.line(kind, size, seed));
            left.located
        });
        let located = located.count();
        assert!(4 * located >= 3 * sets, "{located} of {sets}");
    }
}
