//! Levenberg–Marquardt within bounds and linear inequalities, with three ways to find the step.

use nalgebra::{DMatrix, DVector};

use super::interior::solve_by_interior_point;
use super::levenberg_marquardt::Model;
use super::polyhedron::{Faces, Polyhedron};
use super::polyhedron_step::{MAX_FACE_DISTANCE, PolyhedronProblem, PolyhedronSolution};
use super::settings::MAX_RADIUS_DEVIATION;
use super::{Bounds, Factor, Inequalities, Settings, Step, Subproblem};
use crate::least_squares::Linearisation;

/// Maximum number of damping values tried for one step when both the radius and bounds limit it.
const MAX_DAMPING_TRIES: usize = 25;

/// Method that finds a step within the constraints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepMethod {
    /// Damped step in the polyhedron of the constraints.
    ///
    /// min ½‖J p + r‖² + ½λ‖D p‖² subject to lo ≤ x + p ≤ hi and lo ≤ A (x + p) ≤ hi
    ///
    /// The solver first tries the unconstrained step, then the step in the polyhedron. Each is
    /// tried without damping if that respects the radius. An active-set method guesses the active
    /// faces and corrects them until the optimality conditions hold. After a constrained step, the
    /// step in the polyhedron is tried first. The problem is never evaluated outside the bounds, or
    /// outside the inequalities beyond rounding. A start outside is moved to the [`nearest`]
    /// feasible point. The solver has converged when the gradient vanishes along all feasible
    /// directions.
    ActiveSet,
    /// Step of the active-set problem, computed by Clarabel's interior-point method, with the
    /// radius ‖D p‖ ≤ Δ as a second-order cone.
    InteriorPoint,
    /// Unconstrained step clamped to the bounds; a baseline for comparisons.
    ///
    /// It may stop at a bound above the minimum, since a clamped step need not lead downhill.
    Clamped,
}

/// Returns the point nearest to `x` that satisfies bounds and inequalities, or `None` if there is
/// none.
pub fn nearest(x: &DVector<f64>, bounds: &Bounds, rows: &Inequalities) -> Option<DVector<f64>> {
    let n = x.len();
    if bounds.lower().len() != n || rows.matrix().ncols() != n {
        return None;
    }
    let mut point = x.clone();
    bounds.clamp(&mut point);
    if rows.contain(&point) {
        return Some(point);
    }
    let factor = Factor::new(DMatrix::identity(n, n), DVector::zeros(n), f64::EPSILON);
    let polyhedron = Polyhedron::around(x, bounds, rows, &DVector::from_element(n, 1.0));
    let solution =
        PolyhedronProblem::new(&factor, &polyhedron, polyhedron.faces_at_origin.clone()).solve(0.0);
    let mut point = x + &solution.q;
    bounds.place_on_bounds(&mut point, &solution.faces.bounds);
    let is_satisfied = |i| rows.at(&point, i).is_some() || rows.holds(&point, i);
    (0..rows.len()).all(is_satisfied).then_some(point)
}

/// Subproblem of a step within a sphere ‖D p‖ ≤ Δ, bounds and inequalities.
#[derive(Debug, Clone)]
pub struct Constrained {
    method: StepMethod,
    bounds: Bounds,
    rows: Inequalities,
    model: Option<Model>,
    /// Active faces of the last solution from the same x, guessed to be active in the next.
    guess: Option<Faces>,
    /// Constrained step from x without damping, once it was computed.
    undamped: Option<PolyhedronSolution>,
    /// True if constraints changed the last step.
    is_limited: bool,
}

impl Constrained {
    /// Returns the constrained step without damping; `None` if no constraint or the radius limits
    /// it.
    fn undamped_step(&mut self, x: &DVector<f64>, radius: f64) -> Option<Step> {
        let model = self.model.as_ref()?;
        let undamped = self.undamped.get_or_insert_with(|| {
            let polyhedron = Polyhedron::around(x, &self.bounds, &self.rows, &model.scale);
            PolyhedronProblem::new(&model.factor, &polyhedron, polyhedron.faces_at_origin.clone())
                .solve(0.0)
        });
        let is_within_radius = !undamped.faces.is_empty()
            && undamped.q.norm() <= (1.0 + MAX_RADIUS_DEVIATION) * radius;
        let solution = is_within_radius.then(|| undamped.clone())?;
        Some(self.step_from(x, solution, 0.0))
    }

