//! An arm in code, fitted within bounds with a law and a solver of the caller, and predicted with
//! covariance: `cargo run --example custom`.

#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use flexcal::fit::{CustomSolver, Options, identify};
use flexcal::least_squares::solver::{Bounds, Solution, Termination};
use flexcal::nalgebra::{DVector, Vector3};
use flexcal::{least_squares::Objective, measurement::Dataset, problem::Problem};

// Two links. The first is declared 0.5 m long and is at most 1.5 mm longer.
const ARM: &str = "name = 'planar'\n[[joint]]\n[[joint]]\na_m = 0.5\n[tool]\ntarget_m = [0.4, 0, 0]
[parameters]\n'joint2.a' = { sigma_mm = 5, max_mm = 501.5 }\n'joint2.theta' = { sigma_deg = 1 }
[data]\nposition_sigma_mm = 0.05";
// An eccentric of joint 1 turns joint 2: Δθ₂ = c · sin q₁; c has a prior of 0 ± 10 mrad.
const CAM: &str = "law = { name = 'cam', at = 'joint2', terms = ['sin(q1)'], sigma_rad = 0.01 }";

/// Gauss–Newton steps, each clamped to the bounds.
struct Projected;

impl CustomSolver for Projected {
    fn keeps_bounds(&self) -> bool {
        true
    }

    fn minimise(&self, f: &dyn Objective, x: DVector<f64>, bounds: &Bounds, n: u64) -> Solution {
        let linear = f.linearise(&x);
        // Not finite where the unknowns are not determined; the steps then run out.
        let step = linear.triangle.solve_upper_triangular_unchecked(&-linear.projected);
        let mut next = &x + step;
        bounds.clamp(&mut next);
        match n {
            0 => Solution::new(f, x, Termination::IterationLimit, bounds),
            _ if (&next - &x).amax() < 1e-12 => Solution::new(f, x, Termination::Step, bounds),
            _ => self.minimise(f, next, bounds, n - 1),
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arm = Problem::parse(ARM, "planar.toml".as_ref())?;
    let arm = arm.with_effect(arm.effect(CAM, "cam".as_ref())?.effect);
    // The true arm is 1 mm longer, and its eccentric turns 3 mrad; the readings are to 0.1 mm.
    let at = |l: f64, a: f64| (Vector3::new(a.cos(), a.sin(), 0.0) * l * 1e4).map(f64::round) / 1e4;
    let tip = |[a, b]: &[f64; 2]| at(0.501, *a) + at(0.4, a + b + 3e-3 * a.sin());
    let q = [[-2.7, 0.4], [-1.9, 1.0], [-0.8, -1.2], [0.1, 0.9], [0.8, -0.5], [1.5, 1.3]];
    let data = Dataset::builder(q, q.iter().map(tip)).build()?;
    let options = Options::default().with_custom_solver(std::sync::Arc::new(Projected));
    let found = identify(&arm, &data, &options)?;
    let cam = found.estimate("law[cam].1").map_or(0.0, |cam| cam.estimate * 1e3);
    let predicted = &found.predict_with_covariance(&arm, &data.measurements)?[0];
    let sigma = predicted.covariance.trace().sqrt() * 1e6;
    println!("cam: {cam:.2} mrad; tip at {:.3?} m ± {sigma:.0} µm", predicted.position.as_slice());
    Ok(())
}
