//! Interior reflective method within a box: the distance to the bounds scales the step, and a step
//! that meets a bound is reflected.

use nalgebra::DVector;

use super::{Bounds, Factor, Settings, Step, Subproblem};
use crate::least_squares::Linearisation;

/// Fraction of the distance to a bound that a step may take.
const MAX_BOUND_FRACTION: f64 = 0.995;
/// Smallest distance of a start from its bounds, relative to the magnitude of the bound or 1,
/// whichever is larger.
const MIN_START_MARGIN: f64 = 1e-10;

/// Subproblem of the interior reflective step within bounds lo < x < hi [Branch, Coleman & Li
/// 1999].
///
/// Let v be the distance to the bound in the direction of −g (1 if there is none), and V = diag(v).
/// The optimality conditions are V g = 0, and min ½‖J p + r‖² + ½ pᵀ V⁻¹|g| p is solved within a
/// radius in unknowns scaled by √v. If the step leaves the box, the best of three steps is taken,
/// like in SciPy's `trf`: to the bound, its reflection there, and the steepest descent. Unknowns
/// that end next to a bound are moved onto it by
/// [`minimise_constrained_by`](super::minimise_constrained_by).
#[derive(Debug, Clone)]
pub struct Reflective {
    bounds: Bounds,
    model: Option<ScaledModel>,
}

/// Linearised problem in unknowns p̂ = p / d.
#[derive(Debug, Clone)]
struct ScaledModel {
    factor: Factor,
    /// Scale d = √(v / D), or 1/D if there is no bound in the direction of descent; 0 for a fixed
    /// unknown.
    size: DVector<f64>,
    gradient: DVector<f64>,
}

/// Candidate step p̂ with the change of the quadratic model, ½‖B p̂‖² + ĝᵀp̂.
struct Candidate {
    scaled: DVector<f64>,
    change: f64,
}

impl ScaledModel {
    fn candidate(&self, scaled: DVector<f64>) -> Candidate {
        let change = 0.5 * self.factor.image(&scaled).norm_squared() + self.gradient.dot(&scaled);
        Candidate { scaled, change }
    }

    fn unscaled_step(&self, scaled: &DVector<f64>) -> DVector<f64> {
        scaled.component_mul(&self.size)
    }

    /// Returns the candidate of the lowest model value among `from` + t `along` with low ≤ t ≤
    /// high.
    fn best_along(
        &self,
        from: &DVector<f64>,
        along: &DVector<f64>,
        low: f64,
        high: f64,
    ) -> Candidate {
        let image = self.factor.image(along);
        let slope = self.gradient.dot(along) + image.dot(&self.factor.image(from));
        let best = (-slope / image.norm_squared()).clamp(low, high);
        self.candidate(from + if best.is_finite() { best } else { high } * along)
    }
}

impl Reflective {
    /// Creates the subproblem within `bounds`.
    pub fn new(bounds: Bounds) -> Self {
        Self { bounds, model: None }
    }

    /// Returns the distance of `x[j]` to the bound in the direction of −gradient, or `None` if
    /// there is none.
    fn distance(&self, x: &DVector<f64>, j: usize, gradient: f64) -> Option<f64> {
        let distance = if gradient < 0.0 {
            self.bounds.upper()[j] - x[j]
        } else {
            x[j] - self.bounds.lower()[j]
        };
        (distance.is_finite() && gradient != 0.0).then_some(distance.max(0.0))
    }

    /// Returns the fraction of p that reaches the first bound, and the unknowns that meet a bound
    /// there.
    fn fraction_to_bound(&self, x: &DVector<f64>, p: &DVector<f64>) -> (f64, Vec<usize>) {
        let fraction = |j: usize| match p[j] {
            p if p > 0.0 => ((self.bounds.upper()[j] - x[j]) / p).max(0.0),
            p if p < 0.0 => ((self.bounds.lower()[j] - x[j]) / p).max(0.0),
            _ => f64::INFINITY,
        };
        let fractions: Vec<f64> = (0..x.len()).map(fraction).collect();
        let first = fractions.iter().copied().fold(f64::INFINITY, f64::min);
        (first, (0..x.len()).filter(|&j| fractions[j] <= first).collect())
    }

