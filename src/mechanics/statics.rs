//! Static equilibrium: moments that deflect the arm, and position of its target.
//!
//! The unknowns x are the moments at the sections that deflect, and the positions of hooks whose
//! ropes may lean. There are three moments at every beam element's tip, one about every flexible
//! joint, and two where a part tilts. A forward pass with moments x places every load, and the
//! loads give moments G(x). The moments of the undeflected pass are the paper's first order; x =
//! G(x) is equilibrium on the deflected arm. With P(x) the target position,
//!
//! p = P(x*) + Λ (G(x*) − x*),  Λ = `P_x` (I − `G_x`)⁻¹,
//!
//! has the value and the first derivatives of the equilibrium position. The pass is made in dual
//! numbers at the real fixed point x* (implicit function theorem, in adjoint form). No iteration in
//! dual numbers is needed.

use nalgebra::Vector3;
use num_dual::Dual64;

use super::arm::Arm;
use super::forward::DeflectionMode;
use crate::problem::{Equilibrium, PoseView};
use crate::scalar::Scalar;
use crate::spatial::Frame;

pub use super::workspace::Workspace;

/// Maximum number of passes towards a fixed point. An arm that needs more is reported as too soft
/// for its loads.
pub(super) const MAX_EQUILIBRIUM_PASSES: usize = 200;
/// Largest change per pass at convergence: of the moments relative to the sum of their magnitudes,
/// and of Λ relative to its size.
pub(super) const MAX_RELATIVE_CHANGE: f64 = 1e-13;
/// Largest change of Λ in its last pass, relative to its size, that is still accepted. Rounding may
/// prevent a smaller one, and the derivatives do not change.
pub(super) const MAX_ACCEPTED_CHANGE: f64 = 1e-9;
/// Largest change of a moment between passes, relative to the sum of the magnitudes of its terms,
/// that counts as rounding and ends the iteration. The terms cancel if a hoist balances the arm.
const MOMENT_ROUNDING: f64 = 1e-15;
/// Reason why a pose has no static equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StaticsError {
    /// Deflections that grow from pass to pass: the arm is too soft for its loads.
    #[error("the deflection does not settle: the arm is too soft for its loads")]
    NotSettled,
}

/// Arm in static equilibrium in one pose.
#[derive(Debug, Clone, Default)]
pub struct StaticState {
    /// Frame of the joint `tip`, arm base frame.
    pub frame: Frame<f64>,
    pub(super) tip: usize,
    /// Moments x* of the loads at equilibrium, one for each unknown moment [N·m].
    pub(super) moments: Vec<f64>,
    /// Influence Λ, shape = (3, moments), row-major [m/(N·m)]; empty until it is computed.
    pub(super) adjoint: Vec<f64>,
    /// Matrix `P_x`, shape = (3, moments), row-major.
    position_response: Vec<f64>,
    /// Matrix `G_x`, shape = (moments, moments), column-major.
    moment_response: Vec<f64>,
}

impl Arm<f64> {
    /// Computes the equilibrium of one pose and the frame of the last joint.
    ///
    /// # Errors
    /// Returns an error if the arm is too soft for its loads.
    pub fn equilibrate(
        &self,
        setup: &PoseView,
        ws: &mut Workspace<f64>,
        pose: &mut StaticState,
    ) -> Result<(), StaticsError> {
        self.equilibrate_at(setup, self.last(), ws, pose)
    }

    /// Computes the equilibrium of one pose and the frame of the joint `tip`, counted from 0.
    ///
    /// # Errors
    /// Returns an error if the arm is too soft for its loads.
    pub fn equilibrate_at(
        &self,
        setup: &PoseView,
        tip: usize,
        ws: &mut Workspace<f64>,
        pose: &mut StaticState,
    ) -> Result<(), StaticsError> {
        pose.adjoint.clear();
        pose.moments.clear();
        pose.tip = tip;
        if !self.is_elastic() {
            pose.frame = self.rigid_frame(setup, tip);
            return Ok(());
        }
        self.gather_forces(setup, &[], ws);
        self.walk(setup, DeflectionMode::Rigid, tip, ws);
        ws.sum_moments();
        pose.moments.extend_from_slice(&ws.next_moments);
        let first_order = if self.is_first_order() {
            self.update_leaning_ropes(setup, &pose.moments, ws);
            pose.frame = self.walk(setup, DeflectionMode::FirstOrder(&pose.moments), tip, ws);
            let Some(mixing) = self.mixing else { return Ok(()) };
            Some((pose.frame, mixing))
        } else {
            None
        };
        ws.anderson.restart();
        for _ in 0..MAX_EQUILIBRIUM_PASSES {
            self.update_leaning_ropes(setup, &pose.moments, ws);
            pose.frame = self.walk(setup, DeflectionMode::Bent(&pose.moments), tip, ws);
            ws.sum_moments();
            let largest = ws.next_moments.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let change = pose
                .moments
                .iter()
                .zip(&ws.next_moments)
                .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            if !change.is_finite() {
                break;
            }
            if change <= MAX_RELATIVE_CHANGE * largest
                || change <= MOMENT_ROUNDING * ws.moment_scale()
            {
                if let Some((first_order, mixing)) = &first_order {
                    pose.frame = mix_frames(first_order, &pose.frame, *mixing);
                }
                return Ok(());
            }
            ws.anderson.advance(&mut pose.moments, &ws.next_moments);
        }
        Err(StaticsError::NotSettled)
    }
}

