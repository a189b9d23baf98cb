//! Assumed misfit: smooth errors of the joints that the model lacks, as a linear model.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use rand::RngExt as _;

use super::{Sensitivity, Site};
use crate::measurement::Measurements;
use crate::random;

/// Number of random features of the error of one joint.
const FEATURES: usize = 24;
/// Correlation length of the joint errors: \[rad\] for revolute joints, a fraction of the range for
/// prismatic ones. It is the middle of 0.3 to 1.2 rad, between which plans on two measured arms
/// differ little.
const CORRELATION_LENGTH: f64 = 0.6;
/// Degrees of freedom of the spectral density of the Matérn 5/2 correlation. [Rasmussen & Williams
/// 2006, eq. 4.15]
const SPECTRAL_FREEDOM: usize = 5;
/// Random stream of the frequencies and phases of the features.
const FEATURE_STREAM: u64 = 300;

/// Smooth error eⱼ(q) of every joint coordinate that no declared law describes.
///
/// eⱼ ~ GP(0, aⱼ² k) with the Matérn 5/2 correlation k of all commands, written as eⱼ = aⱼ φ(q)ᵀ w
/// with random Fourier features φ and w ~ N(0, I) [Rahimi & Recht 2007]. The weights w are unknowns
/// beside the parameters. Poses far from all measured ones then stay uncertain, and a plan covers
/// the workspace even where the model is wrong.
#[derive(Debug, Clone)]
pub(super) struct Misfit {
    /// Frequency of each feature in each coordinate (cos q, sin q or x, 0), shape = (features, 2
    /// joints).
    frequencies: DMatrix<f64>,
    /// Phase of each feature, a cosine of the commands \[rad\].
    phases: Vec<f64>,
    /// Standard deviation aⱼ of each joint's smooth error \[rad\] or \[m\]; 0 for a joint that does
    /// not move the target.
    joint_sigmas: Vec<f64>,
    /// Smallest command and inverse width of each prismatic joint's range \[m\], \[1/m\]; `None`
    /// for angles.
    ranges: Vec<Option<(f64, f64)>>,
}

impl Misfit {
    /// Creates a misfit that moves the position along each axis by `size` \[m\], root mean square
    /// over the axes and the poses of `table`. All joints contribute equally.
    pub fn new(site: &Site, table: &Measurements, size: f64, seed: u64) -> Self {
        let joints = table.joints;
        let mut random = random::stream(seed, FEATURE_STREAM);
        let mut frequencies = DMatrix::zeros(FEATURES, 2 * joints);
        let mut phases = Vec::with_capacity(FEATURES);
        for feature in 0..FEATURES {
            let mut normal = || random::normal(&mut random);
            let squares: f64 = (0..SPECTRAL_FREEDOM).map(|_| normal().powi(2)).sum();
            let scale = (SPECTRAL_FREEDOM as f64 / squares.max(f64::MIN_POSITIVE)).sqrt()
                / CORRELATION_LENGTH;
            for coordinate in 0..2 * joints {
                frequencies[(feature, coordinate)] = scale * random::normal(&mut random);
            }
            phases.push(TAU * random.random::<f64>());
        }
        let slopes = site.command_slopes(table);
        let count = slopes.len().max(1) as f64;
        let lever = |joint: usize| {
            let squares = slopes.iter().map(|slope| slope.column(joint).norm_squared());
            (squares.filter(|square| square.is_finite()).sum::<f64>() / count).sqrt()
        };
        let levers: Vec<f64> = (0..joints).map(lever).collect();
        let moving = levers.iter().filter(|lever| **lever > 0.0).count().max(1) as f64;
        let of_joint = size * (3.0 / moving).sqrt();
        let joint_sigmas =
            levers.iter().map(|lever| if *lever > 0.0 { of_joint / lever } else { 0.0 }).collect();
        let range = |joint: usize| {
            (!site.is_angle(joint)).then(|| {
                let values = (0..table.len()).map(|row| table.configuration(row)[joint]);
                let (low, high) = crate::numeric::range(values);
                (low, (high - low).max(f64::MIN_POSITIVE).recip())
            })
        };
        Self { frequencies, phases, joint_sigmas, ranges: (0..joints).map(range).collect() }
    }

    /// Returns the number of weights w of all joints together.
    pub fn weights(&self) -> usize {
        self.phases.len() * self.joint_sigmas.len()
    }

    /// Returns `sensitivity` of the poses of `table` with a row for every weight below those of the
    /// parameters. The new rows are in units of σ, or of `unit` \[m\] if given.
    pub fn with_misfit_rows(
        &self,
        site: &Site,
        table: &Measurements,
        sensitivity: &Sensitivity,
        unit: Option<f64>,
    ) -> Sensitivity {
        let (parameters, coordinates) = (sensitivity.rows.nrows(), sensitivity.coordinates);
        let mut rows = sensitivity.rows.clone().resize_vertically(parameters + self.weights(), 0.0);
        let sigmas = site.sigmas(table, unit);
        for (pose, slope) in site.command_slopes(table).iter().enumerate() {
            let features = self.features(table.configuration(pose));
            for (joint, sigma) in self.joint_sigmas.iter().enumerate() {
                for axis in 0..3 {
                    let slope = slope[(axis, joint)] * sigma / sigmas[pose];
                    let column = coordinates * pose + axis;
                    for (k, feature) in features.iter().enumerate() {
                        rows[(parameters + features.len() * joint + k, column)] = slope * feature;
                    }
                }
            }
        }
        Sensitivity { rows, coordinates }
    }

    /// Returns the random features φ at a configuration. The sum of their squares is 1 on average.
    fn features(&self, configuration: &[f64]) -> Vec<f64> {
        let embedded = configuration.iter().zip(&self.ranges).flat_map(|(q, range)| match range {
            Some((offset, scale)) => [(q - offset) * scale, 0.0],
            None => [q.cos(), q.sin()],
        });
        let embedded = DVector::from_iterator(self.frequencies.ncols(), embedded);
        let angles = &self.frequencies * embedded;
        let size = (2.0 / self.phases.len() as f64).sqrt();
        angles.iter().zip(&self.phases).map(|(angle, phase)| size * (angle + phase).cos()).collect()
    }
}
