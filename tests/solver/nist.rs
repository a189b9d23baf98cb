//! Certified values of the NIST Statistical Reference Datasets.

use flexcal::least_squares::Fit;
use flexcal::least_squares::solver::{Settings, Solution, minimise};
use nalgebra::DVector;

use crate::collections::nist::{Dataset, datasets};

/// Returns the number of digits that agree with the certified values, −log₁₀ of the largest
/// relative error of a parameter.
fn digits(solution: &Solution, certified: &DVector<f64>) -> f64 {
    let error = |(x, c): (&f64, &f64)| -((x - c).abs() / c.abs()).max(1e-11).log10();
    solution
        .x
        .iter()
        .zip(certified)
        .map(error)
        .fold(11.0, |a, b| if b.is_nan() { 0.0 } else { f64::min(a, b) })
}

#[expect(clippy::print_stdout, reason = "the table of results, shown on request")]
fn solve(dataset: &Dataset, start: usize, settings: &Settings) -> (Solution, f64) {
    let solution = minimise(Fit::new(dataset), dataset.starts[start].clone(), settings);
    let digits = digits(&solution, &dataset.certified);
    println!(
        "{:10} start {}: {digits:4.1} digits, rss {:.10e} ({:+.1e}), {} iterations, {}",
        dataset.name,
        start + 1,
        2.0 * solution.cost,
        2.0 * solution.cost / dataset.rss - 1.0,
        solution.iterations,
        solution.termination.as_str(),
    );
    (solution, digits)
}

const TIGHT: Settings = Settings {
    gradient_tolerance: 1e-14,
    cost_tolerance: 1e-15,
    step_tolerance: 1e-14,
    rank_tolerance: 1e-12,
    initial_radius: 100.0,
    max_iterations: 3000,
};

#[test]
fn certified_values_are_a_minimum_of_the_stored_data() {
    use flexcal::least_squares::Objective;
    for dataset in datasets() {
        let rss = 2.0 * Fit::new(&dataset).cost(&dataset.certified);
        // Eleven certified digits do not reach the residual of Lanczos1, 1.4e-25.
        let expected = if dataset.name == "lanczos1" {
            rss < 1e-20
        } else {
            (rss / dataset.rss - 1.0).abs() < 1e-9
        };
        assert!(expected, "{}: {rss} against {}", dataset.name, dataset.rss);
    }
}

#[test]
fn certified_from_the_near_start() {
    for dataset in datasets() {
        let (solution, digits) = solve(&dataset, 1, &TIGHT);
        assert!(solution.termination.converged(), "{}", dataset.name);
        assert!(digits >= 6.0, "{}: {digits}", dataset.name);
    }
}

#[test]
fn certified_from_the_far_start() {
    for dataset in datasets() {
        let (solution, digits) = solve(&dataset, 0, &TIGHT);
        assert!(solution.termination.converged(), "{}", dataset.name);
        assert!(digits >= 6.0, "{}: {digits}", dataset.name);
    }
}

/// The default settings are meant for noisy data: their remaining error is far below the standard
/// errors.
#[test]
fn four_digits_with_default_settings() {
    for dataset in datasets() {
        let (solution, digits) = solve(&dataset, 1, &Settings::default());
        assert!(solution.termination.converged(), "{}", dataset.name);
        assert!(digits >= 4.0, "{}: {digits}", dataset.name);
    }
}
