//! Properties of effects that follow from the data of their laws.

use std::{collections::BTreeSet, f64::consts::TAU};

use serde::ser::{Serialize, SerializeMap, Serializer};

use super::argument::{Argument, ArgumentKind};
use super::catalogue::Effect;
use super::expression::{Vocabulary, parse};
use super::family::{At, Family, Need, TermEntry};
use super::law::LAW;
use super::quantity::Quantity;
use super::site::JointField;
use super::term::EffectTerm;
use super::text::filled;

impl Effect {
    /// Returns the name of the effect in files.
    pub fn name(&self) -> &'static str {
        self.family().map_or(LAW, |family| family.name)
    }

    /// Returns true if both are the same effect with the same arguments, or laws of the same name.
    pub(crate) fn is_same_as(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Law(law), Self::Law(other)) => law.name() == other.name(),
            _ => self == other,
        }
    }

    /// Returns the place of the effect, which parameter names contain in brackets: a joint's
    /// number, a link, a time, the name of a law. Empty if it acts on the whole arm or measurement.
    #[doc(hidden)]
    pub fn place(&self) -> String {
        if let Self::Law(law) = self { law.name().to_owned() } else { self.place_without(None) }
    }

    /// Returns the places of all arguments but the one with the key `left_out`.
    fn place_without(&self, left_out: Option<&str>) -> String {
        let arguments = self.arguments().into_iter().filter(|(key, _)| Some(*key) != left_out);
        arguments.filter_map(|(_, argument)| argument.place()).collect::<Vec<_>>().join(",")
    }

    /// Returns the declaration in the syntax of a problem file: `gear-ratio = { joint = 3 }`.
    #[doc(hidden)]
    pub fn declaration(&self) -> String {
        let arguments: Vec<_> =
            self.arguments().iter().map(|(key, argument)| (*key, argument.toml())).collect();
        declaration(self.name(), &arguments)
    }

    /// Returns the value of the argument with this key; `None` if the effect has no such argument.
    pub(crate) fn argument(&self, key: &str) -> Option<Argument> {
        self.arguments().into_iter().find(|(known, _)| *known == key).map(|(_, argument)| argument)
    }

    /// Returns the number, from 1, of the joint at which the effect acts; `None` if it acts at
    /// none.
    pub(crate) fn joint(&self) -> Option<usize> {
        if let Self::Law(law) = self {
            return law.joint();
        }
        self.arguments().into_iter().find_map(|(_, argument)| match argument {
            Argument::Joint(joint) => Some(joint),
            _ => None,
        })
    }

    /// Returns the name of the link on which the effect acts; `None` if it acts on none.
    pub(crate) fn link(&self) -> Option<String> {
        match self {
            Self::Law(law) => law.link().map(str::to_owned),
            _ => match self.argument("link")? {
                Argument::Name(link) => Some(link),
                _ => None,
            },
        }
    }

    /// Returns the name of the covariate on which the effect depends; `None` if there is none.
    pub(crate) fn covariate(&self) -> Option<String> {
        let (key, _) = self.key_of(|kind| kind == ArgumentKind::Covariate)?;
        match self.argument(key)? {
            Argument::Name(name) => Some(name),
            _ => None,
        }
    }

    /// Returns the name of the camera on whose images the effect acts; `None` if there is none.
    pub(crate) fn camera(&self) -> Option<String> {
        if let Self::Law(law) = self {
            return law.camera().map(str::to_owned);
        }
        let (key, _) = self.key_of(|kind| kind == ArgumentKind::Camera)?;
        match self.argument(key)? {
            Argument::Name(name) => Some(name),
            _ => None,
        }
    }

    /// Returns key and kind of the first argument for whose kind `is_wanted` is true; `None` if
    /// there is none.
    fn key_of(
        &self,
        is_wanted: impl Fn(ArgumentKind) -> bool,
    ) -> Option<(&'static str, ArgumentKind)> {
        self.family()?.arguments.iter().find(|(_, kind)| is_wanted(*kind)).copied()
    }

    /// Returns the parameters with their formulas, parsed with the words of `vocabulary`.
    /// Parameters whose formula uses another word are left out.
    pub(crate) fn entries(&self, vocabulary: &Vocabulary) -> Vec<EffectTerm> {
        if let Self::Law(law) = self {
            return law.entries();
        }
        let family = self.family().unwrap_or(&Family::PLAIN);
        let arguments = self.arguments();
        let is_at_mount = |entry: &&TermEntry| match entry.at {
            At::Coordinate => self.joint().is_some(),
            At::BaseShift(_) | At::BaseTurn(_) => self.joint().is_none(),
            _ => true,
        };
        let term = |entry: &TermEntry, arguments: &[(&str, Argument)]| {
            let formula = match entry.formula {
                "" => None,
                formula => Some(parse(&filled(formula, arguments), vocabulary).ok()?),
            };
            Some(EffectTerm {
                name: filled(entry.name, arguments),
                at: entry.at,
                formula,
                prior: entry.prior,
                nominal: entry.nominal,
                never_negative: entry.never_negative,
                inner: None,
            })
        };
        let entries = || family.terms.iter().filter(is_at_mount);
        match arguments.iter().find(|(_, argument)| matches!(argument, Argument::Orders(_))) {
            Some((key, Argument::Orders(orders))) => orders
                .iter()
                .flat_map(|&order| {
                    let single = |(known, argument): &(_, Argument)| {
                        let order = Argument::Orders(vec![order]);
                        (*known, if known == key { order } else { argument.clone() })
                    };
                    let arguments: Vec<(&str, Argument)> = arguments.iter().map(single).collect();
                    entries().filter_map(|entry| term(entry, &arguments)).collect::<Vec<_>>()
                })
                .collect(),
            _ => entries().filter_map(|entry| term(entry, &arguments)).collect(),
        }
    }

    /// Returns the parameters without reference to a particular arm: any joint and covariate is
    /// accepted.
    fn entries_without_arm(&self) -> Vec<EffectTerm> {
        let covariates: Vec<String> = self.covariate().into_iter().collect();
        let slides = [false; MAX_JOINTS];
        self.entries(&Vocabulary {
            slides: &slides,
            covariates: &covariates,
            ..Vocabulary::default()
        })
    }

    /// Returns the quantities of a pose that occur in the formulas of the effect, without
    /// duplicates.
    pub(crate) fn quantities(&self) -> Vec<Quantity> {
        let mut found = Vec::new();
        for formula in self.entries_without_arm().into_iter().filter_map(|entry| entry.formula) {
            for quantity in formula.expression.quantities() {
                if !found.contains(&quantity) {
                    found.push(quantity);
                }
            }
        }
        found
    }

    /// Returns true if a quantity for which `is_wanted` is true occurs in the effect's formulas.
    fn depends_on(&self, is_wanted: fn(Quantity) -> bool) -> bool {
        self.quantities().into_iter().any(is_wanted)
    }

    /// Returns true if a parameter of the effect acts at the site `at`.
    pub(crate) fn acts_at(&self, at: At) -> bool {
        match self {
            Self::Law(law) => law.at() == at,
            _ => {
                self.family().is_some_and(|family| family.terms.iter().any(|entry| entry.at == at))
            }
        }
    }

    /// Returns true if the effect depends on the temperature.
    pub(crate) fn is_thermal(&self) -> bool {
        self.depends_on(Quantity::is_thermal)
    }

    /// Returns true if the effect depends on directions of approach.
    pub(crate) fn has_sides(&self) -> bool {
        !self.sided_joints().is_empty()
    }

    /// Returns the joints, counted from 0, on whose directions of approach the effect depends.
    pub(crate) fn sided_joints(&self) -> BTreeSet<usize> {
        let played = self.joint().filter(|_| self.is_play()).and_then(|joint| joint.checked_sub(1));
        let of_formulas = self.quantities().into_iter().filter_map(Quantity::sided_joint);
        played.into_iter().chain(of_formulas).collect()
    }

    /// Returns true if the effect is the play of a joint, which the moment of the loads takes up
    /// without directions of approach.
    pub(crate) fn is_play(&self) -> bool {
        self.acts_at(At::JointOrSlide(JointField::Play, JointField::SlidingPlay))
    }

    /// Returns true if friction alone makes the effect depend on directions of approach.
    pub(crate) fn is_friction_alone(&self) -> bool {
        !self.is_play() && !self.depends_on(|quantity| matches!(quantity, Quantity::Approach(_)))
    }

    /// Returns true if the effect depends on time or the order of the poses, rather than on
    /// quantities that a choice of poses can vary.
    pub(crate) fn follows_time(&self) -> bool {
        self.depends_on(Quantity::follows_time)
    }

    /// Returns true if the family of the effect has one of these needs.
    pub(crate) fn has_need(&self, needs: &[Need]) -> bool {
        self.family().is_some_and(|family| needs.iter().any(|need| family.needs.contains(need)))
    }

    /// Returns true if the effect depends on earlier poses.
    pub(crate) fn has_memory(&self) -> bool {
        self.depends_on(Quantity::has_memory)
    }

    /// Returns the joint, counted from 1, that a gravity compensator supports; `None` for other
    /// effects.
    pub(crate) fn compensated(&self) -> Option<usize> {
        self.acts_at(At::Joint(JointField::SpringRate)).then(|| self.joint()).flatten()
    }

    /// Returns (joint, commanded joint), both counted from 1, if the effect adds to the coordinate
    /// of a joint a function of one command alone; else `None`.
    pub(crate) fn function_of(&self) -> Option<(usize, usize)> {
        let joint = self.joint()?;
        let entries = self.entries_without_arm();
        if entries.is_empty() || entries.iter().any(|entry| entry.at != At::Coordinate) {
            return None;
        }
        match self.quantities().as_slice() {
            [Quantity::Command(from)] => Some((joint, from + 1)),
            _ => None,
        }
    }

    /// Returns joint (counted from 1) and order of each wave sin kq or cos kq that adds to the
    /// coordinate of that joint itself.
    pub(crate) fn waves(&self) -> Vec<(usize, f64)> {
        let Some((joint, from)) = self.function_of() else { return Vec::new() };
        let wave = |entry: EffectTerm| {
            entry.formula.and_then(|formula| Some(formula.expression.as_wave()?.1))
        };
        let waves = self.entries_without_arm().into_iter().filter_map(wave);
        let mut orders: Vec<f64> = waves.filter(|_| joint == from).collect();
        orders.dedup();
        orders.into_iter().map(|order| (joint, order)).collect()
    }

    /// Returns an integer order of a wave that both effects have at the same joint; `None` if the
    /// first order that they share is no integer, or if they share none.
    pub(crate) fn shared_order(&self, other: &Self) -> Option<u32> {
        let waves = other.waves();
        let shared = self.waves().into_iter().find(|wave| waves.contains(wave))?.1;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "orders are above 0, and whole here"
        )]
        (shared.fract() == 0.0).then_some(shared as u32)
    }

    /// Returns the description of the effect in words.
    pub fn describe(&self) -> String {
        if let Self::Law(law) = self {
            law.describe()
        } else {
            let family = self.family().unwrap_or(&Family::PLAIN);
            let of_base = self.argument("base").is_some();
            let says = if of_base { family.says_of_base } else { family.says };
            filled(says, &self.arguments())
        }
    }

    /// Returns the description of the effect. If times were not measured, it refers to row numbers,
    /// counted from 1, instead. `slides` is true for each prismatic joint, so that the period of a
    /// wave is a length there and an angle elsewhere.
    pub(crate) fn describe_in(&self, time_measured: bool, slides: &[bool]) -> String {
        if let Self::JointWave { joint, order } = self {
            let is_slide = slides.get(joint.wrapping_sub(1)).copied().unwrap_or(false);
            let period = if is_slide {
                format!("{:.2} mm", 1e3 * TAU / order)
            } else {
                format!("{:.2}°", 360.0 / order)
            };
            return format!("{} (every {period})", self.describe());
        }
        match self.family() {
            Some(family) if !time_measured && !family.says_by_row.is_empty() => {
                filled(family.says_by_row, &self.arguments())
            }
            _ => self.describe(),
        }
    }

    /// Returns the name of the family and the place as in parameter names, without the argument
    /// that the search determines.
    #[doc(hidden)]
    pub fn name_and_place(&self) -> String {
        if let Self::Law(law) = self {
            return format!("law {}", law.name());
        }
        let place = self.place_without(self.searched());
        if place.is_empty() { self.name().to_owned() } else { format!("{} {place}", self.name()) }
    }

    /// Returns the key of the argument that the search determines; `None` if there is none.
    pub(crate) fn searched(&self) -> Option<&'static str> {
        self.key_of(ArgumentKind::is_searched).map(|(key, _)| key)
    }

    /// Returns kind and value of the argument that the search determines, such as a time, an order
    /// or a path; `None` if there is none.
    pub(crate) fn searched_value(&self) -> Option<(ArgumentKind, f64)> {
        let (key, kind) = self.key_of(ArgumentKind::is_searched)?;
        match self.argument(key)? {
            Argument::Number(value) => Some((kind, value)),
            _ => None,
        }
    }

    /// Returns the other joint, counted from 1, whose command moves the joint at which the effect
    /// acts; `None` if there is none.
    pub(crate) fn other_joint(&self) -> Option<usize> {
        let (key, _) = self.key_of(|kind| kind == ArgumentKind::OtherJoint)?;
        match self.argument(key)? {
            Argument::Joint(joint) => Some(joint),
            _ => None,
        }
    }

    /// Returns true if the search determines an argument, such as a time, or composed the formula.
    /// Effects with equal [`Self::name_and_place`] then count as one.
    pub(crate) fn is_searched(&self) -> bool {
        self.searched().is_some() || self.is_composed()
    }

    /// Returns true for a law whose formula a search composed.
    pub(crate) fn is_composed(&self) -> bool {
        matches!(self, Self::Law(law) if law.composed_ln_prior().is_some())
    }

    /// Returns true if the effect only changes the coordinate of a joint or its rotation about its
    /// axis.
    pub(crate) fn acts_at_joint(&self) -> bool {
        let is_there = |at: At| {
            matches!(
                at,
                At::Coordinate
                    | At::Joint(JointField::Compliance | JointField::Cubic | JointField::Play)
                    | At::JointOrSlide(JointField::Play, _)
            )
        };
        match self {
            Self::Law(law) => is_there(law.at()),
            _ => self.family().is_some_and(|family| {
                self.joint().is_some() && family.terms.iter().all(|entry| is_there(entry.at))
            }),
        }
    }

    /// Returns true if both effects are equal, except perhaps for the value of the argument that
    /// the search determines.
    pub(crate) fn is_but_for_search(&self, other: &Self) -> bool {
        let is_alike = || {
            std::mem::discriminant(self) == std::mem::discriminant(other)
                && self.name_and_place() == other.name_and_place()
        };
        self == other || (self.is_searched() && is_alike())
    }

    /// Returns the effect with its time constant or friction distance multiplied by `factor`,
    /// rounded to three digits. `None` if the effect has no such argument, or if the product is
    /// zero or not finite.
    pub(crate) fn with_scaled_argument(&self, factor: f64) -> Option<Self> {
        let (key, _) = self.key_of(ArgumentKind::is_scalable)?;
        let Some(Argument::Number(number)) = self.argument(key) else { return None };
        self.with(key, &Argument::Number(to_three_digits(factor * number)?))
    }

    /// Returns the effect with `value` for the argument `key`; `None` if the value is of another
    /// kind, and for laws.
    fn with(&self, key: &str, value: &Argument) -> Option<Self> {
        let arguments = self.arguments();
        Self::from_name(self.name(), &|wanted| {
            let present = arguments.iter().find(|(known, _)| *known == wanted);
            if wanted == key { Some(value) } else { present.map(|(_, value)| value) }.cloned()
        })
    }

    /// Returns the orders of a harmonic; `None` for other effects.
    pub(crate) fn harmonic_orders(&self) -> Option<Vec<u32>> {
        self.orders().map(|(_, orders)| orders)
    }

    /// Returns the orders of a harmonic, and their key; `None` for other effects.
    fn orders(&self) -> Option<(&'static str, Vec<u32>)> {
        let (key, _) = self.key_of(|kind| kind == ArgumentKind::Orders)?;
        match self.argument(key)? {
            Argument::Orders(orders) => Some((key, orders)),
            _ => None,
        }
    }

    /// Returns the parts of the effect that are tested separately: each order of a harmonic, or
    /// else the effect itself.
    pub(crate) fn parts(&self) -> Vec<Self> {
        let Some((key, orders)) = self.orders() else { return vec![self.clone()] };
        let with_order = |order: u32| self.with(key, &Argument::Orders(vec![order]));
        orders.into_iter().filter_map(with_order).collect()
    }

    /// Returns the key of the orders, the orders of this effect and those of the other one, if the
    /// effects differ in nothing else; else `None`.
    fn orders_of_both(&self, other: &Self) -> Option<(&'static str, Vec<u32>, Vec<u32>)> {
        let ((key, orders), (_, more)) = (self.orders()?, other.orders()?);
        let same = self.with(key, &Argument::Orders(more.clone()))? == *other;
        same.then_some((key, orders, more))
    }

    /// Returns one effect with the orders of both, if both are harmonics of the same joint; else
    /// `None`.
    pub(crate) fn joined(&self, other: &Self) -> Option<Self> {
        let (key, mut orders, more) = self.orders_of_both(other)?;
        let added: Vec<u32> = more.into_iter().filter(|order| !orders.contains(order)).collect();
        orders.extend(added);
        orders.sort_unstable();
        self.with(key, &Argument::Orders(orders))
    }

    /// Returns true if both effects are equal, or if they are harmonics of the same joint and this
    /// one has all orders of the other.
    #[doc(hidden)]
    pub fn covers(&self, other: &Self) -> bool {
        match self.orders_of_both(other) {
            Some((_, orders, wanted)) => wanted.iter().all(|order| orders.contains(order)),
            None => self == other,
        }
    }
}

