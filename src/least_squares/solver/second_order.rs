//! Geodesic acceleration and second derivatives, used when linearised residuals predict poorly.

use nalgebra::{DMatrix, DVector};

use crate::least_squares::Linearisation;

/// Range of the gain ratio (actual over predicted reduction) of a step that the model predicted
/// well.
const ACCURATE_RATIO_RANGE: std::ops::RangeInclusive<f64> = 0.5..=1.5;
/// Narrower range of the gain ratio for undamped steps of the model with the second-order term S,
/// which is exact near an optimum.
const ACCURATE_RATIO_RANGE_WITH_S: std::ops::RangeInclusive<f64> = 0.9..=1.1;
/// Number of poorly predicted steps in a run from which the steps that follow get geodesic
/// acceleration.
const MIN_MISSES_FOR_ACCELERATION: usize = 2;
/// Largest ratio of acceleration to length of an undamped step after which acceleration pauses
/// until the next poorly predicted step.
const MAX_STRAIGHT_ACCELERATION: f64 = 0.01;
/// Number of poorly predicted steps after which S = Σ rᵢ ∇²rᵢ is formed, if there are few unknowns.
const MIN_MISSES_FOR_FORMATION: usize = 15;
/// Number of poorly predicted steps per unknown after which S is formed, with many unknowns.
/// Forming S takes about one linearisation per unknown.
const MIN_MISSES_PER_UNKNOWN_FOR_FORMATION: f64 = 1.0 / 6.0;
/// Number of successive slow steps from which the remaining steps are extrapolated. S is then
/// formed if those steps would cost more than S, or exceed the iteration limit.
const MIN_SLOW_STEPS: usize = 3;
/// Number of steps per unknown that must pass before S is formed again.
const MIN_STEPS_PER_UNKNOWN_BETWEEN_FORMATIONS: f64 = 1.0 / 40.0;
/// Ratio of the lengths of successive undamped steps above which convergence is slow.
const MIN_SLOW_RATIO: f64 = 0.5;
/// Maximum number of times that the second-order term S = Σ rᵢ ∇²rᵢ is formed in one run.
const MAX_FORMATIONS: usize = 50;
/// Penalty ρ on leaving active faces in the convex model, relative to the largest curvature.
const FACE_PENALTY: f64 = 1e3;
/// Damping μ that makes the model convex, as a multiple of the magnitude of its most negative
/// curvature.
const CONVEXITY_MARGIN: f64 = 1.01;
/// Smallest damping μ that makes the model convex, relative to the largest curvature.
const MIN_CONVEXITY_DAMPING: f64 = 1e-10;

/// Decides when steps are accelerated and when second derivatives are used.
///
/// JᵀJ predicts poorly for two reasons. The path may be a curved valley: then a step gets a
/// geodesic acceleration from the second derivative of r along the step [Transtrum & Sethna 2012].
/// Or residuals may stay large: then S = Σ rᵢ ∇²rᵢ is added to JᵀJ [Dennis, Gay & Welsch 1981]. S
/// costs one linearisation per unknown. It is therefore kept over several points while steps agree
/// with its prediction and shrink.
#[derive(Debug, Clone, Default)]
pub(super) struct SecondOrder {
    misses: usize,
    /// True if the last accelerated step had a small acceleration and no step was predicted poorly
    /// since.
    is_straight: bool,
    /// Lengths ‖D p‖ of the last successive undamped steps.
    lengths: Vec<f64>,
    /// Second-order term S = Σ rᵢ ∇²rᵢ of the Hessian, shape = (n, n); `None` until it is formed.
    matrix: Option<DMatrix<f64>>,
    /// True if the second-order term S was formed at the present point, not at an earlier one.
    is_fresh: bool,
    /// Number of steps since the second-order term S was last formed.
    age: usize,
    /// Number of times that the second-order term S was formed in this run.
    formations: usize,
    /// True once convergence was reached and second derivatives are no longer used.
    is_retired: bool,
}

