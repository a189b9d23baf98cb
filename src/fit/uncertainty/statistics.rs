//! Statistics of a fit: standard errors, identified shares, χ² and residual lengths.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use crate::fit::stages::active_limits::{ActiveLimit, confine};
use crate::fit::stages::fitting::FitEnd;
use crate::fit::stages::noise_model::{MAX_CHANCE_PROBABILITY, NoiseModel};
use crate::fit::stages::stage::{Stage, StageError};
use crate::fit::uncertainty::hidden_by_limit::{HiddenByLimit, hidden_by_limits};
use crate::fit::uncertainty::prices::Prices;
use crate::fit::uncertainty::residual_lengths::Lengths;
use crate::least_squares::{Loss, Uncertainty, UnidentifiableSpace};
use crate::model::Pose;

/// Largest part of an unknown in unidentifiable combinations, 0…1, at which the unknown still has a
/// standard error.
const MAX_UNIDENTIFIABLE_SHARE: f64 = 1e-3;

/// Deviation of an arm along a weak combination, as a share of the plausible size.
const REAL_DEVIATION: f64 = 0.01;
/// Largest change of an unknown, in its standard errors, by such deviations along all weak
/// combinations at which the unknown still has a standard error.
const MAX_MOVED: f64 = 0.3;

/// Statistics of the unknowns of a fit.
#[derive(Debug, Clone)]
pub(in crate::fit) struct Statistics {
    /// Standard error of each unknown: of its deviation in SI units, or of the logarithm of a
    /// stiffness or rigidity.
    pub errors: Vec<f64>,
    /// For each unknown, true if data and priors determine it: it rests on no bound, has no part in
    /// an unidentifiable combination, does not follow one, and its standard error is not refuted by
    /// the curvature of the model.
    pub determined: Vec<bool>,
    /// Identified share of each unknown, 0…1; 1 for unknowns without a prior in a provisional fit.
    pub identified: Vec<f64>,
    /// Covariance of the unknowns, in the units of `errors`, shape = (unknowns, unknowns); 0 for
    /// unknowns that are held at a bound.
    pub covariance: DMatrix<f64>,
    /// Reduced χ² of the residuals in units of the declared σ; `None` without degrees of freedom.
    /// A robust loss excludes outliers.
    pub reduced_chi2: Option<f64>,
    /// Interval in which `reduced_chi2` lies with probability 0.999 if the residual is only noise;
    /// `None` without degrees of freedom.
    pub chance: Option<(f64, f64)>,
    /// Constraints that are active (at a limit) at the end of the fit.
    pub constraints: Vec<ActiveLimit>,
    /// Shadow prices of the bounds and constraints on which the fit rests.
    pub prices: Prices,
    /// Limits that hide the uncertainty of unknowns.
    pub hidden: Vec<HiddenByLimit>,
    /// Lengths of the whitened residuals of the poses, with their scatter.
    pub lengths: Lengths,
}

