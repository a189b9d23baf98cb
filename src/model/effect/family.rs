//! What a family of effects says of itself.

use super::coverage::{Columns, DataCoverage};
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::{Effect, Problem};

/// A kind of effect. The functions on effects are asked about those of this family alone.
#[derive(Debug)]
#[non_exhaustive]
pub struct Family {
    /// Name in problem files.
    pub name: &'static str,
    /// The parameters of an effect.
    pub terms: fn(&Effect, &Problem) -> Vec<Term>,
    /// The effects that are conceivable on an arm, each with the reason why these data cannot show
    /// it.
    pub candidates: fn(&Problem, &DataCoverage) -> Vec<Candidate>,
    /// What an effect is, in words for people: "transmission ratio of joint 3".
    pub describe: fn(&Effect) -> String,
    /// The same where times were not measured and the order of the rows, counted from 1, stands for
    /// them; `None`: the same.
    pub describe_by_row: fn(&Effect) -> Option<String>,
    /// One over the share of a family's chance that falls to one of its members among the
    /// candidates.
    pub tries: fn(&Effect, &[&Effect], &Problem) -> f64,
    /// Parts that are tested one by one.
    pub parts: fn(&Effect) -> Vec<Effect>,
    /// The one effect that is two of them, where they are of one place.
    pub joined: fn(&Effect, &Effect) -> Option<Effect>,
    /// Whether the first holds all of the second.
    pub covers: fn(&Effect, &Effect) -> bool,
    /// The joint at which the effect is a function of a command alone, and the joint commanded,
    /// both from 1.
    pub function_of: fn(&Effect) -> Option<(usize, usize)>,
    /// The column without which an effect cannot be fitted, if measurements with these columns lack
    /// it, as a message names it.
    pub missing_column: fn(&Effect, &Problem, Columns) -> Option<&'static str>,
    /// The key of an argument that is searched, as a time: those of the family that differ in
    /// nothing else are one effect that is not yet found.
    pub searched: Option<&'static str>,
    /// The same effect with that argument multiplied, to three digits, where values between those
    /// of the candidates tell.
    pub scaled: fn(&Effect, f64) -> Option<Effect>,
}

/// A family about which there is nothing special to say.
pub(super) const USUAL: Family = Family {
    name: "",
    terms: |_, _| Vec::new(),
    candidates: |_, _| Vec::new(),
    describe: |_| String::new(),
    describe_by_row: |_| None,
    tries: |_, members, _| members.len().max(1) as f64,
    parts: |effect| vec![effect.clone()],
    joined: |_, _| None,
    covers: |one, other| one == other,
    function_of: |_| None,
    missing_column: |_, _, _| None,
    searched: None,
    scaled: |_, _| None,
};

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Name after the dot.
    pub name: String,
    /// Where it enters.
    pub site: ParameterSite,
    /// What it is multiplied by there.
    pub regressor: Regressor,
    /// Its value where the effect has no size, SI.
    pub nominal: f64,
    /// A size that no realistic effect exceeds by much, SI: 1 σ of its prior.
    pub size: f64,
    /// Whether nature knows no negative ones: an effect that would need one is no explanation.
    pub never_negative: bool,
}

impl Term {
    /// A parameter that acts the same in every pose.
    pub fn constant(name: &str, site: ParameterSite, size: f64) -> Self {
        Self::driven(name, site, Regressor::Constant, size)
    }

    /// A parameter that is multiplied by what is known of a pose.
    pub fn driven(name: &str, site: ParameterSite, regressor: Regressor, size: f64) -> Self {
        Self { name: name.to_owned(), site, regressor, nominal: 0.0, size, never_negative: false }
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
    /// An effect that needs something from the data: `reason` says what is missing, unless it is
    /// there.
    pub(super) fn needing(effect: Effect, there: bool, reason: &'static str) -> Self {
        Self { effect, untestable: (!there).then_some(reason) }
    }

    /// An effect that poses alone can show.
    pub(super) fn of(effect: Effect) -> Self {
        Self { effect, untestable: None }
    }
}

/// A searched number to three digits; `None` where nothing is left.
pub(super) fn to_three_digits(number: f64) -> Option<f64> {
    let step = 10_f64.powf(number.log10().floor() - 2.0);
    let rounded = (number / step).round() * step;
    // As written with three digits, not as the product has it.
    let written = if step < 1.0 { format!("{rounded:.6}").parse().ok()? } else { rounded.round() };
    (written > 0.0).then_some(written)
}
