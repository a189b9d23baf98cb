//! Files changed at random: no input makes the reader panic.

use std::fs;
use std::path::Path;

use flexcal::measurement::{Measurements, Split};
use flexcal::problem::Problem;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use super::reading::{CASES, check};

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
