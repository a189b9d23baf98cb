//! Linear least squares in a polyhedron: active-set method with an interior-point method as
//! fallback.

use nalgebra::{DMatrix, DVector};

use super::interior::solve_by_interior_point;
pub(super) use super::polyhedron::PolyhedronSolution;
use super::polyhedron::{Faces, Polyhedron};
use super::reduced::retriangularise;
use super::{AtBound, Factor};
use crate::least_squares::{Linearisation, Triangle};

/// Distance to a face, relative to the size of the step, at which an interior point counts as on
/// the face.
pub(super) const MAX_FACE_DISTANCE: f64 = 1e-6;
/// Maximum number of corrections of all wrong faces at once without progress; each costs one
/// factorisation, the interior-point method more than twenty.
const MAX_JOINT_CORRECTIONS: usize = 10;
/// Maximum number of corrections of one face at a time, after the corrections of all wrong faces at
/// once.
const MAX_SINGLE_CORRECTIONS: usize = 40;
/// Maximum number of corrections that start from the faces near the interior-point solution.
const MAX_INTERIOR_CORRECTIONS: usize = 30;
/// Relative rounding allowed in the optimality conditions.
const MAX_OPTIMALITY_ROUNDING: f64 = 1e-12;

/// Problem min ½‖B q + c‖² + ½λ‖q‖² within a polyhedron, for any λ.
pub(super) struct PolyhedronProblem<'a> {
    factor: &'a Factor,
    gradient: DVector<f64>,
    polyhedron: &'a Polyhedron,
    guess: Faces,
}

impl<'a> PolyhedronProblem<'a> {
    /// Creates the problem; `guess` holds the faces on which the minimiser may lie.
    pub(super) fn new(factor: &'a Factor, polyhedron: &'a Polyhedron, guess: Faces) -> Self {
        Self { factor, gradient: factor.gradient(), polyhedron, guess }
    }

    /// If there is no guess yet, guesses that the active faces are those that the unconstrained
    /// step `unbounded` violates.
    pub(super) fn guess_faces(&mut self, unbounded: &DVector<f64>) {
        if self.guess.is_empty() {
            self.guess = self.corrected_faces(&self.guess, unbounded, 0.0);
        }
    }

    /// Returns the gradient norm ‖Bᵀc‖ at q = 0.
    pub(super) fn gradient_norm(&self) -> f64 {
        self.gradient.norm()
    }

    /// Returns the minimiser for damping λ, exactly on its faces.
    pub(super) fn solve(&mut self, lambda: f64) -> PolyhedronSolution {
        let limits = (MAX_JOINT_CORRECTIONS, MAX_SINGLE_CORRECTIONS);
        let solution = self.active_set(self.guess.clone(), lambda, limits).unwrap_or_else(|| {
            let interior =
                solve_by_interior_point(self.factor, lambda, &self.polyhedron.half_spaces(), None)
                    .map(|(q, _)| q);
            let faces_near = |q: &DVector<f64>| self.polyhedron.faces_near(q, MAX_FACE_DISTANCE);
            let refined = interior.as_ref().and_then(|q| {
                self.active_set(faces_near(q), lambda, (MAX_INTERIOR_CORRECTIONS, 0))
            });
            refined.unwrap_or_else(|| {
                let q = interior.unwrap_or_else(|| DVector::zeros(self.gradient.len()));
                self.polyhedron.pulled_inside(q, 0.0)
            })
        });
        self.guess.clone_from(&solution.faces);
        solution
    }

    /// Solves on a set of faces and corrects the set until the optimality conditions hold; `None`
    /// if the correction limits are reached.
    ///
    /// Each round drops the faces whose multiplier has the wrong sign and adds the violated ones.
    /// It corrects all wrong faces at once while their number falls at least once in `joint`
    /// rounds. That may cycle, so afterwards only the last wrong face is corrected. Single
    /// corrections end, except for rounding, if the problem is strictly convex and its faces are
    /// independent [Murty 1974; Júdice & Pires 1994].
    fn active_set(
        &self,
        mut faces: Faces,
        lambda: f64,
        (joint, single): (usize, usize),
    ) -> Option<PolyhedronSolution> {
        let (mut fewest, mut tries) = (usize::MAX, joint);
        for _ in 0..joint + single {
            let q = self.solve_on_faces(&faces, lambda);
            let corrected = self.corrected_faces(&faces, &q, lambda);
            if corrected == faces {
                let q = self.polyhedron.clamped(q);
                let is_feasible = (0..faces.rows.len()).all(|i| !self.polyhedron.violates(i, &q));
                return is_feasible.then_some(PolyhedronSolution { q, faces });
            }
            let wrong = faces.differences(&corrected);
            if wrong < fewest {
                (fewest, tries) = (wrong, joint);
            }
            if tries > 0 {
                faces = corrected;
            } else {
                faces.adopt_last_difference(&corrected);
            }
            tries = tries.saturating_sub(1);
        }
        None
    }

