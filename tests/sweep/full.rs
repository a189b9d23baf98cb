//! The whole sweep: `cargo test --release --test sweep -- --ignored --nocapture`.

use std::env;

use rayon::prelude::*;

use crate::bench::{LARGE, SMALL, Size};
use crate::families::{Lacking, catalogue, pairs, triples};
use crate::judged::{Judged, name};
use crate::outside::{KINDS, Left};

/// Sets of each kind, unless `FLEXCAL_SWEEP` names another number.
fn sets(otherwise: u64) -> u64 {
    env::var("FLEXCAL_SWEEP").ok().and_then(|number| number.parse().ok()).unwrap_or(otherwise)
}

fn run(kinds: &[Vec<Lacking>], size: Size, seeds: std::ops::Range<u64>) {
    let all: Vec<(&Vec<Lacking>, u64)> =
        kinds.iter().flat_map(|kind| seeds.clone().map(move |seed| (kind, seed))).collect();
    let one = |(lacking, seed): (&Vec<Lacking>, u64)| {
        println!("{}", Judged::of(lacking, size, seed).line(&name(lacking), size, seed));
    };
    all.into_par_iter().for_each(one);
}

#[test]
#[ignore = "minutes"]
fn noise_alone_in_few_poses() {
    run(&[Vec::new()], SMALL, 1000..1000 + sets(200));
}

#[test]
#[ignore = "minutes"]
fn noise_alone_in_many_poses() {
    run(&[Vec::new()], LARGE, 2000..2000 + sets(30));
}

#[test]
#[ignore = "minutes"]
fn one_effect_in_few_poses() {
    run(&catalogue().into_iter().map(|one| vec![one]).collect::<Vec<_>>(), SMALL, 0..sets(4));
}

#[test]
#[ignore = "minutes"]
fn one_effect_in_many_poses() {
    run(&catalogue().into_iter().map(|one| vec![one]).collect::<Vec<_>>(), LARGE, 100..100 + sets(2));
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
        let all: Vec<_> =
            KINDS.iter().flat_map(|kind| (first..first + sets(4)).map(move |seed| (*kind, seed))).collect();
        all.into_par_iter().for_each(|(kind, seed)| println!("{}", Left::of(kind, size, seed).line(kind, size, seed)));
    }
}
