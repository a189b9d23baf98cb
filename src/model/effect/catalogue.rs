//! All families, and what effects say of themselves through them.

use super::coverage::{Columns, DataCoverage};
use super::custom::custom;
use super::family::{Candidate, Family, Term, USUAL};
use super::{
    backlash, base_compliance, covariate, deflected_equilibrium, frame_strain, gear_ratio,
    gravity_compensator, gravity_direction, hoist_direction, hoist_force, joint_compliance,
    joint_coupling, joint_harmonic, joint_hysteresis, joint_lateral_compliance,
    joint_nonlinear_stiffness, joint_thermal_drift, joint_wave, link_bending, link_thermal_bending,
    link_thermal_expansion, payload_backlash, payload_mass, slide_bending, station_move,
    station_shift, thermal_lag, tracker_drift, tracker_scale, tracker_settling, twist_bending,
    unmodelled_mass,
};
use crate::model::parameter::EffectParameter;
use crate::problem::{Effect, Problem};

/// Every family, in the order of the file format.
pub const FAMILIES: [&Family; 34] = [
    &joint_compliance::FAMILY,
    &joint_harmonic::FAMILY,
    &joint_wave::FAMILY,
    &gear_ratio::FAMILY,
    &backlash::FAMILY,
    &payload_backlash::FAMILY,
    &joint_hysteresis::FAMILY,
    &joint_nonlinear_stiffness::FAMILY,
    &joint_lateral_compliance::FAMILY,
    &gravity_compensator::FAMILY,
    &joint_thermal_drift::FAMILY,
    &thermal_lag::JOINT,
    &joint_coupling::FAMILY,
    &link_bending::FAMILY,
    &slide_bending::FAMILY,
    &twist_bending::FAMILY,
    &link_thermal_bending::FAMILY,
    &link_thermal_expansion::FAMILY,
    &thermal_lag::BENDING,
    &thermal_lag::EXPANSION,
    &unmodelled_mass::FAMILY,
    &payload_mass::FAMILY,
    &hoist_force::FAMILY,
    &hoist_direction::FAMILY,
    &base_compliance::FAMILY,
    &gravity_direction::FAMILY,
    &deflected_equilibrium::FAMILY,
    &tracker_scale::FAMILY,
    &frame_strain::FAMILY,
    &tracker_drift::FAMILY,
    &station_shift::FAMILY,
    &station_move::FAMILY,
    &tracker_settling::FAMILY,
    &covariate::FAMILY,
];

/// Every effect of the catalogue that is conceivable on an arm, with the reason why these data
/// cannot show it.
pub fn candidates(problem: &Problem, data: &DataCoverage) -> Vec<Candidate> {
    FAMILIES.iter().flat_map(|family| (family.candidates)(problem, data)).collect()
}

/// Parameters of every effect that `problem` declares, in order.
pub fn parameters(problem: &Problem) -> Vec<EffectParameter> {
    problem.effects.iter().flat_map(|declared| declared.effect.parameters(problem)).collect()
}

