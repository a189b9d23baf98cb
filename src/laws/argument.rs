//! Arguments of effects: their kinds, their values, and their syntax in files.

use serde::Serialize;

/// Part of the arm that a covariate displaces: a joint or the base.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mount {
    /// Joint that takes a command, counted from 1.
    Joint(usize),
    /// Base of the arm.
    Base,
}

/// Length at which a spring pulls with its preload alone \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeLength(pub f64);

/// Kind of an argument of an effect, which determines its valid values on an arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ArgumentKind {
    /// Number of any joint, from 1.
    AnyJoint,
    /// Number of a joint that takes a command.
    MovingJoint,
    /// Number of a revolute joint that takes a command.
    TurningJoint,
    /// Number of a prismatic joint that takes a command.
    SlidingJoint,
    /// Number of a joint that has a link before it, from 1.
    LinkedJoint,
    /// Number of a revolute joint that is compliant about its axis, so that a gravity compensator
    /// relieves it.
    RelievedJoint,
    /// Number of a joint that carries bodies with a mass.
    LoadedJoint,
    /// Number of a joint that takes a command and differs from the joint of the preceding argument.
    OtherJoint,
    /// Joint that takes a command, or the base.
    Mount,
    /// Name of a beam.
    Beam,
    /// Name of a covariate of the problem.
    Covariate,
    /// Name of a camera of the problem.
    Camera,
    /// Integer orders of harmonics.
    Orders,
    /// Order of a wave \[cycles per revolution\].
    Order,
    /// Time at which an effect begins or changes, on the clock of the table \[s\].
    Time,
    /// Duration, such as a time constant; above zero \[s\].
    Duration,
    /// Path of a joint over which an effect builds up; above zero \[rad\].
    Distance,
    /// Point in the plane normal to a joint's axis \[m\].
    Point,
    /// Length at which a spring pulls with its preload alone, not negative \[m\].
    FreeLength,
}

impl ArgumentKind {
    /// Returns true if the search for effects determines the value of the argument. Effects that
    /// differ only in this value count as one effect with an undetermined value.
    pub fn is_searched(self) -> bool {
        matches!(self, Self::Order | Self::Time | Self::Duration | Self::Distance)
    }

    /// Returns true if the search may refine the value by scaling it, between those of the listed
    /// candidates.
    pub fn is_scalable(self) -> bool {
        matches!(self, Self::Duration | Self::Distance)
    }
}

/// Value of an argument of an effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum Argument {
    /// Number of a joint, from 1.
    Joint(usize),
    /// Orders of harmonics.
    Orders(Vec<u32>),
    /// Name of a beam, a camera or a covariate.
    Name(String),
    /// Time \[s\], path \[rad\], or order of a wave.
    Number(f64),
    /// Point in the plane normal to a joint's axis \[m\].
    Point([f64; 2]),
    /// Number that does not distinguish the effect from others: the free length of a spring \[m\],
    /// or the prior σ of a law's coefficients in the unit of its key.
    Length(f64),
    /// The base, written as `true`.
    Base(bool),
    /// Name or site of a law.
    Text(String),
    /// Formulas of a law.
    Texts(Vec<String>),
    /// Start, limits and prior σ of a parameter inside the formulas of a law, each with its key.
    #[serde(serialize_with = "as_map")]
    Numbers(Vec<(&'static str, f64)>),
}

/// Serialises numbers with names as a map.
fn as_map<S: serde::Serializer>(
    numbers: &[(&'static str, f64)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(numbers.iter().copied())
}

impl Argument {
    /// Returns the value in TOML syntax.
    pub fn toml(&self) -> String {
        let list = |entries: Vec<String>| format!("[{}]", entries.join(", "));
        match self {
            Self::Joint(joint) => joint.to_string(),
            Self::Orders(orders) => list(orders.iter().map(u32::to_string).collect()),
            Self::Name(name) | Self::Text(name) => quoted(name),
            Self::Texts(texts) => list(texts.iter().map(|text| quoted(text)).collect()),
            Self::Base(there) => there.to_string(),
            Self::Point([x, y]) => format!("[{}, {}]", float(*x), float(*y)),
            Self::Number(number) | Self::Length(number) => float(*number),
            Self::Numbers(numbers) => {
                let entries: Vec<String> = numbers
                    .iter()
                    .map(|(key, value)| format!("{key} = {}", float(*value)))
                    .collect();
                format!("{{ {} }}", entries.join(", "))
            }
        }
    }

    /// Returns the text of the argument in the brackets of parameter names, which distinguishes
    /// effects of one family; `None` if the names do not contain the argument.
    pub(crate) fn place(&self) -> Option<String> {
        match self {
            Self::Joint(joint) => Some(joint.to_string()),
            Self::Name(name) => Some(name.clone()),
            Self::Number(number) => Some(number.to_string()),
            Self::Base(_) => Some("base".to_owned()),
            _ => None,
        }
    }
}

/// Returns a name in quotes in TOML syntax, with a backslash before quotes and backslashes.
pub(crate) fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
}

/// Returns a number as a float in TOML syntax.
fn float(number: f64) -> String {
    if number.fract() == 0.0 { format!("{number:.1}") } else { number.to_string() }
}

/// Type of an effect's field that is read from and written as an argument.
pub(super) trait Field: Sized {
    /// Returns the field as an argument, with the key that files use.
    fn argument(&self, key: &'static str) -> (&'static str, Argument);
    /// Returns the field's value from an argument; `None` if that has another type.
    fn of(argument: &Argument) -> Option<Self>;
}

/// Implements [`Field`] for a type that is one variant of [`Argument`].
macro_rules! field {
    ($type:ty, $variant:ident, $value:ident => $to:expr, $from:expr) => {
        impl Field for $type {
            fn argument(&self, key: &'static str) -> (&'static str, Argument) {
                let $value = self;
                (key, Argument::$variant($to))
            }

            fn of(argument: &Argument) -> Option<Self> {
                match argument {
                    Argument::$variant($value) => Some($from),
                    _ => None,
                }
            }
        }
    };
}

field!(usize, Joint, joint => *joint, *joint);
field!(Vec<u32>, Orders, orders => orders.clone(), orders.clone());
field!(String, Name, name => name.clone(), name.clone());
field!(f64, Number, number => *number, *number);
field!([f64; 2], Point, point => *point, *point);

impl Field for FreeLength {
    fn argument(&self, key: &'static str) -> (&'static str, Argument) {
        (key, Argument::Length(self.0))
    }

    fn of(argument: &Argument) -> Option<Self> {
        if let Argument::Length(length) = argument { Some(Self(*length)) } else { None }
    }
}

impl Field for Mount {
    fn argument(&self, key: &'static str) -> (&'static str, Argument) {
        match self {
            Self::Joint(joint) => (key, Argument::Joint(*joint)),
            Self::Base => ("base", Argument::Base(true)),
        }
    }

    fn of(argument: &Argument) -> Option<Self> {
        match argument {
            Argument::Joint(joint) => Some(Self::Joint(*joint)),
            Argument::Base(true) => Some(Self::Base),
            _ => None,
        }
    }
}
