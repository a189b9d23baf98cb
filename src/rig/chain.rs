//! Arm as a chain of rigid pieces joined by lumped springs, with the loads on the pieces.

use nalgebra::{Rotation2, Vector2, Vector3};

use crate::spatial::Frame;

/// Lumped spring between two rigid pieces of the arm, with compliance, play and deformation without
/// load.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Hinge {
    /// Rotation about each axis per moment about the same axis [rad/(N·m)].
    pub compliance: Vector3<f64>,
    /// Rotation about one axis per moment about another [rad/(N·m)]: first for the pair x and y,
    /// then for the pair x and z.
    pub coupling: Vector2<f64>,
    /// Angle about z per cube of the moment about z [rad/(N·m)³].
    pub cubic: f64,
    /// Play b about z \[rad\]. The moment about z rotates the hinge by up to b/2 to its side.
    pub play: f64,
    /// Elongation along x per force [m/N].
    pub stretch: f64,
    /// Rotation vector without load \[rad\].
    pub free_rotation: Vector3<f64>,
    /// Displacement along x without load \[m\].
    pub free_stretch: f64,
}

/// Moment at which the hinge has rotated by 76 % (tanh 1) of half its play [N·m].
const PLAY_MOMENT: f64 = 1.0;

impl Hinge {
    /// Returns true if the hinge does not deform.
    pub fn is_rigid(&self) -> bool {
        *self == Self::default()
    }

    /// Returns the deformation of the hinge under a force \[N\] and a moment [N·m], both in the
    /// axes of the hinge.
    pub fn deformation(&self, force: &Vector3<f64>, moment: &Vector3<f64>) -> Motion {
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

/// Deformation of a hinge: rotation and elongation.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Motion {
    /// Rotation vector of the deformation \[rad\].
    pub rotation: Vector3<f64>,
    /// Displacement along x \[m\].
    pub stretch: f64,
}

/// Spring of a gravity compensator across a hinge. It pulls a point of the piece behind the hinge
/// towards an anchor before the hinge; points are given by x and y in the frame of the hinge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spring {
    /// Index of the piece behind the hinge.
    pub piece: usize,
    /// Anchor before the hinge \[m\].
    pub anchor: Vector2<f64>,
    /// Attachment point behind the hinge, at zero rotation \[m\].
    pub end: Vector2<f64>,
    /// Length at which the tension equals the preload \[m\].
    pub free_length: f64,
    /// Spring rate, tension per length [N/m].
    pub rate: f64,
    /// Tension at the free length \[N\].
    pub preload: f64,
}

impl Spring {
    /// Returns the moment about z on the piece behind the hinge [N·m], when the hinge is rotated by
    /// `angle` \[rad\].
    pub fn moment(&self, angle: f64) -> f64 {
        let end = Rotation2::new(angle) * self.end;
        let span = self.anchor - end;
        let tension = self.preload + self.rate * (span.norm() - self.free_length);
        span.try_normalize(0.0).map_or(0.0, |direction| end.perp(&(direction * tension)))
    }
}

/// Rigid piece of the arm with the hinge before it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub hinge: Hinge,
    /// Frame in which the hinge is mounted.
    pub root: PieceFrame,
}

/// Frame that is fixed to a piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct PieceFrame {
    /// Index of the piece, which is lower than that of any piece mounted on this frame; `None` is
    /// the base.
    pub piece: Option<usize>,
    /// Frame relative to the deformed end of the piece's hinge, or to the base.
    pub frame: Frame<f64>,
}

/// Force on a rigid piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct Load {
    /// Index of the piece that carries the load.
    pub piece: usize,
    /// Point of action, relative to the deformed end of the piece's hinge \[m\].
    pub at: Vector3<f64>,
    pub force: Force,
}

/// Force law of a load.
#[derive(Debug, Clone, Copy)]
pub(super) enum Force {
    /// Constant force, base frame \[N\].
    Constant(Vector3<f64>),
    /// Rope with constant tension, whose direction may depend on the position of its hook.
    Rope {
        /// Tension of the rope \[N\].
        tension: f64,
        /// Unit vector along the rope with the hook at the origin, base frame.
        direction: Vector3<f64>,
        /// Change of the x and y components of the direction per x and y of the hook [1/m].
        trolley: f64,
    },
}

impl Force {
    /// Returns the force \[N\] on a point \[m\], base frame.
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

/// Tree of pieces from the base outwards, with loads in any order.
#[derive(Debug)]
pub(super) struct Chain {
    pub pieces: Vec<Piece>,
    pub loads: Vec<Load>,
    pub springs: Vec<Spring>,
    /// Index of the piece to which the next elements are added.
    last: usize,
    /// Current end of that piece, relative to the piece's hinge.
    end: Frame<f64>,
}

impl Chain {
    /// Creates a single piece of zero length, mounted to the base by `hinge`.
    pub fn new(hinge: Hinge) -> Self {
        let root = PieceFrame { piece: None, frame: Frame::identity() };
        let pieces = vec![Piece { hinge, root }];
        Self { pieces, loads: Vec::new(), springs: Vec::new(), last: 0, end: Frame::identity() }
    }

    /// Returns the current end of the chain, relative to its last hinge, for modification.
    pub fn end(&mut self) -> &mut Frame<f64> {
        &mut self.end
    }

    /// Returns the current end of the chain as a frame on its piece.
    pub fn end_frame(&self) -> PieceFrame {
        PieceFrame { piece: Some(self.last), frame: self.end }
    }

    /// Continues the chain from a frame on one of its pieces.
    pub fn continue_from(&mut self, start: &PieceFrame) {
        (self.last, self.end) = (start.piece.unwrap_or(0), start.frame);
    }

    /// Adds a hinge and a new piece behind it; a rigid hinge adds nothing.
    pub fn add_hinge(&mut self, hinge: Hinge) {
        if !hinge.is_rigid() {
            self.pieces.push(Piece { hinge, root: self.end_frame() });
            (self.last, self.end) = (self.pieces.len() - 1, Frame::identity());
        }
    }

    /// Adds springs across the last hinge.
    pub fn add_springs(&mut self, springs: impl Iterator<Item = Spring>) {
        let piece = self.last;
        self.springs.extend(springs.map(|spring| Spring { piece, ..spring }));
    }

    /// Returns Σ F · p over all loads [N·m], with every hinge undeformed. F is the force in this
    /// chain, and p its point of action in the `moved` chain. Differences of the sum between moved
    /// chains are the work of the loads.
    pub fn work(&self, moved: &Self) -> f64 {
        let forces = self.loads.iter().zip(self.points());
        let forces = forces.map(|(load, point)| load.force.at(&point));
        forces.zip(moved.points()).map(|(force, point)| force.dot(&point)).sum()
    }

    /// Returns the point of action of each load, with every hinge undeformed, base frame \[m\].
    fn points(&self) -> Vec<Vector3<f64>> {
        let mut frames: Vec<Frame<f64>> = Vec::with_capacity(self.pieces.len());
        for Piece { root, .. } in &self.pieces {
            let carrier = root.piece.and_then(|piece| frames.get(piece));
            frames.push(carrier.map_or(root.frame, |carrier| carrier.compose(&root.frame)));
        }
        let point = |load: &Load| frames.get(load.piece).map(|frame| frame.point(&load.at));
        self.loads.iter().filter_map(point).collect()
    }

    /// Adds a load at a point \[m\] relative to the current end of the chain.
    pub fn add_load(&mut self, point: &Vector3<f64>, force: Force) {
        self.loads.push(Load { piece: self.last, at: self.end.point(point), force });
    }
}
