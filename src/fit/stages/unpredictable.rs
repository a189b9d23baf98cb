//! Rows that the nominal arm cannot predict: poses without an equilibrium, and points behind their
//! camera.

use nalgebra::DVector;

use super::fitting::Fitting;
use super::fixture_location::undecided_views;
use super::single_views::SingleViews;
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
                .or_else(|| {
                    let behind = self.behind_camera(&of_cameras, &x);
                    lost(&of_cameras, &self.located(), behind)
                })
        };
        lost(&others, &x, InputErrorKind::NoEquilibrium)
            .or_else(|| if of_cameras.is_empty() { None } else { behind() })
    }

    /// Returns an error about the first of `rows` if the points of most images fit the marker only
    /// with its grid counted along the other side.
    fn unlike_marker(&self, rows: &[usize], x: &DVector<f64>) -> Option<InputError> {
        let views = SingleViews::of(self.model, &self.poses(rows), x)?;
        let SingleViews { declared, transposed } = views;
        let kind = InputErrorKind::GridTransposed { declared, transposed };
        views.are_transposed().then(|| self.measurements.location(rows[0]).error(kind))
    }

    /// Returns the error of a point behind the camera, with what the images by themselves show.
    fn behind_camera(&self, rows: &[usize], x: &DVector<f64>) -> InputErrorKind {
        let views = SingleViews::of(self.model, &self.poses(rows), x);
        let fits = views.map(|views| !views.miss_the_marker());
        InputErrorKind::PointBehindCamera { fits, miss: views.map(|views| views.declared) }
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
