//! Covariance of the remainder between poses. Matérn 5/2 processes describe joint errors, and the
//! arm's Jacobian maps these to the measured position.

use nalgebra::{DMatrix, Matrix3};

use super::rows::{AXES, Inputs, Rows};
use crate::numeric::parallel;

/// Hyperparameters of the remainder.
///
/// The error at the coordinate of joint j is uⱼ(qⱼ) + vⱼ(q). uⱼ ~ GP(0, a²ᵤⱼ k(·/ℓᵤⱼ)) is a
/// function of the joint's own command. vⱼ ~ GP(0, a²ᵥⱼ k(·/ℓᵥ)) is a function of all inputs, with
/// one length ℓᵥ for each input. k is the Matérn 5/2 correlation. The measurement adds noise of
/// variance σ² to each coordinate, and noise of variance σ_c² that rows of one configuration share.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Hyperparameters {
    /// Amplitude aᵤⱼ of each site: prior 1 σ of uⱼ times the lever of the site \[m\].
    pub single: Vec<f64>,
    /// Amplitude aᵥⱼ of each site: prior 1 σ of vⱼ times the lever of the site \[m\].
    pub joint: Vec<f64>,
    /// Prior 1 σ of each site's constant error times the lever of the site \[m\].
    pub constant: Vec<f64>,
    /// Length ℓᵤⱼ of each site: \[rad\] for revolute joints, in standard deviations of the input
    /// for others.
    pub single_lengths: Vec<f64>,
    /// Length ℓᵥ of each input: \[rad\] for angles, in standard deviations of the input for others.
    pub input_lengths: Vec<f64>,
    /// 1 σ of the independent noise of each coordinate \[m\].
    pub noise: f64,
    /// 1 σ of the noise σ_c that rows of one configuration share \[m\]; 0 if no configuration is
    /// repeated.
    pub shared_noise: f64,
}

impl Hyperparameters {
    /// Creates the hyperparameters of a model that has parameters and noise, but no remainder.
    pub fn without_remainder(noise: f64, shared_noise: f64) -> Self {
        Self {
            single: Vec::new(),
            joint: Vec::new(),
            constant: Vec::new(),
            single_lengths: Vec::new(),
            input_lengths: Vec::new(),
            noise,
            shared_noise,
        }
    }

    /// Returns the number of sites at which joint errors are modelled; 0 without a remainder.
    pub fn sites(&self) -> usize {
        self.single.len()
    }

    /// Returns the prior variance of the error at a site times the lever of the site \[m²\].
    pub fn site_variance(&self, site: usize) -> f64 {
        [self.single[site], self.joint[site], self.constant[site]].iter().map(|a| a * a).sum()
    }

    /// Returns the noise variance of one coordinate of a row \[m²\]; `relative_sigma` is the row's
    /// σ in units of the default σ.
    pub fn noise_variance_of(&self, relative_sigma: f64) -> f64 {
        (self.noise * relative_sigma).powi(2) + self.shared_noise.powi(2)
    }
}

/// Returns the Matérn 5/2 correlation (1 + √5 d + 5/3 d²) exp(−√5 d) at `squared` = d², and its
/// derivative with respect to −½ d². d is a distance in units of the length ℓ. [Rasmussen &
/// Williams 2006, eq. 4.17]
#[inline]
pub(super) fn matern(squared: f64) -> (f64, f64) {
    let scaled = (5.0 * squared).sqrt();
    let decay = (-scaled).exp();
    let correlation = (1.0 + scaled + 5.0 / 3.0 * squared) * decay;
    (correlation, 5.0 / 3.0 * (1.0 + scaled) * decay)
}

/// Maps each input to two coordinates whose squared differences add up to the squared distance,
/// shape = (2 inputs, rows). Angles become (cos q, sin q), other inputs (x, 0).
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

/// Returns the squared distance between two values of an input that differ by Δ: the chord (2 sin
/// Δ/2)² of angles, Δ² of other inputs.
pub(super) fn squared_distance(is_angle: bool, difference: f64) -> f64 {
    if is_angle { (2.0 * (0.5 * difference).sin()).powi(2) } else { difference * difference }
}

/// Returns the squared distance between two rows in each input, from coordinates by [`embedded`].
#[inline]
pub(super) fn squared_distances<'a>(
    first: &'a [f64],
    second: &'a [f64],
) -> impl Iterator<Item = f64> + 'a {
    let pairs = first.chunks_exact(2).zip(second.chunks_exact(2));
    pairs.map(|(a, b)| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2))
}

/// Prior covariances of the errors at each site between two poses \[m²\]; errors are multiplied by
/// the levers of their sites.
pub(super) struct SiteCovariance<'a> {
    inputs: &'a Inputs,
    /// Variance a²ᵤⱼ and inverse squared length ℓᵤⱼ⁻² of each site.
    single: Vec<(f64, f64)>,
    /// Variance a²ᵥⱼ of each site, and the variance of its constant error.
    joint: Vec<(f64, f64)>,
    /// Inverse squared length ℓᵥ⁻² of each input.
    joint_scales: Vec<f64>,
}

impl<'a> SiteCovariance<'a> {
    /// Precomputes variances and inverse squared lengths from the hyperparameters.
    pub fn new(hyper: &Hyperparameters, inputs: &'a Inputs) -> Self {
        let single = hyper.single.iter().zip(&hyper.single_lengths);
        let joint = hyper.joint.iter().zip(&hyper.constant);
        Self {
            inputs,
            single: single.map(|(size, length)| (size * size, length.powi(-2))).collect(),
            joint: joint.map(|(size, constant)| (size * size, constant * constant)).collect(),
            joint_scales: hyper.input_lengths.iter().map(|length| length.powi(-2)).collect(),
        }
    }

    /// Writes to `out` the covariance of each site's error between two poses, given by their inputs
    /// from [`embedded`]. `squares` receives the squared distance in each input.
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

/// Returns the covariance of the remainder between the rows `left` and `right`, shape = (3 left, 3
/// right) \[m²\].
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
    let columns = |pose: usize, out: &mut [f64]| {
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
            position_covariances(&sites, (left, row), (right, pose), |a, b, value| {
                out[b * height + AXES * row + a] = value;
            });
        }
    };
    parallel::write_chunks(out.as_mut_slice(), AXES * height, &columns);
    out
}

/// Computes the covariance of the positions of two rows from the covariances `sites` of the errors
/// at each site. For each pair of axes a and b, it calls `enter` with Σ A₁ₐ c A₂ᵦ. The sum is over
/// the sites with covariance c; A₁ and A₂ are the site derivatives of the two rows.
#[inline]
pub(super) fn position_covariances(
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

/// Returns the prior covariance of the remainder at one pose, shape = (3, 3) \[m²\].
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
