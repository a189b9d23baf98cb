//! Arguments of effects: what there are, how each is read, and an example of each.

use serde::Serialize;

use super::quoted::quoted;
use super::section::Section;
use super::{Joint, JointKind, Problem};
use crate::error::{InputError, InputErrorKind};
use crate::quantity::Unit;

/// Most orders of one effect.
const MOST_ORDERS: usize = 100;
/// Highest order of a wave: beyond it commands to a hundredth of a degree tell no phase.
pub(crate) const HIGHEST_ORDER: f64 = 1e4;

/// Where something of the arm moves with a covariate: a joint, from 1, or the base.
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

/// An argument of an effect as the files write it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum Argument {
    /// Number of a joint, from 1.
    Joint(usize),
    /// Orders of harmonics.
    Orders(Vec<u32>),
    /// Name of a beam, or the place of a custom effect.
    Name(String),
    /// A time \[s\], or the order of a wave.
    Number(f64),
    /// A point of a plane \[m\].
    Point([f64; 2]),
    /// A length that says nothing of the place \[m\].
    Length(f64),
    /// The base, `true`.
    Base(bool),
}

impl Argument {
    /// The key that it stands behind, by that of its field: a place is the base or a joint.
    pub(super) fn key(&self, field: &'static str) -> &'static str {
        if matches!(self, Self::Base(_)) { "base" } else { field }
    }

    /// As TOML writes it.
    pub fn toml(&self) -> String {
        match self {
            Self::Joint(joint) => joint.to_string(),
            Self::Orders(orders) => {
                format!("[{}]", orders.iter().map(u32::to_string).collect::<Vec<_>>().join(", "))
            }
            Self::Name(name) => quoted(name),
            Self::Base(there) => there.to_string(),
            Self::Point([x, y]) => format!("[{}, {}]", float(*x), float(*y)),
            Self::Number(number) | Self::Length(number) => float(*number),
        }
    }

    /// Its part of the place of an effect: orders have none, nor has what is about a place that is
    /// named.
    pub(crate) fn place(&self) -> Option<String> {
        match self {
            Self::Joint(joint) => Some(joint.to_string()),
            Self::Name(name) => Some(name.clone()),
            Self::Number(number) => Some(number.to_string()),
            Self::Base(_) => Some("base".to_owned()),
            Self::Orders(_) | Self::Point(_) | Self::Length(_) => None,
        }
    }
}

/// A float, whatever its value.
fn float(number: f64) -> String {
    if number.fract() == 0.0 { format!("{number:.1}") } else { number.to_string() }
}

impl From<&[f64; 2]> for Argument {
    fn from(point: &[f64; 2]) -> Self {
        Self::Point(*point)
    }
}

impl From<&FreeLength> for Argument {
    fn from(length: &FreeLength) -> Self {
        Self::Length(length.0)
    }
}

impl From<&usize> for Argument {
    fn from(joint: &usize) -> Self {
        Self::Joint(*joint)
    }
}

impl From<&Vec<u32>> for Argument {
    fn from(orders: &Vec<u32>) -> Self {
        Self::Orders(orders.clone())
    }
}

impl From<&String> for Argument {
    fn from(name: &String) -> Self {
        Self::Name(name.clone())
    }
}

impl From<&Mount> for Argument {
    fn from(place: &Mount) -> Self {
        match *place {
            Mount::Joint(joint) => Self::Joint(joint),
            Mount::Base => Self::Base(true),
        }
    }
}

impl From<&f64> for Argument {
    fn from(number: &f64) -> Self {
        Self::Number(*number)
    }
}

/// The arguments of one effect, read one after the other and checked against the arm: a method for
/// each kind.
pub(crate) struct Reader<'s, 'a, 'i> {
    pub section: Section<'a, 'i>,
    joints: &'s [Joint],
    /// The joint that was read last.
    last: Option<usize>,
}

impl<'s, 'a, 'i> Reader<'s, 'a, 'i> {
    pub fn new(section: Section<'a, 'i>, joints: &'s [Joint]) -> Self {
        Self { section, joints, last: None }
    }

    /// A joint's number, counted from 1.
    pub fn any_joint(&mut self, key: &str) -> Result<usize, InputError> {
        let item = self.section.require(key, &format!("{key} = …, a joint's number"))?;
        let joint = item.whole(0)?;
        match usize::try_from(joint) {
            Ok(number) if (1..=self.joints.len()).contains(&number) => Ok(number),
            _ => Err(item.error(InputErrorKind::UnknownJoint { joint, joints: self.joints.len() })),
        }
    }

    /// The number of a joint before which there is a link.
    pub fn linked_joint(&mut self, key: &str) -> Result<usize, InputError> {
        self.any_joint(key)
    }

    /// The number of a joint that takes a command.
    pub fn moving_joint(&mut self, key: &str) -> Result<usize, InputError> {
        let joint = self.any_joint(key)?;
        let kind = self.joints.get(joint - 1).map(Joint::command_kind);
        if let (Some(JointKind::Fixed), Some(item)) = (kind, self.section.peek(key)) {
            return Err(item.error(InputErrorKind::NoCommand { joint }));
        }
        self.last = Some(joint);
        Ok(joint)
    }