    /// Returns the step of a solution, placed exactly on its active bounds, and stores its faces as
    /// the next guess.
    fn step_from(
        &mut self,
        x: &DVector<f64>,
        PolyhedronSolution { q, faces }: PolyhedronSolution,
        damping: f64,
    ) -> Step {
        let Some(model) = &self.model else { return Step::none(x) };
        let mut point = x + q.component_div(&model.scale);
        self.bounds.place_on_bounds(&mut point, &faces.bounds);
        self.guess = Some(faces);
        let slope = -model.factor.gradient().dot(&q);
        let predicted = slope - 0.5 * model.factor.image(&q).norm_squared();
        Step { point, length: q.norm(), slope, predicted, damping }
    }

    /// Creates the subproblem of a method with bounds and linear inequalities `rows`.
    pub fn new(method: StepMethod, bounds: Bounds, rows: Inequalities) -> Self {
        Self { method, bounds, rows, model: None, guess: None, undamped: None, is_limited: false }
    }
}

impl Subproblem for Constrained {
    fn name(&self) -> &'static str {
        match self.method {
            StepMethod::ActiveSet => "bounded Levenberg–Marquardt",
            StepMethod::InteriorPoint => "interior-point Levenberg–Marquardt",
            StepMethod::Clamped => "clamped Levenberg–Marquardt",
        }
    }

    fn admit_start(&self, start: &mut DVector<f64>) -> bool {
        let Some(admitted) = nearest(start, &self.bounds, &self.rows) else { return false };
        *start = admitted;
        true
    }

    fn prepare(
        &mut self,
        _x: &DVector<f64>,
        linearisation: &Linearisation,
        scale: &DVector<f64>,
        settings: &Settings,
    ) {
        self.model = Some(Model::new(linearisation, scale, settings));
        (self.guess, self.undamped) = (None, None);
    }

    fn free_gradient(&self, x: &DVector<f64>, j: usize, gradient: f64) -> f64 {
        let is_at_lower = gradient > 0.0 && x[j] <= self.bounds.lower()[j];
        let is_at_upper = gradient < 0.0 && x[j] >= self.bounds.upper()[j];
        if is_at_lower || is_at_upper { 0.0 } else { gradient }
    }

    fn project_gradient(
        &self,
        x: &DVector<f64>,
        scale: &DVector<f64>,
        gradient: &mut DVector<f64>,
    ) {
        if (0..self.rows.len()).any(|i| self.rows.at(x, i).is_some()) {
            *gradient =
                Polyhedron::around(x, &self.bounds, &self.rows, scale).projected_gradient(gradient);
        } else {
            (0..x.len()).for_each(|j| gradient[j] = self.free_gradient(x, j, gradient[j]));
        }
    }

    fn is_feasible(&self, x: &DVector<f64>) -> bool {
        self.bounds.contain(x) && self.rows.contain(x)
    }

    fn is_step_constrained(&self) -> bool {
        self.is_limited && self.method != StepMethod::Clamped
    }

    fn active_normals(
        &self,
        x: &DVector<f64>,
        scale: &DVector<f64>,
        gradient: &DVector<f64>,
    ) -> DMatrix<f64> {
        let polyhedron = Polyhedron::around(x, &self.bounds, &self.rows, scale);
        polyhedron.normals_of(&polyhedron.active_faces(gradient).0)
    }

    fn accelerated(
        &mut self,
        x: &DVector<f64>,
        acceleration: &DVector<f64>,
        damping: f64,
    ) -> Option<DVector<f64>> {
        let model = self.model.as_ref()?;
        let factor = model.with_acceleration(acceleration)?;
        let polyhedron = Polyhedron::around(x, &self.bounds, &self.rows, &model.scale);
        let PolyhedronSolution { q, faces } = match self.method {
            StepMethod::ActiveSet => {
                let guess =
                    self.guess.clone().unwrap_or_else(|| polyhedron.faces_at_origin.clone());
                PolyhedronProblem::new(&factor, &polyhedron, guess).solve(damping)
            }
            StepMethod::InteriorPoint => {
                let (q, _) =
                    solve_by_interior_point(&factor, damping, &polyhedron.half_spaces(), None)?;
                polyhedron.pulled_inside(q, MAX_FACE_DISTANCE)
            }
            StepMethod::Clamped => return None,
        };
        let mut point = x + q.component_div(&model.scale);
        self.bounds.place_on_bounds(&mut point, &faces.bounds);
        Some(point)
    }

    fn step(&mut self, x: &DVector<f64>, radius: f64) -> Step {
        if self.is_limited && self.method == StepMethod::ActiveSet {
            // Constraints that changed the last step usually change this one, too.
            if let Some(step) = self.undamped_step(x, radius) {
                return step;
            }
        }
        let Some(model) = &mut self.model else { return Step::none(x) };
        let step = model.unbounded_step(x, radius);
        let is_feasible = self.bounds.contain(&step.point) && self.rows.contain(&step.point);
        self.is_limited = !is_feasible;
        if is_feasible && self.method != StepMethod::InteriorPoint {
            return step;
        }
        let polyhedron = Polyhedron::around(x, &self.bounds, &self.rows, &model.scale);
        let (solution, damping) = match self.method {
            StepMethod::ActiveSet => {
                let faces = self
                    .undamped
                    .as_ref()
                    .map_or(&polyhedron.faces_at_origin, |undamped| &undamped.faces);
                let mut problem = PolyhedronProblem::new(&model.factor, &polyhedron, faces.clone());
                problem.guess_faces(&(&step.point - x).component_mul(&model.scale));
                let (gradient_norm, undamped) = (problem.gradient_norm(), &mut self.undamped);
                let solve = |lambda| match lambda {
                    0.0 => undamped.get_or_insert_with(|| problem.solve(0.0)).clone(),
                    _ => problem.solve(lambda),
                };
                step_within_radius(solve, step.damping, gradient_norm, radius)
            }
            StepMethod::InteriorPoint => {
                let solution = solve_by_interior_point(
                    &model.factor,
                    0.0,
                    &polyhedron.half_spaces(),
                    Some(radius),
                );
                let (q, damping) = solution.unwrap_or_else(|| (DVector::zeros(x.len()), 0.0));
                (polyhedron.pulled_inside(q, MAX_FACE_DISTANCE), damping)
            }
            StepMethod::Clamped => {
                let q = (step.point - x).component_mul(&model.scale);
                (polyhedron.pulled_inside(q, 0.0), step.damping)
            }
        };
        self.step_from(x, solution, damping)
    }
}

