//! Forward pass from the base to the tips, branch by branch: frames, loads, and the sections whose
//! moments deflect the arm.

use nalgebra::Vector3;

use super::Wrench;
use super::arm::Arm;
use super::element::{Element, LinkLoad};
use super::joint::Coordinates;
use super::link::{Beam, Hoist, PointMass};
use super::motion::MOTION_STARTS;
use super::segment::{Cut, SLIDE_TILT_POSITIONS, Segment};
use super::workspace::{Event, Workspace};
use crate::problem::PoseView;
use crate::scalar::Scalar;
use crate::spatial::Frame;

/// Way in which a forward pass deflects the arm and what it records.
#[derive(Debug, Clone, Copy)]
pub(super) enum DeflectionMode<'a, S> {
    /// No deflection; records loads and sections as events.
    Rigid,
    /// Deflection by the given moments [N·m]; records loads and sections as events.
    Bent(&'a [S]),
    /// Deflection by the given moments [N·m], with each segment differentiated by itself.
    ///
    /// Each segment starts at a frame without derivatives, so that the derivatives of its end come
    /// from its parameters alone. With a rotation vector (of value zero), beam elements first
    /// rotate by it. The derivatives of their ends then include those by a rotation of their root.
    BySegment(&'a [S], Option<&'a Vector3<S>>),
    /// Deflection by the given moments [N·m], with forces resolved in the frames of the last
    /// undeflected pass; records no events.
    FirstOrder(&'a [S]),
}

/// State of a forward pass.
struct ForwardPass<'a, S> {
    setup: &'a PoseView<'a>,
    bend: DeflectionMode<'a, S>,
    frame: Frame<S>,
    /// Index of the next unknown moment.
    next: usize,
    /// Index of the joint whose frame is returned.
    tip: usize,
}

impl<S: Scalar> ForwardPass<'_, S> {
    /// Returns the next N of the given moments [N·m]; `None` in a pass without deflection.
    fn next_moments<const N: usize>(&mut self) -> Option<[S; N]> {
        let first = self.next;
        self.next += N;
        match self.bend {
            DeflectionMode::Rigid => None,
            DeflectionMode::Bent(moments)
            | DeflectionMode::BySegment(moments, _)
            | DeflectionMode::FirstOrder(moments) => {
                Some(std::array::from_fn(|k| moments[first + k]))
            }
        }
    }

    /// Ends a segment that the last `unknowns` moments deflect: records its end frame and continues
    /// from that frame without derivatives. Does nothing in other passes than
    /// [`DeflectionMode::BySegment`].
    fn record_cut(
        &mut self,
        segment: Segment,
        unknowns: usize,
        events: &mut Vec<Event<S>>,
        cuts: &mut Vec<Cut<S>>,
    ) {
        if let DeflectionMode::BySegment(..) = self.bend {
            cuts.push(Cut {
                frame: self.frame,
                segment,
                unknowns: (self.next - unknowns, unknowns),
            });
            events.push(Event::Cut);
            self.frame = self.frame.without_derivatives();
        }
    }

    /// Rotates the frame by the unknown moments times flexibilities [rad/(N·m)] about x and y. The
    /// moments act about the axes at half the rotation.
    fn apply_tilt(&mut self, [about_x, about_y]: &[S; 2], segment: Segment, ws: &mut Workspace<S>) {
        let half = self
            .next_moments()
            .map(|[x, y]| Vector3::new(*about_x * x, *about_y * y, S::from(0.0)) * S::from(0.5));
        if let Some(half) = &half {
            self.frame.rotate(half);
            self.record_cut(segment, 2, &mut ws.events, &mut ws.cuts);
        }
        if self.records_events() {
            let [x, y, _] = self.frame.axes;
            ws.events.push(Event::Tilt { at: self.frame.origin, axes: [x, y] });
        }
        if let Some(half) = &half {
            self.frame.rotate(half);
            self.record_cut(segment, 2, &mut ws.events, &mut ws.cuts);
        }
    }

    /// Moves along a slide of `length` L \[m\], negative along −z, with `flexibility` 1/EI
    /// [1/(N·m²)]: a weightless cantilever loaded at its end.
    ///
    /// δ = F L³/(3EI) + M L²/(2EI),  φ = F L²/(2EI) + M L/(EI). The moment is linear along the
    /// slide. Two tilts at the Gauss–Legendre points, each by the moment there times L/(2EI),
    /// integrate it exactly. Small slopes only.
    fn apply_slide(&mut self, flexibility: S, length: S, segment: Segment, ws: &mut Workspace<S>) {
        let half = flexibility * length * (0.5 * length.re().signum());
        let mut passed = 0.0;
        for at in SLIDE_TILT_POSITIONS {
            self.frame.translate_z(length * (at - passed));
            self.apply_tilt(&[half, half], segment, ws);
            passed = at;
        }
        self.frame.translate_z(length * (1.0 - passed));
    }

    /// Records a fork: a frame where `branches` more branches start besides the one that follows.
    fn record_fork(&self, branches: usize, ws: &mut Workspace<S>) {
        if branches > 0 {
            ws.forks.extend((0..branches).map(|_| self.frame));
            if self.records_events() {
                ws.events.push(Event::Fork { branches });
            }
        }
    }

    /// Returns to the last fork at which a branch is still to be passed.
    fn return_to_fork(&mut self, ws: &mut Workspace<S>) {
        self.frame = ws.forks.pop().unwrap_or(self.frame);
        if self.records_events() {
            ws.events.push(Event::Branch);
        }
    }

    fn records_events(&self) -> bool {
        !matches!(self.bend, DeflectionMode::FirstOrder(_))
    }
}

