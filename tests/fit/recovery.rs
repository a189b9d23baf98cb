//! Recovery of the true arm from exact measurements.

use crate::common::arms::{
    golden, golden_problem, measured, parse, path, table_2_deviations, with_parameters,
    without_elasticity,
};
use crate::common::made::{at_random, draw, labels, measure, model_of, part, predicted, split_at};
use flexcal::fit::{Identification, Options, Strategy, identify};
use flexcal::least_squares::solver::AtBound;
use flexcal::measurement::{Dataset, Measurements, Split};
use flexcal::model::parameter::Parameter;
use flexcal::problem::Problem;
use flexcal::quantity::Unit;
use nalgebra::{DVector, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn fit(problem: &Problem, rows: &Measurements, split: &Split) -> Identification {
    fit_by(Strategy::Joint, problem, rows, split)
}

fn fit_by(
    strategy: Strategy,
    problem: &Problem,
    rows: &Measurements,
    split: &Split,
) -> Identification {
    let options = Options::default().with_strategy(strategy);
    let found = identify(problem, &Dataset::new(rows.clone(), split.clone()), &options).unwrap();
    assert!(found.is_trusted(), "{:?} {:?}", found.findings, found.termination);
    found
}

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(42)
}

/// Returns half the sum of squares of residuals and priors on the identification rows.
fn cost(problem: &Problem, rows: &Measurements, split: &Split, x: &DVector<f64>) -> f64 {
    let rows = part(rows, split.identification.iter().copied());
    let sigma = problem.data.position_sigma.unwrap();
    let data: f64 = predicted(problem, &rows, x)
        .iter()
        .zip(&rows.positions)
        .map(|(a, b)| (a - b).norm_squared())
        .sum();
    let parameters = model_of(problem, &rows).parameters;
    let priors =
        parameters.iter().zip(x).filter_map(|(p, x)| Some((x / p.sigma?).powi(2))).sum::<f64>();
    0.5 * (data / sigma.powi(2) + priors)
}

/// Returns the rigid lunar sampler with positions of the arm of table 2, rounded to a nanometre.
fn rigid_rows(problem: &Problem) -> Measurements {
    let mut reader = csv::Reader::from_path(golden("rigid.csv")).unwrap();
    let table: Vec<Vec<f64>> = reader
        .records()
        .map(|record| record.unwrap().iter().map(|cell| cell.parse().unwrap()).collect())
        .collect();
    let mut rows = at_random(problem, table.len(), 1.0, &mut rng());
    rows.configurations =
        table.iter().flat_map(|row| row[..4].iter().map(|q| q.to_radians())).collect();
    rows.positions =
        table.iter().map(|row| Vector3::new(row[9], row[10], row[11]) * 1e-3).collect();
    rows
}

#[test]
fn all_that_rigid_positions_tell_of_table_2_comes_back() {
    let everything = "\"joint*\" = { free = true }";
    let problem = without_elasticity(with_parameters("tests/golden/problem.toml", everything));
    let rows = rigid_rows(&problem);
    let found = fit(&problem, &rows, &split_at(28, &rows));
    assert!(found.fitted.held_out.max.norm < 1e-9, "{:?}", found.fitted.held_out);
    // β1 rotates about the axis of θ2; d2, d3 and d4 are along parallel axes.
    let unidentifiable: Vec<Vec<&str>> = found
        .identifiability()
        .unidentifiable
        .iter()
        .map(|combination| {
            combination.weights.iter().map(|&(j, _)| found.unknowns[j].as_str()).collect()
        })
        .collect();
    assert_eq!(
        unidentifiable,
        [["joint1.beta", "joint2.theta"], ["joint2.d", "joint4.d"], ["joint3.d", "joint4.d"]]
    );
    let model = model_of(&problem, &rows);
    let error = &found.x - table_2_deviations(&model.parameters);
    let of = |name: &str| {
        error[found.estimates.iter().position(|estimate| estimate.name == name).unwrap()]
    };
    for (estimate, error) in found.estimates.iter().zip(&error) {
        // Unidentifiable parameters stay near nominal; other parameters compensate the remainder
        // beyond first order.
        let limit = if estimate.identified > 0.999_999 { 2e-5 } else { 0.01 };
        assert!(error.abs() < limit, "{}: off by {error:e}", estimate.name);
    }
    assert!((of("joint1.beta") - of("joint2.theta")).abs() < 1e-6);
    assert!((of("joint2.d") + of("joint3.d") + of("joint4.d")).abs() < 1e-8);
    assert!(
        of("joint2.d").abs() > 1e-3,
        "the parts of an unidentifiable combination are not known"
    );
}

