//! Linear inequalities: agreement without active rows, exact active rows, no evaluation outside,
//! and results of `SciPy`.

use flexcal::least_squares::solver::{
    AtBound, Bounds, Inequalities, Termination, minimise, minimise_bounded, minimise_constrained,
    nearest,
};
use flexcal::least_squares::{Fit, Linearisation, Objective};
use nalgebra::{DMatrix, DVector};

use super::bench::{Guarded, analytic, tight, vector};

const FREE: f64 = f64::INFINITY;

/// Returns rows around a point with a margin `room` on either side.
fn rows_around(x: &DVector<f64>, room: f64) -> Inequalities {
    let n = x.len();
    let matrix = DMatrix::from_fn(4, n, |i, j| (1.0 + 2.3 * i as f64 + 1.7 * (j * j) as f64).sin());
    let centre = &matrix * x;
    Inequalities::new(matrix, centre.add_scalar(-room), centre.add_scalar(room)).unwrap()
}

#[test]
fn without_active_rows_as_without_rows() {
    let cases = [
        (analytic!(bard, 3, 15), vec![1.0, 1.0, 1.0]),
        (analytic!(osborne1, 5, 33), vec![0.5, 1.5, -1.0, 0.01, 0.02]),
        (analytic!(watson, 6, 31), vec![0.0; 6]),
        (analytic!(kowalik_osborne, 4, 11), vec![0.25, 0.39, 0.415, 0.39]),
    ];
    for (problem, start) in cases {
        let free = minimise(Fit::new(&problem), vector(&start), &tight());
        let bounds = Bounds::none(start.len());
        for room in [100.0, 4.0] {
            let rows = rows_around(&free.x, room);
            let guarded =
                Guarded { objective: Fit::new(&problem), bounds: &bounds, rows: Some(&rows) };
            let found = minimise_constrained(guarded, vector(&start), &bounds, &rows, &tight());
            assert!(found.termination.converged());
            assert!(
                (&found.x - &free.x).amax() <= 1e-8 * free.x.amax(),
                "{} against {}",
                found.x,
                free.x
            );
            assert!(found.at_limit.iter().all(Option::is_none));
        }
    }
}

