//! Where the target may go.

use nalgebra::Vector3;

/// A box and half-spaces that the nominal target has to stay in, frame of the arm's base; the rest
/// of the arm is not looked at.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Workspace {
    /// Opposite corners of the box, least first \[m\].
    pub room: Option<[Vector3<f64>; 2]>,
    /// Planes that the target stays beyond: n·p ≥ d with a unit normal n and d \[m\].
    pub planes: Vec<(Vector3<f64>, f64)>,
}

impl Workspace {
    /// Whether a point may be reached for.
    pub fn holds(&self, point: &Vector3<f64>) -> bool {
        let inside = |[from, to]: &[Vector3<f64>; 2]| {
            point.iter().zip(from).zip(to).all(|((x, from), to)| (*from..=*to).contains(x))
        };
        self.room.as_ref().is_none_or(inside)
            && self.planes.iter().all(|(normal, least)| normal.dot(point) >= *least)
    }
}
