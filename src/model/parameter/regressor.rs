//! Regressors: functions of a pose that multiply parameters.

use std::sync::Arc;

use num_dual::Dual64;

use crate::laws::Quantity;
use crate::laws::expression::{Expression, FormulaError, Names, Parsed, Per, Vocabulary, parse};
use crate::mechanics::{Arm, AxisMoments};
use crate::problem::{PoseView, Problem, ThermalLag};

/// Function of a pose that multiplies a parameter at its site.
///
/// Joints are counted from 0. Harmonics of integer order are separate variants, because sums of
/// many of them are evaluated in one pass.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Regressor {
    /// Factor 1 of a parameter that replaces the quantity at its site.
    Constant,
    /// Factor 1 of a parameter that is added to the quantity at its site.
    Unit,
    /// Function sin kq of a joint's command q and an order k.
    Sine(usize, u32),
    /// Function cos kq of a joint's command q and an order k.
    Cosine(usize, u32),
    /// Formula that is no harmonic of integer order.
    Formula(Arc<Formula>),
    /// Velocity of a joint in the row of a pixel \[rad/s\] or \[m/s\], times the row of the image if
    /// `by_row` is true; 0 for other rows, and if no velocities are recorded.
    Exposure {
        /// Index of the camera among the fixtures.
        camera: usize,
        /// Index of the joint.
        joint: usize,
        /// True if the row of the image multiplies the velocity.
        by_row: bool,
    },
    /// Marker of a parameter inside formulas: it multiplies nothing (value 0).
    Inner,
    /// Derivative of formulas with respect to a parameter inside them, or to a load whose moments
    /// they use.
    Slope(Arc<Slope>),
}

/// Derivative of a sum of terms c f(pose; p) with respect to one parameter p.
#[derive(Debug, Clone, PartialEq)]
pub struct Slope {
    /// Coefficient c, formula f with its parameter values, and way in which f depends on p, for
    /// each term.
    terms: Vec<(f64, Arc<Formula>, Dependence)>,
}

/// Way in which a formula depends on a parameter.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Dependence {
    /// Parameter inside the formula, by its index among the formula's parameters.
    Inner(usize),
    /// Load whose moments the formula uses; the load is the dual number's variable.
    Load(Arc<AxisMoments<Dual64>>),
}

impl Slope {
    /// Creates the derivative from the coefficient, the formula and the dependence of each term.
    pub(super) fn new(terms: Vec<(f64, Arc<Formula>, Dependence)>) -> Self {
        Self { terms }
    }

    /// Returns the value of the derivative in a pose.
    pub(super) fn value(&self, setup: &PoseView) -> f64 {
        let slope = |(c, formula, variable): &(f64, Arc<Formula>, Dependence)| {
            c * match variable {
                Dependence::Inner(index) => formula.parameter_slope(setup, *index),
                Dependence::Load(moments) => formula.load_slope(setup, moments),
            }
        };
        self.terms.iter().map(slope).sum()
    }
}

/// Formula over quantities of a pose, with default values of quantities that a pose does not
/// record.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula {
    expression: Expression,
    per: Per,
    /// Names of the covariates, used to print the formula.
    covariates: Vec<String>,
    /// Reference temperature T₀ [°C].
    reference: f64,
    /// Payload of poses that record none \[kg\].
    payload: f64,
    /// Hoist force of poses that record none \[N\].
    hoist: f64,
    /// Full names and values of the parameters inside the formula.
    parameters: Vec<(String, f64)>,
    /// Moments of the arm's loads; `None` if the formula does not use them.
    moments: Option<Arc<AxisMoments<f64>>>,
    /// True if the term displaces the base itself, false if it is an error of the instrument's
    /// readings.
    moves_base: bool,
}

impl Formula {
    /// Returns the reference temperature T₀ [°C].
    pub(crate) fn reference(&self) -> f64 {
        self.reference
    }

