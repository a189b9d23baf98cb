//! Reproducible random numbers, the same on every machine and for any number of threads.

use std::f64::consts::TAU;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Returns stream number `stream` of the generator with this seed. Streams are independent: numbers
/// drawn from one do not change those of another.
pub(crate) fn stream(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream);
    random
}

/// Returns a standard normal number, √(−2 ln(1 − u)) cos 2πv with u, v uniform in [0, 1) [Box &
/// Muller 1958].
///
/// The method must not change: the published simulated measurements come from it, and another
/// method would give others for the same seed.
pub(crate) fn normal(random: &mut ChaCha8Rng) -> f64 {
    let (u, v): (f64, f64) = (random.random(), random.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (TAU * v).cos()
}
