//! Measured poses as a least-squares problem.

use std::ops::Range;

use nalgebra::{DVector, Vector3};
use rayon::prelude::*;

use super::Model;
use super::derivative::Linearised;
use super::pose::Pose;
use crate::least_squares::{Block, CHUNK_ITEMS, LeastSquares};
use crate::mechanics::{Equilibrated, Workspace};

/// Whitened residuals (measured − predicted) / σ of some poses as a function of some of the parameters.
pub struct PoseResiduals<'a> {
    model: &'a Model,
    poses: Vec<Pose<'a>>,
    /// Which parameters are unknown here.
    unknowns: Vec<usize>,
    /// Full parameter vector; the unknowns' entries are overwritten.
    at: DVector<f64>,
}

impl<'a> PoseResiduals<'a> {
    /// Residuals of `poses`; the parameters listed in `unknowns` vary, the others stay as in `at`.
    pub fn new(model: &'a Model, poses: Vec<Pose<'a>>, unknowns: Vec<usize>, at: DVector<f64>) -> Self {
        Self { model, poses, unknowns, at }
    }

    /// The full parameter vector for unknowns `x`.
    pub fn full(&self, x: &DVector<f64>) -> DVector<f64> {
        let mut full = self.at.clone();
        for (&k, &value) in self.unknowns.iter().zip(x.iter()) {
            full[k] = value;
        }
        full
    }

    /// The unknowns' entries of a full parameter vector.
    pub fn reduced(&self, full: &DVector<f64>) -> DVector<f64> {
        DVector::from_iterator(self.unknowns.len(), self.unknowns.iter().map(|&k| full[k]))
    }

    /// The poses.
    pub fn poses(&self) -> &[Pose<'a>] {
        &self.poses
    }

    /// Which parameters are unknown.
    pub fn unknowns(&self) -> &[usize] {
        &self.unknowns
    }

    /// Residuals measured − predicted, measuring frame \[m\]; NaN where a pose has no equilibrium.
    pub fn position_errors(&self, x: &DVector<f64>) -> Vec<Vector3<f64>> {
        let mut errors = vec![Vector3::zeros(); self.poses.len()];
        let write = |(chunk, errors): (usize, &mut [Vector3<f64>])| {
            let first = chunk * CHUNK_ITEMS;
            let mut left = errors.iter_mut();
            self.each_prediction(x, first..first + left.len(), |pose, predicted| {
                if let Some(error) = left.next() {
                    *error = pose.measured - predicted;
                }
            });
        };
        if errors.len() <= CHUNK_ITEMS {
            write((0, &mut errors));
        } else {
            errors.par_chunks_mut(CHUNK_ITEMS).enumerate().for_each(write);
        }
        errors
    }

    fn each_prediction(&self, x: &DVector<f64>, items: Range<usize>, mut use_it: impl FnMut(&Pose, Vector3<f64>)) {
        let full = self.full(x);
        let arm = self.model.arm(|k| full[k]);
        let bases = self.model.base_frames(full.as_slice());
        let targets = self.model.target_positions(full.as_slice());
        let instrument = self.model.instrument_at(full.as_slice());
        let mut commands = self.model.commands(full.as_slice());
        let mut ws = Workspace::default();
        let mut rest = Equilibrated::default();
        for pose in &self.poses[items] {
            let predicted = match arm.equilibrate(&commands.apply(&pose.setup), &mut ws, &mut rest) {
                Ok(()) => {
                    let position = bases[pose.base].point(&rest.frame.point(&targets[pose.target]));
                    instrument.of(&position, &pose.setup)
                }
                Err(_) => Vector3::from_element(f64::NAN),
            };
            use_it(pose, predicted);
        }
    }
}

impl Model {
    /// Residuals measured − predicted of poses at the full parameter vector `x`, measuring frame \[m\]; NaN where a pose has no
    /// equilibrium.
    pub fn residuals(&self, poses: Vec<Pose>, x: &DVector<f64>) -> Vec<Vector3<f64>> {
        PoseResiduals::new(self, poses, Vec::new(), x.clone()).position_errors(&DVector::zeros(0))
    }

    /// Predicted positions of poses at the full parameter vector `x`, as measured, measuring frame \[m\]; NaN where a pose has no
    /// equilibrium.
    pub fn predict(&self, poses: Vec<Pose>, x: &DVector<f64>) -> Vec<Vector3<f64>> {
        let measured: Vec<Vector3<f64>> = poses.iter().map(|pose| pose.measured).collect();
        measured.into_iter().zip(self.residuals(poses, x)).map(|(measured, residual)| measured - residual).collect()
    }

    /// Target positions in the arm's base frame \[m\] at the full parameter vector `x`; `None` without equilibrium.
    ///
    /// What effects do to the measurement is not in them.
    pub fn points(&self, poses: &[Pose], x: &[f64]) -> Vec<Option<Vector3<f64>>> {
        let arm = self.arm(|k| x[k]);
        let targets = self.target_positions(x);
        let mut commands = self.commands(x);
        let (mut ws, mut rest) = (Workspace::default(), Equilibrated::default());
        let point = |pose: &Pose| {
            arm.equilibrate(&commands.apply(&pose.setup), &mut ws, &mut rest).ok()?;
            Some(rest.frame.point(&targets[pose.target]))
        };
        poses.iter().map(point).collect()
    }
}

impl LeastSquares for PoseResiduals<'_> {
    fn parameters(&self) -> usize {
        self.unknowns.len()
    }

    fn items(&self) -> usize {
        self.poses.len()
    }

    fn rows_per_item(&self) -> usize {
        3
    }

    fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
        let mut rows = out.chunks_exact_mut(3);
        self.each_prediction(x, items, |pose, predicted| {
            if let Some(row) = rows.next() {
                row.copy_from_slice(((pose.measured - predicted) / pose.sigma).as_slice());
            }
        });
    }

    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
        let full = self.full(x);
        let mut linearised = Linearised::new(self.model, &full, &self.unknowns);
        for (k, pose) in self.poses[items].iter().enumerate() {
            linearised.write(pose, block, 3 * k);
        }
    }
}
