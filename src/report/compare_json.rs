//! `compare.json`.

use serde::Serialize;

use super::json::{Both, to_text};
use crate::identify::{Baseline, Comparison, Identification, SolverChoice};
use crate::problem::Problem;

#[derive(Debug, Serialize)]
struct Document<'a> {
    problem: &'a str,
    registered: Both,
    /// One row per strategy and solver.
    rows: Vec<Row<'a>>,
    /// One row per part of the elasticity that is kept, strategy joint.
    ablations: Vec<Ablated<'a>>,
}

#[derive(Debug, Serialize)]
struct Row<'a> {
    strategy: &'a str,
    solver: &'a str,
    #[serde(flatten)]
    errors: Both,
    iterations: u64,
    evaluations: u64,
    seconds: f64,
    termination: &'a str,
    trusted: bool,
    reduced_chi2: Option<f64>,
    condition_number: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Ablated<'a> {
    elasticity: &'a str,
    parameters: usize,
    #[serde(flatten)]
    row: Row<'a>,
}

impl<'a> From<&'a Identification> for Row<'a> {
    fn from(result: &'a Identification) -> Self {
        Self {
            strategy: result.strategy.as_str(),
            solver: result.solver.as_str(),
            errors: (&result.fitted).into(),
            iterations: result.iterations,
            evaluations: result.evaluations,
            seconds: result.seconds,
            termination: result.termination.as_str(),
            trusted: result.is_trusted(),
            reduced_chi2: result.reduced_chi2,
            condition_number: Some(result.identifiability.condition_number()),
        }
    }
}

impl<'a> From<&'a Baseline> for Row<'a> {
    fn from(result: &'a Baseline) -> Self {
        Self {
            strategy: result.strategy(),
            solver: SolverChoice::PseudoInverse.as_str(),
            errors: (&result.errors).into(),
            iterations: result.iterations,
            evaluations: result.evaluations,
            seconds: result.seconds,
            termination: result.termination.as_str(),
            trusted: result.termination.converged(),
            reduced_chi2: None,
            condition_number: None,
        }
    }
}

/// A comparison as JSON text, ending in a line break.
pub fn compare_json(problem: &Problem, comparison: &Comparison) -> String {
    to_text(&Document {
        problem: &problem.name,
        registered: (&comparison.joint.registered).into(),
        rows: comparison.strategies.iter().map(Row::from).chain(comparison.paper.iter().map(Row::from)).collect(),
        ablations: comparison
            .ablations
            .iter()
            .map(|(ablation, result)| Ablated {
                elasticity: ablation.as_str(),
                parameters: result.unknowns.len(),
                row: result.into(),
            })
            .collect(),
    })
}