impl<S: Scalar> Arm<S> {
    /// Computes the forces of hoist ropes and the total force beyond each link. Only ropes that may
    /// lean depend on the deflection, through the hook positions in `state`.
    ///
    /// With an empty state, leaning ropes are taken as if their hooks were above the base.
    pub(super) fn gather_forces(&self, setup: &PoseView, state: &[S], ws: &mut Workspace<S>) {
        let zero = Vector3::from_element(S::from(0.0));
        let mut hooks = state.chunks_exact(2);
        ws.ropes.clear();
        ws.ropes.extend(self.joints.iter().map(|joint| {
            let Some(hoist) = joint.beam.as_ref().and_then(|beam| beam.hoist.as_ref()) else {
                return zero;
            };
            let hook = || hooks.next().map_or([S::from(0.0); 2], |hook| [hook[0], hook[1]]);
            self.rope_force(hoist, setup, hook)
        }));
        ws.outboard_forces.clear();
        ws.outboard_forces.resize(self.joints.len(), zero);
        ws.branch_sums.clear();
        let (mut mass, mut hoisted) = (S::from(0.0), zero);
        for (index, ((joint, beyond), rope)) in
            self.joints.iter().zip(&mut ws.outboard_forces).zip(&ws.ropes).enumerate().rev()
        {
            for (more, pull) in
                (0..self.tree.extra_branches_on(index)).filter_map(|_| ws.branch_sums.pop())
            {
                mass += more;
                hoisted += pull;
            }
            if index == self.payload_joint() {
                mass += self.payload(setup);
            }
            for (of_body, _) in joint.masses() {
                mass += of_body;
            }
            *beyond = self.gravity * mass + hoisted;
            if let Some(beam) = &joint.beam {
                mass += beam.mass + beam.masses.iter().map(|carried| carried.mass).sum::<f64>();
                if let Some(added) = &beam.added {
                    mass += added.mass;
                }
                hoisted += rope;
            }
            if self.tree.begins_branch(index) {
                ws.branch_sums.push((mass, hoisted));
                (mass, hoisted) = (S::from(0.0), zero);
            }
        }
    }

    /// Returns the index of the joint whose frame carries the payload.
    fn payload_joint(&self) -> usize {
        self.payload_on.unwrap_or_else(|| self.last())
    }

    /// Returns the force of a rope \[N\], arm base frame; `hook` gives the hook's x and y \[m\] and
    /// is evaluated only if the rope may lean.
    fn rope_force(
        &self,
        hoist: &Hoist,
        setup: &PoseView,
        hook: impl FnOnce() -> [S; 2],
    ) -> Vector3<S> {
        let tension = setup.hoist.copied().unwrap_or(hoist.force);
        match &self.rope {
            None => (hoist.direction * tension).map(S::from),
            Some(rope) => rope.pull(&hoist.direction, tension, hook()),
        }
    }

    /// Returns the number of unknowns that are coordinates of hooks: two for each rope that may
    /// lean.
    fn hook_unknown_count(&self) -> usize {
        let hoists = || self.joints.iter().filter_map(|joint| joint.beam.as_ref()?.hoist.as_ref());
        self.rope.as_ref().map_or(0, |_| 2 * hoists().count())
    }

