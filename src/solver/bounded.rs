//! Bounded Levenberg–Marquardt: every step is a box-constrained linear least-squares problem.

use nalgebra::DVector;

use super::box_step::{BoxProblem, BoxSolution};
use super::factor::RADIUS_SLACK;
use super::levenberg_marquardt::Model;
use super::{Settings, Step, Subproblem, TrustRegion};
use crate::fit::Linearisation;

/// Damped problems tried for one step when the radius limits a step along bounds.
const DAMPINGS: usize = 25;

/// A bound that holds an unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AtBound {
    /// x equals its lower bound.
    Lower,
    /// x equals its upper bound.
    Upper,
}

/// Bounds lo ≤ x ≤ hi; infinite where there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    lower: DVector<f64>,
    upper: DVector<f64>,
}

/// Bounds that no x can satisfy.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BoundsError {
    /// The two vectors differ in length.
    #[error("setting bounds: {lower} lower bounds, but {upper} upper bounds")]
    Sizes {
        /// Number of lower bounds.
        lower: usize,
        /// Number of upper bounds.
        upper: usize,
    },
    /// Not lo ≤ hi (or not a number, or an infinity on the wrong side).
    #[error("setting bounds: unknown {index} has no value between {lower} and {upper}")]
    Empty {
        /// Which unknown.
        index: usize,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
}

impl Bounds {
    /// Bounds lo ≤ x ≤ hi; lo = hi holds an unknown fixed.
    ///
    /// # Errors
    /// When the lengths differ or some unknown is left without a value.
    pub fn new(lower: DVector<f64>, upper: DVector<f64>) -> Result<Self, BoundsError> {
        if lower.len() != upper.len() {
            return Err(BoundsError::Sizes { lower: lower.len(), upper: upper.len() });
        }
        for (index, (&lower, &upper)) in lower.iter().zip(&upper).enumerate() {
            if !(lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY) {
                return Err(BoundsError::Empty { index, lower, upper });
            }
        }
        Ok(Self { lower, upper })
    }

    /// No bounds on any of `n` unknowns.
    pub fn none(n: usize) -> Self {
        Self { lower: DVector::from_element(n, f64::NEG_INFINITY), upper: DVector::from_element(n, f64::INFINITY) }
    }

    /// lo.
    pub fn lower(&self) -> &DVector<f64> {
        &self.lower
    }

    /// hi.
    pub fn upper(&self) -> &DVector<f64> {
        &self.upper
    }

    /// The bound that `x[j]` equals, if any.
    pub fn at(&self, x: &DVector<f64>, j: usize) -> Option<AtBound> {
        if x[j] <= self.lower[j] {
            Some(AtBound::Lower)
        } else if x[j] >= self.upper[j] {
            Some(AtBound::Upper)
        } else {
            None
        }
    }

    /// The nearest point within the bounds.
    pub fn clamp(&self, x: &mut DVector<f64>) {
        for (j, x) in x.iter_mut().enumerate() {
            *x = x.clamp(self.lower[j], self.upper[j]);
        }
    }

    fn contain(&self, x: &DVector<f64>) -> bool {
        (0..x.len()).all(|j| self.lower[j] <= x[j] && x[j] <= self.upper[j])
    }
}

/// Levenberg–Marquardt within bounds lo ≤ x ≤ hi.
///
/// min ½‖J p + r‖² + ½λ‖D p‖² subject to lo − x ≤ p ≤ hi − x
///
/// The unconstrained step is tried first; only if it leaves the box is the boxed problem solved, without damping if
/// that respects the radius. The problem is never evaluated outside the bounds; a start outside is moved to the nearest
/// point within. Converged when the gradient vanishes along all directions that the bounds leave open.
pub fn bounded_levenberg_marquardt(bounds: Bounds, settings: Settings) -> TrustRegion<BoxConstrained> {
    TrustRegion::new(BoxConstrained { bounds, model: None, guess: Vec::new() }, settings)
}

