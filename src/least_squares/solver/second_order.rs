//! Second derivatives where linearised residuals forecast badly.

use nalgebra::{DMatrix, DVector};

use crate::least_squares::Linearisation;

/// A gain outside this range of its forecast is a miss.
const FORECAST: std::ops::RangeInclusive<f64> = 0.5..=1.5;
/// The same of an undamped step with S, which near an optimum knows all there is.
const CLOSE_FORECAST: std::ops::RangeInclusive<f64> = 0.9..=1.1;
/// Misses after which steps are bent, until one without damping is bent by no more than a part of
/// its length: the way is straight then, up to the next miss.
const BENDING_MISSES: usize = 2;
const STRAIGHT: f64 = 0.01;
/// Misses of linearised residuals after which S is formed; for many unknowns, such a part of their
/// number, since forming S costs about as many linearisations as there are unknowns.
const MISSES: usize = 15;
const MISSES_PER_UNKNOWN: f64 = 1.0 / 6.0;
/// Slow steps in a row after which S is formed, if without it more steps would follow than it
/// costs, or than are left; no fewer must be left.
const SLOW_STEPS: usize = 3;
/// Steps for each unknown after which S may be formed again.
const STEPS_PER_UNKNOWN: f64 = 1.0 / 40.0;
/// A step without damping is slow if it is longer than this part of the one before.
const SLOW: f64 = 0.5;
/// How often S is formed at most: what has not converged by then will not.
const MOST_TIMES: usize = 50;
/// What keeps a step on the faces that it presses against, over the largest curvature.
const WALL: f64 = 1e3;
/// μ over the most negative curvature, and over the largest one at least.
const BEYOND: f64 = 1.01;
const LEAST_DAMPING: f64 = 1e-10;

/// Second derivatives, once linearised residuals have missed too often.
///
/// Two things make JᵀJ forecast badly. The way may be a curved valley: then a step follows its
/// bend, from the second derivative of r along the step [Transtrum & Sethna 2012]. And residuals
/// may stay large: then S = Σ rᵢ ∇²rᵢ is added to JᵀJ [Dennis, Gay & Welsch 1981], which costs as
/// many linearisations as there are unknowns, so that S is kept from point to point while steps
/// keep to its forecast and get shorter as they should.
#[derive(Debug, Clone, Default)]
pub(super) struct SecondOrder {
    misses: usize,
    /// Whether the last step that was bent went straight on.
    straight: bool,
    /// ‖D p‖ of the last steps, in a row, without damping.
    lengths: Vec<f64>,
    matrix: Option<DMatrix<f64>>,
    /// Whether S was formed at the present point, and how many steps ago.
    fresh: bool,
    age: usize,
    /// How often it was formed.
    times: usize,
    /// Whether it has done its work.
    retired: bool,
}

/// What a step gains in a quadratic model that is convex, and what was added to make it so.
#[derive(Debug, Clone)]
pub(super) struct Convex {
    /// In the form of linearised residuals: the gradient is Rᵀ(Qᵀr), the Hessian RᵀR.
    pub linearisation: Linearisation,
    /// μ, times q = D p.
    damping: f64,
    /// √ρ N.
    walls: DMatrix<f64>,
}

impl Convex {
    /// ½(μ‖q‖² + ρ‖N q‖²), which the model takes off the gain of a step too much.
    pub fn excess(&self, q: &DVector<f64>) -> f64 {
        0.5 * (self.damping * q.norm_squared() + (&self.walls * q).norm_squared())
    }
}

impl SecondOrder {
    /// Whether steps are bent.
    pub fn bends(&self) -> bool {
        self.misses >= BENDING_MISSES && !self.straight && !self.retired
    }

    /// Takes in by which part of its length a step was bent.
    pub fn bent(&mut self, share: f64, damping: f64) {
        self.straight = damping == 0.0 && share <= STRAIGHT;
    }

    /// Ends it where steps gain nothing more, and says whether S was at work: what is left is
    /// better seen by linearised residuals, whose condition is not squared.
    pub fn retire(&mut self) -> bool {
        self.retired = true;
        self.matrix.take().is_some()
    }

    /// Takes in what a step gained over its forecast, where S is not wanted.
    pub fn watch(&mut self, ratio: f64) {
        self.misses += usize::from(!FORECAST.contains(&ratio));
    }

    /// Takes in what any step gained over its forecast: a miss shows that the way is not straight.
    pub fn look(&mut self, ratio: f64) {
        self.straight &= FORECAST.contains(&ratio);
    }

    /// Takes in a step of length ‖D p‖, `left` others being left; whether S should be formed at the
    /// point where the solver is now. The forecast of its gain was `worth` times the gain below
    /// which no step is worth it.
    pub fn judge(
        &mut self,
        (ratio, taken): (f64, bool),
        (length, damping): (f64, f64),
        (worth, left): (f64, u64),
        unknowns: usize,
    ) -> bool {
        let near = self.matrix.is_some() && damping == 0.0;
        let missed = !(if near { CLOSE_FORECAST } else { FORECAST }).contains(&ratio);
        if taken && damping == 0.0 {
            self.lengths.push(length);
        } else {
            self.lengths.clear();
        }
        let slow = self.lengths.windows(2).last().is_some_and(|pair| pair[1] > SLOW * pair[0]);
        self.misses += usize::from(missed);
        self.fresh = self.fresh && !taken;
        self.age += 1;
        let part = |part: f64| part * unknowns as f64;
        let enough = if self.matrix.is_some() {
            self.age as f64 >= part(STEPS_PER_UNKNOWN)
        } else {
            let misses = self.misses as f64 >= part(MISSES_PER_UNKNOWN).max(MISSES as f64);
            misses || (left > SLOW_STEPS as u64 && self.to_come(worth) > part(1.0).min(left as f64))
        };
        (missed || slow) && enough && !self.fresh && !self.retired && self.times < MOST_TIMES
    }

