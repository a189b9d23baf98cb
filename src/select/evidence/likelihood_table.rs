//! Tabulated likelihood of a residual as a function of its sum of squares.

use std::sync::OnceLock;

/// Half the width of the tabulated range of ln(S/ν). It contains the sums of squares S that the
/// grid of noise factors can explain; beyond it the function is computed without the table.
const HALF_RANGE: f64 = 9.0;

/// Value of a smooth function with its first and second derivative.
pub(super) type Jet = [f64; 3];

/// Table of a smooth function of ln S, interpolated between its nodes by quintic Hermite
/// polynomials. A node is computed when it is first used, so that the result does not depend on the
/// order of use.
#[derive(Debug, Clone)]
pub(super) struct LikelihoodTable {
    /// Value of ln S, the logarithm of the sum of squares, at the first node of the table.
    first: f64,
    /// Difference of ln S, the logarithm of the sum of squares, between successive nodes.
    step: f64,
    /// Value at each node with its derivatives by ln S, each derivative times as many powers of the
    /// step.
    nodes: Vec<OnceLock<Jet>>,
}

impl LikelihoodTable {
    /// Creates a table about S = ν, for ν degrees of freedom (`freedom`) and nodes at a distance of
    /// `step` in ln S.
    pub fn new(freedom: f64, step: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "few steps")]
        let count = (2.0 * HALF_RANGE / step).ceil() as usize + 1;
        let count = if freedom > 0.0 { count } else { 0 };
        let nodes = std::iter::repeat_with(OnceLock::new).take(count).collect();
        Self { first: freedom.ln() - HALF_RANGE, step, nodes }
    }

    /// Returns the function at S = `squares`; `of` returns its value and its derivatives by S.
    pub fn value(&self, squares: f64, of: impl Fn(f64) -> Jet) -> f64 {
        let place = (squares.ln() - self.first) / self.step;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in range")]
        let number = place as usize;
        let is_inside = place >= 0.0 && place < self.nodes.len() as f64;
        let nodes = if is_inside { self.nodes.get(number..=number + 1) } else { None };
        let Some([left, right]) = nodes else { return of(squares)[0] };
        let at = |node: &OnceLock<Jet>, number: usize| {
            *node.get_or_init(|| {
                let squares = (self.first + self.step * number as f64).exp();
                let [value, slope, curvature] = of(squares);
                let by_ln = squares * slope;
                let second = by_ln + squares * squares * curvature;
                [value, self.step * by_ln, self.step * self.step * second]
            })
        };
        interpolated(at(left, number), at(right, number + 1), place - number as f64)
    }
}

/// Returns the quintic polynomial with the given values and derivatives at 0 and at 1, evaluated at
/// `t`.
fn interpolated([a, da, dda]: Jet, [b, db, ddb]: Jet, t: f64) -> f64 {
    // Taylor expansion at 0, and what its value and derivatives at 1 lack.
    let (gap, slope_gap, curvature_gap) = (b - (a + da + 0.5 * dda), db - (da + dda), ddb - dda);
    let cubic = 10.0 * gap - 4.0 * slope_gap + 0.5 * curvature_gap;
    let quartic = -15.0 * gap + 7.0 * slope_gap - curvature_gap;
    let quintic = 6.0 * gap - 3.0 * slope_gap + 0.5 * curvature_gap;
    a + t * (da + t * (0.5 * dda + t * (cubic + t * (quartic + t * quintic))))
}
