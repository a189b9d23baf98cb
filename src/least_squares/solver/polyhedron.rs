//! Polyhedron of steps that bounds and inequalities allow; a box if there are no inequalities.

use nalgebra::{DMatrix, DVector};

use super::interior::HalfSpace;
use super::{AtBound, Bounds, Factor, Inequalities};

/// Smallest length of the independent part of a unit normal; a shorter one counts as linearly
/// dependent.
const MIN_INDEPENDENT_LENGTH: f64 = 1e-10;
/// Rounding error allowed in the distance to a half-space, relative to the size of its terms.
const MAX_HALF_SPACE_ROUNDING: f64 = 1e-14;

/// Set of steps lower ≤ q ≤ upper with G q ≥ h; the rows of G have unit length.
#[derive(Debug, Clone)]
pub(super) struct Polyhedron {
    pub(super) lower: DVector<f64>,
    pub(super) upper: DVector<f64>,
    /// Unit normals of the half-spaces G q ≥ h as rows, shape = (k, n).
    pub(super) normals: DMatrix<f64>,
    /// Offsets h of the half-spaces G q ≥ h, length k.
    pub(super) offsets: DVector<f64>,
    /// Faces that contain the zero step q = 0, that is the present point x itself.
    pub(super) faces_at_origin: Faces,
}

/// Set of faces of the polyhedron.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Faces {
    /// Bound on which a step rests in each unknown; `None` if it rests on none.
    pub(super) bounds: Vec<Option<AtBound>>,
    /// For each half-space G q ≥ h, true if the step rests on it.
    pub(super) rows: Vec<bool>,
}

/// Step q with the faces that contain it.
#[derive(Debug, Clone)]
pub(super) struct PolyhedronSolution {
    pub(super) q: DVector<f64>,
    pub(super) faces: Faces,
}

impl Faces {
    /// Returns the unknowns without an active bound.
    pub(super) fn free_unknowns(&self) -> Vec<usize> {
        (0..self.bounds.len()).filter(|&j| self.bounds[j].is_none()).collect()
    }

    /// Returns true if no face is in the set.
    pub(super) fn is_empty(&self) -> bool {
        self.bounds.iter().all(Option::is_none) && !self.rows.contains(&true)
    }

    /// Returns the number of unknowns and half-spaces whose active faces differ between the two
    /// sets.
    pub(super) fn differences(&self, other: &Self) -> usize {
        let rows = self.rows.iter().zip(&other.rows).filter(|(a, b)| a != b).count();
        rows + self.bounds.iter().zip(&other.bounds).filter(|(a, b)| a != b).count()
    }

    /// Makes the last face in which the two sets differ as it is in `other`; half-spaces come after
    /// bounds.
    pub(super) fn adopt_last_difference(&mut self, other: &Self) {
        if let Some(i) = (0..self.rows.len()).rfind(|&i| self.rows[i] != other.rows[i]) {
            self.rows[i] = other.rows[i];
        } else if let Some(j) = (0..self.bounds.len()).rfind(|&j| self.bounds[j] != other.bounds[j])
        {
            self.bounds[j] = other.bounds[j];
        }
    }

    /// Returns the indices of the active half-spaces.
    fn active_rows(&self) -> Vec<usize> {
        (0..self.rows.len()).filter(|&i| self.rows[i]).collect()
    }
}

impl Polyhedron {
    /// Returns the polyhedron of steps q = D p from `x` that satisfy bounds and rows; D is `scale`.
    pub(super) fn around(
        x: &DVector<f64>,
        bounds: &Bounds,
        rows: &Inequalities,
        scale: &DVector<f64>,
    ) -> Self {
        let mut spaces: Vec<(DVector<f64>, f64, bool)> = Vec::new();
        for i in 0..rows.len() {
            let row = rows.matrix().row(i).transpose();
            let (value, at) = (row.dot(x), rows.at(x, i));
            let normal = row.component_div(scale);
            let size = normal.norm();
            let (lower, upper) = (rows.lower()[i], rows.upper()[i]);
            if lower.is_finite() {
                spaces.push((&normal / size, (lower - value) / size, at == Some(AtBound::Lower)));
            }
            let is_at_upper = at == Some(AtBound::Upper) || (at.is_some() && lower >= upper);
            if upper.is_finite() {
                spaces.push((-&normal / size, (value - upper) / size, is_at_upper));
            }
        }
        Self {
            lower: (bounds.lower() - x).component_mul(scale),
            upper: (bounds.upper() - x).component_mul(scale),
            normals: DMatrix::from_fn(spaces.len(), x.len(), |i, j| spaces[i].0[j]),
            offsets: DVector::from_iterator(spaces.len(), spaces.iter().map(|space| space.1)),
            faces_at_origin: Faces {
                bounds: (0..x.len()).map(|j| bounds.at(x, j)).collect(),
                rows: spaces.iter().map(|space| space.2).collect(),
            },
        }
    }

