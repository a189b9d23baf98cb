//! A problem with its effects, fitted, and its linear neighbourhood.

use nalgebra::{DMatrix, DVector, Vector3};

use super::data::Data;
use super::neighbourhood::{Library, Linear, open};
use super::smooth_term::SmoothTerm;
use crate::identify::{Identification, IdentifyError, Noise, Options, Placement, identify};
use crate::model::parameter::Slot;
use crate::model::{Model, Pose, PoseResiduals};
use crate::problem::{Effect, EffectDeclaration, Problem};

/// By what σ grows where a position says nothing: gross errors, if the loss is robust, decide on no effect.
const NOTHING_SAID: f64 = 1e6;

/// A fitted problem.
#[derive(Clone)]
pub(super) struct Fitted {
    pub problem: Problem,
    pub model: Model,
    pub found: Identification,
    /// Parameters that were fitted to the identification rows and rest on no bound.
    pub unknowns: Vec<usize>,
    /// Rows of the constraints that hold them, shape = (constraints, unknowns).
    closed: DMatrix<f64>,
    /// 1 σ of a coordinate in rows without one of their own [m].
    pub sigma: f64,
}

impl Fitted {
    /// Fits `problem` to the identification rows.
    pub fn new(problem: Problem, data: &Data, options: &Options) -> Result<Self, IdentifyError> {
        let found = identify(&problem, data.dataset, options)?;
        Self::of(problem, data, found)
    }

    /// A problem that was fitted to the identification rows before.
    pub fn of(problem: Problem, data: &Data, found: Identification) -> Result<Self, IdentifyError> {
        let placement = Placement::of(data.measurements);
        let model = Model::new(&problem, &placement.bases, &placement.targets)?;
        let free = |&k: &usize| {
            let name = &model.parameters[k].name;
            found.unknowns.contains(name) && found.estimates[k].at_bound.is_none()
        };
        let unknowns: Vec<usize> = (0..model.parameters.len()).filter(free).collect();
        let coefficient = |i: usize, j: usize| -> f64 {
            let terms = &model.constraints[found.active_constraints[i].constraint].terms;
            terms.iter().filter(|(k, _)| *k == unknowns[j]).map(|(_, coefficient)| coefficient).sum()
        };
        let closed = DMatrix::from_fn(found.active_constraints.len(), unknowns.len(), coefficient);
        let sigma = match found.noise {
            Noise::Estimated(sigma) => sigma,
            Noise::Declared | Noise::Unknown => placement.sigma(data.measurements, data.rows(), &problem),
        };
        Ok(Self { problem, model, found, unknowns, closed, sigma })
    }

    /// Options to fit a problem that differs by a few effects: from where this fit ended.
    pub fn onwards(&self, options: &Options) -> Options {
        let values = self.found.estimates.iter().map(|estimate| (estimate.name.clone(), estimate.estimate));
        Options { start: values.collect(), ..options.clone() }
    }

    /// The same problem with other effects declared.
    pub fn with_effects(&self, effects: &[Effect]) -> Problem {
        let mut problem = self.problem.clone();
        let location = problem.data.location.clone();
        problem.effects = effects
            .iter()
            .map(|effect| EffectDeclaration { effect: effect.clone(), location: location.clone() })
            .collect();
        problem
    }

    /// Declared effects.
    pub fn effects(&self) -> Vec<Effect> {
        self.problem.effects.iter().map(|declared| declared.effect.clone()).collect()
    }

