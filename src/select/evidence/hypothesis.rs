//! Hypotheses about the cause of a residual: effects and functions without a law, and sets of them.

use std::fmt;

use crate::laws::At;
use crate::model::parameter::{ArmField, JointField, ParameterSite, Regressor};
use crate::problem::{Effect, Problem};
use crate::residual_tests::Covariate;

/// Site of an error: a part of the arm or of the measurement. Joints are counted from 0. Its
/// `Display` is the name in files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Site {
    /// Joint, counted from 0.
    Joint(usize),
    /// Link before the joint with this index, counted from 0.
    LinkBefore(usize),
    /// Base, or the ground below it.
    Base,
    /// Payload at the tool.
    Payload,
    /// Tool or its target.
    Tool,
    /// Last joint, counted from 0, or the tool, which moves the target alike.
    LastJointOrTool(usize),
    /// Joint, counted from 0, or a link beside it, which bends under nearly the same loads.
    JointOrLink(usize),
    /// Link before the joint with this index, counted from 0, or a joint at its ends, which tilts
    /// under nearly the same loads.
    LinkOrJoint(usize),
    /// Hoist that carries part of the weight.
    Hoist,
    /// Arm as a whole.
    Arm,
    /// Instrument and its frame.
    Measurement,
}

impl Site {
    /// Returns the part of the arm or measurement to which a parameter site belongs.
    pub fn of(site: ParameterSite) -> Self {
        match site {
            ParameterSite::Joint { joint, field: JointField::Alpha | JointField::A }
            | ParameterSite::Beam { joint, .. } => Self::LinkBefore(joint),
            ParameterSite::Joint { joint, .. } => Self::Joint(joint),
            ParameterSite::Arm(field) => {
                use crate::model::parameter::ArmField as Field;
                match field {
                    Field::Payload | Field::PayloadAt(_) => Self::Payload,
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
            ParameterSite::ArmStrain => Self::Arm,
            ParameterSite::Base { .. } | ParameterSite::Turn { .. } => Self::Base,
            ParameterSite::Target { .. } => Self::Payload,
            ParameterSite::Fixture { .. }
            | ParameterSite::FixtureShift { .. }
            | ParameterSite::Exposure { .. }
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
            Self::Tool => f.write_str("tool"),
            Self::LastJointOrTool(joint) => write!(f, "joint {} or the tool", joint + 1),
            Self::JointOrLink(joint) => write!(f, "joint {} or a link beside it", joint + 1),
            Self::LinkOrJoint(joint) => {
                write!(f, "link before joint {} or a joint at its ends", joint + 1)
            }
            Self::Hoist => f.write_str("hoist"),
            Self::Arm => f.write_str("arm"),
            Self::Measurement => f.write_str("measurement"),
        }
    }
}

/// Law of an error, or the kind of function if its law is unknown.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum HypothesisKind {
    /// Effect with a law.
    Effect(Effect),
    /// Smooth function without a law.
    Smooth,
    /// Function with approximately this number of periods per revolution of the joint, whose
    /// amplitude and phase change slowly along its range.
    NearHarmonic(u32),
    /// Periodic error of a joint: all harmonics up to this order, with one prior on their
    /// coefficients.
    Gear(u32),
    /// Free value in every pose, which no recorded quantity predicts.
    PerPose,
    /// Error that wanders in time: close to its previous value, but not smooth, like noise that is
    /// correlated from reading to reading.
    Wandering,
    /// Displacement of the target that is linear in its position.
    Linear,
    /// Deflection under the weight of links whose masses are not declared.
    Sag,
    /// Limit (bound or constraint) of the declared problem that is active in the fit, but wrong.
    /// The text describes it.
    Limit(String),
}

impl HypothesisKind {
    /// Returns true if two kinds have the same law, whatever the value of a searched argument.
    pub(super) fn has_same_law_as(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Effect(effect), Self::Effect(other)) => effect.is_but_for_search(other),
            _ => self == other,
        }
    }
}

/// Hypothesis about the cause of a residual: a law or function at a site.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis {
    /// Law of the error, or kind of function.
    pub kind: HypothesisKind,
    /// Part of the arm or of the measurement at which the error acts.
    pub site: Site,
    /// Coordinate to which the function adds, if it is a single one. `None` for effects, limits,
    /// and functions at several coordinates.
    pub coordinate: Option<ParameterSite>,
    /// Quantities on which the error depends, in ascending order.
    pub depends_on: Vec<Covariate>,
}

impl Hypothesis {
    /// Creates a hypothesis from its kind, site, coordinate and quantities.
    pub fn new(
        kind: HypothesisKind,
        site: Site,
        coordinate: Option<ParameterSite>,
        depends_on: Vec<Covariate>,
    ) -> Self {
        Self { kind, site, coordinate, depends_on }
    }

