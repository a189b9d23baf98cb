//! Deflections of links and joints, and their displacement of the end point, eq. 3-27.

use flexcal::model::parameter::{BeamField, JointField, ParameterSite};
use flexcal::paper::{
    Chain, Flexibility, Form, LinkTerms, Loads, Misprint, Parameters, Reading,
    inertial_link_transfer, joint, joint_transfer, link_transfer, transfer,
};
use nalgebra::{DVector, Matrix4, Vector6};

use super::arm::{both, dual_jacobian, end, model, odd_problem, odd_rows, problem};
use crate::common::golden::golden_rows;

fn near(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-12 * (1.0 + b.abs()), "{a} {b}");
}

#[test]
fn link_b_of_eq_3_to_5_from_forces_resolved_by_hand() {
    let problem = problem();
    let parameters = Parameters::nominal(&problem);
    let (g, payload) = (9.80665, 0.7);
    let row = &golden_rows("rigid.csv")[0];
    let setup = flexcal::problem::PoseView { payload: Some(&payload), ..row.setup() };
    let chain = Chain::new(&problem, &parameters.geometry, setup.configuration);
    let loads = Loads::new(&problem, &chain, &setup);
    let phi_3 = row.q[1] + row.q[2];
    let phi_4 = phi_3 + row.q[3];
    let l = 1.75;
    // Frame of link B: x along it, y upward, z to the left; weights pull to (−sin φ₃, −cos φ₃).
    let m_4 = 3.6 + payload;
    let (g_r, g_n) = (-m_4 * g * phi_3.sin(), -m_4 * g * phi_3.cos());
    let m_v = -g * (3.6 * 0.13 + payload * 0.22) * phi_4.cos();
    // Levers along z from the axis of link B: d_4 − 0.06 for the sampler and d_4 − 0.09 for the
    // payload.
    let lever = (3.6 * -0.16 + payload * -0.19) / m_4;
    let (q_r, q_n) = (-3.1 * g / l * phi_3.sin(), -3.1 * g / l * phi_3.cos());
    let (c_r, c_n, r, r_z) = (-0.85 * g * phi_3.sin(), -0.85 * g * phi_3.cos(), 1.15, 0.11);
    let f = row.hoist;
    let (f_r, f_n, s, m_f) = (f * phi_3.sin(), f * phi_3.cos(), 0.95, -f * 0.06 * phi_3.sin());

    let terms = LinkTerms::new(loads.links[3].as_ref().unwrap(), &Form::Corrected.into());
    near(terms.stretch, q_r * l * l / 2.0 + c_r * r + g_r * l + f_r * s);
    let hoist = f_n * s * s * (3.0 * l - s) / 6.0 + m_f * s * (2.0 * l - s) / 2.0;
    let f_y1 = q_n * l.powi(4) + 4.0 * (m_v * l * l + c_n * r * r * (l - r));
    near(terms.bend_y.0, f_y1 / 8.0 + (c_n * r.powi(3) + g_n * l.powi(3)) / 3.0 + hoist);
    let hoist = f_n * s * s / 2.0 + m_f * s;
    near(
        terms.bend_y.1,
        q_n * l.powi(3) / 6.0 + (c_n * r * r + g_n * l * l + 2.0 * m_v * l) / 2.0 + hoist,
    );
    // Moments that bend towards +z: −M_y, from weights along x with levers along z.
    let (mc_n, m4_n) = (-r_z * c_r, -lever * g_r);
    near(terms.bend_z.0, (mc_n * r * r + m4_n * l * l + 2.0 * mc_n * r * (l - r)) / 2.0);
    near(terms.bend_z.1, mc_n * r + m4_n * l);
    near(terms.twist, -r_z * c_n * r - lever * g_n * l);

    let motion = terms.motion(&parameters.links[3], &Form::Corrected.into());
    let expected = [
        terms.stretch / 2.6e7,
        terms.bend_y.0 / 1.5e4,
        terms.bend_z.0 / 1.5e4,
        terms.twist / 1.15e4,
    ];
    let slopes = [-terms.bend_z.1 / 1.5e4, terms.bend_y.1 / 1.5e4];
    expected.iter().chain(&slopes).zip(&motion).for_each(|(a, b)| near(*a, *b));
}

