//! The tables `[[effect]]`: one effect each, with its arguments.

use std::path::Path;

use toml::de::DeTable;

use super::item::{Document, Item};
use super::section::Section;
use super::{Data, Effect, EffectDeclaration, Equilibrium, Joint, JointKind, Problem, Statics};
use crate::error::{InputError, InputErrorKind, Location};
use crate::quantity::Unit;

/// The effects by name.
pub(crate) const NAMES: [&str; 21] = [
    "joint-compliance",
    "joint-harmonic",
    "gear-ratio",
    "backlash",
    "joint-nonlinear-stiffness",
    "joint-lateral-compliance",
    "joint-thermal-drift",
    "joint-coupling",
    "link-bending",
    "link-thermal-bending",
    "link-thermal-expansion",
    "unmodelled-mass",
    "payload-mass",
    "hoist-force",
    "hoist-direction",
    "base-compliance",
    "gravity-direction",
    "deflected-equilibrium",
    "tracker-scale",
    "tracker-drift",
    "station-shift",
];

/// Every `[[effect]]`.
pub(super) fn read(root: &mut Section<'_, '_>, joints: &[Joint]) -> Result<Vec<EffectDeclaration>, InputError> {
    let mut effects: Vec<EffectDeclaration> = Vec::new();
    for section in root.sections("effect")? {
        let entries = section.entries();
        let [(name, item)] = entries.as_slice() else {
            return Err(section.error(InputErrorKind::NotOneEffect { found: section.len() }));
        };
        let effect = effect(name, item, joints)?;
        if let Some(first) = effects.iter().find(|known| known.effect == effect) {
            let line = first.location.line.unwrap_or(0);
            return Err(item.error(InputErrorKind::RepeatedEffect { line }));
        }
        if let Some((order, line)) = effects.iter().find_map(|known| shared_order(known, &effect)) {
            return Err(item.error(InputErrorKind::RepeatedHarmonic { order, line }));
        }
        effects.push(EffectDeclaration { effect, location: item.location() });
    }
    Ok(effects)
}

/// An order that two declared harmonics of one joint share, and the line of the first.
fn shared_order(known: &EffectDeclaration, effect: &Effect) -> Option<(u32, usize)> {
    match (&known.effect, effect) {
        (Effect::JointHarmonic { joint, orders }, Effect::JointHarmonic { joint: other, orders: more })
            if joint == other =>
        {
            let order = more.iter().find(|order| orders.contains(order))?;
            Some((*order, known.location.line.unwrap_or(0)))
        }
        _ => None,
    }
}

/// Refuses what could never act on this arm: the declared model has it already, or has nothing for it to act on.
pub(super) fn check(
    effects: &[EffectDeclaration],
    statics: Statics,
    joints: &[Joint],
    data: &Data,
) -> Result<(), InputError> {
    let hoisted = || joints.iter().any(|joint| joint.beam.as_ref().is_some_and(|beam| beam.hoist.is_some()));
    for EffectDeclaration { effect, location } in effects {
        let kind = match effect {
            Effect::LinkBending { joint } if joints[joint - 1].a == 0.0 => InputErrorKind::NoLink { joint: *joint },
            Effect::DeflectedEquilibrium if statics.equilibrium == Equilibrium::Deflected => {
                InputErrorKind::InEquilibriumAlready
            }
            Effect::HoistForce | Effect::HoistDirection if !hoisted() => InputErrorKind::NoHoist,
            effect if effect.is_thermal() && data.reference_temperature.is_none() => {
                InputErrorKind::NeedsTemperature { write: "reference_temperature_C in [data]" }
            }
            _ => continue,
        };
        return Err(location.clone().error(kind));
    }
    Ok(())
}

