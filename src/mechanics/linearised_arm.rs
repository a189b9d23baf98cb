//! Forward pass segment by segment, linearised about an equilibrium.

use std::ops::Range;

use nalgebra::Vector3;

use super::anderson::Anderson;
use crate::spatial::Frame;

/// One vector for each of the three coordinates of the target's position.
pub(super) type PerCoordinate = [Vector3<f64>; 3];

/// Motion of a segment's end per unit of one parameter: a point r fixed to the end moves by
/// rotation × r + translation, arm base frame.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct EndTwist {
    /// Rotation vector per unit of the parameter \[rad\].
    pub rotation: Vector3<f64>,
    /// Displacement of the point at the base origin per unit \[m\].
    pub translation: Vector3<f64>,
    /// Change of the moment of the spring about a joint's axis, per unit [N·m].
    pub spring_moment: f64,
}

/// Axes of a section's moment: fixed in space, or moving with the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MomentAxes {
    Fixed,
    Moving,
}

/// Element of the linearised forward pass, in order from the base outwards.
#[derive(Debug, Clone)]
pub(super) enum Step {
    /// Load on a rigid part, by its index in [`LinearisedArm::loads`].
    Load(usize),
    /// Point of the arm where moments are unknown.
    MomentSection(MomentSection),
    /// Segment of the arm.
    Segment(LinearisedSegment),
    /// Fork at which `branches` branches start besides the one that follows.
    Fork { branches: usize },
    /// End of a branch; the next one starts at the last fork with a branch left.
    Branch,
}

/// Segment with the indices of its derivatives: one twist for each of its directions, and the moves
/// of its loads in each.
///
/// The first three directions of a segment that `rotates` are rotations of its root, in the root's
/// axes.
#[derive(Debug, Clone, Default)]
pub(super) struct LinearisedSegment {
    /// Index of the segment in the list of all segments of the arm.
    pub index: usize,
    pub root: Frame<f64>,
    pub tip: Frame<f64>,
    pub rotates: bool,
    /// Indices of the unknown moments that deflect the segment.
    pub unknowns: Range<usize>,
    pub moment_direction: usize,
    /// Index of the first direction of the segment that belongs to a parameter.
    pub parameter_direction: usize,
    /// Number of directions in which the segment is linearised: moments and parameters.
    pub directions: usize,
    /// Events of the forward pass that are the segment's loads.
    pub events: Range<usize>,
    /// Event of the joint's axis; `None` if the segment is no joint that deflects about it.
    pub axis: Option<usize>,
    /// Indices of the segment's loads, set by [`LinearisedArm::push_segment`].
    pub loads: Range<usize>,
    /// Index of its first twist in [`LinearisedArm::columns`].
    pub first_column: usize,
    /// Index of its first load motion in [`LinearisedArm::moves`].
    pub first_move: usize,
}

impl LinearisedSegment {
    pub fn column_index(&self, direction: usize) -> usize {
        self.first_column + direction
    }

    pub fn move_range(&self, direction: usize) -> Range<usize> {
        let first = self.first_move + direction * self.loads.len();
        first..first + self.loads.len()
    }
}

/// Point of the arm where moments are unknowns of the equilibrium: position, axes of the moments,
/// indices of the unknowns.
#[derive(Debug, Clone)]
pub(super) struct MomentSection {
    pub at: Vector3<f64>,
    pub axes: PerCoordinate,
    pub unknowns: Range<usize>,
    pub moment_axes: MomentAxes,
    /// Sum of the forces of all loads beyond \[N\].
    pub force: Vector3<f64>,
    pub moment: Vector3<f64>,
}

/// Force at a point, arm base frame. Its virtual force is the change of each coordinate of the
/// target per displacement of the point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Load {
    pub at: Vector3<f64>,
    pub force: Vector3<f64>,
    pub virtual_force: PerCoordinate,
}

/// Sum of forces, and of their moments about the base origin.
#[derive(Default)]
struct Wrench {
    force: Vector3<f64>,
    moment: Vector3<f64>,
}

impl Wrench {
    fn add(&mut self, load: &Load) {
        self.force += load.force;
        self.moment += load.at.cross(&load.force);
    }
}

