//! Covariance of the remainder between poses: Matérn 5/2 processes of joint errors, carried to the
//! target by the arm's Jacobian.

use nalgebra::{DMatrix, Matrix3};
use rayon::prelude::*;

use super::rows::{AXES, Inputs, Rows};

/// Hyperparameters of the remainder.
///
/// The error of site j is uⱼ(qⱼ) + vⱼ(q), with uⱼ ~ GP(0, a²ᵤⱼ k(·/ℓᵤⱼ)) a function of the joint's
/// own command and vⱼ ~ GP(0, a²ᵥⱼ k(·/ℓᵥ)) a function of all inputs, each with a length in ℓᵥ; k is
/// the Matérn 5/2 correlation. Measurements add σ² for each coordinate and σ_c² that rows of one
/// configuration share.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Hyperparameters {
    /// aᵤⱼ of each site: 1 σ of its effect on the target \[m\].
    pub single: Vec<f64>,
    /// aᵥⱼ of each site, likewise \[m\].
    pub joint: Vec<f64>,
    /// a of the constant of each site, likewise \[m\].
    pub constant: Vec<f64>,
    /// ℓᵤⱼ of each site: \[rad\] for revolute joints, standard deviations of other inputs.
    pub single_lengths: Vec<f64>,
    /// ℓᵥ of each input, in the same units.
    pub joint_lengths: Vec<f64>,
    /// σ \[m\].
    pub noise: f64,
    /// σ_c \[m\]; 0 where no configuration is measured twice.
    pub shared_noise: f64,
}

impl Hyperparameters {
    /// Hyperparameters of a model without a remainder.
    pub fn without_remainder(noise: f64, shared_noise: f64) -> Self {
        Self {
            single: Vec::new(),
            joint: Vec::new(),
            constant: Vec::new(),
            single_lengths: Vec::new(),
            joint_lengths: Vec::new(),
            noise,
            shared_noise,
        }
    }

    /// Number of sites that err; 0 without a remainder.
    pub fn sites(&self) -> usize {
        self.single.len()
    }

    /// Prior variance of the error at a site \[m²\].
    pub fn site_variance(&self, site: usize) -> f64 {
        [self.single[site], self.joint[site], self.constant[site]].iter().map(|a| a * a).sum()
    }

    /// Variance of the noise of one coordinate of a row with this relative σ \[m²\].
    pub fn noise_variance_of(&self, relative_sigma: f64) -> f64 {
        (self.noise * relative_sigma).powi(2) + self.shared_noise.powi(2)
    }
}

/// Matérn 5/2 correlation at the squared scaled distance d², (1 + √5 d + 5/3 d²) exp(−√5 d), and
/// its derivative with respect to −½ d², both  [Rasmussen & Williams 2006, eq. 4.17]
#[inline]
pub(super) fn matern(squared: f64) -> (f64, f64) {
    let scaled = (5.0 * squared).sqrt();
    let decay = (-scaled).exp();
    let correlation = (1.0 + scaled + 5.0 / 3.0 * squared) * decay;
    (correlation, 5.0 / 3.0 * (1.0 + scaled) * decay)
}

/// Coordinates in which squared distances of inputs are sums of squares, shape = (2 inputs, rows):
/// (cos q, sin q) of angles, (x, 0) of standardised values.
pub(super) fn embedded(inputs: &Inputs, rows: &Rows) -> DMatrix<f64> {
    DMatrix::from_fn(2 * inputs.angles.len(), rows.len(), |k, row| {
        let value = rows.inputs[(k / 2, row)];
        match (inputs.angles[k / 2], k % 2) {
            (true, 0) => value.cos(),
            (true, _) => value.sin(),
            (false, 0) => value,
            (false, _) => 0.0,
        }
    })
}

/// Squared distance between two values of an input: (2 sin Δ/2)² of angles, Δ² of standardised
/// values of others.
pub(super) fn squared_distance(is_angle: bool, difference: f64) -> f64 {
    if is_angle { (2.0 * (0.5 * difference).sin()).powi(2) } else { difference * difference }
}