/// Returns (1 − λ) × `one` + λ × `other`, origins and axes alike, with λ = `mixing`; the result is
/// not orthonormal.
fn mix_frames<S: Scalar>(one: &Frame<S>, other: &Frame<S>, mixing: S) -> Frame<S> {
    let mix = |one: &Vector3<S>, other: &Vector3<S>| one + (other - one) * mixing;
    let axes = std::array::from_fn(|i| mix(&one.axes[i], &other.axes[i]));
    Frame { axes, origin: mix(&one.origin, &other.origin) }
}

/// Solver for Λ, the influence of the moments' equations on the target's position at equilibrium.
#[derive(Debug, Clone)]
pub struct AdjointSolver {
    arm: Arm<Dual64>,
    ws: Workspace<Dual64>,
}

impl AdjointSolver {
    /// Creates the solver for poses of `arm`.
    pub fn new(arm: &Arm<f64>) -> Self {
        Self { arm: arm.lift(), ws: Workspace::default() }
    }

    /// Computes Λ of a pose at equilibrium for the target at `target` \[m\], in the frame for which
    /// the equilibrium was computed.
    ///
    /// # Errors
    /// Returns an error if Λ does not converge: with a little more load, the arm would have no
    /// equilibrium.
    pub fn adjoint(
        &mut self,
        setup: &PoseView,
        target: &Vector3<f64>,
        pose: &mut StaticState,
    ) -> Result<(), StaticsError> {
        let n = pose.moments.len();
        if n == 0 || (self.arm.is_first_order() && self.arm.mixing.is_none()) {
            return Ok(());
        }
        pose.position_response.resize(3 * n, 0.0);
        pose.moment_response.resize(n * n, 0.0);
        let target = target.map(Dual64::from);
        let mut moments = std::mem::take(&mut self.ws.moments);
        self.arm.gather_forces(setup, &[], &mut self.ws);
        for j in 0..n {
            moments.clear();
            moments.extend(pose.moments.iter().map(|&x| Dual64::from(x)));
            moments[j] = moments[j].derivative();
            self.arm.update_leaning_ropes(setup, &moments, &mut self.ws);
            let frame =
                self.arm.walk(setup, DeflectionMode::Bent(&moments), pose.tip, &mut self.ws);
            self.ws.sum_moments();
            let position = frame.point(&target);
            for i in 0..3 {
                pose.position_response[i * n + j] = position[i].eps;
            }
            for (response, moment) in
                pose.moment_response[j * n..].iter_mut().zip(&self.ws.next_moments)
            {
                *response = moment.eps;
            }
        }
        self.ws.moments = moments;
        pose.solve_adjoint()
    }
}

impl StaticState {
    /// Solves Λ = `P_x` + Λ `G_x` by the same contraction as the equilibrium.
    fn solve_adjoint(&mut self) -> Result<(), StaticsError> {
        let n = self.moments.len();
        self.adjoint.clear();
        self.adjoint.extend_from_slice(&self.position_response);
        for row in 0..3 {
            let direct = &self.position_response[row * n..(row + 1) * n];
            let adjoint = &mut self.adjoint[row * n..(row + 1) * n];
            let scale = direct.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let mut change = 0.0_f64;
            for _ in 0..MAX_EQUILIBRIUM_PASSES {
                change = 0.0;
                // Gauss–Seidel from the tip inwards: outboard moments act on everything inboard.
                for j in (0..n).rev() {
                    let column = &self.moment_response[j * n..(j + 1) * n];
                    let next =
                        direct[j] + adjoint.iter().zip(column).map(|(l, g)| l * g).sum::<f64>();
                    change = change.max((next - adjoint[j]).abs());
                    adjoint[j] = next;
                }
                if change <= MAX_RELATIVE_CHANGE * scale {
                    break;
                }
            }
            let largest = adjoint.iter().fold(scale, |m, x| m.max(x.abs()));
            // A comparison with NaN is always false.
            if change.is_nan()
                || change > MAX_ACCEPTED_CHANGE * largest
                || adjoint.iter().any(|x| !x.is_finite())
            {
                return Err(StaticsError::NotSettled);
            }
        }
        Ok(())
    }
}

