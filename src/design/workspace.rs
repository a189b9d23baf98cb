//! Region in which the target must stay.

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

/// Error of a region that is empty or whose plane has no normal.
#[doc(hidden)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RegionError {
    /// The box is empty.
    #[error("the box is empty; write x0, x1, y0, y1, z0, z1, the lesser of each pair first")]
    Empty,
    /// A plane has no normal.
    #[error("0, 0, 0 is no normal of a plane")]
    NoNormal,
}

impl Workspace {
    /// Creates the region of a box x0, x1, y0, y1, z0, z1 \[mm\] and of planes nx, ny, nz, d
    /// \[mm\]; `None` without either.
    ///
    /// # Errors
    /// Returns an error if the box is empty or a plane has no normal.
    #[doc(hidden)]
    pub fn from_mm(
        box_mm: Option<[f64; 6]>,
        planes_mm: &[[f64; 4]],
    ) -> Result<Option<Self>, RegionError> {
        let corners = match box_mm.map(|room| room.map(|x| x * 1e-3)) {
            Some([x0, x1, y0, y1, z0, z1]) if x0 < x1 && y0 < y1 && z0 < z1 => {
                Some([Vector3::new(x0, y0, z0), Vector3::new(x1, y1, z1)])
            }
            Some(_) => return Err(RegionError::Empty),
            None => None,
        };
        let plane = |&[x, y, z, least]: &[f64; 4]| {
            let normal = Vector3::new(x, y, z).try_normalize(0.0).ok_or(RegionError::NoNormal)?;
            Ok((normal, least * 1e-3))
        };
        let planes = planes_mm.iter().map(plane).collect::<Result<Vec<_>, _>>()?;
        Ok((corners.is_some() || !planes.is_empty()).then_some(Self { corners, planes }))
    }

    /// Returns true if a point is inside the region.
    pub fn contains(&self, point: &Vector3<f64>) -> bool {
        let is_inside = |[from, to]: &[Vector3<f64>; 2]| {
            point.iter().zip(from).zip(to).all(|((x, from), to)| (*from..=*to).contains(x))
        };
        self.corners.as_ref().is_none_or(is_inside)
            && self.planes.iter().all(|(normal, offset)| normal.dot(point) >= *offset)
    }
}
