//! Predictions of an arm for any rows from a saved estimate, without another fit of the arm.

use std::collections::BTreeMap;

use nalgebra::{DVector, Vector3};

use crate::error::{InputError, InputErrorKind};
use crate::fit::apply::predict::{Residual, in_space};
use crate::fit::apply::saved_estimate::SavedEstimate;
use crate::fit::apply::saved_estimate_error::{SavedEstimateError, missing};
use crate::fit::checks::point_spread::{PointSpread, spreads};
use crate::fit::checks::required_columns::check_columns;
use crate::fit::errors::of_kind;
use crate::fit::stages::fixture_location::locate;
use crate::fit::stages::placement::ASSUMED_SIGMA;
use crate::fit::stages::registration::register;
use crate::fit::stages::stage::{Stage, StageError};
use crate::fit::uncertainty::residual_lengths::are_outliers;
use crate::fit::{ErrorSummary, Placement, SolverChoice};
use crate::least_squares::LinearisationCache;
use crate::measurement::{Measurements, Split};
use crate::model::parameter::ParameterSite;
use crate::model::{Model, Pose};
use crate::observation::Needs;
use crate::problem::{Observation, Problem};
use crate::quantity::Unit;

/// Largest component of a parameter in the rows of undetermined combinations, at which the measured
/// rows determine the parameter.
const MAX_UNDETERMINED_SHARE: f64 = 1e-6;

/// Predictions of an arm for the rows of a table, with residuals if the rows were measured.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Prediction {
    /// Predicted position of the target in each row, measuring frame \[m\]; NaN where the arm has
    /// no equilibrium.
    pub positions: Vec<Vector3<f64>>,
    /// Predicted values of the numbers that each row measures, in the units of its kind: a position
    /// \[m\], a pixel \[px\], a distance \[m\], or tilts \[rad\]; unused entries are 0.
    pub numbers: Vec<Vector3<f64>>,
    /// Predicted orientation of each row, a rotation vector, measuring frame \[rad\]; `None` if
    /// orientation is not fitted.
    pub orientations: Option<Vec<Vector3<f64>>>,
    /// Residuals of the rows; `None` if the rows contain no measurements.
    pub residuals: Option<Vec<Residual>>,
    /// Summaries of the residuals, in total and by session; `None` if the rows contain no
    /// measurements.
    #[doc(hidden)]
    pub errors: Option<ErrorsBySession>,
    /// Scatter of the predicted target at each point that the rows touch.
    pub spreads: Vec<PointSpread>,
    /// Names of the parameters of bases, tools and fixtures that the estimate lacks. They were
    /// fitted to the measured rows, with the arm's parameters fixed.
    pub placed: Vec<String>,
    /// Full parameter vector of the model of the predicted rows, with the fitted bases, tools and
    /// fixtures.
    pub x: DVector<f64>,
}

impl Prediction {
    /// Returns the indices of the rows in which the arm has no equilibrium.
    pub(crate) fn lost_rows(&self) -> Vec<usize> {
        let is_lost = |position: &Vector3<f64>| !position.iter().all(|x| x.is_finite());
        (0..self.positions.len()).filter(|&row| is_lost(&self.positions[row])).collect()
    }
}

/// Summaries of the errors of all rows, of each kind of rows, and of each session.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorsBySession {
    /// Errors of all rows of the leading kind: positions, if the table has any.
    pub all: ErrorSummary,
    /// Errors of each kind of rows; empty if there is only one kind.
    pub kinds: Vec<ErrorSummary>,
    /// Name and errors of each session, in the order of the table; the errors are those of the
    /// leading kind of the session's rows (positions, if there are any). Empty without sessions.
    pub sessions: Vec<(String, ErrorSummary)>,
}

/// Error of predictions that cannot be computed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PredictError {
    /// Problem and rows are not compatible.
    #[error("{0}")]
    Input(#[from] InputError),
    /// The estimate belongs to another problem, or lacks a parameter that the rows need.
    #[error(transparent)]
    Estimate(#[from] SavedEstimateError),
    /// The measured rows of a session, tool or fixture that the estimate lacks do not determine its
    /// pose.
    #[error(
        "{name} is not in the estimate, and its rows do not determine it; measure more poses \
         there{}",
        if name.starts_with("base[") {
            ", or, if base and instrument stand where they stood, give these rows a session of the \
             estimate"
        } else {
            ""
        }
    )]
    Open {
        /// Name of the parameter that the rows do not determine.
        name: String,
    },
    /// There is no estimate, and the measured rows do not determine the pose of a base, tool or
    /// fixture.
    #[error(
        "the rows do not determine {name}, and there is no estimate to take it from; measure more \
         poses there"
    )]
    OpenWithoutEstimate {
        /// Name of the parameter that the rows do not determine.
        name: String,
    },
    /// Bases, tools and fixtures that the estimate lacks could not be fitted.
    #[error(transparent)]
    Stage(#[from] StageError),
}

