//! Tests of the processes on synthetic rows. The covariance must be positive, the gradient must
//! equal finite differences, and leaving out in closed form must equal fitting again.

use nalgebra::{DMatrix, DVector, Vector3};

use super::kernel::{Hyperparameters, covariance, variance};
use super::likelihood::MarginalLikelihood;
use super::posterior::{Posterior, Training};
use super::prior::ParameterPrior;
use super::rows::{AXES, InputSource, Inputs, Rows, SiteFunctions};

/// Number of configurations; the first is measured twice.
const CONFIGURATIONS: usize = 14;

/// Returns a pseudo-random number between −1 and 1.
fn noise(k: usize) -> f64 {
    ((12.9898 * k as f64).sin() * 43758.5453).rem_euclid(2.0) - 1.0
}

fn inputs() -> Inputs {
    Inputs {
        sources: [0, 1, 2].map(InputSource::Command).to_vec(),
        angles: vec![true, true, false],
        sites: vec![
            SiteFunctions { single: Some(0), joint: true, constant: false },
            SiteFunctions { single: Some(1), joint: true, constant: true },
        ],
        standard: vec![(0.0, 1.0); 3],
        ranges: vec![(-1.0, 1.0); 3],
    }
}

/// Creates rows with two sites, three inputs and two parameters.
fn rows() -> Rows {
    let count = CONFIGURATIONS + 1;
    let configuration: Vec<usize> = (0..count).map(|row| row.saturating_sub(1)).collect();
    let of = |row: usize, k: usize| noise(100 * configuration[row] + k);
    Rows {
        residual: DVector::from_fn(AXES * count, |k, _| 1e-4 * noise(1000 + k)),
        jacobian: DMatrix::from_fn(AXES * count, 2, |k, j| of(k / AXES, 10 + 2 * (k % AXES) + j)),
        sites: DMatrix::from_fn(2, AXES * count, |s, k| of(k / AXES, 20 + 2 * (k % AXES) + s)),
        inputs: DMatrix::from_fn(3, count, |k, row| 2.0 * of(row, k)),
        relative_sigma: (0..count).map(|row| 1.0 + 0.1 * noise(row)).collect(),
        configuration,
    }
}

fn prior() -> ParameterPrior {
    ParameterPrior {
        mean: DVector::from_vec(vec![1e-5, -2e-5]),
        spread: DVector::from_vec(vec![3e-4, 1e-1]),
        information: None,
    }
}

fn hyper() -> Hyperparameters {
    Hyperparameters {
        single: vec![6e-5, 3e-5],
        joint: vec![4e-5, 9e-5],
        constant: vec![0.0, 5e-5],
        single_lengths: vec![0.3, 0.5],
        input_lengths: vec![1.2, 0.9, 2.0],
        noise: 2e-5,
        shared_noise: 1.5e-5,
    }
}

fn all(rows: &Rows) -> Vec<usize> {
    (0..rows.len()).collect()
}

#[test]
fn the_covariance_is_positive_and_its_diagonal_the_variance() {
    let (rows, hyper) = (rows(), hyper());
    let matrix = covariance(&hyper, &inputs(), &rows, &rows);
    assert!((&matrix - matrix.transpose()).amax() <= 1e-20);
    let least = matrix.clone().symmetric_eigenvalues().min();
    assert!(least > -1e-12 * matrix.amax(), "{least}");
    for row in 0..rows.len() {
        let block = matrix.view((AXES * row, AXES * row), (AXES, AXES));
        assert!((block - variance(&hyper, &rows, row)).amax() < 1e-18);
    }
}

#[test]
fn the_gradient_of_the_likelihood_is_its_slope() {
    let (rows, inputs, prior) = (rows(), inputs(), prior());
    let likelihood = MarginalLikelihood::new((&rows, &inputs), &prior, true, 1e-4).unwrap();
    let at = likelihood.start([0.4, 0.4]).map_with_location(|k, _, value| value + 0.2 * noise(k));
    let (value, gradient) = likelihood.value_and_gradient(&at).unwrap();
    assert!(value.is_finite() && gradient.len() == likelihood.len());
    for k in 0..at.len() {
        let beside = |step: f64| {
            let mut moved = at.clone();
            moved[k] += step;
            likelihood.value_and_gradient(&moved).unwrap().0
        };
        let slope = (beside(1e-5) - beside(-1e-5)) / 2e-5;
        assert!(
            (slope - gradient[k]).abs() < 1e-5 * (1.0 + slope.abs()),
            "{k}: {slope} {gradient}"
        );
    }
}

