//! Table of all units: SI symbol, suffixes in files, and unit for display.

use std::borrow::Cow;
use std::f64::consts::PI;

use super::quotient::{BASES, Dividend, Quotient};

/// Kind of physical quantity, which determines the SI unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unit {
    /// Angle \[rad\].
    Angle,
    /// Length \[m\].
    Length,
    /// Length in an image \[px\].
    Pixel,
    /// Mass \[kg\].
    Mass,
    /// Force \[N\].
    Force,
    /// Acceleration [m/s²].
    Acceleration,
    /// Temperature [°C].
    Temperature,
    /// Time \[s\].
    Time,
    /// Force per length [N/m].
    ForcePerLength,
    /// Torsional stiffness [N·m/rad].
    TorsionalStiffness,
    /// Axial rigidity EA \[N\].
    AxialRigidity,
    /// Flexural rigidity EI or torsional rigidity GJ [N·m²].
    FlexuralRigidity,
    /// Torsional compliance [rad/(N·m)].
    Compliance,
    /// Coefficient of a moment cubed in an angle [rad/(N·m)³].
    CubicCompliance,
    /// Flexibility 1/EI of a bending beam [1/(N·m²)].
    Flexibility,
    /// Beam curvature per temperature difference [1/(m·K)].
    CurvaturePerDegree,
    /// Strain per temperature difference [1/K].
    PerDegree,
    /// Angle per temperature difference [rad/K].
    AnglePerDegree,
    /// Length per temperature difference [m/K].
    LengthPerDegree,
    /// Angle per payload mass [rad/kg].
    AnglePerMass,
    /// Angle per torque and payload mass [rad/(N·m·kg)].
    AnglePerTorqueMass,
    /// Length per payload mass [m/kg].
    LengthPerMass,
    /// Number per length [1/m].
    PerLength,
    /// Curvature per payload mass [1/(m·kg)].
    CurvaturePerMass,
    /// Curvature per length [1/m²].
    CurvaturePerLength,
    /// Curvature per time [1/(m·s)].
    CurvaturePerTime,
    /// Curvature per unit of a declared covariate [1/(m·unit)].
    CurvaturePerUnit,
    /// Strain per payload mass [1/kg].
    StrainPerMass,
    /// Strain per time [1/s].
    StrainPerTime,
    /// Strain per torque [1/(N·m)].
    StrainPerTorque,
    /// Strain per unit of a declared covariate [1/unit].
    StrainPerUnit,
    /// Speed [m/s].
    Speed,
    /// Angular speed [rad/s].
    AngularSpeed,
    /// Length per torque [m/(N·m)].
    LengthPerTorque,
    /// Length per angle [m/rad].
    LengthPerAngle,
    /// Angle per length [rad/m].
    AnglePerLength,
    /// Angle per unit of a declared covariate [rad/unit].
    AnglePerUnit,
    /// Length per unit of a declared covariate [m/unit].
    LengthPerUnit,
    /// Length per table row, used when no time was measured [m/row].
    LengthPerRow,
    /// Angle per table row, used when no time was measured [rad/row].
    AnglePerRow,
    /// Ratio of equal units (rad/rad or m/m) that is small, displayed in ‰.
    Ratio,
    /// Dimensionless number of order 1.
    Number,
    /// Unit of a coefficient that no other variant has: that of a quantity divided by that of a
    /// formula.
    Quotient(Quotient),
}

/// Unit suffix of a key or column, written after an underscore: `deg` in `alpha_deg`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Suffix {
    /// Suffix of column names and keys for the unit, without its underscore.
    pub name: &'static str,
    /// Converts a value in this unit to SI.
    pub to_si: fn(f64) -> f64,
}

/// Unit for display, with the factor that converts an SI value to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Display {
    /// Factor that converts an SI value to the displayed unit.
    pub factor: f64,
    /// Symbol of the displayed unit: `mm`, `kN·m²`.
    pub symbol: String,
}

/// Unit in which tables and messages give measured numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TableUnit {
    /// Factor that converts an SI value to this unit.
    pub factor: f64,
    /// Suffix in names of columns and keys: `mm`, `deg`.
    pub suffix: &'static str,
    /// Symbol in text: `mm`, `°`.
    pub symbol: &'static str,
}

/// Row of the unit table: properties of one unit.
struct UnitRow {
    /// Name of the quantity with its article, for messages.
    noun: &'static str,
    /// Symbol of the SI unit.
    symbol: &'static str,
    /// Suffixes accepted in files, including the SI unit; empty if no file contains this unit.
    suffixes: &'static [Suffix],
    shown: DisplayRule,
}

