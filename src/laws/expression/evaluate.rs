//! Values of expressions, generic over the scalar.

use super::tree::{Expression, Function, Operator};
use crate::laws::quantity::Quantity;
use crate::scalar::Scalar;

impl Expression {
    /// Returns the value of the expression for quantities `at` and named `parameters`.
    ///
    /// Dual numbers propagate derivatives. A derivative that is one-sided (`abs`, `sign` and `step`
    /// at 0) or infinite (`sqrt` and powers below 1 at 0) counts as 0. For equal operands of `min`
    /// and `max`, the derivative of the first one is used. A value outside the domain of a function
    /// is NaN or infinite.
    pub fn evaluate<S: Scalar>(&self, at: &impl Fn(Quantity) -> S, parameters: &[S]) -> S {
        match self {
            Self::Number(number) => S::from(*number),
            Self::Quantity(quantity) => at(*quantity),
            Self::Parameter(index) => {
                parameters.get(*index).copied().unwrap_or_else(|| S::from(f64::NAN))
            }
            Self::Negative(inner) => -inner.evaluate(at, parameters),
            Self::Call(function, argument) => function.apply(argument.evaluate(at, parameters)),
            Self::Binary(operator, operands) => {
                let [left, right] = &**operands;
                if let (Operator::Power, Self::Number(exponent)) = (operator, right) {
                    return power(left.evaluate(at, parameters), *exponent);
                }
                operator.apply(left.evaluate(at, parameters), right.evaluate(at, parameters))
            }
        }
    }
}

impl Function {
    /// Returns the value of the function at x.
    fn apply<S: Scalar>(self, x: S) -> S {
        match self {
            Self::Sin => x.sin(),
            Self::Cos => x.cos(),
            Self::Tan => x.tan(),
            Self::Exp => x.exp(),
            Self::Expm1 => x.exp_m1(),
            Self::Log => x.ln(),
            Self::Sqrt | Self::Abs if x.re() == 0.0 => S::from(0.0),
            Self::Sqrt => x.sqrt(),
            Self::Abs if x.re() < 0.0 => -x,
            Self::Abs => x,
            Self::Sign => S::from(sign(x.re())),
            Self::Tanh => tanh(x),
            Self::Step => S::from(f64::from(x.re() >= 0.0)),
            Self::Spline => cubic_spline(x),
        }
    }
}

impl Operator {
    /// Returns the value of the operator for the operands a and b.
    fn apply<S: Scalar>(self, a: S, b: S) -> S {
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
            // a^b = exp(b ln a) has a derivative with respect to b only for positive a.
            Self::Power if a.re() > 0.0 => (b * a.ln()).exp(),
            Self::Power => S::from(a.re().powf(b.re())),
            Self::Atan2 if a.re() == 0.0 && b.re() == 0.0 => S::from(0.0),
            Self::Atan2 => a.atan2(b),
            Self::Minimum if b.re() < a.re() || b.re().is_nan() => b,
            Self::Maximum if b.re() > a.re() || b.re().is_nan() => b,
            Self::Minimum | Self::Maximum => a,
        }
    }
}

/// Largest integer exponent that is computed by multiplications.
const MAX_WHOLE_EXPONENT: f64 = 64.0;

/// Returns x to a power that is a literal number.
#[expect(clippy::cast_possible_truncation, reason = "a whole number up to 64")]
fn power<S: Scalar>(x: S, exponent: f64) -> S {
    if exponent.fract() == 0.0 && exponent.abs() <= MAX_WHOLE_EXPONENT {
        return x.powi(exponent as i32);
    }
    if x.re() == 0.0 { S::from(x.re().powf(exponent)) } else { x.powf(exponent) }
}

/// Returns the sign −1, 0 or 1 of x; NaN for NaN.
fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// Returns tanh x, with a derivative of 0 if |x| is so large that tanh x equals ±1 to rounding.
fn tanh<S: Scalar>(x: S) -> S {
    /// Smallest argument at which tanh equals ±1 to rounding.
    const SATURATED_TANH: f64 = 20.0;
    if x.re().abs() > SATURATED_TANH { S::from(sign(x.re())) } else { x.tanh() }
}

/// Returns the uniform cubic B-spline with the knots 0, 1, 2, 3, 4; 0 outside 0…4.
fn cubic_spline<S: Scalar>(u: S) -> S {
    let above = u.re() > 2.0;
    let v = if above { -u + 4.0 } else { u };
    match v.re() {
        re if re <= 0.0 => S::from(0.0),
        re if re <= 1.0 => v * v * v / 6.0,
        _ => {
            let w = -v + 2.0;
            let square = w * w;
            (square * w * 3.0 - square * 6.0 + 4.0) / 6.0
        }
    }
}
