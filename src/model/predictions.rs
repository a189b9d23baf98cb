//! Predicted rows, positions, orientations and shapes at a full parameter vector.

use nalgebra::{DVector, Vector3};

use super::Model;
use super::pose::Pose;
use super::pose_residuals::PoseResiduals;
use super::predictor::Predictor;
use crate::least_squares::CHUNK_ITEMS;
use crate::mechanics::CentreLine;
use crate::numeric::parallel;
use crate::observation::{FixtureValues, Needs, Observation};
use crate::spatial::{Frame, rotation_between};

impl Model {
    /// Returns measured − predicted of each row at the full parameter vector `x` \[m\], \[rad\] or
    /// \[px\]; NaN without equilibrium.
    #[doc(hidden)]
    pub fn residuals(&self, poses: Vec<Pose>, x: &DVector<f64>) -> Vec<Vector3<f64>> {
        PoseResiduals::new(self, poses, Vec::new(), x.clone()).position_errors(&DVector::zeros(0))
    }

    /// Returns the predicted numbers of each row at the full parameter vector `x` \[m\], \[rad\] or
    /// \[px\]; NaN without equilibrium.
    #[doc(hidden)]
    pub fn predict(&self, poses: Vec<Pose>, x: &DVector<f64>) -> Vec<Vector3<f64>> {
        let measured: Vec<Vector3<f64>> = poses.iter().map(|pose| *pose.measured).collect();
        let residuals = self.residuals(poses, x);
        measured
            .into_iter()
            .zip(residuals)
            .map(|(measured, residual)| measured - residual)
            .collect()
    }

    /// Returns the rotation vectors from the predicted to the measured orientations, measuring
    /// frame \[rad\], as [`PoseResiduals::orientation_errors`].
    pub(crate) fn orientation_residuals(
        &self,
        poses: Vec<Pose>,
        x: &DVector<f64>,
    ) -> Vec<Vector3<f64>> {
        PoseResiduals::new(self, poses, Vec::new(), x.clone())
            .orientation_errors(&DVector::zeros(0))
    }

    /// Returns measured − predicted of each row at the full parameter vector `x` \[m\], \[rad\] or
    /// \[px\], with rigid links and joints and without effects on the arm.
    pub(crate) fn geometric_residuals(&self, poses: &[Pose], x: &[f64]) -> Vec<Vector3<f64>> {
        let mut predictor = Predictor::rigid(self, x);
        poses.iter().map(|pose| pose.measured - predictor.predict(pose).numbers).collect()
    }

