//! What may explain a residual: effects by their laws, and functions whose law nobody knows.

use std::fmt;

use crate::model::parameter::{ArmField, JointField, ParameterSite, Regressor};
use crate::problem::{Effect, Problem};
use crate::residual_tests::Covariate;

/// A part of the arm or of its measurement; joints are counted from 0. Its `Display` is the name in
/// files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Site {
    /// A joint.
    Joint(usize),
    /// The link before a joint.
    LinkBefore(usize),
    /// The base, or what it stands on.
    Base,
    /// The payload.
    Payload,
    /// The hoist.
    Hoist,
    /// The arm as a whole.
    Arm,
    /// What measures.
    Measurement,
}

impl Site {
    /// The part that a site belongs to.
    pub fn of(site: ParameterSite) -> Self {
        match site {
            ParameterSite::Joint { joint, field: JointField::Alpha | JointField::A }
            | ParameterSite::Beam { joint, .. } => Self::LinkBefore(joint),
            ParameterSite::Joint { joint, .. } => Self::Joint(joint),
            ParameterSite::Arm(field) => {
                use crate::model::parameter::ArmField as Field;
                match field {
                    Field::Payload => Self::Payload,
                    Field::HoistForce
                    | Field::HoistLeanX
                    | Field::HoistLeanY
                    | Field::HoistTrolley => Self::Hoist,
                    Field::MountingX | Field::MountingY | Field::GravityX | Field::GravityY => {
                        Self::Base
                    }
                    Field::Mixing => Self::Arm,
                }
            }
            ParameterSite::Base { .. } | ParameterSite::Turn { .. } => Self::Base,
            ParameterSite::Target { .. } => Self::Payload,
            ParameterSite::Fixture { .. }
            | ParameterSite::Shift { .. }
            | ParameterSite::Scale
            | ParameterSite::Strain { .. } => Self::Measurement,
        }
    }
}

impl fmt::Display for Site {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Joint(joint) => write!(f, "joint {}", joint + 1),
            Self::LinkBefore(joint) => write!(f, "link before joint {}", joint + 1),
            Self::Base => f.write_str("base"),
            Self::Payload => f.write_str("payload"),
            Self::Hoist => f.write_str("hoist"),
            Self::Arm => f.write_str("arm"),
            Self::Measurement => f.write_str("measurement"),
        }
    }
}

/// How a part's error follows from what it depends on.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum HypothesisKind {
    /// As an effect says.
    Effect(Effect),
    /// Some smooth function.
    Smooth,
    /// Some function that repeats about so many times a turn of the joint, its height and phase
    /// changing slowly.
    NearHarmonic(u32),
    /// Another value in every pose: nothing that is known of a pose tells it.
    PerPose,
    /// Wanders in time: near what it was a little before, and not smooth, as noise is in which one
    /// reading follows the last.
    Wandering,
    /// Linear in the position.
    Linear,
    /// Gives way under the weight of links whose masses nobody declared.
    Sag,
    /// A limit of the declared problem, in words, that holds the fit is wrong.
    Limit(String),
}

impl HypothesisKind {
    /// Whether it is the same law: of an effect whose time or order is searched with whatever one.
    pub(super) fn is_of(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Effect(own), Self::Effect(other)) => own.is_but_for_search(other),
            _ => self == other,
        }
    }
}

/// One explanation of a residual.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis {
    /// The law, or what is known of it.
    pub kind: HypothesisKind,
    /// Where it acts.
    pub site: Site,
    /// The coordinate of the part, where the error is one of a single coordinate.
    pub coordinate: Option<ParameterSite>,
    /// What it depends on, ascending.
    pub depends_on: Vec<Covariate>,
}

impl Hypothesis {
    /// An effect of the catalogue or of one's own: where its parameters enter and what drives them
    /// say the rest.
    pub fn of_effect(
        effect: &Effect,
        problem: &Problem,
        approach_known: bool,
        time_measured: bool,
    ) -> Self {
        let terms = effect.terms(problem);
        let site = terms.first().map_or(Site::Arm, |term| Site::of(term.site));
        let mut depends_on: Vec<Covariate> = terms
            .iter()
            .flat_map(|term| {
                covariates(term.site, &term.regressor, problem, (approach_known, time_measured))
            })
            .collect();
        depends_on.sort();
        depends_on.dedup();
        Self { kind: HypothesisKind::Effect(effect.clone()), site, coordinate: None, depends_on }
    }

    /// A smooth function of some covariates at a place.
    pub(super) fn smooth(site: ParameterSite, depends_on: Vec<Covariate>) -> Self {
        Self {
            kind: HypothesisKind::Smooth,
            site: Site::of(site),
            coordinate: Some(site),
            depends_on,
        }
    }

    /// Whether another says the same: the same law at the same part, of the same covariates.
    pub fn says(&self, other: &Self) -> bool {
        self.kind == other.kind && self.site == other.site && self.depends_on == other.depends_on
    }

    /// Whether it is that a limit of the declared problem is wrong.
    pub(super) fn is_limit(&self) -> bool {
        matches!(self.kind, HypothesisKind::Limit(_))
    }

    /// Its effect, if its law is one.
    pub fn effect(&self) -> Option<&Effect> {
        match &self.kind {
            HypothesisKind::Effect(effect) => Some(effect),
            _ => None,
        }
    }
}

/// Returns the covariates that a parameter depends on, by its regressor or by the physics of its
/// site.
fn covariates(
    site: ParameterSite,
    regressor: &Regressor,
    problem: &Problem,
    known: (bool, bool),
) -> Vec<Covariate> {
    let quantities = regressor.quantities();
    if !quantities.is_empty() {
        let of = |quantity| Covariate::of(quantity, problem, known);
        return quantities.into_iter().flat_map(of).collect();
    }
    vec![match site {
        ParameterSite::Joint { joint, field: JointField::Play | JointField::SlidingPlay }
            if known.0 =>
        {
            Covariate::Approach(joint)
        }
        ParameterSite::Arm(ArmField::Payload) => Covariate::Payload,
        ParameterSite::Scale | ParameterSite::Strain { .. } => Covariate::Position,
        _ => Covariate::Load,
    }]
}