    /// Returns the part of a gradient γ at q = 0 along the feasible directions.
    ///
    /// It is γ − Gᵀμ with multipliers μ ≥ 0 over the faces through q = 0, except faces that a
    /// descent step leaves inwards.
    pub(super) fn projected_gradient(&self, gradient: &DVector<f64>) -> DVector<f64> {
        let (faces, mut projected) = self.active_faces(gradient);
        (0..projected.len())
            .filter(|&j| faces.bounds[j].is_some())
            .for_each(|j| projected[j] = 0.0);
        projected
    }

    /// Returns the faces through q = 0 that a step against `gradient` would violate, and the
    /// gradient without its components along the half-spaces among them.
    pub(super) fn active_faces(&self, gradient: &DVector<f64>) -> (Faces, DVector<f64>) {
        let mut faces = self.faces_at_origin.clone();
        loop {
            let (remainder, multipliers) = self.multipliers(&faces, gradient);
            let retained = self.retained_faces(&faces, &remainder, &multipliers, 0.0);
            if retained == faces {
                return (faces, remainder);
            }
            faces = retained;
        }
    }

    /// Returns the normals of the active bounds, then of the active half-spaces, shape = (faces,
    /// n).
    pub(super) fn normals_of(&self, faces: &Faces) -> DMatrix<f64> {
        let n = faces.bounds.len();
        let (active, bounded) = (
            faces.active_rows(),
            (0..n).filter(|&j| faces.bounds[j].is_some()).collect::<Vec<_>>(),
        );
        let bounds =
            DMatrix::from_fn(bounded.len(), n, |i, j| f64::from(u8::from(bounded[i] == j)));
        let mut rows = bounds.insert_rows(bounded.len(), active.len(), 0.0);
        rows.rows_mut(bounded.len(), active.len()).copy_from(&self.normals.select_rows(&active));
        rows
    }

    /// Returns the remainder `force` − Gᵀμ and the multipliers μ of the half-spaces among `faces`,
    /// of minimum norm if they are not unique.
    ///
    /// The remainder holds the multipliers of the active bounds. Its entries of free unknowns
    /// vanish if `force` is a combination of the normals of the faces.
    pub(super) fn multipliers(
        &self,
        faces: &Faces,
        force: &DVector<f64>,
    ) -> (DVector<f64>, Vec<(usize, f64)>) {
        let (active, free) = (faces.active_rows(), faces.free_unknowns());
        if active.is_empty() {
            return (force.clone(), Vec::new());
        }
        let normals = self.normals.select_rows(&active).transpose();
        let multipliers = Factor::new(
            normals.select_rows(&free),
            -force.select_rows(&free),
            MIN_INDEPENDENT_LENGTH,
        )
        .gauss_newton();
        (
            force - normals * &multipliers,
            active.into_iter().zip(multipliers.iter().copied()).collect(),
        )
    }

    /// Returns the faces whose multiplier has the right sign, or the wrong one by at most `slack`.
    /// `bounds` and `rows` hold the multipliers of bounds and half-spaces. A fixed unknown keeps
    /// its bound.
    pub(super) fn retained_faces(
        &self,
        faces: &Faces,
        bounds: &DVector<f64>,
        rows: &[(usize, f64)],
        slack: f64,
    ) -> Faces {
        let mut retained = faces.clone();
        for (j, bound) in
            retained.bounds.iter_mut().enumerate().filter(|&(j, _)| self.lower[j] < self.upper[j])
        {
            *bound = bound.filter(|side| match side {
                AtBound::Lower => bounds[j] >= -slack,
                AtBound::Upper => bounds[j] <= slack,
            });
        }
        for &(i, multiplier) in rows {
            retained.rows[i] = multiplier >= -slack;
        }
        retained
    }

