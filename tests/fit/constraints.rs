//! `[[constraint]]` on the lunar sampler: exact if active, without effect otherwise.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::arms::{self, parse};
use crate::common::bounded::Bounded;
use crate::common::made::fit;
use crate::judged::text;
use crate::trusted::simulated;
use argmin::core::observers::Observe;
use flexcal::fit::{
    Estimate, FindingCode, Identification, IdentifyError, Options, SolverChoice, StageError,
    Strategy, identify,
};
use flexcal::least_squares::solver::{
    BoundMethod, Settings, Solution, State, minimise_constrained_by,
};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::Problem;
use flexcal::report::{PredictionAccuracy, estimate_text};
use flexcal::results::{Document as _, IdentificationResult};
use flexcal::select::trace;

struct Silent;

impl Observe<State> for Silent {}

fn cases() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases")
}

/// Returns the problem of the lunar sampler with text appended.
fn problem(more: &str) -> Problem {
    let file = cases().join("problem.toml");
    let text = fs::read_to_string(&file).unwrap();
    Problem::parse(&format!("{text}\n{more}\n"), &file).unwrap()
}

fn run(problem: &Problem, options: &Options) -> Result<Identification, IdentifyError> {
    let (measurements, _) = Measurements::read(&[cases().join("a-none.csv")], problem).unwrap();
    let data = Dataset::from_measurements(problem, measurements).unwrap();
    identify(problem, &data, options)
}

fn identified(more: &str) -> Identification {
    run(&problem(more), &Options::default()).unwrap()
}

fn estimate<'a>(result: &'a Identification, name: &str) -> &'a Estimate {
    result.estimate(name).unwrap()
}

fn constraint(terms: &str, limits: &str) -> String {
    format!("[[constraint]]\nterms = {{ {terms} }}\n{limits}\n")
}

#[test]
fn an_inactive_constraint_changes_nothing() {
    let free = identified("");
    let stiffer = constraint("\"A.EI\" = 1.0, \"B.EI\" = -1.0", "at_least = 0.0");
    let long = constraint("\"joint3.a\" = 1, \"joint4.a\" = 1", "at_most_mm = 4000");
    let bounded = identified(&(stiffer + &long));
    assert_eq!(
        (free.solver, bounded.solver),
        (SolverChoice::LevenbergMarquardt, SolverChoice::Bounded)
    );
    assert!(bounded.active_constraints.is_empty() && bounded.is_trusted());
    let change = (&bounded.x - &free.x).amax();
    assert!(change <= 1e-8 * free.x.amax(), "{change}");
    for (bounded, free) in bounded.estimates.iter().zip(&free.estimates) {
        let errors = (bounded.std_error.unwrap_or(0.0), free.std_error.unwrap_or(0.0));
        assert!((errors.0 - errors.1).abs() <= 1e-6 * errors.1, "{}: {errors:?}", free.name);
    }
}

