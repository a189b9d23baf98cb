//! Many items: chunked reduction equals the dense one, to the bit for any number of threads.

use std::ops::Range;

use flexcal::least_squares::solver::{Settings, minimise};
use flexcal::least_squares::{
    Block, CHUNK_ITEMS, Fit, LeastSquares, Objective, jacobian, residual_vector,
};
use nalgebra::DVector;

/// Damped waves sampled at many times, three residuals each.
struct Waves {
    items: usize,
    unknowns: usize,
}

impl Waves {
    fn row(
        &self,
        x: &DVector<f64>,
        item: usize,
        axis: usize,
        mut derivative: impl FnMut(usize, f64),
    ) -> f64 {
        let t = item as f64 / self.items as f64;
        let mut value = -(3.0 * t + axis as f64).cos();
        for j in 0..self.unknowns {
            let phase = (1.0 + j as f64) * t * (1.0 + 0.3 * axis as f64);
            value += x[j].sin() * phase.cos();
            derivative(j, x[j].cos() * phase.cos());
        }
        value
    }
}

impl LeastSquares for Waves {
    fn parameters(&self) -> usize {
        self.unknowns
    }

    fn items(&self) -> usize {
        self.items
    }

    fn rows_per_item(&self) -> usize {
        3
    }

    fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
        for (item, out) in items.zip(out.chunks_exact_mut(3)) {
            for (axis, out) in out.iter_mut().enumerate() {
                *out = self.row(x, item, axis, |_, _| {});
            }
        }
    }

    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
        for (row, item) in items.enumerate() {
            for axis in 0..3 {
                let value = self.row(x, item, axis, |j, d| block.column_mut(j)[3 * row + axis] = d);
                block.column_mut(self.unknowns)[3 * row + axis] = value;
            }
        }
    }
}

fn with_threads<T: Send>(threads: usize, run: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(run)
}

#[test]
fn threads_do_not_change_a_bit() {
    // More than one group of chunks, with an incomplete last chunk.
    let problem = Waves { items: 70 * CHUNK_ITEMS + 17, unknowns: 7 };
    let fit = Fit::new(&problem);
    let x = DVector::from_fn(7, |j, _| 0.1 * j as f64);
    let one = with_threads(1, || (fit.linearise(&x), fit.cost(&x)));
    for threads in [2, 3] {
        let several = with_threads(threads, || (fit.linearise(&x), fit.cost(&x)));
        assert_eq!(one.0.triangle, several.0.triangle);
        assert_eq!(one.0.projected, several.0.projected);
        assert_eq!(one.0.cost.to_bits(), several.0.cost.to_bits());
        assert_eq!(one.1.to_bits(), several.1.to_bits());
    }
    assert_eq!(one.0.cost.to_bits(), one.1.to_bits());
}

#[test]
fn chunks_equal_the_dense_problem() {
    for items in [1, 5, CHUNK_ITEMS, CHUNK_ITEMS + 1, 3 * CHUNK_ITEMS] {
        let problem = Waves { items, unknowns: 5 };
        let x = DVector::from_fn(5, |j, _| 0.2 + 0.1 * j as f64);
        let (j, r) = (jacobian(&problem, &x), residual_vector(&problem, &x));
        let reduced = Fit::new(&problem).linearise(&x);
        let gram = j.tr_mul(&j);
        assert!((reduced.triangle.tr_mul(&reduced.triangle) - &gram).amax() < 1e-12 * gram.amax());
        assert!(
            (reduced.triangle.tr_mul(&reduced.projected) - j.tr_mul(&r)).amax()
                < 1e-12 * gram.amax()
        );
        assert!((2.0 * reduced.cost - r.norm_squared()).abs() < 1e-12 * r.norm_squared());
    }
}

#[test]
fn many_items_converge_as_few() {
    let settings = Settings::default();
    let solution =
        minimise(Fit::new(&Waves { items: 2000, unknowns: 3 }), DVector::zeros(3), &settings);
    assert!(solution.termination.converged());
    println!("{solution:?}");
}
