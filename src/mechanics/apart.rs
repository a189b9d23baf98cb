//! The arm taken apart: every part is differentiated alone, by the few numbers that act on it.
//!
//! A part is the base that tilts, a joint, or a beam element; between parts only a frame is handed on. What the moments and
//! the parameters of a part do, and the turning of its root, is kept in plain numbers: how its end moves (a twist) and how
//! its loads do. Parts do not feel each other, so that numbers of different parts share a direction of one walk. [`super::virtual_work`] chains them.

use nalgebra::Vector3;
use num_dual::Dual64;

use super::link::Arm;
use super::trail::{self, Column, Felt, Step, Trail};
use super::workspace::{Event, Workspace};
use crate::scalar::Scalar;
use crate::spatial::Frame;

/// A part of the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The base, where it tilts.
    Mounting,
    /// A joint with its α, and its a where no beam lies along it.
    Joint(usize),
    /// The beam along a joint's a; a part for every element, with the same parameters.
    Beam(usize),
}

impl Part {
    /// The first direction that is left for parameters: a beam's root turns in three, an element bends by three moments, a
    /// joint tilts by two and turns by one.
    pub fn first_lane(self) -> usize {
        if self.is_beam() { 6 } else { 3 }
    }

    /// Direction of the first of the `count` moments that bend the part at once.
    fn moment_lane(self, count: usize) -> usize {
        match (self, count) {
            (Self::Beam(_), _) => 3,
            (_, 2) => 0,
            _ => 2,
        }
    }

    fn is_beam(self) -> bool {
        matches!(self, Self::Beam(_))
    }

    /// Place in a list of all parts.
    pub(super) fn index(self) -> usize {
        match self {
            Self::Mounting => 0,
            Self::Joint(joint) => 1 + 2 * joint,
            Self::Beam(joint) => 2 + 2 * joint,
        }
    }
}

/// The end of a part.
#[derive(Debug, Clone)]
pub(super) struct Cut<S> {
    /// The frame there.
    pub frame: Frame<S>,
    pub part: Part,
    /// Index of the first moment that bends the part, and how many there are.
    pub unknowns: (usize, usize),
}

/// Directions of all moments of an arm, in their order.
pub(super) fn moment_lanes<S: Scalar>(arm: &Arm<S>) -> Vec<usize> {
    let mut lanes = Vec::new();
    let mut add = |part: Part, count: usize| lanes.extend((0..count).map(|k| part.moment_lane(count) + k));
    if arm.mounting.is_some() {
        add(Part::Mounting, 2);
    }
    for (i, joint) in arm.joints.iter().enumerate() {
        if joint.beam.is_some() {
            (0..arm.beam_elements).for_each(|_| add(Part::Beam(i), 3));
        }
        if joint.lateral.is_some() {
            add(Part::Joint(i), 2);
        }
        if joint.turns() {
            add(Part::Joint(i), 1);
        }
    }
    lanes
}

impl<S: Scalar> Cut<S> {
    fn real(&self) -> Frame<f64> {
        Frame { axes: self.frame.axes.map(|axis| axis.map(|c| c.re())), origin: self.frame.origin.map(|c| c.re()) }
    }
}

impl Trail {
    /// Takes down a walk part by part; `parameters` counts those of each part. The columns are left to be filled in.
    pub(super) fn record(&mut self, ws: &Workspace<Dual64>, parameters: &[usize]) {
        self.clear();
        let mut cuts = ws.cuts.iter();
        let mut root = Frame::identity();
        // Loads since the last other event: those of an element, if one ends next.
        let mut own = 0;
        for (index, event) in ws.events.iter().enumerate() {
            match event {
                Event::Load { at, force } => {
                    self.load(at.map(|c| c.re), force.map(|c| c.re));
                    own += 1;
                    continue;
                }
                Event::Cut => {
                    let Some(cut) = cuts.next() else { continue };
                    let (part, (first, count)) = (cut.part, cut.unknowns);
                    self.part(trail::Part {
                        index: part.index(),
                        root,
                        tip: cut.real(),
                        turns: part.is_beam(),
                        unknowns: first..first + count,
                        moment_lane: part.moment_lane(count),
                        parameter_lane: part.first_lane(),
                        lanes: part.first_lane() + parameters[part.index()],
                        events: if part.is_beam() { index - own..index } else { index..index },
                        ..trail::Part::default()
                    });
                    root = cut.real();
                }
                Event::Tip { .. } => self.section(root.origin, &Frame::identity().axes, Felt::InSpace),
                Event::Axis { .. } => self.section(root.origin, &root.axes[2..], Felt::OnTheArm),
                Event::Tilt { .. } => self.section(root.origin, &root.axes[..2], Felt::OnTheArm),
            }
            own = 0;
        }
        self.sum_loads();
    }

    /// Fills in the columns of one direction, from the same walk with derivatives in that direction.
    pub(super) fn fill(&mut self, lane: usize, ws: &Workspace<Dual64>) {
        let parts = self.steps.iter().filter_map(|step| match step {
            Step::Part(part) => Some(part),
            _ => None,
        });
        for (part, cut) in parts.zip(&ws.cuts).filter(|(part, _)| lane < part.lanes) {
            let [x, y, z] = &part.tip.axes;
            let [dx, dy, dz] = cut.frame.axes.map(|axis| axis.map(|c| c.eps));
            let rotation = part.tip.vector(&Vector3::new(dy.dot(z), dz.dot(x), dx.dot(y)));
            let velocity = cut.frame.origin.map(|c| c.eps);
            self.columns[part.column(lane)] =
                Column { rotation, translation: velocity - rotation.cross(&part.tip.origin) };
            for (moved, event) in self.moves[part.moves(lane)].iter_mut().zip(&ws.events[part.events.clone()]) {
                if let Event::Load { at, .. } = event {
                    *moved = at.map(|c| c.eps);
                }
            }
        }
    }
}
