//! Solver choice of `auto`, compared with the table of `benches/RESULTS.md`.

#![expect(clippy::panic, reason = "a test that fails may panic")]

use std::fs;

use crate::common::arms::{path, with_parameters};
use crate::common::bounded::Bounded;
use argmin::core::observers::Observe;
use flexcal::fit::SolverChoice;
use flexcal::least_squares::Loss;
use flexcal::least_squares::solver::{
    GaussNewtonSettings, PseudoInverseSettings, Settings, Solution, State, minimise,
    minimise_constrained_by, minimise_gauss_newton, minimise_pseudo_inverse,
};
use flexcal::model::Model;
use flexcal::problem::Problem;

/// Allowed ratio of the time of `auto`, summed over a class, to that of the fastest solver that
/// reaches every optimum.
const SLOWER: f64 = 2.0;

/// Classes of the table; true if their models have bounds.
const CLASSES: [(&str, bool); 8] = [
    ("rigid, identifiable", false),
    ("rigid, redundant", false),
    ("elastic", false),
    ("bounded", true),
    ("robust", false),
    ("sequential", false),
    ("NIST", false),
    ("Moré–Garbow–Hillstrom", false),
];

/// Row of the table.
struct Row<'a> {
    solver: &'a str,
    problem: &'a str,
    optimum: &'a str,
    /// Time of the solver [ms].
    time: f64,
}

/// Returns the rows of a section.
fn rows<'a>(page: &'a str, class: &str) -> Vec<Row<'a>> {
    let (_, section) = page.split_once(&format!("\n## {class}\n")).unwrap();
    let section = section.split("\n## ").next().unwrap();
    let cells = section.lines().filter_map(|line| line.strip_prefix("| ")?.strip_suffix(" |"));
    let cells = cells.map(|line| line.split(" | ").collect::<Vec<&str>>()).skip(1);
    cells
        .map(|cells| {
            let [problem, solver, optimum, .., time] = cells[..] else {
                panic!("{class}: {cells:?}")
            };
            Row { solver, problem, optimum, time: time.parse().unwrap() }
        })
        .collect()
}

fn auto(bounded: bool) -> (SolverChoice, Option<&'static str>) {
    let file = "problems/lunar-sampler/problem.toml";
    let problem = if bounded {
        with_parameters(file, "\"joint*.theta\" = { sigma_deg = 1, min_deg = -1, max_deg = 1 }\n")
    } else {
        Problem::read(&path(file)).unwrap()
    };
    let model = Model::new(&problem, &[String::new()], &[String::new()]).unwrap();
    assert_eq!(model.is_bounded(), bounded);
    (SolverChoice::Auto.decide(&model), SolverChoice::Auto.reason(&model))
}

/// Returns the faults of the solver `pick` in these rows.
fn faults(rows: &[Row], pick: &str) -> Vec<String> {
    let of = |solver: &str| rows.iter().filter(|row| row.solver == solver).collect::<Vec<_>>();
    let missed = |rows: &[&Row]| rows.iter().filter(|row| !row.optimum.starts_with("yes")).count();
    let total = |rows: &[&Row], beside: &[&Row]| {
        let both =
            rows.iter().filter(|row| beside.iter().any(|other| other.problem == row.problem));
        both.map(|row| row.time).sum::<f64>()
    };
    let picked = of(pick);
    if picked.is_empty() {
        return vec![format!("{pick} is not in the table")];
    }
    let lost = picked.iter().filter(|row| !row.optimum.starts_with("yes"));
    let mut faults: Vec<String> =
        lost.map(|row| format!("{pick} on {}: {}", row.problem, row.optimum)).collect();
    for row in rows {
        let others = of(row.solver);
        let [picked_time, other] = [total(&picked, &others), total(&others, &picked)];
        if missed(&others) == 0 && picked_time > SLOWER * other {
            faults.push(format!("{pick} takes {picked_time} ms, {} only {other} ms", row.solver));
        }
    }
    faults.dedup();
    faults
}

#[test]
fn auto_takes_what_the_table_recommends() {
    let page = fs::read_to_string(path("benches/RESULTS.md")).unwrap();
    for (class, bounded) in CLASSES {
        let rows = rows(&page, class);
        let faults = faults(&rows, auto(bounded).0.as_str());
        assert!(faults.is_empty(), "{class}:\n{}", faults.join("\n"));
    }
    let sections = page.lines().filter(|line| line.starts_with("## ")).count();
    assert_eq!(sections, CLASSES.len() + 1, "every section but the summary is a class");
}

