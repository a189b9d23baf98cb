//! Units of expressions, as powers of base units.

use super::tree::Operator;

/// Number of base units of formulas: rad, m, K, kg, s, N, and the unit of a covariate.
const BASES: usize = 7;
/// Symbols of the base units, in the order of the powers.
const SYMBOLS: [&str; BASES] = ["rad", "m", "K", "kg", "s", "N", "units of the covariate"];

/// Unit of an expression as powers of base units.
///
/// Literal numbers and named parameters may have any unit, so a product with one of them is
/// `flexible`: its unit is not determined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dimension {
    powers: [i32; BASES],
    flexible: bool,
    /// True if the powers do not tell the unit: that of a root, or of a power that is fitted.
    untold: bool,
}

/// Unit of a formula, by which a site's unit is divided to give the unit of the term's coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Per {
    /// No unit.
    #[default]
    Number,
    /// Angle \[rad\].
    Angle,
    /// Length \[m\].
    Length,
    /// Temperature difference \[K\].
    Kelvin,
    /// Mass \[kg\].
    Mass,
    /// Time \[s\].
    Second,
    /// Torque [N·m].
    Torque,
    /// Torque times mass [N·m·kg].
    TorqueMass,
    /// Unit of a covariate, which the problem declares, or a unit that is not determined.
    Covariate,
    /// Product of powers of the base units that is none of the other units.
    Product([i32; BASES]),
}

impl Per {
    /// Returns the power of each base unit.
    pub fn powers(self) -> [i32; BASES] {
        let of = match self {
            Self::Number => Dimension::PLAIN,
            Self::Angle => Dimension::ANGLE,
            Self::Length => Dimension::LENGTH,
            Self::Kelvin => Dimension::KELVIN,
            Self::Mass => Dimension::MASS,
            Self::Second => Dimension::SECOND,
            Self::Torque => Dimension::TORQUE,
            Self::TorqueMass => Dimension::TORQUE_MASS,
            Self::Covariate => Dimension::COVARIATE,
            Self::Product(powers) => return powers,
        };
        of.powers
    }
}

impl Dimension {
    /// Unit of a number without unit.
    pub(super) const PLAIN: Self = Self { powers: [0; BASES], flexible: false, untold: false };
    /// Unit of a literal or parameter, which may be any.
    pub(super) const FLEXIBLE: Self = Self { powers: [0; BASES], flexible: true, untold: false };
    pub(super) const ANGLE: Self = Self::base(0);
    pub(super) const LENGTH: Self = Self::base(1);
    pub(super) const KELVIN: Self = Self::base(2);
    pub(super) const MASS: Self = Self::base(3);
    pub(super) const SECOND: Self = Self::base(4);
    pub(super) const FORCE: Self = Self::base(5);
    /// Unit of torque, N·m.
    pub(super) const TORQUE: Self = Self { powers: [0, 1, 0, 0, 0, 1, 0], ..Self::base(5) };
    /// Unit of torque times mass, N·m·kg.
    pub(super) const TORQUE_MASS: Self = Self { powers: [0, 1, 0, 1, 0, 1, 0], ..Self::base(5) };
    pub(super) const COVARIATE: Self = Self { flexible: true, ..Self::base(6) };

    const fn base(index: usize) -> Self {
        let mut powers = [0; BASES];
        powers[index] = 1;
        Self { powers, flexible: false, untold: false }
    }

    /// Returns this unit as the one by which the unit of a coefficient is divided.
    pub fn per(self) -> Per {
        if self.untold {
            return Per::Covariate;
        }
        let is = |of: Self| self.powers == of.powers;
        let denominators = [
            (Self::ANGLE, Per::Angle),
            (Self::LENGTH, Per::Length),
            (Self::KELVIN, Per::Kelvin),
            (Self::MASS, Per::Mass),
            (Self::SECOND, Per::Second),
            (Self::TORQUE, Per::Torque),
            (Self::TORQUE_MASS, Per::TorqueMass),
            (Self::COVARIATE, Per::Covariate),
        ];
        let named = denominators.into_iter().find(|(of, _)| is(*of)).map(|(_, per)| per);
        let has_unit = self.powers.iter().any(|power| *power != 0);
        named.unwrap_or(if has_unit { Per::Product(self.powers) } else { Per::Number })
    }

    /// Returns true if a function such as `sin` accepts an expression with this unit: it has no
    /// unit, is a power of an angle, or is not determined.
    pub(super) fn is_plain(self) -> bool {
        self.flexible || self.powers[1..].iter().all(|power| *power == 0)
    }

