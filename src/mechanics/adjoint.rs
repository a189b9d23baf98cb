//! The adjoint sweep: derivatives of the position at rest, by virtual work.
//!
//! With Λ the influence of the moments' equations (see [`super::statics`]), each coordinate of p +
//! Λ·(G − x) changes with the place of every load, section and segment. Walking inwards from the
//! target, the wrench that does that change as virtual work on everything passed so far is kept for
//! each of the three coordinates: a load f at r adds the force f × W, with W the Λ-weighted axes of
//! all sections inwards of it; a section adds what its own place and axes do to its moment. A
//! segment's derivative is then the work of that wrench on the segment's twist, and for the spring
//! of a joint what turning the joint does to its moment. For the moments themselves this is Λ
//! again, so that Λ is a fixed point of the sweep, reached by the same contraction as the
//! equilibrium itself.
//!
//! Where branches meet, the wrenches of all of them add up. A branch without the target carries the
//! virtual forces of its loads alone: that is how its masses, by bending the trunk, move the target
//! of another.

use nalgebra::{Matrix3, Vector3};

use super::statics::{HOVERING, MAX_PASSES, SETTLED, StaticsError};
use super::tape::{Column, Each, Felt, Load, Section, Step, Tape};
use crate::spatial::Frame;

/// The wrench about the base origin that does the coordinates' change as virtual work.
#[derive(Debug, Clone, Copy, Default)]
struct Virtual {
    force: Each,
    moment: Each,
}

impl Virtual {
    fn add(&mut self, at: &Vector3<f64>, force: &Each) {
        for (i, force) in force.iter().enumerate() {
            self.moment[i] += at.cross(force);
            self.force[i] += force;
        }
    }

    /// Work on a segment's end.
    fn on(&self, column: &Column) -> Vector3<f64> {
        let each = |i: usize| {
            self.moment[i].dot(&column.rotation) + self.force[i].dot(&column.translation)
        };
        Vector3::new(each(0), each(1), each(2))
    }
}

impl Tape {
    /// Finds Λ, then the derivatives of the position `at` \[m\] of the target with respect to all
    /// parameters.
    pub(super) fn differentiate(&mut self, at: &Vector3<f64>) -> Result<(), StaticsError> {
        self.find_influence(at)?;
        self.weigh_loads();
        self.adjoint_sweep(at, Sought::Parameters);
        Ok(())
    }

    /// Sweeps until Λ is its own image.
    fn find_influence(&mut self, at: &Vector3<f64>) -> Result<(), StaticsError> {
        self.anderson.restart();
        let mut hovers = false;
        for _ in 0..MAX_PASSES {
            self.weigh_loads();
            self.adjoint_sweep(at, Sought::Influence);
            let Self { influence, image, anderson, .. } = self;
            let largest = image.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let change =
                influence.iter().zip(&*image).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            if change <= SETTLED * largest {
                return Ok(());
            }
            hovers = change <= HOVERING * largest && image.iter().all(|x| x.is_finite());
            anderson.advance(influence, image);
        }
        if hovers { Ok(()) } else { Err(StaticsError::NotSettled) }
    }

    /// What a move of each load does.
    fn weigh_loads(&mut self) {
        let Self { steps, loads, influence, .. } = self;
        let mut weights = [Vector3::zeros(); 3];
        let mut forks = Vec::new();
        let weigh = |load: &mut Load, weights: &Each| {
            load.virtually = weights.each_ref().map(|w| load.force.cross(w))
        };
        for step in steps {
            match step {
                Step::Load(load) => weigh(&mut loads[*load], &weights),
                Step::Segment(segment) => {
                    loads[segment.loads.clone()].iter_mut().for_each(|load| weigh(load, &weights));
                }
                Step::Section(section) => {
                    let own = section.weights(influence);
                    (0..3).for_each(|i| weights[i] += own[i]);
                }
                Step::Fork { further } => forks.extend((0..*further).map(|_| weights)),
                Step::Branch => weights = forks.pop().unwrap_or(weights),
            }
        }
    }

