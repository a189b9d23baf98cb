//! Fits that the data refute are not passed on: bounds along unidentifiable directions, priors and
//! noise that the data contradict, held-out rows, orientations, planar arms, and reversed joints.

use flexcal::fit::{FindingCode, Options, identify};
use flexcal::measurement::Dataset;
use flexcal::model::PoseResiduals;
use flexcal::problem::{Effect, Problem};
use flexcal::select::{Status, close};
use nalgebra::{DVector, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::common::arms::parse;
use crate::common::made::{at_random, divided, fit, measure, model_of};
use crate::judged::{PRIORS, SIGMA, measured, text};

/// Simulates noisy poses of the arm with these deviations, the first `fitted` for identification.
pub fn simulated(
    problem: &Problem,
    truth: &[(&str, f64)],
    poses: [usize; 2],
    seed: u64,
) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut rows = at_random(problem, poses[0] + poses[1], 2.0, &mut rng);
    let parameters = model_of(problem, &rows).parameters;
    let deviation = |name: &str| truth.iter().find(|own| own.0 == name).map_or(0.0, |own| own.1);
    let x = DVector::from_iterator(parameters.len(), parameters.iter().map(|p| deviation(&p.name)));
    measure(problem, &mut rows, &x, SIGMA, &mut rng);
    divided(poses[0], &rows)
}

#[test]
fn a_bound_along_an_unidentifiable_direction_gives_its_partner_no_certainty() {
    // Axes 2 and 3 are parallel: only joint2.d + joint3.d moves the target.
    let problem = parse(&text(
        "'joint2.d' = { min_mm = -1, max_mm = 1 }\n'joint3.d' = { min_mm = -5, max_mm = 5 }",
    ));
    let truth = [("joint2.d", 0.2e-3), ("joint3.d", 3e-3)];
    let found = fit(&problem, &simulated(&problem, &truth, [60, 30], 1));
    assert!(found.estimate("joint2.d").unwrap().at_bound.is_some());
    let finding = found.finding(FindingCode::BoundInUnidentifiedDirection).unwrap();
    assert_eq!(finding.word("parameter"), Some("joint2.d"), "{finding}");
    let partner = found.estimate("joint3.d").unwrap();
    let error = (partner.estimate - partner.nominal - 3e-3).abs();
    let sigma = partner.std_error.unwrap();
    assert!(error < 3.0 * sigma && sigma > 3e-4, "{error} {sigma}");
    assert!(partner.identified < 0.5, "{}", partner.identified);
    // The sum is as certain as before.
    let rows = Dataset::poses([[0.3; 5]]).build().unwrap().measurements;
    let predicted = found.predict_with_covariance(&problem, &rows).unwrap();
    assert!(predicted[0].covariance.trace().sqrt() < SIGMA, "{}", predicted[0].covariance);
}

#[test]
fn a_bound_that_the_data_press_against_hides_nothing() {
    let problem =
        parse(&text("'joint3.a' = { min_mm = -1, max_mm = 1 }\n'tool.x' = { free = true }"));
    let found = fit(&problem, &simulated(&problem, &[("joint3.a", 2e-3)], [60, 30], 2));
    assert!(found.estimate("joint3.a").unwrap().at_bound.is_some());
    assert!(!found.has(FindingCode::BoundInUnidentifiedDirection), "{:?}", found.findings);
}

#[test]
fn priors_that_are_a_thousand_times_too_narrow_are_named_and_not_trusted() {
    let problem = parse(&text(
        "'joint*.a' = { sigma_mm = 0.002 }\n'joint*.alpha' = { sigma_deg = 0.3 }\n'joint*.d' = { sigma_mm = 2 }\n\
         'joint*.theta' = { sigma_deg = 0.3 }\n'tool.*' = { sigma_mm = 2 }",
    ));
    let truth = [("joint2.a", 2.5e-3), ("joint3.a", -3e-3), ("joint4.a", 1.5e-3)];
    let found = fit(&problem, &simulated(&problem, &truth, [60, 30], 3));
    let finding = found.finding(FindingCode::PriorContradicted).unwrap();
    assert!(!found.is_trusted());
    assert_eq!(finding.word("rule"), Some("joint*.a"), "{finding}");
    assert!(finding.number("factor").unwrap() >= 100.0, "{finding}");
}

