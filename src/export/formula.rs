//! Generator of C constants and C expressions for formulas of laws.

use std::fmt::Write as _;

use super::error::ExportError;
use crate::laws::Quantity;
use crate::laws::expression::{Expression, Function, Operator};
use crate::model::parameter::Regressor;

/// Number of table entries written on one line.
const NUMBERS_PER_LINE: usize = 6;

/// Returns the C definitions of those helper functions that `code` calls, such as the spline.
pub(super) fn helpers(code: &str) -> String {
    let functions = include_str!("c/helpers.c").split_inclusive("}\n\n");
    let name =
        |text: &str| text.split_once("real ")?.1.split_once('(').map(|(name, _)| name.to_owned());
    let is_called = |text: &&str| name(text).is_some_and(|name| code.contains(&(name + "(")));
    functions.filter(is_called).collect()
}

/// Returns a number as a C constant of type `real`; infinite numbers become ±10³⁰.
pub(super) fn real(number: f64) -> String {
    if number.is_infinite() {
        return (if number > 0.0 { "R(1e30)" } else { "R(-1e30)" }).to_owned();
    }
    format!("R({number:?})")
}

/// Writes a table of numbers as a C array called `name`.
pub(super) fn array(text: &mut String, name: &str, values: &[f64]) {
    let _ = writeln!(text, "static const real {name}[{}] = {{", values.len().max(1));
    if values.is_empty() {
        text.push_str("    R(0.0)\n");
    }
    for line in values.chunks(NUMBERS_PER_LINE) {
        let numbers: Vec<String> = line.iter().map(|&number| real(number)).collect();
        let _ = writeln!(text, "    {},", numbers.join(", "));
    }
    text.push_str("};\n");
}

/// Returns the C expression for the value of a regressor in a pose. The parameters inside its
/// formula are in the table of numbers from index `first` on.
///
/// # Errors
/// Returns an error if the formula contains moments of the loads, or depends on earlier poses.
pub(super) fn formula(regressor: &Regressor, first: usize) -> Result<String, ExportError> {
    let Some(expression) = super::numbers::expression(regressor) else {
        return Ok("R(1.0)".to_owned());
    };
    let (reference, hoist) = match regressor {
        Regressor::Formula(formula) => (formula.reference(), formula.hoist()),
        _ => (0.0, 0.0),
    };
    let follows_loads =
        || regressor.quantities().iter().any(|quantity| matches!(quantity, Quantity::Moment(_)));
    let refuse = || match regressor.text() {
        formula if follows_loads() => ExportError::NeedsLoads { formula },
        formula => ExportError::NeedsPast { formula },
    };
    Printer { first, reference, hoist }.print(&expression).ok_or_else(refuse)
}

/// Printer of expressions as C.
struct Printer {
    /// Index of the formula's first parameter in the table of numbers.
    first: usize,
    /// Reference temperature [°C].
    reference: f64,
    /// Hoist force of a pose that states none \[N\].
    hoist: f64,
}

impl Printer {
    /// Returns the C text of an expression; `None` if it depends on earlier poses or on moments of
    /// the loads.
    fn print(&self, expression: &Expression) -> Option<String> {
        Some(match expression {
            Expression::Number(number) => real(*number),
            Expression::Parameter(index) => format!("number[{}]", self.first + index),
            Expression::Quantity(quantity) => self.quantity(*quantity)?,
            Expression::Negative(inner) => format!("(-{})", self.print(inner)?),
            Expression::Call(function, argument) => {
                let name = match function {
                    Function::Sin => "SIN",
                    Function::Cos => "COS",
                    Function::Tan => "TAN",
                    Function::Exp => "EXP",
                    Function::Expm1 => "EXPM1",
                    Function::Log => "LOG",
                    Function::Sqrt => "SQRT",
                    Function::Abs => "FABS",
                    Function::Tanh => "TANH",
                    Function::Sign => "sign_of",
                    Function::Step => "step_of",
                    Function::Spline => "spline_of",
                };
                format!("{name}({})", self.print(argument)?)
            }
            Expression::Binary(operator, operands) => {
                let [left, right] = &**operands;
                let (left, right) = (self.print(left)?, self.print(right)?);
                match operator {
                    Operator::Add => format!("({left} + {right})"),
                    Operator::Subtract => format!("({left} - {right})"),
                    Operator::Multiply => format!("({left} * {right})"),
                    Operator::Divide => format!("({left} / {right})"),
                    Operator::Power => format!("POW({left}, {right})"),
                    Operator::Atan2 => format!("ATAN2({left}, {right})"),
                    Operator::Minimum => format!("smaller_of({left}, {right})"),
                    Operator::Maximum => format!("larger_of({left}, {right})"),
                }
            }
        })
    }

    /// Returns the C text of a quantity; `None` if the generated code cannot compute it.
    fn quantity(&self, quantity: Quantity) -> Option<String> {
        Some(match quantity {
            Quantity::Command(joint) => format!("pose->q[{joint}]"),
            Quantity::Warming => format!("(pose->temperature_C - {})", real(self.reference)),
            Quantity::Elapsed => "pose->elapsed_s".to_owned(),
            Quantity::Time => "pose->time_s".to_owned(),
            Quantity::Payload => "pose->payload_kg".to_owned(),
            Quantity::Hoist => {
                format!("(pose->has_hoist != 0 ? pose->hoist_N : {})", real(self.hoist))
            }
            Quantity::Approach(joint) => {
                format!("(pose->has_approach != 0 ? pose->approach[{joint}] : R(0.0))")
            }
            Quantity::Covariate(index) => format!("pose->covariate[{index}]"),
            Quantity::Lagging { .. } | Quantity::Friction { .. } | Quantity::Moment(_) => {
                return None;
            }
        })
    }
}
