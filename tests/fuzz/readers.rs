//! Readers of the library with what holds of each for any bytes: it accepts them or reports an error
//! on one line. `targets` gives them random mutations, `guided` what a coverage-guided fuzzer finds.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use flexcal::error::{InputError, is_hidden};
use flexcal::fit::{Options, PredictError, SavedEstimate, identify, predict};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::mechanics::Arm;
use flexcal::model::Model;
use flexcal::problem::Problem;
use flexcal::rig::{Truth, simulate};
use flexcal::study::Study;
use flexcal::urdf::{Chain, Robot, describe, export};

use super::arms::texts;

/// Result of a reader.
type Said = Result<(), Box<dyn Error>>;
/// Reader with the name of its folder in the corpus.
pub type Target = (&'static str, fn(&[u8], &Bench) -> Said);
/// The readers.
pub const TARGETS: [Target; 8] = [
    ("problem", problem),
    ("table", table),
    ("truth", truth),
    ("study", study),
    ("targets", targets),
    ("estimate", estimate),
    ("urdf", urdf),
    ("formula", formula),
];

/// Returns true if the reader accepts the text.
///
/// # Panics
///
/// If the error names no file, has more than one line or characters that are not seen.
pub fn accepts(target: Target, text: &[u8], bench: &Bench) -> bool {
    let (name, reader) = target;
    let Err(error) = reader(text, bench) else { return true };
    let message = error.to_string();
    let is_clean = message.chars().all(|letter| !is_hidden(letter)) && !message.contains('\n');
    let names_a_file = match error.downcast_ref::<InputError>() {
        Some(error) => error.location.file.file_name().is_some(),
        None => message.contains("estimate.json: "),
    };
    assert!(names_a_file, "{name}: no file: {message}");
    assert!(is_clean && message.len() < 20_000, "{name}: {message:?}");
    false
}

/// Temporary folder for files, with an arm for inputs that need one.
pub struct Bench {
    folder: tempfile::TempDir,
    arm: Problem,
    rows: Measurements,
}

impl Bench {
    /// Creates the folder and reads the elastic arm with its table.
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in texts(true) {
            fs::write(folder.path().join(name), text).unwrap();
        }
        let arm = Problem::read(folder.path()).unwrap();
        fs::write(folder.path().join("elastic.csv"), include_bytes!("../corpus/table/elastic.csv"))
            .unwrap();
        let (rows, _) = Measurements::read(&[folder.path().join("elastic.csv")], &arm).unwrap();
        Self { folder, arm, rows }
    }

    fn file(&self, name: &str, text: &[u8]) -> PathBuf {
        let path = self.folder.path().join(name);
        fs::write(&path, text).unwrap();
        path
    }
}

fn problem(text: &[u8], bench: &Bench) -> Said {
    let problem = Problem::read(&bench.file("arm.toml", text))?;
    let _ = (problem.digest(), Model::new(&problem, &[String::new()], &[String::new()])?);
    Ok(())
}

fn table(text: &[u8], bench: &Bench) -> Said {
    let (data, _) = Dataset::read_files(&[bench.file("rows.csv", text)], &bench.arm)?;
    // A readable table can be fitted, or gives an error.
    let _ = identify(&bench.arm, &data, &Options::default());
    Ok(())
}

fn truth(text: &[u8], bench: &Bench) -> Said {
    let truth = Truth::read(&bench.file("true.toml", text), &bench.arm)?;
    let _ = simulate(&bench.arm, &truth, 3, 1);
    Ok(())
}

fn study(text: &[u8], bench: &Bench) -> Said {
    Study::read(&bench.file("STUDY.toml", text))?;
    Ok(())
}

fn targets(text: &[u8], bench: &Bench) -> Said {
    let problem = Problem {
        data: flexcal::problem::Data { held_out: None, ..bench.arm.data.clone() },
        ..bench.arm.clone()
    };
    Measurements::read(&[bench.file("targets.csv", text)], &problem)?;
    Ok(())
}

fn estimate(text: &[u8], bench: &Bench) -> Said {
    let saved = SavedEstimate::read(&bench.file("estimate.json", text))?;
    // A readable estimate can be applied, or is refused as one of another arm.
    match predict(&bench.arm, Some(&saved), &bench.rows, None) {
        Err(PredictError::Estimate(error)) => Err(error.into()),
        _ => Ok(()),
    }
}

fn urdf(text: &[u8], bench: &Bench) -> Said {
    let robot = Robot::read(&bench.file("arm.urdf", text))?;
    let chain =
        Chain::new(&robot, None, None).or_else(|_| Chain::new(&robot, None, Some("tool")))?;
    let problem = Problem::parse(&describe(&chain)?.text, Path::new("problem.toml"))?;
    export(&chain, &problem, &Arm::nominal(&problem))?;
    Ok(())
}

/// Predicts with the arm whose second joint has a law of this formula.
fn formula(text: &[u8], bench: &Bench) -> Said {
    let law = format!(
        "[[effect]]\nlaw = {{ name = \"law\", at = \"joint2\", terms = [{}], sigma_deg = 0.1, k = {{ start = 0.5 }} }}\n",
        serde_json::Value::from(String::from_utf8_lossy(text))
    );
    let arm = fs::read_to_string(bench.folder.path().join("problem.toml"))?;
    let at = arm.find("[parameters]").unwrap_or_default();
    let arm = [&arm[..at], &law, &arm[at..]].concat();
    let problem = Problem::read(&bench.file("lawful.toml", arm.as_bytes()))?;
    let _ = predict(&problem, None, &bench.rows, None);
    Ok(())
}
