//! Region that the target must stay in.

use nalgebra::Vector3;

/// Box and half-spaces in which the nominal target must stay, arm base frame. Other parts of the
/// arm are not checked.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Workspace {
    /// Opposite corners of the box, minimum first \[m\].
    pub corners: Option<[Vector3<f64>; 2]>,
    /// Half-spaces in which the target must stay: n·p ≥ d with a unit normal n and d \[m\].
    pub planes: Vec<(Vector3<f64>, f64)>,
}

impl Workspace {
    /// Returns true if a point is inside the region.
    pub fn contains(&self, point: &Vector3<f64>) -> bool {
        let is_inside = |[from, to]: &[Vector3<f64>; 2]| {
            point.iter().zip(from).zip(to).all(|((x, from), to)| (*from..=*to).contains(x))
        };
        self.corners.as_ref().is_none_or(is_inside)
            && self.planes.iter().all(|(normal, offset)| normal.dot(point) >= *offset)
    }
}
