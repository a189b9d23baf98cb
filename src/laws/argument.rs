//! Arguments of effects, as files write them.

use serde::Serialize;

/// Part of the arm that moves with a covariate: a joint, from 1, or the base.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mount {
    /// A joint that takes a command.
    Joint(usize),
    /// The base.
    Base,
}

/// Length of a spring at which it pulls with its preload alone \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeLength(pub f64);

/// Kind of an argument: the values it may have on an arm.
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
    /// Number of a joint before which there is a link.
    LinkedJoint,
    /// Number of a revolute joint that gives way about its axis.
    RelievedJoint,
    /// Number of a joint that takes a command, other than the one of the argument before.
    OtherJoint,
    /// A joint that takes a command, or the base.
    Mount,
    /// Name of a beam.
    Beam,
    /// Name of a covariate of the problem.
    Covariate,
    /// Whole orders of harmonics.
    Orders,
    /// Order of a wave, cycles a revolution.
    Order,
    /// A time \[s\].
    Time,
    /// A time above zero \[s\].
    Duration,
    /// A path of a joint above zero \[rad\].
    Distance,
    /// A point of the plane across a joint's axis \[m\].
    Point,
    /// A length, 0 or more \[m\].
    FreeLength,
}

impl ArgumentKind {
    /// Returns true if the value is searched: effects that differ in nothing else are one effect
    /// whose value is not yet found.
    pub fn is_searched(self) -> bool {
        matches!(self, Self::Order | Self::Time | Self::Duration | Self::Distance)
    }

    /// Returns true if values between those of the candidates can be told apart.
    pub fn is_scalable(self) -> bool {
        matches!(self, Self::Duration | Self::Distance)
    }
}

/// Value of an argument.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum Argument {
    /// Number of a joint, from 1.
    Joint(usize),
    /// Orders of harmonics.
    Orders(Vec<u32>),
    /// Name of a beam or of a declared law.
    Name(String),
    /// A time \[s\], a path \[rad\], or the order of a wave.
    Number(f64),
    /// A point of a plane \[m\].
    Point([f64; 2]),
    /// A length that is no part of the place \[m\].
    Length(f64),
    /// The base, `true`.
    Base(bool),
    /// Text that is no part of the place.
    Text(String),
    /// Formulas.
    Texts(Vec<String>),
    /// Named numbers.
    #[serde(serialize_with = "as_map")]
    Numbers(Vec<(&'static str, f64)>),
}

fn as_map<S: serde::Serializer>(
    numbers: &[(&'static str, f64)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(numbers.iter().copied())
}

impl Argument {
    /// Returns the value as TOML writes it.
    pub fn toml(&self) -> String {
        let list = |all: Vec<String>| format!("[{}]", all.join(", "));
        match self {
            Self::Joint(joint) => joint.to_string(),
            Self::Orders(orders) => list(orders.iter().map(u32::to_string).collect()),
            Self::Name(name) | Self::Text(name) => quoted(name),
            Self::Texts(texts) => list(texts.iter().map(|text| quoted(text)).collect()),
            Self::Base(there) => there.to_string(),
            Self::Point([x, y]) => format!("[{}, {}]", float(*x), float(*y)),
            Self::Number(number) | Self::Length(number) => float(*number),
            Self::Numbers(numbers) => {
                let all: Vec<String> = numbers
                    .iter()
                    .map(|(key, value)| format!("{key} = {}", float(*value)))
                    .collect();
                format!("{{ {} }}", all.join(", "))
            }
        }
    }

    /// Returns its part of the place of an effect, which parameters carry in brackets.
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

/// Returns a name in quotes as TOML writes it, with a backslash before quotes and backslashes.
pub(crate) fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
}

/// Returns a number as TOML writes a float.
fn float(number: f64) -> String {
    if number.fract() == 0.0 { format!("{number:.1}") } else { number.to_string() }
}

/// Type of a field of an effect, which is read from and written as an argument.
pub(super) trait Field: Sized {
    /// Returns the argument with its key, by that of the field.
    fn argument(&self, key: &'static str) -> (&'static str, Argument);
    /// Returns the value of an argument of this type.
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
