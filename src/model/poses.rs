//! Measured poses as a least-squares problem.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DVector, Vector3};
use rayon::prelude::*;

use super::Model;
use super::commands::Commands;
use super::derivative::Linearised;
use super::known::LinearModel;
use super::observation::between;
use super::pose::Pose;
use super::tilt::{Tilts, rigid_tilts};
use crate::least_squares::{Block, CHUNK_ITEMS, LeastSquares};
use crate::mechanics::{CentreLine, StaticState, Workspace};
use crate::problem::Observation;
use crate::spatial::{Frame, rotation_axes, rotation_between};

/// Coordinates of a position, and of a position with an orientation.
const POSITION: usize = 3;
const POSE: usize = 6;

/// Whitened residuals (measured − predicted) / σ of some poses as a function of some of the
/// parameters.
///
/// Three rows a pose, 0 behind the numbers that it measures; six where any has an orientation that
/// counts, the last three log(R Rₚᵀ) / σ of measured R and predicted Rₚ, measuring frame, and 0 for
/// poses without.
pub struct PoseResiduals<'a> {
    model: &'a Model,
    poses: Arc<Vec<Pose<'a>>>,
    /// Which parameters are unknown here.
    unknowns: Vec<usize>,
    /// Full parameter vector; the unknowns' entries are overwritten.
    at: DVector<f64>,
    rows: usize,
    /// Whether some poses measure tilts.
    tilted: bool,
    /// Derivatives that are known at a point where these residuals may be linearised.
    known: Option<&'a LinearModel>,
}

/// What is seen of a pose.
struct Seen {
    position: Vector3<f64>,
    /// Rotation vector from the predicted to the measured orientation, where that counts \[rad\].
    turn: Option<Vector3<f64>>,
}

impl<'a> PoseResiduals<'a> {
    /// Residuals of `poses`, which may be shared with others; the parameters listed in `unknowns`
    /// vary, the others stay as in `at`.
    pub fn new(
        model: &'a Model,
        poses: impl Into<Arc<Vec<Pose<'a>>>>,
        unknowns: Vec<usize>,
        at: DVector<f64>,
    ) -> Self {
        let poses = poses.into();
        let rows =
            if poses.iter().any(|pose| pose.orientation.is_some()) { POSE } else { POSITION };
        let tilted = poses.iter().any(|pose| pose.observation.is_angle());
        Self { model, poses, unknowns, at, rows, tilted, known: None }
    }

    /// The same with derivatives that are `known` at a point.
    #[must_use]
    pub(crate) fn with_linear_model(self, known: Option<&'a LinearModel>) -> Self {
        Self { known, ..self }
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
        self.errors(x, |pose, seen| pose.measured - seen.position)
    }

    /// Rotation vectors from the predicted to the measured orientations, measuring frame \[rad\]; 0
    /// for poses without, NaN where a pose has no equilibrium.
    pub fn orientation_errors(&self, x: &DVector<f64>) -> Vec<Vector3<f64>> {
        self.errors(x, |_, seen| seen.turn.unwrap_or_default())
    }