/// One effect written as in a problem file, its `[[effect]]` left out: `gear-ratio = { joint = 3 }`; `hoist-force` alone
/// stands for `hoist-force = true`.
pub(super) fn parse(text: &str, named: &Path, problem: &Problem) -> Result<EffectDeclaration, InputError> {
    if text.contains('=') {
        return written(text.to_owned(), named, problem);
    }
    written(format!("{text} = true"), named, problem).map_err(|error| {
        let kind = match *error.kind {
            InputErrorKind::MissingKey { .. } => {
                InputErrorKind::NeedsArguments { write: format!("'{}'", example(text.trim(), &problem.joints)) }
            }
            kind => kind,
        };
        // Nobody wrote the text that was read.
        Location::file(named).with_key(text.trim()).error(kind)
    })
}

/// How an effect may be declared on this arm: `gear-ratio = { joint = 1 }`.
pub(crate) fn example(name: &str, joints: &[Joint]) -> String {
    let mut moving = (1..=joints.len()).filter(|number| joints[number - 1].kind != JointKind::Fixed);
    let joint = moving.next().unwrap_or(1);
    let link = || joints.iter().find_map(|joint| joint.beam.as_ref()).map_or("A", |beam| beam.name.as_str());
    let arguments = match name {
        "joint-harmonic" => format!("{{ joint = {joint}, orders = [1] }}"),
        "joint-coupling" => format!("{{ joint = {}, from = {joint} }}", moving.next().unwrap_or(joint + 1)),
        "link-bending" => {
            let long = (1..=joints.len()).find(|number| joints[number - 1].a != 0.0);
            format!("{{ joint = {} }}", long.unwrap_or(joint))
        }
        "link-thermal-bending" | "link-thermal-expansion" | "unmodelled-mass" => format!("{{ link = {:?} }}", link()),
        "station-shift" => "{ at_time_s = 600.0 }".to_owned(),
        name if name.starts_with("joint-") || ["gear-ratio", "backlash"].contains(&name) => {
            format!("{{ joint = {joint} }}")
        }
        _ => "true".to_owned(),
    };
    format!("{name} = {arguments}")
}

fn written(text: String, named: &Path, problem: &Problem) -> Result<EffectDeclaration, InputError> {
    let document = Document { file: named.to_owned(), text: text.into() };
    let table = document.table()?;
    let section = Section::new(&document, String::new(), 0..0, table.get_ref());
    let entries = section.entries();
    let [(name, item)] = entries.as_slice() else {
        return Err(section.error(InputErrorKind::NotOneEffect { found: section.len() }));
    };
    let declared = EffectDeclaration { effect: effect(name, item, &problem.joints)?, location: item.location() };
    check(std::slice::from_ref(&declared), problem.statics, &problem.joints, &problem.data)?;
    Ok(declared)
}

/// One effect; `true` stands for no arguments.
pub(crate) fn effect(name: &str, item: &Item<'_, '_>, joints: &[Joint]) -> Result<Effect, InputError> {
    let empty = DeTable::new();
    let section = match item.boolean() {
        Ok(true) => item.section_of(&empty),
        Ok(false) => return Err(item.wrong_type("a table of arguments, or true")),
        Err(_) => item.section()?,
    };
    let mut arguments = Arguments { section, joints };
    let effect = match name {
        "joint-compliance" => Effect::JointCompliance { joint: arguments.joint("joint")? },
        "joint-harmonic" => Effect::JointHarmonic { joint: arguments.commanded("joint")?, orders: arguments.orders()? },
        "gear-ratio" => Effect::GearRatio { joint: arguments.commanded("joint")? },
        "backlash" => Effect::Backlash { joint: arguments.commanded("joint")? },
        "joint-nonlinear-stiffness" => Effect::JointNonlinearStiffness { joint: arguments.joint("joint")? },
        "joint-lateral-compliance" => Effect::JointLateralCompliance { joint: arguments.joint("joint")? },
        "joint-thermal-drift" => Effect::JointThermalDrift { joint: arguments.commanded("joint")? },
        "joint-coupling" => arguments.coupling()?,
        "link-bending" => Effect::LinkBending { joint: arguments.joint("joint")? },
        "link-thermal-bending" => Effect::LinkThermalBending { link: arguments.link()? },
        "link-thermal-expansion" => Effect::LinkThermalExpansion { link: arguments.link()? },
        "unmodelled-mass" => Effect::UnmodelledMass { link: arguments.link()? },
        "payload-mass" => Effect::PayloadMass,
        "hoist-force" => Effect::HoistForce,
        "hoist-direction" => Effect::HoistDirection,
        "base-compliance" => Effect::BaseCompliance,
        "gravity-direction" => Effect::GravityDirection,
        "deflected-equilibrium" => Effect::DeflectedEquilibrium,
        "tracker-scale" => Effect::TrackerScale,
        "tracker-drift" => Effect::TrackerDrift,
        "station-shift" => Effect::StationShift { at_time: arguments.time("at_time")? },
        _ => return Err(item.error(InputErrorKind::UnknownEffect { name: name.to_owned(), known: &NAMES })),
    };
    arguments.section.finish()?;
    Ok(effect)
}

