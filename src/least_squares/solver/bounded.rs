//! Bounded Levenberg–Marquardt: every step is a linear least-squares problem in a box, or in a
//! polyhedron; three ways to solve it.

use nalgebra::{DMatrix, DVector};

use super::interior::interior_point;
use super::levenberg_marquardt::Model;
use super::polyhedron::{Faces, Polyhedron};
use super::polyhedron_step::{NEAR, PolyhedronProblem, PolyhedronSolution};
use super::settings::RADIUS_SLACK;
use super::{Bounds, Factor, Inequalities, Settings, Step, Subproblem, TrustRegion};
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
/// The unconstrained step is tried first, then the one in the polyhedron (a box without
/// inequalities), each without damping if that respects the radius: on a guess of the faces that
/// hold, corrected until the optimality conditions do. After a step that limits held back the one
/// in the polyhedron is tried first. The problem is never evaluated outside (inequalities: beyond
/// rounding); a start outside is moved to the [`nearest`] point within. Converged when the gradient
/// vanishes along all directions that bounds and inequalities leave open.
pub fn constrained_levenberg_marquardt(
    bounds: Bounds,
    rows: Inequalities,
    settings: Settings,
) -> TrustRegion<Constrained> {
    Constrained::solver(Steps::ActiveSet, bounds, rows, settings)
}

/// The same with every step that leaves the polyhedron by Clarabel's interior-point method, ‖D p‖ ≤
/// Δ as a second-order cone.
pub fn interior_point_levenberg_marquardt(
    bounds: Bounds,
    rows: Inequalities,
    settings: Settings,
) -> TrustRegion<Constrained> {
    Constrained::solver(Steps::InteriorPoint, bounds, rows, settings)
}

/// Levenberg–Marquardt whose unbounded steps are moved to the nearest point within the bounds: what
/// one would write first.
///
/// It may stop where a bound keeps it from a lower cost: a clamped step need not lead downhill.
pub fn clamped_levenberg_marquardt(bounds: Bounds, settings: Settings) -> TrustRegion<Constrained> {
    let rows = Inequalities::none(bounds.lower().len());
    Constrained::solver(Steps::Clamped, bounds, rows, settings)
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
    let solution =
        PolyhedronProblem::new(&factor, &polyhedron, polyhedron.touched.clone()).solve(0.0);
    let mut point = x + &solution.q;
    bounds.hold(&mut point, &solution.faces.bounds);
    let kept = |i| rows.at(&point, i).is_some() || rows.holds(&point, i);
    (0..rows.len()).all(kept).then_some(point)
}

/// How a step within bounds is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Steps {
    ActiveSet,
    InteriorPoint,
    Clamped,
}

/// The step within a sphere ‖D p‖ ≤ Δ, a box and inequalities.
#[derive(Debug, Clone)]
pub struct Constrained {
    steps: Steps,
    bounds: Bounds,
    rows: Inequalities,
    model: Option<Model>,
    /// Faces that held in the last problem from the same x.
    guess: Option<Faces>,
    /// The step from x that only limits hold back, once it was asked for.
    undamped: Option<PolyhedronSolution>,
    /// Whether the last step was held back.
    confined: bool,
}

impl Constrained {
    /// The step that limits alone hold back, if some do and the radius does not.
    fn undamped_step(&mut self, x: &DVector<f64>, radius: f64) -> Option<Step> {
        let model = self.model.as_ref()?;
        let undamped = self.undamped.get_or_insert_with(|| {
            let polyhedron = Polyhedron::around(x, &self.bounds, &self.rows, &model.scale);
            PolyhedronProblem::new(&model.factor, &polyhedron, polyhedron.touched.clone())
                .solve(0.0)
        });
        let alone =
            !undamped.faces.is_empty() && undamped.q.norm() <= (1.0 + RADIUS_SLACK) * radius;
        let solution = alone.then(|| undamped.clone())?;
        Some(self.along(x, solution, 0.0))
    }

    /// The step of a solution, exactly on the bounds that hold; the next problem from the same x
    /// begins with its faces.
    fn along(
        &mut self,
        x: &DVector<f64>,
        PolyhedronSolution { q, faces }: PolyhedronSolution,
        damping: f64,
    ) -> Step {
        let Some(model) = &self.model else { return Step::none(x) };
        let mut point = x + q.component_div(&model.scale);
        self.bounds.hold(&mut point, &faces.bounds);
        self.guess = Some(faces);
        let slope = -model.factor.gradient().dot(&q);
        let predicted = slope - 0.5 * model.factor.image(&q).norm_squared();
        Step { point, length: q.norm(), slope, predicted, damping }
    }

    fn solver(
        steps: Steps,
        bounds: Bounds,
        rows: Inequalities,
        settings: Settings,
    ) -> TrustRegion<Self> {
        TrustRegion::new(
            Self { steps, bounds, rows, model: None, guess: None, undamped: None, confined: false },
            settings,
        )
    }
}

