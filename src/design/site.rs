//! Model of the arm at the site of a measurement, with its bases and targets.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::candidate_poses::Extremes;
use super::views::{self, ViewRule};
use super::{DesignError, Sensitivity, Workspace};
use crate::error::InputErrorKind;
use crate::fit::{Identification, Placement, locate};
use crate::measurement::Measurements;
use crate::model::parameter::{BeamField, Parameter, ParameterSite};
use crate::model::{MeasuredOrientation, Model, Pose};
use crate::problem::{JointKind, Observation, PoseRanges, Problem};
use crate::random;
use crate::remainder::Correction;

/// Mass \[kg\] assumed for a declared `unmodelled-mass` when derivatives are taken. With a mass of
/// 0, its position would have no influence.
const PROBE_MASS: f64 = 1.0;
/// Number of poses in a batch of draws, for each candidate whose view is wanted.
const DRAWS_PER_VIEW: usize = 10;
/// Maximum number of poses that are drawn for each candidate whose view is wanted. A camera on the
/// tip sees a whole board in about one of a thousand poses within the limits of an arm.
const MAX_DRAWS_PER_VIEW: usize = 200;
/// Offset between the random streams of successive batches of draws. Other streams are smaller.
const BATCH_STREAM: u64 = 1 << 40;

/// Returns true if a row of a table helps to locate its fixture. A planned row, which has no
/// measured numbers yet, does so only if it is a contact.
fn locates(observation: Observation, table: &Measurements) -> bool {
    let mut fields = observation.description().measured_fields();
    table.position_measured || observation.is_position() || fields.all(|field| !field.required)
}

/// Model with a base for every session and a target for every target name of some tables of poses.
#[derive(Debug, Clone)]
pub struct Site<'a> {
    /// Declared arm with its bases and targets.
    pub model: Model,
    problem: &'a Problem,
    bases: Vec<String>,
    targets: Vec<String>,
    /// Full parameter vector of the nominal arm, with unknown fixtures at the points where that arm
    /// touches them.
    nominal: DVector<f64>,
    /// Fixture indices of each camera and marker that measure together. They measure the rows that
    /// state no other measured quantity; empty if positions are measured instead.
    pairs: Vec<(usize, usize)>,
    /// Condition of each pair of camera and marker on the views that may be planned.
    rules: Vec<ViewRule>,
}

impl<'a> Site<'a> {
    /// Creates the site for all poses of `tables`.
    ///
    /// # Errors
    /// Returns an error if rules of `[parameters]` do not match the arm, no parameter is free, σ is
    /// unknown, or distances are to be measured to an anchor at an unknown position.
    pub fn new(problem: &'a Problem, tables: &[&Measurements]) -> Result<Self, DesignError> {
        Self::with_cameras(problem, tables, Vec::new())
    }

