//! The flexcal program, run in a temporary folder.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that fails may panic")]

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

use super::arms::path;

/// Temporary folder in which flexcal runs.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// Creates a folder with files of the given names and texts.
    pub fn with<const N: usize>(files: [(&str, &str); N]) -> Self {
        let folder = Self::new();
        for (name, text) in files {
            folder.write(name, text);
        }
        folder
    }

    /// Creates a folder with copies of files of `tests/cases`.
    pub fn with_cases(names: &[&str]) -> Self {
        let folder = Self::new();
        for name in names {
            folder.copy(&format!("tests/cases/{name}"), name);
        }
        folder
    }

    /// Creates a folder with the lunar sampler and its data without an effect.
    pub fn with_lunar_sampler() -> Self {
        Self::with_cases(&["problem.toml", "a-none.csv"])
    }

    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn has(&self, name: impl AsRef<Path>) -> bool {
        self.path(name).exists()
    }

    #[track_caller]
    pub fn read(&self, name: impl AsRef<Path>) -> String {
        let path = self.path(name);
        fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    #[track_caller]
    pub fn json(&self, name: impl AsRef<Path>) -> Value {
        serde_json::from_str(&self.read(name)).unwrap()
    }

    /// Returns the cells of a CSV file by row and the names of its columns.
    #[track_caller]
    pub fn table(&self, name: impl AsRef<Path>) -> Table {
        let mut file = csv::Reader::from_path(self.path(name)).unwrap();
        let cells = |row: &csv::StringRecord| row.iter().map(str::to_owned).collect();
        let columns = cells(file.headers().unwrap());
        Table { columns, rows: file.records().map(|row| cells(&row.unwrap())).collect() }
    }

    /// Writes a file; creates its folder.
    pub fn write(&self, name: impl AsRef<Path>, text: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    /// Copies a file of the package.
    pub fn copy(&self, from: &str, name: impl AsRef<Path>) {
        self.write(name, fs::read(path(from)).unwrap());
    }

    /// Replaces a file by a function of its text, which has to change.
    #[track_caller]
    pub fn map(&self, name: &str, map: impl FnOnce(&str) -> String) {
        let text = self.read(name);
        let changed = map(&text);
        assert_ne!(text, changed, "nothing to change in {name}");
        self.write(name, changed);
    }

    /// Replaces the first `from` in a file.
    #[track_caller]
    pub fn edit(&self, name: &str, from: &str, to: &str) {
        self.map(name, |text| text.replacen(from, to, 1));
    }

    /// Keeps the header of a table and maps every other line, counted from 2; `None` removes it.
    pub fn map_rows(&self, name: &str, mut map: impl FnMut(usize, &str) -> Option<String>) {
        let text = self.read(name);
        let lines = text
            .lines()
            .enumerate()
            .filter_map(|(k, line)| if k == 0 { Some(line.to_owned()) } else { map(k + 1, line) });
        self.write(name, lines.collect::<Vec<_>>().join("\n") + "\n");
    }

    /// Keeps only the first `count` rows of a table that contain `mark`, and those without it.
    pub fn keep_marked(&self, name: &str, mark: &str, count: usize) {
        let mut marked = 0;
        self.map_rows(name, |_, line| {
            marked += usize::from(line.contains(mark));
            (!line.contains(mark) || marked <= count).then(|| line.to_owned())
        });
    }

    /// Returns a command with arguments as a shell reads them.
    pub fn command(&self, arguments: &str) -> Command {
        command(self.0.path(), arguments)
    }

    /// Runs flexcal with arguments as a shell reads them.
    #[track_caller]
    pub fn flexcal(&self, arguments: &str) -> Run {
        run(self.0.path(), arguments)
    }

    /// Runs `simulate` on an arm and its truth, and writes the measurements to a file.
    #[track_caller]
    pub fn simulate(&self, arm: &str, truth: &str, poses: usize, seed: u64, to: &str) {
        let options = format!("--poses {poses} --seed {seed} --quiet --out .simulated");
        self.flexcal(&format!("simulate {arm} --truth {truth} {options}")).success();
        self.write(to, self.read(".simulated/measurements.csv"));
    }
}

/// Cells of a CSV file.
pub struct Table {
    pub columns: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    #[track_caller]
    pub fn place(&self, column: &str) -> usize {
        let place = self.columns.iter().position(|name| name == column);
        place.unwrap_or_else(|| panic!("{column} is none of {:?}", self.columns))
    }

    #[track_caller]
    pub fn column(&self, column: &str) -> Vec<&str> {
        let place = self.place(column);
        self.rows.iter().map(|row| row[place].as_str()).collect()
    }

    #[track_caller]
    pub fn numbers(&self, column: &str) -> Vec<f64> {
        self.column(column).iter().map(|cell| cell.parse().unwrap()).collect()
    }
}

/// Exit status and output of a run.
#[derive(Debug)]
pub struct Run {
    pub arguments: String,
    pub status: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Run {
    pub fn of(command: &mut Command) -> Self {
        let arguments: Vec<_> = command.get_args().map(OsStr::to_string_lossy).collect();
        let arguments = arguments.join(" ");
        let output = command.output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        let (stdout, stderr) = (text(output.stdout), text(output.stderr));
        let status = output.status.code().unwrap_or_else(|| panic!("{arguments}: {stderr}"));
        Self { arguments, status, stdout, stderr }
    }

    #[track_caller]
    pub fn code(self, status: i32) -> Self {
        assert_eq!(self.status, status, "flexcal {}\n{}", self.arguments, self.stderr);
        self
    }

    #[track_caller]
    pub fn success(self) -> Self {
        self.code(0)
    }

    /// Parses the printed output.
    #[track_caller]
    pub fn json(&self) -> Value {
        let parsed = serde_json::from_str(&self.stdout);
        parsed.unwrap_or_else(|error| panic!("flexcal {}: {error}\n{self:?}", self.arguments))
    }

    /// Returns the printed output without line breaks.
    pub fn words(&self) -> String {
        in_one_line(&self.stdout)
    }

    /// Returns the printed messages without line breaks.
    pub fn message(&self) -> String {
        in_one_line(&self.stderr)
    }

    pub fn is_silent(&self) -> bool {
        self.stdout.is_empty() && self.stderr.is_empty()
    }
}

/// Returns a command in a folder.
pub fn command(folder: impl AsRef<Path>, arguments: &str) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
    command.current_dir(folder).args(shell_words(arguments));
    command
}

/// Runs flexcal in a folder.
#[track_caller]
pub fn run(folder: impl AsRef<Path>, arguments: &str) -> Run {
    Run::of(&mut command(folder, arguments))
}

/// Runs flexcal in the folder of the package, without results there.
#[track_caller]
pub fn run_in_package(arguments: &str) -> Run {
    let out = tempfile::tempdir().unwrap();
    run(path(""), &format!("{arguments} --out {}", out.path().display()))
}

/// Splits a command into arguments; quoted text stays together.
pub fn shell_words(command: &str) -> Vec<String> {
    let (mut words, mut quote): (Vec<Option<String>>, Option<char>) = (vec![None], None);
    for letter in command.chars() {
        match (quote, letter) {
            (Some(mark), _) if mark == letter => quote = None,
            (None, '"' | '\'') => quote = Some(letter),
            (None, ' ' | '\n') => words.push(None),
            _ => words.last_mut().unwrap().get_or_insert_default().push(letter),
        }
    }
    words.into_iter().flatten().collect()
}

pub fn in_one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Asserts that a text contains every one of `expected`.
#[track_caller]
pub fn assert_contains(text: &str, expected: &[&str]) {
    for words in expected {
        assert!(text.contains(words), "{words:?} missing in:\n{text}");
    }
}

/// Returns the entry of a list whose `name` is the given one.
#[track_caller]
pub fn named<'a>(list: &'a Value, name: &str) -> &'a Value {
    entry(list, |entry| entry["name"] == name)
}

/// Returns the first entry of a list for which a condition holds.
#[track_caller]
pub fn entry(list: &Value, condition: impl Fn(&Value) -> bool) -> &Value {
    let found = items(list).iter().find(|entry| condition(entry));
    found.unwrap_or_else(|| panic!("no such entry in {list:#}"))
}

#[track_caller]
pub fn items(list: &Value) -> &[Value] {
    list.as_array().unwrap_or_else(|| panic!("no list: {list:#}"))
}

/// Returns the texts under a key of every entry of a list.
#[track_caller]
pub fn texts<'a>(list: &'a Value, key: &str) -> Vec<&'a str> {
    items(list).iter().map(|entry| entry[key].as_str().unwrap()).collect()
}

#[track_caller]
pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value:#}"))
}

/// Returns the codes of the findings of a result.
#[track_caller]
pub fn findings(result: &Value) -> Vec<&str> {
    texts(&result["findings"], "code")
}