#[test]
fn rules_that_are_too_narrow_together_do_not_hide_each_other() {
    let problem = parse(&text(
        "'joint*.a' = { sigma_mm = 0.002 }\n'joint*.d' = { sigma_mm = 0.002 }\n'joint*.alpha' = { sigma_deg = 0.3 }\n\
         'joint*.theta' = { sigma_deg = 0.3 }\n'tool.*' = { sigma_mm = 2 }",
    ));
    let truth =
        [("joint2.a", 2.5e-3), ("joint3.a", -3e-3), ("joint4.d", 2.5e-3), ("joint1.d", 2e-3)];
    let found = fit(&problem, &simulated(&problem, &truth, [60, 30], 3));
    let refuted = found.findings.iter().filter(|of| of.code == FindingCode::PriorContradicted);
    let rules: Vec<_> = refuted.filter_map(|finding| finding.word("rule")).collect();
    assert_eq!(rules, ["joint*.a", "joint*.d"], "{:?}", found.findings);
    assert!(!found.is_trusted());
}

#[test]
fn priors_that_hold_are_not_questioned_where_the_model_lacks_something() {
    let problem = parse(&text(PRIORS));
    let mut data = measured(&problem, 4);
    for row in 0..90 {
        let q = data.measurements.configuration(row)[1];
        data.measurements.positions[row].z += 4e-4 * (5.0 * q).sin();
    }
    let found = fit(&problem, &data);
    assert!(found.noise_factor > 4.0 && found.is_trusted(), "{:?}", found.findings);
}

#[test]
fn a_sigma_declared_in_another_unit_is_named() {
    let declared = text(PRIORS).replace("position_sigma_mm = 0.05", "position_sigma_mm = 0.00005");
    let found = fit(&parse(&declared), &measured(&parse(&text(PRIORS)), 5));
    let finding = found.finding(FindingCode::NoiseBeyondDeclared).unwrap();
    assert!(finding.remedy.contains("another unit") && !found.is_trusted(), "{finding}");
}

#[test]
fn held_out_rows_contradict_a_fit_that_does_not_predict_them() {
    let problem = parse(&text(PRIORS));
    let clean = measured(&problem, 6);
    assert!(!fit(&problem, &clean).has(FindingCode::HeldOutBeyondPrediction));
    let mut moved = clean;
    moved.measurements.positions[60..].iter_mut().for_each(|own| own.z += 2.5 * SIGMA);
    let found = fit(&problem, &moved);
    assert!(found.has(FindingCode::HeldOutBeyondPrediction), "{:?}", found.findings);
}

#[test]
fn a_fit_of_few_poses_that_makes_a_true_arm_worse_says_so() {
    let wide = text("'joint*' = { sigma_deg = 2, sigma_mm = 50 }\n'tool.*' = { sigma_mm = 50 }");
    let problem = parse(&wide);
    let found = fit(&problem, &simulated(&problem, &[], [9, 60], 7));
    assert!(found.fitted.held_out.rms.norm > found.registered.held_out.rms.norm);
    let codes = [FindingCode::HeldOutNotBetter, FindingCode::HeldOutWorse];
    assert!(codes.into_iter().any(|code| found.has(code)), "{:?}", found.findings);
}

#[test]
fn a_coordinate_that_no_parameter_moves_counts_in_no_degree_of_freedom() {
    let planar = "name = 'planar'\n[[joint]]\n[[joint]]\na_m = 0.32\n[tool]\ntarget_m = [0.22, 0, 0.1]\n[parameters]\n\
                  'joint1.theta' = { free = true }\n'joint2.a' = { free = true }\n'joint2.theta' = { free = true }\n'tool.x' = { free = true }\n[data]\n";
    let problem = parse(planar);
    let mut squares = 0.0;
    for seed in 0..20 {
        let mut data = simulated(&problem, &[], [40, 10], seed);
        data.measurements.positions.iter_mut().for_each(|own| own.z = 0.1);
        let found = fit(&problem, &data);
        squares += (found.sigma_taken / SIGMA).powi(2) / 20.0;
    }
    assert!((0.9..1.1).contains(&squares), "{squares}");
}