    /// Returns the frame that carries the target of each pose at the full parameter vector `x`, arm
    /// base frame; `None` without equilibrium.
    pub(crate) fn frames(&self, poses: &[Pose], x: &[f64]) -> Vec<Option<Frame<f64>>> {
        #[expect(
            clippy::redundant_closure_for_method_calls,
            reason = "a path is not general enough over lifetimes"
        )]
        self.map(poses, x, |predictor, pose| predictor.target_frame(pose))
    }

    /// Returns the predicted orientations of the targets at the full parameter vector `x`, rotation
    /// vectors, measuring frame \[rad\]; NaN without equilibrium.
    #[doc(hidden)]
    pub fn orientations(&self, poses: &[Pose], x: &[f64]) -> Vec<Vector3<f64>> {
        let reference = [Vector3::x(), Vector3::y(), Vector3::z()];
        self.map(poses, x, |predictor, pose| {
            let Some(frame) = predictor.target_frame(pose) else {
                return Vector3::from_element(f64::NAN);
            };
            rotation_between(&reference, &predictor.axes(pose, &predictor.base_frame(pose), &frame))
        })
    }

    /// Returns the predicted position of the target itself in each pose at the full parameter
    /// vector `x`, measuring frame \[m\], for every kind of row; NaN without equilibrium. Errors of
    /// the instrument are left out.
    pub(crate) fn predicted_targets(&self, poses: &[Pose], x: &[f64]) -> Vec<Vector3<f64>> {
        let (bases, points) = (self.base_frames(x), self.predicted_targets_in_base(poses, x));
        let position = |(pose, point): (&Pose, Option<Vector3<f64>>)| {
            point.map_or(Vector3::from_element(f64::NAN), |point| bases[pose.base].point(&point))
        };
        poses.iter().zip(points).map(position).collect()
    }

    /// Returns the position of the target in each pose at the full parameter vector `x`, arm base
    /// frame \[m\]; `None` without equilibrium.
    pub(crate) fn predicted_targets_in_base(
        &self,
        poses: &[Pose],
        x: &[f64],
    ) -> Vec<Option<Vector3<f64>>> {
        self.map(poses, x, |predictor, pose| {
            Some(predictor.target_frame(pose)?.point(&predictor.target(pose)))
        })
    }

    /// Returns the positions that the instrument would read at the full parameter vector `x`,
    /// measuring frame \[m\], with rigid links and joints and without effects on the arm.
    pub(crate) fn geometric_positions(&self, poses: &[Pose], x: &[f64]) -> Vec<Vector3<f64>> {
        let mut predictor = Predictor::rigid(self, x);
        let position = |pose: &Pose| {
            predictor.predict(&Pose { observation: Observation::Position, ..*pose }).numbers
        };
        poses.iter().map(position).collect()
    }

    /// Returns the centre line of the arm from its base to the target in each pose at the full
    /// parameter vector `x`, measuring frame \[m\]; `None` without equilibrium.
    pub(crate) fn centre_lines(&self, poses: &[Pose], x: &[f64]) -> Vec<Option<CentreLine>> {
        let (arm, bases) = (self.arm(|k| x[k]), self.base_frames(x));
        self.map(poses, x, |predictor, pose| {
            let (joint, target) = (self.target_joint(pose.target), predictor.target(pose));
            let setup = predictor.setup(pose);
            let CentreLine { mut rigid, mut bent } = arm.centre_line(&setup, joint).ok()?;
            rigid.push(arm.rigid_frame(&setup, joint).point(&target));
            bent.push(predictor.target_frame(pose)?.point(&target));
            let points = rigid.iter_mut().chain(&mut bent);
            points.for_each(|point| *point = bases[pose.base].point(point));
            Some(CentreLine { rigid, bent })
        })
    }

    /// Returns the frames that carry the two fixtures of each row at the full parameter vector `x`,
    /// measuring frame; `None` without equilibrium.
    pub(crate) fn carrier_frames(&self, poses: &[Pose], x: &[f64]) -> Vec<Option<[Frame<f64>; 2]>> {
        #[expect(
            clippy::redundant_closure_for_method_calls,
            reason = "a path is not general enough over lifetimes"
        )]
        self.map(poses, x, |predictor, pose| predictor.carriers(pose))
    }

    /// Converts image errors \[px\] to lengths at the observed points \[m\], at the full parameter
    /// vector `x`: along u and v, error / focal length × depth. Rows of other kinds are left out.
    pub(crate) fn lengths_at_points(
        &self,
        poses: &[Pose],
        errors: &[Vector3<f64>],
        x: &DVector<f64>,
    ) -> Vec<Vector3<f64>> {
        let fixtures = self.fixtures(x.as_slice());
        let carriers = self.carrier_frames(poses, x.as_slice());
        let length = |((pose, error), carriers): ((&Pose, &Vector3<f64>), _)| {
            let [camera, marker] = pose.observation.fixtures();
            let (camera, marker): (&FixtureValues<f64>, _) =
                (&fixtures[camera?], &fixtures[marker?]);
            let [of_camera, of_marker]: [Frame<f64>; 2] = carriers?;
            let frame = of_camera.compose(&camera.frame());
            let point = marker.frame().point(&self.fixture_point(pose.observation));
            let depth = frame.resolve(&(of_marker.point(&point) - frame.origin)).z;
            let [_, _, _, _, _, _, fx, fy, ..] = camera.numbers;
            Some(Vector3::new(error.x * depth / fx, error.y * depth / fy, 0.0))
        };
        let of_images = |((pose, _), _): &((&Pose, _), _)| {
            pose.observation.description().needs == Needs::Carriers
        };
        poses.iter().zip(errors).zip(carriers).filter(of_images).filter_map(length).collect()
    }

    /// Evaluates `value` for each pose in parallel, with a predictor at the full parameter vector
    /// `x`.
    fn map<T: Send>(
        &self,
        poses: &[Pose],
        x: &[f64],
        value: impl Fn(&mut Predictor, &Pose) -> T + Sync,
    ) -> Vec<T> {
        let chunk = |poses: &[Pose]| {
            let mut predictor = Predictor::new(self, x);
            poses.iter().map(|pose| value(&mut predictor, pose)).collect::<Vec<_>>()
        };
        parallel::map_chunks(poses, CHUNK_ITEMS, chunk)
    }
}