/// Rule that selects the displayed unit.
enum DisplayRule {
    /// Multiplies the SI value by a factor and uses another symbol.
    As(f64, &'static str),
    /// Displays the SI value.
    Plain,
    /// Displays the SI value with the prefix k, M or G that suits its magnitude.
    Prefixed,
}

/// Number of degrees per radian.
const DEGREES_PER_RADIAN: f64 = 180.0 / PI;

const fn si(name: &'static str) -> Suffix {
    Suffix { name, to_si: std::convert::identity }
}

const fn deg(name: &'static str) -> Suffix {
    Suffix { name, to_si: f64::to_radians }
}

const fn mm(name: &'static str) -> Suffix {
    Suffix { name, to_si: |x| x / 1000.0 }
}

/// Expands to a [`UnitRow`] of the unit table.
macro_rules! row {
    ($noun:literal, $symbol:literal, [$($suffix:expr),*], $shown:expr) => {
        UnitRow { noun: $noun, symbol: $symbol, suffixes: const { &[$($suffix),*] }, shown: $shown }
    };
}

impl Unit {
    /// Returns the row of the unit table.
    fn row(self) -> UnitRow {
        use DisplayRule::{As, Plain, Prefixed};
        match self {
            Self::Angle => {
                row!("an angle", "rad", [deg("deg"), si("rad")], As(DEGREES_PER_RADIAN, "°"))
            }
            Self::Length => row!("a length", "m", [si("m"), mm("mm")], As(1e3, "mm")),
            Self::Pixel => row!("a number of pixels", "px", [si("px")], Plain),
            Self::Mass => row!("a mass", "kg", [si("kg")], Plain),
            Self::Force => row!("a force", "N", [si("N")], Plain),
            Self::Acceleration => row!("an acceleration", "m/s²", [si("m_s2")], Plain),
            Self::Temperature => row!("a temperature", "°C", [si("C")], Plain),
            Self::Time => row!("a time", "s", [si("s")], Plain),
            Self::ForcePerLength => row!("a force per length", "N/m", [si("N_per_m")], Prefixed),
            Self::TorsionalStiffness => {
                row!("a stiffness", "N·m/rad", [si("N_m_per_rad")], Prefixed)
            }
            Self::AxialRigidity => row!("a force", "N", [si("N")], Prefixed),
            Self::FlexuralRigidity => row!("a rigidity", "N·m²", [si("N_m2")], Prefixed),
            Self::Compliance => {
                row!("a compliance", "rad/(N·m)", [si("rad_per_N_m")], As(1e6, "µrad/(N·m)"))
            }
            Self::CubicCompliance => row!(
                "a cubic compliance",
                "rad/(N·m)³",
                [si("rad_per_N3_m3")],
                As(1e9, "nrad/(N·m)³")
            ),
            Self::Flexibility => {
                row!("a flexibility", "1/(N·m²)", [si("per_N_m2")], As(1e6, "1/(MN·m²)"))
            }
            Self::CurvaturePerDegree => {
                row!("a curvature per °C", "1/(m·K)", [si("per_m_C")], As(1e6, "µrad/(m·K)"))
            }
            Self::PerDegree => row!("a strain per °C", "1/K", [si("per_C")], As(1e6, "10⁻⁶/K")),
            Self::AnglePerDegree => row!(
                "an angle per °C",
                "rad/K",
                [deg("deg_per_C"), si("rad_per_C")],
                As(DEGREES_PER_RADIAN, "°/K")
            ),
            Self::LengthPerDegree => {
                row!("a length per °C", "m/K", [si("m_per_C"), mm("mm_per_C")], As(1e3, "mm/K"))
            }
            Self::AnglePerMass => row!(
                "an angle per kg",
                "rad/kg",
                [deg("deg_per_kg"), si("rad_per_kg")],
                As(DEGREES_PER_RADIAN, "°/kg")
            ),
            Self::AnglePerTorqueMass => {
                row!("an angle per torque and mass", "rad/(N·m·kg)", [], As(1e6, "µrad/(N·m·kg)"))
            }
            Self::LengthPerMass => {
                row!("a length per kg", "m/kg", [si("m_per_kg"), mm("mm_per_kg")], As(1e3, "mm/kg"))
            }
            Self::PerLength => row!("a number per length", "1/m", [si("per_m")], Plain),
            Self::Speed => row!(
                "a speed",
                "m/s",
                [si("m_per_s"), mm("mm_per_s"), Suffix { name: "mm_per_h", to_si: |x| x / 3.6e6 }],
                As(3.6e6, "mm/h")
            ),
            Self::AngularSpeed => row!(
                "an angular speed",
                "rad/s",
                [deg("deg_per_s"), si("rad_per_s")],
                As(3600.0 * DEGREES_PER_RADIAN, "°/h")
            ),
            Self::LengthPerTorque => {
                row!("a length per torque", "m/(N·m)", [], As(1e3, "mm/(N·m)"))
            }
            Self::CurvaturePerMass => row!("a curvature per kg", "1/(m·kg)", [], Plain),
            Self::CurvaturePerLength => row!("a curvature per length", "1/m²", [], Plain),
            Self::CurvaturePerTime => row!("a curvature per time", "1/(m·s)", [], Plain),
            Self::CurvaturePerUnit => {
                row!("a curvature per unit of a covariate", "1/(m·unit)", [], Plain)
            }
            Self::StrainPerMass => row!("a strain per kg", "1/kg", [], As(1e6, "10⁻⁶/kg")),
            Self::StrainPerTime => row!("a strain per time", "1/s", [], As(3.6e9, "10⁻⁶/h")),
            Self::StrainPerTorque => {
                row!("a strain per torque", "1/(N·m)", [], As(1e6, "10⁻⁶/(N·m)"))
            }
            Self::StrainPerUnit => {
                row!("a strain per unit of a covariate", "1/unit", [], As(1e6, "10⁻⁶/unit"))
            }
            Self::LengthPerAngle => row!("a length per angle", "m/rad", [], As(1e3, "mm/rad")),
            Self::AnglePerLength => {
                row!("an angle per length", "rad/m", [], As(DEGREES_PER_RADIAN, "°/m"))
            }
            Self::AnglePerUnit => row!(
                "an angle per unit of a covariate",
                "rad/unit",
                [deg("deg_per_unit"), si("rad_per_unit")],
                As(DEGREES_PER_RADIAN, "°/unit")
            ),
            Self::LengthPerUnit => row!(
                "a length per unit of a covariate",
                "m/unit",
                [si("m_per_unit"), mm("mm_per_unit")],
                As(1e3, "mm/unit")
            ),
            Self::LengthPerRow => row!("a length per row", "m/row", [], As(1e3, "mm/row")),
            Self::AnglePerRow => {
                row!("an angle per row", "rad/row", [], As(DEGREES_PER_RADIAN, "°/row"))
            }
            Self::Ratio => row!("a ratio", "1", [si("relative")], As(1e3, "‰")),
            Self::Number => row!("a ratio", "1", [si("relative")], Plain),
            Self::Quotient(_) => row!("a coefficient", "", [], Plain),
        }
    }