#[test]
fn every_reversed_joint_is_named() {
    let problem = parse(&format!("{}\n", text(&format!("{PRIORS}\n'base.*' = {{ free = true }}"))));
    let mut data = measured(&problem, 8);
    let reversed = [1, 2, 4];
    for (k, q) in data.measurements.configurations.iter_mut().enumerate() {
        if reversed.contains(&(k % 5 + 1)) {
            *q = -*q;
        }
    }
    let found = fit(&problem, &data);
    let misread = found.finding(FindingCode::Misread).unwrap();
    let words = "joints 1, 2 and 4 that count the other way";
    assert!(misread.to_string().contains(words), "{misread}");
}

#[test]
fn orientations_in_another_convention_are_not_trusted_and_it_is_named() {
    let oriented = text("'joint*' = { sigma_deg = 0.3, sigma_mm = 2 }\n'tool.*' = { free = true }")
        + "orientation_sigma_deg = 0.02\n";
    let problem = parse(&oriented);
    let mut data = simulated(&problem, &[("joint2.alpha", 2e-3)], [60, 30], 9);
    let model = model_of(&problem, &data.measurements);
    let rows: Vec<usize> = (0..90).collect();
    let poses =
        flexcal::fit::Placement::of(&data.measurements).poses(&data.measurements, &rows, 1.0);
    let zero = DVector::zeros(model.parameters.len());
    let turns = model.orientations(&poses, zero.as_slice());
    let true_turns: Vec<UnitQuaternion<f64>> =
        turns.into_iter().map(UnitQuaternion::from_scaled_axis).collect();
    data.measurements.orientations = Some(true_turns.clone());
    assert!(!fit(&problem, &data).has(FindingCode::OrientationMisfit));
    // Angles of R = Rz Ry Rx, read as rotation vectors.
    let misread = |turn: &UnitQuaternion<f64>| {
        let (x, y, z) = turn.euler_angles();
        UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z))
    };
    data.measurements.orientations = Some(true_turns.iter().map(misread).collect());
    let found = fit(&problem, &data);
    let finding = found.finding(FindingCode::OrientationMisfit).unwrap();
    assert!(!found.is_trusted() && finding.remedy.contains("R = Rz Ry Rx"), "{finding}");
}

/// Sixty poses of an arm with a free base, and thirty held-out ones.
fn based() -> (Problem, Dataset) {
    let problem = parse(&text(&format!("{PRIORS}\n'base.*' = {{ free = true }}")));
    let data = measured(&problem, 8);
    (problem, data)
}