    /// Steps that follow slow ones: steps that shrink by a factor s gain s² times what the one
    /// before did, so that a gain of `worth` times the least is followed by ln(worth) / (2 ln 1/s)
    /// others; 0 where the last ones were not slow.
    fn to_come(&self, worth: f64) -> f64 {
        let Some(last) =
            self.lengths.len().checked_sub(SLOW_STEPS + 1).map(|first| &self.lengths[first..])
        else {
            return 0.0;
        };
        if !last.windows(2).all(|pair| pair[1] > SLOW * pair[0]) {
            return 0.0;
        }
        let shrinks = (last[SLOW_STEPS] / last[0]).powf(1.0 / SLOW_STEPS as f64);
        if shrinks < 1.0 { -0.5 * worth.ln() / shrinks.ln() } else { f64::INFINITY }
    }

    /// Takes S at the present point.
    pub fn renew(&mut self, matrix: Option<DMatrix<f64>>) {
        self.times += 1;
        if let Some(matrix) = matrix {
            self.matrix = Some(matrix);
            (self.fresh, self.age) = (true, 0);
        }
    }

    /// The model with S, in unknowns scaled by D; `pressed` are normals of the faces that x presses
    /// against.
    ///
    /// D⁻¹(JᵀJ + S)D⁻¹ + ρ NᵀN + μ, with ρ and μ zero unless they are needed to make it positive
    /// definite.
    pub fn model(
        &self,
        found: &Linearisation,
        scale: &DVector<f64>,
        pressed: impl FnOnce() -> DMatrix<f64>,
    ) -> Option<Convex> {
        let (n, second) = (scale.len(), self.matrix.as_ref()?);
        let mut hessian = found.triangle.tr_mul(&found.triangle) + second;
        for j in 0..n {
            for i in 0..n {
                hessian[(i, j)] /= scale[i] * scale[j];
            }
        }
        let mut gradient = found.triangle.tr_mul(&found.projected);
        gradient.component_div_assign(scale);
        let largest = hessian.diagonal().amax();
        let root = |hessian: &DMatrix<f64>| {
            let root = hessian.clone().cholesky()?.unpack();
            let floor = largest.sqrt() * n as f64 * f64::EPSILON.sqrt();
            root.diagonal().iter().all(|value| *value > floor).then_some(root)
        };
        let (mut damping, mut walls) = (0.0, DMatrix::zeros(0, n));
        let mut found_root = root(&hessian);
        if found_root.is_none() {
            walls = pressed() * (WALL * largest).sqrt();
            hessian += walls.tr_mul(&walls);
            found_root = root(&hessian);
        }
        let root = if let Some(root) = found_root {
            root
        } else {
            damping =
                BEYOND * hessian.symmetric_eigenvalues().min().abs() + LEAST_DAMPING * largest;
            (0..n).for_each(|j| hessian[(j, j)] += damping);
            hessian.cholesky()?.unpack()
        };
        let projected = root.solve_lower_triangular(&gradient)?;
        let mut triangle = root.transpose();
        triangle.column_iter_mut().zip(scale.iter()).for_each(|(mut column, d)| column *= *d);
        let linearisation = Linearisation { cost: found.cost, triangle, projected };
        Some(Convex { linearisation, damping, walls })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether S is formed after undamped steps that shrink by a factor, so many being left after
    /// each, of so many unknowns.
    fn forms(shrinks: f64, left: u64, unknowns: usize) -> bool {
        let mut own = SecondOrder::default();
        (0..8).any(|k| {
            let length = shrinks.powi(k);
            own.judge((1.0, true), (length, 0.0), (1e8 * length * length, left), unknowns)
        })
    }

    #[test]
    fn steps_are_bent_where_the_way_is_curved() {
        let mut own = SecondOrder::default();
        own.watch(-2.0);
        assert!(!own.bends());
        own.watch(0.1);
        assert!(own.bends());
        // A short step is hardly bent wherever it goes.
        own.bent(0.001, 0.5);
        own.look(1.0);
        assert!(own.bends());
        own.bent(0.001, 0.0);
        own.look(1.0);
        assert!(!own.bends());
        own.look(0.1);
        assert!(own.bends());
        // Without S there is nothing to go on with.
        assert!(!own.retire() && !own.bends());
        own.renew(Some(DMatrix::identity(2, 2)));
        assert!(own.retire() && !own.retire());
    }

    #[test]
    fn second_derivatives_are_formed_where_that_saves_steps() {
        // By 0.6: 18 steps; by 0.9: 87 and more.
        assert!(!forms(0.4, 100, 10) && !forms(0.6, 100, 30) && forms(0.6, 100, 10));
        assert!(forms(0.9, 100, 30) && forms(1.0, 100, 30));
        // For so many unknowns it costs more steps than would follow, unless those end the fit
        // before.
        assert!(!forms(0.9, 100, 500) && forms(0.9, 40, 500) && !forms(0.9, 2, 500));
    }
}