impl ErrorsBySession {
    /// Summarises the `errors` measured − predicted of `rows`, in the unit of their kind.
    /// `at_points` returns the image errors of the rows with given indices as lengths at the
    /// observed points \[m\].
    fn new(
        rows: &Measurements,
        errors: &[Vector3<f64>],
        at_points: impl Fn(&[usize]) -> Vec<Vector3<f64>>,
    ) -> Self {
        let kinds = rows.kinds();
        let summary = |chosen: &[usize], errors: &[Vector3<f64>], kind: Observation| {
            let summary = of_kind(rows, chosen.iter().copied(), errors, kind);
            let is_image = summary.unit() == Unit::Pixel;
            if is_image { summary.with_lengths(&at_points(chosen)) } else { summary }
        };
        let of = |chosen: &[usize], errors: &[Vector3<f64>]| {
            let first = chosen.iter().map(|&row| rows.observation(row)).min().unwrap_or_default();
            summary(chosen, errors, first)
        };
        let session = |(label, name): (usize, &String)| {
            let of_session = (0..rows.len()).filter(|&row| rows.session.of_row[row] == label);
            let (chosen, errors): (Vec<usize>, Vec<Vector3<f64>>) =
                of_session.map(|row| (row, errors[row])).unzip();
            (!name.is_empty() && !chosen.is_empty()).then(|| (name.clone(), of(&chosen, &errors)))
        };
        let sessions = rows.session.names.iter().enumerate().filter_map(session).collect();
        let all_rows: Vec<usize> = (0..rows.len()).collect();
        let each =
            kinds.iter().filter(|_| kinds.len() > 1).map(|&kind| summary(&all_rows, errors, kind));
        Self { all: of(&all_rows, errors), kinds: each.collect(), sessions }
    }
}

