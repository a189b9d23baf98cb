//! Which parameters are fitted together.

use crate::model::parameter::Parameter;
use crate::model::{Ablation, Model};

/// Which parameters are fitted together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Strategy {
    /// Everything at once.
    #[default]
    Joint,
    /// Stiffness, then geometry [Chen2021, sec. 3.3], repeated until it settles.
    Sequential,
    /// Stiffness, then geometry, once: the paper's order.
    OneSweep,
    /// Geometry; stiffnesses stay at their nominal values.
    GeometryOnly,
    /// Stiffnesses; geometry stays at its nominal values.
    StiffnessOnly,
    /// Geometry of an arm in which nothing gives way: what the paper calls ignoring elasticity.
    Rigid,
}

impl Strategy {
    /// Every strategy.
    pub const EACH: [Self; 6] = [
        Self::Joint,
        Self::Sequential,
        Self::OneSweep,
        Self::GeometryOnly,
        Self::StiffnessOnly,
        Self::Rigid,
    ];

    /// Their names.
    pub const NAMES: [&str; Self::EACH.len()] = {
        let mut names = [""; Self::EACH.len()];
        let mut k = 0;
        while k < names.len() {
            names[k] = Self::EACH[k].as_str();
            k += 1;
        }
        names
    };

    /// Name in results, files and arguments, and what it does in a few words.
    const fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Joint => ("joint", "Everything at once"),
            Self::Sequential => {
                ("sequential", "Stiffness, then geometry, repeated until it settles")
            }
            Self::OneSweep => {
                ("sequential-one-sweep", "Stiffness, then geometry, once: the paper's order")
            }
            Self::GeometryOnly => ("geometry-only", "Geometry; stiffnesses stay nominal"),
            Self::StiffnessOnly => ("stiffness-only", "Stiffnesses; geometry stays nominal"),
            Self::Rigid => {
                ("rigid", "Geometry, of an arm in which nothing gives way: elasticity ignored")
            }
        }
    }

    /// Name in results, files and arguments.
    pub const fn as_str(self) -> &'static str {
        self.words().0
    }

    /// What it does, in a few words.
    pub const fn summary(self) -> &'static str {
        self.words().1
    }

    /// The model that is fitted: as declared, or without its elasticity and the parameters that
    /// describe it.
    #[must_use]
    pub fn model(self, declared: Model) -> Model {
        if self == Self::Rigid { declared.ablated(Ablation::Rigid) } else { declared }
    }

    /// The stages of one sweep, each as a choice of parameters; bases and targets take part in
    /// every stage.
    pub fn stages(self) -> &'static [fn(&Parameter) -> bool] {
        const ALL: fn(&Parameter) -> bool = |_| true;
        const STIFFNESS: fn(&Parameter) -> bool = |p| p.site.is_elastic() || p.site.is_placement();
        const GEOMETRY: fn(&Parameter) -> bool = |p| !p.site.is_elastic();
        match self {
            Self::Joint => &[ALL],
            Self::Sequential | Self::OneSweep => &[STIFFNESS, GEOMETRY],
            Self::GeometryOnly | Self::Rigid => &[GEOMETRY],
            Self::StiffnessOnly => &[STIFFNESS],
        }
    }
}