#[test]
fn gross_mistakes_are_fitted_and_named() {
    let misread = |problem: &Problem, data: &Dataset| {
        let found = fit(problem, data);
        assert!(!found.is_trusted());
        found.finding(FindingCode::Misread).map(ToString::to_string).unwrap_or_default()
    };
    let commands = |change: &dyn Fn(&mut [f64])| {
        let (problem, mut data) = based();
        data.measurements.configurations.chunks_exact_mut(5).for_each(change);
        misread(&problem, &data)
    };
    let coupled = commands(&|q| q[2] += q[1]);
    assert!(coupled.contains("joint 3 that also turns by -1.000 times the command of joint 2"));
    assert!(commands(&|q| q.swap(1, 3)).contains("joints 2 and 4 that are exchanged"));
    let zero = commands(&|q| q[3] -= 0.65);
    // With the arm's own deviation of less than a degree.
    assert!(zero.contains("joint 4 whose zero position is 37."), "{zero}");
    let multiple = commands(&|q| q[2] /= 1.7);
    assert!(multiple.contains("joint 3 that turns by 1.700") && !multiple.contains("flexcal loop"));
    // An arm may have a ratio that is wrong by one per cent.
    let ratio = commands(&|q| q[2] /= 1.01);
    assert!(ratio.contains("flexcal loop adds gear-ratio = { joint = 3 }"), "{ratio}");
    let (problem, mut data) = based();
    data.measurements.positions[40..].rotate_left(1);
    let shifted = misread(&problem, &data);
    assert!(shifted.contains("the configuration 1 row after, from row 41"), "{shifted}");
    let declared = |change: &dyn Fn(&mut Problem)| {
        let (mut problem, data) = based();
        change(&mut problem);
        misread(&problem, &data)
    };
    let radians = declared(&|problem| problem.joints[1].alpha = 1.57_f64.to_radians());
    assert!(radians.contains("alpha of joint 2 that is in radians"), "{radians}");
    let (mut problem, mut data) = based();
    problem.parameters.retain(|rule| rule.pattern != "base.*");
    data.measurements.positions.iter_mut().for_each(|at| *at += Vector3::new(0.4, -0.2, 0.1));
    let held = misread(&problem, &data);
    assert!(held.contains("a base that stands elsewhere than declared"), "{held}");
    let signs = declared(&|problem| problem.joints.iter_mut().for_each(|joint| joint.a *= -1.0));
    assert!(signs.contains("a of all joints that has the other sign"), "{signs}");
    let long = declared(&|problem| problem.joints[3].d *= 1e3);
    assert!(long.contains("lengths of joints that are in millimetres"), "{long}");
    // Rows of a standard table: a and α of a joint belong to the next one.
    let standard = declared(&|problem| {
        let next: Vec<(f64, f64)> = problem.joints.iter().map(|j| (j.a, j.alpha)).collect();
        for (k, joint) in problem.joints.iter_mut().enumerate() {
            (joint.a, joint.alpha) = next.get(k + 1).copied().unwrap_or_default();
        }
    });
    assert!(standard.contains("standard DH form"), "{standard}");
}

#[test]
fn exchanged_rows_and_lengths_columns_moved_on_and_one_axis_in_metres_are_named() {
    let named = |problem: &Problem, data: &Dataset, words: &str| {
        let found = fit(problem, data);
        let finding = found.finding(FindingCode::Misread).unwrap().to_string();
        assert!(!found.is_trusted() && finding.contains(words), "{finding}");
        // What follows from the misreading has no remedy of its own.
        for code in [FindingCode::HeldOutNotBetter, FindingCode::HeldOutBeyondPrediction] {
            let follows = found.finding(code);
            assert!(follows.is_none_or(|of| of.remedy.contains("another warning names")));
        }
    };
    let (problem, data) = based();
    let mut moved = data.clone();
    moved.measurements.configurations.chunks_exact_mut(5).for_each(|q| q.rotate_right(1));
    named(&problem, &moved, "columns of the joints that are moved on by 1 place");
    let mut metres = data.clone();
    metres.measurements.positions.iter_mut().for_each(|at| at.z *= 1e-3);
    metres.measurements.position_unit = Some(1e-3);
    named(&problem, &metres, "z alone that is in metres, declared in millimetres");
    let mut rows = problem.clone();
    let (third, fourth) = (rows.joints[2].clone(), rows.joints[3].clone());
    for (joint, other) in [(2, &fourth), (3, &third)] {
        let joint = &mut rows.joints[joint];
        (joint.alpha, joint.a, joint.d) = (other.alpha, other.a, other.d);
    }
    named(&rows, &data, "rows 3 and 4 of the joint table that are exchanged (");
    let mut lengths = problem.clone();
    let fourth = &mut lengths.joints[3];
    std::mem::swap(&mut fourth.a, &mut fourth.d);
    named(&lengths, &data, "a and d of row 4 of the joint table that are exchanged (");
}