impl Statistics {
    /// Computes the statistics of a stage that ended at `end`. `noise_model` is the one with which
    /// the fit converted the declared σ of positions; `None` if none is declared.
    ///
    /// With Huber's loss the covariance is that of the weighted Jacobian, times
    /// [`Loss::variance_factor`]; with absolute lengths it is that of [`sandwich`]. Active
    /// constraints confine the covariance to the directions that they leave free.
    ///
    /// # Errors
    /// Returns an error if a constraint is not finite, or the priors do not match the unknowns.
    pub fn new(
        stage: &Stage,
        end: &FitEnd,
        noise_model: Option<NoiseModel>,
    ) -> Result<Self, StageError> {
        let triangle = stage.weighted_triangle(&end.x);
        let priors = stage.prior_sigmas();
        let mut held: Vec<bool> = end.at_bound.iter().map(Option::is_some).collect();
        let constraints = stage.held(&end.x)?;
        let closed = confine(&triangle, &end.gauge.rows, &constraints, &mut held);
        let mut uncertainty = Uncertainty::of(&triangle, &priors, &closed, &held, 1.0);
        let unmoved = stage.unmoved(&end.x);
        let moved = |pose: &Pose| pose.coordinates().saturating_sub(unmoved.count());
        let coordinates = stage.poses.iter().map(moved).sum::<usize>() as f64;
        // Earlier data are rows of the triangle, but not among the coordinates.
        let effective_parameters = match stage.earlier {
            Some(_) => {
                let data = stage.linearised(&end.x, stage.loss).triangle;
                (&uncertainty.covariance * data.tr_mul(&data)).trace()
            }
            None => uncertainty.effective_parameters,
        };
        let freedom = coordinates - effective_parameters;
        let lengths = Lengths::new(
            stage,
            &end.x,
            &unmoved,
            freedom / coordinates,
            noise_model.map(|model| model.scale),
        );
        let robust = stage.loss != Loss::Squares;
        let counts = |place: usize| !robust || lengths.outlying(place).is_none();
        let kept = (0..lengths.values.len()).filter(|&place| counts(place));
        let chi2: f64 = kept.map(|place| lengths.values[place].powi(2)).sum();
        let aside = (0..lengths.values.len()).filter(|&place| !counts(place));
        let left_out = aside.map(|place| moved(&stage.poses[place]) as f64).sum::<f64>();
        if robust {
            let counts_of_poses: Vec<usize> = stage.poses.iter().map(moved).collect();
            uncertainty = if let Loss::L1 { .. } = stage.loss {
                let kept = (1.0 - left_out / coordinates.max(1.0)).max(MIN_SHARE_KEPT);
                let declared = noise_model.map_or(1.0, |model| model.scale);
                let scale = if lengths.scatter > 0.0 { lengths.scatter / declared } else { 1.0 };
                sandwich(stage, &end.x, (&counts_of_poses, scale, kept), (&closed, &held))
            } else {
                // The factor applies to the new data alone, not to the earlier ones.
                let factor =
                    stage.loss.variance_factor(&lengths.weighed, &counts_of_poses, freedom);
                let data = stage.linearised(&end.x, stage.loss).triangle / factor.sqrt();
                let data = stage.with_earlier(data, &end.x);
                Uncertainty::of(&data, &priors, &closed, &held, 1.0)
            };
        }
        let freedom = freedom - left_out;
        let prices = stage.prices(&end.x, &end.at_bound, &constraints)?;
        let bounded_errors = uncertainty.standard_errors();
        let mut hidden = Vec::new();
        if !stage.cache.is_provisional() {
            let active = (&constraints[..], &prices);
            let found = hidden_by_limits(stage, end, &triangle, active, &bounded_errors);
            hidden = found.0;
            uncertainty.covariance += found.1;
        }
        let errors = uncertainty.standard_errors();
        let is_open = |j: usize| {
            let has = |valley: &HiddenByLimit| valley.partners.contains(&j);
            hidden.iter().any(|valley| has(valley) && valley.deviation.is_infinite())
        };
        // Provisional fits do not compute identified shares.
        let visible = if priors.iter().all(Option::is_some) || stage.cache.is_provisional() {
            vec![1.0; errors.len()]
        } else {
            UnidentifiableSpace::in_triangle(&stage.data_triangle(&end.x)).visible
        };
        // The part of a variance that a bound hides is not determined by the data.
        let from_data = |j: usize| match errors[j] {
            error if error > bounded_errors[j] => (bounded_errors[j] / error).powi(2),
            _ => 1.0,
        };
        let identified = (0..errors.len())
            .map(|j| match priors[j] {
                _ if held[j] || is_open(j) => 0.0,
                Some(sigma) => (1.0 - (errors[j] / sigma).powi(2)).clamp(0.0, 1.0),
                None => visible[j].min(from_data(j)),
            })
            .collect();
        // A combination that the data determined at the start may be undetermined at the end, for
        // example if a rigidity went towards infinity.
        let gauge = stage.gauge(&end.x, &held, &constraints);
        let gauges = [&gauge, &end.gauge];
        let is_visible = |j: usize| {
            gauges.iter().all(|gauge| {
                gauge.visible[j] > 1.0 - MAX_UNIDENTIFIABLE_SHARE
                    && REAL_DEVIATION * gauge.moves[j] <= MAX_MOVED * errors[j]
            })
        };
        let determined =
            (0..errors.len()).map(|j| !held[j] && !is_open(j) && is_visible(j)).collect();
        Ok(Self {
            covariance: uncertainty.covariance,
            errors,
            determined,
            identified,
            reduced_chi2: (freedom > 0.5).then_some(chi2 / freedom),
            chance: noise_interval(freedom),
            prices,
            hidden,
            constraints,
            lengths,
        })
    }
}

