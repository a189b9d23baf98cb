//! Test without a model of the arm whether measured positions depend on the joint angles of their
//! rows.
//!
//! The squared distance of two positions is regressed on 1 − cos Δq of each turning joint and Δq²
//! of each sliding joint. Its coefficient of determination R² is compared with those of randomly
//! exchanged rows, as in the test of two matrices of distances of [Mantel 1967].

use nalgebra::{DMatrix, DVector, Vector3};
use rand::seq::SliceRandom as _;

use super::checked_fit::CheckedFit;
use crate::numeric::spaced;
use crate::random;

/// Maximum number of rows, evenly spaced, whose pairs are regressed.
const MAX_ROWS: usize = 60;
/// Minimum number of rows of the test.
const MIN_ROWS: usize = 20;
/// Number of random orders of the rows.
const ORDERS: u64 = 99;
/// Seed of these orders.
const SEED: u64 = 1;
/// Number of random orders with a larger R² at which measured positions do not depend on joints:
/// three of a hundred tables without any dependence have fewer.
const MIN_LARGER: usize = 3;
/// Smallest ratio of R² of the positions that the nominal arm predicts to the largest R² of a random
/// order, at which a dependence would be seen.
const MIN_RATIO: f64 = 1.5;

/// Joint columns that do not belong to the positions of their rows.
pub(super) struct OtherRows {
    /// Indices of the joints.
    pub joints: Vec<usize>,
    /// R² of the measured positions and of those that the nominal arm predicts.
    pub determination: [f64; 2],
}

/// Pairs of rows with their regressors.
struct Pairs {
    rows: Vec<[usize; 2]>,
    /// Configurations, one for each row.
    configurations: Vec<Vec<f64>>,
    /// Index of each joint, and whether it is revolute.
    joints: Vec<(usize, bool)>,
}

/// Returns the joints whose columns the measured positions do not depend on although those that the
/// nominal arm predicts do: all of the `joints`, or one of them.
pub(super) fn other_rows(fit: &CheckedFit, joints: &[usize]) -> Option<OtherRows> {
    let measurements = fit.table();
    let kind = fit.kind(measurements.leading());
    let rows = spaced(kind.rows, MAX_ROWS);
    if rows.len() < MIN_ROWS || joints.is_empty() {
        return None;
    }
    let poses = fit.fitting.poses(&rows);
    // Fitted to other rows, a free target would move to where joints have no effect.
    let nominal = fit.fitting.located();
    let predicted = fit.model().predicted_targets(&poses, nominal.as_slice());
    let measured: Vec<Vector3<f64>> = rows.iter().map(|&row| measurements.positions[row]).collect();
    let is_turning = |joint: usize| fit.turns(joint);
    // Distances between rows of different bases depend on where these stand.
    let places = (0..rows.len()).flat_map(|one| (0..one).map(move |other| [one, other]));
    let pairs = Pairs {
        rows: places.filter(|&[one, other]| poses[one].base == poses[other].base).collect(),
        configurations: rows.iter().map(|&row| measurements.configuration(row).to_vec()).collect(),
        joints: joints.iter().map(|&joint| (joint, is_turning(joint))).collect(),
    };
    let is_unrelated = |exchanged: &[usize]| -> Option<[f64; 2]> {
        let random: Vec<[f64; 2]> = (1..=ORDERS)
            .filter_map(|order| pairs.determination([&measured, &predicted], exchanged, order))
            .collect();
        let [of_measured, of_predicted] = pairs.determination([&measured, &predicted], &[], 0)?;
        let larger = random.iter().filter(|of| of[0] >= of_measured).count();
        let largest = random.iter().map(|of| of[1]).fold(0.0, f64::max);
        (larger >= MIN_LARGER && of_predicted > MIN_RATIO * largest)
            .then_some([of_measured, of_predicted])
    };
    let of_joints = |joints: &[usize]| {
        let determination = is_unrelated(joints)?;
        Some(OtherRows { joints: joints.to_vec(), determination })
    };
    of_joints(joints).or_else(|| joints.iter().find_map(|&joint| of_joints(&[joint])))
}

impl Pairs {
    /// Returns R² of the squared distances of each set of points, with the coordinates of the
    /// `exchanged` joints taken from other rows in a random order; `None` if the regressors are
    /// dependent.
    fn determination(
        &self,
        points: [&[Vector3<f64>]; 2],
        exchanged: &[usize],
        number: u64,
    ) -> Option<[f64; 2]> {
        let mut order: Vec<usize> = (0..self.configurations.len()).collect();
        order.shuffle(&mut random::stream(SEED, number));
        let coordinate = |row: usize, joint: usize| {
            let row = if exchanged.contains(&joint) { order[row] } else { row };
            self.configurations[row][joint]
        };
        let value = |pair: usize, column: usize| {
            let Some(&(joint, is_turning)) = self.joints.get(column) else { return 1.0 };
            let [one, other] = self.rows[pair];
            let difference = coordinate(one, joint) - coordinate(other, joint);
            if is_turning { 1.0 - difference.cos() } else { difference.powi(2) }
        };
        let regressors = DMatrix::from_fn(self.rows.len(), self.joints.len() + 1, value);
        // A joint that stands still has no influence.
        let ridge = DMatrix::identity(regressors.ncols(), regressors.ncols()) * f64::EPSILON;
        let factor = (regressors.tr_mul(&regressors) + ridge).cholesky()?;
        Some(points.map(|points| {
            let squares = self.rows.iter().map(|&[one, other]| points[one] - points[other]);
            let squares = squares.map(|difference| difference.norm_squared());
            let squares = DVector::from_iterator(self.rows.len(), squares);
            let coefficients = factor.solve(&regressors.tr_mul(&squares));
            let rest = (&squares - &regressors * coefficients).norm_squared();
            let mean = squares.mean();
            1.0 - rest / squares.map(|of| (of - mean).powi(2)).sum()
        }))
    }
}