/// Predicts `rows` with the arm of `problem`: as identified in `estimate`, or the nominal arm if
/// that is `None`.
///
/// A free base, tool or fixture that the estimate lacks is fitted to the rows that use it, with the
/// arm's parameters fixed, if these rows were measured. `split` states which rows are held out;
/// `None` if that is not known.
///
/// # Errors
/// Returns an error if the estimate belongs to another problem or lacks a parameter of the arm, or
/// if the rows lack a column that an effect needs. A base, tool or fixture that the estimate lacks
/// is an error if the rows do not determine it.
pub fn predict(
    problem: &Problem,
    estimate: Option<&SavedEstimate>,
    rows: &Measurements,
    split: Option<&Split>,
) -> Result<Prediction, PredictError> {
    let rows = &*rows.with_sides(estimate.is_some_and(|estimate| estimate.has_approach));
    check_columns(problem, rows)?;
    let placement = Placement::of(rows);
    let model = Model::new(problem, &placement.bases, &placement.targets)?;
    let model = estimate.map_or(model.clone(), |estimate| estimate.model(model));
    if let Some(estimate) = estimate {
        estimate.check(problem, &model)?;
    }
    let estimated_value = |name: &str| estimate.and_then(|estimate| estimate.value(name));
    let mut x = DVector::zeros(model.parameters.len());
    let mut missing = Vec::new();
    for (k, parameter) in model.parameters.iter().enumerate() {
        match estimated_value(&parameter.name) {
            Some(value) => x[k] = parameter.deviation(value),
            None if parameter.site.is_placement() => missing.push(k),
            None if estimate.is_none() => {}
            None => return Err(missing_parameter_error(estimate, &parameter.name)),
        }
    }
    let sigma =
        problem.data.position_sigma.or(estimate.and_then(|estimate| estimate.estimated_sigma));
    let all_rows: Vec<usize> = (0..rows.len()).collect();
    let turn = problem.data.orientation_sigma.filter(|_| problem.data.fits_orientation);
    let mut poses =
        placement.oriented_poses(rows, &all_rows, (sigma.unwrap_or(ASSUMED_SIGMA), turn));
    if let Some(estimate) = estimate {
        estimate.count_time_in(&placement, &mut poses);
    }
    // The parameters of a fixture that no row uses are not needed.
    let is_needed = |k: usize| {
        let fixture = matches!(model.parameters[k].site, ParameterSite::Fixture { .. });
        !fixture || poses.iter().any(|pose| uses(&model, pose, k))
    };
    missing.retain(|&k| is_needed(k));
    if !missing.is_empty() && rows.position_measured {
        if let Some(k) = too_few(&model, &poses, &missing) {
            return Err(undetermined_error(estimate, model.parameters[k].name.clone()));
        }
        x = fit_placements(&model, &poses, &missing, x).map_err(|error| match error {
            PredictError::Open { name } => undetermined_error(estimate, name),
            other => other,
        })?;
    } else if let (Some(&k), Some(_)) = (missing.first(), estimate) {
        return Err(missing_parameter_error(estimate, &model.parameters[k].name));
    }
    let sigmas: Vec<Option<f64>> =
        all_rows.iter().map(|&row| rows.sigma_of(row).or(sigma)).collect();
    let orientations = turn.map(|_| model.orientations(&poses, x.as_slice()));
    let turns = turn
        .filter(|_| rows.orientations.is_some())
        .map(|_| model.orientation_residuals(poses.clone(), &x));
    let targets = model.predicted_targets_in_base(&poses, x.as_slice());
    let base_of: Vec<usize> = poses.iter().map(|pose| pose.base).collect();
    let spreads = spreads(&model, &problem.fixtures, &poses, &x);
    let is_of_camera = |row: usize| rows.observation(row).description().needs == Needs::Carriers;
    let images: Vec<(usize, Pose)> =
        all_rows.iter().filter(|row| is_of_camera(**row)).map(|&row| (row, poses[row])).collect();
    let errors = model.residuals(poses, &x);
    let images: BTreeMap<usize, (Pose, Vector3<f64>)> =
        images.into_iter().map(|(row, pose)| (row, (pose, errors[row]))).collect();
    let at_points = |chosen: &[usize]| {
        let (poses, errors): (Vec<Pose>, Vec<Vector3<f64>>) =
            chosen.iter().filter_map(|row| images.get(row)).copied().unzip();
        model.lengths_at_points(&poses, &errors, &x)
    };
    let is_behind = |&row: &usize| {
        is_of_camera(row)
            && rows.position_measured
            && targets[row].is_some()
            && errors[row].x.is_nan()
    };
    if let Some(row) = (0..rows.len()).find(is_behind) {
        return Err(rows
            .location(row)
            .error(InputErrorKind::PointBehindCamera {
                fits: None,
                miss: None,
                few: 0,
                readings: Vec::new(),
            })
            .into());
    }
    let (fixtures, bases) = (model.fixtures(x.as_slice()), model.base_frames(x.as_slice()));
    let of_row =
        |(row, error): (usize, &Vector3<f64>)| in_space(rows, row, (&fixtures, &bases), error);
    let (predicted, errors): (Vec<Vector3<f64>>, Vec<Vector3<f64>>) =
        errors.iter().enumerate().map(of_row).unzip();
    let position = |row: usize| match rows.observation(row) {
        Observation::Position => predicted[row],
        _ => targets[row]
            .map_or(Vector3::from_element(f64::NAN), |point| bases[base_of[row]].point(&point)),
    };
    let positions = all_rows.iter().map(|&row| position(row)).collect();
    let numbers: Vec<usize> =
        all_rows.iter().map(|&row| rows.observation(row).coordinates()).collect();
    let residuals = rows.position_measured.then(|| {
        residuals((&errors, &predicted), (&sigmas, &numbers), turns.as_deref().zip(turn), split)
    });
    let errors = rows.position_measured.then(|| ErrorsBySession::new(rows, &errors, at_points));
    let placed = if rows.position_measured { missing } else { Vec::new() };
    let placed = placed.into_iter().map(|k| model.parameters[k].name.clone()).collect();
    Ok(Prediction {
        positions,
        numbers: predicted,
        orientations,
        residuals,
        errors,
        spreads,
        placed,
        x,
    })
}

/// Returns the error that the `estimate` lacks the parameter `name`, or that there is no estimate.
fn missing_parameter_error(estimate: Option<&SavedEstimate>, name: &str) -> PredictError {
    let name = name.to_owned();
    match estimate {
        Some(estimate) => missing(estimate.file.clone(), name, |kind| estimate.words(kind)).into(),
        None => PredictError::OpenWithoutEstimate { name },
    }
}

/// Returns the error that the rows do not determine the parameter `name`, which the estimate lacks.
fn undetermined_error(estimate: Option<&SavedEstimate>, name: String) -> PredictError {
    match estimate {
        Some(_) => PredictError::Open { name },
        None => PredictError::OpenWithoutEstimate { name },
    }
}