#[test]
fn table_2_comes_back_once_the_blind_parameters_are_known() {
    let rules = "\"joint*\" = { free = true }\n\"joint1.beta\" = { fixed = true }\n\"joint3.d\" = { fixed = true }\n\
                 \"joint4.d\" = { fixed = true }";
    let mut problem = without_elasticity(with_parameters("tests/golden/problem.toml", rules));
    problem.joints[0].beta = 0.304_f64.to_radians();
    (problem.joints[2].d, problem.joints[3].d) = (-0.095, -0.092);
    let rows = rigid_rows(&problem);
    let found = fit(&problem, &rows, &split_at(28, &rows));
    assert_eq!((found.identifiability().rank, found.unknowns.len()), (17, 17));
    assert!(found.fitted.held_out.max.norm < 1e-9, "{:?}", found.fitted.held_out);
    let error = &found.x - table_2_deviations(&model_of(&problem, &rows).parameters);
    let worst = error.amax();
    println!("Table 2, worst {worst:.1e} m or rad");
    assert!(worst < 2e-8, "{error}");
}

#[test]
fn stiffnesses_come_back_from_exact_positions() {
    let rules = "\"joint*.stiffness\" = { free = true }\n\"A.*\" = { free = true }\n\"B.*\" = { free = true }\n\
                 \"tool.*\" = { free = true }";
    let problem = with_parameters("tests/golden/problem.toml", rules);
    let mut rows = measured(&problem, &["tests/cases/a-none.csv"]);
    let model = model_of(&problem, &rows);
    let truth = draw(&model, |unit| if unit == Unit::Length { 0.005 } else { 0.3 }, &mut rng());
    measure(&problem, &mut rows, &truth, 0.0, &mut rng());
    let found = fit(&problem, &rows, &split_at(28, &rows));
    let stiffnesses = found.estimates.iter().filter(|estimate| estimate.unit.is_relative());
    assert_eq!(stiffnesses.filter(|estimate| estimate.identified > 0.999_999).count(), 9);
    let worst = (&found.x - &truth).amax();
    println!(
        "stiffnesses, worst {worst:.1e} relative; held out {:.1e} m",
        found.fitted.held_out.max.norm
    );
    assert!(worst < 1e-6, "{:e}", found.x - truth);
    assert!(found.fitted.held_out.max.norm < 1e-9);
}

#[test]
fn geometry_and_stiffness_come_back_together() {
    // The stretch of a link is hardly identifiable: without a prior its EA may diverge.
    let rules =
        "\"joint*\" = { free = true }\n\"*.EI\" = { free = true }\n\"*.GJ\" = { free = true }";
    let problem = with_parameters("tests/golden/problem.toml", rules);
    let mut rows = measured(&problem, &["tests/cases/h-none-large.csv"]);
    let model = model_of(&problem, &rows);
    let truth = table_2_deviations(&model.parameters)
        + draw(&model, |unit| if unit.is_relative() { 0.2 } else { 0.0 }, &mut rng());
    measure(&problem, &mut rows, &truth, 0.0, &mut rng());
    let found = fit(&problem, &rows, &split_at(100, &rows));
    assert!(found.fitted.held_out.max.norm < 1e-9, "{:?}", found.fitted.held_out);
    for (k, estimate) in
        found.estimates.iter().enumerate().filter(|(_, estimate)| estimate.unit.is_relative())
    {
        let error = (found.x[k] - truth[k]).abs();
        println!("{} off by {error:.1e}", estimate.name);
        assert!(
            estimate.identified > 0.999_999 && error < 1e-6,
            "{}: off by {error:e}",
            estimate.name
        );
    }
}