/// Number of joints that formulas may name when properties of effects are derived without an arm;
/// more than any arm has.
const MAX_JOINTS: usize = 1000;

/// Returns `name = { key = value }`, or `name = true` without arguments.
pub(crate) fn declaration(name: &str, arguments: &[(&str, String)]) -> String {
    let entries: Vec<String> =
        arguments.iter().map(|(key, value)| format!("{key} = {value}")).collect();
    match entries.join(", ") {
        none if none.is_empty() => format!("{name} = true"),
        all => format!("{name} = {{ {all} }}"),
    }
}

/// Returns a positive number rounded to three digits, at most to a whole number; `None` if the
/// result is zero or not finite.
pub(crate) fn to_three_digits(number: f64) -> Option<f64> {
    let step = 10_f64.powf(number.log10().floor() - 2.0);
    let rounded = (number / step).round() * step;
    // The number is rounded as a text, so that it prints with three digits.
    let written = if step < 1.0 { format!("{rounded:.6}").parse().ok()? } else { rounded.round() };
    (written > 0.0).then_some(written)
}

/// Serialises the effect with its arguments as keys: `{"effect": "gear-ratio", "joint": 3}`.
impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let arguments = self.arguments();
        let mut map = serializer.serialize_map(Some(1 + arguments.len()))?;
        map.serialize_entry("effect", self.name())?;
        for (key, argument) in &arguments {
            map.serialize_entry(key, argument)?;
        }
        map.end()
    }
}