    /// The poses of some rows.
    pub fn poses<'a>(&self, data: &Data<'a>, rows: &[usize]) -> Vec<Pose<'a>> {
        Placement::of(data.measurements).poses(data.measurements, rows, self.sigma)
    }

    /// Residuals of some rows, measuring frame [m].
    pub fn errors(&self, data: &Data, rows: &[usize]) -> Vec<Vector3<f64>> {
        let residuals = PoseResiduals::new(&self.model, self.poses(data, rows), Vec::new(), self.found.x.clone());
        residuals.position_errors(&DVector::zeros(0))
    }

    /// The model about the fit at the identification rows, with every place where `effects` enter and those of `smooth_terms`.
    pub fn library<'a>(&'a self, data: &Data<'a>, effects: &[Effect], smooth_terms: &[SmoothTerm]) -> Library<'a> {
        self.library_of(data, data.rows(), effects, smooth_terms)
    }

    /// The same at other rows.
    pub fn library_of<'a>(
        &'a self,
        data: &Data<'a>,
        rows: &[usize],
        effects: &[Effect],
        smooth_terms: &[SmoothTerm],
    ) -> Library<'a> {
        let mut places: Vec<Slot> = Vec::new();
        for smooth_term in smooth_terms {
            if !places.contains(&smooth_term.slot) {
                places.push(smooth_term.slot);
            }
        }
        let mut poses = self.poses(data, rows);
        if self.problem.robust.is_some() {
            let is_outlier = |row: &usize| self.found.outliers.iter().any(|outlier| outlier.row == *row);
            let gross = poses.iter_mut().zip(rows).filter(|(_, row)| is_outlier(row));
            gross.for_each(|(pose, _)| pose.sigma *= NOTHING_SAID);
        }
        Library::new(&self.problem, &self.model, poses, &self.unknowns, &self.found.x, (effects, &places))
    }

    /// The fit in its linear neighbourhood, with the parameters numbered `without` taken out of it and `smooth_terms` put in.
    pub fn linear(&self, library: &Library, without: &[usize], smooth_terms: &[SmoothTerm]) -> Linear {
        let columns = library.fitted();
        let n = self.unknowns.len();
        let kept: Vec<usize> = (0..n).filter(|&j| !without.contains(&self.unknowns[j])).collect();
        let mut residual = library.residual().clone();
        for (j, &k) in self.unknowns.iter().enumerate() {
            if without.contains(&k) {
                residual.axpy(-self.found.x[k], &columns.column(j), 1.0);
            }
        }
        let mut x: Vec<f64> = kept.iter().map(|&j| self.found.x[self.unknowns[j]]).collect();
        let mut priors: Vec<Option<f64>> =
            kept.iter().map(|&j| self.model.parameters[self.unknowns[j]].sigma).collect();
        x.resize(x.len() + library.let_go().len(), 0.0);
        priors.extend(library.let_go());
        let closed = self.closed.select_columns(&kept).resize_horizontally(x.len(), 0.0);
        let places: Vec<usize> = kept.into_iter().chain(n..columns.ncols()).collect();
        let mut linear = Linear::new(&columns.select_columns(&places), &residual, &x, &priors, &closed);
        for smooth_term in smooth_terms {
            linear.add(&smooth_term.columns(library));
        }
        linear
    }

    /// Numbers of an effect's parameters in the model.
    pub fn parameters_of(&self, effect: &Effect) -> Vec<usize> {
        let own = effect.parameters(&self.problem);
        let is_own = |&k: &usize| own.iter().any(|parameter| parameter.name == self.model.parameters[k].name);
        (0..self.model.parameters.len()).filter(is_own).collect()
    }

    /// What the fit would lose without some of its parameters: sum of squares, priors included, in the linear neighbourhood,
    /// at the optimum with what was put in.
    ///
    /// xᵀ ([N⁻¹])⁻¹ x over those parameters, with N = JᵀJ + Λ and what neither data nor priors see left out.
    pub fn loss_without(&self, normal: &Normal, parameters: &[usize]) -> Option<f64> {
        let places = self.places_of(parameters);
        let at = |&j: &usize| self.found.x[self.unknowns[j]] + normal.step[j];
        let x = DVector::from_iterator(places.len(), places.iter().map(at));
        let covariance = DMatrix::from_fn(places.len(), places.len(), |i, j| normal.inverse[(places[i], places[j])]);
        Some((x.transpose() * covariance.try_inverse()? * &x)[(0, 0)])
    }

    /// What an effect alone gives the fit: orthonormal directions, shape = (3 N + priors, k), and the part of the residual that
    /// they take off, in the linear neighbourhood.
    ///
    /// The effect's columns with all others projected out are [J; Λ^½] N⁻¹ₑ ([N⁻¹]ₑₑ)⁻¹.
    pub fn given_by(
        &self,
        library: &Library,
        (normal, smooth_terms): (&Normal, &[SmoothTerm]),
        effect: &Effect,
    ) -> Given {
        let places: Vec<usize> = self.places_of(&self.parameters_of(effect));
        let x = DVector::from_iterator(
            places.len(),
            places.iter().map(|&j| self.found.x[self.unknowns[j]] + normal.step[j]),
        );
        let own = normal.inverse.select_columns(&places);
        let priors: Vec<(usize, f64)> =
            normal.priors.iter().enumerate().filter_map(|(j, sigma)| Some((j, (*sigma)?))).collect();
        let data = with_smooth_terms(library, smooth_terms) * &own;
        let mut columns = DMatrix::zeros(data.nrows() + priors.len(), places.len());
        columns.rows_mut(0, data.nrows()).copy_from(&data);
        for (row, (j, sigma)) in priors.into_iter().enumerate() {
            columns.set_row(data.nrows() + row, &(own.row(j) / sigma));
        }
        let Some(inverse) = own.select_rows(&places).try_inverse() else {
            return Given { directions: columns.resize_horizontally(0, 0.0), part: DVector::zeros(0) };
        };
        let change = -(&columns * (inverse * x));
        let directions = columns.qr().q();
        let part = directions.tr_mul(&change);
        Given { directions, part }
    }

    /// N = JᵀJ + Λ of the fit, with `smooth_terms` put in, and the step to where they belong.
    pub fn normal(&self, library: &Library, smooth_terms: &[SmoothTerm]) -> Normal {
        let own = self.unknowns.iter().map(|&k| self.model.parameters[k].sigma);
        let priors: Vec<Option<f64>> = own.chain(library.let_go().iter().copied()).collect();
        let columns = with_smooth_terms(library, smooth_terms);
        let mut pull = columns.tr_mul(library.residual());
        for (j, &k) in self.unknowns.iter().enumerate() {
            if let Some(sigma) = self.model.parameters[k].sigma {
                pull[j] += self.found.x[k] / (sigma * sigma);
            }
        }
        Normal::new(&columns, priors, &pull, &self.closed_among(columns.ncols()))
    }

    /// Rows of the constraints that hold the fit, for the unknowns and further columns up to `n`.
    pub fn closed_among(&self, n: usize) -> DMatrix<f64> {
        self.closed.clone().resize_horizontally(n, 0.0)
    }

    /// Columns of some of the model's parameters, shape = (3 N, k).
    pub fn columns(&self, library: &Library, parameters: &[usize]) -> DMatrix<f64> {
        library.fitted().select_columns(&self.places_of(parameters))
    }

    /// Places of some of the model's parameters among the unknowns.
    fn places_of(&self, parameters: &[usize]) -> Vec<usize> {
        parameters.iter().filter_map(|k| self.unknowns.iter().position(|unknown| unknown == k)).collect()
    }
}

