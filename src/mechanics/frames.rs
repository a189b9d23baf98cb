//! Frames along the arm at equilibrium, with derivatives.

use num_dual::Dual64;

use super::arm::Arm;
use super::forward::DeflectionMode;
use super::statics::{MAX_EQUILIBRIUM_PASSES, MAX_RELATIVE_CHANGE, StaticState};
use super::workspace::Workspace;
use crate::problem::{Equilibrium, PoseView};
use crate::spatial::Frame;

impl Arm<Dual64> {
    /// Returns the frame behind the mounting and the frames behind all joints, arm base frame.
    /// `state` is the equilibrium of the same arm without derivatives.
    ///
    /// The derivatives of the moments are those from the fixed point x = G(x) of
    /// [`super::statics`], iterated until they settle.
    pub(crate) fn frames(
        &self,
        setup: &PoseView,
        state: &StaticState,
        ws: &mut Workspace<Dual64>,
    ) -> Vec<Frame<Dual64>> {
        ws.keeps_frames = true;
        self.gather_forces(setup, &[], ws);
        self.walk(setup, DeflectionMode::Rigid, state.tip, ws);
        ws.sum_moments();
        let mut moments = ws.next_moments.clone();
        if !self.is_elastic() || moments.is_empty() {
            return std::mem::take(&mut ws.frames);
        }
        let mut first_order = None;
        if self.equilibrium == Equilibrium::Undeflected {
            self.update_leaning_ropes(setup, &moments, ws);
            self.walk(setup, DeflectionMode::FirstOrder(&moments), state.tip, ws);
            let frames = std::mem::take(&mut ws.frames);
            let Some(mixing) = self.mixing else { return frames };
            first_order = Some((frames, mixing));
        }
        if state.moments.len() == moments.len() {
            moments = state.moments.iter().map(|&x| Dual64::from(x)).collect();
        }
        for _ in 0..MAX_EQUILIBRIUM_PASSES {
            self.update_leaning_ropes(setup, &moments, ws);
            self.walk(setup, DeflectionMode::Bent(&moments), state.tip, ws);
            ws.sum_moments();
            let largest = ws.next_moments.iter().fold(0.0_f64, |m, x| m.max(x.eps.abs()));
            let both = moments.iter().zip(&ws.next_moments);
            let change = both.fold(0.0_f64, |m, (a, b)| m.max((a.eps - b.eps).abs()));
            moments.clone_from(&ws.next_moments);
            if change <= MAX_RELATIVE_CHANGE * largest || !change.is_finite() {
                break;
            }
        }
        let frames = std::mem::take(&mut ws.frames);
        let Some((first_order, mixing)) = first_order else { return frames };
        let mix = |(one, other): (&Frame<Dual64>, &Frame<Dual64>)| Frame {
            axes: std::array::from_fn(|k| one.axes[k] + (other.axes[k] - one.axes[k]) * mixing),
            origin: one.origin + (other.origin - one.origin) * mixing,
        };
        first_order.iter().zip(&frames).map(mix).collect()
    }
}
