//! One fit of a study and how far it is from the truth.

use super::data::Data;
use super::plan::{Campaign, Cell};
use super::tally::{Fitted, ParameterScore, Score};
use crate::identify::{Distrust, Estimate, Identification, IdentifyError, Options, identify};
use crate::problem::Problem;

impl Campaign {
    /// The problem as a cell declares it.
    pub(super) fn problem_of(&self, cell: &Cell) -> Problem {
        let mut problem = self.problem.clone();
        problem.data.position_sigma = Some(cell.sigma);
        problem
    }

    /// Fits a repetition, counted from 0; also the time that the fit took [s].
    pub(super) fn fit(&self, problem: &Problem, cell: &Cell, repetition: usize) -> (Score, f64) {
        let Some(data) = self.data(cell, repetition) else { return (Score::Failed("no-equilibrium"), 0.0) };
        let options = Options { strategy: cell.strategy, solver: cell.solver, ..Options::default() };
        match identify(problem, &data.dataset, &options) {
            // The files fit each other: what is left is a nominal arm that does not stand in one of the poses.
            Err(IdentifyError::Input(_)) => (Score::Failed("no-equilibrium"), 0.0),
            Err(_) => (Score::Failed("cannot-be-fitted"), 0.0),
            Ok(found) => (score(&data, &found), found.seconds),
        }
    }
}

fn score(data: &Data, found: &Identification) -> Score {
    match &found.distrust {
        Some(Distrust::TooFewEquations { .. }) => return Score::Failed("too-few-equations"),
        Some(Distrust::NotConverged(_) | Distrust::HeldOutNotConverged(_)) => return Score::Failed("not-converged"),
        Some(Distrust::Misses { .. }) if !found.termination.converged() => return Score::Failed("not-converged"),
        Some(Distrust::Misses { .. }) => return Score::Failed("misses-the-data"),
        Some(Distrust::BeyondPrior { .. }) => return Score::Failed("beyond-its-prior"),
        None => {}
    }
    let held_out = &found.fitted.held_out;
    if !held_out.rms.norm.is_finite() {
        return Score::Failed("no-equilibrium");
    }
    let parameters = found.estimates.iter().zip(found.x.iter()).zip(&data.truth).map(|((estimate, x), truth)| {
        truth.map(|truth| ParameterScore { error: x - truth, std_error: of_x(estimate) })
    });
    Score::Fitted(Fitted {
        held_out_mean: held_out.mean.norm,
        held_out_rms: held_out.rms.norm,
        reduced_chi2: found.reduced_chi2,
        iterations: found.iterations,
        parameters: parameters.collect(),
    })
}

/// The standard error of x, which is a logarithm for stiffnesses.
fn of_x(estimate: &Estimate) -> Option<f64> {
    let scale = if estimate.unit.is_relative() { estimate.estimate } else { 1.0 };
    estimate.std_error.map(|error| error / scale)
}
