//! Adjoint sweep: derivatives of the position at equilibrium, by virtual work.
//!
//! Λ is the influence of the moments' equations (see [`super::statics`]). Each coordinate of p +
//! Λ·(G − x) changes with the place of every load, section and segment. The sweep runs from the
//! target to the base and keeps, for each of the three coordinates, the wrench whose virtual work
//! equals that change. A load f at r adds the force f × W, where W is the sum of the Λ-weighted
//! axes of all sections between base and load. A section adds the change of its moment with its
//! place and axes. The derivative of a segment is the work of the wrench on the segment's twist;
//! the spring of a joint adds the change of its moment. For the moments themselves this derivative
//! is Λ again. Λ is therefore a fixed point of the sweep, reached by the same contraction as the
//! equilibrium.
//!
//! Where branches meet, their wrenches add up. A branch without the target carries the virtual
//! forces of its loads alone: its masses bend the trunk and so move the target of another branch.

use nalgebra::{Matrix3, Vector3};

use super::linearised_arm::{
    EndTwist, LinearisedArm, Load, MomentAxes, MomentSection, PerCoordinate, Step,
};
use super::statics::{
    MAX_ACCEPTED_CHANGE, MAX_EQUILIBRIUM_PASSES, MAX_RELATIVE_CHANGE, StaticsError,
};
use crate::spatial::Frame;

/// Wrenches about the origin of the arm's base frame, one for each coordinate of the target's
/// position. Their virtual work on a motion is the change of that coordinate.
#[derive(Debug, Clone, Copy, Default)]
struct VirtualWrench {
    force: PerCoordinate,
    moment: PerCoordinate,
}

impl VirtualWrench {
    fn add_force(&mut self, at: &Vector3<f64>, force: &PerCoordinate) {
        for (i, force) in force.iter().enumerate() {
            self.moment[i] += at.cross(force);
            self.force[i] += force;
        }
    }

    /// Returns the virtual work of the three wrenches on the motion of a segment's end: the change
    /// of the target's position per unit of the parameter.
    fn work_on(&self, column: &EndTwist) -> Vector3<f64> {
        let each = |i: usize| {
            self.moment[i].dot(&column.rotation) + self.force[i].dot(&column.translation)
        };
        Vector3::new(each(0), each(1), each(2))
    }
}

impl LinearisedArm {
    /// Finds Λ, then the derivatives of the target's position `at` \[m\] with respect to all
    /// parameters.
    pub(super) fn differentiate(&mut self, at: &Vector3<f64>) -> Result<(), StaticsError> {
        self.find_influence(at)?;
        self.update_virtual_forces();
        self.adjoint_sweep(at, SweepResult::Parameters);
        Ok(())
    }

    /// Repeats the adjoint sweep until Λ is its fixed point.
    fn find_influence(&mut self, at: &Vector3<f64>) -> Result<(), StaticsError> {
        self.anderson.restart();
        let mut is_accepted = false;
        for _ in 0..MAX_EQUILIBRIUM_PASSES {
            self.update_virtual_forces();
            self.adjoint_sweep(at, SweepResult::Influence);
            let Self { influence, image, anderson, .. } = self;
            let largest = image.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let change =
                influence.iter().zip(&*image).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            if change <= MAX_RELATIVE_CHANGE * largest {
                return Ok(());
            }
            is_accepted =
                change <= MAX_ACCEPTED_CHANGE * largest && image.iter().all(|x| x.is_finite());
            anderson.advance(influence, image);
        }
        if is_accepted { Ok(()) } else { Err(StaticsError::NotSettled) }
    }

    /// Sets the virtual force f × W of each load f, with W the sum of the Λ-weighted axes of all
    /// sections between base and load.
    fn update_virtual_forces(&mut self) {
        let Self { steps, loads, influence, .. } = self;
        let mut weights = [Vector3::zeros(); 3];
        let mut forks = Vec::new();
        let weigh = |load: &mut Load, weights: &PerCoordinate| {
            load.virtual_force = weights.each_ref().map(|w| load.force.cross(w));
        };
        for step in steps {
            match step {
                Step::Load(load) => weigh(&mut loads[*load], &weights),
                Step::Segment(segment) => {
                    loads[segment.loads.clone()].iter_mut().for_each(|load| weigh(load, &weights));
                }
                Step::MomentSection(section) => {
                    let section_weights = section.weighted_axes(influence);
                    (0..3).for_each(|i| weights[i] += section_weights[i]);
                }
                Step::Fork { branches } => forks.extend((0..*branches).map(|_| weights)),
                Step::Branch => weights = forks.pop().unwrap_or(weights),
            }
        }
    }

