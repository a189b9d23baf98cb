//! The problem file: the arm as declared, what is free, and where the data are.
//!
//! Everything here is plain data in SI units (m, rad, N, kg, s; temperatures in °C), read once from
//! `problem.toml` and never changed afterwards.

mod argument;
mod arm;
mod conditions;
mod constraints;
mod data;
mod dialect;
pub(crate) mod digest;
pub(crate) mod effect;
pub(crate) mod effects;
pub(crate) mod fixture;
pub(crate) mod item;
mod joint;
mod parameters;
mod past;
pub(crate) mod pattern;
pub(crate) mod quoted;
pub(crate) mod read;
mod robust;
pub(crate) mod section;
mod standard;
mod target;
mod tree;

use nalgebra::Vector3;

use crate::error::{InputError, InputErrorKind, Location, Warning, WarningKind};

pub(crate) use argument::HIGHEST_ORDER;
pub use argument::{Argument, FreeLength, Mount};
pub use conditions::{PoseConditions, PoseRanges, PoseView};
pub use constraints::{Constraint, ConstraintTerm, Limit, LimitKind};
pub use data::{Data, HeldOut, JointSource, OwnCovariate};
pub use dialect::{ColumnOf, ColumnRule, Delimiter, Dialect, Missing, RotationKind};
pub use effect::{Custom, Effect, EffectDeclaration};
pub use fixture::{Fixture, FixtureKind, KnownDistance, Observation};
pub use joint::{Beam, Body, Hoist, Joint, JointKind, Mimic, Placement};
pub use parameters::{Freedom, ParameterRule, Quantities};
pub(crate) use past::Lag;
pub(crate) use past::PoseTable;
pub use past::{Past, PastOf};
pub use robust::{Robust, RobustLoss};
pub use target::{Target, Tool};
pub use tree::Tree;

/// A problem as declared in `problem.toml`.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Short name; results go to `out/<name>` by default.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// Gravity in the arm's base frame [m/s²].
    pub gravity: Vector3<f64>,
    /// How static loads act.
    pub statics: Statics,
    /// Joints from the base outwards, branch by branch; joint `i` of the files is element `i − 1`.
    pub joints: Vec<Joint>,
    /// The measured point and the payload.
    pub tool: Tool,
    /// The measured points, where rows name theirs.
    pub targets: Vec<Target>,
    /// Pose of the arm's base in the measuring frame.
    pub base: BasePose,
    /// Which links of a URDF the arm lies between, if it came from one.
    pub urdf: Option<UrdfEnds>,
    /// Effects that the model declares.
    pub effects: Vec<EffectDeclaration>,
    /// What is touched or measured against: points, anchors, surfaces.
    pub fixtures: Vec<Fixture>,
    /// Known distances between points.
    pub distances: Vec<KnownDistance>,
    /// What is free, in the order of the file: a later rule wins.
    pub parameters: Vec<ParameterRule>,
    /// Linear inequalities between parameters.
    pub constraints: Vec<Constraint>,
    /// Where the measurements are and how they are used.
    pub data: Data,
    /// How gross errors are kept from ruling the fit; `None`: they are not.
    pub robust: Option<Robust>,
}

impl Problem {
    /// Whether something of the declared arm gives way: a joint with a stiffness, or a beam with a
    /// rigidity.
    pub fn is_elastic(&self) -> bool {
        let bends =
            |beam: &Beam| [beam.ea, beam.ei_y, beam.ei_z, beam.gj].iter().any(Option::is_some);
        self.joints
            .iter()
            .any(|joint| joint.stiffness.is_some() || joint.beam.as_ref().is_some_and(bends))
    }

    /// How the joints stand on each other.
    pub fn tree(&self) -> Tree {
        Tree::of(&self.joints)
    }

    /// Whether the joints are one chain, which carries tool and targets behind its last joint.
    pub fn is_chain(&self) -> bool {
        let last = self.joints.len().saturating_sub(1);
        let mut influential_rows =
            self.targets.iter().map(|own| own.joint).chain([self.tool.joint]);
        self.tree().is_chain() && influential_rows.all(|joint| joint == last)
    }

