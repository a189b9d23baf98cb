//! The least-squares problems of Moré, Garbow & Hillstrom, "Testing unconstrained optimization
//! software", ACM TOMS 7 (1981) 17–41: functions, starts and minima as given there (numbers in
//! brackets).

use num_dual::Dual64;

use super::Analytic;
use super::functions as f;

/// Problem with its standard start and known minima.
pub struct Problem {
    pub name: &'static str,
    pub analytic: Analytic,
    pub start: Vec<f64>,
    /// Value ‖r‖² of every known local minimum (or infimum). Minima beyond the paper are those that
    /// MINPACK's driver reports (Osborne 2: norm 1.337840, Chebyquad n = 1: 1.886238 and 1.884248)
    /// and those derived next to them.
    pub minima: Vec<f64>,
}

macro_rules! problem {
    ($name:literal, $function:ident, $rows:expr, $start:expr, $minima:expr) => {{
        let start: Vec<f64> = $start.to_vec();
        let (value, dual) =
            (f::$function::<f64> as fn(&[f64]) -> _, f::$function::<Dual64> as fn(&[Dual64]) -> _);
        Problem {
            name: $name,
            analytic: Analytic { unknowns: start.len(), rows: $rows, value, dual },
            start,
            minima: $minima.to_vec(),
        }
    }};
}

