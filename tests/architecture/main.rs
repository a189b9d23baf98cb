//! Rules of the source, read from its text: allowed uses between modules, no circles, where
//! printing is allowed, and the length of files.

#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test that fails may panic")]

mod circles;
mod source;

use circles::circles;
use source::{Source, sources};

/// Number of lines above which a test fails.
const LONGEST: usize = 500;

/// Modules of input data and their parts.
const GROUND: &[&str] =
    &["scalar", "spatial", "quantity", "error", "observation", "laws", "problem", "measurement"];

/// Top-level modules from the bottom up, each with the modules that it may use.
const STOREYS: &[(&str, &[&[&str]])] = &[
    ("words", &[]),
    ("scalar", &[]),
    ("quantity", &[]),
    ("spatial", &[&["scalar"]]),
    ("error", &[]),
    // Kinds of rows, each with its prediction.
    ("observation", &[&["scalar", "quantity", "spatial"]]),
    // Atomic file output with size limits, and tables.
    ("files", &[]),
    // Small numerical methods: medians, bisection, random numbers.
    ("numeric", &[]),
    ("random", &[]),
    // Laws are data: formulas and the catalogue of effects.
    ("laws", &[&["scalar", "error"]]),
    ("problem", &[&["quantity", "error", "spatial", "observation", "files", "laws"]]),
    ("measurement", &[&["quantity", "error", "observation", "problem", "files"]]),
    // Least squares is independent of robots.
    ("least_squares", &[&["scalar", "error", "numeric"]]),
    // Mechanics is independent of sensors; the test rig shares no mechanics.
    ("mechanics", &[&["scalar", "spatial", "error", "problem"]]),
    // The rig reads the columns of kinds of rows, not their predictions, and the formulas of laws,
    // not their regressors.
    (
        "rig",
        &[&[
            "scalar",
            "spatial",
            "quantity",
            "error",
            "observation",
            "laws",
            "problem",
            "files",
            "random",
        ]],
    ),
    (
        "model",
        &[&[
            "scalar",
            "spatial",
            "quantity",
            "error",
            "observation",
            "laws",
            "problem",
            "mechanics",
            "least_squares",
            "numeric",
        ]],
    ),
    // The paper is a check of the model, so it shares no mechanics with it.
    ("paper", &[&["spatial", "error", "problem", "least_squares"]]),
    ("fit", &[GROUND, BELOW_FIT, &["files"]]),
    // Corrections of an identified arm know fits, and no search for effects.
    ("remainder", &[GROUND, BELOW_FIT, &["fit", "files"]]),
    // Earlier estimates as priors with their remainders, and changes since.
    ("life", &[GROUND, BELOW_FIT, &["fit", "remainder", "files"]]),
    // Statistical tests of a residual are independent of arms and fits.
    ("residual_tests", &[&["error", "laws", "problem", "model", "numeric"]]),
    // The search for effects, which gives way to a remainder where no law is sure.
    ("select", &[GROUND, BELOW_FIT, &["fit", "remainder", "residual_tests"]]),
    // Import and export of URDF.
    (
        "urdf",
        &[&[
            "quantity",
            "spatial",
            "error",
            "problem",
            "mechanics",
            "model",
            "least_squares",
            "random",
        ]],
    ),
    // Choice of poses, and forecasts of their measurement, with the uncertainty of predictions and
    // the explanations that a loop left open, which it reads.
    ("design", &[GROUND, BELOW_FIT, &["fit", "remainder", "select", "files"]]),
    // Identified models as code, with the corrections of their remainders, and rigid tables.
    ("export", &[GROUND, BELOW_FIT, &["fit", "remainder", "urdf", "design"]]),
    // Monte Carlo studies with data from the model or the rig.
    ("study", &[GROUND, BELOW_FIT, &["fit", "rig", "files"]]),
    // Results as data, which reports turn into text and figures.
    (
        "results",
        &[
            GROUND,
            BELOW_FIT,
            &[
                "fit",
                "remainder",
                "life",
                "residual_tests",
                "select",
                "design",
                "study",
                "rig",
                "files",
                "urdf",
            ],
        ],
    ),
    (
        "report",
        &[
            GROUND,
            BELOW_FIT,
            &[
                "fit",
                "remainder",
                "life",
                "residual_tests",
                "select",
                "design",
                "study",
                "files",
                "urdf",
                "results",
            ],
        ],
    ),
    (
        "cli",
        &[
            GROUND,
            BELOW_FIT,
            &[
                "fit",
                "remainder",
                "life",
                "export",
                "residual_tests",
                "select",
                "design",
                "study",
                "results",
                "report",
                "rig",
                "files",
                "urdf",
            ],
        ],
    ),
    ("main", &[&["cli"]]),
];
const BELOW_FIT: &[&str] = &["mechanics", "model", "paper", "least_squares", "numeric", "random"];

/// Modules that read no files.
const WITHOUT_FILES: &[&str] = &[
    "scalar",
    "spatial",
    "quantity",
    "observation",
    "laws",
    "least_squares",
    "mechanics",
    "model",
];
const FILES: &[&str] = &["std::fs", "std::path", "std::io", "csv::", "toml::", "serde_json::"];

/// Modules that print.
const PRINTING: &[&str] = &["cli", "main"];
const PRINTS: &[&str] =
    &["println!", "eprintln!", "print!", "eprint!", "dbg!", "io::stdout", "io::stderr"];