    /// Returns the faces without those whose multiplier has the wrong sign at `q`, and with those
    /// that q violates.
    fn corrected_faces(&self, faces: &Faces, q: &DVector<f64>, lambda: f64) -> Faces {
        // Multipliers w = Bᵀ(B q + c) + λ q − Gᵀμ must satisfy w ≥ 0 at a lower bound, w ≤ 0 at an
        // upper bound, and μ ≥ 0.
        let force =
            self.factor.matrix().tr_mul(&self.factor.image(q)) + &self.gradient + lambda * q;
        let slack = MAX_OPTIMALITY_ROUNDING * (self.gradient.amax() + lambda * q.amax());
        let (bounds, rows) = self.polyhedron.multipliers(faces, &force);
        let mut corrected = self.polyhedron.retained_faces(faces, &bounds, &rows, slack);
        let Polyhedron { lower, upper, .. } = self.polyhedron;
        let tolerance = MAX_OPTIMALITY_ROUNDING * q.amax();
        for j in 0..q.len() {
            if lower[j] >= upper[j] || (faces.bounds[j].is_none() && q[j] < lower[j] - tolerance) {
                corrected.bounds[j] = Some(AtBound::Lower);
            } else if faces.bounds[j].is_none() && q[j] > upper[j] + tolerance {
                corrected.bounds[j] = Some(AtBound::Upper);
            }
        }
        for i in (0..faces.rows.len()).filter(|&i| !faces.rows[i]) {
            corrected.rows[i] = self.polyhedron.violates(i, q);
        }
        corrected
    }

    /// Returns the minimiser restricted to the given faces.
    fn solve_on_faces(&self, faces: &Faces, lambda: f64) -> DVector<f64> {
        let (mut q, basis) = self.polyhedron.affine_subspace(faces);
        let free = faces.free_unknowns();
        let free_columns = self.factor.matrix().select_columns(&free);
        if basis.as_ref().map_or(free_columns.ncols(), DMatrix::ncols) == 0 {
            return q;
        }
        let constant = self.factor.image(&q) + self.factor.projected();
        let y = match basis {
            Some(basis) => &basis * self.minimiser(free_columns * &basis, constant, lambda),
            None if self.factor.is_well_conditioned() => {
                let (mut triangle, mut projected) = retriangularise(free_columns, constant);
                if lambda > 0.0 {
                    let diagonal = DVector::from_element(projected.len(), lambda.sqrt());
                    Linearisation { triangle, projected, .. } =
                        Triangle::damped(&triangle, &projected, &diagonal);
                }
                back_substitute(&triangle, &projected)
                    .unwrap_or_else(|| self.minimiser(triangle, projected, 0.0))
            }
            None => self.minimiser(free_columns, constant, lambda),
        };
        free.iter().zip(y.iter()).for_each(|(&j, value)| q[j] += value);
        q
    }

    /// Returns the minimiser of ‖A y + c‖² + λ‖y‖² for A = `matrix` and c = `constant`.
    fn minimiser(&self, matrix: DMatrix<f64>, constant: DVector<f64>, lambda: f64) -> DVector<f64> {
        // Damping enters as rows √λ y = 0: the corner is orthogonal to every direction along the
        // faces.
        let (n, count) = matrix.shape();
        let extra = if lambda > 0.0 { count } else { 0 };
        let mut matrix = matrix.resize_vertically(n + extra, 0.0);
        matrix.view_mut((n, 0), (extra, extra)).fill_diagonal(lambda.sqrt());
        Factor::new(matrix, constant.resize_vertically(n + extra, 0.0), self.factor.tolerance())
            .gauss_newton()
    }
}

/// Returns −R⁻¹ c, or `None` if it is not finite.
fn back_substitute(triangle: &DMatrix<f64>, projected: &DVector<f64>) -> Option<DVector<f64>> {
    let y = -triangle.solve_upper_triangular(projected)?;
    y.iter().all(|value| value.is_finite()).then_some(y)
}