    /// Passes through all branches; returns the frame of the joint `tip`, arm base frame.
    pub(super) fn walk(
        &self,
        setup: &PoseView,
        bend: DeflectionMode<S>,
        tip: usize,
        ws: &mut Workspace<S>,
    ) -> Frame<S> {
        let mut pass = ForwardPass {
            setup,
            bend,
            frame: Frame::identity(),
            next: self.hook_unknown_count(),
            tip,
        };
        let mut found = pass.frame;
        ws.forks.clear();
        ws.events_before_tip = 0;
        ws.events.clear();
        ws.hooks.clear();
        ws.cuts.clear();
        ws.trail.clear();
        if matches!(bend, DeflectionMode::Rigid) {
            ws.rigid_roots.clear();
        }
        if let Some(mounting) = &self.mounting {
            pass.apply_tilt(mounting, Segment::Mounting, ws);
        }
        ws.frames.clear();
        ws.keep_frame(&pass.frame);
        pass.record_fork(self.tree.extra_branches_at_base(), ws);
        for (i, joint) in self.joints.iter().enumerate() {
            if self.tree.begins_branch(i) {
                pass.return_to_fork(ws);
            }
            joint.advance_to_link(&mut pass.frame);
            if matches!(bend, DeflectionMode::Rigid) {
                ws.rigid_roots.push(pass.frame);
            }
            if joint.beam.is_none() {
                pass.frame.translate_x(joint.a);
            }
            pass.record_cut(Segment::Joint(i), 0, &mut ws.events, &mut ws.cuts);
            if let Some(beam) = &joint.beam {
                self.walk_beam(beam, i, &mut pass, ws);
            } else if self.tree.path_contains(i, tip) {
                ws.trail.push(pass.frame.origin);
            }
            if let Some(lateral) = &joint.lateral {
                pass.apply_tilt(lateral, Segment::Joint(i), ws);
            }
            let motion = setup.motion(i);
            joint.displace(&mut pass.frame, motion, MOTION_STARTS[0]);
            if joint.motion.is_some() {
                // The motion before the joint also moves its axis, so the axis belongs to the next
                // segment.
                pass.record_cut(Segment::Joint(i), 0, &mut ws.events, &mut ws.cuts);
            }
            let (mut twist, mut play_offset) = (None, None);
            if joint.has_twist() {
                let approach = setup.approach.map(|approach| approach[i]);
                twist = pass.next_moments().map(|[moment]| joint.twist(moment, approach));
                play_offset = joint.play_offset(approach);
            }
            let Coordinates { angle, offset } =
                joint.coordinates_with(setup.configuration[i], play_offset, twist);
            if joint.has_twist() && pass.records_events() {
                let pull = joint.compensator.as_ref().map(|spring| spring.moment(angle));
                ws.events.push(Event::Axis {
                    at: pass.frame.origin,
                    axis: pass.frame.axes[2],
                    pull,
                });
            }
            pass.frame.rotate_z(angle);
            let mut deflecting_moments = usize::from(joint.has_twist());
            if let Some(flexibility) = joint.slide {
                pass.record_cut(
                    Segment::Joint(i),
                    deflecting_moments,
                    &mut ws.events,
                    &mut ws.cuts,
                );
                pass.apply_slide(flexibility, offset, Segment::Joint(i), ws);
                deflecting_moments = 0;
            } else {
                pass.frame.translate_z(offset);
            }
            pass.frame.rotate_y(joint.beta.sin_cos);
            joint.displace(&mut pass.frame, motion, MOTION_STARTS[1]);
            if self.tree.path_contains(i, tip) {
                ws.trail.push(pass.frame.origin);
            }
            ws.keep_frame(&pass.frame);
            pass.record_cut(Segment::Joint(i), deflecting_moments, &mut ws.events, &mut ws.cuts);
            if pass.records_events() {
                for (mass, at) in joint.masses() {
                    let at = pass.frame.point(&at.map(S::from));
                    ws.events.push(Event::Load { at, force: self.gravity * mass });
                }
            }
            if i == self.payload_joint() {
                let payload = self.payload(setup);
                if pass.records_events() && payload.re() != 0.0 {
                    let at = pass.frame.point(&self.payload_at);
                    ws.events.push(Event::Load { at, force: self.gravity * payload });
                }
            }
            if i == tip {
                found = pass.frame;
                ws.events_before_tip = ws.events.len();
            }
            pass.record_fork(self.tree.extra_branches_on(i), ws);
        }
        found
    }