    fn errors(
        &self,
        x: &DVector<f64>,
        of: impl Fn(&Pose, &Seen) -> Vector3<f64> + Sync,
    ) -> Vec<Vector3<f64>> {
        let mut errors = vec![Vector3::zeros(); self.poses.len()];
        let write = |(chunk, errors): (usize, &mut [Vector3<f64>])| {
            let first = chunk * CHUNK_ITEMS;
            let mut left = errors.iter_mut();
            self.each_prediction(x, first..first + left.len(), |pose, seen| {
                if let Some(error) = left.next() {
                    *error = of(pose, &seen);
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

    fn each_prediction(
        &self,
        x: &DVector<f64>,
        items: Range<usize>,
        mut use_it: impl FnMut(&Pose, Seen),
    ) {
        let full = self.full(x);
        let arm = self.model.arm(|k| full[k]);
        let bases = self.model.base_frames(full.as_slice());
        let targets = self.model.target_positions(full.as_slice());
        let turned = self.model.target_rotations(full.as_slice());
        let turned: Vec<_> = turned.iter().map(rotation_axes).collect();
        let instrument = self.model.instrument_at(full.as_slice());
        let mut commands = self.model.commands(full.as_slice());
        let fixtures = self.model.fixtures(full.as_slice());
        let mut ws = Workspace::default();
        let mut rest = StaticState::default();
        let mut tilts = None;
        for pose in &self.poses[items] {
            if let Observation::Between(first, second) = pose.observation {
                let seen = between(&fixtures[first as usize], &fixtures[second as usize]).seen;
                use_it(pose, Seen { position: seen, turn: None });
                continue;
            }
            let lost = Vector3::from_element(f64::NAN);
            if let Observation::Tilt(frame) = pose.observation {
                let tilts = tilts
                    .get_or_insert_with(|| Tilts::new(self.model, &full, arm.clone(), Vec::new()));
                let seen = tilts.at(&commands.apply(&pose.setup), frame).unwrap_or(lost);
                use_it(pose, Seen { position: seen, turn: None });
                continue;
            }
            let seen = match arm.equilibrate_at(
                &commands.apply(&pose.setup),
                self.model.target_joint(pose.target),
                &mut ws,
                &mut rest,
            ) {
                Ok(()) => {
                    let base = instrument.base(&bases[pose.base], &pose.setup);
                    let position = base.point(&rest.frame.point(&targets[pose.target]));
                    let turn = pose.orientation.map(|own| {
                        let axes =
                            turned[pose.target].map(|axis| base.vector(&rest.frame.vector(&axis)));
                        own.axes()
                            .map_or(Vector3::zeros(), |measured| rotation_between(&axes, &measured))
                    });
                    let seen = match pose.observation.fixture() {
                        Some(fixture) if pose.observation.is_point() => {
                            base.resolve(&fixtures[fixture].seen(&position))
                        }
                        Some(fixture) => fixtures[fixture].seen(&position),
                        None => instrument.of(&position, &pose.setup),
                    };
                    Seen { position: seen, turn }
                }
                Err(_) => Seen { position: lost, turn: pose.orientation.map(|_| lost) },
            };
            use_it(pose, seen);
        }
    }
}

impl Model {
    /// Residuals measured − predicted of poses at the full parameter vector `x`, measuring frame
    /// \[m\]; NaN where a pose has no equilibrium.
    pub fn residuals(&self, poses: Vec<Pose>, x: &DVector<f64>) -> Vec<Vector3<f64>> {
        PoseResiduals::new(self, poses, Vec::new(), x.clone()).position_errors(&DVector::zeros(0))
    }

    /// Predicted positions of poses at the full parameter vector `x`, as measured, measuring frame
    /// \[m\]; NaN where a pose has no equilibrium.
    pub fn predict(&self, poses: Vec<Pose>, x: &DVector<f64>) -> Vec<Vector3<f64>> {
        let measured: Vec<Vector3<f64>> = poses.iter().map(|pose| *pose.measured).collect();
        measured
            .into_iter()
            .zip(self.residuals(poses, x))
            .map(|(measured, residual)| measured - residual)
            .collect()
    }

    /// Rotation vectors from the predicted to the measured orientations of poses, measuring frame
    /// \[rad\], as [`PoseResiduals::orientation_errors`].
    pub fn orientation_residuals(&self, poses: Vec<Pose>, x: &DVector<f64>) -> Vec<Vector3<f64>> {
        PoseResiduals::new(self, poses, Vec::new(), x.clone())
            .orientation_errors(&DVector::zeros(0))
    }

    /// Frames that carry the targets, in the arm's base frame, at the full parameter vector `x`;
    /// `None` without equilibrium.
    pub fn frames(&self, poses: &[Pose], x: &[f64]) -> Vec<Option<Frame<f64>>> {
        let arm = self.arm(|k| x[k]);
        let some = |poses: &[Pose]| {
            let mut commands = self.commands(x);
            let (mut ws, mut rest) = (Workspace::default(), StaticState::default());
            let mut frame = |pose: &Pose| {
                arm.equilibrate_at(
                    &commands.apply(&pose.setup),
                    self.target_joint(pose.target),
                    &mut ws,
                    &mut rest,
                )
                .ok()?;
                Some(rest.frame)
            };
            poses.iter().map(&mut frame).collect::<Vec<_>>()
        };
        poses.par_chunks(CHUNK_ITEMS).flat_map_iter(some).collect()
    }

    /// Predicted orientations of the targets at the full parameter vector `x`, rotation vectors,
    /// measuring frame \[rad\]; NaN where a pose has no equilibrium.
    pub fn orientations(&self, poses: &[Pose], x: &[f64]) -> Vec<Vector3<f64>> {
        let (bases, turned) = (self.base_frames(x), self.target_rotations(x));
        let instrument = self.instrument_at(x);
        let still = [Vector3::x(), Vector3::y(), Vector3::z()];
        let orientation = |(pose, frame): (&Pose, Option<Frame<f64>>)| {
            let last = instrument.base(&bases[pose.base], &pose.setup).compose(&frame?);
            Some(rotation_between(
                &still,
                &rotation_axes(&turned[pose.target]).map(|axis| last.vector(&axis)),
            ))
        };
        let all = poses.iter().zip(self.frames(poses, x)).map(orientation);
        all.map(|turn| turn.unwrap_or(Vector3::from_element(f64::NAN))).collect()
    }

    /// Positions of poses as the geometry alone has them at the full parameter vector `x`, as
    /// measured, measuring frame \[m\]: nothing of the arm gives way, and no effect acts on it.
    pub fn geometric_positions(&self, poses: &[Pose], x: &[f64]) -> Vec<Vector3<f64>> {
        let arm = self.arm(|k| x[k]);
        let (bases, targets, instrument) =
            (self.base_frames(x), self.target_positions(x), self.instrument_at(x));
        let mut commands = Commands::new(&self.driven, &[], &[]);
        let position = |pose: &Pose| {
            let tip = arm.rigid_frame(&commands.apply(&pose.setup), self.target_joint(pose.target));
            let base = instrument.base(&bases[pose.base], &pose.setup);
            instrument.of(&base.point(&tip.point(&targets[pose.target])), &pose.setup)
        };
        poses.iter().map(position).collect()
    }

    /// Residuals measured − predicted of poses, whatever they measure, as the geometry alone
    /// predicts them at the full parameter vector `x` \[m\], of tilts \[rad\]; points, anchors and
    /// surfaces are where `x` has them.
    pub fn geometric_residuals(&self, poses: &[Pose], x: &[f64]) -> Vec<Vector3<f64>> {
        let arm = self.arm(|k| x[k]);
        let (bases, targets, instrument) =
            (self.base_frames(x), self.target_positions(x), self.instrument_at(x));
        let fixtures = self.fixtures(x);
        let mut commands = Commands::new(&self.driven, &[], &[]);
        let residual = |pose: &Pose| {
            let setup = commands.apply(&pose.setup);
            let seen = match pose.observation {
                Observation::Between(first, second) => {
                    between(&fixtures[first as usize], &fixtures[second as usize]).seen
                }
                Observation::Tilt(frame) => rigid_tilts(&arm, &setup, frame),
                of => {
                    let base = instrument.base(&bases[pose.base], &pose.setup);
                    let tip = arm.rigid_frame(&setup, self.target_joint(pose.target));
                    let position = base.point(&tip.point(&targets[pose.target]));
                    match of.fixture() {
                        Some(fixture) if of.is_point() => {
                            base.resolve(&fixtures[fixture].seen(&position))
                        }
                        Some(fixture) => fixtures[fixture].seen(&position),
                        None => instrument.of(&position, &pose.setup),
                    }
                }
            };
            pose.measured - seen
        };
        poses.iter().map(residual).collect()
    }

    /// The arm as a line to the target at the full parameter vector `x`, measuring frame \[m\];
    /// `None` without equilibrium.
    pub fn centre_lines(&self, poses: &[Pose], x: &[f64]) -> Vec<Option<CentreLine>> {
        let arm = self.arm(|k| x[k]);
        let (bases, targets) = (self.base_frames(x), self.target_positions(x));
        let shape = |(pose, frame): (&Pose, Option<Frame<f64>>)| {
            let mut commands = self.commands(x);
            let setup = commands.apply(&pose.setup);
            let tip = self.target_joint(pose.target);
            let CentreLine { mut rigid, mut bent } = arm.centre_line(&setup, tip).ok()?;
            rigid.push(arm.rigid_frame(&setup, tip).point(&targets[pose.target]));
            bent.push(frame?.point(&targets[pose.target]));
            rigid
                .iter_mut()
                .chain(&mut bent)
                .for_each(|point| *point = bases[pose.base].point(point));
            Some(CentreLine { rigid, bent })
        };
        poses.iter().zip(self.frames(poses, x)).map(shape).collect()
    }

    /// Where the arm has its target in each pose at the full parameter vector `x`, whatever was
    /// measured of it, measuring frame \[m\]; NaN without equilibrium. What effects do to the
    /// measurement is not in them.
    pub(crate) fn predicted_targets(&self, poses: &[Pose], x: &[f64]) -> Vec<Vector3<f64>> {
        let (bases, points) = (self.base_frames(x), self.predicted_targets_in_base(poses, x));
        let lost = Vector3::from_element(f64::NAN);
        poses
            .iter()
            .zip(points)
            .map(|(pose, at)| at.map_or(lost, |at| bases[pose.base].point(&at)))
            .collect()
    }

    /// Target positions in the arm's base frame \[m\] at the full parameter vector `x`; `None`
    /// without equilibrium.
    ///
    /// What effects do to the measurement is not in them.
    pub fn predicted_targets_in_base(
        &self,
        poses: &[Pose],
        x: &[f64],
    ) -> Vec<Option<Vector3<f64>>> {
        let targets = self.target_positions(x);
        let frames = self.frames(poses, x);
        poses
            .iter()
            .zip(frames)
            .map(|(pose, frame)| Some(frame?.point(&targets[pose.target])))
            .collect()
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
        self.rows
    }

    fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
        let mut rows = out.chunks_exact_mut(self.rows);
        self.each_prediction(x, items, |pose, seen| {
            let Some((position, turn)) = rows.next().map(|row| row.split_at_mut(POSITION)) else {
                return;
            };
            position.copy_from_slice(((pose.measured - seen.position) / pose.sigma).as_slice());
            let sigma = pose.orientation.map_or(1.0, |own| own.sigma);
            let error = seen.turn.unwrap_or_default() / sigma;
            turn.iter_mut().zip(&error).for_each(|(out, error)| *out = *error);
        });
    }

    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
        let linearise = |unknowns: &[usize], block: &mut Block| {
            let full = self.full(x);
            let mut linearised =
                Linearised::new(self.model, &full, unknowns, (self.rows == POSE, self.tilted));
            for (k, pose) in self.poses[items.clone()].iter().enumerate() {
                linearised.write(pose, block, self.rows * k);
            }
        };
        let parameters = self.model.parameters.as_slice();
        if let Some(known) = self.known.filter(|_| self.rows == POSITION)
            && let Some(lacking) =
                known.lacking(&self.poses, (parameters, &self.full(x)), &self.unknowns)
        {
            let mut new = Block::zeros(block.rows(), lacking.len());
            linearise(&lacking.iter().map(|&j| self.unknowns[j]).collect::<Vec<_>>(), &mut new);
            let (of, own) =
                ((self.poses.as_slice(), items.clone()), (parameters, self.unknowns.as_slice()));
            if known.fill(block, of, own, (&new, &lacking)) {
                return;
            }
        }
        linearise(&self.unknowns, block);
    }
}
