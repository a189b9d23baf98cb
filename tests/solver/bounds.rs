//! Bounded Levenberg–Marquardt: agreement without active bounds, exact active bounds, and results
//! of `SciPy`.

use argmin::core::observers::Observe;
use flexcal::least_squares::solver::{
    AtBound, BoundMethod, Bounds, Inequalities, State, Termination, minimise, minimise_bounded,
    minimise_constrained_by,
};
use flexcal::least_squares::{Fit, Linearisation, Objective};
use nalgebra::DVector;

use super::bench::{Guarded, analytic, tight, vector};

struct Silent;

impl Observe<State> for Silent {}

#[test]
fn without_active_bounds_as_without_bounds() {
    let cases = [
        (analytic!(bard, 3, 15), vec![1.0, 1.0, 1.0]),
        (analytic!(osborne1, 5, 33), vec![0.5, 1.5, -1.0, 0.01, 0.02]),
        (
            analytic!(osborne2, 11, 65),
            vec![1.3, 0.65, 0.65, 0.7, 0.6, 3.0, 5.0, 7.0, 2.0, 4.5, 5.5],
        ),
        (analytic!(watson, 6, 31), vec![0.0; 6]),
        (analytic!(kowalik_osborne, 4, 11), vec![0.25, 0.39, 0.415, 0.39]),
    ];
    for (problem, start) in cases {
        let free = minimise(Fit::new(&problem), vector(&start), &tight());
        let wide = Bounds::new(free.x.map(|x| x - 20.0), free.x.map(|x| x + 20.0)).unwrap();
        let guarded = Guarded { objective: Fit::new(&problem), bounds: &wide, rows: None };
        let bounded = minimise_bounded(guarded, vector(&start), &wide, &tight());
        assert!(bounded.termination.converged());
        assert!(
            (&bounded.x - &free.x).amax() <= 1e-8 * free.x.amax(),
            "{} against {}",
            bounded.x,
            free.x
        );
        assert!(bounded.at_bound.iter().all(Option::is_none));
        let none = Bounds::none(start.len());
        assert_eq!(minimise_bounded(Fit::new(&problem), vector(&start), &none, &tight()).x, free.x);
    }
}

/// `SciPy` 1.17.1, method "trf", Jacobian by complex step:
///
/// ```python
/// def watson(x):
///     t = np.arange(1, 30) / 29
///     j = np.arange(len(x))
///     value = t[:, None] ** j @ x
///     slope = (j[1:] * t[:, None] ** (j[1:] - 1)) @ x[1:]
///     return np.concatenate([slope - value**2 - 1, [x[0], x[1] - x[0]**2 - 1]])
/// least_squares(watson, x0, jac, (lo, hi), method='trf', ftol=1e-15, xtol=1e-15, gtol=1e-15, max_nfev=10000)
/// # x0 = [0.1]*6, lo = [-0.1]*6, hi = [1, 0.9, 0.5, 1, 0.5, 1]; x0 = [0]*9, lo = [-0.5]*9, hi = [0.95]*9
/// ```
#[test]
fn several_active_bounds_as_scipy() {
    use AtBound::{Lower, Upper};
    let cases = [
        (
            vec![0.1; 6],
            vec![-0.1; 6],
            vec![1.0, 0.9, 0.5, 1.0, 0.5, 1.0],
            vec![-0.028_358_75, 0.9, 0.335_848_15, -0.1, -0.1, 0.431_967_07],
            0.012_939_588_515_981_513,
            vec![None, Some(Upper), None, Some(Lower), Some(Lower), None],
        ),
        (
            vec![0.0; 9],
            vec![-0.5; 9],
            vec![0.95; 9],
            vec![
                2.765_116_84e-4,
                0.95,
                0.325_752_630,
                -0.5,
                0.745_732_901,
                0.345_567_791,
                -0.5,
                -0.121_899_866,
                0.306_076_730,
            ],
            0.001_920_735_475_488_879_4,
            vec![None, Some(Upper), None, Some(Lower), None, None, Some(Lower), None, None],
        ),
    ];
    for (start, lower, upper, x, cost, active) in cases {
        let problem = analytic!(watson, x.len(), 31);
        let bounds = Bounds::new(vector(&lower), vector(&upper)).unwrap();
        let guarded = Guarded { objective: Fit::new(&problem), bounds: &bounds, rows: None };
        let solution = minimise_bounded(guarded, vector(&start), &bounds, &tight());
        println!(
            "{} iterations, {}, cost {:.15}",
            solution.iterations, solution.termination, solution.cost
        );
        assert!(solution.termination.converged());
        assert_eq!(solution.at_bound, active);
        let none = Inequalities::none(x.len());
        for within in [BoundMethod::InteriorPoint, BoundMethod::Reflective, BoundMethod::Clamped] {
            let guarded = Guarded { objective: Fit::new(&problem), bounds: &bounds, rows: None };
            let start = vector(&start);
            let other = minimise_constrained_by(
                within,
                guarded,
                start,
                (&bounds, &none),
                &tight(),
                None::<Silent>,
            );
            println!(
                "  {within:?}: {} iterations, {}, cost {:.15}",
                other.iterations, other.termination, other.cost
            );
            assert!(other.cost >= cost * (1.0 - 1e-9), "{within:?}: {}", other.cost);
            // Clamped steps may stop early.
            assert!(
                within == BoundMethod::Clamped || other.cost <= cost * (1.0 + 1e-8),
                "{within:?}: {}",
                other.cost
            );
            assert!(
                within == BoundMethod::Clamped || other.at_bound == active,
                "{within:?}: {:?}",
                other.at_bound
            );
        }
        assert!((solution.cost / cost - 1.0).abs() < 1e-9, "{}", solution.cost);
        assert!((&solution.x - vector(&x)).amax() < 1e-6, "{}", solution.x);
        for (j, bound) in active.iter().enumerate() {
            match bound {
                Some(Lower) => assert_eq!(solution.x[j].to_bits(), lower[j].to_bits()),
                Some(Upper) => assert_eq!(solution.x[j].to_bits(), upper[j].to_bits()),
                None => {}
            }
        }
    }
}

