//! Syntax tree of a formula.

use std::f64::consts::PI;

use crate::laws::quantity::Quantity;

/// Formula over quantities of a pose and named parameters.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Expression {
    /// Literal number, SI.
    Number(f64),
    /// Quantity of the pose.
    Quantity(Quantity),
    /// Named parameter, by its index in the list of parameter names.
    Parameter(usize),
    /// Negation −a.
    Negative(Box<Self>),
    /// Two operands and the operator between them.
    Binary(Operator, Box<[Self; 2]>),
    /// Function of one argument.
    Call(Function, Box<Self>),
}

/// Binary operator; `atan2`, `min` and `max` are written as calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Operator {
    /// Sum a + b.
    Add,
    /// Difference a − b.
    Subtract,
    /// Product a b.
    Multiply,
    /// Quotient a / b.
    Divide,
    /// Power, a to the power of b.
    Power,
    /// Angle of the point with x = b and y = a from the x axis \[rad\], −π to π.
    Atan2,
    /// Minimum of a and b.
    Minimum,
    /// Maximum of a and b.
    Maximum,
}

/// Function of one argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Function {
    /// Sine of an angle.
    Sin,
    /// Cosine of an angle.
    Cos,
    /// Tangent of an angle.
    Tan,
    /// Exponential function.
    Exp,
    /// Function exp(x) − 1, exact for small x.
    Expm1,
    /// Natural logarithm.
    Log,
    /// Square root; its derivative at 0 counts as 0.
    Sqrt,
    /// Absolute value; its derivative at 0 counts as 0.
    Abs,
    /// Sign −1, 0 or 1.
    Sign,
    /// Hyperbolic tangent.
    Tanh,
    /// Unit step: 1 for arguments from 0 on, else 0.
    Step,
    /// Uniform cubic B-spline with the knots 0, 1, 2, 3, 4; 0 outside 0…4. Its shifts by integers
    /// add up to 1.
    Spline,
}

/// Factors by which angles are converted: degrees and radians, and degrees of a turn.
const CONVERSIONS: [f64; 4] = [PI / 180.0, 180.0 / PI, 180.0, 360.0];

impl Expression {
    /// Returns the factor of a joint's command in a sine, cosine or tangent if it is that between
    /// two units of an angle.
    pub(crate) fn converted_angle(&self) -> Option<f64> {
        match self {
            Self::Call(Function::Sin | Function::Cos | Function::Tan, argument) => {
                let factor = argument.factor_of_command()?.abs();
                let is_conversion = |known: &f64| (factor / known - 1.0).abs() < 1e-3;
                CONVERSIONS.iter().any(is_conversion).then_some(factor)
            }
            Self::Call(_, argument) | Self::Negative(argument) => argument.converted_angle(),
            Self::Binary(_, sides) => sides.iter().find_map(Self::converted_angle),
            Self::Number(_) | Self::Quantity(_) | Self::Parameter(_) => None,
        }
    }

    /// Returns the number that multiplies the command of a joint in a product or sum; `None` if
    /// there is no such command.
    fn factor_of_command(&self) -> Option<f64> {
        match self {
            Self::Quantity(Quantity::Command(_)) => Some(1.0),
            Self::Negative(inner) => Some(-inner.factor_of_command()?),
            Self::Binary(operator, sides) => {
                let [left, right] = &**sides;
                let of = |side: &Self| side.factor_of_command();
                match operator {
                    Operator::Multiply => {
                        let left_factor = of(left).zip(right.number());
                        let (factor, number) =
                            left_factor.or_else(|| of(right).zip(left.number()))?;
                        Some(factor * number)
                    }
                    Operator::Divide => Some(of(left)? / right.number()?),
                    Operator::Add | Operator::Subtract => of(left).or_else(|| of(right)),
                    _ => None,
                }
            }
            _ => None,
        }
    }