    /// Sweeps from all tips to the base and writes `result`: the image of Λ under the sweep, or the
    /// derivatives of the target's position at `at` \[m\] with respect to all parameters.
    fn adjoint_sweep(&mut self, at: &Vector3<f64>, result: SweepResult) {
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
        let (mut wrench, mut ends) = (VirtualWrench::default(), Vec::new());
        for (index, step) in steps.iter().enumerate().rev() {
            if index + 1 == *target {
                wrench.add_force(at, &Frame::identity().axes);
            }
            match step {
                Step::Load(load) => wrench.add_force(&loads[*load].at, &loads[*load].virtual_force),
                Step::MomentSection(section) => section.add_moment_change(influence, &mut wrench),
                Step::Branch => ends.push(std::mem::take(&mut wrench)),
                Step::Fork { branches } => {
                    for branch in (0..*branches).filter_map(|_| ends.pop()) {
                        for i in 0..3 {
                            wrench.force[i] += branch.force[i];
                            wrench.moment[i] += branch.moment[i];
                        }
                    }
                }
                Step::Segment(segment) => {
                    let segment_loads = &loads[segment.loads.clone()];
                    let work = |direction: usize| {
                        let column = &columns[segment.column_index(direction)];
                        let mut work = wrench.work_on(column);
                        if column.spring_moment != 0.0 {
                            // A spring adds to the moment of its joint's section.
                            let first = 3 * segment.unknowns.start;
                            work += Vector3::from_fn(|i, _| {
                                influence[first + i] * column.spring_moment
                            });
                        }
                        for (load, moved) in
                            segment_loads.iter().zip(&moves[segment.move_range(direction)])
                        {
                            work += Vector3::from_fn(|i, _| load.virtual_force[i].dot(moved));
                        }
                        work
                    };
                    match result {
                        SweepResult::Influence => {
                            for (direction, unknown) in
                                (segment.moment_direction..).zip(segment.unknowns.clone())
                            {
                                // A part that tilts has two halves, which both contribute.
                                image[3 * unknown..][..3]
                                    .iter_mut()
                                    .zip(&work(direction))
                                    .for_each(|(a, w)| *a += w);
                            }
                        }
                        SweepResult::Parameters => {
                            for direction in segment.parameter_direction..segment.directions {
                                derivatives[segment.index * *stride + direction] += work(direction);
                            }
                        }
                    }
                    if segment.rotates {
                        let turned = Matrix3::from_columns(&[work(0), work(1), work(2)]);
                        for (i, about_root) in turned.row_iter().enumerate() {
                            wrench.force[i] += segment_loads
                                .iter()
                                .map(|load| load.virtual_force[i])
                                .sum::<Vector3<f64>>();
                            wrench.moment[i] = segment.root.vector(&about_root.transpose())
                                + segment.root.origin.cross(&wrench.force[i]);
                        }
                    }
                }
            }
        }
    }
}

/// Result that an adjoint sweep writes: the image of the adjoint variables Λ, or the derivatives of
/// the position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SweepResult {
    Influence,
    Parameters,
}

impl MomentSection {
    /// Returns Σ Λₖ aₖ over the axes aₖ of the section's moments, for each coordinate of the
    /// target.
    fn weighted_axes(&self, influence: &[f64]) -> PerCoordinate {
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

    /// Adds to `wrench` the change of the section's moment a·(M − r × F) with its place r, and with
    /// its axes a if they move with the arm.
    fn add_moment_change(&self, influence: &[f64], wrench: &mut VirtualWrench) {
        let weights = self.weighted_axes(influence);
        if self.moment_axes == MomentAxes::Moving {
            for (moment, weight) in wrench.moment.iter_mut().zip(&weights) {
                *moment += weight.cross(&self.moment);
            }
        }
        wrench.add_force(&self.at, &weights.map(|weight| weight.cross(&self.force)));
    }
}