#[test]
fn a_held_target_a_turned_row_and_a_ball_screw_are_named() {
    let named = |problem: &Problem, data: &Dataset| {
        let found = fit(problem, data);
        assert!(!found.is_trusted());
        found.finding(FindingCode::Misread).map(ToString::to_string).unwrap_or_default()
    };
    let held = "'joint*' = { sigma_deg = 0.3, sigma_mm = 2 }\n'base.*' = { free = true }";
    let mut problem = parse(&text(held));
    let data = measured(&problem, 8);
    problem.tool.target += Vector3::new(-0.05, 0.06, 0.0);
    let target = named(&problem, &data);
    assert!(target.contains("a target that lies elsewhere than [tool] declares"), "{target}");
    assert!(!target.contains("times its command"), "{target}");
    let (mut problem, data) = based();
    problem.joints[2].alpha += std::f64::consts::FRAC_PI_2;
    let twist = named(&problem, &data);
    assert!(twist.contains("alpha of joint 3 that is 90° off ("), "{twist}");
    let scara = parse(&format!(
        "name = 'arm'\n[[joint]]\nd_m = 0.35\n[[joint]]\na_m = 0.325\n[[joint]]\nkind = 'prismatic'\na_m = 0.275\n\
         alpha_deg = 180\n[[joint]]\n[tool]\ntarget_m = [0.08, 0, 0.02]\n[parameters]\n{held}\n[data]\n\
         position_sigma_mm = 0.05\n"
    ));
    let mut data = measured(&scara, 8);
    let lead = std::f64::consts::TAU / 0.02;
    data.measurements.configurations.chunks_exact_mut(4).for_each(|q| q[3] -= lead * q[2]);
    let screw = named(&scara, &data);
    assert!(screw.contains("joint 4 that also turns by 18.0"), "{screw}");
    assert!(screw.contains("°/mm of joint 3"), "{screw}");
}

#[test]
fn no_cause_is_named_if_the_table_is_one_of_another_arm() {
    let (problem, _) = based();
    let mut other = problem.clone();
    let lengths = [(0.0, 0.2), (0.3, 0.1), (0.35, -0.2), (-0.2, 0.4), (0.1, 0.15)];
    for (joint, (a, d)) in other.joints.iter_mut().zip(lengths) {
        (joint.a, joint.d) = (a, d);
    }
    let found = fit(&problem, &measured(&other, 8));
    assert!(!found.is_trusted() && !found.has(FindingCode::Misread), "{:?}", found.findings);
}

#[test]
fn a_sigma_in_another_unit_is_asked_about() {
    for (factor, is_named) in [(1.0, false), (20.0, false), (1000.0, true)] {
        let (mut problem, data) = based();
        problem.data.position_sigma = Some(factor * SIGMA);
        assert_eq!(fit(&problem, &data).has(FindingCode::SigmaOverstated), is_named, "{factor}");
    }
}

#[test]
fn gross_mistakes_with_a_standard_table_are_fitted_and_named() {
    // Read as a modified table, the same rows have one joint fewer than the measurements.
    let problem = parse(&format!(
        "dh = 'standard'\n{}",
        text(&format!("{PRIORS}\n'base.*' = {{ free = true }}"))
    ));
    let data = measured(&problem, 8);
    assert!(fit(&problem, &data).is_trusted());
    let mut metres = data.clone();
    metres.measurements.positions.iter_mut().for_each(|at| *at *= 1e-3);
    metres.measurements.position_unit = Some(1e-3);
    let found = fit(&problem, &metres);
    let finding = found.finding(FindingCode::Misread).unwrap().to_string();
    assert!(finding.contains("positions that are metres, declared as millimetres"), "{finding}");
}

