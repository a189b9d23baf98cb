//! Readers of the library on mutations of their corpus: each accepts the text or reports an error
//! on one line.

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
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::arms::texts;
use super::mutation::mutated;

/// Number of mutations of each corpus file in the short run.
const SHORT: u64 = 100;

/// Result of a reader.
type Said = Result<(), Box<dyn Error>>;
/// Reader with the name of its folder in the corpus.
type Target = (&'static str, fn(&[u8], &Bench) -> Said);
const TARGETS: [Target; 7] = [
    ("problem", problem),
    ("table", table),
    ("truth", truth),
    ("study", study),
    ("targets", targets),
    ("estimate", estimate),
    ("urdf", urdf),
];

/// Temporary folder for files, with an arm for inputs that need one.
struct Bench {
    folder: tempfile::TempDir,
    arm: Problem,
    rows: Measurements,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in texts(true) {
            fs::write(folder.path().join(name), text).unwrap();
        }
        let arm = Problem::read(folder.path()).unwrap();
        let table = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/table/elastic.csv");
        let (rows, _) = Measurements::read(&[table], &arm).unwrap();
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

/// Returns the corpus files of a reader.
fn corpus(name: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(name);
    let mut paths: Vec<PathBuf> =
        fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), fs::read(&path).unwrap())).collect()
}

#[test]
fn readers_stand_what_they_are_given() {
    let rounds =
        std::env::var("FLEXCAL_MUTATIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(SHORT);
    let bench = Bench::new();
    for (name, target) in TARGETS {
        let files = corpus(name);
        assert!(files.len() >= 3, "the corpus of {name}");
        let mut accepted = 0;
        for (path, text) in files {
            let mut random = ChaCha8Rng::seed_from_u64(text.len() as u64);
            for round in 0..=rounds {
                let text = if round == 0 { text.clone() } else { mutated(&text, &mut random) };
                match target(&text, &bench) {
                    Ok(()) => accepted += 1,
                    Err(error) => {
                        let message = error.to_string();
                        let clean = message.chars().all(|letter| !is_hidden(letter))
                            && !message.contains('\n');
                        let named = match error.downcast_ref::<InputError>() {
                            Some(error) => error.location.file.file_name().is_some(),
                            None => message.contains("estimate.json: "),
                        };
                        assert!(named, "{}: no file: {message}", path.display());
                        assert!(clean && message.len() < 20_000, "{}: {message:?}", path.display());
                    }
                }
            }
        }
        assert!(accepted > 0, "{name}: some are right");
    }
}