    /// The number of a revolute joint that takes a command.
    pub fn turning_joint(&mut self, key: &str) -> Result<usize, InputError> {
        let joint = self.moving_joint(key)?;
        let turns = self.joints.get(joint - 1).is_some_and(|own| own.kind == JointKind::Revolute);
        match self.section.peek(key) {
            Some(item) if !turns => Err(item.error(InputErrorKind::NotRevolute { joint })),
            _ => Ok(joint),
        }
    }

    /// The same of a joint whose load something takes off: that it gives way is seen when all
    /// effects are read.
    pub fn relieved_joint(&mut self, key: &str) -> Result<usize, InputError> {
        self.turning_joint(key)
    }

    /// The number of a prismatic joint that takes a command.
    pub fn sliding_joint(&mut self, key: &str) -> Result<usize, InputError> {
        let joint = self.moving_joint(key)?;
        let slides = self.joints.get(joint - 1).is_some_and(|own| own.kind == JointKind::Prismatic);
        match self.section.peek(key) {
            Some(item) if !slides => Err(item.error(InputErrorKind::NoSlide { joint })),
            _ => Ok(joint),
        }
    }

    /// The number of another joint that takes a command than the one before.
    pub fn other_joint(&mut self, key: &str) -> Result<usize, InputError> {
        let before = self.last;
        let joint = self.moving_joint(key)?;
        if before == Some(joint) {
            return Err(self.section.error(InputErrorKind::CoupledToItself { joint }));
        }
        Ok(joint)
    }

    /// A joint that takes a command, or else `base = true`.
    pub fn mount(&mut self, key: &str) -> Result<Mount, InputError> {
        match self.section.get("base") {
            Some(item) if !item.boolean()? || self.section.peek(key).is_some() => {
                Err(item.error(InputErrorKind::NotOnePlace))
            }
            Some(_) => Ok(Mount::Base),
            None => self.moving_joint(key).map(Mount::Joint),
        }
    }

    /// The name of a covariate; whether there is one is seen when the data are read.
    pub fn covariate(&mut self, key: &str) -> Result<String, InputError> {
        let item = self
            .section
            .require(key, &format!("{key} = \"…\", the name of a column in [data.covariates]"))?;
        Ok(item.text()?.to_owned())
    }

    /// The name of a beam.
    pub fn beam(&mut self, key: &str) -> Result<String, InputError> {
        let item = self.section.require(key, &format!("{key} = \"…\", the name of a beam"))?;
        let link = item.text()?.to_owned();
        let links = || {
            self.joints.iter().filter_map(|joint| joint.beam.as_ref()).map(|beam| beam.name.clone())
        };
        if links().any(|known| known == link) {
            Ok(link)
        } else {
            Err(item.error(InputErrorKind::UnknownLink { link, links: links().collect() }))
        }
    }

    /// Orders of harmonics, at least one, each once.
    pub fn orders(&mut self, key: &str) -> Result<Vec<u32>, InputError> {
        let item = self.section.require(key, &format!("{key} = [1], the harmonics"))?;
        let mut orders = Vec::new();
        let elements = item.list("a list of whole numbers")?;
        item.check_count("orders", elements.len(), MOST_ORDERS)?;
        for element in elements {
            let order = u32::from(element.small()?);
            if orders.contains(&order) {
                return Err(element.error(InputErrorKind::RepeatedOrder { order }));
            }
            orders.push(order);
        }
        if orders.is_empty() { Err(item.error(InputErrorKind::NoOrders)) } else { Ok(orders) }
    }

    /// An order of a wave, above zero: cycles a revolution.
    pub fn order(&mut self, key: &str) -> Result<f64, InputError> {
        let item = self.section.require(key, &format!("{key} = 7.5, cycles a revolution"))?;
        let order = item.number()?;
        if order > 0.0 && order <= HIGHEST_ORDER {
            Ok(order)
        } else {
            Err(item.error(InputErrorKind::NotAnOrder { order, highest: HIGHEST_ORDER }))
        }
    }

    /// A time \[s\]; its key ends in the unit.
    pub fn time(&mut self, key: &str) -> Result<f64, InputError> {
        let base = key.strip_suffix("_s").unwrap_or(key);
        self.section
            .number(base, Unit::Time)?
            .ok_or_else(|| self.section.missing(base, Unit::Time.alternatives(base)))
    }

    /// A time above zero \[s\]; its key ends in the unit.
    pub fn duration(&mut self, key: &str) -> Result<f64, InputError> {
        let base = key.strip_suffix("_s").unwrap_or(key);
        let found = self
            .section
            .positive(base, Unit::Time, |value| InputErrorKind::NotPositive { value })?;
        found.ok_or_else(|| self.section.missing(base, Unit::Time.alternatives(base)))
    }