#[test]
fn link_a_of_eq_6_and_7_is_eq_4_without_loads_in_between() {
    let problem = problem();
    let parameters = Parameters::nominal(&problem);
    let row = &golden_rows("rigid.csv")[1];
    let chain = Chain::new(&problem, &parameters.geometry, &row.q);
    let loads = Loads::new(&problem, &chain, &row.setup());
    let link = loads.links[2].as_ref().unwrap();
    assert!(link.points.is_empty());
    let terms = LinkTerms::new(link, &Form::Corrected.into());
    let (l, q) = (1.95, link.spread);
    let (force, moment) =
        (link.tip.force + link.tip_hoist.force, link.tip.moment + link.tip_hoist.moment);
    near(terms.stretch, q.x * l * l / 2.0 + force.x * l);
    near(
        terms.bend_y.0,
        q.y * l.powi(4) / 8.0 + force.y * l.powi(3) / 3.0 + moment.z * l * l / 2.0,
    );
    near(terms.bend_y.1, q.y * l.powi(3) / 6.0 + force.y * l * l / 2.0 + moment.z * l);
    near(terms.bend_z.0, -moment.y * l * l / 2.0);
    near(terms.bend_z.1, -moment.y * l);
    near(terms.twist, moment.x * l);
    near(q.norm() * l, 4.2 * 9.80665);
}

#[test]
fn torsion_of_eq_8_to_11_with_the_arm_stretched_out() {
    let problem = problem();
    let parameters = Parameters::nominal(&problem);
    let setup = flexcal::problem::PoseView {
        payload: Some(&0.0),
        hoist: Some(&60.0),
        ..flexcal::problem::PoseView::from_configuration(&[0.3, 0.0, 0.0, 0.0])
    };
    let chain = Chain::new(&problem, &parameters.geometry, setup.configuration);
    let joints = Loads::new(&problem, &chain, &setup).joints;
    let g = 9.80665;
    let beyond_4 = [(3.6, 0.13)];
    let beyond_3 = [(3.6, 1.88), (0.85, 1.15), (3.1, 0.875)];
    let beyond_2 = [(3.6, 3.83), (0.85, 3.10), (3.1, 2.825), (2.4, 1.95), (4.2, 0.975)];
    let sum = |masses: &[(f64, f64)]| -g * masses.iter().map(|(m, x)| m * x).sum::<f64>();
    near(joints[3].weights, sum(&beyond_4));
    near(joints[2].weights, sum(&beyond_3));
    near(joints[1].weights, sum(&beyond_2));
    near(joints[3].hoists, 0.0);
    near(joints[2].hoists, 60.0 * 0.95);
    near(joints[1].hoists, 60.0 * (0.95 + 1.95));
    near(joints[0].weights, 0.0);
    near(joints[0].hoists, 0.0);
    let reading = Reading::default();
    let angle = joint::torsion(1, &joints[1], 1.0 / 5.2e4, &chain.links, &reading);
    near(angle, (joints[1].weights + joints[1].hoists) / 5.2e4);
    assert_eq!(
        joint::motion(angle, &chain.links[1], &reading),
        Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, angle)
    );
}

/// Returns Δ as a 4 × 4 matrix, eq. 5.
fn differential(d: &Vector6<f64>) -> Matrix4<f64> {
    #[rustfmt::skip]
    let matrix = Matrix4::new(
        0.0, -d[5], d[4], d[0],
        d[5], 0.0, -d[3], d[1],
        -d[4], d[3], 0.0, d[2],
        0.0, 0.0, 0.0, 0.0,
    );
    matrix
}

