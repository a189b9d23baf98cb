//! Frames along the arm at rest, with derivatives.

use num_dual::Dual64;

use super::arm::Arm;
use super::forward::Bend;
use super::statics::{MAX_PASSES, SETTLED, StaticState};
use super::workspace::Workspace;
use crate::problem::{Equilibrium, PoseView};
use crate::spatial::Frame;

impl Arm<Dual64> {
    /// The frame behind the arm's mounting and that behind every joint, arm base frame, of a pose
    /// that the same arm without derivatives has brought to `rest`.
    ///
    /// The moments' derivatives follow from the fixed point x = G(x) of [`super::statics`] by
    /// passing through it until they settle too.
    pub(crate) fn frames(
        &self,
        setup: &PoseView,
        rest: &StaticState,
        ws: &mut Workspace<Dual64>,
    ) -> Vec<Frame<Dual64>> {
        ws.keeps_frames = true;
        self.gather_forces(setup, &[], ws);
        self.walk(setup, Bend::Rigid, rest.tip, ws);
        ws.sum_moments();
        let mut moments = ws.next_moments.clone();
        if !self.is_elastic() || moments.is_empty() {
            return std::mem::take(&mut ws.frames);
        }
        let mut first_order = None;
        if self.equilibrium == Equilibrium::Undeflected {
            self.lean_ropes(setup, &moments, ws);
            self.walk(setup, Bend::FirstOrder(&moments), rest.tip, ws);
            let frames = std::mem::take(&mut ws.frames);
            let Some(mixing) = self.mixing else { return frames };
            first_order = Some((frames, mixing));
        }
        if rest.moments.len() == moments.len() {
            moments = rest.moments.iter().map(|&x| Dual64::from(x)).collect();
        }
        for _ in 0..MAX_PASSES {
            self.lean_ropes(setup, &moments, ws);
            self.walk(setup, Bend::Bent(&moments), rest.tip, ws);
            ws.sum_moments();
            let largest = ws.next_moments.iter().fold(0.0_f64, |m, x| m.max(x.eps.abs()));
            let both = moments.iter().zip(&ws.next_moments);
            let change = both.fold(0.0_f64, |m, (a, b)| m.max((a.eps - b.eps).abs()));
            moments.clone_from(&ws.next_moments);
            if change <= SETTLED * largest || !change.is_finite() {
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
