//! Robust losses: gradient of the cost, independence of threads, and results of `SciPy`.

use std::ops::Range;

use flexcal::least_squares::solver::{Settings, minimise};
use flexcal::least_squares::{Block, CHUNK_ITEMS, Fit, LeastSquares, Loss, Objective};
use nalgebra::DVector;

const HUBER: Loss = Loss::Huber { threshold: 1.345 };
const L1: Loss = Loss::L1 { slope: 1.0, smoothing: 0.1 };

/// Decay x₀ exp(−x₁ t) − y(t) with `rows` readings per item; every eleventh reading has a gross
/// error.
struct Decay {
    items: usize,
    rows: usize,
}

impl Decay {
    fn reading(&self, i: usize) -> (f64, f64) {
        let t = 4.0 * i as f64 / (self.items * self.rows) as f64;
        let gross = if i % 11 == 5 { 30.0 } else { 0.0 };
        (t, 20.0 * (-0.7 * t).exp() + (3.7 * i as f64).sin() + gross)
    }
}

impl LeastSquares for Decay {
    fn parameters(&self) -> usize {
        2
    }

    fn items(&self) -> usize {
        self.items
    }

    fn rows_per_item(&self) -> usize {
        self.rows
    }

    fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
        for (out, i) in out.iter_mut().zip(items.start * self.rows..) {
            let (t, y) = self.reading(i);
            *out = x[0] * (-x[1] * t).exp() - y;
        }
    }

    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
        self.residuals(x, items.clone(), block.column_mut(2));
        for row in 0..block.rows() {
            let t = self.reading(items.start * self.rows + row).0;
            block.column_mut(0)[row] = (-x[1] * t).exp();
            block.column_mut(1)[row] = -t * x[0] * (-x[1] * t).exp();
        }
    }
}

#[test]
fn gradient_and_curvature_are_those_of_the_cost() {
    for s in [1e-3, 0.1, 1.0, 1.3, 1.4, 7.0, 1e3] {
        for loss in [Loss::Squares, HUBER, L1] {
            let h = 1e-5 * s;
            let slope = (loss.rho(s + h) - loss.rho(s - h)) / (4.0 * h * s);
            assert!((slope / loss.weight(s) - 1.0).abs() < 1e-6, "{loss:?} at {s}");
            let influence = |s: f64| loss.weight(s) * s;
            let curvature = (influence(s + h) - influence(s - h)) / (2.0 * h);
            assert!(
                (curvature - loss.curvature(s)).abs() < 1e-5 * loss.weight(s),
                "{loss:?} at {s}"
            );
        }
    }
    let problem = Decay { items: 20, rows: 3 };
    let x = DVector::from_vec(vec![15.0, 0.5]);
    for loss in [Loss::Squares, HUBER, L1] {
        let fit = Fit::new(&problem).with_loss(loss);
        let reduced = fit.linearise(&x);
        assert_eq!(reduced.cost.to_bits(), fit.cost(&x).to_bits());
        let gradient = reduced.triangle.tr_mul(&reduced.projected);
        for j in 0..2 {
            let at = |h: f64| {
                let mut x = x.clone();
                x[j] += h;
                fit.cost(&x)
            };
            let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
            assert!(
                (gradient[j] / difference - 1.0).abs() < 1e-7,
                "{loss:?}: {} {difference}",
                gradient[j]
            );
        }
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    let problem = Decay { items: 70 * CHUNK_ITEMS + 17, rows: 3 };
    let x = DVector::from_vec(vec![15.0, 0.5]);
    for loss in [HUBER, L1] {
        let fit = Fit::new(&problem).with_loss(loss);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (reduced, cost) = pool.install(|| (fit.linearise(&x), fit.cost(&x)));
            assert_eq!(reduced.cost.to_bits(), cost.to_bits());
            (reduced.triangle, reduced.projected, cost.to_bits())
        };
        assert_eq!(run(1), run(3));
    }
}

/// Results of `SciPy` 1.17.1, one reading per item:
///
/// ```python
/// i = np.arange(60); t = 4 * i / 60
/// y = 20 * np.exp(-0.7 * t) + np.sin(3.7 * i) + 30 * (i % 11 == 5)
/// least_squares(lambda x: x[0] * np.exp(-x[1] * t) - y, [15, 0.5], jac='cs', loss=loss, f_scale=scale,
///               ftol=1e-15, xtol=1e-15, gtol=1e-15, max_nfev=10000)
/// # ("huber", 1.345), ("soft_l1", 0.1); the slope of ours is 1, of soft_l1 its scale
/// ```
#[test]
fn answers_of_scipy() {
    let cases = [
        (HUBER, [20.082_455_408_6, 0.688_223_160_77], 210.136_322_102_572),
        (L1, [20.010_723_266_5, 0.686_282_964_50], 179.037_262_211_129),
    ];
    let problem = Decay { items: 60, rows: 1 };
    for (loss, x, cost) in cases {
        let start = DVector::from_vec(vec![15.0, 0.5]);
        let solution = minimise(Fit::new(&problem).with_loss(loss), start, &Settings::default());
        println!(
            "{loss:?}: {} in {} steps, cost {:.12}",
            solution.termination, solution.iterations, solution.cost
        );
        assert!(solution.termination.converged());
        assert!((solution.cost / cost - 1.0).abs() < 1e-9);
        assert!((&solution.x - DVector::from_column_slice(&x)).amax() < 1e-5, "{}", solution.x);
    }
}

#[test]
fn positions_converge_from_afar() {
    let problem = Decay { items: 40, rows: 3 };
    let l1 = Loss::L1 { slope: Loss::L1_POSITION, smoothing: Loss::L1_SMOOTHING };
    for loss in [Loss::Huber { threshold: Loss::HUBER_POSITION }, l1] {
        let fit = Fit::new(&problem).with_loss(loss);
        let start = DVector::from_vec(vec![1.0, 0.0]);
        let solution = minimise(&fit, start, &Settings::default());
        println!("{loss:?}: {} in {} steps", solution.termination, solution.iterations);
        assert!(solution.termination.converged() && solution.iterations < 60);
        let reduced = fit.linearise(&solution.x);
        let gradient = reduced.triangle.tr_mul(&reduced.projected);
        let size = reduced.triangle.column(0).norm() * (2.0 * reduced.cost).sqrt();
        assert!(gradient[0].abs() < 1e-5 * size, "{}", gradient[0] / size);
    }
}
