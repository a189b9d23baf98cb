//! The catalogue of effects: what an arm and its measurement may do that its declared parameters do not say.
//!
//! One family a file. A family says where in the model its parameters enter (a [`Slot`]), what each is multiplied by there
//! (a [`Driver`]), and which effects of its kind are conceivable on an arm. The laws themselves are physics and live in
//! `arm`, once, generic over the scalar; every effect is inert at zero, so that its derivatives exist before it is fitted.
//!
//! To add a family: its arguments in `problem::Effect` and its reader, a file like `gear_ratio.rs`, a line in
//! [`FAMILIES`]; if it enters at a new place, a slot and its law in `arm` (docs/effects.md walks through it).

mod backlash;
mod base_compliance;
mod coverage;
mod deflected_equilibrium;
mod gear_ratio;
mod gravity_direction;
mod hoist_direction;
mod hoist_force;
mod joint_compliance;
mod joint_coupling;
mod joint_harmonic;
mod joint_lateral_compliance;
mod joint_nonlinear_stiffness;
mod joint_thermal_drift;
mod link_bending;
mod link_thermal_bending;
mod link_thermal_expansion;
mod payload_mass;
mod place;
mod station_shift;
mod tracker_drift;
mod tracker_scale;
mod unmodelled_mass;

use crate::model::parameter::{Driver, EffectParameter, Slot};
use crate::problem::{Effect, Problem};

pub use coverage::DataCoverage;
pub use place::{Argument, arguments, name, place};

/// A kind of effect.
#[derive(Debug)]
pub struct Family {
    /// Name in problem files.
    pub name: &'static str,
    /// The parameters of an effect of this family, none for one of another.
    pub terms: fn(&Effect, &Problem) -> Vec<Term>,
    /// The effects of this family that are conceivable on an arm, each with the reason why these data cannot show it.
    pub candidates: fn(&Problem, &DataCoverage) -> Vec<Candidate>,
    /// What an effect is, in words for people: "transmission ratio of joint 3".
    pub describe: fn(&Effect) -> String,
}

impl Family {
    /// One over the share of a family's chance that falls to one of its `members`: as many as there are, but for harmonics,
    /// of which order k of each of n joints has n π²/6 k²: low orders have causes, high ones are found by trying.
    pub fn tries(&self, effect: &Effect, members: &[&Effect]) -> f64 {
        let Effect::JointHarmonic { orders, .. } = effect else { return members.len().max(1) as f64 };
        let mut joints: Vec<usize> = Vec::new();
        for member in members {
            if let Effect::JointHarmonic { joint, .. } = member
                && !joints.contains(joint)
            {
                joints.push(*joint);
            }
        }
        let order = f64::from(orders.iter().copied().max().unwrap_or(1));
        joints.len().max(1) as f64 * std::f64::consts::PI.powi(2) / 6.0 * order * order
    }
}

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Name after the dot.
    pub name: String,
    /// Where it enters.
    pub slot: Slot,
    /// What it is multiplied by there.
    pub driver: Driver,
    /// Its value where the effect has no size, SI.
    pub nominal: f64,
    /// A size that no realistic effect exceeds by much, SI: 1 σ of its prior.
    pub size: f64,
    /// Whether nature knows no negative ones: an effect that would need one is no explanation.
    pub never_negative: bool,
}

impl Term {
    /// A parameter that acts the same in every pose.
    pub fn constant(name: &str, slot: Slot, size: f64) -> Self {
        Self::driven(name, slot, Driver::Constant, size)
    }

    /// A parameter that is multiplied by what is known of a pose.
    pub fn driven(name: &str, slot: Slot, driver: Driver, size: f64) -> Self {
        Self { name: name.to_owned(), slot, driver, nominal: 0.0, size, never_negative: false }
    }

    /// The same, never negative.
    #[must_use]
    pub fn never_negative(self) -> Self {
        Self { never_negative: true, ..self }
    }
}

/// An effect that may be at work.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Which.
    pub effect: Effect,
    /// Why these data cannot show it, if they cannot.
    pub untestable: Option<&'static str>,
}

impl Candidate {
    /// An effect that needs something from the data: `reason` says what is missing, unless it is there.
    fn needing(effect: Effect, there: bool, reason: &'static str) -> Self {
        Self { effect, untestable: (!there).then_some(reason) }
    }

    /// An effect that poses alone can show.
    fn of(effect: Effect) -> Self {
        Self { effect, untestable: None }
    }
}

/// Every family, in the order of the file format.
pub const FAMILIES: [&Family; 21] = [
    &joint_compliance::FAMILY,
    &joint_harmonic::FAMILY,
    &gear_ratio::FAMILY,
    &backlash::FAMILY,
    &joint_nonlinear_stiffness::FAMILY,
    &joint_lateral_compliance::FAMILY,
    &joint_thermal_drift::FAMILY,
    &joint_coupling::FAMILY,
    &link_bending::FAMILY,
    &link_thermal_bending::FAMILY,
    &link_thermal_expansion::FAMILY,
    &unmodelled_mass::FAMILY,
    &payload_mass::FAMILY,
    &hoist_force::FAMILY,
    &hoist_direction::FAMILY,
    &base_compliance::FAMILY,
    &gravity_direction::FAMILY,
    &deflected_equilibrium::FAMILY,
    &tracker_scale::FAMILY,
    &tracker_drift::FAMILY,
    &station_shift::FAMILY,
];

/// Parameters of an effect, named under it.
pub fn terms(effect: &Effect, problem: &Problem) -> Vec<Term> {
    FAMILIES.iter().flat_map(|family| (family.terms)(effect, problem)).collect()
}

/// What an effect is, in words.
pub fn describe(effect: &Effect) -> String {
    let family = FAMILIES.iter().find(|family| family.name == name(effect));
    family.map_or_else(String::new, |family| (family.describe)(effect))
}

/// The same where times may not have been measured: the order of the rows stands for them then, counted from 1.
pub fn describe_in(effect: &Effect, time_measured: bool) -> String {
    match effect {
        Effect::StationShift { at_time } if !time_measured => {
            format!("the measuring station moved after row {}", at_time.ceil())
        }
        _ => describe(effect),
    }
}

/// The parameters of an effect by that name at a `place`, empty for the whole: `name[place].term`.
pub fn named(name: &str, place: &str, terms: Vec<Term>) -> Vec<EffectParameter> {
    let bracket = if place.is_empty() { String::new() } else { format!("[{place}]") };
    let parameter = |term: Term| EffectParameter {
        name: format!("{name}{bracket}.{}", term.name),
        plain: format!("{name}.{}", term.name),
        slot: term.slot,
        driver: term.driver,
        nominal: term.nominal,
        sigma: term.size,
    };
    terms.into_iter().map(parameter).collect()
}

/// Parameters of every effect that `problem` declares, in order.
pub fn parameters(problem: &Problem) -> Vec<EffectParameter> {
    problem.effects.iter().flat_map(|declared| parameters_of(&declared.effect, problem)).collect()
}

/// Parameters of one effect, with their full names: `gear-ratio[3].error`.
pub fn parameters_of(effect: &Effect, problem: &Problem) -> Vec<EffectParameter> {
    named(name(effect), &place(effect), terms(effect, problem))
}