    /// Returns the best of three candidates for a step p̂ that leaves the box: step to the bound,
    /// reflection, and steepest descent.
    fn best_inside(
        &self,
        model: &ScaledModel,
        x: &DVector<f64>,
        scaled: &DVector<f64>,
        radius: f64,
    ) -> Candidate {
        let (stride, hits) = self.fraction_to_bound(x, &model.unscaled_step(scaled));
        let on_bound = scaled * stride;
        let mut mirrored = scaled.clone();
        for &j in &hits {
            mirrored[j] = -mirrored[j];
        }
        let reflected = {
            let to_radius = fraction_to_radius(&on_bound, &mirrored, radius);
            let (to_bound, _) = self.fraction_to_bound(
                &(x + model.unscaled_step(&on_bound)),
                &model.unscaled_step(&mirrored),
            );
            let limit = to_bound.min(to_radius);
            let low = if limit > 0.0 { (1.0 - MAX_BOUND_FRACTION) * stride / limit } else { 0.0 };
            let high =
                if to_bound <= to_radius { MAX_BOUND_FRACTION * to_bound } else { to_radius };
            (limit > 0.0 && low <= high).then(|| model.best_along(&on_bound, &mirrored, low, high))
        };
        let straight = model.candidate(&on_bound * MAX_BOUND_FRACTION);
        let down = -&model.gradient;
        let to_radius = radius / down.norm().max(f64::MIN_POSITIVE);
        let (to_bound, _) = self.fraction_to_bound(x, &model.unscaled_step(&down));
        let high = (MAX_BOUND_FRACTION * to_bound).min(to_radius);
        let descent = model.best_along(&DVector::zeros(x.len()), &down, 0.0, high);
        let best = if descent.change < straight.change { descent } else { straight };
        match reflected {
            Some(reflected) if reflected.change < best.change => reflected,
            _ => best,
        }
    }
}

/// Returns t ≥ 0 with ‖`from` + t `along`‖ = `radius`, or 0 if there is none.
fn fraction_to_radius(from: &DVector<f64>, along: &DVector<f64>, radius: f64) -> f64 {
    let (a, b, c) = (along.norm_squared(), from.dot(along), from.norm_squared() - radius * radius);
    let root = (b * b - a * c).max(0.0).sqrt();
    let fraction = if b > 0.0 { -c / (b + root) } else { (root - b) / a };
    if fraction.is_finite() { fraction.max(0.0) } else { 0.0 }
}