/// Convex quadratic model of the cost, with the damping and penalty that were added to make it
/// convex.
#[derive(Debug, Clone)]
pub(super) struct ConvexModel {
    /// Model in the form of linearised residuals: gradient Rᵀ(Qᵀr), Hessian RᵀR.
    pub linearisation: Linearisation,
    /// Damping μ ≥ 0 that was added to the Hessian to make the model convex, in terms of the scaled
    /// step q = D p.
    damping: f64,
    /// Penalty rows √ρ N, with the unit normals N of active faces, shape = (faces, n).
    penalty_rows: DMatrix<f64>,
}

impl ConvexModel {
    /// Returns ½(μ‖q‖² + ρ‖N q‖²), by which the model underestimates the reduction of a step q.
    pub fn underestimated_reduction(&self, q: &DVector<f64>) -> f64 {
        0.5 * (self.damping * q.norm_squared() + (&self.penalty_rows * q).norm_squared())
    }
}

impl SecondOrder {
    /// Returns true if the next step should be accelerated.
    pub fn accelerates(&self) -> bool {
        self.misses >= MIN_MISSES_FOR_ACCELERATION && !self.is_straight && !self.is_retired
    }

    /// Records the ratio of acceleration to length of an accelerated step, and the damping of that
    /// step.
    pub fn record_acceleration(&mut self, ratio: f64, damping: f64) {
        self.is_straight = damping == 0.0 && ratio <= MAX_STRAIGHT_ACCELERATION;
    }

    /// Stops the use of second derivatives and returns true if S was in use.
    ///
    /// After convergence with S, linearised residuals refine the solution: their condition number
    /// is not squared.
    pub fn stop_second_derivatives(&mut self) -> bool {
        self.is_retired = true;
        self.matrix.take().is_some()
    }

    /// Counts the step as poorly predicted if its gain `ratio` is outside [`ACCURATE_RATIO_RANGE`].
    pub fn count_miss(&mut self, ratio: f64) {
        self.misses += usize::from(!ACCURATE_RATIO_RANGE.contains(&ratio));
    }

    /// Resumes geodesic acceleration if the gain `ratio` shows that the step was predicted poorly.
    pub fn resume_acceleration_if_missed(&mut self, ratio: f64) {
        self.is_straight &= ACCURATE_RATIO_RANGE.contains(&ratio);
    }

    /// Records a step and returns true if S should be formed at the present point.
    ///
    /// `ratio` is the gain ratio of the step, `taken` true if it was accepted, `length` its ‖D p‖
    /// and `damping` its λ. `worth` is its predicted reduction over the smallest one that is worth
    /// a step, `remaining` the number of steps that the iteration limit leaves.
    pub fn should_form_second_derivatives(
        &mut self,
        (ratio, taken): (f64, bool),
        (length, damping): (f64, f64),
        (worth, remaining): (f64, u64),
        unknowns: usize,
    ) -> bool {
        let is_exact = self.matrix.is_some() && damping == 0.0;
        let range = if is_exact { ACCURATE_RATIO_RANGE_WITH_S } else { ACCURATE_RATIO_RANGE };
        let missed = !range.contains(&ratio);
        if taken && damping == 0.0 {
            self.lengths.push(length);
        } else {
            self.lengths.clear();
        }
        let is_slow =
            self.lengths.windows(2).last().is_some_and(|pair| pair[1] > MIN_SLOW_RATIO * pair[0]);
        self.misses += usize::from(missed);
        self.is_fresh = self.is_fresh && !taken;
        self.age += 1;
        let per_unknown = |factor: f64| factor * unknowns as f64;
        let pays = if self.matrix.is_some() {
            self.age as f64 >= per_unknown(MIN_STEPS_PER_UNKNOWN_BETWEEN_FORMATIONS)
        } else {
            let limit = per_unknown(MIN_MISSES_PER_UNKNOWN_FOR_FORMATION)
                .max(MIN_MISSES_FOR_FORMATION as f64);
            let exceeds = |steps: f64| steps > per_unknown(1.0).min(remaining as f64);
            self.misses as f64 >= limit
                || (remaining > MIN_SLOW_STEPS as u64 && exceeds(self.expected_steps(worth)))
        };
        (missed || is_slow)
            && pays
            && !self.is_fresh
            && !self.is_retired
            && self.formations < MAX_FORMATIONS
    }

