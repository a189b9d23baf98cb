//! Test of docs/tutorial.md, docs/laws.md, docs/life.md and docs/next.md: their files are written, their commands
//! run, and the lines they show
//! compared.
//!
//! `FLEXCAL_REFILL=1 cargo test --test tutorial` writes the printed output into the page instead.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use std::env;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use common::arms::path;
use common::program::{Folder, assert_contains, shell_words};

mod common;

/// Fenced block: the info string of its opening fence, and its lines.
struct Block<'a> {
    info: &'a str,
    lines: Vec<&'a str>,
}

/// Part of the page: text or block.
enum Part<'a> {
    Text(&'a str),
    Block(Block<'a>),
}

fn parts(page: &str) -> Vec<Part<'_>> {
    let (mut parts, mut open): (Vec<Part>, Option<Block>) = (Vec::new(), None);
    for line in page.lines() {
        let fence = line.strip_prefix("```");
        assert!(
            fence.is_none_or(str::is_empty) || open.is_none(),
            "a fence within a fence: {line}"
        );
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

/// Returns the output of a command in a folder.
fn printed(command: &str, folder: &Folder) -> String {
    let (program, arguments) = command.split_once(' ').unwrap();
    if program == "cat" {
        return folder.read(arguments);
    }
    assert_eq!(program, "flexcal");
    let run = folder.flexcal(arguments);
    // A changed arm has exit status 3.
    let run = if arguments.starts_with("watch") && run.status == 3 { run } else { run.success() };
    run.stdout
}

/// Returns the lines of `text` that a block shows: all, or ranges counted from 1 with `…` between
/// them.
fn chosen(text: &str, ranges: &str) -> Vec<String> {
    let lines: Vec<&str> = text.trim_end().lines().collect();
    if ranges.is_empty() {
        return lines.into_iter().map(str::to_owned).collect();
    }
    let (mut shown, mut next) = (Vec::new(), 1);
    for range in ranges.split_whitespace() {
        let (from, to) = range.split_once('-').unwrap();
        let (from, to): (usize, usize) = (from.parse().unwrap(), to.parse().unwrap());
        assert!(
            from >= next && from <= to && to <= lines.len(),
            "{range} of {} lines",
            lines.len()
        );
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

/// Removes the duration of a fit from a line.
fn timeless(line: &str) -> &str {
    match line.rsplit_once(" steps, ") {
        Some((before, time)) if time.ends_with(" s") => before,
        _ => line,
    }
}

#[test]
fn the_tutorial_shows_what_happens() {
    shows_what_happens("tutorial", 10);
}

#[test]
fn the_page_of_laws_shows_what_happens() {
    shows_what_happens("laws", 3);
}

#[test]
fn the_page_of_the_life_of_an_arm_shows_what_happens() {
    shows_what_happens("life", 8);
}

#[test]
fn the_page_of_next_poses_shows_what_happens() {
    shows_what_happens("next", 4);
}

/// Runs the commands of a page and compares its blocks with what they print, or refills them.
fn shows_what_happens(page: &str, least_commands: usize) {
    let path = path(&format!("docs/{page}.md"));
    let page = fs::read_to_string(&path).unwrap();
    let folder = Folder::new();
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
            let shown = chosen(&printed(command, &folder), rest);
            if env::var_os("FLEXCAL_REFILL").is_none() {
                let (page, now) = (
                    lines[1..].iter().map(|line| timeless(line)),
                    shown.iter().map(|line| timeless(line)),
                );
                assert_eq!(page.collect::<Vec<_>>(), now.collect::<Vec<_>>(), "{command}");
            }
            lines.truncate(1);
            lines.extend(shown);
            commands += 1;
        } else if !rest.is_empty() {
            folder.write(rest, lines.join("\n") + "\n");
        }
        writeln!(filled, "```{}\n{}\n```", block.info, lines.join("\n")).unwrap();
    }
    assert!(commands >= least_commands);
    if env::var_os("FLEXCAL_REFILL").is_some() {
        fs::write(&path, filled).unwrap();
    }
}

#[test]
fn what_is_left_out_is_marked() {
    assert_eq!(chosen("a\nb\nc\nd\ne\n", "1-2 4-4"), ["a", "b", "…", "d", "…"]);
    assert_eq!(chosen("a\nb\n", ""), ["a", "b"]);
    assert_eq!(
        shell_words("plan a --separate \"x = { y = 1 }\" z"),
        ["plan", "a", "--separate", "x = { y = 1 }", "z"]
    );
    assert_eq!(timeless("Converged in 6 steps, 0.119 s"), "Converged in 6");
}

/// Returns the pages of the documentation, the README first.
fn pages() -> Vec<PathBuf> {
    let docs = fs::read_dir(path("docs")).unwrap().map(|entry| entry.unwrap().path());
    let mut pages: Vec<PathBuf> =
        docs.filter(|path| path.extension().is_some_and(|ending| ending == "md")).collect();
    pages.sort();
    pages.insert(0, path("README.md"));
    pages
}

#[test]
fn every_page_is_in_the_book_and_every_link_leads_somewhere() {
    let book = fs::read_to_string(path("docs/SUMMARY.md")).unwrap();
    for page in pages() {
        let name = page.file_name().unwrap().to_str().unwrap();
        if !["README.md", "SUMMARY.md"].contains(&name) {
            assert!(book.contains(&format!("]({name})")), "{name} is not in docs/SUMMARY.md");
        }
        let text = fs::read_to_string(&page).unwrap();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = link.split('#').next().unwrap();
            if !file.is_empty() && !file.contains("://") && !file.contains([' ', '\\', '`']) {
                assert!(page.parent().unwrap().join(file).exists(), "{}: {link}", page.display());
            }
        }
    }
}

/// Returns the commands on separate lines of a page, without comments.
fn commands(page: &str) -> Vec<String> {
    let page = page.replace("\\\n", "");
    let lines = page.lines().filter_map(|line| line.strip_prefix("    "));
    let commands = lines.filter(|line| line.starts_with("flexcal "));
    commands.map(|line| line.split(" # ").next().unwrap().trim_end().to_owned()).collect()
}

#[cfg(unix)]
#[test]
fn an_own_arm_goes_the_way_of_the_readme_to_its_end() {
    let readme = fs::read_to_string(path("README.md")).unwrap();
    let (_, section) = readme.split_once("## Your own arm").unwrap();
    let section = section.split("\n## ").next().unwrap();
    let folder = Folder::new();
    std::os::unix::fs::symlink(path("problems"), folder.path("problems")).unwrap();
    let mut said = Vec::new();
    for line in section.lines().filter_map(|line| line.strip_prefix("    ")) {
        let command = line.split(" # ").next().unwrap().trim_end();
        match shell_words(command).as_slice() {
            [program, from, to] if program == "cp" => {
                let name = Path::new(from).file_name().unwrap();
                fs::copy(folder.path(from), folder.path(to).join(name)).unwrap();
            }
            _ => said.push(printed(command, &folder)),
        }
    }
    let [init, check, found, _, exported] = said.as_slice() else { panic!("{section}") };
    assert_contains(
        init,
        &[
            "target_m",
            "position_sigma_mm",
            "30 % of the poses",
            "Next: flexcal check bench-arm --poses 40",
        ],
    );
    assert_contains(check, &["measure 58", "target_m = [0, 0, 0]"]);
    assert_contains(found, &["Explained: one effect was found", "joint = 2"]);
    assert_contains(
        exported,
        &["(--best-rigid), exported", "The exported geometry alone misses 18 held-out poses by 0."],
    );
    assert!(!exported.contains("with --fitted-alone it would"), "{exported}");
    assert!(folder.has("out/calibrated.urdf") && folder.has("out/bench-closed/report.html"));
    let two_tables = "identify problems/bench-arm/two-tables --out out/two-tables";
    let told = folder.flexcal(two_tables).success().stdout;
    assert_contains(&told, &["27 parameters from 41 poses, 18 poses held out"]);
}

#[test]
fn commands_of_the_documentation_are_understood() {
    let (empty, folder) = (Folder::new(), Folder::new());
    #[cfg(unix)]
    std::os::unix::fs::symlink(path("problems"), folder.path("problems")).unwrap();
    let run = |command: &str, folder: &Folder| {
        folder.flexcal(command.split_once(' ').map_or("", |(_, arguments)| arguments))
    };
    let mut understood = 0;
    for page in pages() {
        for command in commands(&fs::read_to_string(&page).unwrap()) {
            // Without files only the arguments can be checked.
            let said = run(&command, &empty).stderr;
            assert!(!said.contains("try '--help'"), "{}: {command}: {said}", page.display());
            understood += 1;
        }
    }
    assert!(understood > 20, "{understood}");
    // The quick commands of the command list run successfully.
    let list = fs::read_to_string(path("docs/commands.md")).unwrap();
    let is_quick = |command: &String| {
        command.contains("lunar-sampler")
            && !["study", "plan"].contains(&shell_words(command)[1].as_str())
    };
    let quick: Vec<String> = commands(&list).into_iter().filter(is_quick).collect();
    assert!(quick.len() >= 8, "{quick:?}");
    for command in quick.iter().filter(|_| cfg!(unix)) {
        let run = run(command, &folder);
        // Without the effect that the loop finds, the rows of another temperature look like a change.
        let is_watch = shell_words(command)[1] == "watch";
        assert!(run.status < 2 || is_watch && run.status == 3, "{run:?}");
    }
}