    /// Returns the unit of a product (`sign` = 1) or quotient (`sign` = −1).
    pub(super) fn product(self, other: Self, sign: i32) -> Self {
        let powers = std::array::from_fn(|k| {
            self.powers[k].saturating_add(sign.saturating_mul(other.powers[k]))
        });
        Self {
            powers,
            flexible: self.flexible || other.flexible,
            untold: self.untold || other.untold,
        }
    }

    /// Returns the unit of a power; `exponent` is `None` if it is not a literal number.
    #[expect(clippy::cast_possible_truncation, reason = "a whole number up to 64")]
    pub(super) fn power(self, exponent: Option<f64>) -> Self {
        match exponent {
            Some(exponent) if exponent.fract() == 0.0 && exponent.abs() <= 64.0 => Self {
                powers: self.powers.map(|power| power.saturating_mul(exponent as i32)),
                ..self
            },
            _ => {
                let has_unit = self.powers[1..].iter().any(|power| *power != 0);
                Self {
                    flexible: self.flexible || has_unit,
                    untold: self.untold || has_unit,
                    ..Self::PLAIN
                }
            }
        }
    }

    /// Returns the unit of a sum, or `None` if the operands have different units. Angles and
    /// numbers without unit may be added.
    pub(super) fn sum(self, other: Self) -> Option<Self> {
        match (self.flexible, other.flexible) {
            (false, false) => (self.powers[1..] == other.powers[1..]).then_some(self),
            (true, false) => Some(other),
            (false, true) => Some(self),
            (true, true) if self.powers == other.powers => Some(self),
            (true, true) if self.powers == [0; BASES] => Some(other),
            (true, true) if other.powers == [0; BASES] => Some(self),
            (true, true) => Some(Self { untold: true, ..Self::FLEXIBLE }),
        }
    }

    /// Returns the unit as symbols, such as `m·kg^2`; `a number` if there is none.
    pub(super) fn symbol(self) -> String {
        let part = |(power, symbol): (&i32, &&str)| match power {
            0 => None,
            1 => Some((*symbol).to_owned()),
            power => Some(format!("{symbol}^{power}")),
        };
        let parts: Vec<String> = self.powers.iter().zip(&SYMBOLS).filter_map(part).collect();
        if parts.is_empty() { "a number".to_owned() } else { parts.join("·") }
    }

    /// Returns the unit of two operands under an operator, or `None` if their units do not match.
    pub(super) fn under(
        operator: Operator,
        left: Self,
        right: Self,
        exponent: Option<f64>,
    ) -> Option<Self> {
        match operator {
            Operator::Add | Operator::Subtract | Operator::Minimum | Operator::Maximum => {
                left.sum(right)
            }
            Operator::Atan2 => left.sum(right).map(|_| Self::PLAIN),
            Operator::Multiply => Some(left.product(right, 1)),
            Operator::Divide => Some(left.product(right, -1)),
            Operator::Power => Some(left.power(exponent)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_sums_and_powers() {
        let covariate = Dimension::COVARIATE;
        assert_eq!(Dimension::LENGTH.sum(Dimension::KELVIN), None);
        assert_eq!(Dimension::ANGLE.sum(Dimension::PLAIN), Some(Dimension::ANGLE));
        assert_eq!(Dimension::LENGTH.sum(covariate), Some(Dimension::LENGTH));
        assert_eq!(covariate.sum(Dimension::LENGTH), Some(Dimension::LENGTH));
        // A unit that is not determined adopts that of the other operand.
        assert_eq!(covariate.sum(Dimension::FLEXIBLE), Some(covariate));
        assert_eq!(Dimension::FLEXIBLE.sum(covariate), Some(covariate));
        assert_eq!(covariate.sum(covariate), Some(covariate));
        let square = covariate.product(covariate, 1);
        assert_eq!(covariate.power(Some(2.0)), square);
        let untold = Dimension { untold: true, ..Dimension::FLEXIBLE };
        assert_eq!(covariate.sum(square), Some(untold));
        // A broken power has a unit that is not determined, unless its base has none.
        assert_eq!(Dimension::LENGTH.power(Some(0.5)), untold);
        assert_eq!(Dimension::ANGLE.power(Some(0.5)), Dimension::PLAIN);
        assert_eq!(Dimension::LENGTH.power(None), untold);
        assert_eq!(Dimension::LENGTH.power(Some(-2.0)).powers[1], -2);
    }
}