    /// Extrapolates the number of steps still to come after a series of slow ones. Returns 0 if the
    /// last steps were not slow, and infinity if they did not shrink.
    ///
    /// `worth` is the predicted reduction of the present step over the smallest one that is worth a
    /// step. Steps that shrink by a factor s reduce the cost by s² of the previous reduction. The
    /// reduction reaches the smallest one after ln(worth) / (2 ln 1/s) steps.
    fn expected_steps(&self, worth: f64) -> f64 {
        let Some(last) =
            self.lengths.len().checked_sub(MIN_SLOW_STEPS + 1).map(|first| &self.lengths[first..])
        else {
            return 0.0;
        };
        if !last.windows(2).all(|pair| pair[1] > MIN_SLOW_RATIO * pair[0]) {
            return 0.0;
        }
        let shrinkage = (last[MIN_SLOW_STEPS] / last[0]).powf(1.0 / MIN_SLOW_STEPS as f64);
        if shrinkage < 1.0 { -0.5 * worth.ln() / shrinkage.ln() } else { f64::INFINITY }
    }

    /// Stores S formed at the present point; `None` if it could not be formed.
    pub fn set_matrix(&mut self, matrix: Option<DMatrix<f64>>) {
        self.formations += 1;
        if let Some(matrix) = matrix {
            self.matrix = Some(matrix);
            (self.is_fresh, self.age) = (true, 0);
        }
    }

