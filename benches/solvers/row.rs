//! Rows of the table: each solver on each problem.

use std::time::Instant;

use flexcal::fit::{Options, SolverChoice, Strategy, identify};
use flexcal::least_squares::solver::BoundMethod;
use nalgebra::DVector;

use crate::arms::Lunar;
use crate::case::{Case, Class};
use crate::method::{Method, Run};

/// The optimum counts as reached if the cost exceeds the lowest known one by at most this fraction.
const REACHED: f64 = 1e-8;
/// The same tolerance for the strategy `sequential`, which stops when a sweep gains less than 1e-6.
const REACHED_BY_SWEEPS: f64 = 1e-4;
/// Largest ½‖r‖² that counts as zero if the optimum is zero, for residuals of order one.
const ZERO: f64 = 5e-15;
/// Time for the repetitions of a solver on a problem [s].
const BUDGET: f64 = 0.3;
/// Largest number of repetitions.
const REPETITIONS: usize = 201;

/// Result of a solver on a problem.
pub struct Row {
    pub class: Class,
    pub problem: String,
    pub solver: &'static str,
    /// Whether the optimum is reached; otherwise what is wrong.
    pub reached: Result<(), String>,
    /// Reason of termination, unless the solver reports convergence.
    pub complaint: Option<String>,
    pub iterations: u64,
    pub residuals: usize,
    /// `None` if they are counted together with the evaluations of residuals.
    pub jacobians: Option<usize>,
    /// Median time [s].
    pub seconds: f64,
}

/// Runs the solvers that take part in `case`, with repetitions in turn.
pub fn measure(case: &Case) -> Vec<Row> {
    let methods: Vec<Method> =
        Method::EACH.into_iter().filter(|method| method.takes_part(case)).collect();
    let (runs, seconds) = repeated(methods.len(), |k| methods[k].run(case), |run| run.seconds);
    let costs = || runs.iter().map(|run| run.cost);
    let best = |listed: f64| {
        let near = costs().filter(|cost| (cost / listed - 1.0).abs() <= case.accuracy);
        near.reduce(f64::min).unwrap_or(listed)
    };
    // Listed minima have few digits; the lowest cost near one is more accurate.
    let optima: Vec<f64> = match case.minima[..] {
        [] => vec![costs().fold(f64::INFINITY, f64::min)],
        _ => case
            .minima
            .iter()
            .map(|&listed| if listed == 0.0 { 0.0 } else { best(listed) })
            .collect(),
    };
    let row = |((run, seconds), method): ((&Run, f64), Method)| Row {
        class: case.class,
        problem: case.name.clone(),
        solver: method.name(),
        reached: reached(run, &optima, case),
        complaint: run.complaint.clone(),
        iterations: run.iterations,
        residuals: run.residuals,
        jacobians: Some(run.jacobians),
        seconds,
    };
    runs.iter().zip(seconds).zip(methods).map(row).collect()
}

/// Checks whether a run reached one of `optima`; the error describes where it ended.
fn reached(run: &Run, optima: &[f64], case: &Case) -> Result<(), String> {
    if optima.iter().any(|&best| run.cost <= best * (1.0 + REACHED) + ZERO * f64::from(best == 0.0))
    {
        return Ok(());
    }
    let best = optima.iter().copied().fold(f64::INFINITY, f64::min);
    let start = case.cost(&case.start);
    Err(if run.cost.is_infinite() && case.bounds.is_some() {
        "outside the limits".to_owned()
    } else if !run.cost.is_finite() {
        "outside the domain".to_owned()
    } else if run.cost >= start {
        "no better than the start".to_owned()
    } else if best == 0.0 {
        format!("cost {:.1e} instead of 0", run.cost)
    } else {
        format!("cost {:.1e} of the optimum above it", run.cost / best - 1.0)
    })
}

/// Runs the strategy `sequential` with each solver that it supports.
pub fn sequential(arm: &Lunar) -> Vec<Row> {
    let joint = arm.case(Class::Sequential, "", DVector::zeros(0), None);
    let joint_options = Options::default();
    let cost = |options: &Options| {
        let begin = Instant::now();
        let identification = identify(&arm.problem, &arm.data, options).unwrap();
        let seconds = begin.elapsed().as_secs_f64();
        (joint.cost(&identification.x), identification, seconds)
    };
    let (best, ..) = cost(&joint_options);
    let is_supported =
        |solver: &SolverChoice| matches!(solver.within(), None | Some(BoundMethod::ActiveSet));
    let each: Vec<SolverChoice> =
        SolverChoice::SOLVERS.iter().copied().filter(is_supported).collect();
    let solve = |k: usize| {
        cost(&Options::default().with_strategy(Strategy::Sequential).with_solver(each[k]))
    };
    let (runs, seconds) = repeated(each.len(), solve, |run| run.2);
    let row = |((run, seconds), solver): (
        (&(f64, flexcal::fit::Identification, f64), f64),
        SolverChoice,
    )| {
        let (cost, identification, _) = run;
        let gap = cost / best - 1.0;
        Row {
            class: Class::Sequential,
            problem: arm.name(),
            solver: solver.as_str(),
            reached: if gap <= REACHED_BY_SWEEPS {
                Ok(())
            } else {
                Err(format!("cost {gap:.1e} of the optimum above it"))
            },
            complaint: (!identification.termination.converged())
                .then(|| identification.termination.as_str().to_owned()),
            iterations: identification.iterations,
            residuals: usize::try_from(identification.evaluations).unwrap(),
            jacobians: None,
            seconds,
        }
    };
    runs.iter().zip(seconds).zip(each).map(row).collect()
}

/// Returns the first run of each of `count` solvers and the median time of its repetitions; the
/// solvers are repeated in turn, so that changes of the machine's speed affect all of them.
fn repeated<T>(
    count: usize,
    mut run: impl FnMut(usize) -> T,
    time: impl Fn(&T) -> f64,
) -> (Vec<T>, Vec<f64>) {
    let first: Vec<T> = (0..count).map(&mut run).collect();
    let mut times: Vec<Vec<f64>> = first.iter().map(|run| vec![time(run)]).collect();
    let wanted = |times: &[f64]| (BUDGET / times[0]).clamp(1.0, REPETITIONS as f64);
    for round in 1..REPETITIONS {
        for (k, times) in times.iter_mut().enumerate() {
            if (round as f64) < wanted(times) {
                times.push(time(&run(k)));
            }
        }
    }
    let median = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    (first, times.into_iter().map(median).collect())
}
