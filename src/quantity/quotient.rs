//! Units of coefficients: the unit of a quantity divided by the unit of a formula.

/// Number of base units of formulas: rad, m, K, kg, s, N, and the unit of a covariate.
pub(super) const BASES: usize = 7;
/// Symbols of the base units, in the order of the powers.
const SYMBOLS: [&str; BASES] = ["rad", "m", "K", "kg", "s", "N", "unit"];
/// Indices of metre, second and newton among the base units.
const METRE: usize = 1;
const SECOND: usize = 4;
const NEWTON: usize = 5;
/// Number of seconds in an hour, the time unit for display.
const SECONDS_PER_HOUR: f64 = 3600.0;

/// Unit of a quantity divided by powers of the base units of formulas.
#[doc(hidden)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quotient {
    /// Quantity that is divided.
    of: Dividend,
    /// Power of each base unit in the divisor, in the order of [`SYMBOLS`].
    powers: [i32; BASES],
    /// True if times are row numbers, because none was measured.
    per_row: bool,
}

/// Quantity to which a law adds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dividend {
    /// Angle \[rad\].
    Angle,
    /// Length \[m\].
    Length,
    /// Curvature of a link [1/m].
    Curvature,
    /// Strain of a link.
    Strain,
    /// Number of pixels.
    Pixel,
    /// Number without a unit, such as a coefficient of a lens.
    Number,
}

impl Quotient {
    /// Creates the unit of the quantity `of` divided by `powers` of the base units.
    pub(super) fn new(of: Dividend, powers: [i32; BASES]) -> Self {
        Self { of, powers, per_row: false }
    }

    /// Returns the unit with rows in place of seconds.
    pub(super) fn per_row(self) -> Self {
        Self { per_row: true, ..self }
    }

    /// Returns the symbol of the SI unit: `rad/(N·m)³`.
    pub(super) fn symbol(self) -> String {
        let dividend = match self.of {
            Dividend::Angle => "rad",
            Dividend::Length => "m",
            Dividend::Pixel => "px",
            Dividend::Curvature | Dividend::Strain | Dividend::Number => "",
        };
        self.written(dividend, "s")
    }

    /// Returns the factor from the SI value to the displayed one, and the displayed symbol. Angles
    /// and lengths per power of a torque are small, so their unit is small too; times are in hours.
    pub(super) fn shown(self) -> (f64, String) {
        let torque = self.powers[NEWTON].min(self.powers[METRE]);
        let (factor, dividend) = match (self.of, torque) {
            (Dividend::Angle, ..=0) => (1_f64.to_degrees(), "°"),
            (Dividend::Angle, 1) | (Dividend::Curvature, _) => (1e6, "µrad"),
            (Dividend::Angle, _) => (1e9, "nrad"),
            (Dividend::Length, ..=1) => (1e3, "mm"),
            (Dividend::Length, _) => (1e6, "µm"),
            (Dividend::Strain, _) => (1e6, "10⁻⁶"),
            (Dividend::Pixel, _) => (1.0, "px"),
            (Dividend::Number, _) => (1.0, ""),
        };
        if self.per_row || self.powers[SECOND] <= 0 {
            return (factor, self.written(dividend, "s"));
        }
        (factor * SECONDS_PER_HOUR.powi(self.powers[SECOND]), self.written(dividend, "h"))
    }

    /// Returns the dividend over the divisor. A newton and a metre of the divisor, or of what its
    /// negative powers multiply, form a torque.
    fn written(self, dividend: &str, time: &str) -> String {
        let time = if self.per_row { "row" } else { time };
        let side = |sign: i32| {
            let mut powers = self.powers.map(|power| (sign * power).max(0));
            let torque = powers[NEWTON].min(powers[METRE]);
            powers[NEWTON] -= torque;
            powers[METRE] -= torque;
            let curved = sign > 0 && self.of == Dividend::Curvature;
            let symbols = SYMBOLS.map(|symbol| if symbol == "s" { time } else { symbol });
            let first = [("m", i32::from(curved)), ("N·m", torque)];
            first.into_iter().chain(symbols.into_iter().zip(powers)).filter(|(_, power)| *power > 0)
        };
        let above: Vec<String> = side(-1).map(raised).collect();
        let below: Vec<(&str, i32)> = side(1).collect();
        let mut text: String = [dividend.to_owned()]
            .into_iter()
            .chain(above)
            .filter(|part| !part.is_empty())
            .collect::<Vec<_>>()
            .join("·");
        if text.is_empty() {
            "1".clone_into(&mut text);
        }
        match below.as_slice() {
            [] => text,
            [one] if *one != ("N·m", 1) => format!("{text}/{}", raised(*one)),
            parts => {
                let parts: Vec<String> = parts.iter().map(|part| raised(*part)).collect();
                format!("{text}/({})", parts.join("·"))
            }
        }
    }
}

/// Writes a power of a unit: `rad²`, `(N·m)³`.
fn raised((symbol, power): (&str, i32)) -> String {
    if power == 1 {
        return symbol.to_owned();
    }
    let exponent: String = power
        .to_string()
        .chars()
        .filter_map(|digit| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(digit.to_digit(10)? as usize))
        .collect();
    if symbol.contains('·') {
        format!("({symbol}){exponent}")
    } else {
        format!("{symbol}{exponent}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotients_are_written_with_powers() {
        // rad, m, K, kg, s, N, unit
        for (of, powers, symbol, shown) in [
            (Dividend::Angle, [0, 3, 0, 0, 0, 3, 0], "rad/(N·m)³", "nrad/(N·m)³"),
            (Dividend::Angle, [2, 0, 0, 0, 0, 0, 0], "rad/rad²", "°/rad²"),
            (Dividend::Angle, [1, 1, 0, 0, 0, 1, 0], "rad/(N·m·rad)", "µrad/(N·m·rad)"),
            (Dividend::Angle, [0, 0, 1, -1, 0, 0, 0], "rad·kg/K", "°·kg/K"),
            (Dividend::Length, [0, 0, 1, 0, 1, 0, 0], "m/(K·s)", "mm/(K·h)"),
            (Dividend::Curvature, [0, 2, 0, 0, 0, 2, 0], "1/(m·(N·m)²)", "µrad/(m·(N·m)²)"),
            (Dividend::Strain, [0, 0, 2, 0, 0, 0, 0], "1/K²", "10⁻⁶/K²"),
            (Dividend::Length, [0, 2, 0, 0, 0, 0, 0], "m/m²", "mm/m²"),
            (Dividend::Pixel, [0, 0, 1, 0, 0, 0, 0], "px/K", "px/K"),
            (Dividend::Number, [0, 0, 1, 0, 0, 0, 0], "1/K", "1/K"),
        ] {
            let unit = Quotient::new(of, powers);
            assert_eq!((unit.symbol().as_str(), unit.shown().1.as_str()), (symbol, shown));
        }
        let squared = Quotient::new(Dividend::Angle, [0, 0, 0, 0, 2, 0, 0]);
        assert_eq!(squared.per_row().symbol(), "rad/row²");
        assert_eq!(squared.per_row().shown().1, "°/row²");
        assert!((squared.shown().0 / (1_f64.to_degrees() * 3600.0 * 3600.0) - 1.0).abs() < 1e-12);
    }
}
