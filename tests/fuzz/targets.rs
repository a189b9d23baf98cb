//! Readers of the library on mutations of their corpus.

use std::fs;
use std::path::{Path, PathBuf};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::mutation::mutated;
use super::readers::{Bench, TARGETS, accepts};

/// Number of mutations of each corpus file in the short run.
const SHORT: u64 = 40;

/// Returns the corpus files of a reader.
fn corpus(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(name);
    let mut paths: Vec<PathBuf> =
        fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| fs::read(path).unwrap()).collect()
}

#[test]
fn readers_stand_what_they_are_given() {
    let rounds =
        std::env::var("FLEXCAL_MUTATIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(SHORT);
    let bench = Bench::new();
    for target in TARGETS {
        let (name, _) = target;
        let files = corpus(name);
        assert!(files.len() >= 3, "the corpus of {name}");
        let mut accepted = 0;
        for text in files {
            let mut random = ChaCha8Rng::seed_from_u64(text.len() as u64);
            for round in 0..=rounds {
                let text = if round == 0 { text.clone() } else { mutated(&text, &mut random) };
                accepted += u64::from(accepts(target, &text, &bench));
            }
        }
        assert!(accepted > 0, "{name}: some are right");
    }
}
