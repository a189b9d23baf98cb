//! Random choices of a case.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use nalgebra::Vector3;

/// Random numbers of one case; they depend on its number alone.
pub struct Draw(ChaCha8Rng);

impl Draw {
    pub fn new(k: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(k))
    }

    /// Returns random numbers for a change of case `k`, independent of those that made it; each
    /// kind of change has its own `stream` from 1 on.
    pub fn of_change(k: u64, stream: u64) -> Self {
        let mut numbers = ChaCha8Rng::seed_from_u64(k);
        numbers.set_stream(stream);
        Self(numbers)
    }

    /// Draws evenly from `low` to `high`, rounded to a ten-thousandth as people write numbers.
    pub fn number(&mut self, low: f64, high: f64) -> f64 {
        (self.0.random_range(low..=high) * 1e4).round() / 1e4
    }

    /// Draws evenly from `low` to `high` with all digits.
    pub fn even(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..=high)
    }

    pub fn whole(&mut self, low: usize, high: usize) -> usize {
        self.0.random_range(low..=high)
    }

    /// Returns true with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.0.random::<f64>() < probability
    }

    pub fn pick<T: Clone>(&mut self, of: &[T]) -> T {
        of[self.0.random_range(0..of.len())].clone()
    }

    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    pub fn normals(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| sigma * self.normal())
    }

    /// Draws a vector whose coordinates are even within ±`size`.
    pub fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.number(-size, size))
    }

    pub fn shuffle<T>(&mut self, list: &mut [T]) {
        for k in (1..list.len()).rev() {
            list.swap(k, self.whole(0, k));
        }
    }
}
