//! Units that keys do not use, with their factors, for messages.

use std::f64::consts::{PI, TAU};

use super::Unit;

/// Suffixes of units that are not read: quantity, and factor that converts to SI.
const FOREIGN_UNITS: [(&str, Unit, f64); 34] = [
    ("um", Unit::Length, 1e-6),
    ("µm", Unit::Length, 1e-6),
    ("micron", Unit::Length, 1e-6),
    ("nm", Unit::Length, 1e-9),
    ("cm", Unit::Length, 1e-2),
    ("dm", Unit::Length, 1e-1),
    ("in", Unit::Length, 0.0254),
    ("inch", Unit::Length, 0.0254),
    ("mil", Unit::Length, 0.0254e-3),
    ("ft", Unit::Length, 0.3048),
    ("mrad", Unit::Angle, 1e-3),
    ("urad", Unit::Angle, 1e-6),
    ("grad", Unit::Angle, PI / 200.0),
    ("gon", Unit::Angle, PI / 200.0),
    ("mdeg", Unit::Angle, PI / 180e3),
    ("arcmin", Unit::Angle, PI / 10.8e3),
    ("arcsec", Unit::Angle, PI / 648e3),
    ("rev", Unit::Angle, TAU),
    ("turns", Unit::Angle, TAU),
    ("g", Unit::Mass, 1e-3),
    ("t", Unit::Mass, 1e3),
    ("lb", Unit::Mass, 0.453_592_37),
    ("kN", Unit::Force, 1e3),
    ("kgf", Unit::Force, 9.80665),
    ("lbf", Unit::Force, 4.448_221_615_260_5),
    ("ms", Unit::Time, 1e-3),
    ("us", Unit::Time, 1e-6),
    ("min", Unit::Time, 60.0),
    ("h", Unit::Time, 3600.0),
    ("kN_m_per_rad", Unit::TorsionalStiffness, 1e3),
    ("percent", Unit::Ratio, 1e-2),
    ("pct", Unit::Ratio, 1e-2),
    ("permille", Unit::Ratio, 1e-3),
    ("N_m_per_deg", Unit::TorsionalStiffness, 180.0 / PI),
];

impl Unit {
    /// Returns the suffixes of units of this quantity that files do not use.
    pub(crate) fn foreign_suffixes(self) -> impl Iterator<Item = &'static str> {
        FOREIGN_UNITS.iter().filter(move |(_, unit, _)| *unit == self).map(|(suffix, ..)| *suffix)
    }

    /// Converts a value in a unit that files do not use to the unit of tables, rounded to twelve
    /// digits. Returns `None` if `suffix` is not such a unit of this quantity.
    pub(crate) fn convert_foreign(self, suffix: &str, value: f64) -> Option<f64> {
        let known = FOREIGN_UNITS.iter().find(|(known, unit, _)| *unit == self && *known == suffix);
        let converted = value * known?.2 * self.in_tables().factor;
        format!("{converted:.11e}").parse().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foreign_units_are_converted_to_those_of_tables() {
        for (unit, suffix, value, converted) in [
            (Unit::Length, "um", 50.0, Some(0.05)),
            (Unit::Length, "in", 1.0, Some(25.4)),
            (Unit::Angle, "grad", 100.0, Some(90.0)),
            (Unit::Mass, "g", 1.0, Some(0.001)),
            (Unit::Angle, "um", 1.0, None),
        ] {
            assert_eq!(unit.convert_foreign(suffix, value), converted, "{suffix}");
        }
        for (suffix, unit, _) in FOREIGN_UNITS {
            let are_inches = unit.suffix(suffix).is_some_and(|read| read.name == "in");
            assert!(unit.suffix(suffix).is_none() || are_inches, "{suffix} is read");
        }
    }
}
