//! Fit of a problem, with its linear neighbourhood.

use crate::select::settings::{MAX_OUTLIER_SHARE, OUTLIER_SQUARED_DISTANCE};
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::data::Data;
use super::neighbourhood::{Derivatives, HatBlocks, LinearNeighbourhood, Linearised, Unknowns};
use crate::fit::{
    Identification, IdentifyError, Noise, Options, Placement, identify, selection_of_outliers,
};
use crate::least_squares::MANY_UNKNOWNS;
use crate::model::parameter::{BeamField, ParameterSite, Regressor};
use crate::model::{Model, Pose};
use crate::problem::{Effect, EffectDeclaration, Problem};

/// Factor on σ that gives an outlier practically no weight.
const SIGMA_FACTOR_OF_OUTLIERS: f64 = 1e6;

/// Median of |r|² for one, two and three normal coordinates with unit variance.
const MEDIAN_OF_SQUARES: [f64; 3] = [0.455, 1.386, 2.366];
/// Maximum number of concentration steps of the search for outliers (least trimmed squares).
const MAX_CONCENTRATION_STEPS: usize = 10;
/// Largest work of one least-squares solve, in poses × unknowns², at which outliers are searched
/// again. Otherwise those of the previous fit are kept, because a search takes about ten solves.
const MAX_OUTLIER_WORK: f64 = 2e8;
/// Largest root mean square difference of the residuals, in units of σ, between a fit that was
/// stopped early and the converged one, at which evidence about the former remains valid.
const MAX_UNSETTLED: f64 = 0.05;
/// Fraction of the noise variance that is added to the residual's covariance 1 − H of each pose, so
/// that it stays invertible along directions that the pose alone determines.
const MIN_VARIANCE_OF_POSE: f64 = 1e-3;

/// Problem with its effects, fitted to the identification rows.
#[derive(Clone)]
pub(super) struct Fitted {
    /// Problem that was fitted, with the effects found so far declared in it.
    pub problem: Problem,
    /// Model of the problem.
    pub model: Model,
    /// Identification of `problem` from the identification rows.
    pub found: Identification,
    /// Indices in the model of the fitted parameters that are not at a bound.
    pub unknowns: Vec<usize>,
    /// Coefficients of the active constraints, shape = (constraints, unknowns).
    pub active: DMatrix<f64>,
    /// Standard deviation (1 σ) of a measured coordinate in rows without a declared σ \[m\].
    pub sigma: f64,
    /// Table indices of the outliers, which get practically no weight in the linear neighbourhood
    /// and in the evidence.
    pub set_aside: Vec<usize>,
    /// Linear neighbourhood at the identification rows, computed on first use.
    at_rows: OnceLock<Arc<LinearNeighbourhood>>,
    /// Derivatives of the residuals at the end of the fit, cached if there are many unknowns.
    derivatives: Arc<Mutex<Option<Arc<Derivatives>>>>,
}

impl Fitted {
    /// Fits `problem` to the identification rows.
    pub fn new(problem: Problem, data: &Data, options: &Options) -> Result<Self, IdentifyError> {
        let found = identify(&problem, data.dataset, options)?;
        Self::of(problem, data, found)
    }

    /// Fits another problem, such as one with more effects, to the same rows. If a search for
    /// outliers would take too long, the outliers of this fit are kept.
    pub fn fit_other(
        &self,
        problem: Problem,
        data: &Data,
        options: &Options,
    ) -> Result<Self, IdentifyError> {
        let found = identify(&problem, data.dataset, options)?;
        Self::with_outliers_of(Some(self), problem, data, found)
    }

    /// Creates the fitted problem from an existing fit to the identification rows.
    pub fn of(problem: Problem, data: &Data, found: Identification) -> Result<Self, IdentifyError> {
        Self::with_outliers_of(None, problem, data, found)
    }