    /// Returns the hoist force of poses that record none \[N\].
    pub(crate) fn hoist(&self) -> f64 {
        self.hoist
    }

    /// Returns the value of a quantity in a pose, in the quantity's SI unit.
    fn quantity(&self, quantity: Quantity, setup: &PoseView) -> f64 {
        let side = |joint: usize| {
            setup.approach.and_then(|sides| sides.get(joint).copied()).unwrap_or(0.0)
        };
        match quantity {
            Quantity::Command(joint) => setup.configuration[joint],
            Quantity::Warming => {
                setup.temperature.map_or(0.0, |temperature| temperature - self.reference)
            }
            Quantity::Lagging { time_constant } => setup.temperature.map_or(0.0, |&temperature| {
                setup.past.read().lagged_temperature((setup.time, temperature), time_constant)
                    - self.reference
            }),
            Quantity::Friction { joint, distance } => {
                let now = (setup.configuration[joint], side(joint));
                setup.past.read().friction_state(joint, now, distance)
            }
            Quantity::Elapsed => setup.elapsed,
            Quantity::Time => setup.time,
            Quantity::Payload => setup.payload.copied().unwrap_or(self.payload),
            Quantity::Hoist => setup.hoist.copied().unwrap_or(self.hoist),
            Quantity::Approach(joint) => side(joint),
            Quantity::Moment(joint) => {
                let moments = self.moments.as_ref().map(|moments| moments.at(setup));
                moments.and_then(|moments| moments.get(joint).copied()).unwrap_or(0.0)
            }
            Quantity::Covariate(index) => setup.covariates.get(index).copied().unwrap_or(0.0),
        }
    }

    /// Returns the derivative of a quantity in a pose with respect to the command of a joint,
    /// counted from 0.
    fn quantity_slope(&self, quantity: Quantity, setup: &PoseView, joint: usize) -> f64 {
        match quantity {
            Quantity::Moment(about) => {
                let seed = Dual64::from(0.0).derivative();
                let moments = self.moments.as_ref().map(|all| all.seeded(joint, seed).at(setup));
                moments.and_then(|moments| Some(moments.get(about)?.eps)).unwrap_or(0.0)
            }
            Quantity::Command(commanded) if commanded == joint => 1.0,
            Quantity::Friction { joint: held, distance } if held == joint => {
                let side =
                    setup.approach.and_then(|sides| sides.get(joint).copied()).unwrap_or(0.0);
                setup.past.read().friction_state_slope(
                    joint,
                    (setup.configuration[joint], side),
                    distance,
                )
            }
            _ => 0.0,
        }
    }

    /// Returns full names and values of the parameters inside the formula.
    pub(crate) fn parameters(&self) -> &[(String, f64)] {
        &self.parameters
    }

    /// Returns the formula with other parameter values.
    pub(super) fn with_parameters(&self, parameters: Vec<(String, f64)>) -> Self {
        Self { parameters, ..self.clone() }
    }

    /// Returns true if the formula uses moments of the arm's loads.
    pub(super) fn uses_moments(&self) -> bool {
        self.moments.is_some()
    }

    /// Returns the formula with its moments about the joint axes replaced by `moments`.
    pub(super) fn with_moments(&self, moments: Arc<AxisMoments<f64>>) -> Self {
        Self { moments: Some(moments), ..self.clone() }
    }

    fn value(&self, setup: &PoseView) -> f64 {
        let at = |quantity| self.quantity(quantity, setup);
        match self.expression {
            // Most formulas are a single quantity.
            Expression::Quantity(quantity) => at(quantity),
            _ if self.parameters.is_empty() => self.expression.evaluate(&at, &[]),
            _ => {
                let values: Vec<f64> =
                    self.parameters.iter().map(|parameter| parameter.1).collect();
                self.expression.evaluate(&at, &values)
            }
        }
    }