    /// Returns a point q on the given faces, the shortest in the free unknowns. Also returns an
    /// orthonormal basis of the directions of the free unknowns along the active half-spaces.
    ///
    /// The basis is `None` if no half-space is active.
    pub(super) fn affine_subspace(&self, faces: &Faces) -> (DVector<f64>, Option<DMatrix<f64>>) {
        let mut corner = DVector::from_fn(faces.bounds.len(), |j, _| match faces.bounds[j] {
            Some(AtBound::Lower) => self.lower[j],
            Some(AtBound::Upper) => self.upper[j],
            None => 0.0,
        });
        let (active, free) = (faces.active_rows(), faces.free_unknowns());
        if active.is_empty() || free.is_empty() {
            return (corner, None);
        }
        let normals = self.normals.select_rows(&active);
        let offsets = self.offsets.select_rows(&active) - &normals * &corner;
        let normals = normals.select_columns(&free);
        let qr = normals.transpose().col_piv_qr();
        let r = qr.r();
        let rank = (0..r.nrows())
            .filter(|&i| r[(i, i)].abs() > MIN_INDEPENDENT_LENGTH * r[(0, 0)].abs())
            .count();
        let mut rotation = DMatrix::identity(free.len(), free.len());
        qr.q_tr_mul(&mut rotation);
        let mut shortest =
            Factor::new(normals.clone(), -&offsets, MIN_INDEPENDENT_LENGTH).gauss_newton();
        shortest +=
            Factor::new(normals.clone(), normals * &shortest - offsets, MIN_INDEPENDENT_LENGTH)
                .gauss_newton();
        free.iter().zip(shortest.iter()).for_each(|(&j, value)| corner[j] = *value);
        (corner, Some(rotation.rows(rank, free.len() - rank).transpose()))
    }

    /// Returns true if q violates half-space `i` beyond rounding.
    pub(super) fn violates(&self, i: usize, q: &DVector<f64>) -> bool {
        self.normals.row(i).transpose().dot(q)
            < self.offsets[i] - MAX_HALF_SPACE_ROUNDING * (q.norm() + self.offsets[i].abs())
    }

    /// Returns the finite bounds and all inequalities as half-spaces.
    pub(super) fn half_spaces(&self) -> Vec<HalfSpace> {
        let side = |bounds: &DVector<f64>, sign: f64| -> Vec<HalfSpace> {
            let finite = bounds.iter().enumerate().filter(|(_, bound)| bound.is_finite());
            finite
                .map(|(j, bound)| HalfSpace { normal: vec![(j, sign)], offset: sign * bound })
                .collect()
        };
        let normal = |i: usize| {
            self.normals.row(i).iter().copied().enumerate().filter(|&(_, g)| g != 0.0).collect()
        };
        let rows = (0..self.offsets.len())
            .map(|i| HalfSpace { normal: normal(i), offset: self.offsets[i] })
            .collect();
        [side(&self.lower, 1.0), side(&self.upper, -1.0), rows].concat()
    }

    /// Returns the faces that `q` violates, or whose distance from `q`, relative to the size of q,
    /// is at most `tolerance`.
    pub(super) fn faces_near(&self, q: &DVector<f64>, tolerance: f64) -> Faces {
        let distance = tolerance * q.amax().max(f64::MIN_POSITIVE);
        let bound = |j: usize| match q[j] {
            value if value - self.lower[j] <= distance => Some(AtBound::Lower),
            value if self.upper[j] - value <= distance => Some(AtBound::Upper),
            _ => None,
        };
        let rows = (&self.normals * q)
            .iter()
            .zip(&self.offsets)
            .map(|(along, offset)| along - offset <= distance)
            .collect();
        Faces { bounds: (0..q.len()).map(bound).collect(), rows }
    }

    /// Returns q clamped into the box; a bound that is not a number (after overflow) limits
    /// nothing.
    pub(super) fn clamped(&self, mut q: DVector<f64>) -> DVector<f64> {
        (0..q.len()).for_each(|j| q[j] = q[j].max(self.lower[j]).min(self.upper[j]));
        q
    }