/// Returns true if a pose uses the base, tool or fixture that parameter `k` belongs to.
fn uses(model: &Model, pose: &Pose, k: usize) -> bool {
    match model.parameters[k].site {
        ParameterSite::Base { base, .. } => pose.base == base,
        ParameterSite::Target { target, .. } => pose.target == target,
        ParameterSite::Fixture { fixture, .. } => {
            pose.observation.fixtures().contains(&Some(fixture))
        }
        _ => false,
    }
}

/// Returns the first of the `missing` parameters without a prior for which there are too few
/// measurements; `None` if there is none. The poses that use its base, tool or fixture must measure
/// at least as many coordinates as `missing` parameters without a prior act on them.
fn too_few(model: &Model, poses: &[Pose], missing: &[usize]) -> Option<usize> {
    let open: Vec<usize> =
        missing.iter().copied().filter(|&k| model.parameters[k].sigma.is_none()).collect();
    open.iter().copied().find(|&k| {
        let users: Vec<&Pose> = poses.iter().filter(|pose| uses(model, pose, k)).collect();
        let measured = users.iter().map(|pose| pose.coordinates()).sum::<usize>();
        let unknown =
            open.iter().filter(|&&other| users.iter().any(|pose| uses(model, pose, other))).count();
        // With as many coordinates as unknowns, a fixture fits its contacts exactly, so that their
        // errors would be 0.
        let placed_exactly = matches!(model.parameters[k].site, ParameterSite::Fixture { .. })
            && measured == unknown;
        measured < unknown || placed_exactly
    })
}

/// Returns the full parameter vector `x` with the `missing` parameters of bases, tools and fixtures
/// fitted to the poses that use them.
fn fit_placements(
    model: &Model,
    poses: &[Pose],
    missing: &[usize],
    mut x: DVector<f64>,
) -> Result<DVector<f64>, PredictError> {
    let users: Vec<Pose> = poses
        .iter()
        .filter(|pose| missing.iter().any(|&k| uses(model, pose, k)))
        .copied()
        .collect();
    let of_base = |k: usize| matches!(model.parameters[k].site, ParameterSite::Base { .. });
    let new_base = |pose: &&Pose| missing.iter().any(|&k| of_base(k) && uses(model, pose, k));
    let registrable: Vec<Pose> = users.iter().filter(new_base).copied().collect();
    register(model, &registrable, &mut x);
    locate(model, &users, |k| missing.contains(&k), &mut x);
    let cache = LinearisationCache::default();
    let solver = SolverChoice::Auto.decide(model);
    let stage =
        Stage { counts_fixed: true, ..Stage::new(model, users, missing.to_vec(), solver, &cache) };
    let placed = stage.run(&x)?.x;
    let open = stage.gauge(&placed, &vec![false; missing.len()], &[]).rows;
    let open = missing.iter().enumerate().find(|(column, _)| {
        open.column(*column).iter().any(|part| part.abs() > MAX_UNDETERMINED_SHARE)
    });
    match open {
        Some((_, &k)) => Err(PredictError::Open { name: model.parameters[k].name.clone() }),
        None => Ok(placed),
    }
}

/// Creates the residuals of all rows from the errors measured − predicted, the predicted numbers
/// `predicted`, and the orientation errors `turns` with their σ \[rad\]. `sigmas` and `coordinates`
/// hold the σ and the number of coordinates of each row. Whitened values are NaN if σ is `None`.
fn residuals(
    (errors, predicted): (&[Vector3<f64>], &[Vector3<f64>]),
    (sigmas, coordinates): (&[Option<f64>], &[usize]),
    turns: Option<(&[Vector3<f64>], f64)>,
    split: Option<&Split>,
) -> Vec<Residual> {
    let whitened: Vec<Vector3<f64>> =
        errors.iter().zip(sigmas).map(|(error, sigma)| error / sigma.unwrap_or(f64::NAN)).collect();
    let lengths: Vec<f64> = whitened.iter().map(Vector3::norm).collect();
    let outliers = are_outliers(&lengths, coordinates);
    let held_out =
        |row: usize| split.is_some_and(|split| split.held_out.binary_search(&row).is_ok());
    let residual =
        |(row, (&position, &whitened)): (usize, (&Vector3<f64>, &Vector3<f64>))| Residual {
            row,
            predicted: predicted[row],
            held_out: held_out(row),
            position,
            whitened,
            orientation: turns.map(|(turns, _)| turns[row]),
            whitened_orientation: turns.map(|(turns, sigma)| turns[row] / sigma),
            outlier: outliers[row],
        };
    errors.iter().zip(&whitened).enumerate().map(residual).collect()
}
