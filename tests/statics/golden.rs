//! Positions of an independent finite-segment simulator (`tests/golden`), which shares no formula
//! with the closed forms.

use crate::common::arms::{golden_problem, table_2};
use crate::common::golden::{GoldenRow, golden_rows};
use flexcal::mechanics::{Arm, StaticState, Workspace};
use flexcal::problem::{Equilibrium, Problem};
use nalgebra::Vector3;

fn rigid(mut arm: Arm<f64>) -> Arm<f64> {
    for joint in &mut arm.joints {
        joint.flexibility = None;
        joint.beam = None;
    }
    arm
}

fn position(arm: &Arm<f64>, problem: &Problem, row: &GoldenRow) -> Vector3<f64> {
    let (mut ws, mut rest) = (Workspace::default(), StaticState::default());
    arm.equilibrate(&row.setup(), &mut ws, &mut rest).unwrap();
    rest.frame.point(&problem.tool.target)
}

/// Returns the largest distance [mm] between the arm's positions and column group `k` of the rows.
fn worst(arm: &Arm<f64>, problem: &Problem, rows: &[GoldenRow], k: usize) -> f64 {
    rows.iter()
        .map(|row| (position(arm, problem, row) - row.values[k]).norm() * 1e3)
        .fold(0.0, f64::max)
}

#[test]
fn rigid_positions_agree_to_a_nanometre() {
    let problem = golden_problem();
    let nominal = rigid(Arm::nominal(&problem));
    let rows = golden_rows("rigid.csv");
    assert!(worst(&nominal, &problem, &rows, 0) < 1e-6);
    assert!(worst(&table_2(nominal.clone()), &problem, &rows, 1) < 1e-6);
}

#[test]
fn first_order_displacements_agree_for_each_part() {
    let problem = golden_problem();
    let nominal = Arm::nominal(&problem);
    let rows = golden_rows("first_order.csv");
    // Deflections a million times smaller are in the linear limit; scaled back, ten digits remain.
    let soft = 1e-6;
    let parts = [
        ("joints", true, false, false),
        ("link A", false, true, false),
        ("link B", false, false, true),
        ("all", true, true, true),
    ];
    for (k, (name, joints, link_a, link_b)) in parts.into_iter().enumerate() {
        let mut arm = nominal.clone();
        arm.equilibrium = Equilibrium::Undeflected;
        for (i, joint) in arm.joints.iter_mut().enumerate() {
            joint.flexibility = joint.flexibility.map(|c| if joints { c * soft } else { 0.0 });
            if let Some(beam) = &mut joint.beam {
                let keep = if i == 2 { link_a } else { link_b };
                let factor = if keep { soft } else { 0.0 };
                let all = &mut beam.flexibility;
                for flexibility in
                    [&mut all.axial, &mut all.about_y, &mut all.about_z, &mut all.twist]
                {
                    *flexibility *= factor;
                }
            }
        }
        let straight = rigid(nominal.clone());
        let worst = rows
            .iter()
            .map(|row| {
                let moved =
                    (position(&arm, &problem, row) - position(&straight, &problem, row)) / soft;
                (moved - row.values[k]).norm() * 1e3
            })
            .fold(0.0, f64::max);
        println!("first order, {name}: {worst:.5} mm");
        assert!(worst < 0.003, "{name}: {worst} mm");
    }
}

#[test]
fn equilibrium_positions_agree_with_one_element_and_better_with_more() {
    let problem = golden_problem();
    let rows = golden_rows("equilibrium.csv");
    for (elements, limit) in [(1, 0.02), (2, 0.006), (8, 0.003)] {
        let mut nominal = Arm::nominal(&problem);
        nominal.beam_elements = elements;
        let worst = worst(&nominal, &problem, &rows, 0).max(worst(
            &table_2(nominal.clone()),
            &problem,
            &rows,
            1,
        ));
        println!("equilibrium, {elements} elements: {worst:.5} mm");
        assert!(worst < limit, "{elements} elements: {worst} mm");
    }
}
