//! From a forward pass segment by segment to the tape: how the end and the loads of each segment
//! move with each of its numbers.

use nalgebra::Vector3;
use num_dual::Dual64;

use super::tape::{Column, Felt, Step, Tape, TapedSegment};
use super::workspace::{Event, Workspace};
use crate::spatial::Frame;

impl Tape {
    /// Takes down a forward pass segment by segment; `parameters` counts those of each segment. The
    /// columns are left to be filled in.
    pub(super) fn record(&mut self, ws: &Workspace<Dual64>, parameters: &[usize]) {
        self.clear();
        let mut cuts = ws.cuts.iter();
        let mut root = Frame::identity();
        let mut forks = Vec::new();
        // Loads since the last other event: those of an element, if one ends next.
        let mut own = 0;
        for (index, event) in ws.events.iter().enumerate() {
            if index == ws.passed {
                self.target = self.steps.len();
            }
            match event {
                Event::Load { at, force } => {
                    self.load(at.map(|c| c.re), force.map(|c| c.re));
                    own += 1;
                    continue;
                }
                Event::Cut => {
                    let Some(cut) = cuts.next() else { continue };
                    let (segment, (first, count)) = (cut.segment, cut.unknowns);
                    self.segment(TapedSegment {
                        index: segment.index(),
                        root,
                        tip: cut.real(),
                        turns: segment.is_beam(),
                        unknowns: first..first + count,
                        moment_lane: segment.moment_lane(count),
                        parameter_lane: segment.first_lane(),
                        lanes: segment.first_lane() + parameters[segment.index()],
                        events: if segment.is_beam() { index - own..index } else { index..index },
                        axis: index
                            .checked_sub(1)
                            .filter(|&last| matches!(ws.events[last], Event::Axis { .. })),
                        ..TapedSegment::default()
                    });
                    root = cut.real();
                }
                Event::Tip { .. } => {
                    self.section(root.origin, &Frame::identity().axes, Felt::InSpace)
                }
                Event::Axis { .. } => self.section(root.origin, &root.axes[2..], Felt::OnTheArm),
                Event::Tilt { .. } => self.section(root.origin, &root.axes[..2], Felt::OnTheArm),
                Event::Fork { further } => {
                    forks.extend((0..*further).map(|_| root));
                    self.steps.push(Step::Fork { further: *further });
                }
                Event::Branch => {
                    root = forks.pop().unwrap_or(root);
                    self.steps.push(Step::Branch);
                }
            }
            own = 0;
        }
        if ws.passed == ws.events.len() {
            self.target = self.steps.len();
        }
        self.sum_loads();
    }

    /// Fills in the columns of one direction, from the same pass with derivatives in that
    /// direction.
    pub(super) fn fill(&mut self, lane: usize, ws: &Workspace<Dual64>) {
        let segments = self.steps.iter().filter_map(|step| match step {
            Step::Segment(segment) => Some(segment),
            _ => None,
        });
        for (segment, cut) in segments.zip(&ws.cuts).filter(|(segment, _)| lane < segment.lanes) {
            let [x, y, z] = &segment.tip.axes;
            let [dx, dy, dz] = cut.frame.axes.map(|axis| axis.map(|c| c.eps));
            let rotation = segment.tip.vector(&Vector3::new(dy.dot(z), dz.dot(x), dx.dot(y)));
            let velocity = cut.frame.origin.map(|c| c.eps);
            let pull = match segment.axis.map(|axis| &ws.events[axis]) {
                Some(Event::Axis { pull: Some(pull), .. }) => pull.eps,
                _ => 0.0,
            };
            self.columns[segment.column(lane)] = Column {
                rotation,
                translation: velocity - rotation.cross(&segment.tip.origin),
                pull,
            };
            for (moved, event) in
                self.moves[segment.moves(lane)].iter_mut().zip(&ws.events[segment.events.clone()])
            {
                if let Event::Load { at, .. } = event {
                    *moved = at.map(|c| c.eps);
                }
            }
        }
    }
}