/// The step within a sphere ‖D p‖ ≤ Δ and a box.
#[derive(Debug, Clone)]
pub struct BoxConstrained {
    bounds: Bounds,
    model: Option<Model>,
    /// Bounds that held in the last boxed problem.
    guess: Vec<Option<AtBound>>,
}

impl Subproblem for BoxConstrained {
    fn name(&self) -> &'static str {
        "bounded Levenberg–Marquardt"
    }

    fn admit(&self, start: &mut DVector<f64>) -> bool {
        let fits = self.bounds.lower.len() == start.len();
        if fits {
            self.bounds.clamp(start);
        }
        fits
    }

    fn prepare(&mut self, x: &DVector<f64>, linearisation: &Linearisation, scale: &DVector<f64>, settings: &Settings) {
        self.model = Some(Model::new(linearisation, scale, settings));
        self.guess = (0..x.len()).map(|j| self.bounds.at(x, j)).collect();
    }

    fn free_gradient(&self, x: &DVector<f64>, j: usize, gradient: f64) -> f64 {
        let down = gradient > 0.0 && x[j] <= self.bounds.lower[j];
        let up = gradient < 0.0 && x[j] >= self.bounds.upper[j];
        if down || up { 0.0 } else { gradient }
    }

    fn step(&mut self, x: &DVector<f64>, radius: f64) -> Step {
        let Some(model) = &mut self.model else { return Step::none(x) };
        let free = model.unbounded_step(x, radius);
        if self.bounds.contain(&free.point) {
            return free;
        }
        let scale = model.scale.clone();
        let lower = (&self.bounds.lower - x).component_mul(&scale);
        let upper = (&self.bounds.upper - x).component_mul(&scale);
        let mut problem = BoxProblem::new(&model.factor, lower, upper, self.guess.clone());
        let (solution, damping) = limited(&mut problem, radius);
        self.guess.clone_from(&solution.active);
        self.finish(x, &solution, damping)
    }
}

impl BoxConstrained {
    /// x + D⁻¹ q, exactly on the bounds that hold.
    fn finish(&self, x: &DVector<f64>, solution: &BoxSolution, damping: f64) -> Step {
        let Some(model) = &self.model else { return Step::none(x) };
        let mut point = x + solution.q.component_div(&model.scale);
        for (j, active) in solution.active.iter().enumerate() {
            match active {
                Some(AtBound::Lower) => point[j] = self.bounds.lower[j],
                Some(AtBound::Upper) => point[j] = self.bounds.upper[j],
                None => {}
            }
        }
        self.bounds.clamp(&mut point);
        let slope = -model.factor.gradient().dot(&solution.q);
        let predicted = slope - 0.5 * model.factor.image(&solution.q).norm_squared();
        Step { point, length: solution.q.norm(), slope, predicted, damping }
    }
}

/// The boxed step with ‖q‖ ≤ Δ to within 10 %, and its damping λ.
///
/// ‖q(λ)‖ falls with λ and is at most ‖Bᵀc‖/λ (compare q with staying put), which brackets λ; within the bracket
/// Hebden's model ‖q(λ)‖ ≈ a/(b + λ) is fitted to the last two values.
fn limited(problem: &mut BoxProblem<'_>, radius: f64) -> (BoxSolution, f64) {
    let mut solution = problem.solve(0.0);
    let mut length = solution.q.norm();
    if length <= (1.0 + RADIUS_SLACK) * radius {
        return (solution, 0.0);
    }
    let (mut low, mut high) = (0.0, problem.gradient_norm() / radius);
    let mut last = (0.0, length);
    let mut lambda = 1e-3 * high;
    let mut best = None;
    for _ in 0..DAMPINGS {
        solution = problem.solve(lambda);
        length = solution.q.norm();
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
    best.unwrap_or_else(|| {
        let solution = problem.solve(high);
        (solution, high)
    })
}
