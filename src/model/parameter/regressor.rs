//! What a parameter is multiplied by, pose by pose.

use crate::problem::{PoseView, ThermalLag};

/// The known quantity of a pose that scales a parameter's part in a joint's coordinate or in the
/// observation.
///
/// Joints are counted from 0, [`Regressor::command`] takes the numbers of files; configurations are
/// those commanded.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Regressor {
    /// 1: the parameter acts the same in every pose.
    Constant,
    /// 1, for what is added to a parameter that acts at the same place.
    Unit,
    /// q of a joint that turns \[rad\].
    Command(usize),
    /// q of a joint that slides \[m\].
    Travel(usize),
    /// sin kq.
    Sine(usize, u32),
    /// cos kq.
    Cosine(usize, u32),
    /// sin(kq + φ) of an order k that need be no whole number.
    Wave {
        /// The joint.
        joint: usize,
        /// k, cycles a revolution.
        order: f64,
        /// φ \[rad\].
        phase: f64,
    },
    /// Temperature above the reference \[K\].
    Warming {
        /// T₀ [°C].
        reference: f64,
    },
    /// The same of what follows the temperature with a time constant.
    Lagging {
        /// T₀ [°C].
        reference: f64,
        /// τ \[s\].
        time_constant: f64,
    },
    /// Which part of its friction pulls a joint back the way on which it came, −1 to 1
    /// ([`dragged`](crate::problem::Past::friction_state)).
    Dragged {
        /// The joint.
        joint: usize,
        /// The way on which that turns over, s \[rad\] or \[m\].
        distance: f64,
    },
    /// Time since the first pose \[s\].
    Elapsed,
    /// 1 from a time on \[s\], 0 before.
    Since(f64),
    /// 1 − exp(−t/τ), t since the first pose, of a time constant τ \[s\].
    Settling(f64),
    /// Half the payload, with the sign of the direction from which a joint came \[kg\]; 0 where
    /// that is not known.
    LoadedSide {
        /// The joint.
        joint: usize,
        /// Payload that the problem declares \[kg\]: that of poses of which none is known.
        declared: f64,
    },
    /// One of the problem's own covariates, counted from 0, in its unit.
    Covariate(usize),
    /// A cubic B-spline of one quantity of the pose, nought outside of its four intervals.
    Spline {
        /// The quantity.
        of: Quantity,
        /// Where it begins, in the quantity's unit.
        begin: f64,
        /// Length of an interval.
        step: f64,
    },
    /// exp(−u²/2) with u = (quantity − centre) / width.
    Bump {
        /// The quantity.
        of: Quantity,
        /// Where it is highest, in the quantity's unit.
        centre: f64,
        /// Its width, in the quantity's unit.
        width: f64,
    },
    /// tanh u with u = (quantity − centre) / width.
    Step {
        /// The quantity.
        of: Quantity,
        /// Where it is steepest, in the quantity's unit.
        centre: f64,
        /// Its width, in the quantity's unit.
        width: f64,
    },
}

/// A quantity that is known of every pose; joints are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Quantity {
    /// q of a joint \[rad\] or \[m\], joints counted from 0.
    Command(usize),
    /// Temperature [°C].
    Temperature,
    /// Time since the first pose \[s\].
    Elapsed,
    /// Payload \[kg\].
    Payload,
    /// Hoist force \[N\].
    Hoist,
    /// One of the problem's own covariates, counted from 0, in its unit.
    Covariate(usize),
}

impl Quantity {
    /// Its value in a pose; 0 where nobody knows.
    pub fn value(self, setup: &PoseView) -> f64 {
        match self {
            Self::Command(joint) => setup.configuration[joint],
            Self::Temperature => setup.temperature.copied().unwrap_or(0.0),
            Self::Elapsed => setup.elapsed,
            Self::Payload => setup.payload.copied().unwrap_or(0.0),
            Self::Hoist => setup.hoist.copied().unwrap_or(0.0),
            Self::Covariate(which) => setup.covariates.get(which).copied().unwrap_or(0.0),
        }
    }
}

