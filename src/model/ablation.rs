//! Models with a part of the elasticity left out.

use super::Model;
use crate::mechanics::Flexibility;
use crate::model::parameter::{ArmField, BeamField, ParameterSite};

worded! {
    /// Part of the elasticity that an ablated model keeps. Loads and shape changes by effects are
    /// always kept.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum Ablation: as_str {
        /// Keeps no elasticity: the arm is rigid.
        Rigid = "rigid";
        /// Keeps the elasticity of joints and base (rotation of revolute joints, bending of
        /// slides), with rigid links.
        JointsOnly = "joints-only";
        /// Keeps the elasticity of the links (stretch, bending, twist), with rigid joints and base.
        LinksOnly = "links-only";
        /// Keeps the bending of the links alone.
        BendingOnly = "bending-only";
        /// Keeps the whole elasticity.
        All = "all";
    }
}

impl Ablation {
    fn keeps(self, site: ParameterSite) -> bool {
        match (self, site) {
            (Self::Rigid, site) => !site.is_elastic(),
            (Self::LinksOnly | Self::BendingOnly, ParameterSite::Joint { .. }) => {
                !site.is_elastic()
            }
            (
                Self::LinksOnly | Self::BendingOnly,
                ParameterSite::Arm(ArmField::MountingX | ArmField::MountingY),
            )
            | (
                Self::BendingOnly,
                ParameterSite::Beam {
                    field:
                        BeamField::Axial
                        | BeamField::Twist
                        | BeamField::CouplingY
                        | BeamField::CouplingZ,
                    ..
                },
            ) => false,
            (Self::JointsOnly, ParameterSite::Beam { field, .. }) => !field.is_rigidity(),
            _ => true,
        }
    }
}

impl Model {
    /// Returns the model with a part of its elasticity left out, together with the parameters of
    /// that part.
    #[must_use]
    #[doc(hidden)]
    pub fn ablated(&self, ablation: Ablation) -> Self {
        let mut model = self.clone();
        let kept: Vec<usize> = (0..model.parameters.len())
            .filter(|&k| ablation.keeps(model.parameters[k].site))
            .collect();
        model.parameters.retain(|parameter| ablation.keeps(parameter.site));
        model.constraints = self
            .constraints
            .iter()
            .filter_map(|constraint| constraint.on_parameters(&kept))
            .collect();
        for joint in &mut model.nominal.joints {
            if matches!(ablation, Ablation::Rigid | Ablation::LinksOnly | Ablation::BendingOnly) {
                (joint.flexibility, joint.lateral, joint.slide) = (None, None, None);
            }
            // A rigid link whose strain depends on temperature remains in the forward pass.
            if ablation == Ablation::Rigid
                && joint.beam.as_ref().is_some_and(|beam| beam.strain.is_none())
            {
                joint.beam = None;
            }
            let Some(beam) = &mut joint.beam else { continue };
            let flexibility = &mut beam.flexibility;
            match ablation {
                Ablation::Rigid | Ablation::JointsOnly => *flexibility = Flexibility::RIGID,
                Ablation::BendingOnly => {
                    (flexibility.axial, flexibility.twist, flexibility.coupling) = (0.0, 0.0, None);
                }
                Ablation::LinksOnly | Ablation::All => {}
            }
        }
        if matches!(ablation, Ablation::Rigid | Ablation::LinksOnly | Ablation::BendingOnly) {
            model.nominal.mounting = None;
        }
        if ablation == Ablation::Rigid {
            model.nominal.mixing = None;
        }
        model
    }
}