#[test]
fn an_active_constraint_holds_exactly_and_is_named() {
    let free = identified("");
    let ratio = estimate(&free, "A.EI").estimate / estimate(&free, "B.EI").estimate;
    let limit = 1.3 * ratio;
    let stiffer =
        constraint("\"A.EI\" = 1.0, \"B.EI\" = -1.0", &format!("at_least = {}", limit.ln()));
    let stiff = identified(&stiffer);
    let reach = estimate(&stiff, "joint3.a").estimate + estimate(&stiff, "joint4.a").estimate;
    let short =
        constraint("\"joint3.a\" = 1, \"joint4.a\" = 1", &format!("at_most_m = {}", reach - 2e-5));
    let problem = problem(&(stiffer + &short));
    let held = run(&problem, &Options::default()).unwrap();
    assert!(held.is_trusted(), "{}", held.termination);
    let (a, b) = (estimate(&held, "A.EI"), estimate(&held, "B.EI"));
    let held_ratio = a.estimate / b.estimate;
    assert!((held_ratio / limit - 1.0).abs() < 1e-9, "{held_ratio} on {limit}, free {ratio}");
    let sum = estimate(&held, "joint3.a").estimate + estimate(&held, "joint4.a").estimate;
    assert!((sum - reach + 2e-5).abs() < 1e-9 * reach, "{sum} on {}", reach - 2e-5);
    // Along the constraints both parameters vary together: logarithms equally, lengths in opposite
    // directions.
    let relative = |of: &Estimate| of.std_error.unwrap() / of.estimate;
    assert!((relative(a) / relative(b) - 1.0).abs() < 1e-6, "{} {}", relative(a), relative(b));
    let length = |name| estimate(&held, name).std_error.unwrap();
    assert!((length("joint3.a") / length("joint4.a") - 1.0).abs() < 1e-6);
    assert!(length("joint3.a") < estimate(&free, "joint3.a").std_error.unwrap());
    let words: Vec<&str> =
        held.active_constraints.iter().map(|active| active.words.as_str()).collect();
    assert_eq!(words.len(), 2);
    assert!(
        words[0].starts_with("ln A.EI − ln B.EI ≥ ")
            && words[1].starts_with("joint3.a + joint4.a ≤ "),
        "{words:?}"
    );
    let text = estimate_text(&problem, &held, None);
    assert!(text.contains("Active limits") && text.contains(words[1]), "{text}");
    let json: serde_json::Value =
        serde_json::from_str(&IdentificationResult::new(&problem, &held).to_json()).unwrap();
    assert_eq!(json["active_constraints"][0]["side"], "at_least");
    assert_eq!(json["active_constraints"][1]["constraint"], words[1]);
    assert_eq!(json["active_constraints"][0]["line"], 86);
    assert_eq!(json["outliers"], serde_json::json!([]));

    // With stiffnesses alone free, only the constraint between them applies.
    let stiffness = Options::default().with_strategy(Strategy::StiffnessOnly);
    let alone = run(&problem, &stiffness).unwrap();
    assert!(alone.active_constraints.iter().all(|active| active.words == words[0]));
    assert!(
        estimate(&alone, "A.EI").estimate / estimate(&alone, "B.EI").estimate / limit > 1.0 - 1e-9
    );
}

