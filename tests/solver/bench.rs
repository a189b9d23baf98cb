//! Shared functions of the solver tests.

use flexcal::least_squares::solver::{Bounds, Inequalities, Settings};
use flexcal::least_squares::{Linearisation, Objective};
use nalgebra::DVector;

/// Creates a problem from a function of the collections.
macro_rules! analytic {
    ($function:ident, $unknowns:expr, $rows:expr) => {
        $crate::collections::Analytic {
            unknowns: $unknowns,
            rows: $rows,
            value: $crate::collections::functions::$function::<f64>,
            dual: $crate::collections::functions::$function::<num_dual::Dual64>,
        }
    };
}
pub(super) use analytic;

pub fn vector(values: &[f64]) -> DVector<f64> {
    DVector::from_column_slice(values)
}

pub fn tight() -> Settings {
    Settings {
        gradient_tolerance: 1e-13,
        cost_tolerance: 1e-15,
        step_tolerance: 1e-13,
        ..Settings::default()
    }
}

/// Objective that fails the test if it is evaluated outside bounds, or outside rows beyond
/// rounding.
pub struct Guarded<'a, O> {
    pub objective: O,
    pub bounds: &'a Bounds,
    pub rows: Option<&'a Inequalities>,
}

impl<O: Objective> Guarded<'_, O> {
    fn check(&self, x: &DVector<f64>) {
        for (j, x) in x.iter().enumerate() {
            assert!(
                (self.bounds.lower()[j]..=self.bounds.upper()[j]).contains(x),
                "unknown {j} = {x} out of bounds"
            );
        }
        let Some(rows) = self.rows else { return };
        let values = rows.matrix() * x;
        for (i, value) in values.iter().enumerate() {
            let rounding = 1e-13 * (1.0 + x.amax());
            let (lower, upper) = (rows.lower()[i] - rounding, rows.upper()[i] + rounding);
            assert!((lower..=upper).contains(value), "row {i} = {value} not in {lower} to {upper}");
        }
    }
}

impl<O: Objective> Objective for Guarded<'_, O> {
    fn parameters(&self) -> usize {
        self.objective.parameters()
    }

    fn cost(&self, x: &DVector<f64>) -> f64 {
        self.check(x);
        self.objective.cost(x)
    }

    fn linearise(&self, x: &DVector<f64>) -> Linearisation {
        self.check(x);
        self.objective.linearise(x)
    }
}