#[test]
fn a_coupling_or_ratio_of_joints_is_found_as_an_effect_and_no_other_mistake_is() {
    let looped = |change: &dyn Fn(&mut [f64])| {
        let (problem, mut data) = based();
        data.measurements.configurations.chunks_exact_mut(5).for_each(change);
        close(&problem, &data, &Options::default()).unwrap()
    };
    let is_found = |effect: Effect, size: f64, change: &dyn Fn(&mut [f64])| {
        let closure = looped(change);
        assert!(closure.before.fit.has(FindingCode::Misread));
        let [only] = closure.effects.as_slice() else { panic!("{:?}", closure.effects) };
        assert_eq!((&only.effect, only.status), (&effect, Status::Found));
        assert!((only.estimates[0].estimate - size).abs() < 1e-3, "{:?}", only.estimates);
        assert!(closure.after.is_trusted(), "{:?}", closure.after.findings);
        assert!(closure.after.fitted.held_out.rms.norm < 3.0 * SIGMA);
    };
    is_found(Effect::JointCoupling { joint: 3, from: 2 }, -1.0, &|q| q[2] += q[1]);
    is_found(Effect::GearRatio { joint: 3 }, 0.7, &|q| q[2] /= 1.7);
    let exchanged = looped(&|q| q.swap(1, 3));
    assert!(exchanged.effects.is_empty() && exchanged.after.has(FindingCode::Misread));
}

#[test]
fn positions_that_a_controller_computes_are_not_measurements() {
    let (problem, mut data) = based();
    let zero = DVector::zeros(model_of(&problem, &data.measurements).parameters.len());
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    // Written to a thousandth of a millimetre.
    measure(&problem, &mut data.measurements, &zero, 3e-7, &mut rng);
    let found = fit(&problem, &data);
    assert!(found.has(FindingCode::PositionsComputed) && !found.is_trusted());
    measure(&problem, &mut data.measurements, &zero, SIGMA, &mut rng);
    assert!(!fit(&problem, &data).has(FindingCode::PositionsComputed));
}

#[test]
fn commands_with_few_digits_are_named_as_a_cause() {
    let rounded = |step_deg: f64| {
        let (problem, mut data) = based();
        let round =
            |q: &mut f64| *q = ((q.to_degrees() / step_deg).round() * step_deg).to_radians();
        data.measurements.configurations.iter_mut().for_each(round);
        fit(&problem, &data)
    };
    let found = rounded(0.1);
    let finding = found.finding(FindingCode::CommandsRounded).unwrap();
    assert!((finding.number("step_deg").unwrap() - 0.1).abs() < 1e-12, "{finding}");
    let ratio = finding.number("rounding").unwrap() / finding.number("rms").unwrap();
    assert!((0.7..1.4).contains(&ratio), "{ratio}");
    assert!(!rounded(0.001).has(FindingCode::CommandsRounded));
}

#[test]
fn a_sound_table_is_not_misread() {
    let (problem, data) = based();
    let found = fit(&problem, &data);
    assert!(found.is_trusted() && !found.has(FindingCode::Misread), "{:?}", found.findings);
}

