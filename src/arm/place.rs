//! One walk from the base to the tip: frames, loads, and the sections whose moments bend something.

use nalgebra::Vector3;

use super::Wrench;
use super::element::{Element, LinkLoad};
use super::link::{Arm, Beam, Setup};
use crate::scalar::Scalar;
use crate::spatial::Frame;

/// What the walk passes, in order from the base outwards.
#[derive(Debug, Clone, Copy)]
pub(super) enum Event<S> {
    /// A force [N] at a point [m].
    Load { at: Vector3<S>, force: Vector3<S> },
    /// The tip of a beam element: its three moments are unknowns.
    Tip { at: Vector3<S> },
    /// A flexible joint: the moment about its axis is an unknown.
    Axis { at: Vector3<S>, axis: Vector3<S> },
}

/// How the walk bends the arm.
#[derive(Debug, Clone, Copy)]
pub(super) enum Bend<'a, S> {
    /// Not at all; records events.
    Rigid,
    /// By these moments, on the bent arm; records events.
    Bent(&'a [S]),
    /// By these moments, with forces resolved in the frames of the last rigid walk; records nothing.
    FirstOrder(&'a [S]),
}

/// Memory for walks, reused from pose to pose.
#[derive(Debug, Clone)]
pub struct Workspace<S> {
    pub(super) events: Vec<Event<S>>,
    pub(super) moments: Vec<S>,
    pub(super) next_moments: Vec<S>,
    /// Force of everything beyond each joint's link [N].
    beyond: Vec<Vector3<S>>,
    /// Frame at each link's root in the last rigid walk.
    rigid_roots: Vec<Frame<S>>,
    link_loads: Vec<LinkLoad<S>>,
    points: Vec<(S, Wrench<S>)>,
}

impl<S> Default for Workspace<S> {
    fn default() -> Self {
        Self {
            events: Vec::new(),
            moments: Vec::new(),
            next_moments: Vec::new(),
            beyond: Vec::new(),
            rigid_roots: Vec::new(),
            link_loads: Vec::new(),
            points: Vec::new(),
        }
    }
}

/// Where a walk has got to.
struct Walk<'a, S> {
    setup: &'a Setup<'a>,
    bend: Bend<'a, S>,
    frame: Frame<S>,
    /// Index of the next unknown moment.
    next: usize,
}

impl<S: Scalar> Walk<'_, S> {
    /// The next N unknown moments; `None` on the rigid arm.
    fn moments<const N: usize>(&mut self) -> Option<[S; N]> {
        let first = self.next;
        self.next += N;
        match self.bend {
            Bend::Rigid => None,
            Bend::Bent(moments) | Bend::FirstOrder(moments) => Some(std::array::from_fn(|k| moments[first + k])),
        }
    }

    fn records(&self) -> bool {
        !matches!(self.bend, Bend::FirstOrder(_))
    }
}

impl<S: Scalar> Arm<S> {
    /// Forces beyond each link; they do not depend on how the arm bends.
    pub(super) fn gather_forces(&self, setup: &Setup, ws: &mut Workspace<S>) {
        ws.beyond.clear();
        ws.beyond.resize(self.joints.len(), Vector3::from_element(S::from(0.0)));
        let mut mass = self.payload(setup);
        let mut hoisted = Vector3::zeros();
        for (joint, beyond) in self.joints.iter().zip(&mut ws.beyond).rev() {
            mass += joint.bodies.iter().map(|body| body.mass).sum::<f64>();
            *beyond = self.gravity * S::from(mass) + hoisted.map(S::from);
            if let Some(beam) = &joint.beam {
                mass += beam.mass + beam.masses.iter().map(|carried| carried.mass).sum::<f64>();
                if let Some(hoist) = &beam.hoist {
                    hoisted += hoist.direction * setup.hoist.unwrap_or(hoist.force);
                }
            }
        }
    }