    /// Returns the symbol of the SI unit.
    pub fn symbol(self) -> Cow<'static, str> {
        match self {
            Self::Quotient(quotient) => quotient.symbol().into(),
            unit => unit.row().symbol.into(),
        }
    }

    /// Returns this unit divided by powers of the base units of formulas: rad, m, K, kg, s, N, and
    /// the unit of a covariate. Returns this unit if laws cannot add to a quantity with it.
    pub(crate) fn divided_by(self, powers: [i32; BASES]) -> Self {
        let of = match self {
            Self::Angle => Dividend::Angle,
            Self::Length => Dividend::Length,
            Self::PerLength => Dividend::Curvature,
            Self::Ratio => Dividend::Strain,
            Self::Pixel => Dividend::Pixel,
            Self::Number => Dividend::Number,
            other => return other,
        };
        Self::Quotient(Quotient::new(of, powers))
    }

    /// Returns the unit with table rows in place of seconds, for times that are row numbers.
    pub(crate) fn per_row(self) -> Self {
        match self {
            Self::Speed => Self::LengthPerRow,
            Self::AngularSpeed => Self::AnglePerRow,
            Self::CurvaturePerTime => Self::PerLength.divided_by([0, 0, 0, 0, 1, 0, 0]).per_row(),
            Self::StrainPerTime => Self::Ratio.divided_by([0, 0, 0, 0, 1, 0, 0]).per_row(),
            Self::Quotient(quotient) => Self::Quotient(quotient.per_row()),
            unit => unit,
        }
    }

    /// Returns true if parameters with this unit are estimated as ln(value / nominal): stiffnesses
    /// and rigidities.
    #[doc(hidden)]
    pub fn is_relative(self) -> bool {
        matches!(self, Self::TorsionalStiffness | Self::AxialRigidity | Self::FlexuralRigidity)
    }

