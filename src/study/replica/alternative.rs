//! Other explanations: arms that the paper's authors may have taken theirs for.

use crate::problem::{Joint, Problem};

/// A mistake in the model of the arm, its formulas corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum AlternativeModel {
    /// Everything a quarter too stiff.
    QuarterTooStiff,
    /// Everything twice as stiff as it is.
    TwiceTooStiff,
    /// Everything two thirds as stiff as it is.
    TooSoft,
    /// Joints give way, links do not.
    JointsAlone,
    /// Links bend, joints do not give way.
    LinksAlone,
    /// The hoist pulls a tenth more than the model says.
    HoistTooWeak,
    /// No hoist in the model.
    NoHoist,
    /// No payload in the model.
    NoPayload,
}

impl AlternativeModel {
    /// All of them.
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

    /// Name in results, and what it says in a few words.
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

    /// The arm that is assumed in place of the true one.
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

    /// By what payload and hoist are multiplied.
    pub(super) fn loads(self) -> (f64, f64) {
        match self {
            Self::HoistTooWeak => (1.0, 0.9),
            Self::NoHoist => (1.0, 0.0),
            Self::NoPayload => (0.0, 1.0),
            _ => (1.0, 1.0),
        }
    }
}

/// Multiplies stiffnesses of joints and rigidities of links.
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
