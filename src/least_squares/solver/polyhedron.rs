//! The polyhedron that bounds and inequalities leave to a step.

use nalgebra::{DMatrix, DVector};

use super::interior::HalfSpace;
use super::{AtBound, Bounds, Factor, Inequalities};

/// Normals are dependent when what is left of one is shorter than this part of it.
const DEPENDENT: f64 = 1e-10;
/// Rounding allowed in the distance to a face.
const TOUCH: f64 = 1e-14;

/// What a face of the polyhedron stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Face {
    /// A bound of an unknown.
    Bound(usize, AtBound),
    /// A limit of an inequality.
    Row,
}

/// Half-spaces G q ≥ h with normals of length one.
#[derive(Debug, Clone)]
pub(super) struct Polyhedron {
    pub(super) faces: Vec<Face>,
    /// G, k × n.
    pub(super) normals: DMatrix<f64>,
    /// h.
    pub(super) least: DVector<f64>,
    /// Which faces x lies on.
    pub(super) touched: Vec<bool>,
}

impl Polyhedron {
    /// The steps q = D p from `x` that keep bounds and rows; D is `scale`.
    pub(super) fn around(x: &DVector<f64>, bounds: &Bounds, rows: &Inequalities, scale: &DVector<f64>) -> Self {
        let n = x.len();
        let mut all: Vec<(Face, DVector<f64>, f64, bool)> = Vec::new();
        let unit = |j: usize, sign: f64| DVector::from_fn(n, |k, _| if k == j { sign } else { 0.0 });
        for j in 0..n {
            let (lower, upper) = (bounds.lower()[j], bounds.upper()[j]);
            if lower.is_finite() {
                all.push((Face::Bound(j, AtBound::Lower), unit(j, 1.0), (lower - x[j]) * scale[j], x[j] <= lower));
            }
            if upper.is_finite() {
                all.push((Face::Bound(j, AtBound::Upper), unit(j, -1.0), (x[j] - upper) * scale[j], x[j] >= upper));
            }
        }
        for i in 0..rows.len() {
            let row = rows.matrix().row(i).transpose();
            let (value, at) = (row.dot(x), rows.at(x, i));
            let normal = row.component_div(scale);
            let size = normal.norm();
            let (lower, upper) = (rows.lower()[i], rows.upper()[i]);
            if lower.is_finite() {
                all.push((Face::Row, &normal / size, (lower - value) / size, at == Some(AtBound::Lower)));
            }
            let on_upper = at == Some(AtBound::Upper) || (at.is_some() && lower >= upper);
            if upper.is_finite() {
                all.push((Face::Row, -&normal / size, (value - upper) / size, on_upper));
            }
        }
        Self {
            faces: all.iter().map(|face| face.0).collect(),
            normals: DMatrix::from_fn(all.len(), n, |i, j| all[i].1[j]),
            least: DVector::from_iterator(all.len(), all.iter().map(|face| face.2)),
            touched: all.iter().map(|face| face.3).collect(),
        }
    }

    /// What is left of a gradient at q = 0 along the directions that the touched faces leave open.
    ///
    /// γ − Gᵀμ with μ ≥ 0 of the touched faces; those that would pull inwards are let go.
    pub(super) fn free_part(&self, gradient: &DVector<f64>) -> DVector<f64> {
        let mut active = self.touched.clone();
        loop {
            let multipliers = self.multipliers(&active, gradient);
            if multipliers.iter().all(|&(_, multiplier)| multiplier >= 0.0) {
                return multipliers.iter().fold(gradient.clone(), |left, &(i, multiplier)| {
                    left - self.normals.row(i).transpose() * multiplier
                });
            }
            for (i, multiplier) in multipliers {
                active[i] = multiplier >= 0.0;
            }
        }
    }

    /// μ of the active faces with Gᵀμ nearest to `force`, the shortest where several are.
    pub(super) fn multipliers(&self, active: &[bool], force: &DVector<f64>) -> Vec<(usize, f64)> {
        let chosen = chosen(active);
        if chosen.is_empty() {
            return Vec::new();
        }
        let normals = self.normals.select_rows(&chosen).transpose();
        let multipliers = Factor::new(normals, -force, DEPENDENT).gauss_newton();
        chosen.into_iter().zip(multipliers.iter().copied()).collect()
    }

    /// The shortest q on all active faces, and orthonormal columns that span the directions along them.
    pub(super) fn flat(&self, active: &[bool]) -> (DVector<f64>, DMatrix<f64>) {
        let (chosen, n) = (chosen(active), self.normals.ncols());
        if chosen.is_empty() {
            return (DVector::zeros(n), DMatrix::identity(n, n));
        }
        let normals = self.normals.select_rows(&chosen);
        let least = DVector::from_iterator(chosen.len(), chosen.iter().map(|&i| self.least[i]));
        let qr = normals.transpose().col_piv_qr();
        let r = qr.r();
        let rank = (0..r.nrows()).filter(|&i| r[(i, i)].abs() > DEPENDENT * r[(0, 0)].abs()).count();
        let mut all = DMatrix::identity(n, n);
        qr.q_tr_mul(&mut all);
        let mut shortest = Factor::new(normals.clone(), -&least, DEPENDENT).gauss_newton();
        shortest += Factor::new(normals.clone(), normals * &shortest - least, DEPENDENT).gauss_newton();
        (shortest, all.rows(rank, n - rank).transpose())
    }

    /// By how much face `i` is passed, beyond rounding.
    pub(super) fn passed(&self, i: usize, q: &DVector<f64>) -> bool {
        self.normals.row(i).transpose().dot(q) < self.least[i] - TOUCH * (q.norm() + self.least[i].abs())
    }

    pub(super) fn half_spaces(&self) -> Vec<HalfSpace> {
        let normal = |i: usize| self.normals.row(i).iter().copied().enumerate().filter(|&(_, g)| g != 0.0).collect();
        (0..self.faces.len()).map(|i| HalfSpace { normal: normal(i), least: self.least[i] }).collect()
    }
}

/// The faces that are marked.
pub(super) fn chosen(active: &[bool]) -> Vec<usize> {
    (0..active.len()).filter(|&i| active[i]).collect()
}