    /// Returns the unit for display: degrees, millimetres, and stiffnesses with the prefix that
    /// suits `magnitude` \[SI\].
    pub(crate) fn display(self, magnitude: f64) -> Display {
        if let Self::Quotient(quotient) = self {
            let (factor, symbol) = quotient.shown();
            return Display { factor, symbol };
        }
        let UnitRow { symbol, shown, .. } = self.row();
        match shown {
            DisplayRule::As(factor, symbol) => Display { factor, symbol: symbol.to_owned() },
            DisplayRule::Plain => Display { factor: 1.0, symbol: symbol.to_owned() },
            DisplayRule::Prefixed => {
                let (factor, prefix) = match magnitude.abs() {
                    m if m >= 1e9 => (1e-9, "G"),
                    m if m >= 1e6 => (1e-6, "M"),
                    m if m >= 1e3 => (1e-3, "k"),
                    _ => (1.0, ""),
                };
                Display { factor, symbol: format!("{prefix}{symbol}") }
            }
        }
    }

    /// Returns the unit in which files state a deviation from a nominal value in this unit: a ratio
    /// for stiffnesses and rigidities, else the same unit.
    pub(crate) fn deviation_unit(self) -> Self {
        if self.is_relative() { Self::Ratio } else { self }
    }

    /// Returns the name of the quantity with its article, for messages.
    pub(crate) fn noun(self) -> &'static str {
        self.row().noun
    }

    /// Returns the suffixes that files may use for this unit.
    pub(crate) fn suffixes(self) -> &'static [Suffix] {
        self.row().suffixes
    }

    /// Returns the suffix called `name`, or `None` if files may not write this unit with it. Columns
    /// of lengths may be in inches too, which no message proposes.
    pub(crate) fn suffix(self, name: &str) -> Option<Suffix> {
        let inches = Suffix { name: "in", to_si: |x| x * 0.0254 };
        let of_columns = (self == Self::Length).then_some(inches);
        self.suffixes().iter().copied().chain(of_columns).find(|suffix| suffix.name == name)
    }

    /// Returns the suffix of the SI unit.
    pub(crate) fn si_suffix(self) -> &'static str {
        let is_si = |suffix: &&Suffix| (suffix.to_si)(1.0).to_bits() == 1.0_f64.to_bits();
        self.suffixes().iter().find(is_si).map_or("", |suffix| suffix.name)
    }

    /// Returns `base` combined with each suffix: `alpha_deg`, `alpha_rad`.
    pub(crate) fn spellings(self, base: &str) -> impl Iterator<Item = String> {
        self.suffixes().iter().map(move |suffix| format!("{base}_{}", suffix.name))
    }

    /// Returns the accepted spellings in words: `alpha_deg or alpha_rad`.
    pub(crate) fn alternatives(self, base: &str) -> String {
        self.spellings(base).collect::<Vec<_>>().join(" or ")
    }

    /// Returns the unit in which tables and messages give measured numbers of this unit.
    pub(crate) fn in_tables(self) -> TableUnit {
        match self {
            Self::Length => TableUnit { factor: 1e3, suffix: "mm", symbol: "mm" },
            Self::Angle => TableUnit { factor: DEGREES_PER_RADIAN, suffix: "deg", symbol: "°" },
            other => {
                TableUnit { factor: 1.0, suffix: other.si_suffix(), symbol: other.row().symbol }
            }
        }
    }

    /// Units that can occur in declarations of arms and in measurements.
    const OF_FILES: [Self; 9] = [
        Self::Angle,
        Self::Length,
        Self::Mass,
        Self::Force,
        Self::FlexuralRigidity,
        Self::TorsionalStiffness,
        Self::Acceleration,
        Self::Temperature,
        Self::Time,
    ];

    /// Returns every suffix that can occur in declarations of arms and in measurements.
    pub(crate) fn all_suffixes() -> impl Iterator<Item = &'static str> {
        Self::OF_FILES.into_iter().flat_map(Self::suffixes).map(|suffix| suffix.name)
    }

    /// Returns true if files may write one quantity with both suffixes.
    pub(crate) fn are_of_one_quantity(suffixes: [&str; 2]) -> bool {
        let has_both = |unit: Self| suffixes.iter().all(|suffix| unit.suffix(suffix).is_some());
        Self::OF_FILES.into_iter().any(has_both)
    }
}
