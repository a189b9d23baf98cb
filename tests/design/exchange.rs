//! Exchange algorithm: it never increases the criterion and ends where no single exchange helps.

use flexcal::design::{
    Candidates, Criterion, DesignError, Exchange, Extremes, Forecast, PlanOptions, Sensitivity,
    Site, plan,
};
use flexcal::measurement::Measurements;
use flexcal::model::parameter::Parameter;
use flexcal::problem::Problem;
use rayon::ThreadPoolBuilder;

use super::bench::{lunar, oriented, ranges};

const POSES: usize = 14;

fn criteria() -> [Criterion; 6] {
    let some = || vec![10, 16, 24];
    [
        Criterion::S,
        Criterion::D,
        Criterion::A,
        Criterion::E,
        Criterion::Subset(some()),
        Criterion::Each(some()),
    ]
}

/// Returns forty candidates of the lunar sampler.
fn candidates() -> (Vec<Parameter>, Sensitivity) {
    candidates_of(&lunar().0)
}

fn candidates_of(problem: &Problem) -> (Vec<Parameter>, Sensitivity) {
    let (_, truth) = lunar();
    let rows = ranges(&truth).draw(problem, 40, Extremes::Often, 5, 0);
    let site = Site::new(problem, &[&rows]).unwrap();
    let sensitivity = site.sensitivity(&rows, None);
    (site.model.parameters, sensitivity)
}

#[test]
fn it_never_worsens_and_ends_where_no_exchange_of_one_pose_helps() {
    for (criterion, problem) in criteria()
        .into_iter()
        .flat_map(|criterion| [(criterion.clone(), lunar().0), (criterion, oriented())])
    {
        let (parameters, candidates) = candidates_of(&problem);
        assert_eq!(candidates.coordinates, if problem.data.fits_orientation { 6 } else { 3 });
        let exchange = Exchange::new(&parameters, &candidates, None, POSES, &criterion).unwrap();
        let found = exchange.improve((0..POSES).collect(), |_, _| {});
        let name = criterion.as_str();
        assert!(
            found.values.windows(2).all(|pair| pair[1] <= pair[0]),
            "{name}: {:?}",
            found.values
        );
        assert!(found.value() < found.values[0] - 0.05, "{name}: {:?}", found.values);
        let mut distinct = found.chosen.clone();
        distinct.dedup();
        assert_eq!(distinct.len(), POSES, "{name}");
        assert!((exchange.value(&found.chosen) - found.value()).abs() < 1e-9, "{name}");
        // Every exchange is evaluated from scratch, not by updates.
        for place in 0..POSES {
            for other in (0..candidates.len()).filter(|other| !found.chosen.contains(other)) {
                let mut swapped = found.chosen.clone();
                swapped[place] = other;
                let value = exchange.value(&swapped);
                assert!(
                    value > found.value() - 1e-5,
                    "{name}: {other} for {place} gives {value}, not {}",
                    found.value()
                );
            }
        }
    }
}

#[test]
fn criteria_measure_the_covariance_that_a_fit_has() {
    let (parameters, candidates) = candidates();
    let wanted = [10, 16, 24];
    let sets: [Vec<usize>; 2] = [(0..POSES).collect(), (20..20 + POSES).collect()];
    let difference = |criterion: &Criterion| {
        let exchange = Exchange::new(&parameters, &candidates, None, POSES, criterion).unwrap();
        exchange.value(&sets[0]) - exchange.value(&sets[1])
    };
    let covariances =
        sets.clone().map(|set| Forecast::new(&parameters, &candidates.select(&set)).covariance);
    let part = covariances
        .clone()
        .map(|all| all.select_rows(&wanted).select_columns(&wanted).determinant().ln());
    let subset = difference(&Criterion::Subset(wanted.to_vec()));
    assert!((subset - (part[0] - part[1]) / 3.0).abs() < 1e-3, "{subset} {part:?}");
    let arm: Vec<usize> =
        (0..parameters.len()).filter(|&k| !parameters[k].site.is_placement()).collect();
    let logs = covariances
        .map(|all| arm.iter().map(|&k| all[(k, k)].ln()).sum::<f64>() / arm.len() as f64);
    let product = difference(&Criterion::S);
    assert!((product - (logs[0] - logs[1])).abs() < 1e-3, "{product} {logs:?}");
}

#[test]
fn a_plan_counts_orientations_where_they_are_fitted() {
    let (problem, (_, truth)) = (oriented(), lunar());
    let rows = Candidates::Rows(Box::new(ranges(&truth).draw(&problem, 80, Extremes::No, 3, 0)));
    let options = PlanOptions {
        poses: 10,
        criterion: &Criterion::S,
        seed: 4,
        progress: None,
        workspace: None,
    };
    let told_by = |poses: &Measurements| {
        let site = Site::new(&problem, &[poses]).unwrap();
        Forecast::new(&site.model.parameters, &site.sensitivity(poses, None))
    };
    let judged = |problem: &Problem| {
        let planned = plan(problem, &rows, None, &options).unwrap();
        let errors = told_by(&planned.poses).expected;
        let arm = errors
            .iter()
            .filter(|estimate| !estimate.is_placement)
            .filter_map(|estimate| estimate.std_error.map(f64::ln));
        arm.sum::<f64>()
    };
    let (with, without) = (judged(&problem), judged(&problem.positions_alone()));
    assert!(with < without, "{with} {without}");
}

#[test]
fn poses_that_are_given_count() {
    let (parameters, candidates) = candidates();
    let given = candidates.select(&(0..20).collect::<Vec<_>>());
    let of = |given| Exchange::new(&parameters, &candidates, given, 4, &Criterion::D).unwrap();
    assert!(of(Some(&given)).value(&[30, 31, 32, 33]) < of(None).value(&[30, 31, 32, 33]) - 0.1);
}

#[test]
fn a_plan_is_the_same_for_any_number_of_threads() {
    let (problem, truth) = lunar();
    let rows = Candidates::Rows(Box::new(ranges(&truth).draw(&problem, 80, Extremes::No, 3, 0)));
    let options = PlanOptions {
        poses: 12,
        criterion: &Criterion::S,
        seed: 4,
        progress: None,
        workspace: None,
    };
    let run = |threads: usize| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let plan = pool.install(|| plan(&problem, &rows, None, &options)).unwrap();
        (plan.poses.configurations, plan.value.to_bits())
    };
    assert_eq!(run(1), run(3));
    let nothing = plan(&problem, &rows, None, &PlanOptions { poses: 0, ..options });
    assert!(matches!(nothing, Err(DesignError::NoPoses)));
    let options = PlanOptions { poses: 81, ..options };
    let refused = plan(&problem, &rows, None, &options);
    assert!(matches!(refused, Err(DesignError::TooFewCandidates { poses: 81, candidates: 80 })));
}
