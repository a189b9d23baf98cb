//! Linearisation of a forward pass segment by segment: motion of each segment's end and loads with
//! each of its parameters.

use nalgebra::Vector3;
use num_dual::Dual64;

use super::linearised_arm::{EndTwist, LinearisedArm, LinearisedSegment, MomentAxes, Step};
use super::workspace::{Event, Workspace};
use crate::spatial::Frame;

impl LinearisedArm {
    /// Copies the events of a forward pass made segment by segment; `parameters` counts the
    /// parameters of each segment. All derivatives are left at zero.
    pub(super) fn linearise(&mut self, ws: &Workspace<Dual64>, parameters: &[usize]) {
        self.clear();
        let mut cuts = ws.cuts.iter();
        let mut root = Frame::identity();
        let mut forks = Vec::new();
        // Number of loads since the last event of another kind. If the end of a beam element is
        // next, they are its loads.
        let mut element_loads = 0;
        for (index, event) in ws.events.iter().enumerate() {
            if index == ws.events_before_tip {
                self.target = self.steps.len();
            }
            match event {
                Event::Load { at, force } => {
                    self.push_load(at.map(|c| c.re), force.map(|c| c.re));
                    element_loads += 1;
                    continue;
                }
                Event::Cut => {
                    let Some(cut) = cuts.next() else { continue };
                    let (segment, (first, count)) = (cut.segment, cut.unknowns);
                    self.push_segment(LinearisedSegment {
                        index: segment.index(),
                        root,
                        tip: cut.real_frame(),
                        rotates: segment.is_beam(),
                        unknowns: first..first + count,
                        moment_direction: segment.moment_direction(count),
                        parameter_direction: segment.first_parameter_direction(),
                        directions: segment.first_parameter_direction()
                            + parameters[segment.index()],
                        events: if segment.is_beam() {
                            index - element_loads..index
                        } else {
                            index..index
                        },
                        axis: index
                            .checked_sub(1)
                            .filter(|&last| matches!(ws.events[last], Event::Axis { .. })),
                        ..LinearisedSegment::default()
                    });
                    root = cut.real_frame();
                }
                Event::Tip { .. } => {
                    self.push_section(root.origin, &Frame::identity().axes, MomentAxes::Fixed);
                }
                Event::Axis { .. } => {
                    self.push_section(root.origin, &root.axes[2..], MomentAxes::Moving);
                }
                Event::Tilt { .. } => {
                    self.push_section(root.origin, &root.axes[..2], MomentAxes::Moving);
                }
                Event::Fork { branches } => {
                    forks.extend((0..*branches).map(|_| root));
                    self.steps.push(Step::Fork { branches: *branches });
                }
                Event::Branch => {
                    root = forks.pop().unwrap_or(root);
                    self.steps.push(Step::Branch);
                }
            }
            element_loads = 0;
        }
        if ws.events_before_tip == ws.events.len() {
            self.target = self.steps.len();
        }
        self.sum_loads();
    }

    /// Sets the derivatives of one direction, from the same pass in dual numbers with that
    /// direction's variables.
    pub(super) fn fill_derivatives(&mut self, direction: usize, ws: &Workspace<Dual64>) {
        let segments = self.steps.iter().filter_map(|step| match step {
            Step::Segment(segment) => Some(segment),
            _ => None,
        });
        for (segment, cut) in
            segments.zip(&ws.cuts).filter(|(segment, _)| direction < segment.directions)
        {
            let [x, y, z] = &segment.tip.axes;
            let [dx, dy, dz] = cut.frame.axes.map(|axis| axis.map(|c| c.eps));
            let rotation = segment.tip.vector(&Vector3::new(dy.dot(z), dz.dot(x), dx.dot(y)));
            let velocity = cut.frame.origin.map(|c| c.eps);
            let spring_moment = match segment.axis.map(|axis| &ws.events[axis]) {
                Some(Event::Axis { pull: Some(pull), .. }) => pull.eps,
                _ => 0.0,
            };
            self.columns[segment.column_index(direction)] = EndTwist {
                rotation,
                translation: velocity - rotation.cross(&segment.tip.origin),
                spring_moment,
            };
            for (moved, event) in self.moves[segment.move_range(direction)]
                .iter_mut()
                .zip(&ws.events[segment.events.clone()])
            {
                if let Event::Load { at, .. } = event {
                    *moved = at.map(|c| c.eps);
                }
            }
        }
    }
}
