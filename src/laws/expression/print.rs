//! Expressions as text.

use std::fmt;

use super::tree::{Expression, Operator};
use crate::laws::quantity::Quantity;

/// Names under which covariates and parameters are printed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Names<'a> {
    /// Names of the covariates.
    pub covariates: &'a [String],
    /// Names of the parameters.
    pub parameters: &'a [String],
}

/// Expression with the names of its covariates and parameters, for printing.
struct Named<'a> {
    expression: &'a Expression,
    names: Names<'a>,
}

impl Expression {
    /// Returns the expression as text with these names. Parsing the text gives an equal expression.
    pub fn display<'a>(&'a self, names: Names<'a>) -> impl fmt::Display + 'a {
        Named { expression: self, names }
    }

    /// Returns the binding strength of the outermost operator: 1 sum, 2 product, 3 sign, 4 power, 5
    /// for expressions that need no parentheses.
    fn strength(&self) -> u8 {
        match self {
            Self::Binary(Operator::Add | Operator::Subtract, _) => 1,
            Self::Binary(Operator::Multiply | Operator::Divide, _) => 2,
            Self::Negative(_) => 3,
            Self::Number(number) if number.is_sign_negative() => 3,
            Self::Binary(Operator::Power, _) => 4,
            _ => 5,
        }
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.display(Names::default()).fmt(f)
    }
}

impl fmt::Display for Named<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = |expression| Self { expression, names: self.names };
        match self.expression {
            Expression::Number(number) => write!(f, "{number}"),
            Expression::Quantity(quantity) => self.quantity(*quantity, f),
            Expression::Parameter(index) => match self.names.parameters.get(*index) {
                Some(name) => f.write_str(name),
                None => write!(f, "parameter{}", index + 1),
            },
            Expression::Negative(inner) => {
                f.write_str("-")?;
                named(inner).in_parentheses(inner.strength() < 4, f)
            }
            Expression::Call(function, argument) => {
                write!(f, "{}({})", function.name(), named(argument))
            }
            Expression::Binary(operator, operands) => {
                let [left, right] = &**operands;
                let (sign, min_strengths) = match operator {
                    Operator::Add => (" + ", (1, 2)),
                    Operator::Subtract => (" - ", (1, 2)),
                    Operator::Multiply => ("*", (2, 3)),
                    Operator::Divide => ("/", (2, 3)),
                    Operator::Power => ("^", (5, 3)),
                    Operator::Atan2 | Operator::Minimum | Operator::Maximum => {
                        let mut calls = Operator::CALLS.iter();
                        let name =
                            calls.find(|(known, _)| known == operator).map_or("", |call| call.1);
                        return write!(f, "{name}({}, {})", named(left), named(right));
                    }
                };
                named(left).in_parentheses(left.strength() < min_strengths.0, f)?;
                f.write_str(sign)?;
                named(right).in_parentheses(right.strength() < min_strengths.1, f)
            }
        }
    }
}

impl Named<'_> {
    /// Writes the expression, in parentheses if they are `needed`.
    fn in_parentheses(&self, needed: bool, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if needed { write!(f, "({self})") } else { write!(f, "{self}") }
    }

    /// Writes a quantity as formulas name it.
    fn quantity(&self, quantity: Quantity, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match quantity {
            Quantity::Command(joint) => write!(f, "q{}", joint + 1),
            Quantity::Warming => f.write_str("T"),
            Quantity::Lagging { time_constant } => write!(f, "lag(T, {time_constant})"),
            Quantity::Friction { joint, distance } => {
                write!(f, "friction(q{}, {distance})", joint + 1)
            }
            Quantity::Elapsed => f.write_str("t"),
            Quantity::Time => f.write_str("time"),
            Quantity::Payload => f.write_str("payload"),
            Quantity::Hoist => f.write_str("hoist"),
            Quantity::Approach(joint) => write!(f, "approach{}", joint + 1),
            Quantity::Moment(joint) => write!(f, "M{}", joint + 1),
            Quantity::Covariate(index) => match self.names.covariates.get(index) {
                Some(name) if is_word(name) => f.write_str(name),
                Some(name) => write!(f, "`{name}`"),
                None => write!(f, "covariate{}", index + 1),
            },
        }
    }
}

/// Returns true if a name can be written in a formula without quotes.
fn is_word(name: &str) -> bool {
    name.starts_with(|c: char| c.is_alphabetic() || c == '_')
        && name.chars().all(|c| c.is_alphanumeric() || c == '_')
}
