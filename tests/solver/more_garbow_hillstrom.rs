//! Problems of Moré, Garbow & Hillstrom, each from its standard start and from 10 and 100 times it,
//! as in MINPACK's driver.

use crate::collections::more_garbow_hillstrom::problems;
use flexcal::least_squares::Fit;
use flexcal::least_squares::solver::{Settings, Termination, minimise};
use nalgebra::DVector;

/// Starts from which no minimum is reached, with the reason.
const LOST: [(&str, u32); 9] = [
    // x₂ = 100: the derivative with respect to x₂ is e⁻¹⁰⁰, so the residual is flat.
    ("Powell badly scaled (3)", 100),
    // e⁴⁰⁰ squared overflows: the start is outside the domain.
    ("Jennrich–Sampson (6)", 100),
    // All derivatives vanish at the start.
    ("Gulf (11)", 100),
    // Polynomials of degree n far outside [0, 1]: ‖r‖² falls by orders of magnitude, but not within
    // the iteration limit. MINPACK's driver tries these from the standard start only.
    ("Chebyquad, n = 8 (35)", 10),
    ("Chebyquad, n = 8 (35)", 100),
    ("Chebyquad, n = 9 (35)", 10),
    ("Chebyquad, n = 9 (35)", 100),
    ("Chebyquad, n = 10 (35)", 10),
    ("Chebyquad, n = 10 (35)", 100),
];

/// Returns true if ‖r‖² is one of the known minima to six digits (zero: to rounding of a residual
/// of order one).
fn is_minimum(squares: f64, minima: &[f64]) -> bool {
    minima
        .iter()
        .any(|&m| if m == 0.0 { squares < 1e-14 } else { (squares / m - 1.0).abs() < 1e-5 })
}

#[test]
fn known_minima_from_three_starts() {
    let settings = Settings {
        gradient_tolerance: 1e-14,
        cost_tolerance: 1e-14,
        step_tolerance: 1e-14,
        max_iterations: 3000,
        ..Settings::default()
    };
    let mut lost = Vec::new();
    for problem in problems() {
        for factor in [1_u32, 10, 100] {
            // A start at zero equals its multiples; MINPACK's driver uses the factor itself.
            let zero = factor > 1 && problem.start.iter().all(|&x| x == 0.0);
            let start =
                problem.start.iter().map(|&x| f64::from(factor) * if zero { 1.0 } else { x });
            let start = DVector::from_iterator(problem.start.len(), start);
            let solution = minimise(Fit::new(&problem.analytic), start, &settings);
            let squares = 2.0 * solution.cost;
            let found = is_minimum(squares, &problem.minima);
            println!(
                "{:40} ×{factor:<4} ‖r‖² = {squares:<12.6e} {:4} iterations, {}{}",
                problem.name,
                solution.iterations,
                solution.termination.as_str(),
                if found { "" } else { "   NOT A LISTED MINIMUM" },
            );
            assert!(solution.x.iter().all(|v| v.is_finite()), "{}", problem.name);
            assert_ne!(solution.termination, Termination::DerivativesNotFinite, "{}", problem.name);
            if !found {
                lost.push((problem.name, factor));
            }
        }
    }
    assert_eq!(lost, LOST);
}
