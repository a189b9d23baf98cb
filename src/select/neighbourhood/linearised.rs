//! Columns of every effect without fitting it: the derivative at the effect's site, times its
//! regressor.

use std::sync::Arc;

use nalgebra::{DMatrix, DMatrixView, DVector, DVectorView};

use crate::fit::Unmoved;
use crate::least_squares::{MANY_UNKNOWNS, jacobian_and_residual};
use crate::model::effect::Term;
use crate::model::parameter::{BeamField, Parameter, ParameterSite, Regressor};
use crate::model::{LinearModel, Model, Pose, PoseResiduals};
use crate::numeric::parallel;
use crate::problem::{Effect, Problem};

/// Mass at which the derivative with respect to the position of an added mass is taken \[kg\]. With
/// a mass of 0, the position would have no influence; this mass is too small to change anything
/// else.
const MASS_OF_DERIVATIVE: f64 = 1e-4;
/// Number of poses that are first examined for unmoved directions. Most arms move in every
/// direction within so few poses.
const MAX_POSES_OF_FIRST_PASS: usize = 32;

/// Model linearised at some poses, with derivatives at every site where effects may enter.
#[derive(Clone)]
pub(crate) struct Linearised<'a> {
    problem: &'a Problem,
    poses: Arc<Vec<Pose<'a>>>,
    derivatives: Arc<Derivatives>,
    /// Number of directions of the measuring frame in which no fitted parameter moves any pose.
    unmoved: usize,
}

/// Derivatives and residual of a model in some poses, which later linearisations reuse.
#[derive(Debug, Clone)]
pub(in crate::select) struct Derivatives {
    /// Columns of the fitted parameters, followed by those of relaxed parameters, shape = (3 N, n).
    fitted: Arc<DMatrix<f64>>,
    /// Whitened residual, length 3 N.
    residual: Arc<DVector<f64>>,
    /// Standard deviation (1 σ) of a measured coordinate of each pose \[m\].
    sigma: Vec<f64>,
    /// Prior 1 σ of each relaxed parameter, the difference of two stiffnesses that the problem
    /// declares equal; `None` without a prior.
    relaxed: Vec<Option<f64>>,
    /// Sites that have a column, each with the column's index: first the columns of `fitted`, then
    /// those of `others`.
    places: Vec<(ParameterSite, usize)>,
    /// Columns of sites at which no parameter is fitted, each of length 3 N.
    others: Vec<Arc<DVector<f64>>>,
}

impl Derivatives {
    /// Returns the derivatives of the parameters `unknowns` as a linear model, which the next fit
    /// reuses if it starts at the same point. `at` holds all parameters and that point.
    pub fn linear_model(
        &self,
        at: (&[Parameter], &DVector<f64>),
        unknowns: &[usize],
    ) -> LinearModel {
        LinearModel::new(
            at,
            unknowns,
            self.sigma.clone(),
            (Arc::clone(&self.fitted), Arc::clone(&self.residual)),
        )
    }

    fn column(&self, index: usize) -> DVectorView<'_, f64> {
        match index.checked_sub(self.fitted.ncols()) {
            Some(other) => self.others[other].as_view(),
            None => self.fitted.column(index),
        }
    }

    /// Appends columns of additional sites.
    fn extend(&mut self, slots: &[(ParameterSite, f64)], columns: DMatrixView<f64>) {
        let first = self.fitted.ncols() + self.others.len();
        self.places.extend(slots.iter().enumerate().map(|(k, &(site, _))| (site, first + k)));
        self.others.extend(columns.column_iter().map(|column| Arc::new(column.into_owned())));
    }
}