impl Effect {
    /// The family; for a custom effect one that has nothing special.
    fn family(&self) -> &'static Family {
        let own = FAMILIES.into_iter().find(|family| family.name == self.name());
        own.filter(|_| custom(self).is_none()).unwrap_or(&USUAL)
    }

    /// Its parameters with where and how each enters the model.
    pub fn terms(&self, problem: &Problem) -> Vec<Term> {
        match custom(self) {
            Some(own) => own.terms(problem),
            None => (self.family().terms)(self, problem),
        }
    }

    /// Its parameters with their full names: `gear-ratio[3].error`.
    pub fn parameters(&self, problem: &Problem) -> Vec<EffectParameter> {
        let place = self.place();
        let bracket = if place.is_empty() { String::new() } else { format!("[{place}]") };
        let name = self.name();
        let parameter = |term: Term| EffectParameter {
            name: format!("{name}{bracket}.{}", term.name),
            plain: format!("{name}.{}", term.name),
            site: term.site,
            regressor: term.regressor,
            nominal: term.nominal,
            sigma: term.size,
        };
        self.terms(problem).into_iter().map(parameter).collect()
    }

    /// What it is, in words for people.
    pub fn describe(&self) -> String {
        match custom(self) {
            Some(own) => own.describe(),
            None => (self.family().describe)(self),
        }
    }

    /// The same where times may not have been measured: the order of the rows stands for them then,
    /// counted from 1.
    pub fn describe_in(&self, time_measured: bool) -> String {
        let by_row = if time_measured { None } else { (self.family().describe_by_row)(self) };
        by_row.unwrap_or_else(|| self.describe())
    }

    /// Name and place for people; without what is searched, as a time.
    pub fn name_and_place(&self) -> String {
        let searched = self.family().searched;
        let known = self.arguments().into_iter().filter(|(key, _)| Some(*key) != searched);
        let place =
            known.filter_map(|(_, argument)| argument.place()).collect::<Vec<_>>().join(",");
        if place.is_empty() { self.name().to_owned() } else { format!("{} {place}", self.name()) }
    }

    /// Whether an argument of it is searched, as a time: those that [`Self::name_and_place`] calls
    /// the same are one effect.
    pub fn is_searched(&self) -> bool {
        self.family().searched.is_some()
    }

    /// Whether it is the same effect, whatever the value of the argument that is searched.
    pub(crate) fn is_but_for_search(&self, other: &Self) -> bool {
        // Names without places are compared first: they are at hand.
        let is_alike =
            || self.name() == other.name() && self.name_and_place() == other.name_and_place();
        self == other || (self.is_searched() && is_alike())
    }

    /// Whether it remembers the poses before, as another effect of its family at the same place
    /// does for another time or distance.
    pub(crate) fn remembers_like(&self, other: &Self) -> bool {
        self.has_memory() && self.name_and_place() == other.name_and_place()
    }

    /// The same with its searched argument multiplied; `None` where values between those of the
    /// candidates tell nothing.
    pub(crate) fn scaled(&self, factor: f64) -> Option<Self> {
        (self.family().scaled)(self, factor)
    }

    /// How often chance has a try at it: one over the share of its family's chance, whose `members`
    /// are the candidates.
    pub fn tries(&self, members: &[&Self], problem: &Problem) -> f64 {
        (self.family().tries)(self, members, problem)
    }

    /// Parts that are tested one by one: a harmonic order by order.
    pub fn parts(&self) -> Vec<Self> {
        (self.family().parts)(self)
    }

    /// The one effect that is this and another: harmonics of one joint; `None` where they are two.
    pub fn joined(&self, other: &Self) -> Option<Self> {
        (self.family().joined)(self, other)
    }

    /// Whether it holds all of another: a harmonic of more orders.
    pub fn covers(&self, other: &Self) -> bool {
        (self.family().covers)(self, other)
    }

    /// The joint at which it is a function of a command alone, and the joint commanded, both from
    /// 1.
    pub fn function_of(&self) -> Option<(usize, usize)> {
        (self.family().function_of)(self)
    }

    /// The column without which it cannot be fitted, if measurements with these columns lack it, as
    /// a message names it.
    pub fn missing_column(&self, problem: &Problem, columns: Columns) -> Option<&'static str> {
        (self.family().missing_column)(self, problem, columns)
    }

    /// Why these data cannot show a custom effect, if they cannot; those of the catalogue come with
    /// their reason.
    pub fn untestable(&self, problem: &Problem, data: &DataCoverage) -> Option<&'static str> {
        custom(self).and_then(|own| own.untestable(problem, data))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::effect::NAMES;

    #[test]
    fn every_effect_of_the_table_has_its_family() {
        let families: Vec<&str> = FAMILIES.iter().map(|family| family.name).collect();
        assert_eq!(families, NAMES);
    }
}
