//! Linear least squares in a polyhedron: active-set guess, interior-point solver, polish.

use nalgebra::{DMatrix, DVector};

use super::interior::interior_point;
use super::polyhedron::{Face, Polyhedron, chosen};
use super::{AtBound, Factor};

/// Distance to a face, relative to the step's size, below which the interior point is on the face.
const NEAR: f64 = 1e-6;
/// Corrections of the active set allowed to a polish.
const CORRECTIONS: usize = 30;
/// Rounding allowed in the signs of the multipliers.
const ROUNDING: f64 = 1e-12;

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