    /// Clamps a step into the box, then shortens it until it satisfies the half-spaces. Its faces
    /// are those within `tolerance`.
    ///
    /// Shortening suffices because q = 0 is feasible.
    pub(super) fn pulled_inside(&self, q: DVector<f64>, tolerance: f64) -> PolyhedronSolution {
        let q = self.clamped(q);
        let fraction = (&self.normals * &q)
            .iter()
            .zip(&self.offsets)
            .filter(|(along, offset)| along < offset)
            .fold(1.0_f64, |part, (along, offset)| part.min((offset / along).clamp(0.0, 1.0)));
        let q = q * fraction;
        PolyhedronSolution { faces: self.faces_near(&q, tolerance), q }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vector(values: &[f64]) -> DVector<f64> {
        DVector::from_column_slice(values)
    }

    /// Returns the polyhedron around a point for two bounded unknowns and one without bounds, with
    /// the rows −3 ≤ x₀ + 2 x₁ + x₂ ≤ 8 and x₁ − x₂ ≤ 1; also point, bounds, rows and scale.
    fn example(point: [f64; 3]) -> (Polyhedron, DVector<f64>, Bounds, Inequalities, DVector<f64>) {
        let infinite = f64::INFINITY;
        let bounds =
            Bounds::new(vector(&[0.0, -1.0, -infinite]), vector(&[5.0, 4.0, infinite])).unwrap();
        let matrix = DMatrix::from_row_slice(2, 3, &[1.0, 2.0, 1.0, 0.0, 1.0, -1.0]);
        let rows =
            Inequalities::new(matrix, vector(&[-3.0, -infinite]), vector(&[8.0, 1.0])).unwrap();
        let (x, scale) = (vector(&point), vector(&[2.0, 0.5, 3.0]));
        (Polyhedron::around(&x, &bounds, &rows, &scale), x, bounds, rows, scale)
    }

    #[test]
    fn faces_through_the_point_are_active() {
        // x₀ on its lower bound, x₀ + 2 x₁ + x₂ on its upper limit, x₁ − x₂ on its limit.
        let (polyhedron, ..) = example([0.0, 3.0, 2.0]);
        let faces = polyhedron.faces_at_origin.clone();
        assert_eq!(faces.bounds, [Some(AtBound::Lower), None, None]);
        assert_eq!(faces.rows, [false, true, true]);
        assert_eq!((faces.free_unknowns(), faces.active_rows()), (vec![1, 2], vec![1, 2]));
        let normals = polyhedron.normals_of(&faces);
        assert_eq!(normals.row(0), vector(&[1.0, 0.0, 0.0]).transpose());
        assert_eq!(normals.rows(1, 2), polyhedron.normals.rows(1, 2));
        // A force made of the normals has their coefficients as multipliers.
        let force = normals.tr_mul(&vector(&[0.4, 2.0, 3.0]));
        let (remainder, multipliers) = polyhedron.multipliers(&faces, &force);
        assert!((remainder - vector(&[0.4, 0.0, 0.0])).amax() < 1e-12);
        assert_eq!(multipliers.iter().map(|pair| pair.0).collect::<Vec<_>>(), [1, 2]);
        assert!((multipliers[0].1 - 2.0).abs() < 1e-12 && (multipliers[1].1 - 3.0).abs() < 1e-12);
        assert!(polyhedron.projected_gradient(&force).amax() < 1e-12);
        // A descent step leaves the face whose multiplier is negative; the gradient along the
        // others remains.
        let force = normals.tr_mul(&vector(&[0.4, 2.0, -1.0]));
        let (active, _) = polyhedron.active_faces(&force);
        assert_eq!(
            (active.bounds[0], active.rows),
            (Some(AtBound::Lower), vec![false, true, false])
        );
        let along = polyhedron.projected_gradient(&force);
        assert!(along.norm() > 0.1 && along[0].abs() < 1e-300);
        assert!(polyhedron.normals.row(1).transpose().dot(&along).abs() < 1e-12);
    }

    #[test]
    fn points_on_faces_are_spanned_by_the_basis() {
        let (polyhedron, ..) = example([1.0, 0.5, 0.25]);
        let mut faces = polyhedron.faces_at_origin.clone();
        assert!(polyhedron.affine_subspace(&faces).1.is_none());
        faces.rows[1] = true;
        let (corner, basis) = polyhedron.affine_subspace(&faces);
        let basis = basis.unwrap();
        let normal = polyhedron.normals.row(1).transpose();
        assert!((normal.dot(&corner) - polyhedron.offsets[1]).abs() < 1e-12);
        // The shortest point of the face lies along its normal.
        assert!((&corner - &normal * polyhedron.offsets[1]).amax() < 1e-12);
        assert_eq!(basis.shape(), (3, 2));
        assert!((basis.tr_mul(&basis) - DMatrix::identity(2, 2)).amax() < 1e-12);
        assert!(basis.tr_mul(&normal).amax() < 1e-12);
        faces.bounds[1] = Some(AtBound::Upper);
        faces.rows[2] = true;
        let (corner, basis) = polyhedron.affine_subspace(&faces);
        assert!((corner[1] - polyhedron.upper[1]).abs() < 1e-12);
        for i in [1, 2] {
            let along = polyhedron.normals.row(i).transpose().dot(&corner);
            assert!((along - polyhedron.offsets[i]).abs() < 1e-12);
        }
        assert_eq!(basis.unwrap().shape(), (2, 0));
    }
}