/// Pose at equilibrium, linearised segment by segment, from which derivatives of the position
/// follow.
#[derive(Debug, Clone, Default)]
pub(super) struct LinearisedArm {
    pub steps: Vec<Step>,
    /// Number of steps between the base and the frame that carries the target.
    pub target: usize,
    pub loads: Vec<Load>,
    pub columns: Vec<EndTwist>,
    pub moves: Vec<Vector3<f64>>,
    /// Influence Λ: for each moment the three coordinates of the target [m/(N·m)].
    pub influence: Vec<f64>,
    /// Image of the influence Λ under the last sweep of the fixed-point iteration [m/(N·m)].
    pub image: Vec<f64>,
    pub anderson: Anderson,
    /// Derivatives of the position with respect to the parameters, by segment and direction.
    pub derivatives: Vec<Vector3<f64>>,
    /// Number of directions reserved for each segment in `derivatives`.
    pub stride: usize,
}

impl LinearisedArm {
    /// Creates an empty linearisation of `parts` segments, each with at most `directions`
    /// directions of differentiation.
    pub fn new(parts: usize, directions: usize) -> Self {
        Self {
            derivatives: vec![Vector3::zeros(); parts * directions],
            stride: directions,
            ..Self::default()
        }
    }

    /// Returns the derivative of the target's position, arm base frame \[m\], with respect to the
    /// parameter in a direction of the segment with index `part`.
    pub fn derivative(&self, part: usize, direction: usize) -> Vector3<f64> {
        self.derivatives[part * self.stride + direction]
    }

    pub fn clear(&mut self) {
        self.steps.clear();
        self.loads.clear();
        self.columns.clear();
        self.moves.clear();
        self.influence.clear();
        self.image.clear();
        self.derivatives.fill(Vector3::zeros());
    }

    pub fn push_load(&mut self, at: Vector3<f64>, force: Vector3<f64>) {
        self.steps.push(Step::Load(self.loads.len()));
        self.loads.push(Load { at, force, virtual_force: [Vector3::zeros(); 3] });
    }

    pub fn push_section(
        &mut self,
        at: Vector3<f64>,
        axes: &[Vector3<f64>],
        moment_axes: MomentAxes,
    ) {
        let first = self.influence.len() / 3;
        self.influence.resize(3 * (first + axes.len()), 0.0);
        self.image.resize(self.influence.len(), 0.0);
        let mut axes_with_zeros = [Vector3::zeros(); 3];
        axes_with_zeros[..axes.len()].copy_from_slice(axes);
        let (force, moment) = (Vector3::zeros(), Vector3::zeros());
        self.steps.push(Step::MomentSection(MomentSection {
            at,
            axes: axes_with_zeros,
            unknowns: first..first + axes.len(),
            moment_axes,
            force,
            moment,
        }));
    }

    /// Appends a segment. Its loads are those that were added last, as many as it has events.
    pub fn push_segment(&mut self, mut segment: LinearisedSegment) {
        segment.loads = self.loads.len() - segment.events.len()..self.loads.len();
        (segment.first_column, segment.first_move) = (self.columns.len(), self.moves.len());
        self.columns.resize(segment.first_column + segment.directions, EndTwist::default());
        self.moves.resize(
            segment.first_move + segment.directions * segment.loads.len(),
            Vector3::zeros(),
        );
        self.steps.truncate(self.steps.len() - segment.loads.len());
        self.steps.push(Step::Segment(segment));
    }

    /// Sums the forces and moments of the loads beyond every section, after all steps were added.
    pub fn sum_loads(&mut self) {
        let mut beyond = Wrench::default();
        let mut ends = Vec::new();
        for step in self.steps.iter_mut().rev() {
            match step {
                Step::Load(load) => beyond.add(&self.loads[*load]),
                Step::Segment(segment) => {
                    self.loads[segment.loads.clone()].iter().for_each(|load| beyond.add(load));
                }
                Step::MomentSection(section) => {
                    section.force = beyond.force;
                    section.moment = beyond.moment - section.at.cross(&beyond.force);
                }
                Step::Branch => ends.push(std::mem::take(&mut beyond)),
                Step::Fork { branches } => {
                    for branch in (0..*branches).filter_map(|_| ends.pop()) {
                        beyond.force += branch.force;
                        beyond.moment += branch.moment;
                    }
                }
            }
        }
    }
}
