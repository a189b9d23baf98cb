//! Provisional fits: steps with the derivatives of an earlier point.

use std::ops::Range;

use flexcal::least_squares::{
    Block, Fit, LeastSquares, Linearisation, LinearisationCache, Objective as _,
};
use nalgebra::DVector;

/// Number of amplitudes, large enough for derivatives to be kept.
const MANY: usize = 100;

/// Waves of many orders with free amplitudes, and the product of a height and a slope.
struct Waves {
    unit: f64,
}

impl LeastSquares for Waves {
    fn parameters(&self) -> usize {
        MANY + 2
    }

    fn items(&self) -> usize {
        900
    }

    fn rows_per_item(&self) -> usize {
        1
    }

    fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
        for (out, t) in out.iter_mut().zip(items.map(|i| i as f64 / 900.0)) {
            let waves: f64 = (0..MANY).map(|k| x[k] * (3.0 * k as f64 * t).cos()).sum();
            *out = (waves + 5.0 * x[MANY] * (x[MANY + 1] * t).sin() - (700.0 * t * t).cos())
                / self.unit;
        }
    }

    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
        self.residuals(x, items.clone(), block.column_mut(MANY + 2));
        for (row, t) in items.map(|i| i as f64 / 900.0).enumerate() {
            for k in 0..MANY {
                block.column_mut(k)[row] = (3.0 * k as f64 * t).cos() / self.unit;
            }
            block.column_mut(MANY)[row] = 5.0 * (x[MANY + 1] * t).sin() / self.unit;
            block.column_mut(MANY + 1)[row] =
                5.0 * x[MANY] * t * (x[MANY + 1] * t).cos() / self.unit;
        }
    }
}

#[test]
fn in_passing_derivatives_of_the_start_serve_in_any_unit() {
    let cache = LinearisationCache::provisional();
    let gradient = |found: &Linearisation| found.triangle.tr_mul(&found.projected);
    let at = |height: f64| {
        let mut x = DVector::from_element(MANY + 2, 0.01);
        x[MANY] = height;
        x
    };
    let (start, near) = (at(0.2), at(0.2004));
    for (x, unit) in [(&start, 0.1), (&near, 0.1), (&near, 0.3), (&start, 0.3)] {
        let waves = Waves { unit };
        let (fit, plain) =
            (Fit::new(&waves).with_cache(&cache, 1, unit), Fit::new(&waves).linearise(x));
        let found = fit.linearise(x);
        assert!((found.cost / plain.cost - 1.0).abs() < 1e-9, "{unit}");
        assert!(
            (gradient(&found) - gradient(&plain)).norm() < 0.01 * gradient(&plain).norm(),
            "{unit}"
        );
        // Second derivatives difference the exact derivatives of each point.
        let second = |fit: &Fit<Waves>| fit.curvature(x, &|_| true).unwrap();
        assert_eq!(second(&fit), second(&Fit::new(&waves)));
    }
}

#[test]
fn in_passing_what_had_no_effect_is_looked_at_again() {
    let cache = LinearisationCache::provisional();
    let mut x = DVector::from_element(MANY + 2, 0.01);
    x[MANY] = 0.0;
    let waves = Waves { unit: 0.1 };
    let fit = Fit::new(&waves).with_cache(&cache, 1, 0.1);
    assert!(fit.linearise(&x).triangle.column(MANY + 1).iter().all(|value| *value == 0.0));
    x[MANY] = 1e-3;
    assert!(fit.linearise(&x).triangle.column(MANY + 1).amax() > 0.0);
}