/// Smallest share of residual coordinates that are not outliers which the covariance of a fit of
/// absolute lengths assumes. It keeps the covariance finite if nearly all rows are outliers.
const MIN_SHARE_KEPT: f64 = 0.1;

/// Returns the covariance of a fit of absolute lengths, A⁻¹ B A⁻¹ with A = a JᵀJ + Λ and B = b JᵀJ
/// + Λ [Huber & Ronchetti 2009, sec. 7.6]. Λ holds the precision of priors and earlier data.
///
/// Such a fit has zero residuals in some rows, whose weights do not show the uncertainty. The mean
/// curvature a and the mean square b of the slope of the loss are therefore those of normal
/// residuals with 1 σ = `scale`. Only the share `kept` of the rows contributes to a. `each` holds
/// the numbers of coordinates of the poses.
fn sandwich(
    stage: &Stage,
    at: &DVector<f64>,
    (each, scale, kept): (&[usize], f64, f64),
    (closed, held): (&DMatrix<f64>, &[bool]),
) -> Uncertainty {
    let total = each.iter().sum::<usize>().max(1) as f64;
    let (mut curvature, mut square) = (0.0, 0.0);
    for coordinates in 1..=each.iter().copied().max().unwrap_or(0) {
        let count = each.iter().filter(|count| **count == coordinates).count() * coordinates;
        if count > 0 {
            let (a, b) = stage.loss.normal_moments(coordinates, scale);
            curvature += kept * a * count as f64 / total;
            square += b * count as f64 / total;
        }
    }
    let triangle = stage.linearised(at, Loss::Squares).triangle * curvature.sqrt();
    let triangle = stage.with_earlier(triangle, at);
    let priors = stage.prior_sigmas();
    let mut uncertainty = Uncertainty::of(&triangle, &priors, closed, held, 1.0);
    let inverse = &uncertainty.covariance;
    let ratio = square / curvature;
    let mut weighted = inverse.clone();
    for (mut row, sigma) in weighted.row_iter_mut().zip(&priors) {
        row *= sigma.map_or(0.0, |sigma| sigma.powi(-2));
    }
    if stage.earlier.is_some() {
        let earlier = stage.earlier_rows(at).matrix;
        weighted += earlier.tr_mul(&(&earlier * inverse));
    }
    let from_priors = inverse * weighted;
    uncertainty.covariance = inverse * ratio + from_priors * (1.0 - ratio);
    uncertainty
}

/// Returns the interval in which χ²/ν of pure noise with ν = `freedom` degrees of freedom lies with
/// probability 0.999; `None` if ν is at most 0.5.
fn noise_interval(freedom: f64) -> Option<(f64, f64)> {
    let distribution = ChiSquared::new(freedom).ok().filter(|_| freedom > 0.5)?;
    let bound = |p: f64| distribution.inverse_cdf(p) / freedom;
    Some((bound(0.5 * MAX_CHANCE_PROBABILITY), bound(1.0 - 0.5 * MAX_CHANCE_PROBABILITY)))
}
