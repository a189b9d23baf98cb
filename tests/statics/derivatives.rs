//! Derivatives by dual numbers compared with extrapolated differences, for every parameter that can
//! be free.

#![expect(clippy::print_stdout, reason = "figures for those who ask with --nocapture")]

use crate::common::arms::{ODD, TREE, golden_problem, measured, parse, path, with_parameters};
use crate::common::made::{at_random, draw, labels, model_of, of_targets, part};
use flexcal::fit::Placement;
use flexcal::least_squares::{check_jacobian, jacobian};
use flexcal::measurement::Measurements;
use flexcal::model::PoseResiduals;
use flexcal::problem::{Equilibrium, Problem};
use flexcal::quantity::Unit;
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Largest allowed difference of a column of the Jacobian, relative to its norm.
const WORST: f64 = 1e-7;
/// Relative effect below which a column counts as that of a parameter without effect.
const WITHOUT_EFFECT: f64 = 1e-12;

/// Returns the size of which unknowns vary by some hundredths.
fn size(unit: Unit) -> f64 {
    match unit {
        Unit::Angle | Unit::Length => 0.1,
        _ => 0.5,
    }
}

/// Checks every column at `x`; exactly the parameters in `without_effect` must have no effect.
fn check_at(
    what: &str,
    problem: &Problem,
    rows: &Measurements,
    x: &DVector<f64>,
    without_effect: &[&str],
) {
    let model = model_of(problem, rows);
    let all: Vec<usize> = (0..rows.len()).collect();
    let poses = Placement::of(rows).poses(rows, &all, 1e-3);
    let residuals =
        PoseResiduals::new(&model, poses, (0..model.parameters.len()).collect(), x.clone());
    let step = DVector::from_iterator(
        x.len(),
        model.parameters.iter().map(|parameter| size(parameter.unit())),
    );
    let exact = jacobian(&residuals, x);
    let effect = |j: usize| exact.column(j).norm() * step[j];
    let largest = (0..x.len()).map(effect).fold(0.0, f64::max);
    let (mut worst, mut silent) = ((0.0, ""), Vec::new());
    for (j, (column, parameter)) in
        check_jacobian(&residuals, x, &step).columns.iter().zip(&model.parameters).enumerate()
    {
        let name = parameter.name.as_str();
        if effect(j) < WITHOUT_EFFECT * largest {
            silent.push(name);
            // The error is relative to 1e-9 of the largest effect: the differences vanish, too.
            assert!(column.relative_error < 1e-3, "{what}: {name} has an effect: {column:?}");
            continue;
        }
        let error =
            if column.relative_error.is_nan() { f64::INFINITY } else { column.relative_error };
        if error > worst.0 {
            worst = (error, name);
        }
    }
    println!("{what}: {} parameters, worst {:.1e} at {}", x.len(), worst.0, worst.1);
    assert!(worst.0 < WORST, "{what}: {} is off by {:e}", worst.1, worst.0);
    assert_eq!(silent, without_effect, "{what}: parameters without effect");
}

/// Checks at zero, and at deviations drawn from the priors.
fn check(
    what: &str,
    problem: &Problem,
    rows: &Measurements,
    silent_at_zero: &[&str],
    silent: &[&str],
) {
    let model = model_of(problem, rows);
    check_at(
        &format!("{what}, nominal"),
        problem,
        rows,
        &DVector::zeros(model.parameters.len()),
        silent_at_zero,
    );
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let x = draw(&model, |unit| 0.1 * size(unit), &mut rng);
    check_at(&format!("{what}, off nominal"), problem, rows, &x, silent);
}

#[test]
fn every_parameter_of_the_lunar_sampler() {
    let everything = "\"*\" = { sigma_deg = 1.0, sigma_mm = 30.0, sigma_relative = 0.5 }\n";
    for equilibrium in [Equilibrium::Deflected, Equilibrium::Undeflected] {
        for elements in [1, 3] {
            let mut problem = with_parameters("tests/golden/problem.toml", everything);
            problem.statics.equilibrium = equilibrium;
            problem.statics.beam_elements = elements;
            let rows = part(&measured(&problem, &["tests/cases/a-none.csv"]), (0..78).step_by(8));
            assert_eq!(model_of(&problem, &rows).parameters.len(), 20 + 3 + 8 + 6 + 3 - 2);
            check(
                &format!("lunar sampler, {equilibrium:?}, {elements} elements"),
                &problem,
                &rows,
                &[],
                &[],
            );
        }
    }
}

#[test]
fn every_parameter_of_an_arm_with_every_kind_of_joint_and_link() {
    for equilibrium in [Equilibrium::Deflected, Equilibrium::Undeflected] {
        for elements in [1, 3] {
            let mut problem = parse(ODD);
            problem.statics.equilibrium = equilibrium;
            problem.statics.beam_elements = elements;
            let mut rng = ChaCha8Rng::seed_from_u64(3);
            let mut rows = at_random(&problem, 10, 2.5, &mut rng);
            rows.payload = Some((0..10).map(|k| if k % 2 == 0 { 0.0 } else { 2.5 }).collect());
            rows.hoist = Some((0..10).map(|k| 10.0 * f64::from(k)).collect());
            check(
                &format!("odd arm, {equilibrium:?}, {elements} elements"),
                &problem,
                &rows,
                &[],
                &[],
            );
        }
    }
}