#[test]
fn leaving_out_in_closed_form_is_fitting_again() {
    let (rows, inputs, prior, hyper) = (rows(), inputs(), prior(), hyper());
    let training = Training::new((&rows, &inputs), &prior, &hyper, &all(&rows)).unwrap();
    let single = training.without_each(&rows.configuration, &all(&rows)).unwrap();
    let block: Vec<usize> = rows.configuration.iter().map(|predicted| predicted % 4).collect();
    let blocks = training.without_each(&block, &all(&rows)).unwrap();
    let check = |found: &super::posterior::LeftOut,
                 left_out: &dyn Fn(usize) -> bool,
                 row: usize| {
        let kept: Vec<usize> = all(&rows).into_iter().filter(|&row| !left_out(row)).collect();
        let others = rows.select(&kept);
        let again = Training::new((&others, &inputs), &prior, &hyper, &all(&others)).unwrap();
        let predicted = again.posterior.at(&rows.select(&[row]))[0];
        let measured = Vector3::from_fn(|axis, _| rows.residual[AXES * row + axis]);
        assert!((measured - predicted.mean - found.error).norm() < 1e-9, "{row}");
        let noise = (hyper.noise * rows.relative_sigma[row]).powi(2) + hyper.shared_noise.powi(2);
        let expected = predicted.covariance.trace() + AXES as f64 * noise;
        assert!(
            (found.covariance.trace() / expected - 1.0).abs() < 1e-4,
            "{row}: {} {expected}",
            found.covariance.trace()
        );
    };
    for row in all(&rows) {
        let configuration = rows.configuration[row];
        check(&single[row], &|other| rows.configuration[other] == configuration, row);
        check(&blocks[row], &|other| block[other] == block[row], row);
    }
}

#[test]
fn far_from_all_rows_only_the_parameters_are_corrected() {
    let (rows, inputs, prior) = (rows(), inputs(), prior());
    let hyper = Hyperparameters {
        single_lengths: vec![0.05; 2],
        input_lengths: vec![0.05; 3],
        constant: vec![0.0; 2],
        ..hyper()
    };
    let posterior = Training::new((&rows, &inputs), &prior, &hyper, &all(&rows)).unwrap().posterior;
    let mut distant_pose = rows.select(&[3]);
    distant_pose.inputs.fill(2.9);
    let predicted = posterior.at(&distant_pose)[0];
    assert!(
        (predicted.covariance.trace() - predicted.prior) > -1e-6 * predicted.prior,
        "the prior is back"
    );
    let parameters = &distant_pose.jacobian * posterior.parameters();
    assert!((predicted.mean - Vector3::from_column_slice(parameters.as_slice())).norm() < 1e-9);
    assert!(
        super::scores::applied_share(predicted.covariance.trace(), predicted.prior).abs() < 1e-15
    );
}

#[test]
fn weights_of_the_centres_restore_a_posterior() {
    let (rows, inputs, prior, hyper) = (rows(), inputs(), prior(), hyper());
    let predicted =
        Training::new((&rows, &inputs), &prior, &hyper, &[0, 2, 5, 9, 11]).unwrap().posterior;
    let again = Posterior::restored(
        (hyper.clone(), inputs.clone()),
        (predicted.inducing.clone(), prior.clone()),
        (predicted.factor.clone(), predicted.kernel_weights(), predicted.parameters()),
    )
    .unwrap();
    for (a, b) in predicted.at(&rows).iter().zip(again.at(&rows)) {
        assert!((a.mean - b.mean).norm() < 1e-12 && (a.covariance - b.covariance).amax() < 1e-16);
    }
}