/// `SciPy` 1.17.1, method SLSQP, confirmed by trust-constr:
///
/// ```python
/// def watson(x):
///     t = np.arange(1, 30) / 29
///     j = np.arange(len(x))
///     value = t[:, None] ** j @ x
///     slope = (j[1:] * t[:, None] ** (j[1:] - 1)) @ x[1:]
///     return np.concatenate([slope - value**2 - 1, [x[0], x[1] - x[0]**2 - 1]])
/// jac = lambda x: np.array([watson(x + 1e-30j * e).imag / 1e-30 for e in np.eye(len(x))]).T
/// minimize(lambda x: 0.5 * watson(x) @ watson(x), x0, jac=lambda x: jac(x).T @ watson(x), bounds=bounds,
///          constraints=[LinearConstraint(A, lo, hi)], method='SLSQP', options=dict(ftol=1e-18, maxiter=1000))
/// # x0 = [0]*6, x[0] >= -0.01, A and limits as below; x0 = [0.1]*9, -2 <= x <= 1
/// ```
#[test]
fn active_rows_as_scipy() {
    use AtBound::{Lower, Upper};
    let first = Inequalities::new(
        DMatrix::from_row_slice(
            3,
            6,
            &[
                0.0, 0.0, 0.0, 1.0, 1.0, 0.0, //
                0.0, 1.0, 1.0, 1.0, 0.0, 0.0, //
                0.0, -3.0, 0.0, 0.0, 0.0, 1.0,
            ],
        ),
        vector(&[0.0, -FREE, -FREE]),
        vector(&[FREE, 1.5, 0.0]),
    );
    let second = Inequalities::new(
        DMatrix::from_row_slice(
            4,
            9,
            &[
                1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, //
                0.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, 0.0, //
                0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, //
                1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -2.0,
            ],
        ),
        vector(&[1.0, -0.2, -FREE, -0.5]),
        vector(&[1.0, 0.2, 0.3, FREE]),
    );
    let mut lower = vec![-FREE; 6];
    lower[0] = -0.01;
    let cases = [
        (
            vec![0.0; 6],
            Bounds::new(vector(&lower), vector(&[FREE; 6])).unwrap(),
            first.unwrap(),
            vec![
                -0.01,
                1.007_343_372_84,
                -0.062_303_562_58,
                0.554_960_189_74,
                -0.554_960_189_74,
                0.582_465_751_28,
            ],
            0.004_429_300_410_245_213,
            vec![Some(Lower), Some(Upper), None],
        ),
        (
            vec![0.1; 9],
            Bounds::new(vector(&[-2.0; 9]), vector(&[1.0; 9])).unwrap(),
            second.unwrap(),
            vec![
                -0.209_766_007_2,
                1.0,
                0.008_402_538_9,
                -0.129_153_109_7,
                0.070_846_890_3,
                1.0,
                -1.323_324_727_9,
                0.637_997_418_6,
                -0.055_003_003_1,
            ],
            0.024_338_295_368_281_8,
            vec![Some(Lower), Some(Lower), None, None],
        ),
    ];
    for (start, bounds, rows, x, cost, active) in cases {
        let problem = analytic!(watson, x.len(), 31);
        let guarded = Guarded { objective: Fit::new(&problem), bounds: &bounds, rows: Some(&rows) };
        let found = minimise_constrained(guarded, vector(&start), &bounds, &rows, &tight());
        println!("{} iterations, {}, cost {:.15}", found.iterations, found.termination, found.cost);
        assert!(found.termination.converged());
        assert_eq!(found.at_limit, active);
        assert!((found.cost / cost - 1.0).abs() < 1e-9, "{}", found.cost);
        assert!((&found.x - vector(&x)).amax() < 1e-6, "{}", found.x);
        let values = rows.matrix() * &found.x;
        for (i, active) in active.iter().enumerate() {
            let limit = match active {
                Some(Lower) => rows.lower()[i],
                Some(Upper) => rows.upper()[i],
                None => continue,
            };
            assert!((values[i] - limit).abs() < 1e-13, "row {i}: {} on {limit}", values[i]);
        }
        // An infeasible start is moved to the nearest feasible point.
        let start = DVector::from_fn(x.len(), |j, _| 3.0 - j as f64);
        let guarded = Guarded { objective: Fit::new(&problem), bounds: &bounds, rows: Some(&rows) };
        let again = minimise_constrained(guarded, start, &bounds, &rows, &tight());
        assert!(
            again.termination.converged() && (again.cost / cost - 1.0).abs() < 1e-9,
            "{}",
            again.cost
        );
    }
}

#[test]
fn optimality_conditions_on_many_polyhedra() {
    // The gradient is a sum of normals of the active rows with multipliers of the right sign.
    let problem = analytic!(osborne2, 11, 65);
    let start = vector(&[1.3, 0.65, 0.65, 0.7, 0.6, 3.0, 5.0, 7.0, 2.0, 4.5, 5.5]);
    let bounds = Bounds::none(11);
    let mut seen = 0;
    for case in 0..20 {
        let matrix = DMatrix::from_fn(5, 11, |i, j| {
            (1.3 * f64::from(case) + 2.1 * j as f64 + 0.7 * (i * i) as f64).sin()
        });
        let centre = &matrix * &start;
        let lower = DVector::from_fn(5, |i, _| {
            centre[i] - 0.1 * (1.0 + (i as f64 + f64::from(case)).cos())
        });
        let rows = Inequalities::new(matrix.clone(), lower, centre.add_scalar(0.1)).unwrap();
        let fit = Guarded { objective: Fit::new(&problem), bounds: &bounds, rows: Some(&rows) };
        let found = minimise_constrained(&fit, start.clone(), &bounds, &rows, &tight());
        assert!(found.termination.converged(), "case {case}: {}", found.termination);
        let Linearisation { cost, triangle, projected } = fit.linearise(&found.x);
        let gradient = triangle.tr_mul(&projected);
        let active: Vec<usize> = (0..5).filter(|&i| found.at_limit[i].is_some()).collect();
        seen += active.len();
        let mut left = gradient.clone();
        if !active.is_empty() {
            let normals = matrix.select_rows(&active).transpose();
            let multipliers = normals.clone().svd(true, true).solve(&gradient, 1e-12).unwrap();
            for (&i, multiplier) in active.iter().zip(&multipliers) {
                let outwards = if found.at_limit[i] == Some(AtBound::Lower) {
                    -multiplier
                } else {
                    *multiplier
                };
                assert!(outwards < 1e-6, "case {case}, row {i}: {outwards}");
            }
            left -= normals * multipliers;
        }
        for j in 0..11 {
            let cosine = left[j] / triangle.column(j).norm() / (2.0 * cost).sqrt();
            assert!(cosine.abs() < 1e-6, "case {case}, unknown {j}: {cosine}");
        }
    }
    assert!(seen > 20, "{seen} active rows in all");
}

