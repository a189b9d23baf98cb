//! Scatter of the predicted target over the rows in which it touched one point.

use nalgebra::{DVector, Matrix3, SymmetricEigen, Vector3};

use crate::fit::stages::fitting::Fitting;
use crate::measurement::Split;
use crate::model::{Model, Pose};
use crate::numeric::median;
use crate::problem::{Fixture, Observation};

/// Smallest ratio of the scatter at a point to the median scatter of all points, at which the point
/// counts as unsteady. Points that were not fitted may scatter 1.5 times as much as others.
const MIN_UNSTEADY_RATIO: f64 = 2.5;
/// Smallest share of the squared scatter along one direction at which a point counts as unsteady.
/// Isotropic scatter has a third along each direction.
const MIN_DIRECTIONAL_SHARE: f64 = 0.7;
/// Minimum number of rows of a point whose scatter is compared.
const MIN_ROWS: usize = 8;
/// Minimum number of points whose scatter can be compared.
const MIN_POINTS: usize = 4;

/// Scatter of the predicted target over the rows that touch one point, independent of the point's
/// position.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq)]
pub struct PointSpread {
    /// Name of the touched point.
    pub point: String,
    /// Number of rows at the point.
    pub n: usize,
    /// Mean distance of the predicted targets from their mean position \[m\].
    pub mean: f64,
    /// Unit vector along which the scatter is largest, measuring frame.
    pub along: Vector3<f64>,
    /// Share of the squared scatter that lies along `along`, 0…1.
    pub share: f64,
}

impl PointSpread {
    /// Returns the points at which the prediction scatters far more than at the others, and mainly
    /// along one direction. The number is the ratio of the scatter to the median. Such points may
    /// have moved or yielded, which no model of the arm explains.
    #[doc(hidden)]
    pub fn unsteady<'a>(spreads: impl IntoIterator<Item = &'a Self>) -> Vec<(&'a Self, f64)> {
        let compared: Vec<&Self> = spreads
            .into_iter()
            .filter(|spread| spread.n >= MIN_ROWS && spread.mean.is_finite())
            .collect();
        let means = compared.iter().map(|spread| spread.mean);
        let Some(middle) = median(means).filter(|_| compared.len() >= MIN_POINTS) else {
            return Vec::new();
        };
        let is_unsteady = |spread: &&Self| {
            spread.mean > MIN_UNSTEADY_RATIO * middle && spread.share > MIN_DIRECTIONAL_SHARE
        };
        let unsteady = compared.into_iter().filter(is_unsteady);
        unsteady.map(|spread| (spread, spread.mean / middle)).collect()
    }
}

/// Returns the scatter at each point that some of `poses` touch, with the arm at the full parameter
/// vector `x`; NaN if a pose has no equilibrium.
pub(in crate::fit) fn spreads(
    model: &Model,
    fixtures: &[Fixture],
    poses: &[Pose],
    x: &DVector<f64>,
) -> Vec<PointSpread> {
    let bases = model.base_frames(x.as_slice());
    let points = model.predicted_targets_in_base(poses, x.as_slice());
    let of_point = |(index, fixture): (usize, &Fixture)| {
        let touching = poses
            .iter()
            .zip(&points)
            .filter(|(pose, _)| pose.observation == Observation::Point(index));
        let lost = Vector3::from_element(f64::NAN);
        let touched: Vec<Vector3<f64>> = touching
            .map(|(pose, point)| point.map_or(lost, |point| bases[pose.base].point(&point)))
            .collect();
        let n = touched.len() as f64;
        let middle = touched.iter().sum::<Vector3<f64>>() / n;
        let mean = touched.iter().map(|point| (point - middle).norm()).sum::<f64>() / n;
        let squares: Matrix3<f64> =
            touched.iter().map(|point| (point - middle) * (point - middle).transpose()).sum();
        let (along, share) = main_direction(squares);
        (!touched.is_empty()).then(|| PointSpread {
            point: fixture.name.clone(),
            n: touched.len(),
            mean,
            along,
            share,
        })
    };
    fixtures.iter().enumerate().filter_map(of_point).collect()
}

impl Fitting<'_> {
    /// Returns the scatter of the predicted target at each touched point: with the registered
    /// nominal arm and with the fitted arm, given by their full parameter vectors. The flag is true
    /// if all rows of the point are held out.
    pub fn spreads(
        &self,
        fixtures: &[Fixture],
        registered: &DVector<f64>,
        fitted: &DVector<f64>,
    ) -> Vec<(PointSpread, PointSpread, bool)> {
        let (rows, Split { identification, .. }) =
            ((0..self.measurements.len()).collect::<Vec<_>>(), self.split);
        let poses = self.poses(&rows);
        let of = |x: &DVector<f64>| spreads(self.model, fixtures, &poses, x);
        let was_fitted = |name: &str| {
            identification.iter().any(|&row| match self.measurements.observation(row) {
                Observation::Point(point) => fixtures[point].name == name,
                _ => false,
            })
        };
        let both = of(registered).into_iter().zip(of(fitted));
        let with_part = |(before, after): (PointSpread, PointSpread)| {
            let held_out = !was_fitted(&before.point);
            (before, after, held_out)
        };
        both.map(with_part).collect()
    }
}

/// Returns the unit vector along which the sum of squares is largest, with its largest component
/// positive, and the share of the squares along it. `squares` is Σ d dᵀ of the deviations d. NaN if
/// it is zero or not finite.
fn main_direction(squares: Matrix3<f64>) -> (Vector3<f64>, f64) {
    let trace = squares.trace();
    if !(trace.is_finite() && trace > 0.0) {
        return (Vector3::from_element(f64::NAN), f64::NAN);
    }
    let eigen = SymmetricEigen::new(squares);
    let most = eigen.eigenvalues.imax();
    let along: Vector3<f64> = eigen.eigenvectors.column(most).into_owned();
    (along * along[along.iamax()].signum(), eigen.eigenvalues[most] / trace)
}