    /// Creates the fitted problem from a fit `found`. The outliers of `previous` are kept if a
    /// search for outliers would take too long.
    fn with_outliers_of(
        previous: Option<&Self>,
        problem: Problem,
        data: &Data,
        found: Identification,
    ) -> Result<Self, IdentifyError> {
        let placement = Placement::of(data.measurements);
        let model =
            found.strategy.model(Model::new(&problem, &placement.bases, &placement.targets)?);
        let free = |&k: &usize| {
            let name = &model.parameters[k].name;
            found.unknowns.contains(name) && found.estimates[k].at_bound.is_none()
        };
        let unknowns: Vec<usize> = (0..model.parameters.len()).filter(free).collect();
        let coefficient = |i: usize, j: usize| -> f64 {
            let terms = &model.constraints[found.active_constraints[i].constraint].terms;
            terms.iter().filter(|(k, _)| *k == unknowns[j]).map(|(_, of_term)| of_term).sum()
        };
        let active = DMatrix::from_fn(found.active_constraints.len(), unknowns.len(), coefficient);
        let sigma = match found.noise {
            Noise::Estimated(sigma) => sigma,
            // If the declared σ is too large, it is reduced; otherwise the priors would decide
            // everything.
            Noise::Declared | Noise::Unknown => {
                found.sigma_scale * placement.sigma(data.measurements, data.rows(), &problem)
            }
        };
        let outliers_of_fit: Vec<usize> =
            found.outliers.iter().map(|outlier| outlier.row).collect();
        let (set_aside, at_rows, derivatives) = (Vec::new(), OnceLock::new(), Arc::default());
        let mut fitted = Self {
            problem,
            model,
            found,
            unknowns,
            active,
            sigma,
            set_aside,
            at_rows,
            derivatives,
        };
        let work = data.rows().len() as f64 * (fitted.unknowns.len() as f64).powi(2);
        fitted.set_aside = match previous {
            // A robust loss has found the outliers. If a cause selects them, the search must
            // explain these rows, so none is left out.
            _ if fitted.problem.robust.is_some() => {
                let found = &fitted.found.outliers;
                let cause = selection_of_outliers(data.measurements, data.rows(), found);
                if cause.is_some() { Vec::new() } else { outliers_of_fit }
            }
            _ if work <= MAX_OUTLIER_WORK => find_outliers(&fitted, data),
            Some(previous) => previous.set_aside.clone(),
            None => outliers_of_fit,
        };
        if !fitted.set_aside.is_empty() {
            fitted.derivatives = Arc::default();
        }
        Ok(fitted)
    }

    /// Returns this fit, continued until it converges if it was stopped early or is provisional.
    pub fn converge(self, data: &Data, options: &Options) -> Result<Self, IdentifyError> {
        if self.found.termination.converged() && !self.found.provisional {
            return Ok(self);
        }
        let continuing = if self.found.provisional {
            self.warm_started_options(options, true)
        } else {
            self.options_from_estimates(options)
        };
        self.fit_other(self.problem.clone(), data, &continuing)
    }

    /// Returns true if the residuals of another fit of the same effects differ by more than
    /// [`MAX_UNSETTLED`] σ in root mean square.
    pub fn differs_from(&self, other: &Self, data: &Data) -> bool {
        let [here, there] = [self, other].map(|fitted| fitted.errors(data, data.rows()));
        let squares: f64 = here.iter().zip(&there).map(|(a, b)| (a - b).norm_squared()).sum();
        squares.sqrt() > MAX_UNSETTLED * self.sigma * (3.0 * here.len() as f64).sqrt()
    }

    /// Returns options for a fit of the same problem that starts where this one ended and does not
    /// search for influential rows.
    pub fn options_from_estimates(&self, options: &Options) -> Options {
        let values =
            self.found.estimates.iter().map(|estimate| (estimate.name.clone(), estimate.estimate));
        Options { start: values.collect(), influential_rows: false, ..options.clone() }
    }

    /// Returns options for the next fit with the state that it reuses: the registered nominal arm
    /// and the derivatives at the optimum. If `alike` is true, the next problem has nearly the same
    /// effects, and the noise scale is reused, too.
    pub fn warm_started_options(&self, options: &Options, alike: bool) -> Options {
        let derivatives = self.derivatives.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let at = (self.model.parameters.as_slice(), &self.found.x);
        let linear_model =
            derivatives.map(|derivatives| derivatives.linear_model(at, &self.unknowns));
        let warm_start = self.found.warm_start(alike).with_linear_model(linear_model);
        Options { warm_start: Some(Arc::new(warm_start)), ..self.options_from_estimates(options) }
    }

