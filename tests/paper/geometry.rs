//! Frames, geometric errors, end-point error and least squares, eq. 1-2 and 28-42.

use flexcal::paper::{Chain, Form, Parameters, least_squares};
use nalgebra::{DMatrix, DVector};

use super::arm::{
    both, dual_jacobian, end, model, odd_problem, odd_rows, place_in_e, problem, rigid, table_2,
    table_2_errors,
};
use crate::common::golden::golden_rows;

#[test]
fn frames_of_eq_1_and_2_meet_the_independent_simulator() {
    let problem = problem();
    for row in golden_rows("rigid.csv") {
        for (parameters, expected) in both(&problem).iter().zip(&row.values) {
            let position = Chain::new(&problem, &parameters.geometry, &row.q).position();
            // The file has six decimals in mm.
            assert!((position - expected).norm() < 1e-9, "{}", (position - expected).norm());
        }
    }
}

#[test]
fn j_g_of_eq_31_to_38_equals_dual_numbers() {
    let mut worst = 0.0_f64;
    let sampler = rigid(problem());
    let at_table_2 = {
        let mut problem = sampler.clone();
        for (joint, link) in problem.joints.iter_mut().zip(table_2()) {
            (joint.alpha, joint.a, joint.theta, joint.d, joint.beta) =
                (link.alpha, link.a, link.theta, link.d, link.beta);
        }
        problem
    };
    let rows = golden_rows("rigid.csv");
    for (problem, rows) in
        [(sampler, &rows), (at_table_2, &rows), (rigid(odd_problem()), &odd_rows("rigid.csv"))]
    {
        let model = model(&problem);
        let zero = DVector::zeros(model.parameters.len());
        assert_eq!(zero.len(), 5 * problem.joints.len());
        for row in rows {
            let closed =
                end(&problem, &Parameters::nominal(&problem), row, Form::Corrected).jacobian();
            let dual = dual_jacobian(&model, row, &zero);
            for (parameter, column) in model.parameters.iter().zip(dual.column_iter()) {
                worst = worst.max((closed.column(place_in_e(parameter).unwrap()) - column).amax());
            }
        }
    }
    println!("J_g against dual numbers: {worst:.1e}");
    assert!(worst < 1e-9);
}

#[test]
fn error_of_eq_39_to_41_drops_second_order_and_the_coupling() {
    let problem = problem();
    let [nominal, _] = both(&problem);
    let e = table_2_errors(&problem);
    let (mut curvature, mut coupling) = ([0.0_f64; 2], [0.0_f64; 2]);
    for row in golden_rows("rigid.csv") {
        let at_nominal = end(&problem, &nominal, &row, Form::Corrected);
        for (k, h) in [1.0, 0.5].into_iter().enumerate() {
            let mut moved = nominal.clone();
            for (geometry, e) in moved.geometry.iter_mut().zip(e.as_slice().chunks(5)) {
                geometry.fields_mut().into_iter().zip(e).for_each(|(field, e)| *field += h * e);
            }
            let there = end(&problem, &moved, &row, Form::Corrected);
            // D_End(E') of eq. 40 with exact geometry, without and with the deflection at E'.
            let with_old_deflection = there.chain.position() - at_nominal.chain.position()
                + at_nominal.deflection(&nominal);
            let exact = there.position(&moved) - at_nominal.chain.position();
            let first_order = at_nominal.error(&nominal, &(&e * h));
            curvature[k] = curvature[k].max((with_old_deflection - first_order).norm() * 1e3);
            coupling[k] = coupling[k].max((exact - with_old_deflection).norm() * 1e3);
        }
    }
    println!(
        "eq. 41 at table 2: curvature {curvature:.3?} mm, coupling dropped {coupling:.3?} mm (e and e/2)"
    );
    let ratio = |pair: [f64; 2]| pair[0] / pair[1];
    assert!((ratio(curvature) - 4.0).abs() < 0.1, "second order in e");
    assert!((ratio(coupling) - 2.0).abs() < 0.1, "first order in e, times the deflection");
    assert!((0.1..2.0).contains(&coupling[0]));
}

#[test]
fn least_squares_of_eq_43_and_44_is_the_pseudo_inverse() {
    let a = DMatrix::from_fn(9, 4, |i, j| ((1 + 3 * i + 5 * j + i * j) as f64).sin());
    let b = DVector::from_fn(9, |i, _| (i as f64 + 0.3).cos());
    let x = least_squares(&a, &b, 0.0).unwrap();
    assert!(a.tr_mul(&(&a * &x - &b)).amax() < 1e-14);
    // With two equal columns the minimum-norm solution shares between them.
    let mut twice = a.clone();
    let first = a.column(0).clone_owned();
    twice.set_column(3, &first);
    let x = least_squares(&twice, &b, 1e-10).unwrap();
    assert!((x[0] - x[3]).abs() < 1e-13 && twice.tr_mul(&(&twice * &x - &b)).amax() < 1e-13);
    assert_eq!(least_squares(&a, &DVector::zeros(8), 0.0), None);
    assert_eq!(
        least_squares(&DMatrix::from_element(3, 1, f64::NAN), &DVector::zeros(3), 0.0),
        None
    );
    assert_eq!(
        least_squares(&DMatrix::zeros(3, 2), &DVector::zeros(3), 0.0),
        Some(DVector::zeros(2))
    );
}

#[test]
fn the_end_point_of_eq_2_hides_theta_4_and_beta_4() {
    let mut problem = problem();
    let columns = |problem: &flexcal::problem::Problem| {
        let nominal = Parameters::nominal(problem);
        let rows = golden_rows("rigid.csv");
        let largest = |place: usize| {
            let norms =
                rows.iter().map(|row| end(problem, &nominal, row, Form::Corrected).jacobian());
            norms.map(|jacobian| jacobian.column(place).norm()).fold(0.0, f64::max)
        };
        [largest(17), largest(19)]
    };
    let [theta, beta] = columns(&problem);
    println!(
        "table 2, joint 4: an offset target moves {theta:.3} m per rad of θ₄ and {beta:.3} m per rad of β₄"
    );
    assert!(theta > 0.2 && beta > 0.2);
    problem.tool.target.fill(0.0);
    assert!(columns(&problem).iter().all(|size| *size < 1e-15));
}
