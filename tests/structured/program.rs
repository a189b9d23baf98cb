//! The program itself on a case: the files that it writes agree with each other and with the
//! library.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use nalgebra::Vector3;
use serde_json::Value;

use super::checks::{Verdict, ensure};
use super::fitted::Fitted;

/// Exit status and messages of a run.
pub struct Ran {
    pub status: Option<i32>,
    pub err: String,
}

/// Runs the program in a folder.
pub fn flexcal(folder: &Path, arguments: &[&str]) -> Ran {
    let output = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    Ran { status: output.status.code(), err: String::from_utf8_lossy(&output.stderr).into_owned() }
}

/// Returns true if a folder holds a file that a command writes as a result.
pub fn has_results(folder: &Path) -> bool {
    let Ok(entries) = fs::read_dir(folder) else { return false };
    entries.flatten().any(|entry| !entry.file_name().to_string_lossy().starts_with('.'))
}

/// Table with the names of its columns.
struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn read(path: &Path) -> Result<Self, String> {
        let text =
            fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
        // Commands have the decimal commas of their targets, and then semicolons.
        let has_semicolons = text.lines().next().is_some_and(|header| header.contains(';'));
        let cells = |line: &str| -> Vec<String> {
            if has_semicolons {
                line.split(';').map(|cell| cell.replace(',', ".")).collect()
            } else {
                line.split(',').map(str::to_owned).collect()
            }
        };
        let mut lines = text.lines();
        let columns = lines.next().map(cells).unwrap_or_default();
        Ok(Self { columns, rows: lines.map(cells).collect() })
    }

    fn place(&self, name: &str) -> Result<usize, String> {
        self.columns.iter().position(|column| column == name).ok_or(format!("no column {name}"))
    }

    fn words(&self, name: &str) -> Result<Vec<&str>, String> {
        let place = self.place(name)?;
        Ok(self.rows.iter().map(|row| row[place].as_str()).collect())
    }

    /// Returns the columns `<of>_x_mm` to `<of>_z_mm` \[mm\].
    fn vectors(&self, of: &str) -> Result<Vec<Vector3<f64>>, String> {
        let places = [
            self.place(&format!("{of}x_mm"))?,
            self.place(&format!("{of}y_mm"))?,
            self.place(&format!("{of}z_mm"))?,
        ];
        let number =
            |cell: &String| cell.parse::<f64>().map_err(|_| format!("{cell} is no number of {of}"));
        self.rows
            .iter()
            .map(|row| {
                Ok(Vector3::new(
                    number(&row[places[0]])?,
                    number(&row[places[1]])?,
                    number(&row[places[2]])?,
                ))
            })
            .collect()
    }
}

fn json(path: &Path) -> Result<Value, String> {
    let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    serde_json::from_str(&text).map_err(|error| format!("{}: {error}", path.display()))
}

/// Runs identify, predict, compensate, and predict on the commands, and checks what they write.
pub fn files_agree(fit: &Fitted, folder: &Path) -> Verdict {
    let run = |arguments: &str, status: &[i32]| -> Verdict {
        let ran = flexcal(
            folder,
            &arguments.split(' ').chain(["--quiet", "--force"]).collect::<Vec<_>>(),
        );
        let is_expected = ran.status.is_some_and(|found| status.contains(&found));
        ensure!(is_expected, "flexcal {arguments}: status {:?}\n{}", ran.status, ran.err);
        Ok(())
    };
    let trusted = i32::from(!fit.found.is_trusted());
    run("identify . --out fitted", &[trusted])?;
    let estimate = json(&folder.join("fitted/estimate.json"))?;
    // The program was given the folder as ".", the library its whole path.
    let of_library = fit.estimate.to_string().replace(&folder.display().to_string(), ".");
    let of_library = serde_json::from_str(&of_library).map_err(|error| error.to_string())?;
    if let Some(key) = first_difference(&estimate, &of_library) {
        return Err(format!("the program writes another {key} to estimate.json than the library"));
    }
    let residuals = Table::read(&folder.join("fitted/residuals.csv"))?;
    residuals_are_written(fit, &residuals)?;
    summary_is_of(&estimate["identification"], &residuals, Some("false"))?;
    if estimate.get("held_out").is_some() {
        summary_is_of(&estimate["held_out"], &residuals, Some("true"))?;
    }
    run("predict . --estimate fitted/estimate.json --data rows.csv --out predicted", &[trusted])?;
    let again = Table::read(&folder.join("predicted/residuals.csv"))?;
    summary_is_of(&json(&folder.join("predicted/errors.json"))?["all"], &again, None)?;
    let predictions = Table::read(&folder.join("predicted/predictions.csv"))?;
    for of in ["predicted_", "residual_"] {
        let pairs = residuals.vectors(of)?.into_iter().zip(again.vectors(of)?);
        let off = pairs.map(|(one, other)| (one - other).abs().max()).fold(0.0, f64::max);
        ensure!(off < 3e-6, "predict is {off} mm off {of} of identify");
    }
    ensure!(
        predictions.vectors("predicted_")? == again.vectors("predicted_")?,
        "two tables of predict differ"
    );
    run("compensate . --estimate fitted/estimate.json --data rows.csv --out commands", &[0, 1])?;
    let has_effects = !fit.problem.effects.is_empty();
    if has_effects || fit.problem.data.orientation_sigma.is_some() {
        return Ok(());
    }
    commands_predict_their_targets(folder, trusted, &run)
}