/// Squared distance of two rows in each input: (2 sin Δ/2)² of angles, Δ² of standardised values.
#[inline]
pub(super) fn squared_distances<'a>(
    first: &'a [f64],
    second: &'a [f64],
) -> impl Iterator<Item = f64> + 'a {
    let pairs = first.chunks_exact(2).zip(second.chunks_exact(2));
    pairs.map(|(a, b)| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2))
}

/// Covariances of the errors of the sites at two poses \[m²\].
pub(super) struct SiteCovariance<'a> {
    inputs: &'a Inputs,
    /// a²ᵤⱼ and ℓᵤⱼ⁻² of each site.
    single: Vec<(f64, f64)>,
    /// a²ᵥⱼ of each site, and that of its constant.
    joint: Vec<(f64, f64)>,
    /// ℓᵥ⁻² of each input.
    joint_scales: Vec<f64>,
}

impl<'a> SiteCovariance<'a> {
    /// Prepares the covariance of inputs of these kinds.
    pub fn new(hyper: &Hyperparameters, inputs: &'a Inputs) -> Self {
        let single = hyper.single.iter().zip(&hyper.single_lengths);
        let joint = hyper.joint.iter().zip(&hyper.constant);
        Self {
            inputs,
            single: single.map(|(size, length)| (size * size, length.powi(-2))).collect(),
            joint: joint.map(|(size, constant)| (size * size, constant * constant)).collect(),
            joint_scales: hyper.joint_lengths.iter().map(|length| length.powi(-2)).collect(),
        }
    }

    /// Writes the covariance of each site's error at two poses with these embedded inputs; `squares`
    /// receives the squared distance in each input.
    #[inline]
    pub fn write(&self, first: &[f64], second: &[f64], squares: &mut [f64], out: &mut [f64]) {
        let mut sum = 0.0;
        for (input, squared) in squared_distances(first, second).enumerate() {
            squares[input] = squared;
            sum += squared * self.joint_scales[input];
        }
        let shared = matern(sum).0;
        for (site, out) in out.iter_mut().enumerate() {
            let (variance, constant) = self.joint[site];
            *out = variance * shared + constant;
            if let Some(input) = self.inputs.sites[site].single {
                let (variance, scale) = self.single[site];
                *out += variance * matern(squares[input] * scale).0;
            }
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
    let [of_left, of_right] = [left, right].map(|rows| embedded(inputs, rows));
    let of_row = |of: &DMatrix<f64>, row: usize| {
        let n = of.nrows();
        n * row..n * (row + 1)
    };
    let columns = |(pose, out): (usize, &mut [f64])| {
        let mut sites = vec![0.0; hyper.sites()];
        let mut squares = vec![0.0; inputs.angles.len()];
        let second = &of_right.as_slice()[of_row(&of_right, pose)];
        for row in 0..left.len() {
            kernel.write(
                &of_left.as_slice()[of_row(&of_left, row)],
                second,
                &mut squares,
                &mut sites,
            );
            carry(&sites, (left, row), (right, pose), |a, b, value| {
                out[b * height + AXES * row + a] = value;
            });
        }
    };
    out.as_mut_slice().par_chunks_mut(AXES * height).enumerate().for_each(columns);
    out
}

/// Carries covariances of the sites to the target: calls `enter` with each pair of axes and
/// Σ A₁ₐ c A₂ᵦ over the sites.
#[inline]
pub(super) fn carry(
    sites: &[f64],
    (left, first): (&Rows, usize),
    (right, second): (&Rows, usize),
    mut enter: impl FnMut(usize, usize, f64),
) {
    for b in 0..AXES {
        let of_second = right.sites_of(AXES * second + b);
        for a in 0..AXES {
            let of_first = left.sites_of(AXES * first + a);
            let each = of_first.iter().zip(of_second).zip(sites);
            enter(a, b, each.map(|((left, right), covariance)| left * right * covariance).sum());
        }
    }
}

/// Prior covariance of the remainder at one pose, shape = (3, 3) \[m²\].
pub(super) fn variance(hyper: &Hyperparameters, rows: &Rows, pose: usize) -> Matrix3<f64> {
    Matrix3::from_fn(|a, b| {
        (0..hyper.sites())
            .map(|site| {
                hyper.site_variance(site)
                    * rows.sites[(site, AXES * pose + a)]
                    * rows.sites[(site, AXES * pose + b)]
            })
            .sum()
    })
}
