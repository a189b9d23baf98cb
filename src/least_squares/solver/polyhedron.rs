//! The polyhedron that bounds and inequalities leave to a step; a box where there are no
//! inequalities.

use nalgebra::{DMatrix, DVector};

use super::interior::HalfSpace;
use super::{AtBound, Bounds, Factor, Inequalities};

/// Normals are dependent when what is left of one is shorter than this part of it.
const DEPENDENT: f64 = 1e-10;
/// Rounding allowed in the distance to a half-space.
const TOUCH: f64 = 1e-14;

/// Steps lower ≤ q ≤ upper with G q ≥ h, normals of length one.
#[derive(Debug, Clone)]
pub(super) struct Polyhedron {
    pub(super) lower: DVector<f64>,
    pub(super) upper: DVector<f64>,
    /// G, k × n.
    pub(super) normals: DMatrix<f64>,
    /// h.
    pub(super) least: DVector<f64>,
    /// What x lies on.
    pub(super) touched: Faces,
}

/// Faces of the polyhedron.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Faces {
    /// The bound of each unknown.
    pub(super) bounds: Vec<Option<AtBound>>,
    /// Which half-spaces.
    pub(super) rows: Vec<bool>,
}

/// A step and the faces it lies on.
#[derive(Debug, Clone)]
pub(super) struct PolyhedronSolution {
    pub(super) q: DVector<f64>,
    pub(super) faces: Faces,
}

impl Faces {
    /// Unknowns at no bound.
    pub(super) fn free(&self) -> Vec<usize> {
        (0..self.bounds.len()).filter(|&j| self.bounds[j].is_none()).collect()
    }

    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.bounds.iter().all(Option::is_none) && !self.rows.contains(&true)
    }

    /// How many faces are those of one alone.
    pub(super) fn differences(&self, other: &Self) -> usize {
        let rows = self.rows.iter().zip(&other.rows).filter(|(own, other)| own != other).count();
        rows + self.bounds.iter().zip(&other.bounds).filter(|(own, other)| own != other).count()
    }

    /// Takes over the last difference to others.
    pub(super) fn take_last_of(&mut self, other: &Self) {
        if let Some(i) = (0..self.rows.len()).rfind(|&i| self.rows[i] != other.rows[i]) {
            self.rows[i] = other.rows[i];
        } else if let Some(j) = (0..self.bounds.len()).rfind(|&j| self.bounds[j] != other.bounds[j])
        {
            self.bounds[j] = other.bounds[j];
        }
    }

    /// Half-spaces among the faces.
    fn chosen(&self) -> Vec<usize> {
        (0..self.rows.len()).filter(|&i| self.rows[i]).collect()
    }
}

