//! Linear least squares in a polyhedron or box: active-set guess, interior-point solver, polish.

use nalgebra::{DMatrix, DVector};

use super::interior::interior_point;
pub(super) use super::polyhedron::PolyhedronSolution;
use super::polyhedron::{Faces, Polyhedron};
use super::reduced::reduced;
use super::{AtBound, Factor};
use crate::least_squares::{Linearisation, Triangle};

/// Distance to a face, relative to the step's size, below which the interior point is on the face.
pub(super) const NEAR: f64 = 1e-6;
/// Corrections of the active set allowed to a guess, of all faces at once and then of one at a
/// time: each costs a factorisation, the interior point some twenty and more.
const GUESSES: usize = 10;
const ONE_BY_ONE: usize = 40;
/// Corrections allowed to the faces near the interior point.
const CORRECTIONS: usize = 30;
/// Rounding allowed in the optimality conditions.
const ROUNDING: f64 = 1e-12;

/// min ½‖B q + c‖² + ½λ‖q‖² in a polyhedron.
pub(super) struct PolyhedronProblem<'a> {
    factor: &'a Factor,
    gradient: DVector<f64>,
    polyhedron: &'a Polyhedron,
    guess: Faces,
}

impl<'a> PolyhedronProblem<'a> {
    /// `guess`: the faces that the minimiser may lie on.
    pub(super) fn new(factor: &'a Factor, polyhedron: &'a Polyhedron, guess: Faces) -> Self {
        Self { factor, gradient: factor.gradient(), polyhedron, guess }
    }

    /// Guesses what a step without limits leaves, where no face is known.
    pub(super) fn begin_at(&mut self, unbounded: &DVector<f64>) {
        if self.guess.is_empty() {
            self.guess = self.corrected(&self.guess, unbounded, 0.0);
        }
    }

    /// ‖Bᵀc‖.
    pub(super) fn gradient_norm(&self) -> f64 {
        self.gradient.norm()
    }

    /// The minimiser for damping λ, exact on its faces.
    pub(super) fn solve(&mut self, lambda: f64) -> PolyhedronSolution {
        let solution =
            self.polish(self.guess.clone(), lambda, (GUESSES, ONE_BY_ONE)).unwrap_or_else(|| {
                let interior =
                    interior_point(self.factor, lambda, &self.polyhedron.half_spaces(), None)
                        .map(|(q, _)| q);
                let near = |q: &DVector<f64>| self.polyhedron.faces_near(q, NEAR);
                let polished =
                    interior.as_ref().and_then(|q| self.polish(near(q), lambda, (CORRECTIONS, 0)));
                polished.unwrap_or_else(|| {
                    let q = interior.unwrap_or_else(|| DVector::zeros(self.gradient.len()));
                    self.polyhedron.within(q, 0.0)
                })
            });
        self.guess.clone_from(&solution.faces);
        solution
    }

    /// Solves on some faces and corrects the choice until the optimality conditions hold, within so
    /// many rounds.
    ///
    /// Each round leaves the faces whose multiplier has the wrong sign and adds those that are
    /// passed: all of them, as long as in so many rounds `at_once` fewer become wrong, for that may
    /// run in circles; else the last of them alone, which does not, but for rounding, where the
    /// problem is strictly convex and its faces independent [Murty 1974; Júdice & Pires 1994].
    fn polish(
        &self,
        mut faces: Faces,
        lambda: f64,
        (at_once, one_by_one): (usize, usize),
    ) -> Option<PolyhedronSolution> {
        let (mut fewest, mut tries) = (usize::MAX, at_once);
        for _ in 0..at_once + one_by_one {
            let q = self.on_faces(&faces, lambda);
            let corrected = self.corrected(&faces, &q, lambda);
            if corrected == faces {
                let q = self.polyhedron.clamped(q);
                let holds = (0..faces.rows.len()).all(|i| !self.polyhedron.leaves(i, &q));
                return holds.then_some(PolyhedronSolution { q, faces });
            }
            let wrong = faces.differences(&corrected);
            if wrong < fewest {
                (fewest, tries) = (wrong, at_once);
            }
            if tries > 0 {
                faces = corrected;
            } else {
                faces.take_last_of(&corrected);
            }
            tries = tries.saturating_sub(1);
        }
        None
    }

    fn corrected(&self, faces: &Faces, q: &DVector<f64>, lambda: f64) -> Faces {
        // Multipliers w = Bᵀ(B q + c) + λ q − Gᵀμ: w ≥ 0 at a lower bound, w ≤ 0 at an upper one, μ
        // ≥ 0.
        let force =
            self.factor.matrix().tr_mul(&self.factor.image(q)) + &self.gradient + lambda * q;
        let slack = ROUNDING * (self.gradient.amax() + lambda * q.amax());
        let (bounds, rows) = self.polyhedron.multipliers(faces, &force);
        let mut corrected = self.polyhedron.kept(faces, &bounds, &rows, slack);
        let Polyhedron { lower, upper, .. } = self.polyhedron;
        let beyond = ROUNDING * q.amax();
        for j in 0..q.len() {
            if lower[j] >= upper[j] || (faces.bounds[j].is_none() && q[j] < lower[j] - beyond) {
                corrected.bounds[j] = Some(AtBound::Lower);
            } else if faces.bounds[j].is_none() && q[j] > upper[j] + beyond {
                corrected.bounds[j] = Some(AtBound::Upper);
            }
        }
        for i in (0..faces.rows.len()).filter(|&i| !faces.rows[i]) {
            corrected.rows[i] = self.polyhedron.leaves(i, q);
        }
        corrected
    }