    /// Returns the value of an expression of numbers alone.
    fn number(&self) -> Option<f64> {
        match self {
            Self::Number(value) => Some(*value),
            Self::Negative(inner) => Some(-inner.number()?),
            Self::Binary(operator, sides) => {
                let [left, right] = [sides[0].number()?, sides[1].number()?];
                match operator {
                    Operator::Add => Some(left + right),
                    Operator::Subtract => Some(left - right),
                    Operator::Multiply => Some(left * right),
                    Operator::Divide => Some(left / right),
                    _ => None,
                }
            }
            _ => None,
        }
    }
}

impl Function {
    /// All functions of one argument with their names.
    pub const ALL: [(Self, &'static str); 12] = [
        (Self::Sin, "sin"),
        (Self::Cos, "cos"),
        (Self::Tan, "tan"),
        (Self::Exp, "exp"),
        (Self::Expm1, "expm1"),
        (Self::Log, "log"),
        (Self::Sqrt, "sqrt"),
        (Self::Abs, "abs"),
        (Self::Sign, "sign"),
        (Self::Tanh, "tanh"),
        (Self::Step, "step"),
        (Self::Spline, "spline"),
    ];

    /// Returns the name in formulas.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(function, _)| *function == self).map_or("", |(_, name)| *name)
    }
}

impl Operator {
    /// Operators that are written as calls of two arguments, with their names.
    pub const CALLS: [(Self, &'static str); 3] =
        [(Self::Atan2, "atan2"), (Self::Minimum, "min"), (Self::Maximum, "max")];
}

impl Expression {
    /// Returns a binary expression.
    pub fn binary(operator: Operator, left: Self, right: Self) -> Self {
        Self::Binary(operator, Box::new([left, right]))
    }

    /// Calls `visit` for every node of the tree, parents before children.
    pub fn visit(&self, visit: &mut impl FnMut(&Self)) {
        visit(self);
        match self {
            Self::Number(_) | Self::Quantity(_) | Self::Parameter(_) => {}
            Self::Negative(inner) | Self::Call(_, inner) => inner.visit(visit),
            Self::Binary(_, operands) => operands.iter().for_each(|operand| operand.visit(visit)),
        }
    }

    /// Returns the quantities that occur, without duplicates, in the order of the text.
    pub fn quantities(&self) -> Vec<Quantity> {
        let mut found = Vec::new();
        self.visit(&mut |node| {
            if let Self::Quantity(quantity) = node
                && !found.contains(quantity)
            {
                found.push(*quantity);
            }
        });
        found
    }

    /// Returns true if the parameter with this index occurs.
    pub fn uses(&self, parameter: usize) -> bool {
        let mut found = false;
        self.visit(&mut |node| found |= *node == Self::Parameter(parameter));
        found
    }

    /// Returns (joint from 0, order k, true for a cosine) if the expression is sin kq or cos kq;
    /// else `None`.
    pub fn as_wave(&self) -> Option<(usize, f64, bool)> {
        let Self::Call(function @ (Function::Sin | Function::Cos), argument) = self else {
            return None;
        };
        let cosine = *function == Function::Cos;
        match &**argument {
            Self::Quantity(Quantity::Command(joint)) => Some((*joint, 1.0, cosine)),
            Self::Binary(Operator::Multiply, operands) => match &**operands {
                [Self::Number(order), Self::Quantity(Quantity::Command(joint))] => {
                    Some((*joint, *order, cosine))
                }
                _ => None,
            },
            _ => None,
        }
    }

    /// Returns joint, order and true for a cosine, like [`wave`](Self::wave), if the order is an
    /// integer.
    pub fn whole_wave(&self) -> Option<(usize, u32, bool)> {
        let (joint, order, cosine) = self.as_wave()?;
        Some((joint, whole(order)?, cosine))
    }
}

/// Returns a number as an integer, if it is one and at least 1.
fn whole(number: f64) -> Option<u32> {
    let is_whole = number.fract() == 0.0 && (1.0..=f64::from(u32::MAX)).contains(&number);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number within the range of u32"
    )]
    is_whole.then_some(number as u32)
}
