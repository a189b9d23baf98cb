//! An arm as the rig sees it: rigid pieces joined by lumped springs, and the loads that they carry.

use nalgebra::{Rotation2, Vector2, Vector3};

use crate::spatial::Frame;

/// A lumped spring between two rigid pieces: it turns and stretches, and may do so without load.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Hinge {
    /// Angle per moment about each axis [rad/(N·m)].
    pub compliance: Vector3<f64>,
    /// Angle about x per moment about y, and about y per moment about x; then the same with z
    /// [rad/(N·m)].
    pub coupling: Vector2<f64>,
    /// Angle about z per cube of the moment [rad/(N·m)³].
    pub cubic: f64,
    /// Play about z that the moment takes up: b \[rad\].
    pub play: f64,
    /// Elongation along x per force [m/N].
    pub stretch: f64,
    /// Rotation vector without load \[rad\].
    pub free_rotation: Vector3<f64>,
    /// Displacement along x without load \[m\].
    pub free_stretch: f64,
}

/// Moment at which play is taken up to three quarters [N·m].
const PLAY_MOMENT: f64 = 1.0;

impl Hinge {
    pub fn is_rigid(&self) -> bool {
        *self == Self::default()
    }

    /// What the hinge does under a force \[N\] and a moment [N·m] in its own axes.
    pub fn give(&self, force: &Vector3<f64>, moment: &Vector3<f64>) -> Motion {
        let mut rotation = self.free_rotation + self.compliance.component_mul(moment);
        rotation += Vector3::new(
            self.coupling.x * moment.y + self.coupling.y * moment.z,
            self.coupling.x * moment.x,
            self.coupling.y * moment.x,
        );
        rotation.z +=
            self.cubic * moment.z.powi(3) + 0.5 * self.play * (moment.z / PLAY_MOMENT).tanh();
        Motion { rotation, stretch: self.free_stretch + self.stretch * force.x }
    }
}

/// How far a hinge has moved.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Motion {
    /// Rotation vector \[rad\].
    pub rotation: Vector3<f64>,
    /// Displacement along x \[m\].
    pub stretch: f64,
}

/// A spring across a hinge, which pulls a point of the piece behind it towards one of the piece
/// before it; x and y of the hinge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spring {
    /// Index of the piece behind the hinge.
    pub piece: usize,
    /// The point before the hinge \[m\].
    pub anchor: Vector2<f64>,
    /// The point behind it, where the hinge has not turned \[m\].
    pub end: Vector2<f64>,
    /// Length at which the preload alone pulls \[m\].
    pub free_length: f64,
    /// Tension per length [N/m].
    pub rate: f64,
    /// Tension at the free length \[N\].
    pub preload: f64,
}

impl Spring {
    /// Moment about z on the piece behind the hinge, which has turned by an angle \[rad\] [N·m].
    pub fn moment(&self, turned: f64) -> f64 {
        let end = Rotation2::new(turned) * self.end;
        let way = self.anchor - end;
        let tension = self.preload + self.rate * (way.norm() - self.free_length);
        way.try_normalize(0.0).map_or(0.0, |direction| end.perp(&(direction * tension)))
    }
}

/// A rigid piece behind a hinge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub hinge: Hinge,
    /// Where the hinge sits.
    pub root: Place,
}

/// A frame on a piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Index of the piece, an earlier one than any that sits there; `None`: the base.
    pub piece: Option<usize>,
    /// Seen from the piece's own hinge, or from the base.
    pub frame: Frame<f64>,
}

/// A force on a rigid piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct Load {
    /// Index of the piece.
    pub piece: usize,
    /// Where it acts, seen from the piece's hinge \[m\].
    pub at: Vector3<f64>,
    pub force: Force,
}

/// What pulls.
#[derive(Debug, Clone, Copy)]
pub(super) enum Force {
    /// The same wherever the piece is, base frame \[N\].
    Constant(Vector3<f64>),
    /// A rope whose direction may depend on where its hook is.
    Rope {
        /// Tension \[N\].
        tension: f64,
        /// Direction with the hook at the origin, base frame.
        direction: Vector3<f64>,
        /// How the x and y of the direction change with those of the hook [1/m].
        trolley: f64,
    },
}

impl Force {
    /// The force \[N\] at a point \[m\], base frame.
    pub fn at(&self, point: &Vector3<f64>) -> Vector3<f64> {
        match *self {
            Self::Constant(force) => force,
            Self::Rope { tension, direction, trolley } => {
                let lean = Vector2::new(point.x, point.y) * trolley;
                (direction + Vector3::new(lean.x, lean.y, 0.0)).normalize() * tension
            }
        }
    }
}

/// Pieces from the base outwards, several perhaps on one; their loads in any order.
#[derive(Debug)]
pub(super) struct Chain {
    pub pieces: Vec<Piece>,
    pub loads: Vec<Load>,
    pub springs: Vec<Spring>,
    /// Index of the piece at which it goes on, and where that ends so far, seen from its hinge.
    last: usize,
    end: Frame<f64>,
}

impl Chain {
    /// A single piece of no length, clamped to the base by `hinge`.
    pub fn new(hinge: Hinge) -> Self {
        let root = Place { piece: None, frame: Frame::identity() };
        let pieces = vec![Piece { hinge, root }];
        Self { pieces, loads: Vec::new(), springs: Vec::new(), last: 0, end: Frame::identity() }
    }

    /// Where the chain ends so far, seen from its last hinge.
    pub fn end(&mut self) -> &mut Frame<f64> {
        &mut self.end
    }

    /// The same as a place to come back to.
    pub fn place(&self) -> Place {
        Place { piece: Some(self.last), frame: self.end }
    }

    /// Goes on from a place where it has been.
    pub fn go_on_from(&mut self, place: &Place) {
        (self.last, self.end) = (place.piece.unwrap_or(0), place.frame);
    }

    /// Goes on behind a hinge; a rigid one is none.
    pub fn hinge(&mut self, hinge: Hinge) {
        if !hinge.is_rigid() {
            self.pieces.push(Piece { hinge, root: self.place() });
            (self.last, self.end) = (self.pieces.len() - 1, Frame::identity());
        }
    }

    /// Puts springs across the hinge behind which the chain has just gone on.
    pub fn spring(&mut self, springs: impl Iterator<Item = Spring>) {
        let piece = self.last;
        self.springs.extend(springs.map(|spring| Spring { piece, ..spring }));
    }

    /// Hangs a load at a point \[m\] seen from where the chain ends so far.
    pub fn load(&mut self, point: &Vector3<f64>, force: Force) {
        self.loads.push(Load { piece: self.last, at: self.end.point(point), force });
    }
}