#[cfg(test)]
mod tests {
    use super::super::{Bounds, Inequalities};
    use super::*;

    #[test]
    fn interior_point_and_active_set_agree_on_a_badly_scaled_box_and_polyhedron() {
        let n = 8;
        let spread = |j: usize| 10.0_f64.powf(0.75 * j as f64);
        let matrix = DMatrix::from_fn(n, n, |i, j| {
            if i <= j { spread(j) * ((5 * i + 3 * j + 2 * i * j) as f64).cos() } else { 0.0 }
        });
        let constant = DVector::from_fn(n, |i, _| 1.0 + i as f64);
        let factor = Factor::new(matrix, constant, 1e-13);
        let mut lower = DVector::from_fn(n, |j, _| -0.5 / spread(j));
        let upper =
            DVector::from_fn(n, |j, _| if j == 1 { f64::INFINITY } else { 0.25 / spread(j) });
        lower[2] = f64::NEG_INFINITY;
        let bounds = Bounds::new(lower, upper).unwrap();
        let row = DMatrix::from_fn(1, n, |_, j| spread(j));
        let check = |rows: &Inequalities, lambda: f64| {
            let polyhedron = Polyhedron::around(
                &DVector::zeros(n),
                &bounds,
                rows,
                &DVector::from_element(n, 1.0),
            );
            let mut problem =
                PolyhedronProblem::new(&factor, &polyhedron, polyhedron.faces_at_origin.clone());
            let interior =
                solve_by_interior_point(&factor, lambda, &polyhedron.half_spaces(), None)
                    .unwrap()
                    .0;
            let solution = problem.solve(lambda);
            let cost = |q: &DVector<f64>| {
                (factor.image(q) + factor.projected()).norm_squared() + lambda * q.norm_squared()
            };
            assert!((cost(&solution.q) / cost(&interior) - 1.0).abs() < 1e-8, "{lambda}");
            assert!(solution.faces.bounds.iter().any(Option::is_some));
            assert_eq!(
                problem.corrected_faces(&solution.faces, &solution.q, lambda),
                solution.faces
            );
            solution
        };
        for lambda in [0.0, 1e-3, 10.0] {
            let boxed = check(&Inequalities::none(n), lambda);
            // The limit makes the minimiser in the box violate this row.
            let limit = DVector::from_element(1, 0.5 * (&row * &boxed.q)[0].abs());
            let solution = check(&Inequalities::new(row.clone(), -&limit, limit).unwrap(), lambda);
            assert_eq!(solution.faces.rows.iter().filter(|on| **on).count(), 1, "{lambda}");
        }
    }

    #[test]
    fn cycling_faces_are_corrected_one_by_one() {
        let hessian =
            DMatrix::from_row_slice(3, 3, &[4.0, 5.0, -5.0, 5.0, 9.0, -5.0, -5.0, -5.0, 7.0]);
        let lower = hessian.cholesky().unwrap().unpack();
        let constant =
            lower.solve_lower_triangular(&DVector::from_vec(vec![2.0, 1.0, -3.0])).unwrap();
        let factor = Factor::new(lower.transpose(), constant, 1e-13);
        let bounds = Bounds::new(DVector::repeat(3, f64::NEG_INFINITY), DVector::zeros(3)).unwrap();
        let polyhedron = Polyhedron::around(
            &DVector::zeros(3),
            &bounds,
            &Inequalities::none(3),
            &DVector::repeat(3, 1.0),
        );
        let problem =
            PolyhedronProblem::new(&factor, &polyhedron, polyhedron.faces_at_origin.clone());
        let starts = (0..8).map(|set| Faces {
            bounds: (0..3).map(|j| (set >> j & 1 == 1).then_some(AtBound::Upper)).collect(),
            rows: polyhedron.faces_at_origin.rows.clone(),
        });
        let limits = (MAX_JOINT_CORRECTIONS, MAX_SINGLE_CORRECTIONS);
        let mut cycles = 0;
        for faces in starts {
            let joint_only = problem.active_set(faces.clone(), 0.0, (MAX_JOINT_CORRECTIONS, 0));
            cycles += usize::from(joint_only.is_none());
            let solution = problem.active_set(faces, 0.0, limits).unwrap();
            assert_eq!(problem.corrected_faces(&solution.faces, &solution.q, 0.0), solution.faces);
        }
        assert!(cycles > 0);
    }
}
