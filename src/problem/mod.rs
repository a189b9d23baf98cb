//! Problem file: the arm as declared, the free parameters, and the measurement files.
//!
//! All values are plain data in SI units (m, rad, N, kg, s; temperatures in °C). They are read once
//! from `problem.toml` and never changed afterwards.
//!
//! [`Problem::read`] reads a file and [`Problem::parse`] a text, with the same errors.
//! [`Problem::effect`] reads one effect or law, and [`Problem::with_effect`] adds it.
//! `docs/problem.md` lists every key and its unit.

mod argument;
mod arm;
mod camera;
mod conditions;
mod constraints;
mod data;
mod dialect;
pub(crate) mod digest;
pub(crate) mod edit;
pub(crate) mod effect;
pub(crate) mod effects;
pub(crate) mod fixture;
pub(crate) mod frame;
pub(crate) mod item;
mod joint;
mod joint_log;
mod joint_source;
mod law;
mod parameters;
mod past;
mod path;
pub(crate) mod pattern;
mod plausible;
pub(crate) mod read;
mod remainder;
mod robust;
pub(crate) mod section;
mod standard;
mod syntax;
mod target;
mod tree;
mod wrong_type;

use nalgebra::Vector3;

use crate::error::{InputError, InputErrorKind, Location, Warning};
pub(crate) use crate::laws::Argument;
pub use crate::laws::Effect;
pub(crate) use crate::laws::quoted;
pub(crate) use law::law_unit;

pub(crate) use crate::observation::FixtureKind;
pub use conditions::PoseRanges;
pub(crate) use constraints::{Constraint, Limit, LimitKind};
pub(crate) use dialect::{ColumnRule, ColumnSelector, Delimiter, Dialect, Missing, RotationKind};
pub(crate) use edit::with_remainder;
pub(crate) use fixture::{
    CENTRE_X, FIRST_COEFFICIENT, FOCAL_X, Fixture, KnownDistance, named_cameras,
};
pub(crate) use joint::{Body, beam_names};
pub(crate) use joint_log::{JoinRule, JointLog};
pub(crate) use joint_source::JointSource;
pub(crate) use parameters::ParameterRule;
pub(crate) use past::PoseTable;
pub(crate) use past::ThermalLag;
pub(crate) use past::{LazyPast, Past};
pub(crate) use remainder::RemainderDeclaration;
pub(crate) use target::Tool;
// These items are public for the tests, the benches and the Python module only.
#[doc(hidden)]
pub use self::{
    conditions::{JointOffsets, PoseConditions, PoseView},
    data::{Data, DeclaredCovariate, HeldOut},
    effect::EffectDeclaration,
    joint::{Beam, Hoist, Joint, JointKind, Mimic, Placement},
    parameters::{DriftRule, Freedom, Quantities},
    robust::{Robust, RobustLoss},
    target::Target,
    tree::Tree,
};
#[doc(hidden)]
pub use crate::laws::{FreeLength, Mount};
#[doc(hidden)]
pub use crate::observation::Observation;

/// Problem as declared in `problem.toml`.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Short name; the default output folder is `out/<name>`.
    pub name: String,
    /// Title for display, one line.
    pub title: String,
    /// Gravity in the arm's base frame [m/s²].
    pub gravity: Vector3<f64>,
    /// Settings of the statics: shape in which loads act, and beam elements.
    #[doc(hidden)]
    pub statics: Statics,
    /// Joints from the base outwards, branch by branch. Joint `i` of the file is element `i − 1`.
    #[doc(hidden)]
    pub joints: Vec<Joint>,
    /// Measured point and payload.
    #[doc(hidden)]
    pub tool: Tool,
    /// Declared measured points, which rows name in the column `target`. Empty if the point of the
    /// tool is the only one.
    #[doc(hidden)]
    pub targets: Vec<Target>,
    /// Pose of the arm's base in the measuring frame.
    #[doc(hidden)]
    pub base: BasePose,
    /// Names of the URDF links at both ends of the arm, if the problem was made from a URDF.
    #[doc(hidden)]
    pub urdf: Option<UrdfEnds>,
    /// Declared effects `[[effect]]`, in the order of the file.
    #[doc(hidden)]
    pub effects: Vec<EffectDeclaration>,
    /// Points, anchors, surfaces, cameras and markers that rows are measured against.
    #[doc(hidden)]
    pub fixtures: Vec<Fixture>,
    /// Known distances between points.
    #[doc(hidden)]
    pub distances: Vec<KnownDistance>,
    /// Rules for free parameters in the order of the file; a later rule overrides an earlier one.
    #[doc(hidden)]
    pub parameters: Vec<ParameterRule>,
    /// Rules for the change of parameters with time, in the order of the file.
    #[doc(hidden)]
    pub drift: Vec<DriftRule>,
    /// Linear inequalities between parameters.
    #[doc(hidden)]
    pub constraints: Vec<Constraint>,
    /// Measurement files and their use.
    #[doc(hidden)]
    pub data: Data,
    /// Robust loss; `None` for least squares.
    #[doc(hidden)]
    pub robust: Option<Robust>,
    /// Warnings about implausible values of the arm.
    pub warnings: Vec<Warning>,
    /// Remainder (smooth correction of errors that no law explains), if one is declared.
    #[doc(hidden)]
    pub remainder: Option<RemainderDeclaration>,
}