/// Returns every problem.
#[allow(clippy::too_many_lines, reason = "a table of problems")]
pub fn problems() -> Vec<Problem> {
    let ramp = |n: usize, g: fn(f64) -> f64| {
        (1..=n).map(|j| g(j as f64 / (n as f64 + 1.0))).collect::<Vec<_>>()
    };
    let alternate =
        |n: usize, cycle: &[f64]| cycle.iter().copied().cycle().take(n).collect::<Vec<_>>();
    vec![
        problem!("Rosenbrock (1)", rosenbrock, 2, [-1.2, 1.0], [0.0]),
        problem!(
            "Freudenstein–Roth (2)",
            freudenstein_roth,
            2,
            [0.5, -2.0],
            [0.0, 48.984_253_679_240_01]
        ),
        problem!("Powell badly scaled (3)", powell_badly_scaled, 2, [0.0, 1.0], [0.0]),
        problem!("Brown badly scaled (4)", brown_badly_scaled, 3, [1.0, 1.0], [0.0]),
        // Along x₂ → 1, x₁ (x₂ − 1) = const the residuals tend to yᵢ + i·const: the infimum is
        // 14.203125 − 13.875²/14.
        problem!("Beale (5)", beale, 3, [1.0, 1.0], [0.0, 14.203_125 - 13.875 * 13.875 / 14.0]),
        // The second minimum has one unknown at −∞ (one-dimensional minimisation by SciPy:
        // 259.58019013425326).
        problem!(
            "Jennrich–Sampson (6)",
            jennrich_sampson,
            10,
            [0.3, 0.4],
            [124.362_182_355_614_7, 259.580_190]
        ),
        problem!("Helical valley (7)", helical_valley, 3, [-1.0, 0.0, 0.0], [0.0]),
        problem!("Bard (8)", bard, 15, [1.0, 1.0, 1.0], [8.214_877e-3, 17.4286]),
        problem!("Gaussian (9)", gaussian, 15, [0.4, 1.0, 0.0], [1.12793e-8]),
        problem!("Meyer (10)", meyer, 16, [0.02, 4000.0, 250.0], [87.945_8]),
        problem!("Gulf (11)", gulf, 99, [5.0, 2.5, 0.15], [0.0]),
        // The second minimum has x₂ → ∞ (SciPy least_squares from 0, 100, 200: 0.0755887407549974).
        problem!(
            "Box three-dimensional (12)",
            box3,
            10,
            [0.0, 10.0, 20.0],
            [0.0, 0.075_588_740_755]
        ),
        problem!("Powell singular (13)", powell_singular, 4, [3.0, -1.0, 0.0, 1.0], [0.0]),
        problem!("Wood (14)", wood, 6, [-3.0, -1.0, -3.0, -1.0], [0.0]),
        problem!(
            "Kowalik–Osborne (15)",
            kowalik_osborne,
            11,
            [0.25, 0.39, 0.415, 0.39],
            [3.075_056e-4, 1.02734e-3]
        ),
        problem!("Brown–Dennis (16)", brown_dennis, 20, [25.0, 5.0, -5.0, -1.0], [85_822.201_626]),
        problem!("Osborne 1 (17)", osborne1, 33, [0.5, 1.5, -1.0, 0.01, 0.02], [5.464_895e-5]),
        problem!(
            "Biggs EXP6 (18)",
            biggs,
            13,
            [1.0, 2.0, 1.0, 1.0, 1.0, 1.0],
            [0.0, 5.655_65e-3, 0.306_366_8]
        ),
        problem!(
            "Osborne 2 (19)",
            osborne2,
            65,
            [1.3, 0.65, 0.65, 0.7, 0.6, 3.0, 5.0, 7.0, 2.0, 4.5, 5.5],
            [4.013_774e-2, 1.789_814]
        ),
        problem!("Watson, n = 6 (20)", watson, 31, [0.0; 6], [2.287_670e-3]),
        problem!("Watson, n = 9 (20)", watson, 31, [0.0; 9], [1.399_760e-6]),
        problem!("Watson, n = 12 (20)", watson, 31, [0.0; 12], [4.722_381e-10]),
        problem!(
            "Extended Rosenbrock, n = 10 (21)",
            extended_rosenbrock,
            10,
            alternate(10, &[-1.2, 1.0]),
            [0.0]
        ),
        problem!(
            "Extended Powell singular, n = 12 (22)",
            extended_powell_singular,
            12,
            alternate(12, &[3.0, -1.0, 0.0, 1.0]),
            [0.0]
        ),
        problem!("Penalty I, n = 4 (23)", penalty1, 5, [1.0, 2.0, 3.0, 4.0], [2.249_975e-5]),
        problem!(
            "Penalty I, n = 10 (23)",
            penalty1,
            11,
            (1..=10).map(f64::from).collect::<Vec<_>>(),
            [7.087_651e-5]
        ),
        problem!("Penalty II, n = 4 (24)", penalty2, 8, [0.5; 4], [9.376_293e-6]),
        problem!("Penalty II, n = 10 (24)", penalty2, 20, [0.5; 10], [2.936_605e-4]),
        problem!(
            "Variably dimensioned, n = 10 (25)",
            variable,
            12,
            (1..=10).map(|j| 1.0 - f64::from(j) / 10.0).collect::<Vec<_>>(),
            [0.0]
        ),
        problem!("Trigonometric, n = 10 (26)", trigonometric, 10, [0.1; 10], [0.0, 2.795_06e-5]),
        problem!(
            "Brown almost linear, n = 10 (27)",
            brown_almost_linear,
            10,
            [0.5; 10],
            [0.0, 1.0]
        ),
        problem!(
            "Brown almost linear, n = 30 (27)",
            brown_almost_linear,
            30,
            [0.5; 30],
            [0.0, 1.0]
        ),
        problem!(
            "Brown almost linear, n = 40 (27)",
            brown_almost_linear,
            40,
            [0.5; 40],
            [0.0, 1.0]
        ),
        problem!(
            "Discrete boundary value, n = 10 (28)",
            boundary_value,
            10,
            ramp(10, |t| t * (t - 1.0)),
            [0.0]
        ),
        problem!(
            "Discrete integral, n = 10 (29)",
            integral,
            10,
            ramp(10, |t| t * (t - 1.0)),
            [0.0]
        ),
        problem!("Broyden tridiagonal, n = 10 (30)", broyden_tridiagonal, 10, [-1.0; 10], [0.0]),
        problem!("Broyden banded, n = 10 (31)", broyden_banded, 10, [-1.0; 10], [0.0]),
        problem!("Linear, full rank, m = 10 (32)", linear_full_10, 10, [1.0; 5], [5.0]),
        problem!("Linear, full rank, m = 50 (32)", linear_full_50, 50, [1.0; 5], [45.0]),
        problem!("Linear, rank 1, m = 10 (33)", linear_rank_one_10, 10, [1.0; 5], [90.0 / 42.0]),
        problem!("Linear, rank 1, m = 50 (33)", linear_rank_one_50, 50, [1.0; 5], [2450.0 / 202.0]),
        problem!(
            "Linear, rank 1, zeros, m = 10 (34)",
            linear_zeros_10,
            10,
            [1.0; 5],
            [124.0 / 34.0]
        ),
        problem!(
            "Linear, rank 1, zeros, m = 50 (34)",
            linear_zeros_50,
            50,
            [1.0; 5],
            [2644.0 / 194.0]
        ),
        problem!("Chebyquad, n = 1 (35)", chebyquad_8, 8, [0.5; 1], [3.557_894, 3.550_391]),
        problem!("Chebyquad, n = 8 (35)", chebyquad, 8, ramp(8, |t| t), [3.516_874e-3]),
        problem!("Chebyquad, n = 9 (35)", chebyquad, 9, ramp(9, |t| t), [0.0]),
        problem!(
            "Chebyquad, n = 10 (35)",
            chebyquad,
            10,
            ramp(10, |t| t),
            [6.503_955e-3, 4.772_713e-3]
        ),
    ]
}