/// Returns the uses of modules that are not below.
fn upward(source: &Source) -> Vec<String> {
    let room = source.room();
    if room == "lib" {
        return Vec::new();
    }
    let Some((_, below)) = STOREYS.iter().find(|(name, _)| *name == room) else {
        return vec![
            source.at(1, &format!("{room} has no storey; give it one in tests/architecture")),
        ];
    };
    let is_room = |name: &str| STOREYS.iter().any(|(room, _)| *room == name);
    let allowed = |name: &str| name == room || below.iter().any(|rooms| rooms.contains(&name));
    let heads = source.uses.iter().filter_map(|(line, path)| Some((*line, path.first()?.as_str())));
    let mut broken: Vec<String> = heads
        .filter(|(_, name)| is_room(name) && !allowed(name))
        .map(|(line, name)| source.at(line, &format!("{room} uses {name}")))
        .collect();
    broken.dedup();
    broken
}

/// Returns the lines of a module that contain one of `words`.
fn holding(source: &Source, words: &[&str]) -> Vec<String> {
    let found = source.code().filter_map(|(line, code)| {
        let word = words.iter().find(|word| {
            let names = |at: usize| code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
            code.match_indices(**word).any(|(at, _)| !names(at))
        })?;
        Some(source.at(line, &format!("{} has {word}", source.room())))
    });
    found.collect()
}

fn forbid(broken: impl Iterator<Item = String>) {
    let broken: Vec<String> = broken.collect();
    assert!(broken.is_empty(), "\n{}", broken.join("\n"));
}

#[test]
fn each_storey_uses_those_below() {
    let sources = sources();
    assert!(sources.iter().map(|source| source.uses.len()).sum::<usize>() > 50, "uses are found");
    forbid(sources.iter().flat_map(upward));
}

#[test]
fn physics_and_least_squares_read_no_files() {
    let sources = sources();
    let rooms = sources.iter().filter(|source| WITHOUT_FILES.contains(&source.room()));
    forbid(rooms.flat_map(|source| holding(source, FILES)));
}

#[test]
fn only_the_command_line_prints() {
    let sources = sources();
    let silent = sources.iter().filter(|source| !PRINTING.contains(&source.room()));
    forbid(silent.flat_map(|source| holding(source, PRINTS)));
}

#[test]
fn files_are_short() {
    let sources = sources();
    let long = sources.iter().filter(|source| source.text.lines().count() > LONGEST);
    forbid(long.map(|source| source.at(LONGEST + 1, "the file ends too late")));
}

#[test]
fn no_files_use_each_other_in_a_circle() {
    forbid(circles(&sources()).into_iter());
}

#[test]
fn every_file_is_a_module_of_its_folder() {
    let sources = sources();
    forbid(sources.iter().filter_map(|source| {
        let (name, folder) = source.module.split_last()?;
        let declares = |other: &&Source| {
            let above = if folder.is_empty() {
                ["lib", "main"].contains(&other.room())
            } else {
                other.module == folder
            };
            above && other.children.contains(name)
        };
        let is_top = folder.is_empty() && name == "main";
        (!is_top && !sources.iter().any(|other| declares(&other)))
            .then(|| source.at(1, "no module declares it"))
    }));
}

#[test]
fn circles_are_found() {
    let sources = [
        Source::new("a/mod.rs", "mod b;\nmod c;\npub use b::B;\npub struct A;\n"),
        Source::new("a/b.rs", "use super::c;\npub struct B;\nfn f() { c::g(); }\n"),
        Source::new(
            "a/c.rs",
            "pub fn g() -> crate::a::B {}\n#[cfg(test)]\nmod tests { use super::super::d; }\n",
        ),
        Source::new("a/d.rs", "use super::{A, B};\n"),
    ];
    assert_eq!(circles(&sources), ["a/b.rs uses a/c.rs\n  a/c.rs uses a/b.rs"]);
    // A definition in the file of a module is no use of the module's other files.
    assert_eq!(circles(&sources[2..]), [] as [&str; 0]);
}

#[test]
fn broken_rules_are_found_with_their_lines() {
    let source = Source::new;
    let text = "//! use crate::fit;\nuse crate::{\n    error::X,\n    mechanics::{Arm, model},\n};\nuse super::super::super::fit::Y;\n\
                fn f() { crate::report::g(); } // crate::cli\n";
    let broken = upward(&source("least_squares/solver/bounded.rs", text));
    let expected = [
        "src/least_squares/solver/bounded.rs:4: least_squares uses mechanics",
        "src/least_squares/solver/bounded.rs:6: least_squares uses fit",
        "src/least_squares/solver/bounded.rs:7: least_squares uses report",
    ];
    assert_eq!(broken, expected);
    assert_eq!(
        upward(&source("mechanics/mod.rs", "use super::measurement;\n")),
        ["src/mechanics/mod.rs:1: mechanics uses measurement"]
    );
    assert_eq!(upward(&source("cli/loop.rs", text)), [] as [&str; 0]);
    assert_eq!(upward(&source("attic.rs", "")).len(), 1);
    let printing = source("fit/mod.rs", "fn f() {\n    eprintln!(\"x\");\n    sprint!();\n}\n");
    assert_eq!(holding(&printing, PRINTS), ["src/fit/mod.rs:2: fit has eprintln!"]);
    let reading = source("mechanics/mod.rs", "use std::fs;\n");
    assert_eq!(holding(&reading, FILES), ["src/mechanics/mod.rs:1: mechanics has std::fs"]);
}