/// The arguments of an effect, checked against the arm.
struct Arguments<'s, 'a, 'i> {
    section: Section<'a, 'i>,
    joints: &'s [Joint],
}

impl Arguments<'_, '_, '_> {
    /// A joint's number, counted from 1.
    fn joint(&mut self, key: &str) -> Result<usize, InputError> {
        let item = self.section.require(key, &format!("{key} = …, a joint's number"))?;
        let joint = item.whole(0)?;
        match usize::try_from(joint) {
            Ok(number) if (1..=self.joints.len()).contains(&number) => Ok(number),
            _ => Err(item.error(InputErrorKind::UnknownJoint { joint, joints: self.joints.len() })),
        }
    }

    /// The number of a joint that takes a command.
    fn commanded(&mut self, key: &str) -> Result<usize, InputError> {
        let joint = self.joint(key)?;
        match (self.joints[joint - 1].kind, self.section.peek(key)) {
            (JointKind::Fixed, Some(item)) => Err(item.error(InputErrorKind::NoCommand { joint })),
            _ => Ok(joint),
        }
    }

    fn coupling(&mut self) -> Result<Effect, InputError> {
        let (joint, from) = (self.commanded("joint")?, self.commanded("from")?);
        if joint == from {
            return Err(self.section.error(InputErrorKind::CoupledToItself { joint }));
        }
        Ok(Effect::JointCoupling { joint, from })
    }

    /// The name of a beam.
    fn link(&mut self) -> Result<String, InputError> {
        let item = self.section.require("link", "link = \"…\", the name of a beam")?;
        let link = item.text()?.to_owned();
        let links = || self.joints.iter().filter_map(|joint| joint.beam.as_ref()).map(|beam| beam.name.clone());
        if links().any(|known| known == link) {
            Ok(link)
        } else {
            Err(item.error(InputErrorKind::UnknownLink { link, links: links().collect() }))
        }
    }

    /// Orders of harmonics, at least one, each once.
    fn orders(&mut self) -> Result<Vec<u32>, InputError> {
        let item = self.section.require("orders", "orders = [1], the harmonics")?;
        let mut orders = Vec::new();
        for element in item.list("a list of whole numbers")? {
            let order = u32::from(element.small()?);
            if orders.contains(&order) {
                return Err(element.error(InputErrorKind::RepeatedOrder { order }));
            }
            orders.push(order);
        }
        if orders.is_empty() { Err(item.error(InputErrorKind::NoOrders)) } else { Ok(orders) }
    }

    /// A time [s].
    fn time(&mut self, base: &str) -> Result<f64, InputError> {
        self.section.number(base, Unit::Time)?.ok_or_else(|| self.section.missing(base, Unit::Time.spelled(base)))
    }
}