/// Keys of estimate.json that differ from run to run, or by how the files are named.
const MAY_DIFFER: [&str; 7] =
    ["seconds", "digest", "file", "measurement_files", "cautions", "text", "remedy"];

/// Returns the path of the first value that differs.
fn first_difference(one: &Value, other: &Value) -> Option<String> {
    match (one, other) {
        (Value::Object(one), Value::Object(other)) => one
            .keys()
            .chain(other.keys())
            .filter(|key| !MAY_DIFFER.contains(&key.as_str()))
            .find_map(|key| {
                let both =
                    (one.get(key).unwrap_or(&Value::Null), other.get(key).unwrap_or(&Value::Null));
                first_difference(both.0, both.1).map(|path| format!("{key}.{path}"))
            }),
        (Value::Array(one), Value::Array(other)) if one.len() == other.len() => {
            one.iter().zip(other).enumerate().find_map(|(k, (one, other))| {
                first_difference(one, other).map(|path| format!("{k}.{path}"))
            })
        }
        _ => (one != other).then(|| format!("({one} for {other})")),
    }
}

/// Checks residuals.csv against the residuals of the library.
fn residuals_are_written(fit: &Fitted, table: &Table) -> Verdict {
    ensure!(table.rows.len() == fit.residuals.len(), "residuals.csv has {} rows", table.rows.len());
    let (predicted, left) = (table.vectors("predicted_")?, table.vectors("residual_")?);
    let (lines, held_out) = (table.words("line")?, table.words("held_out")?);
    for (k, residual) in fit.residuals.iter().enumerate() {
        let line = fit.data.measurements.location(residual.row).line.unwrap_or(0).to_string();
        ensure!(
            lines[k] == line,
            "row {k} of residuals.csv is of line {} instead of {line}",
            lines[k]
        );
        ensure!(
            held_out[k] == residual.held_out.to_string(),
            "row {k}: held_out is {}",
            held_out[k]
        );
        let off = (predicted[k] - residual.predicted * 1e3).abs().max();
        let off = off.max((left[k] - residual.position * 1e3).abs().max());
        ensure!(off < 6e-7, "row {k} of residuals.csv is {off} mm off the residual");
    }
    Ok(())
}

/// Checks an error summary against the rows of residuals.csv, to its decimals.
fn summary_is_of(stated: &Value, table: &Table, held_out: Option<&str>) -> Verdict {
    let flags = table.words("held_out")?;
    let rows = table.vectors("residual_")?;
    let chosen: Vec<Vector3<f64>> = rows
        .into_iter()
        .zip(flags)
        .filter(|(_, flag)| held_out.is_none_or(|part| *flag == part))
        .map(|(row, _)| row)
        .collect();
    ensure!(
        stated["n"] == chosen.len(),
        "{} rows are summarised, {} there",
        stated["n"],
        chosen.len()
    );
    let n = chosen.len() as f64;
    for (axis, of) in [("x", 0), ("y", 1), ("z", 2), ("norm", 3)] {
        let values: Vec<f64> =
            chosen.iter().map(|row| if of < 3 { row[of].abs() } else { row.norm() }).collect();
        let found = [
            ("mean_mm", values.iter().sum::<f64>() / n),
            ("max_mm", values.iter().copied().fold(0.0, f64::max)),
            ("rms_mm", (values.iter().map(|value| value * value).sum::<f64>() / n).sqrt()),
        ];
        for (key, found) in found {
            let stated = stated[key][axis].as_f64().unwrap_or(f64::NAN);
            ensure!(
                chosen.is_empty() || (stated - found).abs() < 2e-6,
                "{key}.{axis} is stated as {stated}, and is {found}"
            );
        }
    }
    Ok(())
}

/// Checks that `predict` takes commands.csv, and that the arm comes to the targets that are called
/// reached.
fn commands_predict_their_targets(
    folder: &Path,
    trusted: i32,
    run: &dyn Fn(&str, &[i32]) -> Verdict,
) -> Verdict {
    let path = folder.join("commands/commands.csv");
    let text = fs::read_to_string(&path).map_err(|error| error.to_string())?;
    let commands = Table::read(&path)?;
    let reached = commands.words("reached")?;
    let header = text.lines().next().unwrap_or_default().to_owned();
    let kept: Vec<&str> = text
        .lines()
        .skip(1)
        .zip(&reached)
        .filter(|(_, flag)| **flag == "true")
        .map(|(line, _)| line)
        .collect();
    if kept.is_empty() {
        return Ok(());
    }
    fs::write(folder.join("reached.csv"), format!("{header}\n{}\n", kept.join("\n"))).unwrap();
    run("predict . --estimate fitted/estimate.json --data reached.csv --out checked", &[trusted])?;
    let table = Table::read(&folder.join("checked/residuals.csv"))?;
    let worst = table.vectors("residual_")?.iter().map(Vector3::norm).fold(0.0, f64::max);
    // 1 µm of reaching, and the decimals of targets.
    ensure!(worst < 1.1e-3, "a target that is called reached is missed by {worst} mm");
    Ok(())
}
