//! An arm of one's own, from its data sheet to an estimate: `cargo run --example own_arm`.
//!
//! Declared in text, measured on the virtual test rig (which knows a truth that the declared arm
//! does not), identified, and printed beside that truth.

use std::error::Error;
use std::path::Path;

use flexcal::fit::{Options, identify};
use flexcal::measurement::{Dataset, DatasetError};
use flexcal::problem::Problem;
use flexcal::rig::{Simulation, Truth, simulate};

/// One row a joint: Rx(α) Tx(a) Rz(θ+q) Tz(d) Ry(β). Two joints give way under their loads.
const ARM: &str = r#"
name = "elbow"
joint = [
  { d_m = 0.45 },
  { alpha_deg = 90, a_m = 0.05, stiffness_N_m_per_rad = 60e3, body = [{ name = "arm", mass_kg = 9, com_m = [0.3, 0, 0] }] },
  { a_m = 0.60, stiffness_N_m_per_rad = 25e3, body = [{ name = "forearm", mass_kg = 6, com_m = [0.25, 0, 0] }] },
  { a_m = 0.50, body = [{ name = "hand", mass_kg = 2, com_m = [0.08, 0, 0] }] },
]
tool.target_m = [0.15, 0.02, 0.0]

[parameters]
"joint*.a*" = { sigma_deg = 0.2, sigma_mm = 1 }
"joint*.stiffness" = { sigma_relative = 0.5 }
"joint1.*" = { fixed = true }
"base.*" = { free = true }

[data]
position_sigma_mm = 0.03
held_out = { column = "split" }
"#;

/// What is true of it, and where it is measured.
const TRUTH: &str = r#"
[parameters]
"joint2.stiffness" = { relative = 0.8 }
"joint3.a" = { mm = 0.7 }

[noise]
position_sigma_mm = 0.03

[poses]
q1_deg = [-150, 150]
q2_deg = [0, 120]
q3_deg = [-130, -10]
q4_deg = [-100, 100]
payload_kg = [0, 3]
identification = 40
"#;

fn main() -> Result<(), Box<dyn Error>> {
    // The names stand for files in messages.
    let problem = Problem::parse(ARM, Path::new("own_arm.toml"))?;
    let truth = Truth::parse(TRUTH, Path::new("truth.toml"), &problem)?;
    let simulation = simulate(&problem, &truth, 90, 1)?;
    let data = measured(&simulation)?;

    let found = identify(&problem, &data, &Options::default())?;
    let mut lines = vec![format!("{:<18} {:>13} {:>11} {:>13}", "SI", "estimate", "± 1 σ", "true")];
    for estimate in &found.estimates {
        let known = simulation.parameters.iter().find(|parameter| parameter.name == estimate.name);
        let known = known.map_or_else(String::new, |parameter| format!("{:.5}", parameter.value));
        let error = estimate.std_error.map_or_else(String::new, |error| format!("{error:.2e}"));
        lines.push(format!(
            "{:<18} {:>13.5} {error:>11} {known:>13}",
            estimate.name, estimate.estimate
        ));
    }
    let [before, after] =
        [&found.registered, &found.fitted].map(|errors| errors.held_out.mean.norm * 1e3);
    lines.push(format!(
        "held-out poses are off by {after:.3} mm on average; before, by {before:.3} mm"
    ));
    #[expect(clippy::print_stdout, reason = "an example shows what it found")]
    {
        println!("{}", lines.join("\n"));
    }
    Ok(())
}

/// Simulated rows as data. Your own would come from arrays as well, or from files by
/// `Dataset::read`.
fn measured(simulation: &Simulation) -> Result<Dataset, DatasetError> {
    let rows = &simulation.rows;
    let configurations = rows.iter().map(|row| &row.conditions.configuration);
    let held_out = (0..rows.len()).filter(|&row| rows[row].held_out);
    Dataset::builder(configurations, rows.iter().map(|row| row.position))
        .payload(rows.iter().map(|row| row.conditions.payload.unwrap_or(0.0)).collect())
        .time(rows.iter().map(|row| row.conditions.time).collect())
        .held_out(held_out)
        .build()
}