#[test]
fn transfers_of_eq_12_to_26_are_the_products_of_matrices_they_stand_for() {
    let problem = problem();
    let [_, parameters] = both(&problem);
    let row = &golden_rows("rigid.csv")[2];
    let chain = Chain::new(&problem, &parameters.geometry, &row.q);
    let d = Vector6::new(0.1, -0.2, 0.3, 0.4, -0.5, 0.6);
    let same = |carried: Vector6<f64>, product: Matrix4<f64>| {
        assert!((differential(&carried) - product).amax() < 1e-12);
    };
    let whole_inverse = chain.after[0].try_inverse().unwrap();
    let reading = Reading::default();
    for k in 0..4 {
        let u = chain.after[k + 1];
        same(transfer(&u) * d, u.try_inverse().unwrap() * differential(&d) * u);
        // Eq. 13-15: dT = T₁ … T_i Δ T_{i+1} … T_n = T Δ_J.
        let dt = chain.before[k + 1] * differential(&d) * u;
        same(joint_transfer(&chain, k, &reading) * d, whole_inverse * dt);
        // Eq. 20-22 corrected: dT = T₁ … T_i1 Δ T_i2 … T_n = T Δ_L.
        let dt = chain.before[k]
            * chain.links[k].to_tip()
            * differential(&d)
            * chain.links[k].from_tip()
            * u;
        same(link_transfer(&chain, k, &reading) * d, whole_inverse * dt);
        // Eq. 21 and 22 as printed are dT = (V Δ V⁻¹) T, eq. 24 in the inertial frame.
        let inertial = differential(&(inertial_link_transfer(&chain, k) * d));
        let dt = chain.before[k] * differential(&d) * chain.after[k];
        assert!((inertial * chain.after[0] - dt).amax() < 1e-12);
        same(link_transfer(&chain, k, &Misprint::LinkSide.into()) * d, whole_inverse * dt);
    }
}

#[test]
fn d_f_of_eq_27_agrees_with_the_independent_simulator_only_when_corrected() {
    let problem = problem();
    let parameters = Parameters::nominal(&problem);
    let rows = golden_rows("first_order.csv");
    for (form, good) in [(Form::Corrected, true), (Form::Printed, false)] {
        let mut worst = [0.0_f64; 4];
        for row in &rows {
            let end = end(&problem, &parameters, row, form);
            let parts = [
                end.elastic.of_joints(&parameters),
                end.elastic.of_link(2, &parameters),
                end.elastic.of_link(3, &parameters),
                end.elastic.motion(&parameters),
            ];
            for (worst, (part, expected)) in worst.iter_mut().zip(parts.iter().zip(&row.values)) {
                *worst = worst.max((end.displacement(part) - expected).norm() * 1e3);
            }
        }
        println!("{form:?}: joints, link A, link B, all: {worst:.5?} mm");
        // The printed formulas for joints are right while β = 0.
        assert!(
            worst[0] < 0.003
                && worst[1..].iter().all(|worst| if good { *worst < 0.003 } else { *worst > 3.0 })
        );
    }
}

#[test]
fn elastic_columns_equal_dual_numbers_in_the_limit_of_small_deflection() {
    let soft = 1e-10_f64;
    let mut worst = 0.0_f64;
    let sampler = problem();
    let [nominal, table_2] = both(&sampler);
    let odd = odd_problem();
    let rows = golden_rows("first_order.csv");
    for (problem, parameters, rows) in [
        (&sampler, nominal, &rows),
        (&sampler, table_2, &rows),
        (&odd, Parameters::nominal(&odd), &odd_rows("first_order.csv")),
    ] {
        let model = model(problem);
        // x = ln(stiffness / nominal), with all stiffnesses multiplied by 10¹⁰.
        let geometry = parameters.geometry.clone();
        let x = DVector::from_iterator(
            model.parameters.len(),
            model.parameters.iter().map(|parameter| match super::arm::place_in_e(parameter) {
                Some(place) => {
                    *geometry[place / 5].clone().fields_mut()[place % 5] - parameter.nominal
                }
                None => -soft.ln(),
            }),
        );
        for row in rows {
            let dual = dual_jacobian(&model, row, &x);
            let end = end(problem, &parameters, row, Form::Corrected);
            for (parameter, column) in model.parameters.iter().zip(dual.column_iter()) {
                let which = match parameter.site {
                    ParameterSite::Joint { joint, field: JointField::Stiffness } => {
                        Flexibility::Joint(joint)
                    }
                    ParameterSite::Beam { joint, field } => match field {
                        BeamField::Axial => Flexibility::Axial(joint),
                        BeamField::Bending => Flexibility::Bending(joint),
                        BeamField::BendingY => Flexibility::BendingY(joint),
                        BeamField::BendingZ => Flexibility::BendingZ(joint),
                        BeamField::Twist => Flexibility::Twist(joint),
                        _ => continue,
                    },
                    _ => continue,
                };
                // ∂p/∂x = −c ∂p/∂c, at c = nominal · soft.
                let closed =
                    end.displacement(&end.elastic.derivative(which)) * parameters.get(which);
                worst = worst.max((closed + column / soft).amax());
            }
        }
    }
    println!("elastic columns against dual numbers: {worst:.1e} m per unit of ln stiffness");
    assert!(worst < 1e-9);
}