    /// Creates the site for all poses of `tables`. Rows that state no other measured quantity are
    /// measured by the `pairs` of a camera and a marker (fixture indices), or as positions if there
    /// are no pairs.
    ///
    /// # Errors
    /// Returns the errors of [`new`](Self::new), or an error if the pose of one of the pairs is
    /// neither declared nor determined by the tables.
    pub(super) fn with_cameras(
        problem: &'a Problem,
        tables: &[&Measurements],
        pairs: Vec<(usize, usize)>,
    ) -> Result<Self, DesignError> {
        let (mut bases, mut targets): (Vec<String>, Vec<String>) = Default::default();
        let add = |words: &mut Vec<String>, word: &String| {
            if !words.contains(word) {
                words.push(word.clone());
            }
        };
        for table in tables {
            let placement = Placement::of(table);
            for row in 0..table.len() {
                add(&mut bases, &placement.bases[placement.base_of(row)]);
                add(&mut targets, &placement.targets[placement.target_of(row)]);
            }
            if pairs.is_empty() && !table.has_declared_noise(problem) {
                return Err(DesignError::no_sigma(problem));
            }
        }
        let model = Model::new(problem, &bases, &targets)?;
        if model.parameters.is_empty() {
            return Err(DesignError::nothing_free(problem));
        }
        let nominal = DVector::zeros(model.parameters.len());
        let used: Vec<usize> =
            pairs.iter().flat_map(|&(camera, marker)| [camera, marker]).collect();
        let mut site = Self { model, problem, bases, targets, nominal, pairs, rules: Vec::new() };
        let (mut located, mut planned_only) = (BTreeSet::new(), BTreeSet::from_iter(used));
        for table in tables {
            let mut poses = site.poses(table, &Placement::of(table));
            for pose in &poses {
                // Before any measurement, contacts locate a fixture, but distances do not.
                let planned = !locates(pose.observation, table);
                let fixtures = pose.observation.fixtures().into_iter().flatten();
                let known = if planned { &mut planned_only } else { &mut located };
                known.extend(fixtures.filter(|_| pose.observation.is_of_arm()));
            }
            poses.retain(|pose| locates(pose.observation, table));
            let mut nominal = std::mem::take(&mut site.nominal);
            locate(&site.model, &poses, |_| true, &mut nominal);
            site.nominal = nominal;
        }
        let unlocated = planned_only.difference(&located);
        for fixture in unlocated.filter_map(|&fixture| problem.fixtures.get(fixture)) {
            if fixture.known.iter().any(Option::is_none) {
                let (what, name) = (fixture.kind.word(), fixture.name.clone());
                let write = fixture.kind.declared_by(0);
                let kind = InputErrorKind::PlaceUnknown { what, name, write };
                return Err(fixture.location.clone().error(kind).into());
            }
        }
        site.set_view_rules(tables);
        Ok(site)
    }

    /// Sets the conditions on planned views from the pixels that rows of `tables` measure.
    fn set_view_rules(&mut self, tables: &[&Measurements]) {
        let poses: Vec<Pose> = tables
            .iter()
            .flat_map(|table| {
                let poses = self.poses(table, &Placement::of(table));
                poses.into_iter().filter(|pose| locates(pose.observation, table))
            })
            .collect();
        let rules = views::rules((self.problem, &self.model), &self.pairs, (&poses, &self.nominal));
        self.rules = rules;
    }

    /// Returns the sensitivity of the poses of a table at the nominal arm. `unit` \[m\] replaces σ,
    /// if given. Unknown sessions and targets are treated as the first of the site.
    pub fn sensitivity(&self, table: &Measurements, unit: Option<f64>) -> Sensitivity {
        let is_mass =
            |site| matches!(site, ParameterSite::Beam { field: BeamField::AddedMass, .. });
        let parameters = self.model.parameters.iter().zip(&self.nominal);
        let values = parameters
            .map(|(parameter, value)| if is_mass(parameter.site) { PROBE_MASS } else { *value });
        let values = DVector::from_iterator(self.model.parameters.len(), values);
        self.sensitivity_at(table, (unit, Some(&self.rules)), &values)
    }

    /// Returns the sensitivities at `count` arms drawn from the priors. Parameters without a prior
    /// stay nominal; arms without equilibrium in one of the poses are omitted.
    pub(super) fn arms(
        &self,
        table: &Measurements,
        count: usize,
        stream: (u64, u64),
    ) -> Vec<Sensitivity> {
        let mut random = random::stream(stream.0, stream.1);
        let mut draw = |parameter: &Parameter| {
            let number = random::normal(&mut random) * parameter.sigma.unwrap_or(0.0);
            number.clamp(parameter.lower, parameter.upper)
        };
        let n = self.model.parameters.len();
        let drawn: Vec<DVector<f64>> = (0..count)
            .map(|_| {
                DVector::from_iterator(n, self.model.parameters.iter().map(&mut draw))
                    + &self.nominal
            })
            .collect();
        let arms = drawn.par_iter().map(|at| self.sensitivity_at(table, (None, None), at));
        arms.filter(|arm| (0..arm.len()).all(|row| arm.is_finite(row))).collect()
    }

