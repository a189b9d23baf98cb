//! Rank deficiency, domains, counters and termination.

use std::ops::Range;

use argmin::core::observers::Observe;
use argmin::core::{Error, KV, State as _};
use flexcal::least_squares::solver::{Settings, State, Termination, minimise, minimise_observed};
use flexcal::least_squares::{Block, Fit, LeastSquares, LinearRows, RowsError};
use nalgebra::{DMatrix, DVector};

/// Linear problem r = A x + b.
struct Linear {
    matrix: DMatrix<f64>,
    constant: DVector<f64>,
}

impl LeastSquares for Linear {
    fn parameters(&self) -> usize {
        self.matrix.ncols()
    }

    fn items(&self) -> usize {
        self.matrix.nrows()
    }

    fn rows_per_item(&self) -> usize {
        1
    }

    fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
        for (out, i) in out.iter_mut().zip(items) {
            *out = (self.matrix.row(i) * x)[0] + self.constant[i];
        }
    }

    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
        self.residuals(x, items.clone(), block.column_mut(x.len()));
        for j in 0..x.len() {
            let column = self.matrix.column(j);
            block.column_mut(j).copy_from_slice(&column.as_slice()[items.clone()]);
        }
    }
}

fn wave(i: usize, j: usize) -> f64 {
    (1.0 + 3.7 * i as f64 + 1.9 * (j * j) as f64 + 0.31 * (i * j) as f64).sin()
}

/// Returns a problem with equal columns 1 and 4 and a zero column 2.
fn redundant() -> Linear {
    let mut matrix = DMatrix::from_fn(40, 6, wave);
    let column = matrix.column(1).clone_owned();
    matrix.set_column(4, &column);
    matrix.column_mut(2).fill(0.0);
    Linear { matrix, constant: DVector::from_fn(40, |i, _| 1.0 + wave(i, 9)) }
}

#[test]
fn redundant_unknowns_take_the_shortest_solution() {
    let problem = redundant();
    let expected = -problem.matrix.clone().svd(true, true).solve(&problem.constant, 1e-10).unwrap();
    let solution = minimise(Fit::new(&problem), DVector::zeros(6), &Settings::default());
    assert!(solution.termination.converged());
    assert!((&solution.x - &expected).norm() < 1e-12 * expected.norm());
    assert!(solution.iterations <= 3);
    // From another start the unidentifiable combinations x₁ − x₄ and x₂ stay unchanged.
    let start = DVector::from_fn(6, |j, _| 1.0 + j as f64);
    let solution = minimise(Fit::new(&problem), start, &Settings::default());
    assert!((solution.x[1] - solution.x[4] + 3.0).abs() < 1e-12);
    assert!((solution.x[1] + solution.x[4] - expected[1] - expected[4]).abs() < 1e-12);
    assert!((solution.x[2] - 3.0).abs() < 1e-13);
}

#[test]
fn linear_rows_decide_what_the_data_cannot() {
    let problem = redundant();
    // x₁ − x₄ = 1 and x₂ = 5 are added as rows.
    let mut matrix = DMatrix::zeros(2, 6);
    (matrix[(0, 1)], matrix[(0, 4)], matrix[(1, 2)]) = (1.0, -1.0, 2.0);
    let rows = LinearRows { matrix, constant: DVector::from_vec(vec![-1.0, -10.0]) };
    let fit = Fit::new(&problem).with_rows(rows).unwrap();
    let solution = minimise(fit, DVector::zeros(6), &Settings::default());
    assert!((solution.x[1] - solution.x[4] - 1.0).abs() < 1e-12);
    assert!((solution.x[2] - 5.0).abs() < 1e-12);
    let wrong = LinearRows { matrix: DMatrix::zeros(1, 5), constant: DVector::zeros(1) };
    let refused = Fit::new(&problem).with_rows(wrong).err();
    assert_eq!(refused, Some(RowsError::Columns { columns: 5, parameters: 6 }));
}

/// Problem r = ln x, defined for x > 0 only; the step from 3 is −3 ln 3.
struct Logarithm;

impl LeastSquares for Logarithm {
    fn parameters(&self) -> usize {
        1
    }

    fn items(&self) -> usize {
        1
    }

    fn rows_per_item(&self) -> usize {
        1
    }

