//! Inducing variables: the values of the remainder on which its Gaussian processes are conditioned
//! instead of on all rows.

use nalgebra::DMatrix;

use super::kernel::{Hyperparameters, covariance, matern, squared_distance};
use super::rows::{AXES, Inputs, Rows};

/// Number of knots of a joint's function uⱼ per correlation length ℓᵤ.
const KNOTS_PER_LENGTH: f64 = 2.0;
/// Maximum number of knots of one site's function uⱼ.
const MAX_KNOTS: usize = 90;

/// Inducing variables: the remainder's shift of the position at some rows, and the values of the
/// functions uⱼ of single joints at knots.
#[derive(Debug, Clone)]
pub(super) struct Inducing {
    /// Rows at which the shift of the position (three coordinates) is an inducing variable. Their
    /// residuals and Jacobians are not used.
    pub centres: Rows,
    /// Knots of the functions uⱼ of single joints.
    pub knots: Vec<Knot>,
}

/// Inducing variable: the value of a site's function uⱼ at one value of its input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Knot {
    pub site: usize,
    /// Input at which the function uⱼ of the site is an inducing variable: \[rad\] for angles,
    /// otherwise standardised (mean 0, standard deviation 1 over the fitted rows).
    pub at: f64,
}

impl Inducing {
    /// Creates the inducing variables at the rows with the indices `centres`. Unless the centres
    /// are all rows, the functions uⱼ also get knots over the range of their commands in the rows.
    pub fn new(rows: &Rows, centres: &[usize], hyper: &Hyperparameters, inputs: &Inputs) -> Self {
        let is_exact = hyper.sites() == 0 || centres.len() == rows.len();
        let centres = rows.select(if hyper.sites() == 0 { &[] } else { centres });
        if is_exact {
            return Self { centres, knots: Vec::new() };
        }
        let sites =
            inputs.sites.iter().enumerate().filter_map(|(site, of)| Some((of.single?, site)));
        let knots = sites.flat_map(|(input, site)| {
            let values = rows.inputs.row(input);
            let (low, width) = (values.min(), values.max() - values.min());
            let wanted = (KNOTS_PER_LENGTH * width / hyper.single_lengths[site]).ceil();
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "between 1 and the limit"
            )]
            let steps = wanted.clamp(1.0, (MAX_KNOTS - 1) as f64) as usize;
            (0..=steps).map(move |k| Knot { site, at: low + width * k as f64 / steps as f64 })
        });
        Self { centres, knots: knots.collect() }
    }

    /// Returns the number of inducing variables.
    pub fn len(&self) -> usize {
        AXES * self.centres.len() + self.knots.len()
    }

    /// Returns the covariance of the remainder's shift at `rows` \[m\] with the inducing variables,
    /// shape = (3 rows, len).
    pub fn cross(&self, hyper: &Hyperparameters, inputs: &Inputs, rows: &Rows) -> DMatrix<f64> {
        let width = AXES * self.centres.len();
        let cross = covariance(hyper, inputs, rows, &self.centres);
        if self.knots.is_empty() {
            return cross;
        }
        let mut cross = cross.resize_horizontally(self.len(), 0.0);
        for (knot, mut column) in
            self.knots.iter().zip(cross.columns_range_mut(width..).column_iter_mut())
        {
            for row in 0..rows.len() {
                let value = inputs.sites[knot.site].single.map_or(0.0, |k| rows.inputs[(k, row)]);
                let covariance = single_covariance(hyper, inputs, knot, value);
                for axis in AXES * row..AXES * (row + 1) {
                    column[axis] = covariance * rows.sites[(knot.site, axis)];
                }
            }
        }
        cross
    }

    /// Returns the covariance matrix of the inducing variables, shape = (len, len).
    pub fn covariance(&self, hyper: &Hyperparameters, inputs: &Inputs) -> DMatrix<f64> {
        let first = AXES * self.centres.len();
        let mut whole = self.cross(hyper, inputs, &self.centres).resize_vertically(self.len(), 0.0);
        for (i, knot) in self.knots.iter().enumerate() {
            for (j, other) in
                self.knots.iter().enumerate().filter(|(_, other)| other.site == knot.site)
            {
                whole[(first + i, first + j)] = single_covariance(hyper, inputs, knot, other.at);
            }
        }
        let below = whole.view((0, first), (first, self.knots.len())).transpose();
        whole.view_mut((first, 0), below.shape()).copy_from(&below);
        whole
    }
}

/// Returns the covariance of a site's function uⱼ at a knot with the same function at `value`
/// \[m²\].
fn single_covariance(hyper: &Hyperparameters, inputs: &Inputs, knot: &Knot, value: f64) -> f64 {
    let is_angle = inputs.sites[knot.site].single.is_some_and(|input| inputs.angles[input]);
    let squared = squared_distance(is_angle, value - knot.at);
    let length = hyper.single_lengths[knot.site];
    hyper.single[knot.site].powi(2) * matern(squared / (length * length)).0
}
