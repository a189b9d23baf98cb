//! Checks in words.

use std::fmt;

use super::outcome::{Outcome, ResidualTest, Sequence, Test};

impl fmt::Display for ResidualTest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.outcome {
            Ok(outcome) => tested(&self.test, outcome, f),
            Err(why) => write!(f, "{} not tested: {why}", untested(&self.test)),
        }
    }
}

fn tested(test: &Test, outcome: &Outcome, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let Outcome { statistic, bounds: (from, to), failed, .. } = outcome;
    let chance = format!("chance gives up to {to:.2}");
    match test {
        Test::ReducedChiSquared => {
            let size = match (failed, statistic < from) {
                (true, _) => "residuals are larger than σ explains",
                (false, true) => "residuals are smaller than σ, which is overstated",
                (false, false) => "residuals are as large as σ",
            };
            write!(f, "{size} (χ²/ν {statistic:.2}, chance gives {from:.2} to {to:.2})")
        }
        Test::LackOfFit => {
            let size = if *failed { "larger than" } else { "as large as" };
            write!(f, "residuals are {size} repeats of a setup scatter (F {statistic:.2}, {chance})")
        }
        Test::Runs { sequence } => {
            let sign = if *failed { "keep their sign" } else { "do not keep their sign beyond chance" };
            let percent = (100.0 * statistic, 100.0 * to);
            write!(
                f,
                "residuals {sign} {} (at {:.0} % of the steps, chance gives up to {:.0} %)",
                order(*sequence),
                percent.0,
                percent.1
            )
        }
        Test::LjungBox { sequence } => {
            let follow = if *failed { "follow one another" } else { "do not follow one another beyond chance" };
            write!(f, "residuals {follow} {} (Ljung–Box {statistic:.1}, chance gives up to {to:.1})", order(*sequence))
        }
        Test::Dependence { covariate } => {
            let depend = if *failed { "depend" } else { "do not depend beyond chance" };
            write!(f, "residuals {depend} on {covariate} (distance correlation {statistic:.2}, {chance})")
        }
        Test::Outliers { worst } => {
            let pose = worst.map_or_else(String::new, |pose| format!("pose {} ", pose + 1));
            let far = if *failed { "is too far off to be noise" } else { "is farthest off, not beyond chance" };
            write!(f, "{pose}{far} ({statistic:.1} times the scatter, chance gives up to {to:.1})")
        }
        Test::Normality => {
            let normal = if *failed { "are not" } else { "may well be" };
            write!(f, "residuals {normal} normally distributed (Anderson–Darling {statistic:.2}, {chance})")
        }
    }
}

fn order(sequence: Sequence) -> &'static str {
    match sequence {
        Sequence::Time => "in the order of time",
        Sequence::Rows => "in the order of the rows",
    }
}

fn untested(test: &Test) -> String {
    match test {
        Test::ReducedChiSquared => "size against σ".to_owned(),
        Test::LackOfFit => "size against repeats".to_owned(),
        Test::Runs { sequence } => format!("signs {}", order(*sequence)),
        Test::LjungBox { sequence } => format!("autocorrelation {}", order(*sequence)),
        Test::Dependence { covariate } => format!("dependence on {covariate}"),
        Test::Outliers { .. } => "outliers".to_owned(),
        Test::Normality => "normal distribution".to_owned(),
    }
}
