//! Errors of single joints that a remainder describes, for tables and figures.

use nalgebra::{DMatrix, DVector};

use super::correction::Correction;
use super::kernel::Hyperparameters;
use super::rows::{AXES, Rows, Site, SiteKind};

/// Error of a joint's coordinate as a function of the joint's own command, and the motions of the
/// target that all modelled errors of the joint cause.
#[derive(Debug, Clone, PartialEq)]
pub struct JointError {
    /// Index of the joint, from 0.
    pub joint: usize,
    /// Correlation length ℓᵤ of the error as a function of the joint's own command: \[rad\], or
    /// \[m\] for a prismatic joint.
    pub length: f64,
    /// Error over the measured range of the command. The mean over the range is subtracted, because
    /// it only changes the joint's offset.
    pub points: Vec<JointErrorPoint>,
    /// Root mean square motions of the target's position at the centres \[m\]. They are caused by
    /// the function of the joint's own command, by the function of all inputs, and by the
    /// additional compliance.
    pub motions: [f64; 3],
}

/// Error of a joint at one value of its command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointErrorPoint {
    /// Command of the joint \[rad\], or \[m\] for a prismatic joint.
    pub command: f64,
    /// Posterior mean of the error times the joint's lever \[m\], minus its mean over the range of
    /// commands. The lever is the root mean square derivative of the position.
    pub mean: f64,
    /// Posterior 1 σ of the error times the lever \[m\].
    pub sigma: f64,
}

impl Correction {
    /// Returns the errors of each joint whose coordinate error the remainder models, at `count`
    /// commands over its measured range. The list is empty without a remainder.
    #[doc(hidden)]
    pub fn joint_errors(&self, count: usize) -> Vec<JointError> {
        let sites = self.layout.sites.iter().enumerate();
        let coordinates = sites.filter(|(_, site)| site.kind == SiteKind::Coordinate);
        coordinates.filter_map(|(place, site)| self.joint_error(place, site, count)).collect()
    }

    /// Returns the error of the joint of a coordinate site, which has the index `place` among all
    /// sites; `None` if the site has no function of the joint's own command.
    fn joint_error(&self, place: usize, site: &Site, count: usize) -> Option<JointError> {
        let inputs = &self.layout.inputs;
        let input = inputs.sites[place].single?;
        let (offset, unit) = inputs.standard[input];
        let (low, high) = inputs.ranges[input];
        let last = count.max(2) - 1;
        let commands: Vec<f64> =
            (0..=last).map(|k| low + (high - low) * k as f64 / last as f64).collect();
        let mut rows = Rows {
            residual: DVector::zeros(AXES * commands.len()),
            jacobian: DMatrix::zeros(AXES * commands.len(), self.parameters.len()),
            sites: DMatrix::zeros(self.layout.sites.len(), AXES * commands.len()),
            inputs: DMatrix::zeros(inputs.sources.len(), commands.len()),
            configuration: (0..commands.len()).collect(),
            relative_sigma: vec![1.0; commands.len()],
        };
        for (row, command) in commands.iter().enumerate() {
            rows.sites[(place, AXES * row)] = 1.0;
            rows.inputs[(input, row)] = (command - offset) / unit;
        }
        let hyper = &self.posterior.hyper;
        let single = Hyperparameters {
            single: single_amplitude(&hyper.single, place),
            ..without_amplitudes(hyper)
        };
        let mut factors = self.posterior.factors_of(&single, &rows);
        // The first coordinate of each row holds the error itself.
        let mean = (0..commands.len()).map(|row| factors.mean[AXES * row]).sum::<f64>()
            / commands.len() as f64;
        let spread = (0..commands.len())
            .map(|row| factors.spread.row(AXES * row).into_owned())
            .reduce(|sum, row| sum + row)?
            / commands.len() as f64;
        for row in 0..commands.len() {
            let mut of_row = factors.spread.row_mut(AXES * row);
            of_row -= &spread;
        }
        let posteriors = factors.rows();
        let points = commands.iter().zip(posteriors).map(|(&command, posterior)| JointErrorPoint {
            command,
            mean: posterior.mean.x - mean,
            sigma: posterior.covariance[(0, 0)].max(0.0).sqrt(),
        });
        let compliance = self
            .layout
            .sites
            .iter()
            .position(|other| other.joint == site.joint && other.kind == SiteKind::Compliance);
        let joint = Hyperparameters {
            joint: single_amplitude(&hyper.joint, place),
            ..without_amplitudes(hyper)
        };
        let constant = compliance.map(|place| Hyperparameters {
            constant: single_amplitude(&hyper.constant, place),
            ..without_amplitudes(hyper)
        });
        Some(JointError {
            joint: site.joint,
            length: hyper.single_lengths[place] * unit,
            points: points.collect(),
            motions: [Some(single), Some(joint), constant]
                .map(|part| part.map_or(0.0, |part| self.motion(&part))),
        })
    }

    /// Returns the root mean square motion of the position at the centres \[m\] that those Gaussian
    /// processes cause whose amplitude in `part` is not 0.
    fn motion(&self, part: &Hyperparameters) -> f64 {
        let inducing = &self.posterior.inducing;
        let cross = inducing.cross(part, &self.layout.inputs, &inducing.centres);
        let motion = cross * self.posterior.kernel_weights();
        (motion.norm_squared() / inducing.centres.len().max(1) as f64).sqrt()
    }
}

/// Returns the amplitudes with all except the one at `place` set to 0.
fn single_amplitude(amplitudes: &[f64], place: usize) -> Vec<f64> {
    amplitudes.iter().enumerate().map(|(k, a)| if k == place { *a } else { 0.0 }).collect()
}

/// Returns the hyperparameters with the same lengths and noise, but with all amplitudes 0.
fn without_amplitudes(hyper: &Hyperparameters) -> Hyperparameters {
    let zeros = vec![0.0; hyper.sites()];
    Hyperparameters {
        single: zeros.clone(),
        joint: zeros.clone(),
        constant: zeros,
        ..hyper.clone()
    }
}
