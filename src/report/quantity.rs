//! Numbers with units, as people read them.

use crate::model::parameter::Unit;

/// From here on numbers are written with a power of ten.
const HUGE: f64 = 1e12;

/// A unit for display and the factor from SI to it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Display {
    pub factor: f64,
    pub symbol: String,
}

impl Display {
    /// Degrees, millimetres, and stiffnesses with the prefix that suits `magnitude` [SI].
    pub fn of(unit: Unit, magnitude: f64) -> Self {
        match unit {
            Unit::Angle => Self { factor: 180.0 / std::f64::consts::PI, symbol: "°".to_owned() },
            Unit::Length => Self { factor: 1e3, symbol: "mm".to_owned() },
            Unit::AnglePerDegree => Self { factor: 180.0 / std::f64::consts::PI, symbol: "°/K".to_owned() },
            Unit::LengthPerDegree => Self { factor: 1e3, symbol: "mm/K".to_owned() },
            Unit::Speed => Self { factor: 3.6e6, symbol: "mm/h".to_owned() },
            Unit::Compliance => Self { factor: 1e6, symbol: "µrad/(N·m)".to_owned() },
            Unit::CubicCompliance => Self { factor: 1e9, symbol: "nrad/(N·m)³".to_owned() },
            Unit::Flexibility => Self { factor: 1e6, symbol: "1/(MN·m²)".to_owned() },
            Unit::CurvaturePerDegree => Self { factor: 1e6, symbol: "µrad/(m·K)".to_owned() },
            Unit::PerDegree => Self { factor: 1e6, symbol: "10⁻⁶/K".to_owned() },
            Unit::LengthPerAngle => Self { factor: 1e3, symbol: "mm/rad".to_owned() },
            Unit::AnglePerLength => Self { factor: 180.0 / std::f64::consts::PI, symbol: "°/m".to_owned() },
            Unit::Ratio => Self { factor: 1e3, symbol: "‰".to_owned() },
            Unit::Mass | Unit::PerLength | Unit::Number => Self { factor: 1.0, symbol: unit.symbol().to_owned() },
            Unit::TorsionalStiffness | Unit::AxialRigidity | Unit::FlexuralRigidity => {
                let (factor, prefix) = match magnitude.abs() {
                    m if m >= 1e9 => (1e-9, "G"),
                    m if m >= 1e6 => (1e-6, "M"),
                    m if m >= 1e3 => (1e-3, "k"),
                    _ => (1.0, ""),
                };
                Self { factor, symbol: format!("{prefix}{}", unit.symbol()) }
            }
        }
    }
}

/// Decimals that show `error` with two significant digits, at most `most`.
pub(super) fn decimals(error: f64, most: usize) -> usize {
    if error <= 0.0 || !error.is_finite() {
        return most;
    }
    let wanted = 1.0 - error.log10().floor();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0..=most")]
    let wanted = wanted.clamp(0.0, most as f64) as usize;
    wanted
}

/// `value` with `decimals`, never as "-0"; as `1.234e300` where it is huge, "–" where there is none.
pub(super) fn number(value: f64, decimals: usize) -> String {
    match value.abs() {
        size if size < HUGE => fixed(value, decimals),
        size if size.is_finite() => format!("{value:.3e}"),
        _ => "–".to_owned(),
    }
}

/// `value` with `decimals`, never as "-0", for tables that programs read.
pub(super) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        _ => text,
    }
}

/// A rows-and-columns text, numbers to the right, without lines around it.
pub(super) fn table(header: &[&str], rows: Vec<Vec<String>>, left: &[usize]) -> String {
    use comfy_table::{CellAlignment, Table, presets::NOTHING};
    let mut table = Table::new();
    table.load_style(NOTHING).set_header(header.to_vec()).add_rows(rows);
    for (index, column) in table.column_iter_mut().enumerate() {
        column.set_padding((if index == 0 { 2 } else { 1 }, 1));
        column.set_cell_alignment(if left.contains(&index) { CellAlignment::Left } else { CellAlignment::Right });
    }
    let mut text: String = table.lines().flat_map(|line| [line.trim_end().to_owned(), "\n".to_owned()]).collect();
    if !text.ends_with('\n') {
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_show_two_digits() {
        assert_eq!(decimals(0.0123, 6), 3);
        assert_eq!(decimals(1.5, 6), 1);
        assert_eq!(decimals(314.0, 6), 0);
        assert_eq!(decimals(1e-12, 6), 6);
        assert_eq!(number(-0.0001, 3), "0.000");
        assert_eq!(number(-0.5, 1), "-0.5");
        assert_eq!(number(-1.5e300, 4), "-1.500e300");
        assert_eq!((number(f64::NAN, 2), number(f64::INFINITY, 2)), ("–".to_owned(), "–".to_owned()));
    }
}