    /// Returns the sensitivity of the poses of a table at a parameter vector. Views of cameras have
    /// to meet the `rules`, if given.
    fn sensitivity_at(
        &self,
        table: &Measurements,
        (unit, rules): (Option<f64>, Option<&[ViewRule]>),
        at: &DVector<f64>,
    ) -> Sensitivity {
        let mut poses = self.poses(table, &Placement::of(table));
        if self.is_of_cameras(table) {
            return views::compressed(
                (self.problem, &self.model),
                (&self.pairs, rules),
                (&poses, at),
            );
        }
        for pose in &mut poses {
            pose.sigma = unit.unwrap_or(pose.sigma);
            let turn =
                self.problem.data.orientation_sigma.filter(|_| self.problem.data.fits_orientation);
            // In a unit of length only positions count.
            let turn = turn.filter(|_| pose.observation.is_position());
            pose.orientation = turn
                .filter(|_| unit.is_none())
                .map(|sigma| MeasuredOrientation { measured: None, sigma });
        }
        Sensitivity::of(&self.model, &poses, at)
    }

    /// Returns true if cameras measure the rows of a table.
    pub(super) fn is_of_cameras(&self, table: &Measurements) -> bool {
        let is_plain = |row: usize| table.observation(row).is_position();
        !self.pairs.is_empty() && (0..table.len()).all(is_plain)
    }

    /// Returns the sensitivity of the marker points that cameras see in the poses of a table, at
    /// the nominal arm; `None` if cameras do not measure the table.
    pub(super) fn all_points(&self, table: &Measurements) -> Option<Sensitivity> {
        let poses = self.poses(table, &Placement::of(table));
        let of_site = (self.problem, &self.model);
        self.is_of_cameras(table)
            .then(|| views::all_points(of_site, &self.pairs, (&poses, &self.nominal)))
    }

    /// Returns the problem of the site.
    pub(super) fn problem(&self) -> &Problem {
        self.problem
    }

    /// Moves the point of linearisation to the values of an identification. Parameters that the
    /// identification lacks keep their values. Planned views are to be like those in `measured`.
    pub(super) fn linearise_at(&mut self, found: &Identification, measured: &Measurements) {
        for (value, parameter) in self.nominal.iter_mut().zip(&self.model.parameters) {
            let place = found.estimates.iter().position(|of| of.name == parameter.name);
            if let Some(estimated) = place.and_then(|place| found.x.get(place)) {
                *value = *estimated;
            }
        }
        self.set_view_rules(&[measured]);
    }

    /// Returns the derivatives ∂p/∂q of the predicted positions with respect to the commands, shape
    /// = (3, joints) for each pose; 0 where the arm has no equilibrium.
    pub(super) fn command_slopes(&self, table: &Measurements) -> Vec<DMatrix<f64>> {
        let poses = self.poses(table, &Placement::of(table));
        let mut slopes = self.model.command_jacobian(self.problem, poses, &self.nominal);
        for value in slopes.iter_mut().flat_map(|slope| slope.iter_mut()) {
            if !value.is_finite() {
                *value = 0.0;
            }
        }
        slopes
    }

    /// Returns the expected root mean square length of measured − predicted at each pose of a table
    /// \[m\], without poses in which the arm has no equilibrium.
    pub(super) fn expected_sizes(&self, correction: &Correction, table: &Measurements) -> Vec<f64> {
        let poses = self.poses(table, &Placement::of(table));
        let corrected = correction.at((self.problem, &self.model, &self.nominal), &[], &poses);
        corrected.iter().map(|pose| pose.size).filter(|size| size.is_finite()).collect()
    }

    /// Returns σ of every row of a table \[m\], or `unit` if given.
    pub(super) fn sigmas(&self, table: &Measurements, unit: Option<f64>) -> Vec<f64> {
        let poses = self.poses(table, &Placement::of(table));
        poses.iter().map(|pose| unit.unwrap_or(pose.sigma)).collect()
    }

