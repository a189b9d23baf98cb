//! Beam element on the deflected arm.

use nalgebra::Vector3;

use super::imperfection::Strain;
use super::{Cantilever, Deflection, Flexibility, Wrench};
use crate::scalar::Scalar;
use crate::spatial::{Frame, rotate};

/// Force on a beam at a point, such as the weight of a point mass or the pull of a rope.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinkLoad<S> {
    /// Index of the element that carries the load.
    pub element: usize,
    /// Position of the load in the frame of its beam \[m\].
    pub at: Vector3<S>,
    /// Force of the load, arm base frame \[N\].
    pub force: Vector3<S>,
    /// True for the force of a hoist's rope, which may depend on the position.
    pub rope: bool,
}

/// Element of a beam with all its loads; forces in the arm base frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Element<'a, S> {
    /// Index of the element along the beam, from 0.
    pub number: usize,
    /// Signed length of the element \[m\].
    pub length: S,
    /// Start of the element along the beam \[m\].
    pub start: S,
    pub flexibility: Flexibility<S>,
    /// Strain of the beam without load.
    pub strain: Option<Strain<S>>,
    /// Weight of the element, arm base frame \[N\].
    pub weight: Vector3<S>,
    /// Loads of the whole beam.
    pub loads: &'a [LinkLoad<S>],
    /// Resultant of all loads beyond the element's tip: force \[N\], and moment about the tip
    /// [N·m], arm base frame.
    pub tip: Wrench<S>,
}

/// Element deflected by its loads.
///
/// Deflections are relative to the chord from root to tip, and forces are resolved along it. The
/// effects that the closed form neglects (the axial force's lever on the bent axis, the shortening
/// of a bent axis) are then of higher order. The chord's frame has half the twist of the tip, as
/// the section in the middle has. Rotations and bending planes then err equally on both sides, and
/// the error of n elements falls with n².
pub(super) struct BentElement<'a, S> {
    element: &'a Element<'a, S>,
    cantilever: Cantilever<'a, S>,
    /// Deflection of the element at its tip relative to its root.
    tip: Deflection<S>,
    /// Frame at the root, x along the chord, rotated about it by half the twist.
    chord: Frame<S>,
    /// Rotation vector from the undeflected section at the root to the chord's frame \[rad\], root
    /// frame.
    lean: Vector3<S>,
}

impl<S: Scalar> Element<'_, S> {
    /// Returns the loads that act on this element, of those of the whole beam.
    pub fn loads_on_element(&self) -> impl Iterator<Item = &LinkLoad<S>> {
        self.loads.iter().filter(|load| load.element == self.number)
    }

    /// Returns the element as a clamped beam with its loads resolved along `axes`; `points` is
    /// reused memory.
    fn cantilever<'p>(
        &self,
        axes: &Frame<S>,
        points: &'p mut Vec<(S, Wrench<S>)>,
    ) -> Cantilever<'p, S> {
        points.clear();
        for load in self.loads_on_element() {
            let (station, offset) = self.station_and_offset(load);
            let force = axes.resolve(&load.force);
            points.push((station, Wrench { force, moment: offset.cross(&force) }));
        }
        let tip =
            Wrench { force: axes.resolve(&self.tip.force), moment: axes.resolve(&self.tip.moment) };
        points.push((self.length, tip));
        Cantilever {
            length: self.length,
            flexibility: self.flexibility,
            spread: axes.resolve(&self.weight) / self.length,
            strain: self.strain,
            points,
        }
    }

    /// Returns the station of a load, measured along the element from its root \[m\], and the rigid
    /// offset from that station to the load \[m\].
    fn station_and_offset(&self, load: &LinkLoad<S>) -> (S, Vector3<S>) {
        let x = load.at.x - self.start;
        let part = x.re() / self.length.re();
        let station = if part < 0.0 {
            S::from(0.0)
        } else if part > 1.0 {
            self.length
        } else {
            x
        };
        (station, Vector3::new(x - station, load.at.y, load.at.z))
    }

    /// Returns the tip frame to first order [Chen2021, eq. 20-22 as corrected], with loads resolved
    /// in the frame `rigid` of the undeflected arm.
    pub fn first_order_tip(
        &self,
        root: Frame<S>,
        rigid: &Frame<S>,
        points: &mut Vec<(S, Wrench<S>)>,
    ) -> Frame<S> {
        let Deflection { displacement, rotation } = self.cantilever(rigid, points).tip();
        let mut tip = root;
        tip.translate_x(self.length);
        tip.translate(&displacement);
        tip.rotate(&rotation);
        tip
    }

    /// Deflects the element, clamped at the frame `root`, by its loads; `points` is reused memory.
    pub fn bend<'p>(
        &'p self,
        root: &Frame<S>,
        points: &'p mut Vec<(S, Wrench<S>)>,
    ) -> BentElement<'p, S> {
        let lean_of = |tip: &Deflection<S>| {
            let slope = tip.displacement / self.length;
            Vector3::new(tip.rotation.x * 0.5, -slope.z, slope.y)
        };
        let leaning = |lean: &Vector3<S>| {
            let mut chord = *root;
            chord.rotate(lean);
            chord
        };
        let along_root = lean_of(&self.cantilever(root, points).tip());
        let cantilever = self.cantilever(&leaning(&along_root), points);
        let tip = cantilever.tip();
        let lean = lean_of(&tip);
        BentElement { element: self, cantilever, tip, chord: leaning(&lean), lean }
    }

    /// Returns the position of a load on the straight element, arm base frame \[m\].
    pub fn straight_point(&self, root: &Frame<S>, load: &LinkLoad<S>) -> Vector3<S> {
        let (station, mut local) = self.station_and_offset(load);
        local.x += station;
        root.point(&local)
    }
}

impl<S: Scalar> BentElement<'_, S> {
    /// Returns the position of a load, arm base frame \[m\].
    pub fn load_position(&self, load: &LinkLoad<S>) -> Vector3<S> {
        let (station, offset) = self.element.station_and_offset(load);
        let Deflection { displacement, rotation } = self.cantilever.at(station);
        let along = Vector3::new(station, S::from(0.0), S::from(0.0));
        let axis = along + displacement - self.lean.cross(&along);
        self.chord.point(&(axis + rotate(&(rotation - self.lean), &offset)))
    }

    /// Returns the centre of mass of the element, arm base frame \[m\].
    pub fn centre_of_mass(&self) -> Vector3<S> {
        let along = Vector3::new(self.element.length * 0.5, S::from(0.0), S::from(0.0));
        self.chord.point(&(along + self.cantilever.mean_displacement() - self.lean.cross(&along)))
    }

    /// Returns the frame at the tip, arm base frame.
    pub fn tip(&self) -> Frame<S> {
        let mut tip = self.chord;
        tip.translate_x(self.element.length + self.tip.displacement.x);
        tip.rotate(&(self.tip.rotation - self.lean));
        tip
    }
}
