//! How far apart the arm puts its target in rows in which it was at one and the same point.

use nalgebra::{DVector, Matrix3, SymmetricEigen, Vector3};

use crate::fit::stages::fitting::Fitting;
use crate::measurement::Split;
use crate::model::{Model, Pose};
use crate::numeric::median;
use crate::problem::{Fixture, Observation};

/// A point whose spread is so many times the median of all: points that took no part in a fit may
/// spread half as much again.
const UNSTEADY: f64 = 2.5;
/// … and whose squares are to this part along one direction, where scatter of equal size in all has
/// a third there.
const ONE_WAY: f64 = 0.7;
/// … of so many rows at least, and so many points.
const LEAST: usize = 8;
const LEAST_POINTS: usize = 4;

/// What an arm makes of the rows at one point; no place of the point takes part.
#[derive(Debug, Clone, PartialEq)]
pub struct PointSpread {
    /// Name of the point.
    pub point: String,
    /// Its rows.
    pub n: usize,
    /// Mean distance of the predicted target from its mean \[m\].
    pub mean: f64,
    /// Direction in which it is largest, measuring frame.
    pub along: Vector3<f64>,
    /// Part of the squares that lies along it.
    pub share: f64,
}

impl PointSpread {
    /// Those of some points that spread far more than the others and along one direction alone:
    /// what they are fixed to may have moved or given way, which no arm explains. Each with its
    /// spread over the median of all.
    pub fn unsteady<'a>(all: impl IntoIterator<Item = &'a Self>) -> Vec<(&'a Self, f64)> {
        let all: Vec<&Self> =
            all.into_iter().filter(|own| own.n >= LEAST && own.mean.is_finite()).collect();
        let Some(middle) =
            median(all.iter().map(|own| own.mean)).filter(|_| all.len() >= LEAST_POINTS)
        else {
            return Vec::new();
        };
        let stands_out = |own: &&Self| own.mean > UNSTEADY * middle && own.share > ONE_WAY;
        all.into_iter().filter(stands_out).map(|own| (own, own.mean / middle)).collect()
    }
}

/// The spread at each point that some of `poses` touch, with the arm at the full parameter vector
/// `x`; NaN where a pose has no equilibrium.
pub(in crate::fit) fn spreads(
    model: &Model,
    fixtures: &[Fixture],
    poses: &[Pose],
    x: &DVector<f64>,
) -> Vec<PointSpread> {
    let bases = model.base_frames(x.as_slice());
    let points = model.predicted_targets_in_base(poses, x.as_slice());
    let of_point = |(index, fixture): (usize, &Fixture)| {
        let own = poses
            .iter()
            .zip(&points)
            .filter(|(pose, _)| pose.observation == Observation::Point(index));
        let lost = Vector3::from_element(f64::NAN);
        let own: Vec<Vector3<f64>> = own
            .map(|(pose, point)| point.map_or(lost, |point| bases[pose.base].point(&point)))
            .collect();
        let n = own.len() as f64;
        let middle = own.iter().sum::<Vector3<f64>>() / n;
        let mean = own.iter().map(|point| (point - middle).norm()).sum::<f64>() / n;
        let squares: Matrix3<f64> =
            own.iter().map(|point| (point - middle) * (point - middle).transpose()).sum();
        let (along, share) = longest(squares);
        (!own.is_empty()).then(|| PointSpread {
            point: fixture.name.clone(),
            n: own.len(),
            mean,
            along,
            share,
        })
    };
    fixtures.iter().enumerate().filter_map(of_point).collect()
}

impl Fitting<'_> {
    /// The spread of the target at each point that was touched, with the arm at the full parameter
    /// vectors of the registered nominal arm and of the fitted one, and whether all of the point's
    /// rows were held out.
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

/// The direction in which squares are largest, its largest component positive, and their part along
/// it; NaN where they are not known.
fn longest(squares: Matrix3<f64>) -> (Vector3<f64>, f64) {
    let trace = squares.trace();
    if !(trace.is_finite() && trace > 0.0) {
        return (Vector3::from_element(f64::NAN), f64::NAN);
    }
    let own = SymmetricEigen::new(squares);
    let most = own.eigenvalues.imax();
    let along: Vector3<f64> = own.eigenvectors.column(most).into_owned();
    (along * along[along.iamax()].signum(), own.eigenvalues[most] / trace)
}