/// Simulates a UR10 in two sessions measured from two sides, with two targets; every third row of
/// the first session has the target of the other.
fn two_sessions(problem: &Problem, per_session: usize, sigma: f64) -> (Measurements, DVector<f64>) {
    let mut rng = rng();
    let mut rows = at_random(problem, 2 * per_session, 2.8, &mut rng);
    rows.session = labels((0..2 * per_session).map(|k| if k < per_session { "A" } else { "B" }));
    let model = model_of(problem, &rows);
    let mut truth = draw(&model, |unit| if unit == Unit::Length { 2e-3 } else { 4e-3 }, &mut rng);
    let bases = [
        ("base[A]", [4.0, -3.0, 0.5, 0.1, -0.2, 0.3]),
        ("base[B]", [-5.0, 2.0, 1.5, 0.0, 0.1, 3.1]),
    ];
    for (base, pose) in bases {
        for (suffix, value) in ["x", "y", "z", "rx", "ry", "rz"].iter().zip(pose) {
            truth[index(&model.parameters, &format!("{base}.{suffix}"))] = value;
        }
    }
    measure(problem, &mut rows, &truth, sigma, &mut rng);
    (rows, truth)
}

fn index(parameters: &[Parameter], name: &str) -> usize {
    parameters.iter().position(|parameter| parameter.name == name).unwrap()
}

/// Free parameters of the UR10 that target positions separate, with bases and targets.
const UR10: &str = "\"joint2.a\" = { free = true }\n\"joint2.theta\" = { free = true }\n\"joint3.a\" = { free = true }\n\
                    \"joint3.alpha\" = { free = true }\n\"joint3.theta\" = { free = true }\n\"joint4.*\" = { free = true }\n\
                    \"joint4.beta\" = { fixed = true }\n\"joint5.theta\" = { free = true }\n\"tool.*\" = { free = true }\n\
                    \"base.*\" = { free = true }";

fn ur10(held_out: &str) -> Problem {
    let text = std::fs::read_to_string(path("problems/ur10-ipa/problem.toml")).unwrap();
    let (arm, _) = text.split_once("[parameters]").unwrap();
    parse(&format!("{arm}[parameters]\n{UR10}\n[data]\nposition_sigma_mm = 0.05\n{held_out}\n"))
}

#[test]
fn sessions_far_apart_are_registered_without_a_guess() {
    let problem = ur10("");
    let (rows, truth) = two_sessions(&problem, 30, 0.0);
    let (held_out, identification) = (0..60).partition(|row| row % 3 == 0);
    let found = fit(&problem, &rows, &Split { identification, held_out });
    assert!(found.registered.held_out.max.norm < 0.05, "{:?}", found.registered.held_out);
    assert!(found.registered.held_out.max.norm > 1e-3, "{:?}", found.registered.held_out);
    assert!(found.fitted.held_out.max.norm < 1e-9, "{:?}", found.fitted.held_out);
    assert_eq!(found.identifiability().rank, found.unknowns.len());
    let worst = (&found.x - &truth).amax();
    println!("sessions, {} steps, worst {worst:.1e} m or rad", found.iterations);
    assert!(worst < 1e-8, "{:e}", found.x - truth);
}

