//! A case as the library reads, fits and saves it, by the calls of `flexcal identify` and
//! `flexcal predict`.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use flexcal::fit::{Identification, Options, Prediction, Residual, SavedEstimate, identify};
use flexcal::measurement::{Dataset, Measurements, Split};
use flexcal::problem::{HeldOut, Problem};
use flexcal::remainder::{self, CorrectedPose, CorrectedPrediction, Correction};
use flexcal::results::{Document as _, IdentificationResult};
use serde_json::Value;

/// Fit of a case with everything that is saved of it.
pub struct Fitted {
    pub problem: Problem,
    pub data: Dataset,
    pub found: Identification,
    pub residuals: Vec<Residual>,
    /// estimate.json.
    pub estimate: Value,
    /// estimate.json, read again.
    pub saved: SavedEstimate,
    pub correction: Option<Correction>,
}

type Said<T> = Result<T, Box<dyn Error>>;

/// Writes problem and table into a folder and returns the path of the problem.
pub fn write(folder: &Path, problem: &str, table: &str) -> PathBuf {
    fs::write(folder.join("rows.csv"), table).unwrap();
    let path = folder.join("problem.toml");
    fs::write(&path, problem).unwrap();
    path
}

impl Fitted {
    /// Reads and fits the case in a folder.
    pub fn new(path: &Path) -> Said<Self> {
        let problem = Problem::read(path)?;
        let (data, _) = Dataset::read(&problem)?;
        let found = identify(&problem, &data, &Options::default().with_influential_rows())?;
        let fitted = remainder::uncertainty(&found, &problem, &data)?;
        let mut result = IdentificationResult::new(&problem, &found);
        if let Some(fitted) = &fitted {
            result = result.with_predictions(&found, fitted);
        }
        let text = result.to_json();
        let saved = SavedEstimate::parse(&text, &path.with_file_name("estimate.json"))?;
        let correction = remainder::of_estimate(&problem, &saved)?;
        let residuals = found.residuals(&problem, &data)?;
        let estimate = serde_json::from_str(&text)?;
        Ok(Self { problem, data, found, residuals, estimate, saved, correction })
    }

    /// Predicts the rows of a table with the saved estimate.
    pub fn predict(&self, rows: &Measurements) -> Said<(Prediction, Option<Vec<CorrectedPose>>)> {
        let by_chance = matches!(self.problem.data.held_out, Some(HeldOut::Fraction { .. }));
        let split = Split::new(&self.problem, rows).ok().filter(|_| !by_chance);
        let split = split.as_ref();
        Ok(match &self.correction {
            Some(correction) => {
                let CorrectedPrediction { prediction, poses, .. } =
                    remainder::predict(&self.problem, &self.saved, correction, rows, split)?;
                (prediction, Some(poses))
            }
            None => (flexcal::fit::predict(&self.problem, Some(&self.saved), rows, split)?, None),
        })
    }
}
