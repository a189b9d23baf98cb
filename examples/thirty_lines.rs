//! An arm, data from arrays, a fit, a prediction, and an effect of one's own that the residual is
//! traced to, in thirty lines: `cargo run --example thirty_lines`.

#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use flexcal::model::{
    effect::CustomEffect, effect::Term, parameter::ParameterSite, parameter::Regressor,
};
use flexcal::{fit, measurement::Dataset, problem::Effect, problem::Problem, select};

const ARM: &str = "name = 'planar'\n[[joint]]\n[[joint]]\na_m = 0.5\n[tool]\ntarget_m = [0.4, 0, 0]
[parameters]\n'joint2.a' = { sigma_mm = 5 }\n'joint2.theta' = { sigma_deg = 1 }\n[data]\nposition_sigma_mm = 0.05";

// An eccentric of joint 1 pulls at joint 2: Δθ₂ = pull · sin q₁; 1 σ of the prior is 10 mrad.
#[derive(Debug)]
struct Cam;
impl CustomEffect for Cam {
    fn name(&self) -> &'static str {
        "eccentric"
    }
    fn terms(&self, problem: &Problem) -> Vec<Term> {
        vec![Term::driven(
            "pull",
            ParameterSite::coordinate(problem, 2),
            Regressor::Sine(0, 1),
            0.01,
        )]
    }
    fn describe(&self) -> String {
        "joint 1 pulls at joint 2".to_owned()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arm = Problem::parse(ARM, "planar.toml".as_ref())?;
    // What a tracker sees of an arm that is 2 mm longer and pulls 3 mrad.
    let q: Vec<[f64; 2]> =
        (0..40_u32).map(|k| [0.15 * f64::from(k) - 3.0, f64::from(7 * k).sin()]).collect();
    let at = |length: f64, angle: f64| {
        flexcal::nalgebra::Vector3::new(length * angle.cos(), length * angle.sin(), 0.0)
    };
    let data = Dataset::builder(
        &q,
        q.iter().map(|[a, b]| at(0.502, *a) + at(0.4, a + b + 3e-3 * a.sin())),
    )
    .build()?;
    let trace = select::trace(
        &arm,
        &data,
        &fit::Options::default().with_candidates(vec![Effect::custom(Cam)]),
    )?;
    let arm = arm.with_effect(Effect::custom(Cam));
    let found = fit::identify(&arm, &data, &fit::Options::default())?;
    let tip = found.predict(&arm, &data.measurements)?[0];
    let pull = found.estimate("eccentric.pull").map_or(0.0, |pull| pull.estimate * 1e3);
    println!(
        "{}: {pull:.2} mrad; the tip is at {tip:.3?} m",
        trace.describe(&trace.ranking[0].effect)
    );
    Ok(())
}
