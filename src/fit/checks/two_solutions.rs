//! Check for a second arm that explains the measurements as well as the fitted one.

use nalgebra::DVector;
use rand::RngExt as _;
use serde_json::json;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use crate::fit::uncertainty::second_solution::SecondSolution;
use crate::model::Pose;
use crate::model::parameter::Parameter;
use crate::problem::{JointKind, PoseView};
use crate::quantity::format::{about_three_digits, decimals, mm};
use crate::random;

/// Number of drawn configurations among which the one is sought that tells the arms apart best.
const CANDIDATES: usize = 300;
/// Seed of these configurations.
const SEED: u64 = 1;
/// Smallest distance of the predictions of two arms, in σ of a coordinate, that one measurement
/// tells apart.
const MIN_APART: f64 = 5.0;
/// Largest number of decimals of an estimate.
const MOST_DECIMALS: usize = 6;

/// Checks that the measurements exclude every other arm that is found.
pub(super) fn one_solution(fit: &CheckedFit) -> Option<Finding> {
    fit.second.map(|second| two_solutions_finding(fit, second))
}

/// Reports the parameter in which the arms differ most, in standard errors, and the configuration
/// in which their predictions do.
fn two_solutions_finding(fit: &CheckedFit, second: &SecondSolution) -> Finding {
    let x = &fit.end.x;
    let k = fit.whole.unknowns[second.most];
    let parameter = &fit.model().parameters[k];
    let name = &parameter.name;
    let error = parameter.value_error(x[k], fit.statistics.errors[second.most]);
    let [estimate, other] = [x, &second.x].map(|x| parameter.value(x[k]));
    let probability = second.probability();
    let (code, place) = if second.is_too_far() {
        (FindingCode::FartherSolution, ", farther from the nominal one,")
    } else {
        (FindingCode::TwoSolutions, "")
    };
    let text = format!(
        "a second arm{place} explains the measurements too, with a probability of {:.1} %: {name} is {} instead of {} (χ² \
         with priors is {} {})",
        probability * 100.0,
        shown(parameter, other, error),
        shown(parameter, estimate, error),
        about_three_digits(second.excess.abs()),
        if second.excess < 0.0 { "smaller" } else { "larger" },
    );
    let is_position = fit.table().leading().is_position();
    let told = if is_position { most_different(fit, &second.x) } else { None };
    let numbers = [
        json!(name),
        estimate.into(),
        other.into(),
        second.excess.into(),
        probability.into(),
        json!(told.as_ref().map(|told| told.1)),
        json!(told.as_ref().map(|told| &told.0)),
    ];
    let finding = Finding::new(code, numbers, text);
    let Some((configuration, apart)) = told else { return finding };
    let remedy = if apart > MIN_APART * fit.sigma_taken {
        format!(
            "measure poses like q = {}, in which their targets are {} mm apart",
            words(fit, &configuration),
            mm(apart, 2)
        )
    } else {
        format!(
            "no pose within the ranges of the joints tells their targets apart: hold {name}, or \
             give it a narrower prior"
        )
    };
    finding.with_remedy(remedy)
}

/// Returns a value with its unit, to the digits of its standard error.
fn shown(parameter: &Parameter, value: f64, error: f64) -> String {
    let display = parameter.unit().display(value);
    let digits = decimals(error * display.factor, MOST_DECIMALS);
    let gap = if display.symbol == "°" { "" } else { " " };
    format!("{:.digits$}{gap}{}", value * display.factor, display.symbol)
}

/// Returns a configuration in degrees and millimetres; fixed joints are left out.
fn words(fit: &CheckedFit, configuration: &[f64]) -> String {
    let joints = fit.problem.joints.iter().zip(configuration);
    let value = |kind: JointKind, q: f64| match kind {
        JointKind::Revolute => Some(format!("{:.0}°", q.to_degrees())),
        JointKind::Prismatic => Some(format!("{:.0} mm", q * 1e3)),
        JointKind::Fixed => None,
    };
    let values = joints.filter_map(|(joint, q)| value(joint.command_kind(), *q));
    format!("({})", values.collect::<Vec<_>>().join(", "))
}

/// Returns the configuration, of some drawn within limits and measured ranges, in which the targets
/// of the fitted arm and of the one with the full parameter vector `other` are farthest apart, with
/// their distance \[m\]. `None` if no configuration has an equilibrium.
fn most_different(fit: &CheckedFit, other: &DVector<f64>) -> Option<(Vec<f64>, f64)> {
    let measurements = fit.table();
    let first = *fit.rows().first()?;
    let template = *fit.fitting.poses(&[first]).first()?;
    let range = |(k, (low, high)): (usize, (f64, f64))| {
        let commands = || (0..measurements.len()).map(|row| measurements.configuration(row)[k]);
        let from = if low.is_finite() { low } else { commands().fold(f64::INFINITY, f64::min) };
        let to = if high.is_finite() { high } else { commands().fold(-f64::INFINITY, f64::max) };
        (from, to.max(from))
    };
    let limits = fit.problem.joints.iter().map(|joint| joint.limits);
    let ranges: Vec<(f64, f64)> = limits.enumerate().map(range).collect();
    let mut random = random::stream(SEED, 0);
    let mut drawn = || -> Vec<f64> {
        ranges.iter().map(|(from, to)| from + (to - from) * random.random::<f64>()).collect()
    };
    let configurations: Vec<Vec<f64>> = (0..CANDIDATES).map(|_| drawn()).collect();
    let poses: Vec<Pose> = configurations
        .iter()
        .map(|configuration| Pose {
            setup: PoseView { configuration, ..template.setup },
            ..template
        })
        .collect();
    let [here, there] =
        [&fit.end.x, other].map(|x| fit.model().predicted_targets(&poses, x.as_slice()));
    let apart = here.iter().zip(&there).map(|(a, b)| (a - b).norm());
    let (best, apart) = apart
        .enumerate()
        .filter(|(_, apart)| apart.is_finite())
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some((configurations[best].clone(), apart))
}
