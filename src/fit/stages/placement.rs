//! Base and target of each row, and the bases, targets and fixtures that only held-out rows use.

use std::collections::BTreeSet;

use nalgebra::{DVector, Vector3};

use crate::measurement::{Measurements, Split, StartTimes};
use crate::model::parameter::ParameterSite;
use crate::model::{MeasuredOrientation, Model, Pose};
use crate::problem::Problem;

/// Standard deviation (1 σ) of a measured coordinate \[m\] with which a fit starts if none is
/// declared.
pub(in crate::fit) const ASSUMED_SIGMA: f64 = 1e-3;

/// Assignment of the rows of a table to bases (poses of the arm's base, one per session) and
/// targets (measured points on the arm).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Placement {
    /// Names of the bases: those of the sessions.
    pub bases: Vec<String>,
    /// Names of the targets: the words of the column `target`, or those of the sessions without
    /// that column.
    pub targets: Vec<String>,
    base_of_row: Vec<usize>,
    target_of_row: Vec<usize>,
    /// True if times were measured; otherwise they are the numbers of the rows.
    is_timed: bool,
}

impl Placement {
    /// Creates the assignment from the columns `session` and `target` of a table.
    pub fn of(measurements: &Measurements) -> Self {
        let session = &measurements.session;
        let target = measurements.target.as_ref().unwrap_or(session);
        Self {
            bases: session.names.clone(),
            targets: target.names.clone(),
            base_of_row: session.of_row.clone(),
            target_of_row: target.of_row.clone(),
            is_timed: measurements.time_measured,
        }
    }

    /// Returns the index of the base of a row in `bases`.
    pub fn base_of(&self, row: usize) -> usize {
        self.base_of_row[row]
    }

    /// Returns the index of the target of a row in `targets`.
    pub fn target_of(&self, row: usize) -> usize {
        self.target_of_row[row]
    }

    /// Returns the root mean square over `rows` of the declared σ of a coordinate \[m\]; rows
    /// without one have 1 mm.
    pub fn sigma(&self, measurements: &Measurements, rows: &[usize], problem: &Problem) -> f64 {
        let whole = problem.data.position_sigma.unwrap_or(ASSUMED_SIGMA);
        let squares = rows.iter().map(|&row| measurements.sigma_of(row).unwrap_or(whole).powi(2));
        if rows.is_empty() { whole } else { (squares.sum::<f64>() / rows.len() as f64).sqrt() }
    }

    /// Returns `rows` as poses without orientations; `sigma` \[m\] is the σ of a coordinate in rows
    /// that state none.
    pub fn poses<'a>(
        &self,
        measurements: &'a Measurements,
        rows: &[usize],
        sigma: f64,
    ) -> Vec<Pose<'a>> {
        let starts = measurements.session_starts();
        rows.iter()
            .map(|&row| Pose {
                setup: measurements.setup(row, &starts),
                base: self.base_of_row[row],
                target: self.target_of_row[row],
                observation: measurements.observation(row),
                measured: &measurements.positions[row],
                sigma: measurements.sigma_of(row).unwrap_or(sigma),
                orientation: None,
            })
            .collect()
    }

    /// Sets the elapsed times of `poses` to those since the start of their session in an earlier
    /// table. Poses without a time, or of sessions without an earlier start, keep the time since the
    /// first pose of their session.
    pub(crate) fn count_time_from(&self, starts: &StartTimes, poses: &mut [Pose]) {
        if !self.is_timed {
            return;
        }
        let starts: Vec<Option<f64>> =
            self.bases.iter().map(|session| starts.of_session(session)).collect();
        for pose in poses {
            if let Some(start) = starts[pose.base] {
                pose.setup.elapsed = pose.setup.time - start;
            }
        }
    }

    /// Returns `rows` as poses, with their measured orientations if the σ `turn` of an orientation
    /// \[rad\] is given. `sigma` \[m\] is the σ of a coordinate in rows that state none.
    pub fn oriented_poses<'a>(
        &self,
        measurements: &'a Measurements,
        rows: &[usize],
        (sigma, turn): (f64, Option<f64>),
    ) -> Vec<Pose<'a>> {
        let mut poses = self.poses(measurements, rows, sigma);
        if let Some(sigma) = turn {
            for (pose, &row) in
                poses.iter_mut().zip(rows).filter(|(pose, _)| pose.observation.is_position())
            {
                let measured =
                    |orientation| MeasuredOrientation { measured: Some(orientation), sigma };
                pose.orientation = measurements.orientation(row).map(measured);
            }
        }
        poses
    }

    /// Returns the residuals measured − predicted of `rows` at the full parameter vector `x`:
    /// positions in the measuring frame \[m\], other rows in the unit of their kind. NaN where the
    /// arm has no equilibrium.
    pub fn position_errors(
        &self,
        model: &Model,
        x: &DVector<f64>,
        measurements: &Measurements,
        rows: &[usize],
    ) -> Vec<Vector3<f64>> {
        model.residuals(self.poses(measurements, rows, 1.0), x)
    }

    /// Finds the parameters of bases, targets and fixtures that only held-out rows use, and those
    /// rows.
    ///
    /// These parameters have no effect on the fitted rows, so they are fitted to their held-out
    /// rows, with the arm's parameters fixed.
    pub(in crate::fit) fn held_out_only(
        &self,
        model: &Model,
        measurements: &Measurements,
        split: &Split,
    ) -> HeldOutOnly {
        let unused = |count: usize, of_row: &[usize]| {
            let mut unused = vec![true; count];
            split.identification.iter().for_each(|&row| unused[of_row[row]] = false);
            unused
        };
        let bases = unused(self.bases.len(), &self.base_of_row);
        let targets = unused(self.targets.len(), &self.target_of_row);
        let fixtures_of = |rows: &[usize]| -> BTreeSet<usize> {
            rows.iter()
                .flat_map(|&row| measurements.observation(row).fixtures())
                .flatten()
                .collect()
        };
        let fitted = fixtures_of(&split.identification);
        let fixtures: BTreeSet<usize> =
            fixtures_of(&split.held_out).difference(&fitted).copied().collect();
        let parameters = model
            .parameters
            .iter()
            .map(|parameter| match parameter.site {
                ParameterSite::Base { base, .. } => bases[base],
                ParameterSite::Target { target, .. } => targets[target],
                ParameterSite::Fixture { fixture, .. } => fixtures.contains(&fixture),
                _ => false,
            })
            .collect();
        let of_fixture =
            |row: usize| measurements.observation(row).fixtures().into_iter().flatten();
        let uses = |&&row: &&usize| {
            bases[self.base_of_row[row]]
                || targets[self.target_of_row[row]]
                || of_fixture(row).any(|fixture| fixtures.contains(&fixture))
        };
        HeldOutOnly { parameters, rows: split.held_out.iter().filter(uses).copied().collect() }
    }
}

/// Bases, targets and fixtures that only held-out rows use.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::fit) struct HeldOutOnly {
    /// For each parameter of the model, true if it belongs to such a base, target or fixture.
    pub parameters: Vec<bool>,
    /// Held-out rows that use such a base, target or fixture.
    pub rows: Vec<usize>,
}
