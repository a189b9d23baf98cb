//! An arm, data from arrays, a fit, a prediction, and a law that the residual is traced to, in thirty lines: `cargo run --example thirty_lines`.

#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use flexcal::{fit, measurement::Dataset, problem::Problem, select};

const ARM: &str = "name = 'planar'\n[[joint]]\n[[joint]]\na_m = 0.5\n[tool]\ntarget_m = [0.4, 0, 0]
[parameters]\n'joint2.a' = { sigma_mm = 5 }\n'joint2.theta' = { sigma_deg = 1 }\n[data]\nposition_sigma_mm = 0.05";

// An eccentric of joint 1 pulls at joint 2: Δθ₂ = pull · sin q₁; 1 σ of the prior is 10 mrad.
const CAM: &str = "law = { name = 'cam', at = 'joint2', terms = ['sin(q1)'], sigma_rad = 0.01 }";

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
    let cam = arm.effect(CAM, "cam".as_ref())?.effect;
    let options = fit::Options::default().with_candidates(vec![cam.clone()]);
    let trace = select::trace(&arm, &data, &options)?;
    let arm = arm.with_effect(cam);
    let found = fit::identify(&arm, &data, &fit::Options::default())?;
    let tip = found.predict(&arm, &data.measurements)?[0];
    let pull = found.estimate("law[cam].1").map_or(0.0, |pull| pull.estimate * 1e3);
    println!(
        "{}: {pull:.2} mrad; the tip is at {tip:.3?} m",
        trace.describe(&trace.ranking[0].effect)
    );
    Ok(())
}
