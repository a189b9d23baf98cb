//! docs/tutorial.md, lived through: its files written, its commands run, every line that it shows compared.
//!
//! `FLEXCAL_REFILL=1 cargo test --test tutorial` writes what is printed into the page instead.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use std::env;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

/// A block between fences: what stands behind the opening one, and its lines.
struct Block<'a> {
    info: &'a str,
    lines: Vec<&'a str>,
}

/// Text of the page around and within its blocks.
enum Part<'a> {
    Text(&'a str),
    Block(Block<'a>),
}

fn parts(page: &str) -> Vec<Part<'_>> {
    let (mut parts, mut open): (Vec<Part>, Option<Block>) = (Vec::new(), None);
    for line in page.lines() {
        let fence = line.strip_prefix("```");
        assert!(fence.is_none_or(str::is_empty) || open.is_none(), "a fence within a fence: {line}");
        match (fence, open.take()) {
            (Some(""), Some(block)) => parts.push(Part::Block(block)),
            (Some(info), None) => open = Some(Block { info, lines: Vec::new() }),
            (None, Some(mut block)) => {
                block.lines.push(line);
                open = Some(block);
            }
            _ => parts.push(Part::Text(line)),
        }
    }
    assert!(open.is_none(), "the last fence is open");
    parts
}

/// Arguments of a command, quotes kept together.
fn words(command: &str) -> Vec<String> {
    let quoted = command.split('"').enumerate();
    quoted
        .flat_map(|(k, part)| match k % 2 {
            0 => part.split_whitespace().map(str::to_owned).collect::<Vec<_>>(),
            _ => vec![part.to_owned()],
        })
        .collect()
}

/// What a command prints in a folder.
fn printed(command: &str, folder: &Path) -> String {
    let words = words(command);
    let (program, arguments) = words.split_first().unwrap();
    if program == "cat" {
        return fs::read_to_string(folder.join(&arguments[0])).unwrap();
    }
    assert_eq!(program, "flexcal");
    let output =
        Command::new(assert_cmd::cargo::cargo_bin!("flexcal")).args(arguments).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The lines of `text` that a block shows: all, or ranges counted from 1, `…` between them.
fn chosen(text: &str, ranges: &str) -> Vec<String> {
    let lines: Vec<&str> = text.trim_end().lines().collect();
    if ranges.is_empty() {
        return lines.into_iter().map(str::to_owned).collect();
    }
    let (mut shown, mut next) = (Vec::new(), 1);
    for range in ranges.split_whitespace() {
        let (from, to) = range.split_once('-').unwrap();
        let (from, to): (usize, usize) = (from.parse().unwrap(), to.parse().unwrap());
        assert!(from >= next && from <= to && to <= lines.len(), "{range} of {} lines", lines.len());
        if from > next {
            shown.push("…".to_owned());
        }
        shown.extend(lines[from - 1..to].iter().map(|line| (*line).to_owned()));
        next = to + 1;
    }
    if next <= lines.len() {
        shown.push("…".to_owned());
    }
    shown
}

/// A line without the time that a fit took.
fn timeless(line: &str) -> &str {
    match line.rsplit_once(" steps, ") {
        Some((before, time)) if time.ends_with(" s") => before,
        _ => line,
    }
}

#[test]
fn the_tutorial_shows_what_happens() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/tutorial.md");
    let page = fs::read_to_string(&path).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (mut filled, mut commands) = (String::new(), 0);
    for part in parts(&page) {
        let block = match part {
            Part::Text(line) => {
                writeln!(filled, "{line}").unwrap();
                continue;
            }
            Part::Block(block) => block,
        };
        let (kind, rest) = block.info.split_once(' ').unwrap_or((block.info, ""));
        let mut lines: Vec<String> = block.lines.iter().map(|line| (*line).to_owned()).collect();
        if kind == "console" {
            let command = block.lines[0].strip_prefix("$ ").unwrap();
            let shown = chosen(&printed(command, folder.path()), rest);
            if env::var_os("FLEXCAL_REFILL").is_none() {
                let (page, now) =
                    (lines[1..].iter().map(|line| timeless(line)), shown.iter().map(|line| timeless(line)));
                assert_eq!(page.collect::<Vec<_>>(), now.collect::<Vec<_>>(), "{command}");
            }
            lines.truncate(1);
            lines.extend(shown);
            commands += 1;
        } else {
            let file = folder.path().join(rest);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, lines.join("\n") + "\n").unwrap();
        }
        writeln!(filled, "```{}\n{}\n```", block.info, lines.join("\n")).unwrap();
    }
    assert!(commands >= 10);
    if env::var_os("FLEXCAL_REFILL").is_some() {
        fs::write(&path, filled).unwrap();
    }
}

#[test]
fn what_is_left_out_is_marked() {
    assert_eq!(chosen("a\nb\nc\nd\ne\n", "1-2 4-4"), ["a", "b", "…", "d", "…"]);
    assert_eq!(chosen("a\nb\n", ""), ["a", "b"]);
    assert_eq!(words("plan a --separate \"x = { y = 1 }\" z"), ["plan", "a", "--separate", "x = { y = 1 }", "z"]);
    assert_eq!(timeless("converged: nothing falls after 6 steps, 0.119 s"), "converged: nothing falls after 6");
}
