//! Results of a forward pass along the arm, and the moments of its loads.

use nalgebra::Vector3;

use super::Wrench;
use super::anderson::Anderson;
use super::element::LinkLoad;
use super::segment::Cut;
use crate::scalar::Scalar;
use crate::spatial::Frame;

/// Event of a forward pass, in order from the base outwards.
#[derive(Debug, Clone, Copy)]
pub(super) enum Event<S> {
    /// Force \[N\] at a point \[m\], arm base frame.
    Load { at: Vector3<S>, force: Vector3<S> },
    /// Tip of a beam element: its three moments are unknown.
    Tip { at: Vector3<S> },
    /// Flexible joint: the moment about its axis is unknown. It is the sum of all loads beyond and
    /// of a spring's pull [N·m].
    Axis { at: Vector3<S>, axis: Vector3<S>, pull: Option<S> },
    /// Tilt about two axes: the moments about them are unknown.
    Tilt { at: Vector3<S>, axes: [Vector3<S>; 2] },
    /// End of a segment; occurs only if the arm is linearised segment by segment.
    Cut,
    /// Fork at which `branches` more branches start besides the one that follows.
    Fork { branches: usize },
    /// End of a branch; the next one starts at the last fork with a branch still to be passed.
    Branch,
}

/// Memory for forward passes, reused from pose to pose.
#[derive(Debug, Clone)]
pub struct Workspace<S> {
    pub(super) events: Vec<Event<S>>,
    pub(super) moments: Vec<S>,
    pub(super) next_moments: Vec<S>,
    /// Position of each hook, x and y in the arm base frame \[m\], if ropes may lean; unknowns
    /// before all moments.
    pub(super) hooks: Vec<[S; 2]>,
    /// Ends of segments, recorded by a pass made segment by segment.
    pub(super) cuts: Vec<Cut<S>>,
    /// Number of events recorded before the frame of the requested joint.
    pub(super) events_before_tip: usize,
    /// Frames at which branches are still to be passed, the last one first.
    pub(super) forks: Vec<Frame<S>>,
    /// Mass \[kg\] and hoist force \[N\] of branches that have been summed but not yet added to
    /// their trunk.
    pub(super) branch_sums: Vec<(S, Vector3<S>)>,
    pub(super) wrenches: Vec<(Vector3<S>, Vector3<S>)>,
    /// Frames behind the mounting and behind each joint in the last pass, if they are kept.
    pub(super) frames: Vec<Frame<S>>,
    pub(super) keeps_frames: bool,
    /// Force of each link's rope \[N\]; zero without a rope.
    pub(super) ropes: Vec<Vector3<S>>,
    /// Force of everything beyond each joint's link \[N\].
    pub(super) outboard_forces: Vec<Vector3<S>>,
    /// Frame at each link's root in the last undeflected pass.
    pub(super) rigid_roots: Vec<Frame<S>>,
    /// Points of the last pass, arm base frame \[m\]: ends of beam elements, and each joint before
    /// and after its rotation.
    pub(super) trail: Vec<Vector3<S>>,
    pub(super) link_loads: Vec<LinkLoad<S>>,
    pub(super) points: Vec<(S, Wrench<S>)>,
    /// Anderson acceleration of the passes towards equilibrium.
    pub(super) anderson: Anderson,
}

impl<S> Default for Workspace<S> {
    fn default() -> Self {
        Self {
            events: Vec::new(),
            moments: Vec::new(),
            next_moments: Vec::new(),
            hooks: Vec::new(),
            cuts: Vec::new(),
            events_before_tip: 0,
            forks: Vec::new(),
            branch_sums: Vec::new(),
            wrenches: Vec::new(),
            frames: Vec::new(),
            keeps_frames: false,
            ropes: Vec::new(),
            outboard_forces: Vec::new(),
            rigid_roots: Vec::new(),
            trail: Vec::new(),
            link_loads: Vec::new(),
            points: Vec::new(),
            anderson: Anderson::default(),
        }
    }
}

impl Workspace<f64> {
    /// Returns the sum of the magnitudes of all moments about the base in the last pass, springs
    /// included [N·m].
    pub(super) fn moment_scale(&self) -> f64 {
        let term = |event: &Event<f64>| match event {
            Event::Load { at, force } => at.norm() * force.norm(),
            Event::Axis { pull: Some(pull), .. } => pull.abs(),
            _ => 0.0,
        };
        self.events.iter().map(term).sum()
    }
}

impl<S: Scalar> Workspace<S> {
    /// Appends the frame behind a joint, if the caller asked for all frames.
    #[inline]
    pub(super) fn keep_frame(&mut self, frame: &Frame<S>) {
        if self.keeps_frames {
            self.frames.push(*frame);
        }
    }

    /// Computes the unknowns of the last pass: positions of hooks \[m\], then moments [N·m].
    pub(super) fn sum_moments(&mut self) {
        let Self { events, next_moments, hooks, wrenches, .. } = self;
        let zero = Vector3::from_element(S::from(0.0));
        let (mut force_sum, mut moment_sum) = (zero, zero);
        next_moments.clear();
        wrenches.clear();
        for event in events.iter().rev() {
            match event {
                Event::Load { at, force } => {
                    force_sum += force;
                    moment_sum += at.cross(force);
                }
                Event::Tip { at } => {
                    let moment = moment_sum - at.cross(&force_sum);
                    next_moments.extend([moment.z, moment.y, moment.x]);
                }
                Event::Axis { at, axis, pull } => {
                    let moment = axis.dot(&(moment_sum - at.cross(&force_sum)));
                    next_moments.push(pull.map_or(moment, |pull| moment + pull));
                }
                Event::Tilt { at, axes: [x, y] } => {
                    let moment = moment_sum - at.cross(&force_sum);
                    next_moments.extend([y.dot(&moment), x.dot(&moment)]);
                }
                Event::Cut => {}
                Event::Branch => {
                    wrenches.push((force_sum, moment_sum));
                    (force_sum, moment_sum) = (zero, zero);
                }
                Event::Fork { branches } => {
                    for (force, moment) in (0..*branches).filter_map(|_| wrenches.pop()) {
                        force_sum += force;
                        moment_sum += moment;
                    }
                }
            }
        }
        next_moments.extend(hooks.iter().rev().flat_map(|&[x, y]| [y, x]));
        next_moments.reverse();
    }
}