    /// An angle above zero \[rad\]; its key ends in the unit.
    pub fn way(&mut self, key: &str) -> Result<f64, InputError> {
        let base = key.strip_suffix("_rad").unwrap_or(key);
        let found = self
            .section
            .positive(base, Unit::Angle, |value| InputErrorKind::NotPositive { value })?;
        found.ok_or_else(|| self.section.missing(base, Unit::Angle.alternatives(base)))
    }

    /// An end of a spring, x and y in the plane across the axis, which it does not lie on \[m\];
    /// its key ends in the unit.
    pub fn arm(&mut self, key: &str) -> Result<[f64; 2], InputError> {
        let base = key.strip_suffix("_m").unwrap_or(key);
        let Some((item, suffix)) = self.section.quantity(base, Unit::Length)? else {
            return Err(self.section.missing(base, Unit::Length.alternatives(base)));
        };
        let end = item.pair()?.map(suffix.to_si);
        if end[0].hypot(end[1]) > 0.0 {
            Ok(end)
        } else {
            Err(item.error(InputErrorKind::OnTheAxis))
        }
    }

    /// The free length of a spring, 0 or more \[m\]; its key ends in the unit.
    pub fn free_length(&mut self, key: &str) -> Result<FreeLength, InputError> {
        let base = key.strip_suffix("_m").unwrap_or(key);
        let found = self.section.not_negative(base, Unit::Length)?;
        found
            .map(FreeLength)
            .ok_or_else(|| self.section.missing(base, Unit::Length.alternatives(base)))
    }
}

/// Examples of the same kinds on an arm, as TOML writes them.
pub(super) struct Examples<'s> {
    joints: &'s [Joint],
    covariate: Option<&'s str>,
}

impl<'s> Examples<'s> {
    pub fn new(problem: &'s Problem) -> Self {
        let covariate = problem.data.covariates.first().map(|own| own.name.as_str());
        Self { joints: &problem.joints, covariate }
    }

    fn moving(&self) -> impl Iterator<Item = usize> {
        (1..)
            .zip(self.joints)
            .filter(|(_, joint)| joint.command_kind() != JointKind::Fixed)
            .map(|(number, _)| number)
    }

    fn first(&self) -> usize {
        self.moving().next().unwrap_or(1)
    }

    pub fn any_joint(&self) -> String {
        self.first().to_string()
    }

    pub fn moving_joint(&self) -> String {
        self.first().to_string()
    }

    pub fn other_joint(&self) -> String {
        self.moving().nth(1).unwrap_or(self.first() + 1).to_string()
    }

    pub fn turning_joint(&self) -> String {
        let turns = |&number: &usize| {
            self.joints.get(number - 1).is_some_and(|own| own.kind == JointKind::Revolute)
        };
        self.moving().find(turns).unwrap_or(self.first()).to_string()
    }

    pub fn relieved_joint(&self) -> String {
        let gives = |&number: &usize| {
            let turns = |own: &Joint| own.kind == JointKind::Revolute && own.stiffness.is_some();
            self.joints.get(number - 1).is_some_and(turns)
        };
        self.moving().find(gives).map_or_else(|| self.turning_joint(), |number| number.to_string())
    }

    pub fn sliding_joint(&self) -> String {
        let slides = |&number: &usize| {
            self.joints.get(number - 1).is_some_and(|own| own.kind == JointKind::Prismatic)
        };
        self.moving().find(slides).unwrap_or(self.first()).to_string()
    }

    pub fn linked_joint(&self) -> String {
        let long = (1..).zip(self.joints).find(|(_, joint)| joint.a != 0.0);
        long.map_or(self.first(), |(number, _)| number).to_string()
    }

    pub fn mount(&self) -> String {
        self.moving_joint()
    }

    pub fn covariate(&self) -> String {
        quoted(self.covariate.unwrap_or("tilt_deg"))
    }

    pub fn beam(&self) -> String {
        let name = self
            .joints
            .iter()
            .find_map(|joint| joint.beam.as_ref())
            .map_or("A", |beam| beam.name.as_str());
        quoted(name)
    }

    #[expect(clippy::unused_self, reason = "a method like those of the other kinds")]
    pub fn orders(&self) -> String {
        "[1]".to_owned()
    }

    #[expect(clippy::unused_self, reason = "a method like those of the other kinds")]
    pub fn time(&self) -> String {
        "600.0".to_owned()
    }

    pub fn duration(&self) -> String {
        self.time()
    }

    #[expect(clippy::unused_self, reason = "a method like those of the other kinds")]
    pub fn way(&self) -> String {
        "0.8".to_owned()
    }

    #[expect(clippy::unused_self, reason = "a method like those of the other kinds")]
    pub fn arm(&self) -> String {
        "[0.0, 0.5]".to_owned()
    }

    #[expect(clippy::unused_self, reason = "a method like those of the other kinds")]
    pub fn free_length(&self) -> String {
        "0.3".to_owned()
    }

    #[expect(clippy::unused_self, reason = "a method like those of the other kinds")]
    pub fn order(&self) -> String {
        "7.5".to_owned()
    }
}
