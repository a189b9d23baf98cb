//! Covariance of the remainder between poses: Matérn 5/2 processes of joint errors, carried to the
//! target by the arm's Jacobian.

use nalgebra::{DMatrix, Matrix3};
use rayon::prelude::*;

use super::rows::{AXES, Inputs, Rows};

/// Hyperparameters of the remainder.
///
/// The error of site j is uⱼ(qⱼ) + vⱼ(q), with uⱼ ~ GP(0, a²ᵤⱼ k(·/ℓᵤ)) a function of the joint's
/// own command and vⱼ ~ GP(0, a²ᵥⱼ k(·/ℓᵥ)) a function of all inputs; k is the Matérn 5/2
/// correlation. Measurements add σ² for each coordinate and σ_c² that rows of one configuration
/// share.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Hyperparameters {
    /// aᵤⱼ of each site: 1 σ of its effect on the target \[m\].
    pub single: Vec<f64>,
    /// aᵥⱼ of each site, likewise \[m\].
    pub joint: Vec<f64>,
    /// ℓᵤ and ℓᵥ: \[rad\] for revolute joints, standard deviations of other inputs.
    pub lengths: [f64; 2],
    /// σ \[m\].
    pub noise: f64,
    /// σ_c \[m\]; 0 where no configuration is measured twice.
    pub shared_noise: f64,
}

impl Hyperparameters {
    /// Hyperparameters of a model without a remainder.
    pub fn without_remainder(noise: f64, shared_noise: f64) -> Self {
        Self { single: Vec::new(), joint: Vec::new(), lengths: [1.0; 2], noise, shared_noise }
    }

    /// Number of sites that err; 0 without a remainder.
    pub fn sites(&self) -> usize {
        self.single.len()
    }

    /// Variance of the noise of one coordinate \[m²\].
    pub fn noise_variance(&self) -> f64 {
        self.noise.powi(2) + self.shared_noise.powi(2)
    }
}

/// Matérn 5/2 correlation at the squared scaled distance d², (1 + √5 d + 5/3 d²) exp(−√5 d), and
/// its derivative with respect to ln ℓ.                            [Rasmussen & Williams 2006, eq. 4.17]
#[inline]
pub(super) fn matern(squared: f64) -> (f64, f64) {
    let scaled = (5.0 * squared).sqrt();
    let decay = (-scaled).exp();
    let correlation = (1.0 + scaled + 5.0 / 3.0 * squared) * decay;
    (correlation, 5.0 / 3.0 * squared * (1.0 + scaled) * decay)
}

/// Squared distance between two values of an input: (2 sin Δ/2)² of angles, Δ² of standardised
/// values of others.
#[inline]
pub(super) fn squared_distance(is_angle: bool, difference: f64) -> f64 {
    if is_angle { (2.0 * (0.5 * difference).sin()).powi(2) } else { difference * difference }
}

/// Covariances of the joint errors of two poses: one for each site \[m²\].
pub(super) struct SiteCovariance<'a> {
    hyper: &'a Hyperparameters,
    inputs: &'a Inputs,
    inverse_squares: [f64; 2],
}

impl<'a> SiteCovariance<'a> {
    /// Prepares the covariance of inputs of these kinds.
    pub fn new(hyper: &'a Hyperparameters, inputs: &'a Inputs) -> Self {
        Self { hyper, inputs, inverse_squares: hyper.lengths.map(|length| length.powi(-2)) }
    }

    /// Writes the covariance of each site's error at two poses with these inputs.
    #[inline]
    pub fn write(&self, first: &[f64], second: &[f64], out: &mut [f64]) {
        let mut sum = 0.0;
        out.fill(0.0);
        let [single, joint] = self.inverse_squares;
        let squares = first.iter().zip(second).zip(&self.inputs.angles);
        for (input, ((first, second), &is_angle)) in squares.enumerate() {
            let squared = squared_distance(is_angle, first - second);
            sum += squared;
            // The first inputs are the commands of the sites that may err.
            if let Some(site) = self.inputs.site_of.get(input).copied().flatten() {
                out[site] = self.hyper.single[site].powi(2) * matern(squared * single).0;
            }
        }
        let shared = matern(sum * joint).0;
        for (out, amplitude) in out.iter_mut().zip(&self.hyper.joint) {
            *out += amplitude * amplitude * shared;
        }
    }
}

/// Covariance of the remainder at the rows `left` and `right`, shape = (3 left, 3 right) \[m²\].
pub(super) fn covariance(
    hyper: &Hyperparameters,
    inputs: &Inputs,
    left: &Rows,
    right: &Rows,
) -> DMatrix<f64> {
    let (height, width) = (AXES * left.len(), AXES * right.len());
    let mut out = DMatrix::from_vec(height, width, vec![0.0; height * width]);
    if hyper.sites() == 0 || out.is_empty() {
        return out;
    }
    let kernel = SiteCovariance::new(hyper, inputs);
    let columns = |(pose, out): (usize, &mut [f64])| {
        let (mut sites, mut carried) = (vec![0.0; hyper.sites()], Vec::new());
        for row in 0..left.len() {
            kernel.write(left.inputs_of(row), right.inputs_of(pose), &mut sites);
            for b in 0..AXES {
                let second = right.sites_of(AXES * pose + b);
                let weighted =
                    second.iter().zip(&sites).map(|(site, covariance)| site * covariance);
                carried.clear();
                carried.extend(weighted);
                for a in 0..AXES {
                    let first = left.sites_of(AXES * row + a).iter().zip(&carried);
                    out[b * height + AXES * row + a] = first.map(|(a, b)| a * b).sum();
                }
            }
        }
    };
    out.as_mut_slice().par_chunks_mut(AXES * height).enumerate().for_each(columns);
    out
}

/// Prior covariance of the remainder at one pose, shape = (3, 3) \[m²\].
pub(super) fn variance(hyper: &Hyperparameters, rows: &Rows, pose: usize) -> Matrix3<f64> {
    Matrix3::from_fn(|a, b| {
        (0..hyper.sites())
            .map(|site| {
                (hyper.single[site].powi(2) + hyper.joint[site].powi(2))
                    * rows.sites[(site, AXES * pose + a)]
                    * rows.sites[(site, AXES * pose + b)]
            })
            .sum()
    })
}
