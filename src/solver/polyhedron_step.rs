//! Linear least squares in a polyhedron: active-set guess, interior-point solver, polish.

use nalgebra::{DMatrix, DVector};

use super::interior::{HalfSpace, interior_point};
use super::{AtBound, Bounds, Factor, Inequalities};

/// Distance to a face, relative to the step's size, below which the interior point is on the face.
const NEAR: f64 = 1e-6;
/// Corrections of the active set allowed to a polish.
const CORRECTIONS: usize = 30;
/// Rounding allowed in the signs of the multipliers.
const ROUNDING: f64 = 1e-12;
/// Rounding allowed in the distance to a face.
const TOUCH: f64 = 1e-14;
/// Normals are dependent when what is left of one is shorter than this part of it.
const DEPENDENT: f64 = 1e-10;

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
    faces: Vec<Face>,
    /// G, k × n.
    normals: DMatrix<f64>,
    /// h.
    least: DVector<f64>,
    /// Which faces x lies on.
    touched: Vec<bool>,
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
            multipliers.iter().for_each(|&(i, multiplier)| active[i] = multiplier >= 0.0);
        }
    }

    /// μ of the active faces with Gᵀμ nearest to `force`, the shortest where several are.
    fn multipliers(&self, active: &[bool], force: &DVector<f64>) -> Vec<(usize, f64)> {
        let chosen = chosen(active);
        if chosen.is_empty() {
            return Vec::new();
        }
        let normals = self.normals.select_rows(&chosen).transpose();
        let multipliers = Factor::new(normals, -force, DEPENDENT).gauss_newton();
        chosen.into_iter().zip(multipliers.iter().copied()).collect()
    }

    /// The shortest q on all active faces, and orthonormal columns that span the directions along them.
    fn flat(&self, active: &[bool]) -> (DVector<f64>, DMatrix<f64>) {
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
    fn passed(&self, i: usize, q: &DVector<f64>) -> bool {
        self.normals.row(i).transpose().dot(q) < self.least[i] - TOUCH * (q.norm() + self.least[i].abs())
    }

    fn half_spaces(&self) -> Vec<HalfSpace> {
        let normal = |i: usize| self.normals.row(i).iter().copied().enumerate().filter(|&(_, g)| g != 0.0).collect();
        (0..self.faces.len()).map(|i| HalfSpace { normal: normal(i), least: self.least[i] }).collect()
    }
}

fn chosen(active: &[bool]) -> Vec<usize> {
    (0..active.len()).filter(|&i| active[i]).collect()
}

/// min ½‖B q + c‖² + ½λ‖q‖² in a polyhedron.
pub(super) struct PolyhedronProblem<'a> {
    factor: &'a Factor,
    gradient: DVector<f64>,
    polyhedron: &'a Polyhedron,
    guess: Vec<bool>,
}

/// A minimiser and the faces it lies on.
#[derive(Debug, Clone)]
pub(super) struct PolyhedronSolution {
    pub(super) q: DVector<f64>,
    active: Vec<bool>,
}

impl<'a> PolyhedronProblem<'a> {
    pub(super) fn new(factor: &'a Factor, polyhedron: &'a Polyhedron) -> Self {
        Self { factor, gradient: factor.gradient(), polyhedron, guess: polyhedron.touched.clone() }
    }

    /// ‖Bᵀc‖.
    pub(super) fn gradient_norm(&self) -> f64 {
        self.gradient.norm()
    }

    /// The bounds among the faces that a solution lies on.
    pub(super) fn bounds_of(&self, solution: &PolyhedronSolution) -> Vec<Option<AtBound>> {
        let mut bounds = vec![None; solution.q.len()];
        for i in chosen(&solution.active) {
            if let Face::Bound(j, side) = self.polyhedron.faces[i] {
                bounds[j] = Some(side);
            }
        }
        bounds
    }

    /// The minimiser for damping λ, exact on its faces.
    pub(super) fn solve(&mut self, lambda: f64) -> PolyhedronSolution {
        let solution = self.polish(self.guess.clone(), lambda, 2).unwrap_or_else(|| {
            let interior = interior_point(self.factor, lambda, &self.polyhedron.half_spaces());
            let interior = interior.unwrap_or_else(|| DVector::zeros(self.gradient.len()));
            self.polish(self.near(&interior), lambda, CORRECTIONS).unwrap_or_else(|| self.shortened(interior))
        });
        self.guess.clone_from(&solution.active);
        solution
    }

    /// Solves on some faces and corrects the choice until the optimality conditions hold, within `corrections` rounds.
    ///
    /// Each round leaves the faces whose multiplier has the wrong sign and adds those that are passed.
    fn polish(&self, mut active: Vec<bool>, lambda: f64, corrections: usize) -> Option<PolyhedronSolution> {
        for _ in 0..corrections {
            let q = self.on_faces(&active, lambda);
            let corrected = self.corrected(&active, &q, lambda);
            if corrected == active {
                let holds = (0..active.len()).all(|i| !self.polyhedron.passed(i, &q));
                return holds.then_some(PolyhedronSolution { q, active });
            }
            active = corrected;
        }
        None
    }

    fn corrected(&self, active: &[bool], q: &DVector<f64>, lambda: f64) -> Vec<bool> {
        let force = self.factor.matrix().tr_mul(&self.factor.image(q)) + &self.gradient + lambda * q;
        let slack = ROUNDING * (self.gradient.norm() + lambda * q.norm());
        let mut corrected: Vec<bool> = (0..active.len()).map(|i| !active[i] && self.polyhedron.passed(i, q)).collect();
        for (i, multiplier) in self.polyhedron.multipliers(active, &force) {
            corrected[i] = multiplier >= -slack;
        }
        corrected
    }

    /// The least-squares solution along the active faces.
    fn on_faces(&self, active: &[bool], lambda: f64) -> DVector<f64> {
        let (corner, along) = self.polyhedron.flat(active);
        let (free, n) = (along.ncols(), self.factor.matrix().nrows());
        if free == 0 {
            return corner;
        }
        // The damping as further rows √λ y = 0: the corner is orthogonal to every direction along the faces.
        let extra = if lambda > 0.0 { free } else { 0 };
        let mut matrix = DMatrix::zeros(n + extra, free);
        matrix.rows_mut(0, n).copy_from(&(self.factor.matrix() * &along));
        matrix.view_mut((n, 0), (extra, extra)).fill_diagonal(lambda.sqrt());
        let constant = (self.factor.image(&corner) + self.factor.constant()).resize_vertically(n + extra, 0.0);
        corner + along * Factor::new(matrix, constant, self.factor.tolerance()).gauss_newton()
    }

    fn near(&self, q: &DVector<f64>) -> Vec<bool> {
        let distance = &self.polyhedron.normals * q - &self.polyhedron.least;
        let size = NEAR * q.amax().max(f64::MIN_POSITIVE);
        distance.iter().map(|&distance| distance <= size).collect()
    }

    /// The part of a step that passes no face; the way back to q = 0 is inside.
    fn shortened(&self, q: DVector<f64>) -> PolyhedronSolution {
        let along = &self.polyhedron.normals * &q;
        let part = along
            .iter()
            .zip(&self.polyhedron.least)
            .filter(|(along, least)| along < least)
            .fold(1.0_f64, |part, (along, least)| part.min((least / along).clamp(0.0, 1.0)));
        let q = q * part;
        let active = (&self.polyhedron.normals * &q).iter().zip(&self.polyhedron.least).map(|(a, l)| a <= l).collect();
        PolyhedronSolution { q, active }
    }
}
