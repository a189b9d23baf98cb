//! The rules of the house, read from the source: who may use whom, who prints, how long a file gets.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Lines from which on a file needs a reason.
const LONGEST: usize = 500;

/// What is read from files, and what it is made of.
const GROUND: &[&str] = &["scalar", "spatial", "quantity", "error", "problem", "measurement"];

/// Each room of the house and the rooms that it may use, from the ground up.
const STOREYS: &[(&str, &[&[&str]])] = &[
    ("scalar", &[]),
    ("quantity", &[]),
    ("spatial", &[&["scalar"]]),
    ("error", &[]),
    ("problem", &[&["quantity", "error", "spatial"]]),
    ("measurement", &[&["quantity", "error", "problem"]]),
    // Least squares knows no arms.
    ("least_squares", &[&["scalar", "error"]]),
    // The physics knows no sensors; the test rig shares no physics.
    ("mechanics", &[&["scalar", "spatial", "error", "problem"]]),
    ("simulate", &[&["scalar", "spatial", "quantity", "error", "problem"]]),
    ("model", &[&["scalar", "spatial", "quantity", "error", "problem", "mechanics", "least_squares"]]),
    // The paper checks the model, so it shares no physics with it.
    ("paper", &[&["spatial", "error", "problem", "least_squares"]]),
    ("identify", &[GROUND, BELOW_IDENTIFY]),
    ("diagnose", &[GROUND, BELOW_IDENTIFY, &["identify"]]),
    // Which poses to measure, and what they will tell.
    ("design", &[GROUND, BELOW_IDENTIFY, &["identify", "diagnose"]]),
    // Many fits to what model or rig measure.
    ("monte_carlo", &[GROUND, BELOW_IDENTIFY, &["identify", "simulate"]]),
    ("report", &[GROUND, BELOW_IDENTIFY, &["identify", "diagnose", "design", "monte_carlo"]]),
    ("cli", &[GROUND, BELOW_IDENTIFY, &["identify", "diagnose", "design", "monte_carlo", "report", "simulate"]]),
    (
        "main",
        &[GROUND, BELOW_IDENTIFY, &["identify", "diagnose", "design", "monte_carlo", "report", "simulate", "cli"]],
    ),
];
const BELOW_IDENTIFY: &[&str] = &["mechanics", "model", "paper", "least_squares"];

/// Rooms that read no files.
const WITHOUT_FILES: &[&str] = &["scalar", "spatial", "quantity", "least_squares", "mechanics", "model"];
const FILES: &[&str] = &["std::fs", "std::path", "std::io", "csv::", "toml::", "serde_json::"];

/// Rooms that print.
const PRINTING: &[&str] = &["cli", "main"];
const PRINTS: &[&str] = &["println!", "eprintln!", "print!", "eprint!", "dbg!", "io::stdout", "io::stderr"];

/// A source file: its path below `src` and its text.
struct Source {
    path: PathBuf,
    text: String,
}

impl Source {
    /// The module path, `["arm", "beam"]`.
    fn modules(&self) -> Vec<String> {
        let mut parts: Vec<String> =
            self.path.with_extension("").iter().map(|part| part.to_string_lossy().into_owned()).collect();
        if parts.len() > 1 && parts.last().is_some_and(|last| last == "mod") {
            parts.pop();
        }
        parts
    }

    /// The room that the file belongs to.
    fn room(&self) -> String {
        self.modules().swap_remove(0)
    }

    /// Lines without comments, counted from 1. Texts with // in them count as comments from there on.
    fn code(&self) -> impl Iterator<Item = (usize, &str)> {
        self.text.lines().enumerate().map(|(k, line)| (k + 1, line.split("//").next().unwrap_or_default()))
    }

    fn at(&self, line: usize, what: &str) -> String {
        format!("src/{}:{line}: {what}", self.path.display())
    }

    /// The rooms that the file uses, with the lines where it does.
    fn uses(&self) -> Vec<(usize, String)> {
        let depth = self.modules().len();
        let (mut text, mut starts) = (String::new(), Vec::new());
        for (number, line) in self.code() {
            starts.push((text.len(), number));
            text.push_str(line);
            text.push('\n');
        }
        let line_of = |at: usize| starts[starts.partition_point(|&(start, _)| start <= at) - 1].1;
        let root = "super::".repeat(depth);
        let mut found = Vec::new();
        for prefix in ["crate::", "flexcal::", root.as_str()] {
            for (at, _) in text.match_indices(prefix) {
                let follows_name = text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':');
                if follows_name || (prefix == root && text[at + prefix.len()..].starts_with("super::")) {
                    continue;
                }
                let rest = at + prefix.len();
                found.extend(heads(&text[rest..]).into_iter().map(|(offset, name)| (line_of(rest + offset), name)));
            }
        }
        found
    }
}

