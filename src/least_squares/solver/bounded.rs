//! Bounded Levenberg–Marquardt: every step is a linear least-squares problem in a box, or in a polyhedron.

use nalgebra::{DMatrix, DVector};

use super::box_step::BoxProblem;
use super::levenberg_marquardt::Model;
use super::polyhedron::Polyhedron;
use super::polyhedron_step::PolyhedronProblem;
use super::settings::RADIUS_SLACK;
use super::{AtBound, Bounds, Factor, Inequalities, Settings, Step, Subproblem, TrustRegion};
use crate::least_squares::Linearisation;

/// Damped problems tried for one step when the radius limits a step along bounds.
const DAMPINGS: usize = 25;

/// Levenberg–Marquardt within bounds lo ≤ x ≤ hi.
///
/// As [`constrained_levenberg_marquardt`] without inequalities.
pub fn bounded_levenberg_marquardt(bounds: Bounds, settings: Settings) -> TrustRegion<Constrained> {
    let rows = Inequalities::none(bounds.lower().len());
    constrained_levenberg_marquardt(bounds, rows, settings)
}

/// Levenberg–Marquardt within bounds lo ≤ x ≤ hi and inequalities lo ≤ A x ≤ hi.
///
/// min ½‖J p + r‖² + ½λ‖D p‖² subject to the bounds and inequalities on x + p
///
/// The unconstrained step is tried first, then the one in the box, and only then the one in the whole polyhedron, each
/// without damping if that respects the radius. The problem is never evaluated outside (inequalities: beyond rounding);
/// a start outside is moved to the [`nearest`] point within. Converged when the gradient vanishes along all directions that
/// bounds and inequalities leave open.
pub fn constrained_levenberg_marquardt(
    bounds: Bounds,
    rows: Inequalities,
    settings: Settings,
) -> TrustRegion<Constrained> {
    TrustRegion::new(Constrained { bounds, rows, model: None, guess: Vec::new() }, settings)
}

/// The point nearest to `x` that keeps bounds and inequalities, if there is one.
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
    let mut problem = PolyhedronProblem::new(&factor, &polyhedron);
    let solution = problem.solve(0.0);
    let mut point = x + &solution.q;
    bounds.hold(&mut point, &problem.bounds_of(&solution));
    let kept = |i| rows.at(&point, i).is_some() || rows.holds(&point, i);
    (0..rows.len()).all(kept).then_some(point)
}

/// The step within a sphere ‖D p‖ ≤ Δ, a box and inequalities.
#[derive(Debug, Clone)]
pub struct Constrained {
    bounds: Bounds,
    rows: Inequalities,
    model: Option<Model>,
    /// Bounds that held in the last boxed problem.
    guess: Vec<Option<AtBound>>,
}

impl Subproblem for Constrained {
    fn name(&self) -> &'static str {
        "bounded Levenberg–Marquardt"
    }

    fn admit(&self, start: &mut DVector<f64>) -> bool {
        let Some(admitted) = nearest(start, &self.bounds, &self.rows) else { return false };
        *start = admitted;
        true
    }

    fn prepare(&mut self, x: &DVector<f64>, linearisation: &Linearisation, scale: &DVector<f64>, settings: &Settings) {
        self.model = Some(Model::new(linearisation, scale, settings));
        self.guess = (0..x.len()).map(|j| self.bounds.at(x, j)).collect();
    }

    fn free_gradient(&self, x: &DVector<f64>, j: usize, gradient: f64) -> f64 {
        let down = gradient > 0.0 && x[j] <= self.bounds.lower()[j];
        let up = gradient < 0.0 && x[j] >= self.bounds.upper()[j];
        if down || up { 0.0 } else { gradient }
    }

    fn hold_back(&self, x: &DVector<f64>, scale: &DVector<f64>, gradient: &mut DVector<f64>) {
        if (0..self.rows.len()).any(|i| self.rows.at(x, i).is_some()) {
            *gradient = Polyhedron::around(x, &self.bounds, &self.rows, scale).free_part(gradient);
        } else {
            (0..x.len()).for_each(|j| gradient[j] = self.free_gradient(x, j, gradient[j]));
        }
    }

    fn step(&mut self, x: &DVector<f64>, radius: f64) -> Step {
        let Some(model) = &mut self.model else { return Step::none(x) };
        let mut step = model.unbounded_step(x, radius);
        if !self.bounds.contain(&step.point) {
            let scale = &model.scale;
            let lower = (self.bounds.lower() - x).component_mul(scale);
            let upper = (self.bounds.upper() - x).component_mul(scale);
            let mut problem = BoxProblem::new(&model.factor, lower, upper, self.guess.clone());
            let size = problem.gradient_norm();
            let (solution, damping) = limited(|lambda| problem.solve(lambda), |found| found.q.norm(), size, radius);
            step = finish(x, &self.bounds, model, &solution.q, &solution.active, damping);
            self.guess = solution.active;
        }
        if self.rows.contain(&step.point) {
            return step;
        }
        let polyhedron = Polyhedron::around(x, &self.bounds, &self.rows, &model.scale);
        let mut problem = PolyhedronProblem::new(&model.factor, &polyhedron);
        let size = problem.gradient_norm();
        let (solution, damping) = limited(|lambda| problem.solve(lambda), |found| found.q.norm(), size, radius);
        finish(x, &self.bounds, model, &solution.q, &problem.bounds_of(&solution), damping)
    }
}

/// x + D⁻¹ q, exactly on the bounds that hold.
fn finish(
    x: &DVector<f64>,
    bounds: &Bounds,
    model: &Model,
    q: &DVector<f64>,
    active: &[Option<AtBound>],
    damping: f64,
) -> Step {
    let mut point = x + q.component_div(&model.scale);
    bounds.hold(&mut point, active);
    let slope = -model.factor.gradient().dot(q);
    let predicted = slope - 0.5 * model.factor.image(q).norm_squared();
    Step { point, length: q.norm(), slope, predicted, damping }
}

/// The constrained step with ‖q‖ ≤ Δ to within 10 %, and its damping λ; `solve` gives it for any λ, `size` is ‖Bᵀc‖.
///
/// ‖q(λ)‖ falls with λ and is at most ‖Bᵀc‖/λ (compare q with staying put), which brackets λ; within the bracket
/// Hebden's model ‖q(λ)‖ ≈ a/(b + λ) is fitted to the last two values.
fn limited<Q>(mut solve: impl FnMut(f64) -> Q, norm: impl Fn(&Q) -> f64, size: f64, radius: f64) -> (Q, f64) {
    let mut solution = solve(0.0);
    let mut length = norm(&solution);
    if length <= (1.0 + RADIUS_SLACK) * radius {
        return (solution, 0.0);
    }
    let (mut low, mut high) = (0.0, size / radius);
    let mut last = (0.0, length);
    let mut lambda = 1e-3 * high;
    let mut best = None;
    for _ in 0..DAMPINGS {
        solution = solve(lambda);
        length = norm(&solution);
        let short = length <= (1.0 + RADIUS_SLACK) * radius;
        if short {
            high = lambda;
            best = Some((solution, lambda));
            if length >= (1.0 - RADIUS_SLACK) * radius {
                break;
            }
        } else {
            low = lambda;
        }
        let shift = (last.0 * last.1 - lambda * length) / (length - last.1);
        let model = length * (lambda + shift) / radius - shift;
        last = (lambda, length);
        let inside = model > low && model < high;
        lambda = if inside { model } else { (low.max(1e-3 * high) * high).sqrt() };
    }
    best.unwrap_or_else(|| (solve(high), high))
}