#[test]
fn a_payload_hangs_at_the_identified_target_where_that_is_declared() {
    let elastic = |tool: &str| {
        format!(
            "name = 'arm'\n[[joint]]\nd_m = 0.4\n[[joint]]\nalpha_deg = 90\na_m = 0.15\nstiffness_N_m_per_rad = 2e4\n\
             [[joint]]\na_m = 0.6\nstiffness_N_m_per_rad = 1e4\n[[joint]]\nalpha_deg = -90\na_m = 0.1\nd_m = 0.6\n\
             stiffness_N_m_per_rad = 3e3\n[tool]\ntarget_m = [0.05, 0.02, 0.12]\npayload_kg = 20\n{tool}[parameters]\n\
             'tool.*' = {{ sigma_mm = 20 }}\n'joint*.stiffness' = {{ sigma_relative = 0.3 }}\n[data]\nposition_sigma_mm = 0.05\n"
        )
    };
    let truth = [("tool.x", 0.02), ("tool.y", -0.01), ("tool.z", 0.03)];
    let (follows, fixed) = (parse(&elastic("payload_at = 'target'\n")), parse(&elastic("")));
    let data = simulated(&follows, &truth, [60, 20], 11);
    let found = fit(&follows, &data);
    for (name, value) in truth {
        let estimate = found.estimates.iter().find(|estimate| estimate.name == name).unwrap();
        let error = estimate.estimate - estimate.nominal - value;
        assert!(error.abs() < 4.0 * estimate.std_error.unwrap(), "{name} {error}");
    }
    let chi2 = |problem| fit(problem, &data).reduced_chi2.unwrap();
    assert!(chi2(&follows) < 1.5 && chi2(&fixed) > 3.0, "{} {}", chi2(&follows), chi2(&fixed));
    assert_ne!(follows.digest(), fixed.digest());
    // Where its place is not declared and matters so much, the fit is not trusted.
    let at_target = |problem| {
        let options = Options::default().with_influential_rows();
        let found = identify(problem, &data, &options).unwrap();
        found.has(FindingCode::PayloadAtTarget)
    };
    let declared = parse(&elastic("payload_at_m = [0.05, 0.02, 0.12]\n"));
    assert!(at_target(&fixed) && !at_target(&follows) && !at_target(&declared));
    // Derivatives with respect to the target contain those of the load.
    let model = model_of(&follows, &data.measurements);
    let placement = flexcal::fit::Placement::of(&data.measurements);
    let rows: Vec<usize> = (0..6).collect();
    let poses = || placement.poses(&data.measurements, &rows, 1e-3);
    let x = DVector::from_element(model.parameters.len(), 1e-3);
    let place = model.parameters.iter().position(|p| p.name == "tool.x").unwrap();
    let at = |step: f64| {
        let mut moved = x.clone();
        moved[place] += step;
        model.residuals(poses(), &moved)
    };
    let (ahead, behind) = (at(1e-4), at(-1e-4));
    let unknowns: Vec<usize> = (0..model.parameters.len()).collect();
    let residuals = PoseResiduals::new(&model, poses(), unknowns, x.clone());
    let slopes = flexcal::least_squares::jacobian(&residuals, &x);
    for (row, (ahead, behind)) in ahead.iter().zip(&behind).enumerate() {
        let expected = (ahead - behind) / 2e-4 / 1e-3;
        let found = slopes.fixed_view::<3, 1>(3 * row, place);
        assert!((expected - found).norm() < 1e-4 * expected.norm(), "{expected} {found}");
    }
}

#[test]
fn a_held_out_session_on_a_line_is_a_finding_about_it_alone() {
    let (problem, mut data) = based();
    data.measurements.session =
        crate::common::made::labels((0..90).map(|row| if row < 60 { "A" } else { "B" }));
    data.measurements.target = Some(crate::common::made::labels((0..90).map(|_| "t")));
    // One axis turns: the points lie on a circle about it, and four of them nearly on a line.
    let rows: Vec<usize> = (0..60).chain([60, 61]).collect();
    data = divided(60, &data.measurements.select(&rows));
    let found = fit(&problem, &data);
    assert!(found.is_trusted(), "{:?}", found.findings);
    assert!(found.has(FindingCode::HeldOutBaseNotDetermined), "{:?}", found.findings);
}

#[test]
fn all_rows_may_be_fitted_and_configurations_left_out_judge() {
    let plain = parse(&text(PRIORS));
    let problem = parse(&(text(PRIORS) + "held_out = 'none'\n"));
    let whole = simulated(&plain, &[("joint2.alpha", 2e-3)], [24, 6], 12);
    let data = Dataset::from_measurements(&problem, whole.measurements.clone()).unwrap();
    assert_eq!((data.split.identification.len(), data.split.held_out.len()), (30, 0));
    let found = fit(&problem, &data);
    assert!(found.is_trusted() && found.fitted.is_left_out && found.fitted.held_out.n == 30);
    let errors = (0..30).map(|row| {
        let mut without = data.clone();
        without.split.identification.retain(|&fitted| fitted != row);
        without.split.held_out = vec![row];
        fit(&plain, &without).fitted.held_out.rms.norm
    });
    let mean = errors.sum::<f64>() / 30.0;
    let ratio = found.fitted.held_out.mean.norm / mean;
    assert!((0.98..1.02).contains(&ratio), "{ratio}");
    assert!(found.fitted.held_out.rms.norm > 1.02 * found.fitted.identification.rms.norm);
}