#[test]
fn a_session_held_out_is_fitted_on_its_own_rows_alone() {
    let problem = ur10("held_out = { session = \"B\" }");
    let (rows, truth) = two_sessions(&problem, 40, 5e-5);
    let split = Split::new(&problem, &rows).unwrap();
    assert_eq!(
        (split.identification.clone(), split.held_out.clone()),
        ((0..40).collect(), (40..80).collect())
    );
    let found = fit(&problem, &rows, &split);
    let parameters = model_of(&problem, &rows).parameters;

    let placed: Vec<usize> =
        (0..parameters.len()).filter(|&k| parameters[k].name.contains("[B]")).collect();
    assert_eq!(placed.len(), 6 + 3);
    for &k in &placed {
        let (estimate, error) = (&found.estimates[k], (found.x[k] - truth[k]).abs());
        assert!(estimate.fitted && !found.unknowns.contains(&estimate.name));
        assert!(
            error < 5.0 * estimate.std_error.unwrap(),
            "{}: {error:e} {estimate:?}",
            estimate.name
        );
    }
    let rms = found.fitted.held_out.rms.norm / 5e-5;
    assert!((1.2..2.2).contains(&rms), "held-out rms {rms} σ");

    // Session A alone, and A with a session B of another arm.
    let mut other = rows.clone();
    for position in &mut other.positions[40..] {
        *position += Vector3::new(0.3 * position.y, 0.1, 0.2 * position.x);
    }
    let with_other = identify(&problem, &Dataset::new(other, split), &Options::default()).unwrap();
    assert!(!with_other.is_trusted(), "held-out rows of another arm");
    let alone = part(&rows, 0..40);
    let split = Split { identification: (0..40).collect(), held_out: Vec::new() };
    let alone = fit(&problem, &alone, &split);
    for (k, parameter) in parameters.iter().enumerate() {
        let same = with_other.x[k].to_bits() == found.x[k].to_bits();
        assert_eq!(
            same,
            !placed.contains(&k),
            "{} {:e} {:e}",
            parameter.name,
            with_other.x[k],
            found.x[k]
        );
        let Some(estimate) = alone.estimate(&parameter.name) else {
            continue;
        };
        assert_eq!(*estimate, found.estimates[k]);
    }
    assert_eq!(alone.estimates.len() + 9, found.estimates.len());
}

#[test]
fn a_target_seen_in_held_out_rows_alone_does_not_touch_the_arm() {
    let problem = ur10("");
    let (mut rows, _) = two_sessions(&problem, 30, 5e-5);
    rows.target = Some(labels((0..60).map(|k| if k % 3 == 0 { "late" } else { "early" })));
    let (held_out, identification): (Vec<usize>, Vec<usize>) =
        (0..60).partition(|row| row % 3 == 0);
    let split = Split { identification, held_out };
    let parameters = model_of(&problem, &rows).parameters;
    let late: Vec<bool> =
        parameters.iter().map(|parameter| parameter.name.starts_with("tool[late]")).collect();
    // Positions of the nominal arm itself would count as computed, not as measured.
    let deviation = |k: usize| if parameters[k].name == "joint3.a" { 2e-3 } else { 0.0 };
    let truth =
        DVector::from_fn(parameters.len(), |k, _| if late[k] { 0.04 } else { deviation(k) });
    rows.positions = predicted(&problem, &rows, &truth);
    let found = fit(&problem, &rows, &split);
    assert!((&found.x - &truth).amax() < 1e-9, "{:e}", found.x - truth);
    for row in &split.held_out {
        rows.positions[*row].x += 0.01;
    }
    let moved = fit(&problem, &rows, &split);
    for (k, late) in late.into_iter().enumerate() {
        assert_eq!(moved.x[k].to_bits() != found.x[k].to_bits(), late, "{}", parameters[k].name);
    }
}

/// Simulates the example poses of the lunar sampler with deviations of the given fractions of the
/// prior sizes.
fn slightly_off(problem: &Problem, geometry: f64, stiffness: f64) -> (Measurements, Split) {
    let mut rows = measured(problem, &["tests/cases/a-none.csv"]);
    let model = model_of(problem, &rows);
    let mut truth = draw(&model, |_| 0.0, &mut rng());
    for (x, parameter) in truth.iter_mut().zip(&model.parameters) {
        *x *= if parameter.site.is_elastic() { stiffness } else { geometry };
    }
    measure(problem, &mut rows, &truth, 5e-5, &mut rng());
    let split = Split::new(problem, &rows).unwrap();
    (rows, split)
}