    /// Creates the hypothesis of an effect; its terms determine the site and the quantities.
    /// `coverage` states whether directions of approach and times are recorded.
    pub fn of_effect(effect: &Effect, problem: &Problem, coverage: (bool, bool)) -> Self {
        let terms = effect.terms(problem);
        let site = match effect {
            Effect::Law(law) if matches!(law.at(), At::Tool(_)) => Site::Tool,
            _ => terms.first().map_or(Site::Arm, |term| Site::of(term.site)),
        };
        let mut depends_on: Vec<Covariate> = terms
            .iter()
            .flat_map(|term| covariates(term.site, &term.regressor, problem, coverage))
            .collect();
        depends_on.sort();
        depends_on.dedup();
        Self { kind: HypothesisKind::Effect(effect.clone()), site, coordinate: None, depends_on }
    }

    /// Creates the hypothesis of a smooth function of some covariates at a site.
    pub(super) fn smooth(site: ParameterSite, depends_on: Vec<Covariate>) -> Self {
        Self {
            kind: HypothesisKind::Smooth,
            site: Site::of(site),
            coordinate: Some(site),
            depends_on,
        }
    }

    /// Returns true if two hypotheses have the same law, site and covariates.
    pub fn is_same_claim(&self, other: &Self) -> bool {
        self.kind == other.kind && self.site == other.site && self.depends_on == other.depends_on
    }

    /// Returns true if the hypothesis is that a limit of the declared problem is wrong.
    pub(super) fn is_limit(&self) -> bool {
        matches!(self.kind, HypothesisKind::Limit(_))
    }

    /// Returns the joint, from 0, if the hypothesis is a periodic error of many orders; `None` for
    /// other hypotheses.
    pub(super) fn gear_joint(&self) -> Option<usize> {
        match (&self.kind, self.site) {
            (HypothesisKind::Gear(_), Site::Joint(joint)) => Some(joint),
            _ => None,
        }
    }

    /// Returns the effect of the hypothesis; `None` for a function without a law.
    pub fn effect(&self) -> Option<&Effect> {
        match &self.kind {
            HypothesisKind::Effect(effect) => Some(effect),
            _ => None,
        }
    }
}

/// Returns the covariates on which a parameter's effect depends, through its regressor or the
/// physics of its site. `is_recorded` states whether directions of approach and times are recorded.
fn covariates(
    site: ParameterSite,
    regressor: &Regressor,
    problem: &Problem,
    is_recorded: (bool, bool),
) -> Vec<Covariate> {
    let quantities = regressor.quantities();
    if !quantities.is_empty() {
        let of = |quantity| Covariate::of(quantity, problem, is_recorded);
        return quantities.into_iter().flat_map(of).collect();
    }
    vec![match site {
        ParameterSite::Joint { joint, field: JointField::Play | JointField::SlidingPlay }
            if is_recorded.0 =>
        {
            Covariate::Approach(joint)
        }
        ParameterSite::Arm(ArmField::Payload | ArmField::PayloadAt(_)) => Covariate::Payload,
        ParameterSite::Scale | ParameterSite::Strain { .. } => Covariate::Position,
        ParameterSite::Exposure { .. } => Covariate::Velocity,
        _ => Covariate::Load,
    }]
}

/// Hypotheses that act together, with their probability.
#[derive(Debug, Clone, PartialEq)]
pub struct HypothesisSet {
    /// Members of the set; empty if the residual is only noise.
    pub hypotheses: Vec<Hypothesis>,
    /// Probability among all sets that were evaluated.
    pub probability: f64,
    /// For each member, index of its function (`Candidate::variant`), and 1 σ of the function's
    /// coefficients in units of σ of the noise.
    pub(super) functions: Vec<(usize, f64)>,
}

impl HypothesisSet {
    /// Returns the members of the set that are effects, those with a law.
    pub fn effects(&self) -> Vec<Effect> {
        self.hypotheses.iter().filter_map(Hypothesis::effect).cloned().collect()
    }

    /// Returns the periodic errors of the set: joint (from 1), highest order, and size. The size is
    /// the prior root mean square displacement by all coefficients, in units of σ.
    pub(in crate::select) fn gears(&self) -> Vec<(usize, u32, f64)> {
        let gear =
            |(member, (_, size)): (&Hypothesis, &(usize, f64))| match (&member.kind, member.site) {
                (HypothesisKind::Gear(highest), Site::Joint(joint)) => {
                    Some((joint + 1, *highest, *size))
                }
                _ => None,
            };
        self.hypotheses.iter().zip(&self.functions).filter_map(gear).collect()
    }

    /// Returns the members that are functions without a law, each with the index of the function
    /// chosen for it.
    pub(in crate::select) fn without_law(&self) -> Vec<(Hypothesis, usize)> {
        let without_effect = self
            .hypotheses
            .iter()
            .zip(&self.functions)
            .filter(|(member, _)| member.effect().is_none());
        without_effect.map(|(member, (variant, _))| (member.clone(), *variant)).collect()
    }
}