#[test]
fn optimality_conditions_on_many_boxes() {
    // Boxes around pseudo-random centres: the projected gradient vanishes and no multiplier has the
    // wrong sign.
    let problem = analytic!(osborne2, 11, 65);
    let start = vector(&[1.3, 0.65, 0.65, 0.7, 0.6, 3.0, 5.0, 7.0, 2.0, 4.5, 5.5]);
    for case in 0..20 {
        let shift = |j: usize| (1.3 * f64::from(case) + 2.1 * j as f64).sin();
        let lower = DVector::from_fn(11, |j, _| start[j] * (0.8 + 0.3 * shift(j)).min(1.0));
        let upper = DVector::from_fn(11, |j, _| lower[j] + 0.25 * start[j]);
        let bounds = Bounds::new(lower, upper).unwrap();
        let fit = Guarded { objective: Fit::new(&problem), bounds: &bounds, rows: None };
        let solution = minimise_bounded(&fit, start.clone(), &bounds, &tight());
        assert!(solution.termination.converged(), "case {case}: {}", solution.termination);
        let Linearisation { cost, triangle, projected } = fit.linearise(&solution.x);
        let gradient = triangle.tr_mul(&projected);
        for j in 0..11 {
            let cosine = gradient[j] / triangle.column(j).norm() / (2.0 * cost).sqrt();
            match solution.at_bound[j] {
                None => assert!(cosine.abs() < 1e-6, "case {case}, unknown {j}: {cosine}"),
                Some(AtBound::Lower) => {
                    assert!(cosine > -1e-6, "case {case}, unknown {j}: {cosine}");
                }
                Some(AtBound::Upper) => {
                    assert!(cosine < 1e-6, "case {case}, unknown {j}: {cosine}");
                }
            }
        }
    }
}

#[test]
fn a_corner_and_a_fixed_unknown() {
    // Rosenbrock in a box away from its valley, with the second unknown fixed.
    let problem = analytic!(rosenbrock, 2, 2);
    let corner = Bounds::new(vector(&[-1.5, -2.0]), vector(&[-0.5, -1.0])).unwrap();
    let solution = minimise_bounded(Fit::new(&problem), vector(&[-1.2, 1.0]), &corner, &tight());
    assert_eq!(solution.x, vector(&[-0.5, -1.0]));
    assert_eq!(solution.termination, Termination::Gradient);
    assert_eq!(solution.at_bound, [Some(AtBound::Upper), Some(AtBound::Upper)]);

    let held =
        Bounds::new(vector(&[f64::NEG_INFINITY, 4.0]), vector(&[f64::INFINITY, 4.0])).unwrap();
    let solution = minimise_bounded(Fit::new(&problem), vector(&[3.0, 0.0]), &held, &tight());
    assert!(solution.termination.converged());
    assert_eq!(solution.x[1].to_bits(), 4.0_f64.to_bits());
    // Stationary in x₁ alone: 200 x₁ (x₁² − 4) + x₁ − 1 = 0.
    let x = solution.x[0];
    let slope = 200.0 * x * (x * x - 4.0) + x - 1.0;
    assert!(slope.abs() < 1e-6, "{slope}");
}

#[test]
fn impossible_bounds_are_refused() {
    assert!(Bounds::new(vector(&[0.0]), vector(&[0.0, 1.0])).is_err());
    assert!(Bounds::new(vector(&[0.0, 2.0]), vector(&[1.0, 1.0])).is_err());
    assert!(Bounds::new(vector(&[f64::NAN]), vector(&[1.0])).is_err());
    let problem = analytic!(rosenbrock, 2, 2);
    let solution =
        minimise_bounded(Fit::new(&problem), vector(&[0.0, 0.0]), &Bounds::none(3), &tight());
    assert_eq!(solution.termination, Termination::SizeMismatch);
}
