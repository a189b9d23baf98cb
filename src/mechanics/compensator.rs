//! Gravity compensator: a spring that relieves a joint of part of its moment.

use crate::scalar::Scalar;

/// Smallest length of a spring, relative to its longer lever, at which its pull has a direction.
/// Below it the ends coincide to rounding.
const MIN_RELATIVE_LENGTH: f64 = 1e-9;

/// Spring between the part before a joint and the link behind it, in the plane across the joint's
/// axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compensator<S> {
    /// End A on the part before the joint \[m\]: x and y of the frame before the joint's rotation,
    /// whose origin lies on the axis.
    pub anchor: [f64; 2],
    /// End B on the link behind the joint \[m\]: x and y of the frame after the joint's rotation.
    pub lever: [f64; 2],
    /// Length l₀ at which the pull equals the preload \[m\].
    pub free_length: f64,
    /// Spring rate k [N/m].
    pub rate: S,
    /// Preload F₀ at length l₀ \[N\].
    pub preload: S,
}

impl<S: Scalar> Compensator<S> {
    /// Returns the moment about the joint's axis on the link behind it [N·m], which adds to that of
    /// the loads beyond the joint.
    ///
    /// τ = F · `(P × A)_z` / l,  F = k (l − l₀) + F₀,  P = Rz(φ) B,  l = |A − P|
    ///
    /// `angle` is (sin, cos) of φ = θ + q, including the joint's twist. F > 0 pulls the ends
    /// together: τ > 0 turns B towards A about +z. `(P × A)_z` / l is the distance of the line of
    /// pull from the axis. Where the ends meet, that line has no direction; then only the part k l
    /// of F counts, whose moment k `(P × A)_z` is smooth. The parts between axis and ends are
    /// rigid.
    pub fn moment(&self, (sin, cos): (S, S)) -> S {
        let ([ax, ay], [bx, by]) = (self.anchor, self.lever);
        let (px, py) = (cos * bx - sin * by, sin * bx + cos * by);
        let area = px * ay - py * ax;
        let (x, y) = (px - ax, py - ay);
        let square = x * x + y * y;
        let least = MIN_RELATIVE_LENGTH * ax.hypot(ay).max(bx.hypot(by));
        if square.re() <= least * least {
            return self.rate * area;
        }
        // F / l = k + (F₀ − k l₀) / l
        (self.rate + (self.preload - self.rate * self.free_length) / square.sqrt()) * area
    }
}

impl Compensator<f64> {
    /// Converts the spring to another scalar type, with constant parameters.
    pub(super) fn lift<S: Scalar>(&self) -> Compensator<S> {
        Compensator {
            anchor: self.anchor,
            lever: self.lever,
            free_length: self.free_length,
            rate: S::from(self.rate),
            preload: S::from(self.preload),
        }
    }
}

#[cfg(test)]
mod tests {
    use num_dual::{Dual64, DualNum as _};

    use super::*;

    fn spring(rate: f64, preload: f64) -> Compensator<f64> {
        Compensator { anchor: [0.0, 0.4], lever: [0.3, 0.0], free_length: 0.2, rate, preload }
    }

    #[test]
    fn a_spring_of_a_right_angle_pulls_with_its_height_over_the_hypotenuse() {
        // Sides of 0.3, 0.4 and 0.5 m: F = k (0.5 − 0.2) + F₀ acts 0.24 m from the axis and turns
        // the link from x towards y.
        let (k, f) = (2e3, 150.0);
        let moment = spring(k, f).moment((0.0, 1.0));
        assert!((moment - (k * 0.3 + f) * 0.24).abs() < 1e-10, "{moment} N·m");
        // At half a turn the pull is reversed; in line with the axis it has no moment.
        let half_turn = spring(k, f).moment((0.0, -1.0));
        assert!((half_turn + moment).abs() < 1e-10, "{half_turn} N·m");
        assert!(spring(k, f).moment((1.0, 0.0)).abs() < 1e-10);
    }

    #[test]
    fn without_free_length_it_is_a_sine() {
        let spring = Compensator { free_length: 0.0, ..spring(5e3, 0.0) };
        for angle in [-2.0, -0.3, 0.0, 0.7, 3.0_f64] {
            let expected = 5e3 * 0.3 * 0.4 * angle.cos();
            assert!((spring.moment(angle.sin_cos()) - expected).abs() < 1e-9, "{angle} rad");
        }
    }

    #[test]
    fn its_derivatives_are_numbers_where_its_ends_meet() {
        let spring = Compensator { anchor: [0.3, 0.0], ..spring(1e5, 1e4) };
        for angle in [0.0, 1e-200, 1e-12, 1e-9, 1e-6] {
            for seeded in 0..3 {
                let seed =
                    |value: f64, number| Dual64::new(value, f64::from(u8::from(seeded == number)));
                let mut seeded_spring = spring.lift::<Dual64>();
                (seeded_spring.rate, seeded_spring.preload) = (seed(1e5, 0), seed(1e4, 1));
                let moment = seeded_spring.moment(seed(angle, 2).sin_cos());
                assert!(
                    moment.re.is_finite() && moment.eps.is_finite(),
                    "{angle} rad, {seeded}: {moment}"
                );
            }
        }
    }

    #[test]
    fn close_ends_are_pulled_along_the_line_between_them() {
        // The ends are 0.3 m from the axis and 0.3 · 1e-6 m apart: F = F₀ − k l₀ across the lever.
        let spring = Compensator { anchor: [0.3, 0.0], ..spring(1e3, 900.0) };
        let moment = spring.moment(1e-6_f64.sin_cos());
        assert!((moment + 0.3 * (900.0 - 1e3 * 0.2)).abs() < 1e-3, "{moment} N·m");
    }
}