/// Checks the choice on fits: `auto` reaches the optimum with at most twice the evaluations of the
/// most economical solver.
#[test]
fn auto_is_best_where_bounds_bind() {
    for (name, solvers) in [("stiffness", 4), ("tight-geometry", 4), ("mild-constraints", 2)] {
        let bounded = Bounded::read(name);
        let residuals = bounded.residuals();
        let fit = bounded.fit(&residuals);
        let solve = |solver: SolverChoice| {
            let (within, limits) = (solver.within().unwrap(), (&bounded.bounds, &bounded.rows));
            let found = minimise_constrained_by(
                within,
                &fit,
                bounded.nominal(),
                limits,
                &Settings::default(),
                None::<Silent>,
            );
            let (steps, count) = (found.iterations, found.evaluations());
            println!(
                "{name}, {}: {steps} steps, {count} evaluations, cost {:.12e}",
                solver.as_str(),
                found.cost
            );
            assert!((0..found.x.len()).all(|j| bounded.bounds.lower()[j] <= found.x[j]
                && found.x[j] <= bounded.bounds.upper()[j]));
            found
        };
        let keeps =
            SolverChoice::SOLVERS.iter().copied().filter(|solver| solver.keeps(&bounded.model));
        let found: Vec<Solution> = keeps.map(solve).collect();
        assert_eq!(found.len(), solvers);
        let auto = solve(SolverChoice::Auto.decide(&bounded.model));
        let best = found.iter().map(|found| found.cost).fold(f64::INFINITY, f64::min);
        assert!(auto.cost <= best * (1.0 + 1e-8), "{name}: {:.12e} against {best:.12e}", auto.cost);
        let reached = found.iter().filter(|found| found.cost <= best * (1.0 + 1e-8));
        let counts: Vec<u64> = reached.map(Solution::evaluations).collect();
        assert!(counts.len() + 1 >= solvers, "{name}: only the naive way may stop short");
        let least = counts.into_iter().min().unwrap();
        assert!(
            auto.evaluations() <= 2 * least,
            "{name}: {} evaluations, the thriftiest {least}",
            auto.evaluations()
        );
    }
}

/// Checks the choice under robust losses, with gross errors in the data.
#[test]
fn auto_is_best_under_robust_losses() {
    let bounded = Bounded::read("stiffness").with_gross_errors();
    let residuals = bounded.residuals();
    let free = auto(false).0;
    for loss in [
        Loss::Huber { threshold: Loss::HUBER_POSITION },
        Loss::L1 { slope: Loss::L1_POSITION, smoothing: Loss::L1_SMOOTHING },
    ] {
        let fit = || bounded.fit(&residuals).with_loss(loss);
        let found = [
            SolverChoice::LevenbergMarquardt,
            SolverChoice::GaussNewton,
            SolverChoice::PseudoInverse,
        ]
        .map(|solver| {
            let found = match solver {
                SolverChoice::GaussNewton => {
                    minimise_gauss_newton(fit(), bounded.nominal(), &GaussNewtonSettings::default())
                }
                SolverChoice::PseudoInverse => minimise_pseudo_inverse(
                    fit(),
                    bounded.nominal(),
                    &PseudoInverseSettings::default(),
                ),
                _ => minimise(fit(), bounded.nominal(), &Settings::default()),
            };
            let (steps, count, cost) = (found.iterations, found.evaluations(), found.cost);
            println!(
                "{loss:?}, {}: {steps} steps, {count} evaluations, cost {cost:.12e}",
                solver.as_str()
            );
            (solver, found)
        });
        let best = found.iter().map(|(_, found)| found.cost).fold(f64::INFINITY, f64::min);
        let reached = found.iter().filter(|(_, found)| found.cost <= best * (1.0 + 1e-8));
        let least = reached.map(|(_, found)| found.evaluations()).min().unwrap();
        let auto =
            found.iter().find(|(solver, _)| *solver == free).map(|(_, found)| found).unwrap();
        assert!(
            auto.termination.converged() && auto.cost <= best * (1.0 + 1e-8),
            "{loss:?}: {:.12e}",
            auto.cost
        );
        assert!(
            auto.evaluations() <= 2 * least,
            "{loss:?}: {} evaluations, the thriftiest {least}",
            auto.evaluations()
        );
    }
}

struct Silent;

impl Observe<State> for Silent {}

#[test]
fn the_rule_is_written_down() {
    let rule = fs::read_to_string(path("docs/solvers.md")).unwrap();
    assert!(rule.contains(&format!("at most {SLOWER} times")));
    for bounded in [false, true] {
        let (solver, reason) = auto(bounded);
        let line = format!("| {} | `{}` |", reason.unwrap(), solver.as_str());
        assert!(rule.contains(&line), "{line}");
    }
    for (class, _) in CLASSES {
        assert!(rule.contains(class), "{class}");
    }
}

#[test]
fn a_solver_that_fails_or_is_slow_is_found() {
    let row = |problem, solver, optimum, time| Row { solver, problem, optimum, time };
    let table = [
        row("a", "fast", "yes", 1.0),
        row("b", "fast", "yes (iteration-limit)", 1.0),
        row("a", "slow", "yes", 2.0),
        row("b", "slow", "yes", 2.5),
        row("a", "wrong", "yes", 0.1),
        row("b", "wrong", "no: diverged", 0.1),
        row("b", "of one", "yes", 1.3),
    ];
    assert!(faults(&table, "fast").is_empty());
    assert_eq!(faults(&table, "slow"), ["slow takes 4.5 ms, fast only 2 ms"]);
    assert_eq!(faults(&table, "wrong"), ["wrong on b: no: diverged"]);
    assert_eq!(faults(&table, "other"), ["other is not in the table"]);
}