impl Polyhedron {
    /// The steps q = D p from `x` that keep bounds and rows; D is `scale`.
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
            let on_upper = at == Some(AtBound::Upper) || (at.is_some() && lower >= upper);
            if upper.is_finite() {
                spaces.push((-&normal / size, (value - upper) / size, on_upper));
            }
        }
        Self {
            lower: (bounds.lower() - x).component_mul(scale),
            upper: (bounds.upper() - x).component_mul(scale),
            normals: DMatrix::from_fn(spaces.len(), x.len(), |i, j| spaces[i].0[j]),
            least: DVector::from_iterator(spaces.len(), spaces.iter().map(|space| space.1)),
            touched: Faces {
                bounds: (0..x.len()).map(|j| bounds.at(x, j)).collect(),
                rows: spaces.iter().map(|space| space.2).collect(),
            },
        }
    }

    /// What is left of a gradient at q = 0 along the directions that the touched faces leave open.
    ///
    /// γ − Gᵀμ with μ ≥ 0 of the touched faces; those that would pull inwards are left.
    pub(super) fn free_part(&self, gradient: &DVector<f64>) -> DVector<f64> {
        let (faces, mut left) = self.pressed(gradient);
        (0..left.len()).filter(|&j| faces.bounds[j].is_some()).for_each(|j| left[j] = 0.0);
        left
    }

    /// The touched faces that a step against `gradient` at q = 0 would leave, and the gradient
    /// without the half-spaces among them.
    pub(super) fn pressed(&self, gradient: &DVector<f64>) -> (Faces, DVector<f64>) {
        let mut faces = self.touched.clone();
        loop {
            let (left, multipliers) = self.multipliers(&faces, gradient);
            let kept = self.kept(&faces, &left, &multipliers, 0.0);
            if kept == faces {
                return (faces, left);
            }
            faces = kept;
        }
    }

    /// Normals of some faces, one a row.
    pub(super) fn normals_of(&self, faces: &Faces) -> DMatrix<f64> {
        let n = faces.bounds.len();
        let (chosen, held) =
            (faces.chosen(), (0..n).filter(|&j| faces.bounds[j].is_some()).collect::<Vec<_>>());
        let bounds = DMatrix::from_fn(held.len(), n, |i, j| f64::from(u8::from(held[i] == j)));
        let mut rows = bounds.insert_rows(held.len(), chosen.len(), 0.0);
        rows.rows_mut(held.len(), chosen.len()).copy_from(&self.normals.select_rows(&chosen));
        rows
    }

    /// μ of the half-spaces among `faces`, the shortest where several do, and what they leave of
    /// `force`: the multipliers of the bounds, and nothing else where the faces hold all of it.
    pub(super) fn multipliers(
        &self,
        faces: &Faces,
        force: &DVector<f64>,
    ) -> (DVector<f64>, Vec<(usize, f64)>) {
        let (chosen, free) = (faces.chosen(), faces.free());
        if chosen.is_empty() {
            return (force.clone(), Vec::new());
        }
        let normals = self.normals.select_rows(&chosen).transpose();
        let multipliers =
            Factor::new(normals.select_rows(&free), -force.select_rows(&free), DEPENDENT)
                .gauss_newton();
        (
            force - normals * &multipliers,
            chosen.into_iter().zip(multipliers.iter().copied()).collect(),
        )
    }

    /// The faces whose multiplier does not pull inwards by more than `slack`; an unknown with one
    /// value only keeps it.
    pub(super) fn kept(
        &self,
        faces: &Faces,
        bounds: &DVector<f64>,
        rows: &[(usize, f64)],
        slack: f64,
    ) -> Faces {
        let mut kept = faces.clone();
        for (j, bound) in
            kept.bounds.iter_mut().enumerate().filter(|&(j, _)| self.lower[j] < self.upper[j])
        {
            *bound = bound.filter(|side| match side {
                AtBound::Lower => bounds[j] >= -slack,
                AtBound::Upper => bounds[j] <= slack,
            });
        }
        for &(i, multiplier) in rows {
            kept.rows[i] = multiplier >= -slack;
        }
        kept
    }

    /// The shortest q on some faces, and orthonormal columns that span the directions of the free
    /// unknowns along the half-spaces among them; none where there are no such half-spaces.
    pub(super) fn flat(&self, faces: &Faces) -> (DVector<f64>, Option<DMatrix<f64>>) {
        let mut corner = DVector::from_fn(faces.bounds.len(), |j, _| match faces.bounds[j] {
            Some(AtBound::Lower) => self.lower[j],
            Some(AtBound::Upper) => self.upper[j],
            None => 0.0,
        });
        let (chosen, free) = (faces.chosen(), faces.free());
        if chosen.is_empty() || free.is_empty() {
            return (corner, None);
        }
        let normals = self.normals.select_rows(&chosen);
        let least = self.least.select_rows(&chosen) - &normals * &corner;
        let normals = normals.select_columns(&free);
        let qr = normals.transpose().col_piv_qr();
        let r = qr.r();
        let rank =
            (0..r.nrows()).filter(|&i| r[(i, i)].abs() > DEPENDENT * r[(0, 0)].abs()).count();
        let mut all = DMatrix::identity(free.len(), free.len());
        qr.q_tr_mul(&mut all);
        let mut shortest = Factor::new(normals.clone(), -&least, DEPENDENT).gauss_newton();
        shortest +=
            Factor::new(normals.clone(), normals * &shortest - least, DEPENDENT).gauss_newton();
        free.iter().zip(shortest.iter()).for_each(|(&j, value)| corner[j] = *value);
        (corner, Some(all.rows(rank, free.len() - rank).transpose()))
    }

    /// Whether half-space `i` is left, beyond rounding.
    pub(super) fn leaves(&self, i: usize, q: &DVector<f64>) -> bool {
        self.normals.row(i).transpose().dot(q)
            < self.least[i] - TOUCH * (q.norm() + self.least[i].abs())
    }

    /// The bounds that are finite, and all others.
    pub(super) fn half_spaces(&self) -> Vec<HalfSpace> {
        let side = |bounds: &DVector<f64>, sign: f64| -> Vec<HalfSpace> {
            let finite = bounds.iter().enumerate().filter(|(_, bound)| bound.is_finite());
            finite
                .map(|(j, bound)| HalfSpace { normal: vec![(j, sign)], least: sign * bound })
                .collect()
        };
        let normal = |i: usize| {
            self.normals.row(i).iter().copied().enumerate().filter(|&(_, g)| g != 0.0).collect()
        };
        let rows = (0..self.least.len())
            .map(|i| HalfSpace { normal: normal(i), least: self.least[i] })
            .collect();
        [side(&self.lower, 1.0), side(&self.upper, -1.0), rows].concat()
    }

    /// The faces no farther from `q` than `near`, relative to its size.
    pub(super) fn faces_near(&self, q: &DVector<f64>, near: f64) -> Faces {
        let distance = near * q.amax().max(f64::MIN_POSITIVE);
        let bound = |j: usize| match q[j] {
            value if value - self.lower[j] <= distance => Some(AtBound::Lower),
            value if self.upper[j] - value <= distance => Some(AtBound::Upper),
            _ => None,
        };
        let rows = (&self.normals * q)
            .iter()
            .zip(&self.least)
            .map(|(along, least)| along - least <= distance)
            .collect();
        Faces { bounds: (0..q.len()).map(bound).collect(), rows }
    }

    /// Into the box; a bound that overflowed to no number bounds nothing.
    pub(super) fn clamped(&self, mut q: DVector<f64>) -> DVector<f64> {
        (0..q.len()).for_each(|j| q[j] = q[j].max(self.lower[j]).min(self.upper[j]));
        q
    }

    /// The part within the half-spaces of a step that is brought into the box, on the faces that
    /// are `near`; the way back to q = 0 is inside.
    pub(super) fn within(&self, q: DVector<f64>, near: f64) -> PolyhedronSolution {
        let q = self.clamped(q);
        let part = (&self.normals * &q)
            .iter()
            .zip(&self.least)
            .filter(|(along, least)| along < least)
            .fold(1.0_f64, |part, (along, least)| part.min((least / along).clamp(0.0, 1.0)));
        let q = q * part;
        PolyhedronSolution { faces: self.faces_near(&q, near), q }
    }
}
