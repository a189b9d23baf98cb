//! Values of many regressors in one pose, with harmonics computed from one another.

use super::regressor::Regressor;
use crate::problem::PoseView;

/// Largest difference in order between two harmonics of a joint that recurrence bridges. For a
/// larger one, computing sine and cosine is cheaper.
const MAX_ORDER_STEPS: u32 = 4;

/// Evaluates many regressors in one pose. A harmonic is computed by recurrence from the last one if
/// its order is at most [`MAX_ORDER_STEPS`] higher.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Waves {
    /// Joint and order k of the last harmonic, with its (sin kq, cos kq).
    last: Option<(usize, u32, (f64, f64))>,
    /// Values (sin q, cos q) of the command q of the joint in `last`; `None` until they are needed.
    first: Option<(f64, f64)>,
}

impl Waves {
    /// Returns the value of a regressor in `setup`. All calls on one instance must use the same
    /// pose.
    #[inline]
    pub fn value(&mut self, regressor: &Regressor, setup: &PoseView) -> f64 {
        match regressor {
            Regressor::Sine(joint, order) => self.wave(*joint, *order, setup).0,
            Regressor::Cosine(joint, order) => self.wave(*joint, *order, setup).1,
            other => other.value(setup),
        }
    }

    /// Returns (sin kq, cos kq) of a joint's command q for the order k.
    fn wave(&mut self, joint: usize, order: u32, setup: &PoseView) -> (f64, f64) {
        let q = setup.configuration[joint];
        let wave = match self.last {
            Some((of, last, wave)) if of == joint && last == order => return wave,
            Some((of, last, mut wave))
                if of == joint && last < order && order - last <= MAX_ORDER_STEPS =>
            {
                let (by_sin, by_cos) = *self.first.get_or_insert_with(|| q.sin_cos());
                for _ in last..order {
                    let (sin, cos) = wave;
                    wave = (sin * by_cos + cos * by_sin, cos * by_cos - sin * by_sin);
                }
                wave
            }
            _ => {
                let wave = (f64::from(order) * q).sin_cos();
                self.first = (order == 1).then_some(wave);
                wave
            }
        };
        self.last = Some((joint, order, wave));
        wave
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::Problem;

    #[test]
    fn waves_that_follow_each_other_are_those_by_themselves() {
        let setup = PoseView::from_configuration(&[0.7, -2.3]);
        let mut waves = Waves::default();
        let orders = (1..=60).chain([3, 4, 4, 6, 9, 13, 18]);
        let arm = "name = 'arm'\njoint = [{}, {}]\n";
        let problem = Problem::parse(arm, "problem.toml".as_ref()).unwrap();
        let command = Regressor::parse("q2", &problem).unwrap();
        for (order, joint) in
            orders.flat_map(|order| [(order, 1), (order, 1), (order, order as usize % 2)])
        {
            for regressor in
                [&Regressor::Sine(joint, order), &Regressor::Cosine(joint, order), &command]
            {
                let (found, expected) = (waves.value(regressor, &setup), regressor.value(&setup));
                assert!((found - expected).abs() < 1e-13, "{regressor:?}: {found}, not {expected}");
            }
        }
        let mut waves = Waves::default();
        for regressor in
            (1..=60).flat_map(|order| [Regressor::Sine(0, order), Regressor::Cosine(0, order)])
        {
            assert!((waves.value(&regressor, &setup) - regressor.value(&setup)).abs() < 1e-13);
        }
    }
}