    /// Returns the problem with other effects declared.
    pub fn with_effects(&self, effects: &[Effect]) -> Problem {
        let mut problem = self.problem.clone();
        let location = problem.data.location.clone();
        problem.effects = effects
            .iter()
            .map(|effect| EffectDeclaration { effect: effect.clone(), location: location.clone() })
            .collect();
        problem
    }

    /// Returns the effects of the fitted problem, declared ones included.
    pub fn effects(&self) -> Vec<Effect> {
        self.problem.effects.iter().map(|declared| declared.effect.clone()).collect()
    }

    /// Returns the poses of the table rows with the indices `rows`.
    pub fn poses<'a>(&self, data: &Data<'a>, rows: &[usize]) -> Vec<Pose<'a>> {
        let mut poses = Placement::of(data.measurements).poses(data.measurements, rows, self.sigma);
        if data.measurements.sigma.is_some() {
            for pose in &mut poses {
                pose.sigma *= self.found.sigma_scale;
            }
        }
        poses
    }

    /// Returns measured − predicted of the rows with the indices `rows`, measuring frame \[m\].
    pub fn errors(&self, data: &Data, rows: &[usize]) -> Vec<Vector3<f64>> {
        self.model.residuals(self.poses(data, rows), &self.found.x)
    }

    /// Returns the model linearised at the fit in the identification rows, with the sites at which
    /// `effects` enter.
    ///
    /// With many unknowns, the derivatives are cached for the next call. `data` must be those that
    /// were fitted.
    pub fn linearised<'a>(&'a self, data: &Data<'a>, effects: &[Effect]) -> Linearised<'a> {
        if self.unknowns.len() < MANY_UNKNOWNS {
            return self.linearised_at(data, data.rows(), effects);
        }
        let kept = || self.derivatives.lock().unwrap_or_else(PoisonError::into_inner);
        let cached = kept().clone();
        let found = self.linearised_reusing(cached, (data, data.rows()), effects, &[]);
        *kept() = Some(found.derivatives());
        found
    }

    /// Returns the model linearised at the fit in other rows.
    pub fn linearised_at<'a>(
        &'a self,
        data: &Data<'a>,
        rows: &[usize],
        effects: &[Effect],
    ) -> Linearised<'a> {
        self.linearised_with(data, rows, effects, &[])
    }

    /// Returns the model linearised at the fit in some rows, with the sites of `effects` and the
    /// parameter sites `slots`.
    pub fn linearised_with<'a>(
        &'a self,
        data: &Data<'a>,
        rows: &[usize],
        effects: &[Effect],
        slots: &[ParameterSite],
    ) -> Linearised<'a> {
        self.linearised_reusing(None, (data, rows), effects, slots)
    }

    fn linearised_reusing<'a>(
        &'a self,
        cached: Option<Arc<Derivatives>>,
        (data, rows): (&Data<'a>, &[usize]),
        effects: &[Effect],
        slots: &[ParameterSite],
    ) -> Linearised<'a> {
        let mut poses = self.poses(data, rows);
        let aside = poses.iter_mut().zip(rows).filter(|(_, row)| self.set_aside.contains(row));
        aside.for_each(|(pose, _)| pose.sigma *= SIGMA_FACTOR_OF_OUTLIERS);
        Linearised::new(
            (&self.problem, cached),
            &self.model,
            poses,
            &self.unknowns,
            &self.found.x,
            (effects, slots),
        )
    }

    /// Returns the linear neighbourhood of the fit at the poses of `linearised`.
    pub fn neighbourhood(&self, linearised: &Linearised) -> LinearNeighbourhood {
        self.neighbourhood_without(linearised, &[])
    }

    /// Returns the linear neighbourhood of the fit at the identification rows, computed once.
    pub fn neighbourhood_at_rows(&self, data: &Data) -> Arc<LinearNeighbourhood> {
        if let Some(cached) = self.at_rows.get() {
            return Arc::clone(cached);
        }
        let new = Arc::new(self.neighbourhood(&self.linearised(data, &[])));
        Arc::clone(self.at_rows.get_or_init(|| new))
    }

    /// Returns this fit with the table rows `rows`, and no others, treated as outliers. The
    /// estimates stay the same; the linear neighbourhood changes.
    pub fn with_outliers(&self, rows: Vec<usize>) -> Self {
        Self {
            set_aside: rows,
            at_rows: OnceLock::new(),
            derivatives: Arc::default(),
            ..self.clone()
        }
    }

    /// Returns the linear neighbourhood with the weight that priors had in the fit, relative to the
    /// data. The fit may have estimated a larger σ than declared, which makes priors stronger.
    pub fn neighbourhood_as_fitted(&self, linearised: Linearised) -> LinearNeighbourhood {
        let unknowns =
            self.unknowns_without(&linearised, &[], self.found.noise_factor.max(1.0).sqrt());
        let empty = linearised.empty();
        let (columns, residual) = linearised.into_fitted();
        LinearNeighbourhood::in_place_of(columns, residual, &unknowns, empty)
    }

    /// Returns the unknowns except those with the indices `without`, followed by the relaxed
    /// coefficients; 1 σ of each prior is divided by `weight`.
    fn unknowns_without(
        &self,
        linearised: &Linearised,
        without: &[usize],
        weight: f64,
    ) -> Unknowns {
        let kept: Vec<usize> = (0..self.unknowns.len()).filter(|j| !without.contains(j)).collect();
        let relaxed = linearised.relaxed().iter().copied();
        let sigmas = kept.iter().map(|&j| self.model.parameters[self.unknowns[j]].sigma);
        Unknowns {
            x: kept
                .iter()
                .map(|&j| self.found.x[self.unknowns[j]])
                .chain(relaxed.clone().map(|_| 0.0))
                .collect(),
            priors: sigmas.chain(relaxed).map(|sigma| Some(sigma? / weight)).collect(),
            active: self.active.select_columns(&kept),
        }
    }

    /// Returns the linear neighbourhood of the fit without the unknowns with the indices `without`,
    /// whose values become 0: the residual then contains their contribution.
    pub fn neighbourhood_without(
        &self,
        linearised: &Linearised,
        without: &[usize],
    ) -> LinearNeighbourhood {
        let (columns, n) = (linearised.fitted(), self.unknowns.len());
        let mut residual = linearised.residual().clone();
        // A parameter inside a formula, or the position of an added mass, has no influence if the
        // coefficient by which it is multiplied is zero.
        let is_position_of_mass = |site: ParameterSite| {
            matches!(site, ParameterSite::Beam { field: BeamField::AddedAt, .. })
        };
        let is_inside = |&&j: &&usize| {
            let parameter = &self.model.parameters[self.unknowns[j]];
            is_position_of_mass(parameter.site) || parameter.regressor == Regressor::Inner
        };
        for &j in without.iter().filter(|j| !is_inside(j)) {
            residual.axpy(-self.found.x[self.unknowns[j]], &columns.column(j), 1.0);
        }
        let unknowns = self.unknowns_without(linearised, without, 1.0);
        if without.is_empty() {
            return LinearNeighbourhood::new(columns, &residual, &unknowns, linearised.empty());
        }
        let kept: Vec<usize> =
            (0..columns.ncols()).filter(|j| *j >= n || !without.contains(j)).collect();
        LinearNeighbourhood::new(
            &columns.select_columns(&kept),
            &residual,
            &unknowns,
            linearised.empty(),
        )
    }

    /// Returns the indices of an effect's parameters among the unknowns.
    pub fn unknowns_of(&self, effect: &Effect) -> Vec<usize> {
        let place = |k: &usize| self.unknowns.iter().position(|unknown| unknown == k);
        self.parameters_of(effect).iter().filter_map(place).collect()
    }

    /// Returns the indices of an effect's parameters in the model.
    pub fn parameters_of(&self, effect: &Effect) -> Vec<usize> {
        let parameters = effect.parameters(&self.problem);
        let is_of_effect = |&k: &usize| {
            parameters.iter().any(|parameter| parameter.name == self.model.parameters[k].name)
        };
        (0..self.model.parameters.len()).filter(is_of_effect).collect()
    }
}

