//! Units as the files write them, and what they become inside the program.

/// A unit as a suffix of a key or column.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Unit {
    /// Suffix without its underscore.
    pub suffix: &'static str,
    /// Conversion to the SI unit.
    pub to_si: fn(f64) -> f64,
}

/// A kind of quantity and the units it may be written in.
#[derive(Debug)]
pub(crate) struct Kind {
    /// Name with its article, for messages.
    pub noun: &'static str,
    /// Units accepted.
    pub units: &'static [Unit],
}

const fn si(suffix: &'static str) -> Unit {
    Unit { suffix, to_si: std::convert::identity }
}

pub(crate) const ANGLE: Kind =
    Kind { noun: "an angle", units: &[Unit { suffix: "deg", to_si: f64::to_radians }, si("rad")] };
pub(crate) const LENGTH: Kind =
    Kind { noun: "a length", units: &[si("m"), Unit { suffix: "mm", to_si: |length| length / 1000.0 }] };
pub(crate) const MASS: Kind = Kind { noun: "a mass", units: &[si("kg")] };
pub(crate) const FORCE: Kind = Kind { noun: "a force", units: &[si("N")] };
pub(crate) const RIGIDITY: Kind = Kind { noun: "a rigidity", units: &[si("N_m2")] };
pub(crate) const STIFFNESS: Kind = Kind { noun: "a stiffness", units: &[si("N_m_per_rad")] };
pub(crate) const ACCELERATION: Kind = Kind { noun: "an acceleration", units: &[si("m_s2")] };
pub(crate) const TEMPERATURE: Kind = Kind { noun: "a temperature", units: &[si("C")] };
pub(crate) const TIME: Kind = Kind { noun: "a time", units: &[si("s")] };
/// Relative to a nominal value.
pub(crate) const RELATIVE: Kind = Kind { noun: "a ratio", units: &[si("relative")] };

/// Angle per moment.
pub(crate) const COMPLIANCE: Kind = Kind { noun: "a compliance", units: &[si("rad_per_N_m")] };
/// Angle per cube of a moment.
pub(crate) const CUBIC_COMPLIANCE: Kind = Kind { noun: "a cubic compliance", units: &[si("rad_per_N3_m3")] };
/// Curvature per moment.
pub(crate) const FLEXIBILITY: Kind = Kind { noun: "a flexibility", units: &[si("per_N_m2")] };
pub(crate) const ANGLE_PER_DEGREE: Kind =
    Kind { noun: "an angle per °C", units: &[Unit { suffix: "deg_per_C", to_si: f64::to_radians }, si("rad_per_C")] };
pub(crate) const LENGTH_PER_DEGREE: Kind = Kind {
    noun: "a length per °C",
    units: &[si("m_per_C"), Unit { suffix: "mm_per_C", to_si: |length| length / 1000.0 }],
};
pub(crate) const STRAIN_PER_DEGREE: Kind = Kind { noun: "a strain per °C", units: &[si("per_C")] };
pub(crate) const CURVATURE_PER_DEGREE: Kind = Kind { noun: "a curvature per °C", units: &[si("per_m_C")] };
pub(crate) const PER_LENGTH: Kind = Kind { noun: "a number per length", units: &[si("per_m")] };
pub(crate) const SPEED: Kind = Kind {
    noun: "a speed",
    units: &[
        si("m_per_s"),
        Unit { suffix: "mm_per_s", to_si: |speed| speed / 1000.0 },
        Unit { suffix: "mm_per_h", to_si: |speed| speed / 3.6e6 },
    ],
};

const ALL: [&Kind; 9] = [&ANGLE, &LENGTH, &MASS, &FORCE, &RIGIDITY, &STIFFNESS, &ACCELERATION, &TEMPERATURE, &TIME];

impl Kind {
    /// The unit of this kind with that suffix.
    pub fn unit(&self, suffix: &str) -> Option<Unit> {
        self.units.iter().copied().find(|unit| unit.suffix == suffix)
    }

    /// Suffix of the SI unit.
    pub fn si_suffix(&self) -> &'static str {
        let is_si = |unit: &&Unit| (unit.to_si)(1.0).to_bits() == 1.0_f64.to_bits();
        self.units.iter().find(is_si).map_or("", |unit| unit.suffix)
    }

    /// How to write a quantity of this kind: `alpha_deg or alpha_rad`.
    pub fn spelled(&self, base: &str) -> String {
        self.units.iter().map(|unit| format!("{base}_{}", unit.suffix)).collect::<Vec<_>>().join(" or ")
    }
}

/// Every suffix that is a unit of some kind.
pub(crate) fn suffixes() -> impl Iterator<Item = &'static str> {
    ALL.into_iter().flat_map(|kind| kind.units).map(|unit| unit.suffix)
}
