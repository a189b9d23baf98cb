//! Mistakes in problems and tables, each of which must be refused at a place that exists.

use std::fs;
use std::path::Path;

use super::case::Case;
use super::checks::{Verdict, ensure};
use super::draw::Draw;
use super::fitted::write;
use super::program::{flexcal, has_results};
use super::row::Row;
use super::sight::Sight;

/// Texts of a case with one mistake.
struct Mistaken {
    what: &'static str,
    problem: String,
    table: String,
}

/// Changes the cells of a random row, given those and the place of the measured y.
fn in_a_row(draw: &mut Draw, case: &Case, change: &dyn Fn(&mut Vec<String>, usize)) -> String {
    let rows: Vec<&Row> = case.rows.iter().filter(|row| row.sight == Sight::Position).collect();
    let row = draw.pick(&rows);
    let mut lines: Vec<String> = case.table.lines().map(str::to_owned).collect();
    let header = lines.iter().find(|line| !line.starts_with("//")).unwrap().clone();
    let delimiter =
        [";", "|", "\t", "  ", ","].into_iter().find(|mark| header.contains(mark)).unwrap();
    let is_y = |name: &str| {
        ["y_mm", "y_m"]
            .iter()
            .any(|ours| name == *ours || case.problem.contains(&format!("\"{name}\" = \"{ours}\"")))
    };
    let place = header.split(delimiter).position(is_y).unwrap();
    let mut cells: Vec<String> = lines[row.line - 1].split(delimiter).map(str::to_owned).collect();
    change(&mut cells, place);
    lines[row.line - 1] = cells.join(delimiter);
    lines.join("\n") + "\n"
}

/// Replaces the measured y of a random row.
fn in_a_cell(draw: &mut Draw, case: &Case, cell: &str) -> String {
    in_a_row(draw, case, &|cells, place| cell.clone_into(&mut cells[place]))
}

/// Makes one mistake.
fn mistaken(draw: &mut Draw, case: &Case) -> Mistaken {
    let (problem, table) = (case.problem.clone(), case.table.clone());
    let edit = |from: &str, to: &str| case.problem.replacen(from, to, 1);
    let (what, problem, table) = match draw.whole(0, 17) {
        0 => ("nan in a cell", problem, in_a_cell(draw, case, "nan")),
        1 => ("a word in a cell", problem, in_a_cell(draw, case, "12mm3")),
        2 => ("an empty cell", problem, in_a_cell(draw, case, "\"\"")),
        3 => ("a huge number", problem, in_a_cell(draw, case, "1e200")),
        4 => ("a cell too few", problem, in_a_row(draw, case, &|cells, _| drop(cells.pop()))),
        5 => ("an unknown key", edit("[tool]\n", "[tool]\ntagret = 1\n"), table),
        6 => ("a length without a unit", edit("[base]\n", "[base]\nxyz = [0, 0, 0]\n"), table),
        7 => ("a repeated section", problem + "[tool]\n", table),
        8 => (
            "a pattern of nothing",
            edit("[parameters]\n", "[parameters]\n\"joint99.a\" = { free = true }\n"),
            table,
        ),
        9 => (
            "a rule of another kind",
            edit("[parameters]\n", "[parameters]\n\"joint1.*\" = { sigma_relative = 1 }\n"),
            table,
        ),
        10 => (
            "an effect of no joint",
            edit("[parameters]\n", "[[effect]]\ngear-ratio = { joint = 44 }\n[parameters]\n"),
            table,
        ),
        11 => (
            "an effect of no name",
            edit("[parameters]\n", "[[effect]]\ngear-ration = { joint = 1 }\n[parameters]\n"),
            table,
        ),
        12 => ("a σ below zero", edit("[data]\n", "[data]\npoint_sigma_mm = -1\n"), table),
        13 => ("no table", edit("rows.csv", "row.csv"), table),
        14 => ("an open bracket", edit("target_m = [", "target_m = [["), table),
        15 => ("no name", edit("name = \"case", "title = \"case"), table),
        16 => (
            "a number that is none",
            edit("[base]\n", "[base]\nrotation_rad = [nan, 0, 0]\n"),
            table,
        ),
        _ => (
            "a formula of no quantity",
            edit(
                "[parameters]\n",
                "[[effect]]\nlaw = { name = \"odd\", at = \"joint1\", terms = [\"sin(q1)*zz(q1)\"] }\n[parameters]\n",
            ),
            table,
        ),
    };
    Mistaken { what, problem, table }
}

/// Makes a mistake in a case, and checks that `identify` names a place that exists, ends with
/// status 2 and writes nothing.
pub fn mistakes_are_told(k: u64, case: &Case, folder: &Path) -> Verdict {
    let draw = &mut Draw::of_change(k, 1);
    let Mistaken { what, problem, table } = mistaken(draw, case);
    ensure!(problem != case.problem || table != case.table, "{what}: nothing is changed");
    write(folder, &problem, &table);
    let _ = fs::remove_dir_all(folder.join("mistaken"));
    let ran = flexcal(folder, &["identify", ".", "--out", "mistaken", "--quiet"]);
    ensure!(ran.status == Some(2), "{what}: status {:?} instead of 2\n{}", ran.status, ran.err);
    ensure!(!has_results(&folder.join("mistaken")), "{what}: results are written");
    place_exists(folder, &ran.err).map_err(|words| format!("{what}: {words}"))
}

/// Checks that the place that a message names, `file:line`, exists.
fn place_exists(folder: &Path, message: &str) -> Verdict {
    for name in ["problem.toml", "rows.csv", "row.csv"] {
        let Some((_, after)) = message.split_once(&format!("{name}:")) else { continue };
        let number: String = after.chars().take_while(char::is_ascii_digit).collect();
        let Ok(text) = fs::read_to_string(folder.join(name)) else {
            return if number.is_empty() {
                Ok(())
            } else {
                Err(format!("a line of no file:\n{message}"))
            };
        };
        let lines = text.lines().count();
        let Ok(line) = number.parse::<usize>() else { continue };
        ensure!((1..=lines).contains(&line), "line {line} of {lines}:\n{message}");
        return Ok(());
    }
    Err(format!("no place is named:\n{message}"))
}