    fn residuals(&self, x: &DVector<f64>, _items: Range<usize>, out: &mut [f64]) {
        out[0] = x[0].ln();
    }

    fn linearise(&self, x: &DVector<f64>, _items: Range<usize>, block: &mut Block) {
        block.column_mut(0)[0] = x[0].recip();
        block.column_mut(1)[0] = x[0].ln();
    }
}

#[test]
fn steps_out_of_the_domain_are_taken_back() {
    for start in [3.0, 10.0, 1e6, 1e-6] {
        let solution =
            minimise(Fit::new(&Logarithm), DVector::from_element(1, start), &Settings::default());
        assert!(solution.termination.converged(), "{start}: {}", solution.termination);
        assert!((solution.x[0] - 1.0).abs() < 1e-9, "{start}: {}", solution.x[0]);
    }
    let outside =
        minimise(Fit::new(&Logarithm), DVector::from_element(1, -1.0), &Settings::default());
    assert_eq!(outside.termination, Termination::OutsideDomainAtStart);
    assert!(!outside.termination.converged());
    let flat = minimise(Fit::new(&Logarithm), DVector::zeros(1), &Settings::default());
    assert_eq!(flat.termination, Termination::OutsideDomainAtStart);
}

#[test]
fn counters_limit_and_names() {
    let problem = redundant();
    let solution = minimise(Fit::new(&problem), DVector::zeros(6), &Settings::default());
    assert_eq!(solution.iterations, solution.cost_evaluations);
    assert!(solution.linearisations <= solution.iterations + 1);
    let limited = Settings { max_iterations: 0, ..Settings::default() };
    let stopped = minimise(Fit::new(&problem), DVector::zeros(6), &limited);
    assert_eq!(stopped.termination, Termination::IterationLimit);
    assert_eq!(stopped.termination.as_str(), "iteration-limit");
    assert_eq!(stopped.termination.to_string(), "stopped: the limit of iterations was reached");
    let mismatch = minimise(Fit::new(&problem), DVector::zeros(5), &Settings::default());
    assert_eq!(mismatch.termination, Termination::SizeMismatch);
}

#[test]
fn nothing_to_estimate_and_nothing_measured() {
    let empty = Linear { matrix: DMatrix::zeros(0, 3), constant: DVector::zeros(0) };
    let solution = minimise(Fit::new(&empty), DVector::from_element(3, 2.0), &Settings::default());
    assert_eq!(solution.termination, Termination::ZeroResidual);
    let fixed = Linear { matrix: DMatrix::zeros(4, 0), constant: DVector::from_element(4, 1.0) };
    let solution = minimise(Fit::new(&fixed), DVector::zeros(0), &Settings::default());
    assert_eq!(solution.termination, Termination::Gradient);
    assert!((solution.cost - 2.0).abs() < 1e-15);
}

/// Observer that counts iterations and fails at the tenth.
struct Watch(std::sync::Arc<std::sync::atomic::AtomicU64>);

impl Observe<State> for Watch {
    fn observe_iter(&mut self, state: &State, log: &KV) -> Result<(), Error> {
        assert!(state.get_param().is_some() && log.get("ratio").is_some());
        let seen = self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        if seen < 10 { Ok(()) } else { Err(Error::msg("enough")) }
    }
}

#[test]
fn an_observer_sees_every_iteration_and_may_stop() {
    let seen = std::sync::Arc::new(std::sync::atomic::AtomicU64::new(0));
    let start = DVector::from_element(1, 3.0);
    let solution = minimise_observed(
        Fit::new(&Logarithm),
        start,
        &Settings::default(),
        Some(Watch(seen.clone())),
    );
    assert_eq!(seen.load(std::sync::atomic::Ordering::Relaxed), solution.iterations);
    let problem = crate::collections::Analytic {
        unknowns: 2,
        rows: 2,
        value: crate::collections::functions::rosenbrock::<f64>,
        dual: crate::collections::functions::rosenbrock::<num_dual::Dual64>,
    };
    let start = DVector::from_vec(vec![-1.2, 1.0]);
    let solution =
        minimise_observed(Fit::new(&problem), start, &Settings::default(), Some(Watch(seen)));
    assert_eq!(solution.termination, Termination::Interrupted);
}
