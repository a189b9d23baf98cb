//! `flexcal identify`.

use std::error::Error;

use clap::{Args, ValueEnum};
use flexcal::identify::{self, Options, SolverChoice, Strategy};
use flexcal::report::{self, PlotData};

use super::input::{Common, Input};
use super::progress::Line;
use super::{Outcome, diagnostic, output};

/// Arguments of `flexcal identify`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  flexcal identify problems/lunar-sampler
  flexcal identify problems/ur10-ipa --data session_A.csv session_B.csv session_C.csv
  flexcal identify my-arm/problem.toml --strategy sequential --json")]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// Which parameters are fitted together
    #[arg(long, value_enum, default_value_t = StrategyArgument::Joint)]
    strategy: StrategyArgument,
    /// By which solver; auto keeps bounds and constraints where there are any
    #[arg(long, value_enum, default_value_t = SolverArgument::Auto)]
    solver: SolverArgument,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum StrategyArgument {
    /// Everything at once
    Joint,
    /// Stiffness, then geometry, repeated until it settles
    Sequential,
    /// Stiffness, then geometry, once: the paper's order
    SequentialOneSweep,
    /// Geometry; stiffnesses stay nominal
    GeometryOnly,
    /// Stiffnesses; geometry stays nominal
    StiffnessOnly,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum SolverArgument {
    /// Bounded where there are bounds or constraints, else levenberg-marquardt
    Auto,
    /// Levenberg-Marquardt without bounds
    LevenbergMarquardt,
    /// Gauss-Newton: undamped steps
    GaussNewton,
    /// Undamped steps by a truncated pseudo-inverse, as in the paper
    PseudoInverse,
    /// Levenberg-Marquardt within the bounds of [parameters] and every [[constraint]]
    Bounded,
}

impl From<StrategyArgument> for Strategy {
    fn from(argument: StrategyArgument) -> Self {
        match argument {
            StrategyArgument::Joint => Self::Joint,
            StrategyArgument::Sequential => Self::Sequential,
            StrategyArgument::SequentialOneSweep => Self::OneSweep,
            StrategyArgument::GeometryOnly => Self::GeometryOnly,
            StrategyArgument::StiffnessOnly => Self::StiffnessOnly,
        }
    }
}

impl From<SolverArgument> for SolverChoice {
    fn from(argument: SolverArgument) -> Self {
        match argument {
            SolverArgument::Auto => Self::Auto,
            SolverArgument::LevenbergMarquardt => Self::LevenbergMarquardt,
            SolverArgument::GaussNewton => Self::GaussNewton,
            SolverArgument::PseudoInverse => Self::PseudoInverse,
            SolverArgument::Bounded => Self::Bounded,
        }
    }
}

/// Identifies, writes `estimate.json`, `report.md` and `report.html`, and prints the table.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let common = &arguments.common;
    let Input { problem, data } = common.read()?;
    let line = common.talks().then(Line::new);
    let options = Options::default()
        .with_strategy(arguments.strategy.into())
        .with_solver(arguments.solver.into())
        .with_progress(line.as_ref().map(Line::sink));
    let result = identify::identify(&problem, &data, &options);
    if let Some(line) = line {
        line.clear();
    }
    let identification = result?;
    let json = report::estimate_json(&problem, &identification);
    let folder = common.folder(&problem);
    let shown = PlotData::of_identification(&problem, &data, &identification)?;
    let told = report::identification_report(&problem, &identification, &shown);
    output::write_report(&folder, &[("estimate.json", &json)], &told)?;
    if common.json {
        output::print(&json)?;
    } else if common.talks() {
        output::print(&report::estimate_text(&problem, &identification))?;
        output::print(&format!("\nWritten to {}: estimate.json, report.md, report.html\n", folder.display()))?;
    }
    Ok(diagnostic::judged(&identification, common.quiet))
}