impl Regressor {
    /// Its values in some poses, the faster the more of them follow one another.
    pub(crate) fn values<'p>(self, poses: impl Iterator<Item = &'p PoseView<'p>>) -> Vec<f64> {
        let Self::Lagging { reference, time_constant } = self else {
            return poses.map(|own| self.value(own)).collect();
        };
        let mut lag = ThermalLag::new(time_constant);
        let felt = |own: &PoseView| {
            own.temperature.map(|&now| lag.advance(&own.past.read(), (own.time, now)) - reference)
        };
        poses.map(felt).map(|warming| warming.unwrap_or(0.0)).collect()
    }

    /// Its value in a pose.
    pub fn value(self, setup: &PoseView) -> f64 {
        match self {
            Self::Constant | Self::Unit => 1.0,
            Self::Command(joint) | Self::Travel(joint) => setup.configuration[joint],
            Self::Sine(joint, order) => (f64::from(order) * setup.configuration[joint]).sin(),
            Self::Cosine(joint, order) => (f64::from(order) * setup.configuration[joint]).cos(),
            Self::Wave { joint, order, phase } => {
                (order * setup.configuration[joint] + phase).sin()
            }
            Self::Warming { reference } => {
                setup.temperature.map_or(0.0, |temperature| temperature - reference)
            }
            Self::Lagging { reference, time_constant } => {
                setup.temperature.map_or(0.0, |&temperature| {
                    setup.past.read().lagged_temperature((setup.time, temperature), time_constant)
                        - reference
                })
            }
            Self::Dragged { joint, distance } => {
                let side =
                    setup.approach.and_then(|sides| sides.get(joint).copied()).unwrap_or(0.0);
                setup.past.read().friction_state(
                    joint,
                    (setup.configuration[joint], side),
                    distance,
                )
            }
            Self::Elapsed => setup.elapsed,
            Self::Since(time) => f64::from(setup.time >= time),
            Self::Settling(time_constant) => -(-setup.elapsed / time_constant).exp_m1(),
            Self::LoadedSide { joint, declared } => {
                let side =
                    setup.approach.and_then(|sides| sides.get(joint).copied()).unwrap_or(0.0);
                0.5 * setup.payload.copied().unwrap_or(declared) * side
            }
            Self::Covariate(which) => Quantity::Covariate(which).value(setup),
            Self::Spline { of, .. } | Self::Bump { of, .. } | Self::Step { of, .. } => {
                self.at(of.value(setup))
            }
        }
    }

    /// The value of a function of one quantity at a value of that quantity; 0 for other regressors.
    pub fn at(self, quantity: f64) -> f64 {
        match self {
            Self::Spline { begin, step, .. } => cubic((quantity - begin) / step),
            Self::Bump { centre, width, .. } => {
                (-0.5 * ((quantity - centre) / width).powi(2)).exp()
            }
            Self::Step { centre, width, .. } => ((quantity - centre) / width).tanh(),
            _ => 0.0,
        }
    }

    /// Derivative of its value by the command of a joint, counted from 0.
    pub fn slope(self, setup: &PoseView, joint: usize) -> f64 {
        let order = |order: u32| f64::from(order);
        match self {
            Self::Command(own) | Self::Travel(own) if own == joint => 1.0,
            Self::Sine(own, k) if own == joint => {
                order(k) * (order(k) * setup.configuration[joint]).cos()
            }
            Self::Cosine(own, k) if own == joint => {
                -order(k) * (order(k) * setup.configuration[joint]).sin()
            }
            Self::Wave { joint: own, order, phase } if own == joint => {
                order * (order * setup.configuration[joint] + phase).cos()
            }
            Self::Spline { of: Quantity::Command(own), begin, step } if own == joint => {
                cubic_slope((setup.configuration[joint] - begin) / step) / step
            }
            Self::Bump { of: Quantity::Command(own), centre, width } if own == joint => {
                let u = (setup.configuration[joint] - centre) / width;
                -u / width * (-0.5 * u * u).exp()
            }
            Self::Step { of: Quantity::Command(own), centre, width } if own == joint => {
                (1.0 - ((setup.configuration[joint] - centre) / width).tanh().powi(2)) / width
            }
            Self::Dragged { joint: own, distance } if own == joint => {
                let side =
                    setup.approach.and_then(|sides| sides.get(joint).copied()).unwrap_or(0.0);
                setup.past.read().friction_state_slope(
                    joint,
                    (setup.configuration[joint], side),
                    distance,
                )
            }
            _ => 0.0,
        }
    }

    /// Whether it depends on what the joints are told.
    pub fn follows_commands(self) -> bool {
        match self {
            Self::Command(_)
            | Self::Travel(_)
            | Self::Sine(..)
            | Self::Cosine(..)
            | Self::Wave { .. }
            | Self::Dragged { .. } => true,
            Self::Spline { of, .. } | Self::Bump { of, .. } | Self::Step { of, .. } => {
                matches!(of, Quantity::Command(_))
            }
            Self::Constant
            | Self::Unit
            | Self::Warming { .. }
            | Self::Lagging { .. }
            | Self::Elapsed
            | Self::Since(_)
            | Self::Settling(_)
            | Self::LoadedSide { .. }
            | Self::Covariate(_) => false,
        }
    }

    /// Whether the parameter acts the same in every pose.
    pub fn is_constant(self) -> bool {
        self == Self::Constant
    }
}

/// Orders that a wave may be above the one before it to be had from it by steps: a sine and a
/// cosine cost more than so many.
const NEAR: u32 = 4;

/// The values of many regressors in one pose: a wave takes its sine and cosine from the one before it
/// where their orders are near.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Waves {
    /// Joint and order of the last wave, with its sine and cosine.
    last: Option<(usize, u32, (f64, f64))>,
    /// sin q and cos q of that joint, once needed.
    first: Option<(f64, f64)>,
}