    /// From the tips, the target among them, to the base.
    fn adjoint_sweep(&mut self, at: &Vector3<f64>, sought: Sought) {
        let Self {
            steps,
            target,
            loads,
            columns,
            moves,
            influence,
            image,
            derivatives,
            stride,
            ..
        } = self;
        image.fill(0.0);
        let (mut wrench, mut branches) = (Virtual::default(), Vec::new());
        for (index, step) in steps.iter().enumerate().rev() {
            if index + 1 == *target {
                wrench.add(at, &Frame::identity().axes);
            }
            match step {
                Step::Load(load) => wrench.add(&loads[*load].at, &loads[*load].virtually),
                Step::Section(section) => section.act(influence, &mut wrench),
                Step::Branch => branches.push(std::mem::take(&mut wrench)),
                Step::Fork { further } => {
                    for branch in (0..*further).filter_map(|_| branches.pop()) {
                        for i in 0..3 {
                            wrench.force[i] += branch.force[i];
                            wrench.moment[i] += branch.moment[i];
                        }
                    }
                }
                Step::Segment(segment) => {
                    let own = &loads[segment.loads.clone()];
                    let work = |lane: usize| {
                        let column = &columns[segment.column(lane)];
                        let mut work = wrench.on(column);
                        if column.pull != 0.0 {
                            // A spring adds to the moment of the joint's own section.
                            let own = 3 * segment.unknowns.start;
                            work += Vector3::from_fn(|i, _| influence[own + i] * column.pull);
                        }
                        for (load, moved) in own.iter().zip(&moves[segment.moves(lane)]) {
                            work += Vector3::from_fn(|i, _| load.virtually[i].dot(moved));
                        }
                        work
                    };
                    match sought {
                        Sought::Influence => {
                            for (lane, unknown) in
                                (segment.moment_lane..).zip(segment.unknowns.clone())
                            {
                                // What tilts does so in two halves.
                                image[3 * unknown..][..3]
                                    .iter_mut()
                                    .zip(&work(lane))
                                    .for_each(|(a, w)| *a += w);
                            }
                        }
                        Sought::Parameters => {
                            for lane in segment.parameter_lane..segment.lanes {
                                derivatives[segment.index * *stride + lane] += work(lane);
                            }
                        }
                    }
                    if segment.turns {
                        let turned = Matrix3::from_columns(&[work(0), work(1), work(2)]);
                        for (i, about_root) in turned.row_iter().enumerate() {
                            wrench.force[i] +=
                                own.iter().map(|load| load.virtually[i]).sum::<Vector3<f64>>();
                            wrench.moment[i] = segment.root.vector(&about_root.transpose())
                                + segment.root.origin.cross(&wrench.force[i]);
                        }
                    }
                }
            }
        }
    }
}

/// What an adjoint sweep is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sought {
    Influence,
    Parameters,
}

impl Section {
    /// Λ-weighted axes.
    fn weights(&self, influence: &[f64]) -> Each {
        let mut weights = [Vector3::zeros(); 3];
        for (axis, influence) in self
            .axes
            .iter()
            .zip(influence[3 * self.unknowns.start..3 * self.unknowns.end].chunks_exact(3))
        {
            for i in 0..3 {
                weights[i] += axis * influence[i];
            }
        }
        weights
    }

    /// The section's moment is a·(M − r × F): its own place r and axes a, where they turn with the
    /// arm, move.
    fn act(&self, influence: &[f64], wrench: &mut Virtual) {
        let weights = self.weights(influence);
        if self.felt == Felt::OnTheArm {
            for (moment, weight) in wrench.moment.iter_mut().zip(&weights) {
                *moment += weight.cross(&self.moment);
            }
        }
        wrench.add(&self.at, &weights.map(|weight| weight.cross(&self.force)));
    }
}