    /// Returns the derivative of the formula's value in a pose with respect to the parameter with
    /// index `parameter`.
    pub(super) fn parameter_slope(&self, setup: &PoseView, parameter: usize) -> f64 {
        let seeded = |(k, (_, value)): (usize, &(String, f64))| {
            Dual64::new(*value, f64::from(u8::from(k == parameter)))
        };
        let values: Vec<Dual64> = self.parameters.iter().enumerate().map(seeded).collect();
        let at = |quantity| Dual64::from(self.quantity(quantity, setup));
        self.expression.evaluate(&at, &values).eps
    }

    /// Returns the derivative of the formula's value in a pose with respect to a load. `moments`
    /// has this load as its variable.
    fn load_slope(&self, setup: &PoseView, moments: &AxisMoments<Dual64>) -> f64 {
        let moments = moments.at(setup);
        let at = |quantity| match quantity {
            Quantity::Moment(joint) => {
                moments.get(joint).copied().unwrap_or_else(|| Dual64::from(0.0))
            }
            _ => Dual64::from(self.quantity(quantity, setup)),
        };
        let values: Vec<Dual64> =
            self.parameters.iter().map(|parameter| Dual64::from(parameter.1)).collect();
        self.expression.evaluate(&at, &values).eps
    }
}

impl Regressor {
    /// Creates the regressor of a formula on the arm of `problem`. `parameters` are full names and
    /// start values of the parameters inside; `moves_base` is true if the term displaces the base
    /// itself.
    pub(crate) fn new(
        formula: &Parsed,
        parameters: Vec<(String, f64)>,
        problem: &Problem,
        moves_base: bool,
    ) -> Self {
        match formula.expression.whole_wave().filter(|_| !moves_base) {
            Some((joint, order, false)) => return Self::Sine(joint, order),
            Some((joint, order, true)) => return Self::Cosine(joint, order),
            None => {}
        }
        let hoists = problem.joints.iter().filter_map(|joint| joint.beam.as_ref()?.hoist.as_ref());
        Self::Formula(Arc::new(Formula {
            per: formula.dimension.per(),
            expression: formula.expression.clone(),
            covariates: problem.covariate_names(),
            reference: problem.data.reference_temperature.unwrap_or(0.0),
            payload: problem.tool.payload_mass,
            hoist: hoists.map(|hoist| hoist.force).sum(),
            parameters,
            moments: formula
                .expression
                .quantities()
                .iter()
                .any(is_load_moment)
                .then(|| Arc::new(AxisMoments::new(Arm::nominal(problem)))),
            moves_base,
        }))
    }

    /// Parses a formula in the syntax of problem files, such as `sin(2*q3)*T`.
    ///
    /// # Errors
    /// Returns an error with the column if the text is no formula of this arm.
    pub fn parse(text: &str, problem: &Problem) -> Result<Self, FormulaError> {
        let (slides, covariates) = (problem.slides(), problem.covariate_names());
        let vocabulary =
            Vocabulary { slides: &slides, covariates: &covariates, ..Vocabulary::default() };
        Ok(Self::new(&parse(text, &vocabulary)?, Vec::new(), problem, false))
    }

    /// Creates the regressor q of a joint's command \[rad\] or \[m\], joint numbered from 1 as in
    /// files.
    pub fn command(problem: &Problem, joint: usize) -> Self {
        Self::parse(&format!("q{joint}"), problem).unwrap_or(Self::Constant)
    }

    /// Returns the regressor as an expression, harmonics included.
    pub fn expression(&self) -> Expression {
        let wave = |function, joint: usize, order: u32| {
            use crate::laws::expression::{Function, Operator};
            let command = Expression::Quantity(Quantity::Command(joint));
            let order = Expression::Number(f64::from(order));
            let argument = Expression::binary(Operator::Multiply, order, command);
            let function = if function { Function::Sin } else { Function::Cos };
            Expression::Call(function, Box::new(argument))
        };
        match self {
            Self::Constant | Self::Unit => Expression::Number(1.0),
            Self::Inner | Self::Slope(_) | Self::Exposure { .. } => Expression::Number(0.0),
            Self::Sine(joint, order) => wave(true, *joint, *order),
            Self::Cosine(joint, order) => wave(false, *joint, *order),
            Self::Formula(formula) => formula.expression.clone(),
        }
    }

