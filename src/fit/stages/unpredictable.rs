//! Rows that the nominal arm cannot predict: poses without an equilibrium, and points behind their
//! camera.

use std::collections::BTreeMap;

use nalgebra::DVector;

use super::fitting::Fitting;
use super::fixture_location::undecided_views;
use super::marker_pose::MIN_POINTS_OF_POSE;
use super::single_views::{Numbering, SingleViews};
use crate::error::{InputError, InputErrorKind};
use crate::observation::Needs;

impl Fitting<'_> {
    /// Returns an error about the first row that the nominal arm cannot predict, because its pose
    /// has no equilibrium or a point is behind its camera. `None` if the nominal arm predicts every
    /// row.
    pub fn unpredictable(&self) -> Option<InputError> {
        let is_of_camera = |row: &usize| {
            let kind = self.measurements.observation(*row).description();
            kind.needs == Needs::Carriers
        };
        let (of_cameras, others): (Vec<usize>, Vec<usize>) =
            (0..self.measurements.len()).partition(is_of_camera);
        let lost = |rows: &[usize], x: &DVector<f64>, kind| {
            let errors = self.position_errors(rows, x);
            let place = errors.iter().position(|error| error.x.is_nan())?;
            Some(self.measurements.location(rows[place]).error(kind))
        };
        let x = DVector::zeros(self.model.parameters.len());
        let behind = || {
            let carriers = self.model.carrier_frames(&self.poses(&of_cameras), x.as_slice());
            let place = carriers.iter().position(Option::is_none);
            let kind = InputErrorKind::NoEquilibrium;
            let lost_pose = place.map(|k| self.measurements.location(of_cameras[k]).error(kind));
            lost_pose
                .or_else(|| self.unlike_marker(&of_cameras, &x))
                .or_else(|| self.undecided(&of_cameras))
                .or_else(|| self.behind_camera(&of_cameras, &x))
        };
        lost(&others, &x, InputErrorKind::NoEquilibrium)
            .or_else(|| if of_cameras.is_empty() { None } else { behind() })
    }

    /// Returns an error at the first row of a camera and a marker, among `rows`, if the points of
    /// most of their images fit the marker only with its grid counted along the other side.
    fn unlike_marker(&self, rows: &[usize], x: &DVector<f64>) -> Option<InputError> {
        let mut pairs: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        for &row in rows {
            pairs.entry(self.measurements.observation(row).fixtures()).or_default().push(row);
        }
        let error = |([camera, marker], rows): (&[Option<usize>; 2], &Vec<usize>)| {
            let views = SingleViews::of(self.model, &self.poses(rows), x)?;
            let SingleViews { declared, other, numbering } = views;
            let [camera, marker] = [(*camera)?, (*marker)?].map(|of| self.model.fixture_name(of));
            let crossed = match numbering {
                Numbering::Exchanged(points) => Some(points),
                _ => None,
            };
            let px = [declared, other];
            let kind = InputErrorKind::PointsRenumbered { camera, marker, px, crossed };
            views.are_renumbered().then(|| self.measurements.location(rows[0]).error(kind))
        };
        pairs.iter().find_map(error)
    }

    /// Returns the error of the first of `rows` whose point is behind the camera, with what the
    /// images of its camera and marker by themselves show.
    fn behind_camera(&self, rows: &[usize], x: &DVector<f64>) -> Option<InputError> {
        let errors = self.position_errors(rows, &self.located());
        let row = rows[errors.iter().position(|error| error.x.is_nan())?];
        let pair = |row: usize| self.measurements.observation(row).fixtures();
        let alike: Vec<usize> =
            rows.iter().copied().filter(|&other| pair(other) == pair(row)).collect();
        let views = SingleViews::of(self.model, &self.poses(&alike), x);
        let fits = views.map(|views| !views.miss_the_marker());
        let miss = views.map(|views| views.declared);
        let most = SingleViews::most_points(&self.poses(&alike));
        let few = if most < MIN_POINTS_OF_POSE { most } else { 0 };
        let kind = InputErrorKind::PointBehindCamera { fits, miss, few, readings: Vec::new() };
        Some(self.measurements.location(row).error(kind))
    }

    /// Returns an error at the first row of a camera and a marker whose poses the views in `rows`
    /// do not determine; `None` if they determine all of them.
    fn undecided(&self, rows: &[usize]) -> Option<InputError> {
        let x = DVector::zeros(self.model.parameters.len());
        let ([camera, marker], why) = undecided_views(self.model, &self.poses(rows), &x)?;
        let is_of_pair = |row: &&usize| {
            self.measurements.observation(**row).fixtures() == [Some(camera), Some(marker)]
        };
        let row = *rows.iter().find(is_of_pair)?;
        let [camera, marker] = [camera, marker].map(|fixture| self.model.fixture_name(fixture));
        let kind = InputErrorKind::ViewsUndecided { camera, marker, why };
        Some(self.measurements.location(row).error(kind))
    }
}