impl Waves {
    /// The value of a regressor in the pose that all others were of.
    #[inline]
    pub fn value(&mut self, regressor: Regressor, setup: &PoseView) -> f64 {
        match regressor {
            Regressor::Sine(joint, order) => self.wave(joint, order, setup).0,
            Regressor::Cosine(joint, order) => self.wave(joint, order, setup).1,
            other => other.value(setup),
        }
    }

    /// sin kq and cos kq.
    fn wave(&mut self, joint: usize, order: u32, setup: &PoseView) -> (f64, f64) {
        let q = setup.configuration[joint];
        let wave = match self.last {
            Some((own, last, wave)) if own == joint && last == order => return wave,
            Some((own, last, mut wave)) if own == joint && last < order && order - last <= NEAR => {
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

/// The uniform cubic B-spline over the intervals 0…4; its shifts by whole numbers add up to 1.
fn cubic(u: f64) -> f64 {
    let v = 2.0 - (u - 2.0).abs();
    match v {
        v if v <= 0.0 => 0.0,
        v if v <= 1.0 => v * v * v / 6.0,
        v => {
            let w = 2.0 - v;
            (4.0 - 6.0 * w * w + 3.0 * w * w * w) / 6.0
        }
    }
}

/// The derivative of [`cubic`].
fn cubic_slope(u: f64) -> f64 {
    let v = 2.0 - (u - 2.0).abs();
    let slope = match v {
        v if v <= 0.0 => 0.0,
        v if v <= 1.0 => v * v / 2.0,
        v => {
            let w = 2.0 - v;
            2.0 * w - 1.5 * w * w
        }
    };
    if u > 2.0 { -slope } else { slope }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_of_unknown_payload_carries_the_declared_one() {
        let regressor = Regressor::LoadedSide { joint: 1, declared: 3.0 };
        let sides = [1.0, -1.0];
        let pose = PoseView { approach: Some(&sides), ..PoseView::from_configuration(&[0.0, 0.0]) };
        assert!((regressor.value(&pose) + 1.5).abs() < 1e-15);
        assert!((regressor.value(&PoseView { payload: Some(&2.0), ..pose }) + 1.0).abs() < 1e-15);
    }

    #[test]
    fn slopes_are_those_of_the_values() {
        let of = Quantity::Command(1);
        let regressors = [
            Regressor::Command(1),
            Regressor::Travel(0),
            Regressor::Sine(1, 3),
            Regressor::Cosine(1, 2),
            Regressor::Wave { joint: 1, order: 2.43, phase: 0.7 },
            Regressor::Elapsed,
            Regressor::Spline { of, begin: -1.0, step: 0.7 },
            Regressor::Spline { of: Quantity::Payload, begin: -1.0, step: 0.7 },
            Regressor::Bump { of, centre: 0.4, width: 0.3 },
            Regressor::Step { of, centre: 0.4, width: 0.3 },
        ];
        for regressor in regressors {
            for k in -20..20 {
                let at = |q: f64| regressor.value(&PoseView::from_configuration(&[0.2, q]));
                let (q, step) = (0.093 * f64::from(k), 1e-5);
                let expected = (at(q + step) - at(q - step)) / (2.0 * step);
                let slope = regressor.slope(&PoseView::from_configuration(&[0.2, q]), 1);
                assert!(
                    (slope - expected).abs() < 1e-8,
                    "{regressor:?} at {q}: {slope}, not {expected}"
                );
            }
        }
    }

    #[test]
    fn waves_that_follow_each_other_are_those_by_themselves() {
        let setup = PoseView::from_configuration(&[0.7, -2.3]);
        let mut waves = Waves::default();
        let orders = (1..=60).chain([3, 4, 4, 6, 9, 13, 18]);
        for (order, joint) in
            orders.flat_map(|order| [(order, 1), (order, 1), (order, order as usize % 2)])
        {
            for regressor in [
                Regressor::Sine(joint, order),
                Regressor::Cosine(joint, order),
                Regressor::Command(joint),
            ] {
                let (found, expected) = (waves.value(regressor, &setup), regressor.value(&setup));
                assert!((found - expected).abs() < 1e-13, "{regressor:?}: {found}, not {expected}");
            }
        }
        let mut waves = Waves::default();
        for regressor in
            (1..=60).flat_map(|order| [Regressor::Sine(0, order), Regressor::Cosine(0, order)])
        {
            assert!((waves.value(regressor, &setup) - regressor.value(&setup)).abs() < 1e-13);
        }
    }

    #[test]
    fn splines_add_up_to_one() {
        for k in 0..40 {
            let u = 0.025 * f64::from(k);
            let sum: f64 = (0..4).map(|shift| cubic(u + f64::from(shift))).sum();
            assert!((sum - 1.0).abs() < 1e-14, "{u}: {sum}");
        }
    }
}
