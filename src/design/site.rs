//! The arm where it is to be measured.

use std::collections::BTreeSet;

use nalgebra::DVector;
use rayon::prelude::*;

use super::{DesignError, Sensitivity, Workspace};
use crate::error::InputErrorKind;
use crate::fit::{Placement, locate};
use crate::measurement::Measurements;
use crate::model::parameter::{BeamField, Parameter, ParameterSite};
use crate::model::{MeasuredOrientation, Model, Pose};
use crate::problem::{Observation, Problem};
use crate::random;

/// Mass that a declared `unmodelled-mass` is taken to have: without any, its place would not matter
/// \[kg\].
const PROBE_MASS: f64 = 1.0;

/// The model with a base for every session and a target for every word of some tables of poses.
#[derive(Debug, Clone)]
pub struct Site<'a> {
    /// The declared arm, its bases and targets.
    pub model: Model,
    problem: &'a Problem,
    bases: Vec<String>,
    targets: Vec<String>,
    /// Where the nominal arm puts the points, anchors and surfaces of which nothing is known: the
    /// full parameter vector.
    about: DVector<f64>,
}

impl<'a> Site<'a> {
    /// For all poses of `tables`.
    ///
    /// # Errors
    /// Rules of `[parameters]` do not fit the arm, no parameter is free, σ is not known, or
    /// distances are to be measured to an anchor that nobody knows the place of.
    pub fn new(problem: &'a Problem, tables: &[&Measurements]) -> Result<Self, DesignError> {
        let (mut bases, mut targets): (Vec<String>, Vec<String>) = Default::default();
        let add = |all: &mut Vec<String>, word: &String| {
            if !all.contains(word) {
                all.push(word.clone());
            }
        };
        for table in tables {
            let placement = Placement::of(table);
            for row in 0..table.len() {
                add(&mut bases, &placement.bases[placement.base_of(row)]);
                add(&mut targets, &placement.targets[placement.target_of(row)]);
            }
            if !table.has_declared_noise(problem) {
                return Err(DesignError::no_sigma(problem));
            }
        }
        let model = Model::new(problem, &bases, &targets)?;
        if model.parameters.is_empty() {
            return Err(DesignError::nothing_free(problem));
        }
        let about = DVector::zeros(model.parameters.len());
        let mut site = Self { model, problem, bases, targets, about };
        let (mut seen, mut planned_only) = (BTreeSet::new(), BTreeSet::new());
        for table in tables {
            let mut poses = site.poses(table, &Placement::of(table));
            for pose in &poses {
                // Where nothing is measured yet, contacts tell where something stands; distances do
                // not.
                let planned = matches!(pose.observation, Observation::Distance(_))
                    && !table.position_measured;
                if let Some(fixture) = pose.observation.fixture() {
                    if planned { &mut planned_only } else { &mut seen }.insert(fixture);
                }
            }
            poses.retain(|pose| {
                table.position_measured || !matches!(pose.observation, Observation::Distance(_))
            });
            let mut about = std::mem::take(&mut site.about);
            locate(&site.model, &poses, |_| true, &mut about);
            site.about = about;
        }
        for own in
            planned_only.difference(&seen).filter_map(|&fixture| problem.fixtures.get(fixture))
        {
            if own.known.iter().any(Option::is_none) {
                let (what, name) = (own.kind.word(), own.name.clone());
                let kind =
                    InputErrorKind::PlaceUnknown { what, name, write: own.kind.declared_by(0) };
                return Err(own.location.clone().error(kind).into());
            }
        }
        Ok(site)
    }

    /// What the poses of a table tell about the nominal arm; `unit` \[m\] stands for σ, if it is
    /// given. Words that the site does not know are taken for its first.
    pub fn sensitivity(&self, table: &Measurements, unit: Option<f64>) -> Sensitivity {
        let added = |site| matches!(site, ParameterSite::Beam { field: BeamField::AddedMass, .. });
        let own = self.model.parameters.iter().zip(&self.about);
        let about = own.map(|(own, about)| if added(own.site) { PROBE_MASS } else { *about });
        self.sensitivity_at(
            table,
            unit,
            &DVector::from_iterator(self.model.parameters.len(), about),
        )
    }

    /// The same about `count` arms drawn from the priors; parameters without one stay nominal, and
    /// arms that do not come to rest in all of the poses are left out.
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
                DVector::from_iterator(n, self.model.parameters.iter().map(&mut draw)) + &self.about
            })
            .collect();
        let all = drawn.par_iter().map(|at| self.sensitivity_at(table, None, at));
        all.filter(|arm| (0..arm.len()).all(|row| arm.is_finite(row))).collect()
    }

    fn sensitivity_at(
        &self,
        table: &Measurements,
        unit: Option<f64>,
        at: &DVector<f64>,
    ) -> Sensitivity {
        let mut poses = self.poses(table, &Placement::of(table));
        for pose in &mut poses {
            pose.sigma = unit.unwrap_or(pose.sigma);
            let turn =
                self.problem.data.orientation_sigma.filter(|_| self.problem.data.fits_orientation);
            // In a unit of length, what counts are positions.
            let turn = turn.filter(|_| pose.observation.is_position());
            pose.orientation = turn
                .filter(|_| unit.is_none())
                .map(|sigma| MeasuredOrientation { measured: None, sigma });
        }
        Sensitivity::of(&self.model, &poses, at)
    }

    /// The rows of a table as poses of the site's model.
    fn poses<'t>(&self, table: &'t Measurements, placement: &Placement) -> Vec<Pose<'t>> {
        let rows: Vec<usize> = (0..table.len()).collect();
        let mut poses =
            placement.poses(table, &rows, self.problem.data.position_sigma.unwrap_or(1.0));
        let place =
            |all: &[String], word: &String| all.iter().position(|known| known == word).unwrap_or(0);
        for pose in &mut poses {
            pose.base = place(&self.bases, &placement.bases[pose.base]);
            pose.target = place(&self.targets, &placement.targets[pose.target]);
        }
        poses
    }

    /// Rows of a table in which the nominal target stays in a workspace.
    pub(super) fn inside(&self, table: &Measurements, workspace: &Workspace) -> Vec<usize> {
        let nominal = vec![0.0; self.model.parameters.len()];
        let points = self
            .model
            .predicted_targets_in_base(&self.poses(table, &Placement::of(table)), &nominal);
        (0..table.len())
            .filter(|&row| points[row].is_some_and(|point| workspace.holds(&point)))
            .collect()
    }

    /// A table without the poses in which the arm does not come to rest, and what the others tell.
    pub(super) fn at_rest(&self, table: &Measurements) -> (Measurements, Sensitivity) {
        let all = self.sensitivity(table, None);
        let rows: Vec<usize> = (0..all.len()).filter(|&row| all.is_finite(row)).collect();
        if rows.len() == all.len() {
            (table.clone(), all)
        } else {
            (table.select(&rows), all.select(&rows))
        }
    }
}