#[test]
fn stage_by_stage_settles_where_everything_at_once_does() {
    // Joint zeros, which resemble flexible joints, stay fixed, since they slow the sweeps down.
    let rules = "\"joint*.a\" = { sigma_mm = 30.0 }\n\"joint*.alpha\" = { sigma_deg = 1.0 }\n\
                 \"joint*.stiffness\" = { sigma_relative = 0.5 }\n\"A.*\" = { sigma_relative = 0.5 }\n\
                 \"B.*\" = { sigma_relative = 0.5 }\n\"tool.*\" = { sigma_mm = 5.0 }";
    let problem = with_parameters("tests/golden/problem.toml", rules);
    let (rows, split) = slightly_off(&problem, 0.1, 0.1);
    let joint = fit(&problem, &rows, &split);
    let sequential = fit_by(Strategy::Sequential, &problem, &rows, &split);
    let cost = |found: &Identification| cost(&problem, &rows, &split, &found.x);
    let (least, settled) = (cost(&joint), cost(&sequential));
    let apart = predicted(&problem, &rows, &joint.x)
        .iter()
        .zip(predicted(&problem, &rows, &sequential.x))
        .map(|(a, b)| (a - b).norm())
        .fold(0.0, f64::max);
    println!(
        "cost {least:.6} at once, {settled:.6} stage by stage in {} steps, positions within {:.1e} m",
        sequential.iterations, apart
    );
    assert!(settled >= least * (1.0 - 1e-9), "{settled} below {least}");
    assert!(settled < least * (1.0 + 1e-5), "{settled} above {least}");
    assert!(apart < 1e-5, "positions differ by {apart} m");
}

#[test]
fn strategies_leave_the_others_at_nominal() {
    let problem = golden_problem();
    let strategies =
        [(Strategy::GeometryOnly, false, 0.1, 1e-3), (Strategy::StiffnessOnly, true, 1e-3, 0.1)];
    for (strategy, elastic, geometry, stiffness) in strategies {
        let (rows, split) = slightly_off(&problem, geometry, stiffness);
        let parameters = model_of(&problem, &rows).parameters;
        let found = fit_by(strategy, &problem, &rows, &split);
        assert!(found.fitted.identification.rms.norm < found.registered.identification.rms.norm);
        for (k, (parameter, estimate)) in parameters.iter().zip(&found.estimates).enumerate() {
            let varied = parameter.site.is_placement() || parameter.site.is_elastic() == elastic;
            assert_eq!(estimate.fitted, varied, "{strategy:?} {}", parameter.name);
            assert_eq!(found.unknowns.contains(&parameter.name), varied);
            if varied {
                assert!(found.x[k] != 0.0, "{strategy:?}: {} has not moved", parameter.name);
            } else {
                assert_eq!((found.x[k], estimate.std_error, estimate.identified), (0.0, None, 0.0));
                assert_eq!(estimate.estimate.to_bits(), estimate.nominal.to_bits());
            }
        }
    }
}