/// Returns the table indices of the identification rows that are outliers, judged in the linear
/// neighbourhood of the fit without them.
///
/// The rows with the largest residuals, as many as may be outliers, are left out repeatedly until
/// they stay the same. This is one start of least trimmed squares [Rousseeuw and Van Driessen
/// 2006]. Then only rows beyond [`OUTLIER_SQUARED_DISTANCE`] are left out.
fn find_outliers(fitted: &Fitted, data: &Data) -> Vec<usize> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a part of a count"
    )]
    let allowed = |count: usize| (MAX_OUTLIER_SHARE * count as f64) as usize;
    let worst = |squares: &[f64], count: usize| -> Vec<usize> {
        let mut order: Vec<usize> = (0..squares.len()).collect();
        order.sort_by(|&a, &b| squares[b].total_cmp(&squares[a]));
        order.truncate(count);
        order.sort_unstable();
        order
    };
    // The concentration steps use the rows of the evidence, the final steps all rows.
    let (rows, subset) = (data.rows(), data.evidence_rows());
    let is_whole = rows.len() == subset.len();
    let mut linearised = if is_whole {
        fitted.linearised(data, &[])
    } else {
        fitted.linearised_at(data, &subset, &[])
    };
    let mut of_all = HatBlocks::new(fitted.neighbourhood(&linearised));
    let mut aside = Vec::new();
    for _ in 0..MAX_CONCENTRATION_STEPS {
        let squares = squared_distances(fitted, (&linearised, &of_all), &aside);
        let next = worst(&squares, allowed(subset.len()));
        if next == aside {
            break;
        }
        aside = next;
    }
    if !is_whole {
        linearised = fitted.linearised(data, &[]);
        of_all = HatBlocks::new(fitted.neighbourhood(&linearised));
    }
    let kept: BTreeSet<usize> =
        (0..subset.len()).filter(|k| !aside.contains(k)).map(|k| subset[k]).collect();
    let mut aside: Vec<usize> = (0..rows.len()).filter(|&k| !kept.contains(&rows[k])).collect();
    for _ in 0..MAX_CONCENTRATION_STEPS {
        let squares = squared_distances(fitted, (&linearised, &of_all), &aside);
        let outlier_count =
            squares.iter().filter(|square| **square > OUTLIER_SQUARED_DISTANCE).count();
        if outlier_count > allowed(rows.len()) {
            return Vec::new();
        }
        let next = worst(&squares, outlier_count);
        if next == aside {
            break;
        }
        aside = next;
    }
    aside.into_iter().map(|k| rows[k]).collect()
}