impl Subproblem for Reflective {
    fn name(&self) -> &'static str {
        "interior reflective Levenberg–Marquardt"
    }

    fn admit_start(&self, start: &mut DVector<f64>) -> bool {
        let n = start.len();
        if self.bounds.lower().len() != n {
            return false;
        }
        self.bounds.clamp(start);
        for j in 0..n {
            let (lower, upper) = (self.bounds.lower()[j], self.bounds.upper()[j]);
            let margin = |bound: f64| {
                if bound.is_finite() { MIN_START_MARGIN * bound.abs().max(1.0) } else { 0.0 }
            };
            let (least, most) = (lower + margin(lower), upper - margin(upper));
            start[j] =
                if least <= most { start[j].clamp(least, most) } else { 0.5 * (lower + upper) };
        }
        true
    }

    fn prepare(
        &mut self,
        x: &DVector<f64>,
        linearisation: &Linearisation,
        scale: &DVector<f64>,
        settings: &Settings,
    ) {
        let n = x.len();
        let gradient = linearisation.triangle.tr_mul(&linearisation.projected);
        let mut size = DVector::zeros(n);
        let mut barrier = DVector::zeros(n);
        for j in (0..n).filter(|&j| self.bounds.lower()[j] < self.bounds.upper()[j]) {
            match self.distance(x, j, gradient[j]) {
                Some(distance) => {
                    size[j] = (distance / scale[j]).sqrt();
                    barrier[j] = (gradient[j].abs() / scale[j]).sqrt();
                }
                None => size[j] = scale[j].recip(),
            }
        }
        let mut matrix = linearisation.triangle.clone().resize_vertically(2 * n, 0.0);
        matrix.column_iter_mut().zip(size.iter()).for_each(|(mut column, size)| column *= *size);
        (0..n).for_each(|j| matrix[(n + j, j)] = barrier[j]);
        let constant = linearisation.projected.clone().resize_vertically(2 * n, 0.0);
        let factor = Factor::new(matrix, constant, settings.rank_tolerance);
        self.model = Some(ScaledModel { factor, gradient: gradient.component_mul(&size), size });
    }

    fn free_gradient(&self, _x: &DVector<f64>, _j: usize, gradient: f64) -> f64 {
        gradient
    }

    fn project_gradient(
        &self,
        x: &DVector<f64>,
        scale: &DVector<f64>,
        gradient: &mut DVector<f64>,
    ) {
        // Close to a bound (less than one residual unit) the gradient is scaled down in proportion.
        for j in 0..x.len() {
            if let Some(distance) = self.distance(x, j, gradient[j]) {
                gradient[j] *= (distance * scale[j]).min(1.0);
            }
        }
    }

    fn is_feasible(&self, x: &DVector<f64>) -> bool {
        self.bounds.contain(x)
    }

    fn step(&mut self, x: &DVector<f64>, radius: f64) -> Step {
        let Some(mut model) = self.model.take() else { return Step::none(x) };
        let (scaled, damping) = model.factor.limited(radius);
        let is_inside = self.bounds.contain(&(x + model.unscaled_step(&scaled)));
        let Candidate { scaled, change } = if is_inside {
            model.candidate(scaled)
        } else {
            self.best_inside(&model, x, &scaled, radius)
        };
        let mut point = x + model.unscaled_step(&scaled);
        self.bounds.clamp(&mut point);
        let slope = -model.gradient.dot(&scaled);
        self.model = Some(model);
        Step { point, length: scaled.norm(), slope, predicted: -change, damping }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vector(values: &[f64]) -> DVector<f64> {
        DVector::from_column_slice(values)
    }

    fn within(lower: &[f64], upper: &[f64]) -> Reflective {
        Reflective::new(Bounds::new(vector(lower), vector(upper)).unwrap())
    }

    #[test]
    fn steps_end_at_the_first_bound() {
        let infinite = f64::INFINITY;
        let bounded = within(&[-1.0, -2.0, -infinite], &[3.0, 2.0, infinite]);
        let x = vector(&[1.0, 0.0, 5.0]);
        for (step, fraction, hits) in [
            ([4.0, 1.0, 9.0], 0.5, vec![0]),
            ([-4.0, 1.0, 9.0], 0.5, vec![0]),
            ([2.0, -4.0, 0.0], 0.5, vec![1]),
            ([2.0, 2.0, -1.0], 1.0, vec![0, 1]),
            ([0.5, 8.0, 0.0], 0.25, vec![1]),
        ] {
            let (found, met) = bounded.fraction_to_bound(&x, &vector(&step));
            assert!((found - fraction).abs() < 1e-15 && met == hits, "{step:?}: {found} {met:?}");
        }
        assert!(bounded.fraction_to_bound(&x, &vector(&[0.0, 0.0, 1.0])).0.is_infinite());
    }

    #[test]
    fn fractions_reach_the_radius() {
        let from = vector(&[0.6, -0.2]);
        for along in [[2.0, 1.0], [-2.0, 1.0], [0.5, 1.5], [-3.0, 0.0]] {
            let along = vector(&along);
            let fraction = fraction_to_radius(&from, &along, 1.5);
            assert!(fraction > 0.0 && ((&from + fraction * &along).norm() - 1.5).abs() < 1e-12);
        }
        // From outside and outwards there is none; neither without a direction.
        assert!(fraction_to_radius(&from, &from, 0.1).abs() < 1e-300);
        assert!(fraction_to_radius(&from, &vector(&[0.0, 0.0]), 1.5).abs() < 1e-300);
    }

    #[test]
    fn starts_are_moved_off_the_bounds() {
        let infinite = f64::INFINITY;
        let narrow = 2.0 + 1e-11;
        let bounded = within(&[-1.0, 2e3, 2.0, -infinite], &[3.0, 4e3, narrow, 7.0]);
        let mut start = vector(&[-9.0, 5e3, 2.0, 3.0]);
        assert!(bounded.admit_start(&mut start));
        // 1e-10 times the magnitude of the bound, or times 1.
        assert!(((start[0] + 1.0) / 1e-10 - 1.0).abs() < 1e-4, "{start}");
        assert!(((4e3 - start[1]) / 4e-7 - 1.0).abs() < 1e-4, "{start}");
        // Between bounds that are closer: the middle.
        assert!((start[2] - 0.5 * (2.0 + narrow)).abs() < 1e-15);
        assert!((start[3] - 3.0).abs() < 1e-15);
        assert!(!bounded.admit_start(&mut vector(&[0.0])));
    }

    #[test]
    fn steps_stay_inside_and_reduce_the_model_as_predicted() {
        let lower = [-1.0, -0.4, -5.0];
        let upper = [0.3, 2.0, 0.2];
        let triangle = nalgebra::DMatrix::from_row_slice(
            3,
            3,
            &[2.0, 0.5, -0.3, 0.0, 1.0, 0.8, 0.0, 0.0, 0.5],
        );
        let x = vector(&[0.1, 0.2, -0.3]);
        let scale = DVector::from_iterator(3, triangle.column_iter().map(|c| c.norm()));
        for projected in [[-3.0, 1.0, -2.0], [3.0, -1.0, 0.4], [0.5, 4.0, -1.0], [-9.0, -9.0, 9.0]]
        {
            let projected = vector(&projected);
            let cost = 0.5 * projected.norm_squared();
            let gradient = triangle.tr_mul(&projected);
            let distances = DVector::from_fn(3, |j, _| {
                (if gradient[j] < 0.0 { upper[j] - x[j] } else { x[j] - lower[j] }).abs()
            });
            // gᵀp + ½‖J p‖² + ½ pᵀ V⁻¹|g| p
            let model = |p: &DVector<f64>| {
                let barrier = gradient.abs().component_div(&distances);
                let squares = (&triangle * p).norm_squared() + barrier.dot(&p.component_mul(p));
                gradient.dot(p) + 0.5 * squares
            };
            let linearisation = Linearisation { cost, triangle: triangle.clone(), projected };
            for radius in [0.2, 1.0, 30.0] {
                let mut subproblem = within(&lower, &upper);
                subproblem.prepare(&x, &linearisation, &scale, &Settings::default());
                let step = subproblem.step(&x, radius);
                let p = &step.point - &x;
                assert!((0..3).all(|j| lower[j] < step.point[j] && step.point[j] < upper[j]));
                assert!(step.length <= 1.1 * radius + 1e-12);
                assert!((step.slope + gradient.dot(&p)).abs() < 1e-12 * step.slope.abs());
                assert!((step.predicted + model(&p)).abs() < 1e-12 * step.predicted);
                // No point of the scaled steepest descent, −t V D⁻¹ g, that is well inside the box
                // and the radius is lower.
                let direction = -gradient.component_mul(&distances).component_div(&scale);
                let squares = direction.component_mul(&scale).component_div(&distances);
                let longest = 0.9 * radius / squares.dot(&direction).sqrt();
                for t in (1..100).map(|k| 0.01 * f64::from(k) * longest) {
                    let p = t * &direction;
                    let end = &x + &p / MAX_BOUND_FRACTION;
                    if (0..3).all(|j| lower[j] <= end[j] && end[j] <= upper[j]) {
                        assert!(-step.predicted <= model(&p) + 1e-12 * step.predicted);
                    }
                }
            }
        }
    }
}
