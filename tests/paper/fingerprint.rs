//! Sign of α₂ implied by Δβ₁ = Δθ₂ = 0.304° in table 2.

use flexcal::measurement::Dataset;
use flexcal::paper::{Chain, Form, Measured, Options, Parameters, StiffnessStage, identify};
use flexcal::problem::{PoseView, Problem};

use crate::common::arms::{path, without_elasticity};

/// Errors of table 2 [° and m], with 2 · 0.304° divided unevenly between β₁ and θ₂.
const ERRORS: [[f64; 5]; 4] = [
    [0.019, 0.0, -0.008, -0.003, 0.5],
    [-0.004, -0.002, 0.108, 0.016, 0.007],
    [-0.001, 0.024, 0.189, 0.005, 0.0],
    [-0.019, 0.016, -0.790, 0.008, 0.005],
];

/// Applies eq. 45 to exact positions of the rigid lunar sampler in its 28 poses; returns the errors
/// [α a θ d β] of each joint [° and m].
fn identified(alpha_2: f64) -> Vec<[f64; 5]> {
    let mut problem = Problem::read(&path("problems/lunar-sampler")).unwrap();
    let (data, _) = Dataset::read(&problem).unwrap();
    problem = without_elasticity(problem);
    problem.joints[1].alpha = alpha_2.to_radians();
    let nominal = Parameters::nominal(&problem);
    let mut truth = nominal.clone();
    for (link, errors) in truth.geometry.iter_mut().zip(ERRORS) {
        for (k, (field, error)) in link.fields_mut().into_iter().zip(errors).enumerate() {
            *field += if k % 2 == 0 { error.to_radians() } else { error };
        }
    }
    // The same positions: with the other sign of α₂, θ₂ to θ₄ change their sign.
    let turned = |row: usize| -> Vec<f64> {
        let q = data.measurements.configuration(row);
        q.iter().enumerate().map(|(k, q)| if k > 0 && alpha_2 > 0.0 { -q } else { *q }).collect()
    };
    let configurations: Vec<Vec<f64>> =
        data.split.identification.iter().map(|&row| turned(row)).collect();
    assert_eq!(configurations.len(), 28);
    let measured = |q: &'_ [f64]| Chain::new(&problem, &truth.geometry, q).position();
    let poses: Vec<Measured> = configurations
        .iter()
        .map(|q| Measured { setup: PoseView::from_configuration(q), position: measured(q) })
        .collect();
    let options = Options::new(Form::Corrected, StiffnessStage::Nominal);
    let found = identify(&problem, &poses, &options).unwrap();
    assert!(found.iteration.termination.converged() && found.iteration.cost < 1e-18);
    let pairs = found.parameters.geometry.into_iter().zip(nominal.geometry);
    pairs
        .map(|(mut found, mut nominal)| {
            let (found, nominal) =
                (found.fields_mut().map(|v| *v), nominal.fields_mut().map(|v| *v));
            std::array::from_fn(|k| {
                let error = found[k] - nominal[k];
                if k % 2 == 0 { error.to_degrees() } else { error }
            })
        })
        .collect()
}

#[test]
fn equal_errors_of_beta_1_and_theta_2_speak_for_alpha_2_of_minus_90() {
    let (beta, theta) = (4, 2);
    let down = identified(-90.0);
    println!("α₂ = −90°: Δβ₁ = {:.5}°, Δθ₂ = {:.5}°", down[0][beta], down[1][theta]);
    assert!((down[0][beta] - down[1][theta]).abs() < 1e-3);
    assert!(
        (down[0][beta] - 0.304).abs() < 1e-3,
        "their sum is seen, and a step of least length shares it evenly"
    );
    let up = identified(90.0);
    println!("α₂ = +90°: Δβ₁ = {:.5}°, Δθ₂ = {:.5}°", up[0][beta], up[1][theta]);
    assert!(
        (up[0][beta] + up[1][theta]).abs() < 1e-3 && up[0][beta].abs() > 0.1,
        "their difference is seen"
    );
    // Counter-evidence: offsets along parallel axes share evenly, but table 2 has 16, 5 and 8 mm.
    let d = 3;
    for found in [down, up] {
        let offsets = [found[1][d], found[2][d], found[3][d]].map(|offset| offset * 1e3);
        println!("Δd₂, Δd₃, Δd₄ = {offsets:.3?} mm");
        assert!(offsets.iter().all(|offset| (offset - 29.0 / 3.0).abs() < 0.01));
    }
}
