//! Choice of poses one after the other, each where it lowers the mean variance of predictions most.

use nalgebra::{DMatrix, SMatrix};

use super::views::COMPRESSED_ROWS;
use crate::numeric::parallel;
use crate::numeric::product;

/// Number of candidates that one thread evaluates at a time.
const BLOCK_CANDIDATES: usize = 128;

/// Covariance of the unknowns, with the products by which every candidate is evaluated.
///
/// An additional pose J changes C to C − W S⁻¹ Wᵀ with W = C Jᵀ and S = I + J C Jᵀ. The goal tr(C
/// M) falls by tr(S⁻¹ Wᵀ M W). V = C Jᵀ and T = M V of all candidates follow each chosen pose by
/// updates of rank 3 (6 with orientation, 12 for views of cameras). One pose costs a number of
/// operations proportional to unknowns times candidates. [Fedorov 1972, ch. 3]
pub(super) struct Greedy<'a> {
    /// Jᵀ of all candidates, shape = (unknowns, coordinates · candidates).
    candidates: &'a DMatrix<f64>,
    coordinates: usize,
    /// Weights M of the goal tr(C M), shape = (unknowns, unknowns).
    goal: &'a DMatrix<f64>,
    /// Covariance C of the unknowns, shape = (unknowns, unknowns).
    pub covariance: DMatrix<f64>,
    /// Products V = C Jᵀ of the covariance C and the Jacobians J of all candidates, shape =
    /// (unknowns, coordinates · candidates).
    v: DMatrix<f64>,
    /// Products T = M C Jᵀ of all candidates, shape = (unknowns, coordinates · candidates).
    t: DMatrix<f64>,
}

impl<'a> Greedy<'a> {
    /// Starts from the information before any candidate is measured; `None` if it is singular.
    /// `candidates` holds the Jᵀ, with `coordinates` columns for each, and `goal` the weights M of
    /// tr(C M).
    pub fn new(
        (candidates, coordinates): (&'a DMatrix<f64>, usize),
        goal: &'a DMatrix<f64>,
        information: &DMatrix<f64>,
    ) -> Option<Self> {
        let covariance = information.clone().cholesky()?.inverse();
        let v = product(&covariance, candidates);
        let t = product(goal, &v);
        Some(Self { candidates, coordinates, goal, covariance, v, t })
    }

    /// Returns the goal tr(C M).
    pub fn value(&self) -> f64 {
        self.covariance.dot(self.goal)
    }

    /// Returns the decrease of the goal tr(C M) by each candidate.
    pub fn gains(&self) -> Vec<f64> {
        let count = self.candidates.ncols() / self.coordinates;
        let of_block = |block: usize| -> Vec<f64> {
            let start = block * BLOCK_CANDIDATES;
            let gain = |k| match self.coordinates {
                6 => self.gain::<6>(k),
                COMPRESSED_ROWS => self.gain::<COMPRESSED_ROWS>(k),
                _ => self.gain::<3>(k),
            };
            (start..(start + BLOCK_CANDIDATES).min(count)).map(gain).collect()
        };
        parallel::joined(parallel::map(count.div_ceil(BLOCK_CANDIDATES), of_block))
    }

    /// Returns the decrease of the goal by one candidate with R coordinates.
    fn gain<const R: usize>(&self, candidate: usize) -> f64 {
        let columns = R * candidate;
        let dot = |a: &DMatrix<f64>, i: usize, b: &DMatrix<f64>, j: usize| {
            a.column(columns + i).dot(&b.column(columns + j))
        };
        let mut s = SMatrix::<f64, R, R>::identity();
        let mut lowered = SMatrix::<f64, R, R>::zeros();
        for i in 0..R {
            for j in i..R {
                s[(i, j)] += dot(self.candidates, i, &self.v, j);
                s[(j, i)] = s[(i, j)];
                lowered[(i, j)] = dot(&self.v, i, &self.t, j);
                lowered[(j, i)] = lowered[(i, j)];
            }
        }
        s.cholesky().map_or(0.0, |factor| factor.solve(&lowered).trace())
    }

    /// Adds a candidate to the measured poses: updates C, V and T.
    pub fn take(&mut self, candidate: usize) {
        let columns = self.coordinates * candidate;
        let [j, w, m] = [self.candidates, &self.v, &self.t]
            .map(|of| of.columns(columns, self.coordinates).into_owned());
        let s = DMatrix::identity(self.coordinates, self.coordinates) + j.tr_mul(&w);
        let Some(inverse) = s.cholesky().map(|factor| factor.inverse()) else { return };
        // The products J W of all candidates.
        let cross = w.tr_mul(self.candidates);
        let (moved, moved_goal) = (&w * &inverse, m * &inverse);
        self.covariance.gemm(-1.0, &moved, &w.transpose(), 1.0);
        self.v.gemm(-1.0, &moved, &cross, 1.0);
        self.t.gemm(-1.0, &moved_goal, &cross, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random;

    #[test]
    fn gains_after_updates_are_those_of_the_inverse_information() {
        let mut random = random::stream(1, 0);
        let mut draw = |_, _| random::normal(&mut random);
        let (candidates, root) =
            (DMatrix::from_fn(7, 3 * 5, &mut draw), DMatrix::from_fn(7, 7, &mut draw));
        let goal = &root * root.transpose();
        let mut information = DMatrix::identity(7, 7);
        let value = |information: &DMatrix<f64>| {
            information.clone().try_inverse().map_or(f64::NAN, |inverse| inverse.dot(&goal))
        };
        let greedy = Greedy::new((&candidates, 3), &goal, &information);
        assert!(greedy.is_some());
        let Some(mut greedy) = greedy else { return };
        for chosen in [2, 4, 2] {
            let j = candidates.columns(3 * chosen, 3);
            let gain = greedy.gains()[chosen];
            let before = value(&information);
            information += j * j.transpose();
            assert!((before - value(&information) - gain).abs() < 1e-10 * before);
            greedy.take(chosen);
            assert!((greedy.value() - value(&information)).abs() < 1e-10 * before);
        }
    }
}