    /// Returns the convex model with S in unknowns scaled by D, or `None` if S is not in use.
    ///
    /// Its Hessian is D⁻¹(JᵀJ + S)D⁻¹ + ρ NᵀN + μ. The rows of N are the normals of active faces,
    /// computed by `active_normals`. ρ and μ are zero unless they are needed for positive
    /// definiteness.
    pub fn model(
        &self,
        linearisation: &Linearisation,
        scale: &DVector<f64>,
        active_normals: impl FnOnce() -> DMatrix<f64>,
    ) -> Option<ConvexModel> {
        let (n, second) = (scale.len(), self.matrix.as_ref()?);
        let mut hessian = linearisation.triangle.tr_mul(&linearisation.triangle) + second;
        for j in 0..n {
            for i in 0..n {
                hessian[(i, j)] /= scale[i] * scale[j];
            }
        }
        let mut gradient = linearisation.triangle.tr_mul(&linearisation.projected);
        gradient.component_div_assign(scale);
        let largest = hessian.diagonal().amax();
        let factorise = |hessian: &DMatrix<f64>| {
            let root = hessian.clone().cholesky()?.unpack();
            let floor = largest.sqrt() * n as f64 * f64::EPSILON.sqrt();
            root.diagonal().iter().all(|value| *value > floor).then_some(root)
        };
        let (mut damping, mut penalty_rows) = (0.0, DMatrix::zeros(0, n));
        let mut root = factorise(&hessian);
        if root.is_none() {
            penalty_rows = active_normals() * (FACE_PENALTY * largest).sqrt();
            hessian += penalty_rows.tr_mul(&penalty_rows);
            root = factorise(&hessian);
        }
        let root = if let Some(root) = root {
            root
        } else {
            let lowest = hessian.symmetric_eigenvalues().min();
            damping = CONVEXITY_MARGIN * lowest.abs() + MIN_CONVEXITY_DAMPING * largest;
            (0..n).for_each(|j| hessian[(j, j)] += damping);
            hessian.cholesky()?.unpack()
        };
        let projected = root.solve_lower_triangular(&gradient)?;
        let mut triangle = root.transpose();
        triangle.column_iter_mut().zip(scale.iter()).for_each(|(mut column, d)| column *= *d);
        let linearisation = Linearisation { cost: linearisation.cost, triangle, projected };
        Some(ConvexModel { linearisation, damping, penalty_rows })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns true if S is formed after undamped steps that shrink by a factor, with a number of
    /// remaining steps and of unknowns.
    fn forms(shrinkage: f64, remaining: u64, unknowns: usize) -> bool {
        let mut second_order = SecondOrder::default();
        (0..8).any(|k| {
            let length = shrinkage.powi(k);
            let worth = (1e8 * length * length, remaining);
            second_order.should_form_second_derivatives((1.0, true), (length, 0.0), worth, unknowns)
        })
    }

    #[test]
    fn steps_are_accelerated_along_a_curved_path() {
        let mut second_order = SecondOrder::default();
        second_order.count_miss(-2.0);
        assert!(!second_order.accelerates());
        second_order.count_miss(0.1);
        assert!(second_order.accelerates());
        // A short (damped) step has a small acceleration on any path.
        second_order.record_acceleration(0.001, 0.5);
        second_order.resume_acceleration_if_missed(1.0);
        assert!(second_order.accelerates());
        second_order.record_acceleration(0.001, 0.0);
        second_order.resume_acceleration_if_missed(1.0);
        assert!(!second_order.accelerates());
        second_order.resume_acceleration_if_missed(0.1);
        assert!(second_order.accelerates());
        // Without S there is nothing to refine.
        assert!(!second_order.stop_second_derivatives() && !second_order.accelerates());
        second_order.set_matrix(Some(DMatrix::identity(2, 2)));
        assert!(second_order.stop_second_derivatives() && !second_order.stop_second_derivatives());
    }

    #[test]
    fn second_derivatives_are_formed_where_that_saves_steps() {
        // A shrinkage of 0.6 leaves 18 steps, one of 0.9 at least 87.
        assert!(!forms(0.4, 100, 10) && !forms(0.6, 100, 30) && forms(0.6, 100, 10));
        assert!(forms(0.9, 100, 30) && forms(1.0, 100, 30));
        // With 500 unknowns S costs more than the remaining steps, unless the iteration limit comes
        // first.
        assert!(!forms(0.9, 100, 500) && forms(0.9, 40, 500) && !forms(0.9, 2, 500));
    }

    #[test]
    fn slow_steps_are_extrapolated_to_the_smallest_reduction() {
        let with =
            |lengths: &[f64]| SecondOrder { lengths: lengths.to_vec(), ..Default::default() };
        // Each step leaves 0.36 of the reduction: ln 1e4 / (2 ln 1/0.6) = 9.02 steps.
        let slow = with(&[5.0, 1.0, 0.6, 0.36, 0.216]);
        assert!((slow.expected_steps(1e4) - 9.015).abs() < 1e-3);
        // Three ratios are needed, none of them below one half.
        assert!(with(&[1.0, 0.6, 0.36]).expected_steps(1e4).abs() < 1e-300);
        assert!(with(&[1.0, 0.6, 0.24, 0.2]).expected_steps(1e4).abs() < 1e-300);
        assert!(with(&[1.0, 0.9, 0.9, 1.0]).expected_steps(1e4).is_infinite());
    }

    #[test]
    fn second_derivatives_are_formed_after_enough_poor_predictions() {
        // Steps limited by the radius, with 6 unknowns or 120; 15 misses, or one in six unknowns.
        let misses_until = |ratio: f64, unknowns: usize| {
            let mut second_order = SecondOrder::default();
            (1..100).find(|_| {
                second_order.should_form_second_derivatives(
                    (ratio, true),
                    (1.0, 0.5),
                    (1e8, 200),
                    unknowns,
                )
            })
        };
        assert_eq!(misses_until(0.3, 6), Some(15));
        assert_eq!(misses_until(1.6, 6), Some(15));
        assert_eq!(misses_until(0.3, 120), Some(20));
        assert_eq!(misses_until(0.6, 6), None);
    }

    #[test]
    fn second_derivatives_are_renewed_where_their_prediction_fails() {
        let formed = || {
            let mut second_order = SecondOrder::default();
            second_order.set_matrix(Some(DMatrix::identity(2, 2)));
            second_order
        };
        let next = |second_order: &mut SecondOrder, (ratio, taken), damping, unknowns| {
            let (length, rest) = ((1.0, damping), (1e8, 200));
            second_order.should_form_second_derivatives((ratio, taken), length, rest, unknowns)
        };
        // With S an undamped step within 10 % is predicted well, a damped one within 50 %.
        assert!(next(&mut formed(), (0.8, true), 0.0, 6));
        assert!(!next(&mut formed(), (0.95, true), 0.0, 6));
        assert!(!next(&mut formed(), (0.8, true), 0.5, 6));
        assert!(next(&mut formed(), (0.4, true), 0.5, 6));
        // Not where it was formed at the same point, nor before one step per 40 unknowns.
        assert!(!next(&mut formed(), (-1.0, false), 0.0, 6));
        let mut many = formed();
        assert!(!next(&mut many, (0.8, true), 0.0, 80) && next(&mut many, (0.8, true), 0.0, 80));
        // Nor after convergence.
        let mut retired = formed();
        retired.stop_second_derivatives();
        retired.misses = 1000;
        assert!(!next(&mut retired, (0.1, true), 0.0, 6));
    }

    #[test]
    fn convex_models_underestimate_the_reduction_by_what_made_them_convex() {
        let triangle =
            DMatrix::from_row_slice(3, 3, &[2.0, 0.3, -0.5, 0.0, 1.5, 0.4, 0.0, 0.0, 1.0]);
        let projected = DVector::from_vec(vec![0.7, -1.2, 0.4]);
        let gradient = triangle.tr_mul(&projected);
        let normal = triangle.tr_mul(&triangle);
        let linearisation = Linearisation { cost: 3.0, triangle, projected };
        let scale = DVector::from_vec(vec![2.0, 0.5, 3.0]);
        let face = DMatrix::from_row_slice(1, 3, &[0.0, 0.0, 1.0]);
        for (lowest, is_damped, is_penalised) in
            [(0.1, false, false), (-40.0, false, true), (-40.0, true, true)]
        {
            let mut second = DMatrix::from_diagonal(&DVector::from_vec(vec![0.2, -0.1, lowest]));
            let normals = if is_damped { DMatrix::zeros(0, 3) } else { face.clone() };
            second[(0, 2)] = 0.3;
            second[(2, 0)] = 0.3;
            let mut second_order = SecondOrder::default();
            second_order.set_matrix(Some(second.clone()));
            let convex = second_order.model(&linearisation, &scale, || normals).unwrap();
            assert_eq!(convex.damping > 0.0, is_damped);
            assert_eq!(convex.penalty_rows.nrows() == 1, is_penalised && !is_damped);
            let model = &convex.linearisation;
            for p in [[1.0, 0.0, 0.0], [0.3, -0.4, 0.6], [0.0, 2.0, -1.0]] {
                let p = DVector::from_column_slice(&p);
                let exact = -gradient.dot(&p) - 0.5 * p.dot(&((&normal + &second) * &p));
                let slope = model.triangle.tr_mul(&model.projected).dot(&p);
                let found = -slope - 0.5 * (&model.triangle * &p).norm_squared();
                let under = convex.underestimated_reduction(&p.component_mul(&scale));
                assert!((found + under - exact).abs() < 1e-9 * (1.0 + under), "{found} {under}");
                assert_eq!(under.abs() > 0.0, is_penalised && (is_damped || p[2].abs() > 0.0));
            }
            // Just enough damping: with 1.01 times the lowest curvature the model is flat there.
            if is_damped {
                let lowest = (0..3).fold(&normal + second, |mut hessian, j| {
                    hessian.row_mut(j).scale_mut(scale[j].recip());
                    hessian.column_mut(j).scale_mut(scale[j].recip());
                    hessian
                });
                let lowest = lowest.symmetric_eigenvalues().min();
                assert!((convex.damping / -lowest - 1.01).abs() < 1e-6, "{}", convex.damping);
            }
        }
        assert!(SecondOrder::default().model(&linearisation, &scale, || face).is_none());
    }
}
