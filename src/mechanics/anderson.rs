//! Anderson acceleration of a fixed-point iteration.

/// Maximum number of earlier differences of passes that are combined (the depth m of Anderson
/// acceleration).
const MAX_PAIRS: usize = 4;
/// Smallest squared length of the part of a difference that is orthogonal to earlier ones, relative
/// to its squared length, at which the difference is used. A smaller part is a rounding error.
const MIN_INDEPENDENT_PART: f64 = 1e-20;
/// Largest ratio of the residual lengths of two successive passes that counts as a contraction.
/// Slower passes are not accelerated.
const MAX_CONTRACTION: f64 = 0.5;

/// Difference of two residuals g(x) − x, orthogonal to the other pairs, with the difference of the
/// images g(x). `squares` is zero if the pair is linearly dependent.
#[derive(Debug, Clone, Default)]
struct Pair {
    residual: Vec<f64>,
    image: Vec<f64>,
    squares: f64,
}

/// Anderson acceleration of x ← g(x).
///
/// The differences of earlier residuals approximate the current residual, and the same combination
/// of differences of g(x) is subtracted from g(x). [Anderson 1965; Walker & Ni 2011]
#[derive(Debug, Clone, Default)]
pub(super) struct Anderson {
    pairs: [Pair; MAX_PAIRS],
    /// Number of pairs formed since the last pass that was no contraction; the last [`MAX_PAIRS`]
    /// are kept.
    used: usize,
    /// Number of passes since the last restart.
    passes: usize,
    last: Pair,
}

impl Anderson {
    /// Discards all earlier passes, because another fixed-point problem follows.
    pub fn restart(&mut self) {
        (self.used, self.passes) = (0, 0);
    }

    /// Replaces x by the next iterate, given g(x) as `image`.
    pub fn advance(&mut self, x: &mut [f64], image: &[f64]) {
        let Self { pairs, used, passes, last } = self;
        let residual = |k: usize| image[k] - x[k];
        let n = x.len();
        let squares: f64 = (0..n).map(|k| residual(k) * residual(k)).sum();
        if *passes > 0 && squares < MAX_CONTRACTION * MAX_CONTRACTION * last.squares {
            let (oldest, newer) = (*used % MAX_PAIRS, (*used).min(MAX_PAIRS));
            let mut pair = std::mem::take(&mut pairs[oldest]);
            refill(&mut pair.residual, n, |k| residual(k) - last.residual[k]);
            refill(&mut pair.image, n, |k| image[k] - last.image[k]);
            let whole = dot(&pair.residual, &pair.residual);
            let others = pairs[..newer]
                .iter()
                .enumerate()
                .filter(|(k, other)| *k != oldest && other.squares > 0.0);
            for (_, other) in others {
                let part = dot(&pair.residual, &other.residual) / other.squares;
                subtract(&mut pair.residual, part, &other.residual);
                subtract(&mut pair.image, part, &other.image);
            }
            pair.squares = dot(&pair.residual, &pair.residual);
            if pair.squares <= MIN_INDEPENDENT_PART * whole {
                pair.squares = 0.0;
            }
            pairs[oldest] = pair;
            *used += 1;
        } else {
            *used = 0;
        }
        refill(&mut last.residual, n, residual);
        refill(&mut last.image, n, |k| image[k]);
        last.squares = squares;
        *passes += 1;
        x.copy_from_slice(image);
        for pair in pairs[..(*used).min(MAX_PAIRS)].iter().filter(|pair| pair.squares > 0.0) {
            subtract(x, dot(&last.residual, &pair.residual) / pair.squares, &pair.image);
        }
    }
}

fn refill(list: &mut Vec<f64>, n: usize, value: impl Fn(usize) -> f64) {
    list.clear();
    list.extend((0..n).map(value));
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn subtract(a: &mut [f64], factor: f64, b: &[f64]) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a -= factor * b);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contraction of three unknowns with two slow directions and weak nonlinearity.
    fn image(x: &[f64]) -> Vec<f64> {
        let [a, b, c] = [x[0], x[1], x[2]];
        vec![
            1.0 + 0.3 * a - 0.1 * b + 0.01 * a * c,
            2.0 + 0.1 * a + 0.2 * b,
            -1.0 + 0.05 * b * b - 0.02 * c,
        ]
    }

    /// Returns the passes until the residual is below rounding, and the fixed point.
    fn passes(mut next: impl FnMut(&mut Vec<f64>, &[f64])) -> (usize, Vec<f64>) {
        let mut x = vec![0.0; 3];
        for pass in 1.. {
            let g = image(&x);
            if x.iter().zip(&g).all(|(x, g)| (x - g).abs() < 1e-13) {
                return (pass, x);
            }
            next(&mut x, &g);
        }
        unreachable!()
    }

    #[test]
    fn fewer_passes_lead_to_the_same_point() {
        let (plain, there) = passes(|x, g| x.copy_from_slice(g));
        let mut anderson = Anderson::default();
        let (accelerated, here) = passes(|x, g| anderson.advance(x, g));
        assert!(2 * accelerated <= plain, "{accelerated} passes, {plain} without");
        assert!(there.iter().zip(&here).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