    /// Returns true if the command of a joint is an angle.
    pub(super) fn is_angle(&self, joint: usize) -> bool {
        self.problem.joints[joint].kind == JointKind::Revolute
    }

    /// Returns the rows of a table as poses of the model.
    fn poses<'t>(&self, table: &'t Measurements, placement: &Placement) -> Vec<Pose<'t>> {
        let rows: Vec<usize> = (0..table.len()).collect();
        let mut poses =
            placement.poses(table, &rows, self.problem.data.position_sigma.unwrap_or(1.0));
        let index = |words: &[String], word: &String| {
            words.iter().position(|other| other == word).unwrap_or(0)
        };
        for pose in &mut poses {
            pose.base = index(&self.bases, &placement.bases[pose.base]);
            pose.target = index(&self.targets, &placement.targets[pose.target]);
        }
        poses
    }

    /// Returns the indices of the rows of a table in which the nominal target is inside a
    /// workspace.
    pub(super) fn inside(&self, table: &Measurements, workspace: &Workspace) -> Vec<usize> {
        let nominal = vec![0.0; self.model.parameters.len()];
        let points = self
            .model
            .predicted_targets_in_base(&self.poses(table, &Placement::of(table)), &nominal);
        (0..table.len())
            .filter(|&row| points[row].is_some_and(|point| workspace.contains(&point)))
            .collect()
    }

    /// Draws poses from `ranges` until `count` of them satisfy `select` and are seen by the
    /// cameras, or [`MAX_DRAWS_PER_VIEW`] times as many were drawn. Without cameras, `count` poses
    /// are drawn. Returns the poses and the number that was drawn.
    pub(super) fn draw_in_view(
        &self,
        ranges: &PoseRanges,
        (count, extremes): (usize, Extremes),
        (seed, stream): (u64, u64),
        select: impl Fn(Measurements) -> Measurements,
    ) -> (Measurements, usize) {
        let draw = |count: usize, batch: u64| {
            let stream = stream + batch * BATCH_STREAM;
            select(ranges.draw(self.problem, count, extremes, seed, stream))
        };
        if self.pairs.is_empty() {
            return (draw(count, 0), count);
        }
        let first = draw(DRAWS_PER_VIEW * count, 0);
        if !self.is_of_cameras(&first) {
            let all: Vec<usize> = (0..first.len().min(count)).collect();
            return (first.select(&all), count);
        }
        let mut seen = self.seen(&first);
        let mut batches = 1;
        while seen.len() < count && batches < MAX_DRAWS_PER_VIEW / DRAWS_PER_VIEW {
            let batch = draw(DRAWS_PER_VIEW * count, batches as u64);
            seen = seen.concatenate(&self.seen(&batch));
            batches += 1;
        }
        let chosen: Vec<usize> = (0..seen.len().min(count)).collect();
        (seen.select(&chosen), batches * DRAWS_PER_VIEW * count)
    }

    /// Returns the poses of a table that the cameras see.
    fn seen(&self, table: &Measurements) -> Measurements {
        let poses = self.poses(table, &Placement::of(table));
        let of_site = (self.problem, &self.model);
        let seen = views::seen(of_site, (&self.pairs, &self.rules), (&poses, &self.nominal));
        table.select(&seen)
    }

    /// Returns the rows of a table in which the arm has an equilibrium, and their sensitivity.
    pub(super) fn in_equilibrium(&self, table: &Measurements) -> (Measurements, Sensitivity) {
        let sensitivity = self.sensitivity(table, None);
        let rows: Vec<usize> =
            (0..sensitivity.len()).filter(|&row| sensitivity.is_finite(row)).collect();
        if rows.len() == sensitivity.len() {
            (table.clone(), sensitivity)
        } else {
            (table.select(&rows), sensitivity.select(&rows))
        }
    }
}