/// Returns the squared distance of each pose from the fit without the poses `aside`, in units of
/// the variance of one coordinate, given the fit to all poses.
///
/// The squared distance is rᵀ C⁻¹ r divided by the scatter: the median over all poses relative to
/// that of normal residuals, at least 1 if σ is declared. C = 1 − H for a pose in the fit, C = 1 +
/// H for one that was left out.
fn squared_distances(
    fitted: &Fitted,
    (linearised, of_all): (&Linearised, &HatBlocks),
    aside: &[usize],
) -> Vec<f64> {
    let (hats, left) = of_all.without(aside, 1.0 - SIGMA_FACTOR_OF_OUTLIERS.powi(-2));
    let square = |pose: usize| {
        let r = left.fixed_rows::<3>(3 * pose).into_owned();
        let hat = hats[pose];
        let covariance = if aside.binary_search(&pose).is_ok() {
            Matrix3::identity() + hat
        } else {
            Matrix3::identity() * (1.0 + MIN_VARIANCE_OF_POSE) - hat
        };
        covariance.cholesky().map_or(0.0, |factor| r.dot(&factor.solve(&r)))
    };
    let squares: Vec<f64> = (0..left.len() / 3).map(square).collect();
    let usual = |pose: usize| MEDIAN_OF_SQUARES[linearised.coordinates(pose) - 1];
    let ratios = squares.iter().enumerate().map(|(pose, square)| square / usual(pose));
    let mut ratios: Vec<f64> = ratios.collect();
    ratios.sort_by(|a, b| b.total_cmp(a));
    // The scatter is at least the declared σ; relative to rounding errors alone, every row would
    // be an outlier.
    let least = if fitted.found.noise == Noise::Declared { 1.0 } else { 0.0 };
    let scatter = ratios.get(ratios.len() / 2).copied().unwrap_or(0.0).max(least);
    squares.into_iter().map(|square| if scatter > 0.0 { square / scatter } else { 0.0 }).collect()
}
