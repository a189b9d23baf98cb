//! Coverage-guided fuzzing of one reader, named by the environment variable `FLEXCAL_READER`.

#![no_main]

use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;

#[path = "../../arms.rs"]
mod arms;
#[path = "../../readers.rs"]
mod readers;

use readers::{Bench, TARGETS, Target, accepts};

/// Returns the reader and its folder of files.
fn bench() -> &'static (Target, Bench) {
    static BENCH: OnceLock<(Target, Bench)> = OnceLock::new();
    BENCH.get_or_init(|| {
        let name = std::env::var("FLEXCAL_READER").unwrap_or_default();
        let names = TARGETS.map(|(name, _)| name);
        let Some(target) = TARGETS.into_iter().find(|target| target.0 == name) else {
            eprintln!("FLEXCAL_READER must be one of {}", names.join(", "));
            std::process::exit(2)
        };
        (target, Bench::new())
    })
}

fuzz_target!(
    init: {
        bench();
    },
    |text: &[u8]| {
        let (target, bench) = bench();
        accepts(*target, text, bench);
    }
);