#[test]
fn a_row_on_one_unknown_is_a_bound() {
    let problem = analytic!(watson, 6, 31);
    let upper =
        Bounds::new(vector(&[-FREE; 6]), vector(&[FREE, 0.9, 0.5, FREE, 0.5, FREE])).unwrap();
    let bounded = minimise_bounded(Fit::new(&problem), DVector::zeros(6), &upper, &tight());
    let matrix = DMatrix::from_fn(3, 6, |i, j| f64::from(u8::from(j == [1, 2, 4][i])));
    // One row is given twice: dependent rows do no harm.
    let matrix = matrix.insert_row(3, 0.0);
    let matrix =
        DMatrix::from_fn(4, 6, |i, j| if i == 3 { 2.0 * matrix[(0, j)] } else { matrix[(i, j)] });
    let rows =
        Inequalities::new(matrix, vector(&[-FREE; 4]), vector(&[0.9, 0.5, 0.5, 1.8])).unwrap();
    let found = minimise_constrained(
        Fit::new(&problem),
        DVector::zeros(6),
        &Bounds::none(6),
        &rows,
        &tight(),
    );
    assert!(found.termination.converged());
    assert!(
        (&found.x - &bounded.x).amax() < 1e-8 * bounded.x.amax(),
        "{} against {}",
        found.x,
        bounded.x
    );
    assert_eq!(found.at_limit[0], bounded.at_bound[1]);
}

#[test]
fn impossible_rows_are_refused() {
    let one = |lower: f64, upper: f64, matrix: DMatrix<f64>| {
        Inequalities::new(matrix, vector(&[lower]), vector(&[upper]))
    };
    assert!(one(1.0, 0.0, DMatrix::from_element(1, 2, 1.0)).is_err());
    assert!(one(0.0, 1.0, DMatrix::zeros(1, 2)).is_err());
    assert!(one(f64::NAN, 1.0, DMatrix::from_element(1, 2, 1.0)).is_err());
    assert!(Inequalities::new(DMatrix::zeros(2, 2), vector(&[0.0]), vector(&[0.0])).is_err());
    // x₀ + x₁ ≥ 3 is infeasible in the unit box.
    let rows = one(3.0, FREE, DMatrix::from_element(1, 2, 1.0)).unwrap();
    let bounds = Bounds::new(vector(&[0.0, 0.0]), vector(&[1.0, 1.0])).unwrap();
    assert!(nearest(&vector(&[0.5, 0.5]), &bounds, &rows).is_none());
    let problem = analytic!(rosenbrock, 2, 2);
    let start = vector(&[0.5, 0.5]);
    let found = minimise_constrained(Fit::new(&problem), start, &bounds, &rows, &tight());
    assert_eq!(found.termination, Termination::Infeasible);
    // x₀ + x₁ = 1.5, reached from (0.5, 0.5) along the shortest path.
    let rows = one(1.5, 1.5, DMatrix::from_element(1, 2, 1.0)).unwrap();
    let moved = nearest(&vector(&[0.5, 0.5]), &bounds, &rows).unwrap();
    assert!((moved - vector(&[0.75, 0.75])).amax() < 1e-14);
}