impl Problem {
    /// Returns true if the declared arm is elastic: a joint has a stiffness or a beam has a
    /// rigidity.
    pub(crate) fn is_elastic(&self) -> bool {
        let bends =
            |beam: &Beam| [beam.ea, beam.ei_y, beam.ei_z, beam.gj].iter().any(Option::is_some);
        self.joints
            .iter()
            .any(|joint| joint.stiffness.is_some() || joint.beam.as_ref().is_some_and(bends))
    }

    /// Returns the parent relations of the joints.
    pub(crate) fn tree(&self) -> Tree {
        Tree::from_joints(&self.joints)
    }

    /// Returns true if the joints form one chain with the tool and all targets on its last joint.
    #[doc(hidden)]
    pub fn is_chain(&self) -> bool {
        let last = self.joints.len().saturating_sub(1);
        let mut carrier_joints =
            self.targets.iter().map(|target| target.joint).chain([self.tool.joint]);
        self.tree().is_chain() && carrier_joints.all(|joint| joint == last)
    }

    /// Returns an error if the joints do not form a chain; `what` names the operation that needs
    /// one.
    ///
    /// # Errors
    /// Returns an error if the parent of a joint is not the joint before it.
    pub(crate) fn require_chain(&self, what: &'static str) -> Result<(), InputError> {
        let mut joints = self.joints.iter().enumerate();
        match joints.find(|(index, joint)| joint.parent != index.checked_sub(1)) {
            Some((index, joint)) => {
                let location =
                    joint.location.clone().with_key(format!("joint[{}].parent", index + 1));
                Err(location.error(InputErrorKind::NotAChain { what }))
            }
            None => Ok(()),
        }
    }

    /// Returns the `[[target]]` called `word`, or the point of `[tool]` if no target is declared.
    ///
    /// # Errors
    /// Returns an error if targets are declared and none has that name.
    pub(crate) fn target(&self, word: &str) -> Result<Target, InputError> {
        let location = Location { line: None, excerpt: None, ..self.data.location.clone() };
        if self.targets.is_empty() {
            return Ok(Target::of_tool(&self.tool, location.with_key("tool")));
        }
        let found = self.targets.iter().find(|target| target.name == word).cloned();
        found.ok_or_else(|| location.with_key("target").error(self.unknown_target(word)))
    }

    /// Returns the words by which rows may name their target; one empty word if no target is
    /// declared.
    #[doc(hidden)]
    pub fn target_words(&self) -> Vec<String> {
        if self.targets.is_empty() {
            return vec![String::new()];
        }
        self.targets.iter().map(|target| target.name.clone()).collect()
    }

    /// Returns the error for a word that names no target.
    pub(crate) fn unknown_target(&self, word: &str) -> InputErrorKind {
        let known: Vec<String> = self.targets.iter().map(|target| target.name.clone()).collect();
        match word {
            "" => InputErrorKind::TargetsUnnamed { targets: known },
            _ => InputErrorKind::UnknownFixture { what: "target", name: word.to_owned(), known },
        }
    }
}

/// Section `[statics]`: shape of the arm in which loads act, and discretisation of beams.
#[doc(hidden)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Statics {
    /// Shape of the arm in which the loads act.
    pub equilibrium: Equilibrium,
    /// Number of closed-form elements per beam, at least 1.
    pub beam_elements: usize,
}

/// Shape of the arm in which the loads act.
#[doc(hidden)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Equilibrium {
    /// Loads act on the rigid arm: first order in the deflection \[Chen2021\].
    Undeflected,
    /// Loads act on the deflected arm in equilibrium.
    Deflected,
}

/// Section `[urdf]`: links of a URDF at both ends of the arm.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UrdfEnds {
    /// Link whose frame is the arm's base frame.
    pub base: String,
    /// Link whose frame is the last frame of the arm.
    pub tip: String,
}

/// Section `[base]`: pose of the arm's base in the measuring frame.
#[doc(hidden)]
#[derive(Debug, Clone)]
pub struct BasePose {
    /// Origin of the base frame \[m\].
    pub translation: Vector3<f64>,
    /// Rotation vector of the base frame \[rad\].
    pub rotation: Vector3<f64>,
}