/// Fitted columns, then those of `smooth_terms`, shape = (3 N, …).
pub(super) fn with_smooth_terms(library: &Library, smooth_terms: &[SmoothTerm]) -> DMatrix<f64> {
    let mut columns = library.fitted();
    for smooth_term in smooth_terms {
        let more = smooth_term.columns(library);
        let first = columns.ncols();
        columns = columns.resize_horizontally(first + more.ncols(), 0.0);
        columns.columns_mut(first, more.ncols()).copy_from(&more);
    }
    columns
}

/// What an effect alone gives a fit.
pub(super) struct Given {
    /// Orthonormal, shape = (3 N + priors, k).
    pub directions: DMatrix<f64>,
    /// Part of the residual along them that the effect takes off.
    pub part: DVector<f64>,
}

/// The inverse of a normal matrix; 0 in directions that neither data nor priors see, or that constraints hold.
pub(super) struct Normal {
    pub inverse: DMatrix<f64>,
    /// σ of the priors of the first columns.
    priors: Vec<Option<f64>>,
    /// − N⁻¹ g: from where the derivatives were taken to the optimum of what they describe.
    pub step: DVector<f64>,
}

/// Eigenvalues of a normal matrix of unit diagonal below this are what nothing sees.
const UNSEEN: f64 = 1e-12;

impl Normal {
    /// Of columns, shape = (3 N, n), with priors on the first of them, the gradient g, and rows of constraints that hold.
    pub fn new(
        columns: &DMatrix<f64>,
        priors: Vec<Option<f64>>,
        gradient: &DVector<f64>,
        closed: &DMatrix<f64>,
    ) -> Self {
        let mut matrix = columns.transpose() * columns;
        for (j, sigma) in priors.iter().enumerate() {
            if let Some(sigma) = sigma {
                matrix[(j, j)] += sigma.powi(-2);
            }
        }
        let scale: Vec<f64> = matrix.diagonal().iter().map(|d| if *d > 0.0 { d.sqrt() } else { 1.0 }).collect();
        let n = matrix.nrows();
        if n == 0 {
            return Self { inverse: matrix, priors, step: DVector::zeros(0) };
        }
        let matrix = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] / (scale[i] * scale[j]));
        let scaled = match open(closed, &scale) {
            Some(open) if open.is_empty() => DMatrix::zeros(n, n),
            Some(open) => &open * seen_inverse(open.transpose() * matrix * &open) * open.transpose(),
            None => seen_inverse(matrix),
        };
        let inverse = DMatrix::from_fn(n, n, |i, j| scaled[(i, j)] / (scale[i] * scale[j]));
        let step = -(&inverse * gradient);
        Self { inverse, priors, step }
    }
}

/// The inverse of a normal matrix of unit diagonal, or of a part of one; 0 in directions that nothing sees.
fn seen_inverse(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let eigen = matrix.symmetric_eigen();
    let inverted = eigen.eigenvalues.map(|value| if value > UNSEEN { value.recip() } else { 0.0 });
    &eigen.eigenvectors * DMatrix::from_diagonal(&inverted) * eigen.eigenvectors.transpose()
}