/// Returns the constrained step with ‖q‖ ≤ Δ to within 10 %, and its damping λ.
///
/// `solve` returns the constrained step for any λ, `gradient_norm` is ‖Bᵀc‖ and `first` the λ of
/// the unconstrained step, 0 if it was not damped. ‖q(λ)‖ falls with λ and is at most ‖Bᵀc‖/λ
/// (compare q with 0), which brackets λ. Within the bracket, Hebden's model ‖q(λ)‖ ≈ a/(b + λ) is
/// fitted to the last two values.
fn step_within_radius(
    mut solve: impl FnMut(f64) -> PolyhedronSolution,
    first: f64,
    gradient_norm: f64,
    radius: f64,
) -> (PolyhedronSolution, f64) {
    let is_short = |length: f64| length <= (1.0 + MAX_RADIUS_DEVIATION) * radius;
    let fills_radius =
        |length: f64| is_short(length) && length >= (1.0 - MAX_RADIUS_DEVIATION) * radius;
    let mut first_solution = (first > 0.0).then(|| solve(first));
    if let Some(solution) = first_solution.take_if(|solution| fills_radius(solution.q.norm())) {
        return (solution, first);
    }
    let undamped = solve(0.0);
    let mut length = undamped.q.norm();
    if is_short(length) {
        return (undamped, 0.0);
    }
    let (mut low, mut high) = (0.0, gradient_norm / radius);
    let mut last = (0.0, length);
    let mut lambda = if first_solution.is_some() { first } else { 1e-3 * high };
    let mut best = None;
    for _ in 0..MAX_DAMPING_TRIES {
        let solution = first_solution.take().unwrap_or_else(|| solve(lambda));
        length = solution.q.norm();
        if is_short(length) {
            high = lambda;
            best = Some((solution, lambda));
            if fills_radius(length) {
                break;
            }
        } else {
            low = lambda;
        }
        let shift = (last.0 * last.1 - lambda * length) / (length - last.1);
        let model = length * (lambda + shift) / radius - shift;
        last = (lambda, length);
        let is_bracketed = model > low && model < high;
        lambda = if is_bracketed { model } else { (low.max(1e-3 * high) * high).sqrt() };
    }
    best.unwrap_or_else(|| (solve(high), high))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the solution of one coordinate q = g / (b + λ).
    fn hebden(gradient: f64, curvature: f64, lambda: f64) -> PolyhedronSolution {
        let q = DVector::from_element(1, gradient / (curvature + lambda));
        PolyhedronSolution { q, faces: Faces { bounds: vec![None], rows: Vec::new() } }
    }

    #[test]
    fn the_damping_is_found_by_the_model_of_two_steps() {
        // ‖q(λ)‖ = 6 / (2 + λ) is its own model: the second damped step has the radius exactly.
        for (first, radius) in [(0.0, 1.0), (0.0, 0.02), (5.0, 0.02), (900.0, 0.02), (0.1, 1.5)] {
            let mut solved = Vec::new();
            let solve = |lambda| {
                solved.push(lambda);
                hebden(6.0, 2.0, lambda)
            };
            let (solution, lambda) = step_within_radius(solve, first, 6.0, radius);
            let expected = 6.0 / radius - 2.0;
            assert!((lambda / expected - 1.0).abs() < 1e-9, "{first} {radius}: {lambda}");
            assert!((solution.q[0] / radius - 1.0).abs() < 1e-9);
            assert_eq!(solved.len(), 3, "{solved:?}");
        }
    }

    #[test]
    fn steps_shorter_than_the_radius_are_not_damped() {
        let solve = |lambda| hebden(6.0, 2.0, lambda);
        assert!(step_within_radius(solve, 0.0, 6.0, 2.8).1.abs() < 1e-300);
        assert!(step_within_radius(solve, 7.0, 6.0, 3.5).1.abs() < 1e-300);
        // The damping of the unconstrained step is kept if its step has the radius to within 10 %.
        let (solution, lambda) = step_within_radius(solve, 4.0, 6.0, 1.08);
        assert!((lambda - 4.0).abs() < 1e-300 && (solution.q[0] - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_damping_is_bracketed_where_the_model_fails() {
        // A length that falls in a jump, as where a face becomes active.
        let jump = |lambda: f64| if lambda < 3.0 { 4.0 } else { 6.0 / (2.0 + lambda) };
        let solve = |lambda| PolyhedronSolution {
            q: DVector::from_element(1, jump(lambda)),
            faces: Faces { bounds: vec![None], rows: Vec::new() },
        };
        for radius in [0.1, 0.9, 1.05] {
            let (solution, _) = step_within_radius(solve, 0.0, 8.0, radius);
            assert!((solution.q[0] / radius - 1.0).abs() < MAX_RADIUS_DEVIATION, "{radius}");
        }
        // No damping has this radius; the step is shorter.
        let (solution, lambda) = step_within_radius(solve, 0.0, 8.0, 2.0);
        assert!(solution.q[0] <= 2.0 && lambda >= 3.0);
    }
}