    /// Walks to the last frame, arm base frame.
    pub(super) fn walk(&self, setup: &Setup, bend: Bend<S>, ws: &mut Workspace<S>) -> Frame<S> {
        let mut walk = Walk { setup, bend, frame: Frame::identity(), next: 0 };
        ws.events.clear();
        if matches!(bend, Bend::Rigid) {
            ws.rigid_roots.clear();
        }
        for (i, joint) in self.joints.iter().enumerate() {
            walk.frame.rotate_x(joint.alpha.sin_cos);
            if matches!(bend, Bend::Rigid) {
                ws.rigid_roots.push(walk.frame);
            }
            match &joint.beam {
                None => walk.frame.translate_x(joint.a),
                Some(beam) => self.walk_beam(beam, i, &mut walk, ws),
            }
            let mut twist = None;
            if let Some(flexibility) = joint.flexibility {
                if walk.records() {
                    ws.events.push(Event::Axis { at: walk.frame.origin, axis: walk.frame.axes[2] });
                }
                twist = walk.moments().map(|[moment]| flexibility * moment);
            }
            joint.turn(&mut walk.frame, setup.configuration[i], twist);
            if walk.records() {
                for body in &joint.bodies {
                    let force = self.gravity * S::from(body.mass);
                    ws.events.push(Event::Load { at: walk.frame.point(&body.at.map(S::from)), force });
                }
            }
        }
        let payload = self.payload(setup);
        if walk.records() && payload != 0.0 {
            let at = walk.frame.point(&self.payload_at.map(S::from));
            ws.events.push(Event::Load { at, force: self.gravity * S::from(payload) });
        }
        walk.frame
    }

    /// Walks along the beam of joint `link`, element by element.
    fn walk_beam(&self, beam: &Beam<S>, link: usize, walk: &mut Walk<S>, ws: &mut Workspace<S>) {
        let Workspace { events, beyond, rigid_roots, link_loads, points, .. } = ws;
        let elements = self.beam_elements;
        let length = self.joints[link].a / elements as f64;
        self.load_beam(beam, walk.setup, length, link_loads);
        let weight = self.gravity * S::from(beam.mass / elements as f64);
        for number in 0..elements {
            let further = link_loads.iter().filter(|load| load.element > number).map(|load| load.force);
            let further = weight * S::from((elements - 1 - number) as f64) + further.sum::<Vector3<S>>();
            let moment = walk.moments().map_or_else(|| Vector3::from_element(S::from(0.0)), Vector3::from);
            let element = Element {
                number,
                length,
                start: length * number as f64,
                flexibility: beam.flexibility,
                weight,
                loads: link_loads,
                tip: Wrench { force: beyond[link] + further, moment },
            };
            let root = walk.frame;
            match walk.bend {
                Bend::FirstOrder(_) => {
                    walk.frame = element.first_order_tip(root, &rigid_roots[link], points);
                }
                Bend::Rigid => {
                    let middle = root.origin + root.axes[0] * (length * 0.5);
                    events.push(Event::Load { at: middle, force: weight });
                    let at = |load| Event::Load { at: element.straight_point(&root, load), force: load.force };
                    events.extend(element.own_loads().map(at));
                    walk.frame.translate_x(length);
                    events.push(Event::Tip { at: walk.frame.origin });
                }
                Bend::Bent(_) => {
                    let bent = element.bend(&root, points);
                    events.push(Event::Load { at: bent.centre_of_mass(), force: weight });
                    let at = |load| Event::Load { at: bent.point(load), force: load.force };
                    events.extend(element.own_loads().map(at));
                    walk.frame = bent.tip();
                    events.push(Event::Tip { at: walk.frame.origin });
                }
            }
        }
    }

    /// Lists the loads of a beam with elements of `length` [m].
    fn load_beam(&self, beam: &Beam<S>, setup: &Setup, length: S, loads: &mut Vec<LinkLoad<S>>) {
        let last = (self.beam_elements - 1) as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rounded down and clamped")]
        let load =
            |at: Vector3<f64>, force| LinkLoad { element: (at.x / length.re()).clamp(0.0, last) as usize, at, force };
        loads.clear();
        loads.extend(beam.masses.iter().map(|carried| load(carried.at, self.gravity * S::from(carried.mass))));
        if let Some(hoist) = &beam.hoist {
            let force = hoist.direction * setup.hoist.unwrap_or(hoist.force);
            loads.push(load(hoist.at, force.map(S::from)));
        }
    }
}