#[test]
fn a_constraint_on_one_parameter_is_a_bound() {
    let rule = "\"A.*\" = { sigma_relative = 0.5 }";
    let file = cases().join("problem.toml");
    let text = fs::read_to_string(&file).unwrap();
    let bound = format!("{rule}\n\"A.EI\" = {{ sigma_relative = 0.5, max_relative = 1.0 }}");
    let bounded =
        run(&Problem::parse(&text.replace(rule, &bound), &file).unwrap(), &Options::default())
            .unwrap();
    let held =
        identified(&constraint("\"A.EI\" = 2.0", &format!("at_most = {}", 2.0 * 2.6e4_f64.ln())));
    let change = (&bounded.x - &held.x).amax();
    assert!(change < 1e-6 * bounded.x.amax(), "{change} of {}", bounded.x.amax());
    assert!(estimate(&bounded, "A.EI").at_bound.is_some() && held.active_constraints.len() == 1);
    assert!(estimate(&held, "A.EI").std_error.is_none());
    let printed = estimate_text(&problem(""), &held, None);
    let row = printed.lines().find(|line| line.trim_start().starts_with("A.EI ")).unwrap();
    assert!(row.ends_with("set by constraints"), "{row}");
    for (held, bounded) in held.estimates.iter().zip(&bounded.estimates) {
        let errors = (held.std_error.unwrap_or(0.0), bounded.std_error.unwrap_or(0.0));
        assert!((errors.0 - errors.1).abs() <= 1e-5 * errors.1, "{}: {errors:?}", held.name);
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let both = constraint("\"joint3.a\" = 1", "at_least_mm = 2000")
        + &constraint("\"joint3.a\" = 1, \"joint4.a\" = 1e-3", "at_most_mm = 1900")
        + &constraint("\"joint4.a\" = 1", "at_least_mm = 1700");
    let refused = run(&problem(&both), &Options::default());
    assert!(matches!(refused, Err(IdentifyError::Stage(StageError::Infeasible))));
    let solver = SolverChoice::LevenbergMarquardt;
    let any = constraint("\"joint3.a\" = 1", "at_least_mm = 1000");
    let refused = run(&problem(&any), &Options::default().with_solver(solver));
    assert!(matches!(refused, Err(IdentifyError::BoundsIgnored { .. })));

    let mistakes: [(&str, &str, &[&str]); 8] = [
        (
            "\"C.EI\" = 1",
            "at_least = 0",
            &["problem.toml:87", "\"C.EI\"", "no such parameter", "B.EI"],
        ),
        (
            "\"A.EI\" = 1, \"joint3.a\" = 1",
            "at_least = 0",
            &["problem.toml:87", "cannot be added to A.EI"],
        ),
        (
            "\"A.EI\" = 1",
            "at_least_mm = 0",
            &["problem.toml:88", "at_least_mm", "A.EI takes at_least"],
        ),
        (
            "\"A.EI\" = 1, \"B.EI\" = -1",
            "at_least = 1e149",
            &["problem.toml:88", "at_least", "no values satisfy this", "at most 691 in size"],
        ),
        (
            "\"joint3.a\" = 1",
            "at_most = 0",
            &["problem.toml:88", "at_most", "joint3.a takes at_least_mm"],
        ),
        (
            "\"joint3.alpha\" = 1",
            "at_most_mm = 0",
            &["problem.toml:88", "at_most_mm", "at_most_rad"],
        ),
        (
            "\"base.x\" = 1",
            "at_most_mm = 0",
            &["problem.toml:86", "constraint[1]", "none of its parameters is free"],
        ),
        ("\"base.x\" = 1, \"tool.x\" = 1", "at_least_mm = 100", &[]),
    ];
    for (terms, limits, words) in mistakes {
        let result = run(&problem(&constraint(terms, limits)), &Options::default());
        let message = result.as_ref().err().map(ToString::to_string).unwrap_or_default();
        assert_eq!(result.is_ok(), words.is_empty(), "{terms}: {message}");
        for word in words {
            assert!(message.contains(word), "{terms}: no {word:?} in {message}");
        }
    }
}

#[test]
fn checks_are_of_what_a_constraint_leaves() {
    // The links are 10 mm longer than allowed: the fit misses, and so must the checked residual.
    let problem = problem(&constraint("\"joint3.a\" = 1, \"joint4.a\" = 1", "at_most_mm = 3690"));
    let (measurements, _) = Measurements::read(&[cases().join("a-none.csv")], &problem).unwrap();
    let data = Dataset::from_measurements(&problem, measurements).unwrap();
    let trace = trace(&problem, &data, &Options::default()).unwrap();
    assert_eq!(trace.fit.active_constraints.len(), 1);
    let check = trace
        .residual_tests
        .tests
        .iter()
        .find(|check| check.name() == "reduced-chi-squared")
        .unwrap();
    let (checked, fitted) =
        (check.outcome.as_ref().unwrap().statistic, trace.fit.reduced_chi2.unwrap());
    assert!(check.failed() && fitted > 100.0, "{fitted}");
    assert!((checked / fitted - 1.0).abs() < 0.1, "{checked} of {fitted}");
}

/// Optima at the declared σ with bounds and constraints that bind slightly, or that contradict the
/// truth and leave residuals of hundreds of σ.
///
/// Active set, interior point and other starts reach the same optimum. Without second derivatives
/// the fits took 428 and more than 500 steps; with steps scaled by the columns of J, 113 and 70.
#[test]
fn bounds_against_the_truth_are_fitted_to_the_optimum() {
    let cases = [
        ("stiffness", 3.691_363_401_669e2, 10),
        ("against-the-truth", 3.173_174_880_261e4, 59),
        ("tight-geometry", 8.576_617_413_776e2, 10),
        ("constraints-against-the-truth", 4.924_858_831_617e3, 59),
        ("mild-constraints", 4.087_276_052_119e2, 20),
    ];
    for (name, optimum, most) in cases {
        let bounded = Bounded::read(name);
        let residuals = bounded.residuals();
        let fit = bounded.fit(&residuals);
        for (within, most) in
            [(BoundMethod::ActiveSet, most), (BoundMethod::InteriorPoint, most.max(20))]
        {
            let limits = (&bounded.bounds, &bounded.rows);
            let found = minimise_constrained_by(
                within,
                &fit,
                bounded.nominal(),
                limits,
                &Settings::default(),
                None::<Silent>,
            );
            let Solution { iterations, cost, termination, .. } = found;
            println!(
                "{name}, {within:?}: {termination} after {iterations} steps, cost {cost:.12e}"
            );
            assert!(termination.converged(), "{name}, {within:?}: {termination}");
            assert!((cost / optimum - 1.0).abs() < 1e-8, "{name}, {within:?}: {cost:.12e}");
            assert!(iterations <= most, "{name}, {within:?}: {iterations} steps");
        }
        // Users get the estimates at the σ estimated from the residual.
        let fitted = identify(&bounded.problem, &bounded.data, &Options::default()).unwrap();
        println!("  identified after {} steps", fitted.iterations);
        assert!(
            fitted.termination.converged() && fitted.iterations < 60,
            "{name}: {} steps",
            fitted.iterations
        );
    }
}

/// Checks that a shadow price is the gain from moving the limit.
#[test]
fn shadow_prices_are_differences_of_fits() {
    let at = |limit: f64| {
        identified(&constraint(
            "\"joint3.a\" = 1, \"joint4.a\" = 1",
            &format!("at_most_mm = {limit}"),
        ))
    };
    let (tight, loose) = (at(3739.0), at(3739.01));
    let [active] = &tight.active_constraints[..] else { panic!("{:?}", tight.active_constraints) };
    let fall = |found: &Identification| found.fitted.identification.rms.norm;
    let (price, per) = active.shadow_price.in_mm(active.unit);
    assert_eq!(per, "mm");
    let gained = 1e3 * (fall(&tight) - fall(&loose)) / 0.01;
    assert!(price > 0.0 && (gained / price - 1.0).abs() < 0.3, "{price} against {gained}");
    assert!(estimate_text(&problem(""), &tight, None).contains("Active limits and their cost"));
    assert!(
        IdentificationResult::new(&problem(""), &tight).to_json().contains("\"shadow_price\": {")
    );
}

/// Checks the example of the problem page: the wrong limit has a high price, the others a low one.
#[test]
fn the_service_arm_shows_which_limit_is_wrong() {
    let problem = Problem::read(&arms::path("problems/service-arm/problem.toml")).unwrap();
    let (data, _) = Dataset::read(&problem).unwrap();
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let price = |name: &str| estimate(&found, name).shadow_price.unwrap().rms;
    let [bench] = &found.active_constraints[..] else { panic!("{:?}", found.active_constraints) };
    assert_eq!(bench.words, "joint3.a + joint4.a ≤ 1200.1 mm");
    // 0.1 mm of length is compared with 10 % of rigidity.
    let dear = 1e-4 * price("joint4.a").min(bench.shadow_price.rms);
    let cheap = 0.1 * price("upper.EI").max(price("fore.EI"));
    assert!(dear > 20.0 * cheap, "{dear} against {cheap}");
    assert!(found.reduced_chi2 > found.chance.map(|(_, most)| most));
    let page = fs::read_to_string(arms::path("problems/service-arm/README.md")).unwrap();
    let (_, block) = page.split_once("```text\n").unwrap();
    // The bound comes from predictions in the workspace, of which the fit alone knows nothing.
    let lines = block.lines().skip_while(|line| !line.starts_with("Error bound of a prediction"));
    let bound: Vec<&str> = lines.take_while(|line| !line.is_empty()).collect();
    let bound = Some(bound.join("\n"));
    let accuracy = PredictionAccuracy { bound, contradicted: None, corrected: None };
    let printed = estimate_text(&problem, &found, Some(accuracy));
    for line in block.split("```").next().unwrap().lines() {
        assert!(printed.contains(line), "{line}");
    }
}

#[test]
fn a_constraint_on_what_the_data_do_not_tell_gives_no_certainty() {
    // Axes 2 and 3 are parallel: only joint2.d + joint3.d moves the target. By the priors alone the
    // difference would lie 0.05 mm beyond the limit.
    let parameters = "'joint2.d' = { sigma_mm = 1 }\n'joint3.d' = { sigma_mm = 1 }";
    let terms = "terms = { 'joint2.d' = 1.0, 'joint3.d' = -1.0 }";
    let problem =
        parse(&format!("{}\n[[constraint]]\n{terms}\nat_least_mm = 0.05\n", text(parameters)));
    let truth = [("joint2.d", 1.3e-3), ("joint3.d", -0.9e-3)];
    let found = fit(&problem, &simulated(&problem, &truth, [60, 30], 1));
    let finding = found.finding(FindingCode::BoundInUnidentifiedDirection).unwrap();
    assert!(finding.to_string().contains("joint2.d − joint3.d ≥"), "{finding}");
    for (name, expected) in truth {
        let of = found.estimate(name).unwrap();
        let (error, sigma) = (of.estimate - of.nominal - expected, of.std_error.unwrap());
        // Half a normal distribution of 1 σ = √2 mm from the limit on, shared by both lengths.
        assert!((sigma / 0.7e-3 - 1.0).abs() < 0.15, "{name}: {sigma}");
        assert!(error.abs() < 3.0 * sigma && of.identified < 0.7, "{name}: {error} {of:?}");
    }
}