    /// Returns the formula in the syntax of problem files.
    pub fn text(&self) -> String {
        let (covariates, parameters) = match self {
            Self::Formula(formula) => {
                let names =
                    formula.parameters.iter().map(|parameter| parameter.0.clone()).collect();
                (formula.covariates.as_slice(), names)
            }
            _ => (&[][..], Vec::new()),
        };
        self.expression().display(Names { covariates, parameters: &parameters }).to_string()
    }

    /// Returns the quantities of a pose that the regressor depends on.
    pub fn quantities(&self) -> Vec<Quantity> {
        match self {
            Self::Constant | Self::Unit | Self::Inner | Self::Slope(_) | Self::Exposure { .. } => {
                Vec::new()
            }
            Self::Sine(joint, _) | Self::Cosine(joint, _) => vec![Quantity::Command(*joint)],
            Self::Formula(formula) => formula.expression.quantities(),
        }
    }

    /// Returns true if the term displaces the base itself, false if it is an error of the
    /// instrument's readings.
    pub(crate) fn moves_base(&self) -> bool {
        matches!(self, Self::Formula(formula) if formula.moves_base)
    }

    /// Returns the quantity that the regressor equals; `None` if it is any other function.
    pub fn as_quantity(&self) -> Option<Quantity> {
        match self {
            Self::Formula(formula) => match formula.expression {
                Expression::Quantity(quantity) => Some(quantity),
                _ => None,
            },
            _ => None,
        }
    }

    /// Returns the regressor's unit, by which the site's unit is divided to give the coefficient's
    /// unit.
    pub(crate) fn per(&self) -> Per {
        match self {
            Self::Formula(formula) => formula.per,
            _ => Per::Number,
        }
    }

    /// Returns the regressor's value in each pose. A lagged temperature is continued from pose to
    /// pose, which is faster than computing it anew for each.
    pub(crate) fn values<'p>(&self, poses: impl Iterator<Item = &'p PoseView<'p>>) -> Vec<f64> {
        let (Self::Formula(formula), Some(Quantity::Lagging { time_constant })) =
            (self, self.as_quantity())
        else {
            return poses.map(|pose| self.value(pose)).collect();
        };
        let mut lag = ThermalLag::new(time_constant);
        let felt = |pose: &PoseView| {
            let now = (pose.time, *pose.temperature?);
            Some(lag.advance(&pose.past.read(), now) - formula.reference)
        };
        poses.map(felt).map(|warming| warming.unwrap_or(0.0)).collect()
    }

    /// Returns the regressor's value in a pose.
    pub fn value(&self, setup: &PoseView) -> f64 {
        match self {
            Self::Constant | Self::Unit => 1.0,
            Self::Exposure { camera, joint, by_row } => {
                let exposed = setup.past.exposed(*camera);
                exposed.map_or(0.0, |(velocities, row)| {
                    velocities
                        .get(*joint)
                        .map_or(0.0, |velocity| if *by_row { velocity * row } else { *velocity })
                })
            }
            Self::Sine(joint, order) => (f64::from(*order) * setup.configuration[*joint]).sin(),
            Self::Cosine(joint, order) => (f64::from(*order) * setup.configuration[*joint]).cos(),
            Self::Formula(formula) => formula.value(setup),
            Self::Inner => 0.0,
            Self::Slope(slope) => slope.value(setup),
        }
    }

    /// Returns the derivative of the regressor's value with respect to the command of a joint,
    /// counted from 0.
    pub fn slope(&self, setup: &PoseView, joint: usize) -> f64 {
        let order = |order: u32| f64::from(order);
        match self {
            Self::Sine(of, k) if *of == joint => {
                order(*k) * (order(*k) * setup.configuration[joint]).cos()
            }
            Self::Cosine(of, k) if *of == joint => {
                -order(*k) * (order(*k) * setup.configuration[joint]).sin()
            }
            Self::Formula(formula) => {
                let seeded = |quantity: Quantity| {
                    let slope = formula.quantity_slope(quantity, setup, joint);
                    Dual64::new(formula.quantity(quantity, setup), slope)
                };
                let values: Vec<Dual64> =
                    formula.parameters.iter().map(|parameter| Dual64::from(parameter.1)).collect();
                formula.expression.evaluate(&seeded, &values).eps
            }
            _ => 0.0,
        }
    }

    /// Returns true if the regressor depends on the commands of joints.
    pub fn follows_commands(&self) -> bool {
        let follows =
            |quantity: &Quantity| quantity.commanded_joint().is_some() || is_load_moment(quantity);
        self.quantities().iter().any(follows)
    }

    /// Returns true if the parameter replaces the quantity at its site.
    pub fn is_constant(&self) -> bool {
        *self == Self::Constant
    }
}

