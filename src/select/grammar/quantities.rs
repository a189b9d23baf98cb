//! Values of the quantities of formulas in some poses.

use crate::laws::to_three_digits;
use crate::model::Pose;
use crate::model::parameter::Regressor;
use crate::problem::{JointKind, Problem};

/// Time constant of the trial temperature lag, as a fraction of the measured duration.
const LAG_FRACTION: f64 = 0.1;

/// Quantities from which formulas are built, with their values in every pose. Quantities that do
/// not vary are left out. Joints are counted from 0.
pub struct Quantities {
    /// Joints that move, with their commands \[rad\] or \[m\].
    pub commands: Vec<(usize, Vec<f64>)>,
    /// True for each joint of the arm that is revolute.
    pub turns: Vec<bool>,
    /// Joints with the side from which they approached each pose, −1 to 1.
    pub sides: Vec<(usize, Vec<f64>)>,
    /// Joints with the moments of the loads about their axes [N·m].
    pub moments: Vec<(usize, Vec<f64>)>,
    /// Temperature above the reference temperature in each pose \[K\]; `None` if no temperature or
    /// no reference is known.
    pub warming: Option<Vec<f64>>,
    /// Time constant \[s\] and lagged temperature above the reference \[K\]; `None` if temperature
    /// or time is unknown.
    pub lag: Option<(f64, Vec<f64>)>,
    /// Time since the first pose, as a fraction of the measured duration, and that duration \[s\].
    pub elapsed: Option<(Vec<f64>, f64)>,
    /// Payload \[kg\].
    pub payload: Option<Vec<f64>>,
    /// Indices of the declared covariates that vary, with their values in their units.
    pub covariates: Vec<(usize, Vec<f64>)>,
    /// Names of all declared covariates.
    pub names: Vec<String>,
}

impl Quantities {
    /// Evaluates the quantities of a problem in some poses. `time_measured` is true if times are
    /// recorded.
    pub fn new(problem: &Problem, poses: &[&Pose], time_measured: bool) -> Self {
        let values = |formula: &str| {
            let regressor = Regressor::parse(formula, problem).ok()?;
            varying(regressor.values(poses.iter().map(|pose| &pose.setup)))
        };
        let joints = || 0..problem.joints.len();
        let takes_command = |joint: &usize| problem.joints[*joint].takes_command();
        let turns: Vec<bool> =
            problem.joints.iter().map(|joint| joint.kind == JointKind::Revolute).collect();
        let of_joints = |name: &str, is_of: &dyn Fn(&usize) -> bool| {
            let of = |joint: usize| Some((joint, values(&format!("{name}{}", joint + 1))?));
            joints().filter(is_of).filter_map(of).collect::<Vec<_>>()
        };
        let is_given_everywhere =
            |is_known: fn(&Pose) -> bool| poses.iter().all(|pose| is_known(pose));
        let has_temperature = is_given_everywhere(|pose| pose.setup.temperature.is_some())
            && problem.data.reference_temperature.is_some();
        let warming = if has_temperature { values("T") } else { None };
        let elapsed = if time_measured { values("t") } else { None };
        let span = elapsed.iter().flatten().copied().fold(0.0, f64::max);
        let lagged = |constant: f64| Some((constant, values(&format!("lag(T, {constant})"))?));
        let names = problem.covariate_names();
        let covariate = |(k, name): (usize, &String)| Some((k, values(&quoted(name))?));
        Self {
            commands: of_joints("q", &takes_command),
            sides: if is_given_everywhere(|pose| pose.setup.approach.is_some()) {
                of_joints("approach", &takes_command)
            } else {
                Vec::new()
            },
            moments: if problem.gravity.norm() > 0.0 {
                of_joints("M", &|joint| turns[*joint] && takes_command(joint))
            } else {
                Vec::new()
            },
            lag: (warming.is_some() && span > 0.0)
                .then(|| to_three_digits(LAG_FRACTION * span).and_then(lagged))
                .flatten(),
            warming,
            elapsed: elapsed.map(|t| (t.iter().map(|t| t / span).collect(), span)),
            payload: values("payload"),
            covariates: names.iter().enumerate().filter_map(covariate).collect(),
            turns,
            names,
        }
    }
}

/// Returns the name of a covariate in back quotes, as formulas write it.
pub(super) fn quoted(name: &str) -> String {
    format!("`{name}`")
}

/// Returns the values if they are finite and not all equal, else `None`.
fn varying(values: Vec<f64>) -> Option<Vec<f64>> {
    let (low, high) = range(&values);
    let scale = low.abs().max(high.abs());
    (values.iter().all(|value| value.is_finite()) && high - low > 1e-9 * scale).then_some(values)
}

/// Returns the smallest and the largest value.
pub(super) fn range(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| {
        (low.min(value), high.max(value))
    })
}
