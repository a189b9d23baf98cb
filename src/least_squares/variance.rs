//! How large the noise is that residuals and priors together speak for.

use nalgebra::{DMatrix, DVector};

use super::inverse::inverse_rows;
use super::singular::SingularValues;
use super::{Linearisation, Triangle};

/// Weight that turns rows of held combinations into constraints.
const HARD: f64 = 1e5;
/// Variances that are searched, as logarithms of their ratio to the assumed one, and the steps of
/// the search.
const SEARCH: (f64, f64) = (-60.0, 60.0);
const STEPS: u32 = 480;
/// Directions in which a prior reaches the data with more than this part of their variance say
/// nothing of the noise.
const DECIDED: f64 = 0.1;
/// Golden sections of the best step: ln s² is then known to 1e-8.
const SECTIONS: u32 = 40;
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// Restricted likelihood of the variance of the data, priors being what they are.
///
/// Linearised about a fit, the data at the priors' means are y = A z + e with z ∼ N(0, I), e ∼ N(0,
/// s² I): unknowns without a prior are projected out, those with one scaled by it. With A = U
/// diag(a) Vᵀ, c = Uᵀy and m rows that A does not reach,
///
/// −2 ln L(s²) = Σ (ln(s² + a²) + c²/(s² + a²)) + m ln s² + ‖y − U c‖²/s²          [Patterson &
/// Thompson 1971]
///
/// Directions with a² above 0.1 are projected out too: the data decide there, and a prior that they
/// contradict is no noise. s² = 1 is the variance by which the data were whitened.
#[derive(Debug, Clone, PartialEq)]
pub struct VarianceLikelihood {
    /// a² and c² of each direction that a prior reaches.
    directions: Vec<(f64, f64)>,
    /// ‖y − U c‖².
    rest: f64,
    /// m.
    free_rows: f64,
}

impl VarianceLikelihood {
    /// From the linearisation at the unknowns `x` of `rows` rows of data, `squares` being their
    /// ‖r‖²; `priors` holds 1 σ of each unknown's prior, `held` marks unknowns that are not
    /// estimated, and `closed` are rows of combinations that are held.
    pub fn of(
        data: &Linearisation,
        (rows, squares): (usize, f64),
        x: &DVector<f64>,
        priors: &[Option<f64>],
        held: &[bool],
        closed: &DMatrix<f64>,
    ) -> Self {
        let n = x.len();
        let with = |prior: bool| (0..n).filter(move |&j| !held[j] && priors[j].is_some() == prior);
        let (free, known): (Vec<usize>, Vec<usize>) = (with(false).collect(), with(true).collect());
        let width = free.len() + known.len();
        let mut moved = DVector::zeros(n);
        for &j in &known {
            moved[j] = x[j];
        }
        let at_priors = &data.projected - &data.triangle * &moved;
        let height = n + closed.nrows();
        let mut stack = DMatrix::zeros(height.max(width + 1), width + 1);
        for (place, &j) in free.iter().chain(&known).enumerate() {
            let scale = priors[j].unwrap_or(1.0);
            stack.view_mut((0, place), (n, 1)).copy_from(&(data.triangle.column(j) * scale));
            stack
                .view_mut((n, place), (closed.nrows(), 1))
                .copy_from(&(closed.column(j) * (HARD * scale)));
        }
        stack.view_mut((0, width), (n, 1)).copy_from(&at_priors);
        stack.view_mut((n, width), (closed.nrows(), 1)).copy_from(&(closed * moved * -HARD));
        let reduced = Triangle::of(&stack);
        let (first, k) = (free.len(), known.len());
        let left = reduced.view((first, first), (k, k)).into_owned();
        let y = reduced.view((first, width), (k, 1)).column(0).into_owned();
        let rest =
            (squares - data.projected.norm_squared()).max(0.0) + reduced[(width, width)].powi(2);
        let free_rows = (rows + closed.nrows()) as f64 - first as f64;
        // ‖left⁻¹‖² bounds every a² from below: where all directions are projected out, no singular
        // value is needed.
        let inverse = inverse_rows(&left, (0..k).map(|j| (j, 1.0)));
        if inverse.is_some_and(|squares| squares * DECIDED < 1.0) {
            return Self { directions: Vec::new(), rest, free_rows: free_rows - k as f64 };
        }
        // Singular vectors on the left: of the transpose those on the right.
        let SingularValues { values, right } = SingularValues::of(&left.transpose());
        let along = right.tr_mul(&y);
        let mut directions: Vec<(f64, f64)> =
            values.iter().zip(along.iter()).map(|(a, c)| (a * a, c * c)).collect();
        let lost = (y.norm_squared() - along.norm_squared()).max(0.0);
        directions.retain(|(a, _)| *a > 0.0);
        let seen = directions.len() as f64;
        directions.retain(|(a, _)| *a <= DECIDED);
        Self { directions, rest: rest + lost, free_rows: free_rows - seen }
    }