impl<S: Scalar> Arm<S> {
    /// Returns the position \[m\] of the target at `target` \[m\] in the pose's frame, arm base
    /// frame, with its exact first derivatives.
    ///
    /// `pose` is the equilibrium of the same pose with the real parts of this arm's parameters. For
    /// loads on the deflected arm it contains Λ of the same target.
    pub fn target_position(
        &self,
        setup: &PoseView,
        target: &Vector3<f64>,
        pose: &StaticState,
        ws: &mut Workspace<S>,
    ) -> Vector3<S> {
        let target = target.map(S::from);
        if pose.moments.is_empty() {
            return self.rigid_frame(setup, pose.tip).point(&target);
        }
        self.gather_forces(setup, &[], ws);
        let mut moments = std::mem::take(&mut ws.moments);
        let first_order = self.is_first_order().then(|| {
            self.walk(setup, DeflectionMode::Rigid, pose.tip, ws);
            ws.sum_moments();
            moments.clear();
            moments.extend_from_slice(&ws.next_moments);
            self.update_leaning_ropes(setup, &moments, ws);
            self.walk(setup, DeflectionMode::FirstOrder(&moments), pose.tip, ws).point(&target)
        });
        let position = match (first_order, self.mixing) {
            (Some(first_order), None) => first_order,
            (None, _) => self.deflected_position(setup, &target, pose, &mut moments, ws),
            (Some(first_order), Some(mixing)) => {
                first_order
                    + (self.deflected_position(setup, &target, pose, &mut moments, ws)
                        - first_order)
                        * mixing
            }
        };
        ws.moments = moments;
        position
    }

    /// Returns the target's position on the deflected arm with its exact first derivatives, arm
    /// base frame \[m\]; `moments` is reused memory.
    fn deflected_position(
        &self,
        setup: &PoseView,
        target: &Vector3<S>,
        pose: &StaticState,
        moments: &mut Vec<S>,
        ws: &mut Workspace<S>,
    ) -> Vector3<S> {
        moments.clear();
        moments.extend(pose.moments.iter().map(|&x| S::from(x)));
        self.update_leaning_ropes(setup, moments, ws);
        let mut position =
            self.walk(setup, DeflectionMode::Bent(moments), pose.tip, ws).point(target);
        ws.sum_moments();
        let n = moments.len();
        for (j, (next, &x)) in ws.next_moments.iter().zip(&pose.moments).enumerate() {
            let change = *next - x;
            for i in 0..3 {
                position[i] += change * pose.adjoint[i * n + j];
            }
        }
        position
    }

    /// Returns true if the loads act on the undeflected arm.
    fn is_first_order(&self) -> bool {
        self.equilibrium == Equilibrium::Undeflected
    }

    /// Updates the forces of ropes that may lean, from the hook positions in the unknowns `state`.
    pub(super) fn update_leaning_ropes(
        &self,
        setup: &PoseView,
        state: &[S],
        ws: &mut Workspace<S>,
    ) {
        if self.rope.is_some() {
            self.gather_forces(setup, state, ws);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns two moments, each of which multiplies the other by `factor`.
    fn pose(factor: f64) -> StaticState {
        StaticState {
            moments: vec![0.0; 2],
            position_response: vec![1.0; 6],
            moment_response: vec![0.0, factor, factor, 0.0],
            ..StaticState::default()
        }
    }

    #[test]
    fn an_adjoint_that_does_not_settle_is_an_error_of_the_pose() {
        let mut near = pose(0.5);
        assert_eq!(near.solve_adjoint(), Ok(()));
        assert!(
            near.adjoint.iter().all(|entry| (entry - 2.0).abs() < 1e-12),
            "1 / (1 − 1/2): {:?}",
            near.adjoint
        );
        for factor in [1.0, -2.0, 2.0, f64::NAN] {
            assert_eq!(pose(factor).solve_adjoint(), Err(StaticsError::NotSettled), "{factor}");
        }
    }
}