    /// Refuses a tree of joints, for the sake of `what`.
    ///
    /// # Errors
    /// A joint stands elsewhere than on the one before.
    pub fn require_chain(&self, what: &'static str) -> Result<(), InputError> {
        let mut joints = self.joints.iter().enumerate();
        match joints.find(|(index, own)| own.parent != index.checked_sub(1)) {
            Some((index, own)) => {
                let location =
                    own.location.clone().with_key(format!("joint[{}].parent", index + 1));
                Err(location.error(InputErrorKind::NotAChain { what }))
            }
            None => Ok(()),
        }
    }

    /// What the word of a row's target names: one of `[[target]]`, or the point of `[tool]` where
    /// none is declared.
    ///
    /// # Errors
    /// There are targets, and none has that name.
    pub fn target(&self, word: &str) -> Result<Target, InputError> {
        let location = Location { line: None, excerpt: None, ..self.data.location.clone() };
        if self.targets.is_empty() {
            return Ok(Target::of_tool(&self.tool, location.with_key("tool")));
        }
        let found = self.targets.iter().find(|own| own.name == word).cloned();
        found.ok_or_else(|| location.with_key("target").error(self.unknown_target(word)))
    }

    /// The words by which rows may name their target: the empty one where none is declared.
    pub fn target_words(&self) -> Vec<String> {
        if self.targets.is_empty() {
            return vec![String::new()];
        }
        self.targets.iter().map(|own| own.name.clone()).collect()
    }

    /// The mistake of a word that names no target.
    pub(crate) fn unknown_target(&self, word: &str) -> InputErrorKind {
        let known: Vec<String> = self.targets.iter().map(|own| own.name.clone()).collect();
        match word {
            "" => InputErrorKind::TargetsUnnamed { targets: known },
            _ => InputErrorKind::UnknownFixture { what: "target", name: word.to_owned(), known },
        }
    }

    /// A warning where a target lies further from its frame than the arm could reach twice.
    pub fn far_target(&self) -> Option<Warning> {
        let length = |joint: &Joint| {
            let placed = joint.placement.as_ref().map_or(0.0, |own| own.xyz.norm());
            let (min, max) = joint.limits;
            let way =
                if joint.kind == JointKind::Prismatic { min.abs().max(max.abs()) } else { 0.0 };
            joint.a.hypot(joint.d) + placed + way
        };
        let whole = || Location {
            line: None,
            excerpt: None,
            ..self.data.location.clone().with_key("tool.target")
        };
        let farthest = self.targets.iter().max_by(|a, b| a.at.norm().total_cmp(&b.at.norm()));
        let (location, target) = farthest
            .map_or_else(|| (whole(), self.tool.target), |own| (own.location.clone(), own.at));
        let (links, distance) = (self.joints.iter().map(length).sum::<f64>(), target.norm());
        let kind = WarningKind::FarTarget {
            distance: format!("{distance:.3}"),
            links: format!("{links:.3}"),
        };
        (links > 0.0 && distance > 2.0 * links).then_some(Warning { location, kind })
    }
}

/// `[statics]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Statics {
    /// On which arm the loads act.
    pub equilibrium: Equilibrium,
    /// Closed-form elements per beam, at least 1.
    pub beam_elements: usize,
}

/// On which arm the loads act.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Equilibrium {
    /// On the rigid arm: the first order of the paper.
    Undeflected,
    /// On the bent arm, in equilibrium.
    Deflected,
}

/// `[urdf]`: the links of a URDF at both ends of the arm.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UrdfEnds {
    /// The arm's base frame is that of this link.
    pub base: String,
    /// The last frame is that of this link.
    pub tip: String,
}

/// `[base]`: pose of the arm's base in the measuring frame.
#[derive(Debug, Clone)]
pub struct BasePose {
    /// Origin \[m\].
    pub translation: Vector3<f64>,
    /// Rotation vector \[rad\].
    pub rotation: Vector3<f64>,
}
