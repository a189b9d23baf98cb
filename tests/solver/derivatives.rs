//! Derivative check: no finding on right derivatives, a finding on a wrong one.

use std::ops::Range;

use flexcal::least_squares::{Block, LeastSquares, check_jacobian};
use nalgebra::DVector;
use num_dual::Dual64;

use crate::collections::Analytic;
use crate::collections::functions as f;

/// Problem with one scaled column of derivatives.
struct Planted<P> {
    problem: P,
    column: usize,
    factor: f64,
}

impl<P: LeastSquares> LeastSquares for Planted<P> {
    fn parameters(&self) -> usize {
        self.problem.parameters()
    }

    fn items(&self) -> usize {
        self.problem.items()
    }

    fn rows_per_item(&self) -> usize {
        self.problem.rows_per_item()
    }

    fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
        self.problem.residuals(x, items, out);
    }

    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
        self.problem.linearise(x, items, block);
        block.column_mut(self.column).iter_mut().for_each(|v| *v *= self.factor);
    }
}

fn osborne() -> (Analytic, DVector<f64>) {
    let problem =
        Analytic { unknowns: 11, rows: 65, value: f::osborne2::<f64>, dual: f::osborne2::<Dual64> };
    (problem, DVector::from_vec(vec![1.3, 0.65, 0.65, 0.7, 0.6, 3.0, 5.0, 7.0, 2.0, 4.5, 5.5]))
}

#[test]
fn right_derivatives_agree_to_1e_8() {
    let (problem, x) = osborne();
    let check = check_jacobian(&problem, &x, &x);
    let (column, worst) = check.worst().unwrap();
    println!("worst column {column}: {worst:?}");
    assert_eq!(check.columns.len(), 11);
    assert!(worst.relative_error < 1e-8);
    assert!(check.columns.iter().all(|c| c.accuracy < 1e-8));
}

#[test]
fn a_planted_error_is_found_and_sized() {
    let (problem, x) = osborne();
    for error in [1e-7, 1e-3, -2.0] {
        let problem = Planted { problem: Analytic { ..problem }, column: 6, factor: 1.0 + error };
        let (column, worst) = check_jacobian(&problem, &x, &x).worst().unwrap();
        assert_eq!(column, 6);
        assert!((worst.relative_error / error.abs() - 1.0).abs() < 0.05, "{worst:?}");
    }
}

#[test]
fn an_unknown_without_effect_and_one_with_little() {
    // x₁ has no effect; x₂ has a hundred-millionth of the effect of x₀.
    fn rows<D: f::Scalar>(x: &[D]) -> Vec<D> {
        vec![x[0].sin() + x[1] * 0.0, x[0].exp() + x[2].sin() * 1e-8]
    }
    let problem = Analytic { unknowns: 3, rows: 2, value: rows::<f64>, dual: rows::<Dual64> };
    let check =
        check_jacobian(&problem, &DVector::from_element(3, 0.3), &DVector::from_element(3, 1.0));
    assert!(check.columns[1].relative_error <= 0.0);
    assert!(check.columns[2].relative_error < 1e-5);
    let planted = Planted { problem, column: 2, factor: 1.5 };
    let check =
        check_jacobian(&planted, &DVector::from_element(3, 0.3), &DVector::from_element(3, 1.0));
    assert!(check.columns[2].relative_error > 0.4);
}