#[test]
fn known_distances_count_as_rows_that_no_joint_error_moves() {
    let (rows, inputs, prior, hyper) = (rows(), inputs(), prior(), hyper());
    let known = 4.0;
    let place = |row: usize| AXES * row..AXES * (row + 1);
    let mut more = rows.select(&[all(&rows), vec![2]].concat());
    let last = more.len() - 1;
    let numbers = |seed: usize| (0..AXES).map(move |axis| noise(seed + axis));
    more.sites.columns_range_mut(place(last)).fill(0.0);
    more.relative_sigma[last] = known;
    more.configuration[last] = CONFIGURATIONS;
    let of = |row| rows.configuration.iter().position(|&found| found == row).unwrap();
    let residual = DVector::from_iterator(AXES, numbers(5000).map(|value| 1e-4 * value));
    let jacobian = DMatrix::from_iterator(AXES, 2, numbers(6000).chain(numbers(7000)));
    more.residual.rows_range_mut(place(last)).copy_from(&residual);
    more.jacobian.rows_range_mut(place(last)).copy_from(&jacobian);
    // A row of its own configuration has the noise of the row and that of the configuration.
    let sigma = (hyper.noise * known).hypot(hyper.shared_noise);
    let with = prior.clone().with_information(&(jacobian / sigma), &(residual / sigma));
    let centres = [of(0), of(4), of(8)];
    let posterior = |rows: &Rows, prior: &ParameterPrior| {
        Training::new((rows, &inputs), prior, &hyper, &centres).unwrap().posterior
    };
    let (among_rows, in_prior) = (posterior(&more, &prior), posterior(&rows, &with));
    for (a, b) in among_rows.at(&rows).iter().zip(in_prior.at(&rows)) {
        assert!((a.mean - b.mean).norm() < 1e-12, "{} {}", a.mean, b.mean);
        assert!((a.covariance - b.covariance).amax() < 1e-9 * a.covariance.amax());
    }
    // The likelihood of the rows given the distances is that of all over that of the distances.
    let value = |rows: &Rows, prior: &ParameterPrior, noise: f64| {
        let likelihood = MarginalLikelihood::new((rows, &inputs), prior, true, 1e-4).unwrap();
        let mut at = likelihood.start([0.4, 0.4]);
        let count = at.len();
        at[count - 2] = hyper.noise.ln();
        at[count - 1] = hyper.shared_noise.ln();
        at[0] += noise;
        likelihood.value_and_gradient(&at).unwrap().0
    };
    let difference = |noise| value(&more, &prior, noise) - value(&rows, &with, noise);
    assert!((difference(0.0) - difference(0.7)).abs() < 1e-9);
}

#[test]
fn rows_in_turn_say_what_all_rows_say_at_once() {
    let (rows, inputs, prior, hyper) = (rows(), inputs(), prior(), hyper());
    // The centres are among the first rows, so that both ways have the same inducing variables.
    let centres = [0, 2, 5, 7];
    let (first, later): (Vec<usize>, Vec<usize>) =
        all(&rows).into_iter().partition(|row| rows.configuration[*row] < 9);
    let knots =
        |rows: &Rows| Training::new((rows, &inputs), &prior, &hyper, &centres).unwrap().posterior;
    let (at_once, before) = (knots(&rows), knots(&rows.select(&first)));
    let before = Posterior { inducing: at_once.inducing.clone(), ..before };
    // Knots depend on the rows, so the first rows are conditioned on again with those of all rows.
    let n = at_once.factor.nrows();
    let none = Posterior {
        factor: DMatrix::identity(n, n),
        inverse: at_once.inverse.clone(),
        inverse_factor: DMatrix::identity(n, n),
        weights: DVector::zeros(n),
        ..before
    };
    let first = Training::continued(&none, &rows.select(&first)).unwrap();
    let both = Training::continued(&first.posterior, &rows.select(&later)).unwrap();
    for (a, b) in at_once.at(&rows).iter().zip(both.posterior.at(&rows)) {
        assert!((a.mean - b.mean).norm() < 1e-12, "{} {}", a.mean, b.mean);
        assert!((a.covariance - b.covariance).amax() < 1e-6 * a.covariance.amax());
    }
    // Each later row is predicted by the earlier rows and the other later ones.
    let left_out = both.without_each(&rows.select(&later).configuration, &[0]).unwrap().remove(0);
    let others = rows.select(&later[1..]);
    let without = Training::continued(&first.posterior, &others).unwrap().posterior;
    let predicted = without.at(&rows.select(&later[..1]))[0];
    let measured = Vector3::from_fn(|axis, _| rows.residual[AXES * later[0] + axis]);
    assert!((measured - predicted.mean - left_out.error).norm() < 1e-12);
}
