//! Alternative models: wrong assumptions about the arm that might explain the errors reported in
//! \[Chen2021\].

use crate::problem::{Joint, Problem};

worded! {
    /// Wrong assumption about the arm, with correct formulas.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum AlternativeModel: as_str, summary {
        /// Model 1.25 times as stiff as the arm.
        QuarterTooStiff = "quarter-too-stiff", "model 1.25 times as stiff as the arm";
        /// Model twice as stiff as the arm.
        TwiceTooStiff = "twice-too-stiff", "model twice as stiff as the arm";
        /// Model two thirds as stiff as the arm.
        TooSoft = "third-too-soft", "model two thirds as stiff as the arm";
        /// Model with elastic joints and rigid links.
        JointsAlone = "joints-alone", "rigid links in the model";
        /// Model with elastic links and rigid joints.
        LinksAlone = "links-alone", "rigid joints in the model";
        /// Model whose hoist force is 10 % too small.
        HoistTooWeak = "hoist-too-weak", "hoist 10 % weaker in the model";
        /// Model without a hoist.
        NoHoist = "no-hoist", "no hoist in the model";
        /// Model without a payload.
        NoPayload = "no-payload", "no payload in the model";
    }
}

impl AlternativeModel {
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

    /// Returns the factors by which the model multiplies payload and hoist force.
    pub(super) fn loads(self) -> (f64, f64) {
        match self {
            Self::HoistTooWeak => (1.0, 0.9),
            Self::NoHoist => (1.0, 0.0),
            Self::NoPayload => (0.0, 1.0),
            _ => (1.0, 1.0),
        }
    }
}

/// Multiplies the stiffnesses of all joints by `joints` and the rigidities of all links by `links`.
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
