//! Models that leave a part of the elasticity out.

use super::Model;
use crate::parameter::{BeamField, Slot};

/// What an ablated model keeps of the elasticity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ablation {
    /// Nothing: geometry alone.
    Rigid,
    /// Torsion of the joints.
    JointsOnly,
    /// Stretch, bending and twist of the links.
    LinksOnly,
    /// Bending of the links.
    BendingOnly,
    /// Everything.
    All,
}

impl Ablation {
    /// In order from least to most.
    pub const EACH: [Self; 5] = [Self::Rigid, Self::JointsOnly, Self::LinksOnly, Self::BendingOnly, Self::All];

    /// Name in results.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Rigid => "rigid",
            Self::JointsOnly => "joints-only",
            Self::LinksOnly => "links-only",
            Self::BendingOnly => "bending-only",
            Self::All => "all",
        }
    }

    fn keeps(self, slot: Slot) -> bool {
        match (self, slot) {
            (Self::Rigid, slot) => !slot.is_elastic(),
            (Self::LinksOnly | Self::BendingOnly, Slot::Joint { .. }) => !slot.is_elastic(),
            (Self::JointsOnly, Slot::Beam { .. })
            | (Self::BendingOnly, Slot::Beam { field: BeamField::Axial | BeamField::Twist, .. }) => false,
            _ => true,
        }
    }
}

impl Model {
    /// The same model with a part of its elasticity left out, and the parameters that describe it.
    #[must_use]
    pub fn ablated(&self, ablation: Ablation) -> Self {
        let mut model = self.clone();
        let kept: Vec<usize> =
            (0..model.parameters.len()).filter(|&k| ablation.keeps(model.parameters[k].slot)).collect();
        model.parameters.retain(|parameter| ablation.keeps(parameter.slot));
        model.constraints = self.constraints.iter().filter_map(|constraint| constraint.on(&kept)).collect();
        for joint in &mut model.nominal.joints {
            if matches!(ablation, Ablation::Rigid | Ablation::LinksOnly | Ablation::BendingOnly) {
                (joint.flexibility, joint.nonlinear, joint.lateral) = (None, None, None);
            }
            if ablation == Ablation::Rigid {
                joint.beam = None;
            }
            let Some(beam) = &mut joint.beam else { continue };
            let all = &mut beam.flexibility;
            match ablation {
                Ablation::JointsOnly => (all.axial, all.about_y, all.about_z, all.twist) = (0.0, 0.0, 0.0, 0.0),
                Ablation::BendingOnly => (all.axial, all.twist) = (0.0, 0.0),
                Ablation::Rigid | Ablation::LinksOnly | Ablation::All => {}
            }
        }
        model
    }
}
