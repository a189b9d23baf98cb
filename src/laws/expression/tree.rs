//! Syntax tree of a formula.

use crate::laws::quantity::Quantity;

/// Formula over quantities of a pose and named parameters.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Expression {
    /// A literal number, SI.
    Number(f64),
    /// A quantity of the pose.
    Quantity(Quantity),
    /// A named parameter, by its index in the list of names.
    Parameter(usize),
    /// −a.
    Negative(Box<Self>),
    /// Two operands and the operator between them.
    Binary(Operator, Box<[Self; 2]>),
    /// A function of one argument.
    Call(Function, Box<Self>),
}

/// Binary operator; `atan2`, `min` and `max` are written as calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Operator {
    /// a + b.
    Add,
    /// a − b.
    Subtract,
    /// a b.
    Multiply,
    /// a / b.
    Divide,
    /// a to the power of b.
    Power,
    /// Angle of the point (b, a) \[rad\], −π to π.
    Atan2,
    /// The smaller of a and b.
    Minimum,
    /// The greater of a and b.
    Maximum,
}

/// Function of one argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Function {
    /// Sine.
    Sin,
    /// Cosine.
    Cos,
    /// Tangent.
    Tan,
    /// Exponential.
    Exp,
    /// exp(x) − 1, exact for small x.
    Expm1,
    /// Natural logarithm.
    Log,
    /// Square root; its derivative at 0 counts as 0.
    Sqrt,
    /// Absolute value; its derivative at 0 counts as 0.
    Abs,
    /// −1, 0 or 1.
    Sign,
    /// Hyperbolic tangent.
    Tanh,
    /// 1 from 0 on, 0 below.
    Step,
    /// Uniform cubic B-spline over the intervals 0…4; its shifts by whole numbers add up to 1.
    Spline,
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

    /// Calls `visit` for every node, parents first.
    pub fn visit(&self, visit: &mut impl FnMut(&Self)) {
        visit(self);
        match self {
            Self::Number(_) | Self::Quantity(_) | Self::Parameter(_) => {}
            Self::Negative(inner) | Self::Call(_, inner) => inner.visit(visit),
            Self::Binary(_, operands) => operands.iter().for_each(|operand| operand.visit(visit)),
        }
    }

    /// Returns the quantities that occur, each once, in the order of the text.
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

    /// Returns true if a named parameter occurs, by its index.
    pub fn uses(&self, parameter: usize) -> bool {
        let mut found = false;
        self.visit(&mut |node| found |= *node == Self::Parameter(parameter));
        found
    }

    /// Returns joint (from 0), order k and whether it is a cosine, of sin kq or cos kq.
    pub fn wave(&self) -> Option<(usize, f64, bool)> {
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

    /// Returns joint, whole order and whether it is a cosine, like [`wave`](Self::wave).
    pub fn whole_wave(&self) -> Option<(usize, u32, bool)> {
        let (joint, order, cosine) = self.wave()?;
        Some((joint, whole(order)?, cosine))
    }
}

/// Returns a number as a whole one from 1 on, if it is one.
fn whole(number: f64) -> Option<u32> {
    let is_whole = number.fract() == 0.0 && (1.0..=f64::from(u32::MAX)).contains(&number);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number within the range of u32"
    )]
    is_whole.then_some(number as u32)
}