impl Subproblem for Constrained {
    fn name(&self) -> &'static str {
        match self.steps {
            Steps::ActiveSet => "bounded Levenberg–Marquardt",
            Steps::InteriorPoint => "interior-point Levenberg–Marquardt",
            Steps::Clamped => "clamped Levenberg–Marquardt",
        }
    }

    fn admit(&self, start: &mut DVector<f64>) -> bool {
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

    fn admits(&self, x: &DVector<f64>) -> bool {
        self.bounds.contain(x) && self.rows.contain(x)
    }

    fn is_confined(&self) -> bool {
        self.confined && self.steps != Steps::Clamped
    }

    fn pressed(
        &self,
        x: &DVector<f64>,
        scale: &DVector<f64>,
        gradient: &DVector<f64>,
    ) -> DMatrix<f64> {
        let polyhedron = Polyhedron::around(x, &self.bounds, &self.rows, scale);
        polyhedron.normals_of(&polyhedron.pressed(gradient).0)
    }

    fn bent(
        &mut self,
        x: &DVector<f64>,
        bend: &DVector<f64>,
        damping: f64,
    ) -> Option<DVector<f64>> {
        let model = self.model.as_ref()?;
        let factor = model.bent(bend)?;
        let polyhedron = Polyhedron::around(x, &self.bounds, &self.rows, &model.scale);
        let PolyhedronSolution { q, faces } = match self.steps {
            Steps::ActiveSet => {
                let guess = self.guess.clone().unwrap_or_else(|| polyhedron.touched.clone());
                PolyhedronProblem::new(&factor, &polyhedron, guess).solve(damping)
            }
            Steps::InteriorPoint => {
                let (q, _) = interior_point(&factor, damping, &polyhedron.half_spaces(), None)?;
                polyhedron.within(q, NEAR)
            }
            Steps::Clamped => return None,
        };
        let mut point = x + q.component_div(&model.scale);
        self.bounds.hold(&mut point, &faces.bounds);
        Some(point)
    }

    fn step(&mut self, x: &DVector<f64>, radius: f64) -> Step {
        if self.confined && self.steps == Steps::ActiveSet {
            // Limits that held the last step back hold this one back too, most often.
            if let Some(step) = self.undamped_step(x, radius) {
                return step;
            }
        }
        let Some(model) = &mut self.model else { return Step::none(x) };
        let step = model.unbounded_step(x, radius);
        let inside = self.bounds.contain(&step.point) && self.rows.contain(&step.point);
        self.confined = !inside;
        if inside && self.steps != Steps::InteriorPoint {
            return step;
        }
        let polyhedron = Polyhedron::around(x, &self.bounds, &self.rows, &model.scale);
        let (solution, damping) = match self.steps {
            Steps::ActiveSet => {
                let known =
                    self.undamped.as_ref().map_or(&polyhedron.touched, |undamped| &undamped.faces);
                let mut problem = PolyhedronProblem::new(&model.factor, &polyhedron, known.clone());
                problem.begin_at(&(&step.point - x).component_mul(&model.scale));
                let (size, undamped) = (problem.gradient_norm(), &mut self.undamped);
                let solve = |lambda| match lambda {
                    0.0 => undamped.get_or_insert_with(|| problem.solve(0.0)).clone(),
                    _ => problem.solve(lambda),
                };
                limited(solve, step.damping, size, radius)
            }
            Steps::InteriorPoint => {
                let found =
                    interior_point(&model.factor, 0.0, &polyhedron.half_spaces(), Some(radius));
                let (q, damping) = found.unwrap_or_else(|| (DVector::zeros(x.len()), 0.0));
                (polyhedron.within(q, NEAR), damping)
            }
            Steps::Clamped => {
                let q = (step.point - x).component_mul(&model.scale);
                (polyhedron.within(q, 0.0), step.damping)
            }
        };
        self.along(x, solution, damping)
    }
}

/// The constrained step with ‖q‖ ≤ Δ to within 10 %, and its damping λ; `solve` gives it for any λ,
/// `size` is ‖Bᵀc‖, `first` is the λ > 0 that it would need without constraints.
///
/// ‖q(λ)‖ falls with λ and is at most ‖Bᵀc‖/λ (compare q with staying put), which brackets λ;
/// within the bracket Hebden's model ‖q(λ)‖ ≈ a/(b + λ) is fitted to the last two values.
fn limited(
    mut solve: impl FnMut(f64) -> PolyhedronSolution,
    first: f64,
    size: f64,
    radius: f64,
) -> (PolyhedronSolution, f64) {
    let is_short = |length: f64| length <= (1.0 + RADIUS_SLACK) * radius;
    let fills = |length: f64| is_short(length) && length >= (1.0 - RADIUS_SLACK) * radius;
    let mut known = (first > 0.0).then(|| solve(first));
    if let Some(solution) = known.take_if(|solution| fills(solution.q.norm())) {
        return (solution, first);
    }
    let undamped = solve(0.0);
    let mut length = undamped.q.norm();
    if is_short(length) {
        return (undamped, 0.0);
    }
    let (mut low, mut high) = (0.0, size / radius);
    let mut last = (0.0, length);
    let mut lambda = if known.is_some() { first } else { 1e-3 * high };
    let mut best = None;
    for _ in 0..DAMPINGS {
        let solution = known.take().unwrap_or_else(|| solve(lambda));
        length = solution.q.norm();
        if is_short(length) {
            high = lambda;
            best = Some((solution, lambda));
            if fills(length) {
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