    /// The least-squares solution along some faces.
    fn on_faces(&self, faces: &Faces, lambda: f64) -> DVector<f64> {
        let (mut q, along) = self.polyhedron.flat(faces);
        let free = faces.free();
        let open = self.factor.matrix().select_columns(&free);
        if along.as_ref().map_or(open.ncols(), DMatrix::ncols) == 0 {
            return q;
        }
        let constant = self.factor.image(&q) + self.factor.constant();
        let y = match along {
            Some(along) => &along * self.minimiser(open * &along, constant, lambda),
            None if self.factor.is_well_conditioned() => {
                let (mut triangle, mut projected) = reduced(open, constant);
                if lambda > 0.0 {
                    let diagonal = DVector::from_element(projected.len(), lambda.sqrt());
                    Linearisation { triangle, projected, .. } =
                        Triangle::damped(&triangle, &projected, &diagonal);
                }
                solved(&triangle, &projected)
                    .unwrap_or_else(|| self.minimiser(triangle, projected, 0.0))
            }
            None => self.minimiser(open, constant, lambda),
        };
        free.iter().zip(y.iter()).for_each(|(&j, value)| q[j] += value);
        q
    }

    /// The minimiser of ‖A y + c‖² + λ‖y‖².
    fn minimiser(&self, matrix: DMatrix<f64>, constant: DVector<f64>, lambda: f64) -> DVector<f64> {
        // The damping as further rows √λ y = 0: the corner is orthogonal to every direction along
        // the faces.
        let (n, count) = matrix.shape();
        let extra = if lambda > 0.0 { count } else { 0 };
        let mut matrix = matrix.resize_vertically(n + extra, 0.0);
        matrix.view_mut((n, 0), (extra, extra)).fill_diagonal(lambda.sqrt());
        Factor::new(matrix, constant.resize_vertically(n + extra, 0.0), self.factor.tolerance())
            .gauss_newton()
    }
}

/// −R⁻¹ c.
fn solved(triangle: &DMatrix<f64>, projected: &DVector<f64>) -> Option<DVector<f64>> {
    let y = -triangle.solve_upper_triangular(projected)?;
    y.iter().all(|value| value.is_finite()).then_some(y)
}

#[cfg(test)]
mod tests {
    use super::super::{Bounds, Inequalities};
    use super::*;

    #[test]
    fn interior_point_and_polish_agree_on_a_badly_scaled_box_and_polyhedron() {
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
                PolyhedronProblem::new(&factor, &polyhedron, polyhedron.touched.clone());
            let interior =
                interior_point(&factor, lambda, &polyhedron.half_spaces(), None).unwrap().0;
            let solution = problem.solve(lambda);
            let cost = |q: &DVector<f64>| {
                (factor.image(q) + factor.constant()).norm_squared() + lambda * q.norm_squared()
            };
            assert!((cost(&solution.q) / cost(&interior) - 1.0).abs() < 1e-8, "{lambda}");
            assert!(solution.faces.bounds.iter().any(Option::is_some));
            assert_eq!(problem.corrected(&solution.faces, &solution.q, lambda), solution.faces);
            solution
        };
        for lambda in [0.0, 1e-3, 10.0] {
            let boxed = check(&Inequalities::none(n), lambda);
            // A row that the minimiser in the box leaves.
            let limit = DVector::from_element(1, 0.5 * (&row * &boxed.q)[0].abs());
            let solution = check(&Inequalities::new(row.clone(), -&limit, limit).unwrap(), lambda);
            assert_eq!(solution.faces.rows.iter().filter(|on| **on).count(), 1, "{lambda}");
        }
    }

    #[test]
    fn faces_that_run_in_circles_are_corrected_one_by_one() {
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
        let problem = PolyhedronProblem::new(&factor, &polyhedron, polyhedron.touched.clone());
        let begins = (0..8).map(|set| Faces {
            bounds: (0..3).map(|j| (set >> j & 1 == 1).then_some(AtBound::Upper)).collect(),
            rows: polyhedron.touched.rows.clone(),
        });
        let mut circles = 0;
        for faces in begins {
            circles += usize::from(problem.polish(faces.clone(), 0.0, (GUESSES, 0)).is_none());
            let solution = problem.polish(faces, 0.0, (GUESSES, ONE_BY_ONE)).unwrap();
            assert_eq!(problem.corrected(&solution.faces, &solution.q, 0.0), solution.faces);
        }
        assert!(circles > 0);
    }
}
