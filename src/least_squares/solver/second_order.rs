//! Second derivatives where linearised residuals forecast badly.

use nalgebra::{DMatrix, DVector};

use crate::least_squares::Linearisation;

/// A gain outside this range of its forecast is a miss.
const FORECAST: std::ops::RangeInclusive<f64> = 0.5..=1.5;
/// Misses after which steps are bent.
const BENDING_MISSES: usize = 2;
/// Misses, and slow steps, of linearised residuals after which S is formed.
const MISSES: usize = 6;
const SLOW_STEPS: usize = 3;
/// A step without damping is slow if it is longer than this part of the one before.
const SLOW: f64 = 0.5;
/// What keeps a step on the faces that it presses against, over the largest curvature.
const WALL: f64 = 1e3;

/// Second derivatives, once linearised residuals have missed too often.
///
/// Two things make JᵀJ forecast badly. The way may be a curved valley: then a step follows its bend, from the second derivative of
/// r along the step [Transtrum & Sethna 2012]. And residuals may stay large: then S = Σ rᵢ ∇²rᵢ is added to JᵀJ
/// [Dennis, Gay & Welsch 1981], which costs as many linearisations as there are unknowns, so that S is kept from point to point
/// while steps keep to its forecast and get shorter as they should.
#[derive(Debug, Clone, Default)]
pub(super) struct SecondOrder {
    misses: usize,
    slow: usize,
    /// ‖D p‖ of the last step without damping.
    last: Option<f64>,
    matrix: Option<DMatrix<f64>>,
    /// Whether S was formed at the present point.
    fresh: bool,
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
        self.misses >= BENDING_MISSES
    }

    /// Takes in a step of length ‖D p‖; whether S should be formed at the point where the solver is now.
    pub fn judge(&mut self, ratio: f64, taken: bool, (length, damping): (f64, f64)) -> bool {
        let missed = !FORECAST.contains(&ratio);
        let slow = taken && damping == 0.0 && self.last.is_some_and(|last| length > SLOW * last);
        self.last = (taken && damping == 0.0).then_some(length);
        self.misses += usize::from(missed);
        self.slow += usize::from(slow);
        self.fresh = self.fresh && !taken;
        let enough = self.matrix.is_some() || self.misses >= MISSES || self.slow >= SLOW_STEPS;
        (missed || slow) && enough && !self.fresh
    }

    /// Takes S at the present point.
    pub fn renew(&mut self, matrix: Option<DMatrix<f64>>) {
        if let Some(matrix) = matrix {
            self.matrix = Some(matrix);
            self.fresh = true;
        }
    }

    /// The model with S, in unknowns scaled by D; `pressed` are normals of the faces that x presses against.
    ///
    /// D⁻¹(JᵀJ + S)D⁻¹ + ρ NᵀN + μ, with ρ and μ zero unless they are needed to make it positive definite.
    pub fn model(
        &self,
        found: &Linearisation,
        scale: &DVector<f64>,
        pressed: impl FnOnce() -> DMatrix<f64>,
    ) -> Option<Convex> {
        let n = scale.len();
        let mut hessian = found.triangle.tr_mul(&found.triangle) + self.matrix.as_ref()?;
        for j in 0..n {
            for i in 0..n {
                hessian[(i, j)] /= scale[i] * scale[j];
            }
        }
        let mut gradient = found.triangle.tr_mul(&found.projected);
        gradient.component_div_assign(scale);
        let largest = hessian.diagonal().amax();
        let none = DMatrix::zeros(0, n);
        let root = |hessian: &DMatrix<f64>| {
            let root = hessian.clone().cholesky()?.unpack();
            let floor = largest.sqrt() * n as f64 * f64::EPSILON.sqrt();
            root.diagonal().iter().all(|value| *value > floor).then_some(root)
        };
        let (root, damping, walls) = match root(&hessian) {
            Some(root) => (root, 0.0, none),
            None => {
                let walls = pressed() * (WALL * largest).sqrt();
                hessian += walls.tr_mul(&walls);
                match root(&hessian) {
                    Some(root) => (root, 0.0, walls),
                    None => {
                        let least = hessian.symmetric_eigenvalues().min();
                        let damping = -least * 1.01_f64.copysign(-least) + largest * 1e-10;
                        (0..n).for_each(|j| hessian[(j, j)] += damping);
                        (hessian.cholesky()?.unpack(), damping, walls)
                    }
                }
            }
        };
        let projected = root.solve_lower_triangular(&gradient)?;
        let mut triangle = root.transpose();
        triangle.column_iter_mut().zip(scale.iter()).for_each(|(mut column, d)| column *= *d);
        let linearisation = Linearisation { cost: found.cost, triangle, projected };
        Some(Convex { linearisation, damping, walls })
    }
}