/// Returns true if the quantity is a moment of the loads.
fn is_load_moment(quantity: &Quantity) -> bool {
    matches!(quantity, Quantity::Moment(_))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARM: &str = "name = 'arm'\njoint = [{}, {}]\n[tool]\npayload_kg = 3\n";

    fn regressor(formula: &str) -> Regressor {
        let problem = Problem::parse(ARM, "problem.toml".as_ref()).unwrap();
        Regressor::parse(formula, &problem).unwrap()
    }

    #[test]
    fn a_pose_of_unknown_payload_carries_the_declared_one() {
        let regressor = regressor("0.5*payload*approach2");
        let sides = [1.0, -1.0];
        let pose = PoseView { approach: Some(&sides), ..PoseView::from_configuration(&[0.0, 0.0]) };
        assert!((regressor.value(&pose) + 1.5).abs() < 1e-15);
        assert!((regressor.value(&PoseView { payload: Some(&2.0), ..pose }) + 1.0).abs() < 1e-15);
    }

    #[test]
    fn slopes_are_those_of_the_values() {
        let formulas = [
            "q2",
            "q1",
            "sin(3*q2)",
            "cos(2*q2)",
            "sin(2.43*q2 + 0.7)",
            "t",
            "spline((q2 + 1)/0.7)",
            "spline((payload + 1)/0.7)",
            "exp(-((q2 - 0.4)/0.3)^2/2)",
            "tanh((q2 - 0.4)/0.3)",
            "q1*sin(q2)^3*max(q2, 0.111)",
        ];
        for formula in formulas {
            let regressor = regressor(formula);
            for k in -20..20 {
                let at = |q: f64| regressor.value(&PoseView::from_configuration(&[0.2, q]));
                let (q, step) = (0.093 * f64::from(k), 1e-5);
                let expected = (at(q + step) - at(q - step)) / (2.0 * step);
                let slope = regressor.slope(&PoseView::from_configuration(&[0.2, q]), 1);
                assert!(
                    (slope - expected).abs() < 1e-8,
                    "{regressor:?} at {q}: {slope}, not {expected}"
                );
            }
        }
    }

    #[test]
    fn waves_of_whole_orders_stand_apart_and_print_as_they_are_read() {
        assert_eq!(regressor("sin(3*q2)"), Regressor::Sine(1, 3));
        assert_eq!(regressor("cos(q1)"), Regressor::Cosine(0, 1));
        for formula in ["sin(3*q2)", "lag(T, 300)*q1", "friction(q1, 0.8)", "-expm1(-t/40)"] {
            assert_eq!(regressor(formula).text(), formula);
        }
    }
}
