//! The interior reflective method within a box: steps that bounds slow down, turned back where they
//! meet one.

use nalgebra::DVector;

use super::{Bounds, Factor, Settings, Step, Subproblem, TrustRegion};
use crate::least_squares::Linearisation;

/// Part of the way to a bound that a step may take.
const WAY: f64 = 0.995;
/// Distance that a start keeps from its bounds, relative to their size.
const INSIDE: f64 = 1e-10;

/// Levenberg–Marquardt within bounds lo < x < hi by reflections, never on a bound itself [Branch,
/// Coleman & Li 1999].
///
/// With v the distance to the bound that lies down the gradient g (1 without one), unknowns are
/// measured by √v: the optimality conditions are V g = 0, and min ½‖J p + r‖² + ½ pᵀ V⁻¹|g| p is
/// solved within a radius. Of the step to the bound, its reflection there and the steepest descent
/// the best is taken, as by SciPy's `trf`. What ends beside a bound that it presses against is put
/// on it by [`minimise_within`](super::minimise_within).
pub fn reflective_levenberg_marquardt(
    bounds: Bounds,
    settings: Settings,
) -> TrustRegion<Reflective> {
    TrustRegion::new(Reflective { bounds, model: None }, settings)
}

/// The reflective step.
#[derive(Debug, Clone)]
pub struct Reflective {
    bounds: Bounds,
    model: Option<Scaled>,
}

/// The problem in unknowns p̂ = p / d.
#[derive(Debug, Clone)]
struct Scaled {
    factor: Factor,
    /// d = √v / D, or 1/D far from bounds; 0 where an unknown has one value only.
    size: DVector<f64>,
    gradient: DVector<f64>,
}

/// A step p̂, and ½‖B p̂‖² + ĝᵀp̂, what it changes.
struct Candidate {
    hat: DVector<f64>,
    value: f64,
}

impl Scaled {
    fn value(&self, hat: DVector<f64>) -> Candidate {
        let value = 0.5 * self.factor.image(&hat).norm_squared() + self.gradient.dot(&hat);
        Candidate { hat, value }
    }

    fn step(&self, hat: &DVector<f64>) -> DVector<f64> {
        hat.component_mul(&self.size)
    }

    /// The best of `from` + t `along` for low ≤ t ≤ high.
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
        self.value(from + if best.is_finite() { best } else { high } * along)
    }
}

impl Reflective {
    /// Distance to the bound that lies down the gradient, if there is one.
    fn distance(&self, x: &DVector<f64>, j: usize, gradient: f64) -> Option<f64> {
        let distance = if gradient < 0.0 {
            self.bounds.upper()[j] - x[j]
        } else {
            x[j] - self.bounds.lower()[j]
        };
        (distance.is_finite() && gradient != 0.0).then_some(distance.max(0.0))
    }

    /// Part of p that leads to the first bound, and the unknowns that meet one there.
    fn to_bound(&self, x: &DVector<f64>, p: &DVector<f64>) -> (f64, Vec<usize>) {
        let part = |j: usize| match p[j] {
            p if p > 0.0 => ((self.bounds.upper()[j] - x[j]) / p).max(0.0),
            p if p < 0.0 => ((self.bounds.lower()[j] - x[j]) / p).max(0.0),
            _ => f64::INFINITY,
        };
        let parts: Vec<f64> = (0..x.len()).map(part).collect();
        let first = parts.iter().copied().fold(f64::INFINITY, f64::min);
        (first, (0..x.len()).filter(|&j| parts[j] <= first).collect())
    }