impl<'a> Linearised<'a> {
    /// Linearises `model` about its full parameter vector `x`, with the parameters `unknowns`
    /// fitted, at the sites of `effects` and at `places`. Derivatives in `cached` are reused.
    pub fn new(
        (problem, cached): (&'a Problem, Option<Arc<Derivatives>>),
        model: &Model,
        poses: impl Into<Arc<Vec<Pose<'a>>>>,
        unknowns: &[usize],
        x: &DVector<f64>,
        (effects, places): (&[Effect], &[ParameterSite]),
    ) -> Self {
        let poses = poses.into();
        let mut slots: Vec<(ParameterSite, f64)> = places.iter().map(|&site| (site, 0.0)).collect();
        for Term { site, nominal, .. } in effects.iter().flat_map(|effect| effect.terms(problem)) {
            if !slots.iter().any(|(other, _)| *other == site) {
                slots.push((site, nominal));
            }
        }
        // Bending stiffnesses about y and z that the problem declares equal may differ here,
        // because such a difference is not to be attributed to another effect.
        let shared = |&k: &usize| match model.parameters[k].site {
            ParameterSite::Beam { joint, field: BeamField::Bending } => {
                let site = ParameterSite::Beam { joint, field: BeamField::Anisotropy };
                Some((site, model.parameters[k].sigma))
            }
            _ => None,
        };
        let (shared, relaxed): (Vec<(ParameterSite, f64)>, Vec<Option<f64>>) =
            unknowns.iter().filter_map(shared).map(|(site, sigma)| ((site, 0.0), sigma)).unzip();
        // A site at which a parameter is fitted already has a column.
        let fitted_at = |&(site, _): &(ParameterSite, f64)| {
            let is_it = |&k: &usize| {
                model.parameters[k].site == site && model.parameters[k].regressor.is_constant()
            };
            unknowns.iter().position(is_it).map(|column| (site, column))
        };
        let at_fitted: Vec<(ParameterSite, usize)> = slots.iter().filter_map(fitted_at).collect();
        slots.retain(|place| fitted_at(place).is_none());
        let first = model.parameters.len();
        // One pass computes the columns of parameters and of parameter sites, and the residual.
        let pass = |parameters: &[usize], slots: &[(ParameterSite, f64)]| {
            let probing = model.with_springs_of(effects).with_probes(slots);
            let mut at = x.clone().resize_vertically(first + slots.len(), 0.0);
            for (index, (site, _)) in slots.iter().enumerate() {
                if matches!(site, ParameterSite::Beam { field: BeamField::AddedMass, .. }) {
                    at[first + index] = MASS_OF_DERIVATIVE;
                }
            }
            let probed: Vec<usize> =
                parameters.iter().copied().chain(first..first + slots.len()).collect();
            let residuals = PoseResiduals::new(&probing, Arc::clone(&poses), probed, at.clone());
            jacobian_and_residual(&residuals, &residuals.unknowns_in(&at))
        };
        let new = |fitted: DMatrix<f64>, residual| Derivatives {
            fitted: Arc::new(fitted),
            residual: Arc::new(residual),
            sigma: poses.iter().map(|pose| pose.sigma).collect(),
            relaxed: relaxed.clone(),
            places: shared
                .iter()
                .enumerate()
                .map(|(k, &(site, _))| (site, unknowns.len() + k))
                .collect(),
            others: Vec::new(),
        };
        let mut derivatives = if unknowns.len() < MANY_UNKNOWNS {
            let sites = [shared.as_slice(), &slots].concat();
            let (jacobian, _) = pass(unknowns, &sites);
            let plain = PoseResiduals::new(model, Arc::clone(&poses), Vec::new(), x.clone());
            let (_, residual) = jacobian_and_residual(&plain, &DVector::zeros(0));
            let fitted = unknowns.len() + shared.len();
            let beside = jacobian.columns_range(fitted..).into_owned();
            let mut derivatives = new(jacobian.resize_horizontally(fitted, 0.0), residual);
            derivatives.extend(&slots, beside.as_view());
            derivatives
        } else {
            let mut derivatives = cached.map_or_else(
                || {
                    let (fitted, residual) = pass(unknowns, &shared);
                    new(fitted, residual)
                },
                Arc::unwrap_or_clone,
            );
            slots.retain(|(site, _)| !derivatives.places.iter().any(|(other, _)| other == site));
            if !slots.is_empty() {
                derivatives.extend(&slots, pass(&[], &slots).0.as_view());
            }
            derivatives
        };
        for place in at_fitted {
            if !derivatives.places.contains(&place) {
                derivatives.places.push(place);
            }
        }
        let unmoved = unmoved(&poses, &derivatives.fitted);
        if unmoved.count() > 0 {
            // Components along unmoved directions are set to zero in columns and residual, because
            // no parameter could fit a constant residual there.
            for column in derivatives.others.iter_mut().chain([&mut derivatives.residual]) {
                let column = Arc::make_mut(column);
                for pose in 0..poses.len() {
                    let mut here = column.fixed_rows_mut::<3>(3 * pose);
                    let moved = unmoved.moved_part(here.clone_owned());
                    here.copy_from(&moved);
                }
            }
        }
        Self { problem, poses, derivatives: Arc::new(derivatives), unmoved: unmoved.count() }
    }

    /// Returns the derivatives for reuse by another linearisation.
    pub fn derivatives(&self) -> Arc<Derivatives> {
        Arc::clone(&self.derivatives)
    }

    /// Returns the model with the rows of some poses set to zero.
    pub fn without(&self, poses: &[usize]) -> Self {
        let mut reduced = self.clone();
        if poses.is_empty() {
            return reduced;
        }
        let Derivatives { fitted, residual, others, .. } = Arc::make_mut(&mut reduced.derivatives);
        for &pose in poses {
            Arc::make_mut(fitted).rows_mut(3 * pose, 3).fill(0.0);
            for column in others.iter_mut().chain([&mut *residual]) {
                Arc::make_mut(column).rows_mut(3 * pose, 3).fill(0.0);
            }
        }
        reduced
    }

    /// Returns the columns of the fitted parameters, followed by those of relaxed parameters, shape
    /// = (3 N, n).
    pub fn fitted(&self) -> &DMatrix<f64> {
        &self.derivatives.fitted
    }

    /// Returns the columns of [`fitted`](Self::fitted) and the whitened residual. They are copied
    /// only if they are shared.
    pub fn into_fitted(self) -> (DMatrix<f64>, DVector<f64>) {
        let Derivatives { fitted, residual, .. } = Arc::unwrap_or_clone(self.derivatives);
        (Arc::unwrap_or_clone(fitted), Arc::unwrap_or_clone(residual))
    }

    /// Returns the prior σ of the relaxed parameters (differences of two stiffnesses that the
    /// problem declares equal), in the order of their columns; `None` for one without a prior.
    pub fn relaxed(&self) -> &[Option<f64>] {
        &self.derivatives.relaxed
    }

    /// Returns the columns of the parameters with the indices `parameters` of another model about
    /// its full parameter vector `x`, shape = (3 N, parameters).
    pub fn of_parameters(
        &self,
        model: &Model,
        parameters: &[usize],
        x: &DVector<f64>,
    ) -> DMatrix<f64> {
        let residuals =
            PoseResiduals::new(model, Arc::clone(&self.poses), parameters.to_vec(), x.clone());
        jacobian_and_residual(&residuals, &residuals.unknowns_in(x)).0
    }

    /// Returns the whitened residual, length 3 N.
    pub fn residual(&self) -> &DVector<f64> {
        &self.derivatives.residual
    }

    /// Returns the number of residual coordinates of a pose in the degrees of freedom: those that
    /// it measures, less the directions in which no fitted parameter moves any pose.
    pub fn coordinates(&self, pose: usize) -> usize {
        self.poses[pose].observation.coordinates() - self.unmoved
    }

    /// Returns the number of residual coordinates of all poses, of 3 N, that are not in the degrees
    /// of freedom: their poses measure fewer than three numbers, or no fitted parameter moves them.
    pub fn empty(&self) -> usize {
        (0..self.poses.len()).map(|pose| 3 - self.coordinates(pose)).sum()
    }

    /// Returns the poses about which the model is linearised.
    pub fn poses(&self) -> &[Pose<'a>] {
        &self.poses
    }

    /// Returns the columns of an effect's parameters, shape = (3 N, k).
    pub fn columns(&self, effect: &Effect) -> DMatrix<f64> {
        self.columns_of(&EffectTerms::new(self, std::slice::from_ref(effect)), 0)
    }

    /// Returns the columns of the effect with this index in `effect_terms`, shape = (3 N, k).
    pub fn columns_of(&self, effect_terms: &EffectTerms, effect: usize) -> DMatrix<f64> {
        let terms = effect_terms.terms.get(effect).map_or(&[][..], Vec::as_slice);
        let mut columns = DMatrix::zeros(self.derivatives.fitted.nrows(), terms.len());
        for (&(place, regressor), mut out) in terms.iter().zip(columns.column_iter_mut()) {
            let Some(place) = place else { continue };
            let (at_place, values) =
                (self.derivatives.column(place), &effect_terms.values[regressor]);
            for (row, (out, derivative)) in out.iter_mut().zip(at_place.iter()).enumerate() {
                *out = derivative * values[row / 3];
            }
        }
        columns
    }

    /// Returns the problem that was linearised.
    pub fn problem(&self) -> &'a Problem {
        self.problem
    }