/// Fixed joints given by xyz and rpy, and a joint that follows another, appended to an arm.
const PLACED: &str = "[[joint]]\nkind = \"fixed\"\nxyz_m = [0.1, -0.2, 0.3]\nrpy_deg = [10, -80, 200]\n[[joint.body]]\nmass_kg = 1.5\n\
                      com_m = [0.1, 0, 0.2]\n[[joint]]\na_m = 0.2\nmimic = { joint = 1, ratio = -0.5 }\n[[joint]]\nkind = \"fixed\"\n\
                      xyz_m = [0, 0.1, 0]\n";

#[test]
fn every_parameter_of_an_arm_with_placements() {
    let rules =
        ["x", "y", "z"].map(|field| format!("'joint*.{field}' = {{ sigma_mm = 30.0 }}\n")).concat()
            + &["roll", "pitch", "yaw"]
                .map(|field| format!("'joint*.{field}' = {{ sigma_deg = 1.0 }}\n"))
                .concat();
    let odd = parse(&format!("{ODD}{rules}{PLACED}"));
    let everything = "[parameters]\n\"*\" = { sigma_deg = 1.0, sigma_mm = 30.0 }\n";
    let rigid = parse(&format!(
        "name = 'placed'\n[[joint]]\nalpha_deg = 20\nd_m = 0.4\n{PLACED}[tool]\ntarget_m = [0.1, 0.2, 0.3]\n{everything}"
    ));
    for (problem, silent) in [(odd, &[][..]), (rigid, &[])] {
        let mut rows = at_random(&problem, 10, 2.5, &mut ChaCha8Rng::seed_from_u64(3));
        let (n, follower) = (
            problem.joints.len(),
            problem.joints.iter().position(|joint| joint.mimic.is_some()).unwrap(),
        );
        rows.configurations.chunks_exact_mut(n).for_each(|row| row[follower] = 0.0);
        let names: Vec<String> = model_of(&problem, &rows)
            .parameters
            .into_iter()
            .map(|parameter| parameter.name)
            .collect();
        assert!(
            names.contains(&format!("joint{n}.pitch"))
                && !names.contains(&format!("joint{n}.alpha")),
            "{names:?}"
        );
        check(&problem.name, &problem, &rows, silent, silent);
    }
}

#[test]
fn every_parameter_of_a_rigid_arm_with_sessions_and_targets() {
    let problem = Problem::read(&path("problems/ur10-ipa")).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut rows = at_random(&problem, 16, 3.0, &mut rng);
    rows.session = labels((0..16).map(|k| if k < 8 { "A" } else { "B" }));
    rows.target = Some(labels((0..16).map(|k| if k % 3 == 0 { "ball" } else { "mount" })));
    assert_eq!(model_of(&problem, &rows).parameters.len(), 30 + 2 * 6 + 2 * 3);
    // On the nominal arm the target is on axis 6, about which both parameters rotate it.
    check("UR10", &problem, &rows, &["joint5.beta", "joint6.theta"], &[]);
}

#[test]
fn some_parameters_among_many_have_the_same_columns() {
    let problem = golden_problem();
    let rows = part(&measured(&problem, &["tests/cases/a-none.csv"]), 0..6);
    let model = model_of(&problem, &rows);
    let x = draw(&model, size, &mut ChaCha8Rng::seed_from_u64(5));
    let poses = || Placement::of(&rows).poses(&rows, &[0, 1, 2, 3, 4, 5], 1e-3);
    let n = model.parameters.len();
    let whole = jacobian(&PoseResiduals::new(&model, poses(), (0..n).collect(), x.clone()), &x);
    let chosen: Vec<usize> = (0..n).rev().step_by(3).collect();
    let residuals = PoseResiduals::new(&model, poses(), chosen.clone(), x.clone());
    let some = jacobian(&residuals, &residuals.unknowns_in(&x));
    for (column, &k) in some.column_iter().zip(&chosen) {
        let scale = whole.column(k).norm();
        assert!((column - whole.column(k)).norm() <= 1e-12 * scale, "{}", model.parameters[k].name);
    }
}

#[test]
fn every_parameter_of_a_tree_with_targets_on_all_of_its_branches() {
    for (what, mut problem) in
        [("tree", parse(TREE)), ("two arms", free(&path("problems/two-arms/problem.toml")))]
    {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let mut rows = of_targets(&problem, at_random(&problem, 15, 1.2, &mut random));
        rows.payload = Some((0..rows.len()).map(|row| row as f64 * 0.1).collect());
        for elements in [1, 2] {
            problem.statics.beam_elements = elements;
            for equilibrium in [Equilibrium::Deflected, Equilibrium::Undeflected] {
                problem.statics.equilibrium = equilibrium;
                let x = draw(&model_of(&problem, &rows), |unit| 0.1 * size(unit), &mut random);
                check_at(
                    &format!("{what}, {elements} elements, {equilibrium:?}"),
                    &problem,
                    &rows,
                    &x,
                    &[],
                );
            }
        }
        for joint in &mut problem.joints {
            (joint.stiffness, joint.beam) = (None, None);
        }
        let rows = of_targets(&problem, at_random(&problem, 15, 1.2, &mut random));
        let x = draw(&model_of(&problem, &rows), |unit| 0.1 * size(unit), &mut random);
        check_at(&format!("rigid {what}"), &problem, &rows, &x, &[]);
    }
}

/// Returns a problem with every parameter free.
fn free(file: &std::path::Path) -> Problem {
    let text = std::fs::read_to_string(file).unwrap();
    let (before, after) = text.split_once("[parameters]\n").unwrap();
    let (_, after) = after.split_once("\n[data]\n").unwrap();
    parse(&format!("{before}[parameters]\n\"*\" = {{ free = true }}\n[data]\n{after}"))
}