    /// The best of three ways, where p̂ leaves the box.
    fn turned(
        &self,
        model: &Scaled,
        x: &DVector<f64>,
        hat: &DVector<f64>,
        radius: f64,
    ) -> Candidate {
        let (stride, hits) = self.to_bound(x, &model.step(hat));
        let on_bound = hat * stride;
        let mut mirrored = hat.clone();
        for &j in &hits {
            mirrored[j] = -mirrored[j];
        }
        let reflected = {
            let to_radius = along_to_radius(&on_bound, &mirrored, radius);
            let (to_bound, _) = self.to_bound(&(x + model.step(&on_bound)), &model.step(&mirrored));
            let far = to_bound.min(to_radius);
            let low = if far > 0.0 { (1.0 - WAY) * stride / far } else { 0.0 };
            let high = if to_bound <= to_radius { WAY * to_bound } else { to_radius };
            (far > 0.0 && low <= high).then(|| model.best_along(&on_bound, &mirrored, low, high))
        };
        let straight = model.value(&on_bound * WAY);
        let down = -&model.gradient;
        let to_radius = radius / down.norm().max(f64::MIN_POSITIVE);
        let (to_bound, _) = self.to_bound(x, &model.step(&down));
        let descent =
            model.best_along(&DVector::zeros(x.len()), &down, 0.0, (WAY * to_bound).min(to_radius));
        let best = if descent.value < straight.value { descent } else { straight };
        reflected
            .into_iter()
            .fold(best, |best, own| if own.value < best.value { own } else { best })
    }
}

/// t ≥ 0 with ‖from + t along‖ = radius, 0 where there is none.
fn along_to_radius(from: &DVector<f64>, along: &DVector<f64>, radius: f64) -> f64 {
    let (a, b, c) = (along.norm_squared(), from.dot(along), from.norm_squared() - radius * radius);
    let root = (b * b - a * c).max(0.0).sqrt();
    let far = if b > 0.0 { -c / (b + root) } else { (root - b) / a };
    if far.is_finite() { far.max(0.0) } else { 0.0 }
}

impl Subproblem for Reflective {
    fn name(&self) -> &'static str {
        "interior reflective Levenberg–Marquardt"
    }

    fn admit(&self, start: &mut DVector<f64>) -> bool {
        let n = start.len();
        if self.bounds.lower().len() != n {
            return false;
        }
        self.bounds.clamp(start);
        for j in 0..n {
            let (lower, upper) = (self.bounds.lower()[j], self.bounds.upper()[j]);
            let room =
                |bound: f64| if bound.is_finite() { INSIDE * bound.abs().max(1.0) } else { 0.0 };
            let (least, most) = (lower + room(lower), upper - room(upper));
            start[j] =
                if least <= most { start[j].clamp(least, most) } else { 0.5 * (lower + upper) };
        }
        true
    }

    fn prepare(
        &mut self,
        x: &DVector<f64>,
        found: &Linearisation,
        scale: &DVector<f64>,
        settings: &Settings,
    ) {
        let n = x.len();
        let gradient = found.triangle.tr_mul(&found.projected);
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
        let mut matrix = found.triangle.clone().resize_vertically(2 * n, 0.0);
        matrix.column_iter_mut().zip(size.iter()).for_each(|(mut column, size)| column *= *size);
        (0..n).for_each(|j| matrix[(n + j, j)] = barrier[j]);
        let constant = found.projected.clone().resize_vertically(2 * n, 0.0);
        let factor = Factor::new(matrix, constant, settings.rank_tolerance);
        self.model = Some(Scaled { factor, gradient: gradient.component_mul(&size), size });
    }

    fn free_gradient(&self, _x: &DVector<f64>, _j: usize, gradient: f64) -> f64 {
        gradient
    }

    fn hold_back(&self, x: &DVector<f64>, scale: &DVector<f64>, gradient: &mut DVector<f64>) {
        // Nearer to a bound than moves the residual by one, the gradient counts in proportion.
        for j in 0..x.len() {
            if let Some(distance) = self.distance(x, j, gradient[j]) {
                gradient[j] *= (distance * scale[j]).min(1.0);
            }
        }
    }

    fn admits(&self, x: &DVector<f64>) -> bool {
        self.bounds.contain(x)
    }

    fn step(&mut self, x: &DVector<f64>, radius: f64) -> Step {
        let Some(mut model) = self.model.take() else { return Step::none(x) };
        let (hat, damping) = model.factor.limited(radius);
        let inside = self.bounds.contain(&(x + model.step(&hat)));
        let Candidate { hat, value } =
            if inside { model.value(hat) } else { self.turned(&model, x, &hat, radius) };
        let mut point = x + model.step(&hat);
        self.bounds.clamp(&mut point);
        let slope = -model.gradient.dot(&hat);
        self.model = Some(model);
        Step { point, length: hat.norm(), slope, predicted: -value, damping }
    }
}
