//! Digest of the inputs on which a finished part depends.

use std::fmt::Write as _;

use super::definition::{Cell, Part, Study};
use crate::problem::PoseRanges;
use crate::problem::digest::hexadecimal;
use crate::rig::{Cause, HeldOutRows, Shape, Truth};

/// Returns a digest of everything on which the fits of a part depend, 64 hexadecimal digits.
///
/// It is the SHA-256 of a text with numbers in SI, as short as they can be read back exactly. Its
/// lines are: version of flexcal, source, seed and held-out poses; σ, poses, strategy, solver,
/// first repetition and the one after the last; the truth; `effects drawn` if effect values are
/// drawn; the text of the problem file. Inputs of other parts do not change the digest: a study
/// with one more noise level keeps its finished parts.
pub(super) fn key(study: &Study, part: &Part, cell: &Cell) -> String {
    let Study { problem_text, source, seed, held_out, .. } = study;
    let drawn = if study.draws_effects && !study.problem.effects.is_empty() {
        "\neffects drawn"
    } else {
        ""
    };
    let Cell { sigma, poses, strategy, solver } = cell;
    let (version, source) = (env!("CARGO_PKG_VERSION"), source.as_str());
    let (strategy, solver) = (strategy.as_str(), solver.as_str());
    let (first, end) = (part.repetitions.start, part.repetitions.end);
    let truth = canonical(&study.truth);
    hexadecimal(&format!(
        "{version} {source} {seed} {held_out}\n{sigma:e} {poses} {strategy} {solver} {first} \
         {end}\n{truth}{drawn}\n{problem_text}"
    ))
}

/// Returns a truth as text in a fixed order.
///
/// Its lines are: `parameter`, name, value; `random`, pattern, standard deviations of angles,
/// lengths and relative values or `-`; `effect`, declaration (`bump` or `step` with the joint if it
/// is outside the catalogue), values; `poses`, ranges of joints, payloads, hoist, temperature,
/// `sides` or `-`; `covariate`, range; `rows`, time step, held-out share or number of the others,
/// σ, segments.
fn canonical(truth: &Truth) -> String {
    let Truth {
        parameters,
        random,
        effects,
        noise_sigma,
        orientation_sigma: _,
        poses,
        time_step,
        held_out,
        segments,
        kind_sigmas: _,
        positions: _,
        tilts: _,
    } = truth;
    let optional =
        |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:e}"));
    let range = |(from, to): (f64, f64)| format!("{from:e} {to:e}");
    let mut text = String::new();
    // Writing to a text cannot fail.
    for parameter in parameters {
        let _ = writeln!(text, "parameter {} {:e}", parameter.name, parameter.value);
    }
    for rule in random {
        let spreads = [rule.angle, rule.length, rule.relative].map(optional).join(" ");
        let _ = writeln!(text, "random {} {spreads}", rule.pattern);
    }
    for effect in effects {
        let cause = match effect.cause() {
            Cause::Catalogued(effect) => effect.declaration(),
            Cause::Outside { joint, shape: Shape::Bump } => format!("bump {joint}"),
            Cause::Outside { joint, shape: Shape::Step } => format!("step {joint}"),
        };
        let values: Vec<String> =
            effect.values().iter().map(|value| format!("{value:e}")).collect();
        let _ = writeln!(text, "effect {cause} {}", values.join(" "));
    }
    let PoseRanges { joints, payloads, hoist, temperature, approach, covariates } = poses;
    let joints: Vec<String> = joints.iter().copied().map(range).collect();
    let payloads: Vec<String> = payloads.iter().map(|mass| format!("{mass:e}")).collect();
    let [hoist, temperature] =
        [hoist, temperature].map(|limits| limits.map_or_else(|| "-".to_owned(), range));
    let sides = if *approach { "sides" } else { "-" };
    let _ = writeln!(
        text,
        "poses {}, {}, {hoist}, {temperature}, {sides}",
        joints.join(" "),
        payloads.join(" ")
    );
    for &limits in covariates {
        let _ = writeln!(text, "covariate {}", range(limits));
    }
    let held_out = match held_out {
        HeldOutRows::Share(share) => format!("share {share:e}"),
        HeldOutRows::AllBut(others) => format!("all-but {others}"),
    };
    let _ = write!(text, "rows {}, {held_out}, {noise_sigma:e}, {segments}", range(*time_step));
    text
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::problem::Problem;

    #[test]
    fn a_truth_is_written_as_a_fixed_text() {
        let arm = "name = 'arm'\n[[joint]]\na_m = 0.5\n";
        let problem = Problem::parse(arm, Path::new("problem.toml")).unwrap();
        let text = "[noise]\nposition_sigma_mm = 0.1\n[random]\n'joint1.a' = { sigma_mm = 2 }\n\
                    [[effect]]\ngear-ratio = { joint = 1 }\nerror_relative = 1e-3\n[poses]\nq1_deg = [0, 180]\n";
        let truth = Truth::parse(text, Path::new("TRUTH.toml"), &problem).unwrap();
        let pi = std::f64::consts::PI;
        let expected = format!(
            "random joint1.a - 2e-3 -\neffect gear-ratio = {{ joint = 1 }} 1e-3\nposes 0e0 {pi:e}, , -, -, sides\n\
             rows 6e1 6e1, share 3e-1, 1e-4, {}",
            truth.segments
        );
        assert_eq!(canonical(&truth), expected);
    }
}