    /// Returns, for each of an effect's parameters, true if it cannot be negative.
    pub fn never_negative(&self, effect: &Effect) -> Vec<bool> {
        effect.terms(self.problem).iter().map(|term| term.never_negative).collect()
    }

    /// Returns the column of a site, length 3 N; `None` if no column was computed for it.
    pub fn column_at(&self, site: ParameterSite) -> Option<DVector<f64>> {
        let &(_, place) = self.derivatives.places.iter().find(|(other, _)| *other == site)?;
        Some(self.derivatives.column(place).into_owned())
    }
}

/// Finds the directions in which no fitted parameter moves any pose, such as z of a planar arm. The
/// residual along these directions does not depend on the fit. There are none unless every pose
/// measures a position.
fn unmoved(poses: &[Pose], fitted: &DMatrix<f64>) -> Unmoved {
    if fitted.ncols() == 0 || !poses.iter().all(|pose| pose.observation.coordinates() == 3) {
        return Unmoved::default();
    }
    let first = |count: usize| {
        let columns = fitted.as_slice().chunks_exact(fitted.nrows());
        Unmoved::from_columns(columns.map(|column| &column[..3 * count]), 3)
    };
    let few = first(poses.len().min(MAX_POSES_OF_FIRST_PASS));
    if few.count() == 0 { few } else { first(poses.len()) }
}

