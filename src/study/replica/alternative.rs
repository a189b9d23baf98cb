//! Alternative models: mistaken assumptions that might explain the errors reported in \[Chen2021\].

use crate::problem::{Joint, Problem};

/// Wrong assumption about the arm, with correct formulas.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum AlternativeModel {
    /// Model 1.25 times as stiff as the arm.
    QuarterTooStiff,
    /// Model twice as stiff as the arm.
    TwiceTooStiff,
    /// Model two thirds as stiff as the arm.
    TooSoft,
    /// Model with elastic joints and rigid links.
    JointsAlone,
    /// Model with elastic links and rigid joints.
    LinksAlone,
    /// Model whose hoist force is 10 % too small.
    HoistTooWeak,
    /// Model without a hoist.
    NoHoist,
    /// Model without a payload.
    NoPayload,
}

impl AlternativeModel {
    /// All alternative models, in the order of the results.
    pub const EACH: [Self; 8] = [
        Self::QuarterTooStiff,
        Self::TwiceTooStiff,
        Self::TooSoft,
        Self::JointsAlone,
        Self::LinksAlone,
        Self::HoistTooWeak,
        Self::NoHoist,
        Self::NoPayload,
    ];

    /// Returns the name in results and a short description.
    pub const fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::QuarterTooStiff => ("quarter-too-stiff", "model 1.25 times as stiff as the arm"),
            Self::TwiceTooStiff => ("twice-too-stiff", "model twice as stiff as the arm"),
            Self::TooSoft => ("third-too-soft", "model two thirds as stiff as the arm"),
            Self::JointsAlone => ("joints-alone", "rigid links in the model"),
            Self::LinksAlone => ("links-alone", "rigid joints in the model"),
            Self::HoistTooWeak => ("hoist-too-weak", "hoist 10 % weaker in the model"),
            Self::NoHoist => ("no-hoist", "no hoist in the model"),
            Self::NoPayload => ("no-payload", "no payload in the model"),
        }
    }

    /// Returns the arm that this model assumes in place of the true one.
    pub(super) fn assumed(self, mut arm: Problem) -> Problem {
        match self {
            Self::QuarterTooStiff => stiffen(&mut arm, 1.25, 1.25),
            Self::TwiceTooStiff => stiffen(&mut arm, 2.0, 2.0),
            Self::TooSoft => stiffen(&mut arm, 2.0 / 3.0, 2.0 / 3.0),
            Self::JointsAlone => stiffen(&mut arm, 1.0, f64::INFINITY),
            Self::LinksAlone => stiffen(&mut arm, f64::INFINITY, 1.0),
            Self::HoistTooWeak | Self::NoHoist | Self::NoPayload => {}
        }
        arm
    }

    /// Returns the factors of payload and hoist force.
    pub(super) fn loads(self) -> (f64, f64) {
        match self {
            Self::HoistTooWeak => (1.0, 0.9),
            Self::NoHoist => (1.0, 0.0),
            Self::NoPayload => (0.0, 1.0),
            _ => (1.0, 1.0),
        }
    }
}

/// Multiplies the stiffnesses of joints and the rigidities of links.
pub(super) fn stiffen(arm: &mut Problem, joints: f64, links: f64) {
    let each = |joint: &mut Joint| {
        joint.stiffness.iter_mut().for_each(|stiffness| *stiffness *= joints);
        let beam = joint.beam.iter_mut();
        let rigidities =
            beam.flat_map(|beam| [&mut beam.ea, &mut beam.ei_y, &mut beam.ei_z, &mut beam.gj]);
        rigidities.flatten().for_each(|rigidity| *rigidity *= links);
    };
    arm.joints.iter_mut().for_each(each);
}
