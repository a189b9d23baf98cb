//! A walk part by part, taken down in plain numbers.

use std::ops::Range;

use nalgebra::Vector3;

use super::anderson::Anderson;
use crate::spatial::Frame;

/// One vector for each coordinate of the position.
pub(super) type Each = [Vector3<f64>; 3];

/// How a part's end moves with one number: point r of everything beyond moves by rotation × r +
/// translation.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Column {
    /// \[rad\] per unit.
    pub rotation: Vector3<f64>,
    /// Of the point at the base origin \[m\] per unit.
    pub translation: Vector3<f64>,
    /// What the spring at a joint's axis adds to the moment that turns the joint [N·m] per unit.
    pub pull: f64,
}

/// How a section's moment is taken: along axes of space, or along axes that turn with the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Felt {
    InSpace,
    OnTheArm,
}

/// What a walk passes, in order from the base outwards.
#[derive(Debug, Clone)]
pub(super) enum Step {
    /// A load on a rigid place.
    Load(usize),
    /// Moments that are unknowns.
    Section(Section),
    /// A segment.
    Segment(TapedSegment),
    /// As many branches as this, besides the one that comes next, begin here.
    Fork { further: usize },
    /// The last branch has ended, and the next one begins where the last fork has one left.
    Branch,
}

/// A part with the places of its numbers: one column for each of its directions, and as many moves
/// as it has loads.
///
/// The first three directions of a part that `turns` are those of its root, in its own axes.
#[derive(Debug, Clone, Default)]
pub(super) struct TapedSegment {
    /// Place in a list of all parts.
    pub index: usize,
    pub root: Frame<f64>,
    pub tip: Frame<f64>,
    pub turns: bool,
    /// Moments that bend it, and their first direction.
    pub unknowns: Range<usize>,
    pub moment_lane: usize,
    /// First direction of its parameters, and end of all directions.
    pub parameter_lane: usize,
    pub lanes: usize,
    /// Its loads as events of the walk.
    pub events: Range<usize>,
    /// The event of its axis, where it is a joint that turns by a moment.
    pub axis: Option<usize>,
    /// Its loads, columns and moves in the lists of all: known once it is listed.
    pub loads: Range<usize>,
    pub first_column: usize,
    pub first_move: usize,
}

impl TapedSegment {
    pub fn column(&self, lane: usize) -> usize {
        self.first_column + lane
    }

    pub fn moves(&self, lane: usize) -> Range<usize> {
        let first = self.first_move + lane * self.loads.len();
        first..first + self.loads.len()
    }
}

/// A place where moments are unknowns.
#[derive(Debug, Clone)]
pub(super) struct Section {
    pub at: Vector3<f64>,
    pub axes: Each,
    pub unknowns: Range<usize>,
    pub felt: Felt,
    /// All loads beyond: force, and moment about the section.
    pub force: Vector3<f64>,
    pub moment: Vector3<f64>,
}

/// A force at a place, base frame, with what a move of it does: the virtual force.
#[derive(Debug, Clone, Copy)]
pub(super) struct Load {
    pub at: Vector3<f64>,
    pub force: Vector3<f64>,
    pub virtually: Each,
}

/// Sums of loads: force, and moment about the base origin.
#[derive(Default)]
struct Sums {
    force: Vector3<f64>,
    moment: Vector3<f64>,
}

impl Sums {
    fn add(&mut self, load: &Load) {
        self.force += load.force;
        self.moment += load.at.cross(&load.force);
    }
}

/// A pose at rest taken down part by part, to differentiate its position.
#[derive(Debug, Clone, Default)]
pub(super) struct Tape {
    pub steps: Vec<Step>,
    /// How many of them come before the target.
    pub target: usize,
    pub loads: Vec<Load>,
    pub columns: Vec<Column>,
    pub moves: Vec<Vector3<f64>>,
    /// Λ, the three coordinates of each moment [m/(N·m)], and what the last walk made of it.
    pub influence: Vec<f64>,
    pub image: Vec<f64>,
    pub anderson: Anderson,
    /// Of the position with respect to the parameters, part after part, direction after direction.
    pub derivatives: Vec<Vector3<f64>>,
    /// Directions of each part there.
    pub stride: usize,
}

impl Tape {
    /// For `parts` of at most `lanes` directions.
    pub fn new(parts: usize, lanes: usize) -> Self {
        Self {
            derivatives: vec![Vector3::zeros(); parts * lanes],
            stride: lanes,
            ..Self::default()
        }
    }

    /// Derivative of the position with respect to the parameter in a direction of a segment.
    pub fn derivative(&self, part: usize, lane: usize) -> Vector3<f64> {
        self.derivatives[part * self.stride + lane]
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

    pub fn load(&mut self, at: Vector3<f64>, force: Vector3<f64>) {
        self.steps.push(Step::Load(self.loads.len()));
        self.loads.push(Load { at, force, virtually: [Vector3::zeros(); 3] });
    }

    pub fn section(&mut self, at: Vector3<f64>, axes: &[Vector3<f64>], felt: Felt) {
        let first = self.influence.len() / 3;
        self.influence.resize(3 * (first + axes.len()), 0.0);
        self.image.resize(self.influence.len(), 0.0);
        let mut all = [Vector3::zeros(); 3];
        all[..axes.len()].copy_from_slice(axes);
        let (force, moment) = (Vector3::zeros(), Vector3::zeros());
        self.steps.push(Step::Section(Section {
            at,
            axes: all,
            unknowns: first..first + axes.len(),
            felt,
            force,
            moment,
        }));
    }

    /// A segment; its loads are the last ones.
    pub fn segment(&mut self, mut segment: TapedSegment) {
        segment.loads = self.loads.len() - segment.events.len()..self.loads.len();
        (segment.first_column, segment.first_move) = (self.columns.len(), self.moves.len());
        self.columns.resize(segment.first_column + segment.lanes, Column::default());
        self.moves
            .resize(segment.first_move + segment.lanes * segment.loads.len(), Vector3::zeros());
        self.steps.truncate(self.steps.len() - segment.loads.len());
        self.steps.push(Step::Segment(segment));
    }

    /// Sums the loads beyond every section, once all is taken down.
    pub fn sum_loads(&mut self) {
        let mut sums = Sums::default();
        let mut branches = Vec::new();
        for step in self.steps.iter_mut().rev() {
            match step {
                Step::Load(load) => sums.add(&self.loads[*load]),
                Step::Segment(segment) => {
                    self.loads[segment.loads.clone()].iter().for_each(|load| sums.add(load))
                }
                Step::Section(section) => {
                    section.force = sums.force;
                    section.moment = sums.moment - section.at.cross(&sums.force);
                }
                Step::Branch => branches.push(std::mem::take(&mut sums)),
                Step::Fork { further } => {
                    for branch in (0..*further).filter_map(|_| branches.pop()) {
                        sums.force += branch.force;
                        sums.moment += branch.moment;
                    }
                }
            }
        }
    }
}