#[test]
fn a_bound_that_binds_is_kept_exactly_and_reported() {
    // Table 2 has a3 24 mm and a4 16 mm above nominal.
    let rules = "\"joint*.a\" = { sigma_mm = 30.0, min_mm = -30, max_mm = 30 }\n\"joint3.a\" = { max_mm = 5 }\n\
                 \"joint*.theta\" = { sigma_deg = 1.0 }\n\"A.EI\" = { min_relative = 0.9, max_relative = 1.1 }";
    let problem = with_parameters("tests/golden/problem.toml", rules);
    let mut rows = measured(&problem, &["tests/cases/a-none.csv"]);
    let model = model_of(&problem, &rows);
    let mut truth = table_2_deviations(&model.parameters);
    let (a, ei) = (index(&model.parameters, "joint3.a"), index(&model.parameters, "A.EI"));
    truth[ei] = 0.8_f64.ln();
    measure(&problem, &mut rows, &truth, 0.0, &mut rng());
    // Bounds that the data contradict leave a residual far above σ: such a fit is not trusted.
    let data = Dataset::new(rows.clone(), split_at(40, &rows));
    let found = identify(&problem, &data, &Options::default()).unwrap();
    assert!(found.termination.converged() && !found.is_trusted(), "{:?}", found.findings);
    assert_eq!(found.estimates[a].at_bound, Some(AtBound::Upper));
    assert_eq!(found.x[a].to_bits(), model.parameters[a].upper.to_bits());
    assert_eq!(found.estimates[ei].at_bound, Some(AtBound::Lower));
    assert_eq!(found.x[ei].to_bits(), model.parameters[ei].lower.to_bits());
    for (k, (estimate, parameter)) in found.estimates.iter().zip(&model.parameters).enumerate() {
        let resting = k == a || k == ei;
        assert_eq!(estimate.at_bound.is_some(), resting, "{}", estimate.name);
        assert_eq!(estimate.std_error.is_none(), resting, "{}", estimate.name);
        assert!((parameter.lower..=parameter.upper).contains(&found.x[k]));
    }

    // The same bounds without an active one give the unbounded fit.
    truth[a] = 0.004;
    truth[ei] = 1.05_f64.ln();
    measure(&problem, &mut rows, &truth, 0.0, &mut rng());
    let found = fit(&problem, &rows, &split_at(40, &rows));
    assert!(found.estimates.iter().all(|estimate| estimate.at_bound.is_none()));
    assert!(
        (found.x[a] - 0.004).abs() < 1e-5 && (found.x[ei] - truth[ei]).abs() < 1e-3,
        "{}",
        found.x
    );
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let problem = ur10("");
    let (rows, _) = two_sessions(&problem, 500, 5e-5);
    let split = split_at(900, &rows);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found = pool.install(|| fit(&problem, &rows, &split));
        let bits: Vec<u64> = found.x.iter().map(|x| x.to_bits()).collect();
        (bits, found.estimates, found.fitted, found.reduced_chi2)
    };
    let (one, two) = (with(1), with(2));
    assert_eq!(one, two);
    assert!(one.0.iter().any(|&bits| bits != 0));
}

#[test]
fn an_arm_and_the_tools_of_many_sessions_are_recovered() {
    let problem = parse(
        "name = 'arm'\n[[joint]]\nalpha_deg = 90\nd_m = 0.4\n[[joint]]\na_m = 0.5\n[[joint]]\na_m = 0.4\n\
         [parameters]\n'joint*.a' = { sigma_mm = 5 }\n'joint*.theta' = { sigma_deg = 1 }\n'base.*' = { fixed = true }\n\
         'tool.*' = { sigma_mm = 5 }\n[data]\nposition_sigma_mm = 0.01\n",
    );
    let mut rows = at_random(&problem, 200, 1.5, &mut rng());
    let words: Vec<String> = (0..200).map(|row| format!("s{}", row % 50)).collect();
    rows.session = labels(words.iter().map(String::as_str));
    let model = model_of(&problem, &rows);
    let truth = draw(&model, |_| 0.0, &mut rng());
    measure(&problem, &mut rows, &truth, 1e-5, &mut rng());
    let found = fit(&problem, &rows, &split_at(200, &rows));
    let names: Vec<&String> = model.parameters.iter().map(|parameter| &parameter.name).collect();
    assert_eq!(found.unknowns.iter().collect::<Vec<_>>(), names);
    for (k, estimate) in found.estimates.iter().enumerate() {
        let error = (found.x[k] - truth[k]).abs();
        assert!(error < 5.0 * estimate.std_error.unwrap(), "{} {error}", estimate.name);
    }
    // The parameters of sessions precede those of the arm among the unknowns; an optimum of the
    // cost has no slope in either.
    let at = |k: usize, step: f64| {
        let mut x = found.x.clone();
        x[k] += step;
        cost(&problem, &rows, &split_at(200, &rows), &x)
    };
    for k in [0, 2, 5, names.len() / 2, names.len() - 1] {
        let step = found.estimates[k].std_error.unwrap();
        assert!((at(k, step) - at(k, -step)).abs() < 1e-3, "{}", names[k]);
    }
}