    /// Passes along the beam of the joint with index `link`, element by element.
    fn walk_beam(
        &self,
        beam: &Beam<S>,
        link: usize,
        pass: &mut ForwardPass<S>,
        ws: &mut Workspace<S>,
    ) {
        let Workspace {
            events,
            hooks,
            cuts,
            ropes,
            outboard_forces: beyond,
            rigid_roots,
            trail,
            link_loads,
            points,
            ..
        } = ws;
        let elements = self.beam_elements;
        let length = self.joints[link].a / elements as f64;
        self.list_beam_loads(beam, ropes[link], length, link_loads);
        let of_pose = pass.setup.offsets.and_then(|all| Some(all.get(link)?.strain));
        let strain = beam.strain.as_ref().map(|strain| strain.plus(of_pose.unwrap_or_default()));
        let weight = self.gravity * S::from(beam.mass / elements as f64);
        for number in 0..elements {
            let outboard =
                link_loads.iter().filter(|load| load.element > number).map(|load| load.force);
            let outboard =
                weight * S::from((elements - 1 - number) as f64) + outboard.sum::<Vector3<S>>();
            let moment = pass
                .next_moments()
                .map_or_else(|| Vector3::from_element(S::from(0.0)), Vector3::from);
            let element = Element {
                number,
                length,
                start: length * number as f64,
                flexibility: beam.flexibility,
                strain,
                weight,
                loads: link_loads,
                tip: Wrench { force: beyond[link] + outboard, moment },
            };
            let mut root = pass.frame;
            if let DeflectionMode::BySegment(_, Some(rotation)) = pass.bend {
                root.rotate(rotation);
            }
            match pass.bend {
                DeflectionMode::FirstOrder(_) => {
                    pass.frame = element.first_order_tip(root, &rigid_roots[link], points);
                }
                DeflectionMode::Rigid => {
                    let middle = root.origin + root.axes[0] * (length * 0.5);
                    events.push(Event::Load { at: middle, force: weight });
                    for load in element.loads_on_element() {
                        let (at, mut force) = (element.straight_point(&root, load), load.force);
                        if let (true, Some(hoist), Some(_)) = (load.rope, &beam.hoist, &self.rope) {
                            hooks.push([at.x, at.y]);
                            force = self.rope_force(hoist, pass.setup, || [at.x, at.y]);
                        }
                        events.push(Event::Load { at, force });
                    }
                    pass.frame.translate_x(length);
                    events.push(Event::Tip { at: pass.frame.origin });
                }
                DeflectionMode::Bent(_) | DeflectionMode::BySegment(..) => {
                    let bent = element.bend(&root, points);
                    events.push(Event::Load { at: bent.centre_of_mass(), force: weight });
                    for load in element.loads_on_element() {
                        let at = bent.load_position(load);
                        if load.rope && self.rope.is_some() {
                            hooks.push([at.x, at.y]);
                        }
                        events.push(Event::Load { at, force: load.force });
                    }
                    pass.frame = bent.tip();
                    pass.record_cut(Segment::Beam(link), 3, events, cuts);
                    events.push(Event::Tip { at: pass.frame.origin });
                }
            }
            if self.tree.path_contains(link, pass.tip) {
                trail.push(pass.frame.origin);
            }
        }
    }

    /// Writes the loads of a beam with elements of `length` \[m\] into `loads`; `rope` is the force
    /// of its rope \[N\].
    fn list_beam_loads(
        &self,
        beam: &Beam<S>,
        rope: Vector3<S>,
        length: S,
        loads: &mut Vec<LinkLoad<S>>,
    ) {
        let last = (self.beam_elements - 1) as f64;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "rounded down and clamped"
        )]
        let load = |at: Vector3<S>, force, rope| LinkLoad {
            element: (at.x.re() / length.re()).clamp(0.0, last) as usize,
            at,
            force,
            rope,
        };
        loads.clear();
        let carried = |carried: &PointMass| {
            load(carried.at.map(S::from), self.gravity * S::from(carried.mass), false)
        };
        loads.extend(beam.masses.iter().map(carried));
        if let Some(added) = &beam.added {
            let at = Vector3::new(added.at * length.re().signum(), S::from(0.0), S::from(0.0));
            loads.push(load(at, self.gravity * added.mass, false));
        }
        if let Some(hoist) = &beam.hoist {
            loads.push(load(hoist.at.map(S::from), rope, true));
        }
    }
}