/// The first names of the paths that begin a text: one, or those of a group in braces; with their places.
fn heads(text: &str) -> Vec<(usize, String)> {
    let name = |at: usize| {
        let end = text[at..].find(|c: char| !c.is_alphanumeric() && c != '_').map_or(text.len(), |end| at + end);
        (at, text[at..end].to_owned())
    };
    if !text.starts_with('{') {
        return vec![name(0)];
    }
    let (mut depth, mut expected, mut found) = (0, false, Vec::new());
    for (at, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            break;
        }
        if depth == 1 && matches!(c, '{' | ',') {
            expected = true;
        } else if expected && !c.is_whitespace() {
            found.push(name(at));
            expected = false;
        }
    }
    found
}

/// Every file below `src`.
fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let (mut folders, mut sources) = (vec![root.clone()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = fs::read_to_string(&path).unwrap();
                sources.push(Source { path: path.strip_prefix(&root).unwrap().to_owned(), text });
            }
        }
    }
    sources.sort_by(|a, b| a.path.cmp(&b.path));
    sources
}

/// Uses of rooms that are not below.
fn upward(source: &Source) -> Vec<String> {
    let room = source.room();
    if room == "lib" {
        return Vec::new();
    }
    let Some((_, below)) = STOREYS.iter().find(|(name, _)| *name == room) else {
        return vec![source.at(1, &format!("{room} has no storey; give it one in tests/architecture.rs"))];
    };
    let is_room = |name: &str| STOREYS.iter().any(|(room, _)| *room == name);
    let allowed = |name: &str| name == room || below.iter().any(|rooms| rooms.contains(&name));
    let uses = source.uses().into_iter().filter(|(_, name)| is_room(name) && !allowed(name));
    uses.map(|(line, name)| source.at(line, &format!("{room} uses {name}"))).collect()
}

/// Lines of a room in `rooms` (or outside of them) that hold one of `words`.
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
    assert!(sources.iter().map(|source| source.uses().len()).sum::<usize>() > 50, "uses are found");
    forbid(sources.iter().flat_map(upward));
}

#[test]
fn physics_and_least_squares_read_no_files() {
    let sources = sources();
    let rooms = sources.iter().filter(|source| WITHOUT_FILES.contains(&source.room().as_str()));
    forbid(rooms.flat_map(|source| holding(source, FILES)));
}

#[test]
fn only_the_command_line_prints() {
    let sources = sources();
    let silent = sources.iter().filter(|source| !PRINTING.contains(&source.room().as_str()));
    forbid(silent.flat_map(|source| holding(source, PRINTS)));
}

#[test]
fn files_are_short() {
    let sources = sources();
    let long = sources.iter().filter(|source| source.text.lines().count() > LONGEST);
    forbid(long.map(|source| source.at(LONGEST + 1, "the file ends too late")));
}

#[test]
fn every_file_is_a_module_of_its_folder() {
    let sources = sources();
    let modules: BTreeSet<Vec<String>> = sources.iter().map(Source::modules).collect();
    let declares = |parents: &[&[String]], name: &str| {
        let declared =
            |source: &&Source| source.code().any(|(_, code)| code.trim_end().ends_with(&format!("mod {name};")));
        sources.iter().filter(|source| parents.contains(&source.modules().as_slice())).any(|source| declared(&source))
    };
    forbid(sources.iter().filter_map(|source| {
        let path = source.modules();
        let (name, folder) = path.split_last()?;
        let top = [vec!["lib".to_owned()], vec!["main".to_owned()]];
        if folder.is_empty() {
            let found = top.contains(&path) || declares(&[&top[0], &top[1]], name);
            return (!found).then(|| source.at(1, "neither lib.rs nor main.rs declares it"));
        }
        if !modules.contains(folder) {
            return Some(source.at(1, "its folder has no mod.rs"));
        }
        (!declares(&[folder], name)).then(|| source.at(1, "its folder's module does not declare it"))
    }));
}

#[test]
fn broken_rules_are_found_with_their_lines() {
    let source = |path: &str, text: &str| Source { path: PathBuf::from(path), text: text.to_owned() };
    let text = "//! use crate::identify;\nuse crate::{\n    error::X,\n    mechanics::{Arm, model},\n};\nuse super::super::super::identify::Y;\n\
                fn f() { crate::report::g(); } // crate::cli\n";
    let broken = upward(&source("least_squares/solver/bounded.rs", text));
    let expected = [
        "src/least_squares/solver/bounded.rs:4: least_squares uses mechanics",
        "src/least_squares/solver/bounded.rs:7: least_squares uses report",
        "src/least_squares/solver/bounded.rs:6: least_squares uses identify",
    ];
    assert_eq!(broken, expected);
    assert_eq!(
        upward(&source("mechanics/mod.rs", "use super::measurement;\n")),
        ["src/mechanics/mod.rs:1: mechanics uses measurement"]
    );
    assert_eq!(upward(&source("cli/loop.rs", text)), [] as [&str; 0]);
    assert_eq!(upward(&source("attic.rs", "")).len(), 1);
    let printing = source("identify/mod.rs", "fn f() {\n    eprintln!(\"x\");\n    sprint!();\n}\n");
    assert_eq!(holding(&printing, PRINTS), ["src/identify/mod.rs:2: identify has eprintln!"]);
    let reading = source("mechanics/mod.rs", "use std::fs;\n");
    assert_eq!(holding(&reading, FILES), ["src/mechanics/mod.rs:1: mechanics has std::fs"]);
}