/// Terms of some effects, each with the column of its site and the values of its regressor. Equal
/// regressors are evaluated only once.
pub(crate) struct EffectTerms {
    /// For each term of each effect: index of its site's column, `None` if no column was computed,
    /// and index of its regressor in `values`.
    terms: Vec<Vec<(Option<usize>, usize)>>,
    /// Value of each regressor (the function of the pose that multiplies a coefficient) in every
    /// pose.
    values: Vec<Vec<f64>>,
}

impl EffectTerms {
    /// Evaluates the regressors of effects in the poses of a linearised model.
    pub fn new(linearised: &Linearised, effects: &[Effect]) -> Self {
        let mut regressors: Vec<Regressor> = Vec::new();
        let mut term = |Term { site, regressor, .. }: Term| {
            let place = linearised
                .derivatives
                .places
                .iter()
                .find(|(other, _)| *other == site)
                .map(|(_, place)| *place);
            let number =
                regressors.iter().position(|other| *other == regressor).unwrap_or(regressors.len());
            if number == regressors.len() {
                regressors.push(regressor);
            }
            (place, number)
        };
        let terms = effects
            .iter()
            .map(|effect| effect.terms(linearised.problem).into_iter().map(&mut term).collect());
        let terms = terms.collect();
        let value = |regressor: &Regressor| {
            regressor.values(linearised.poses.iter().map(|pose| &pose.setup))
        };
        Self { terms, values: parallel::map_items(&regressors, value) }
    }
}