    /// −2 ln L at ln s².
    fn at(&self, log: f64) -> f64 {
        let variance = log.exp();
        let term = |&(a, c): &(f64, f64)| (variance + a).ln() + c / (variance + a);
        self.directions.iter().map(term).sum::<f64>() + self.free_rows * log + self.rest / variance
    }

    /// The s² of the largest likelihood, and by how much 2 ln L is above that of s² = 1.
    pub fn maximum(&self) -> (f64, f64) {
        let step = (SEARCH.1 - SEARCH.0) / f64::from(STEPS);
        let place = |k: u32| SEARCH.0 + f64::from(k) * step;
        let best = (0..=STEPS)
            .map(place)
            .min_by(|a, b| self.at(*a).total_cmp(&self.at(*b)))
            .unwrap_or(0.0);
        let (mut low, mut high) = (best - step, best + step);
        for _ in 0..SECTIONS {
            let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
            if self.at(a) < self.at(b) { high = b } else { low = a }
        }
        let log = 0.5 * (low + high);
        (log.exp(), self.at(0.0) - self.at(log))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::least_squares::Block;

    /// Deterministic numbers with the spread of normal ones.
    fn noise(i: usize) -> f64 {
        let part = |k: usize| ((i * 12 + k) as f64 * 12.9898).sin() * 43_758.545_3 % 1.0;
        (0..12).map(|k| part(k).abs()).sum::<f64>() - 6.0
    }

    fn likelihood(rows: usize, sigma: f64, x: [f64; 2]) -> VarianceLikelihood {
        // y = t x₀ + x₁, the first with a prior, measured in units of 1.
        let mut block = Block::zeros(rows, 2);
        for i in 0..rows {
            let t = i as f64 / rows as f64 - 0.5;
            block.column_mut(0)[i] = t;
            block.column_mut(1)[i] = 1.0;
            block.column_mut(2)[i] = t * x[0] + x[1] + sigma * noise(i);
        }
        let squares = block.column(2).iter().map(|r| r * r).sum();
        let mut triangle = Triangle::new(2);
        triangle.absorb(&mut block);
        let closed = DMatrix::zeros(0, 2);
        let data = triangle.into_linearisation();
        VarianceLikelihood::of(
            &data,
            (rows, squares),
            &DVector::zeros(2),
            &[Some(1.0), None],
            &[false; 2],
            &closed,
        )
    }

    #[test]
    fn the_scatter_is_found_whatever_was_assumed() {
        for sigma in [0.01, 1.0, 30.0] {
            let found = likelihood(200, sigma, [1.5, 7.0]).maximum();
            assert!((found.0.sqrt() / sigma - 1.0).abs() < 0.15, "{sigma}: {found:?}");
            assert_eq!(found.1 > 10.0, (sigma - 1.0).abs() > 1e-9, "{sigma}: {found:?}");
        }
    }

    #[test]
    fn unknowns_far_beyond_their_prior_are_no_noise() {
        let found = likelihood(200, 1.0, [30.0, 7.0]).maximum();
        assert!((found.0.sqrt() - 1.0).abs() < 0.3, "{found:?}");
    }
}
