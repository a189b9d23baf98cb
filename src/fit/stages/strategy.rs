//! Strategies: which parameters are fitted together.

use crate::model::parameter::Parameter;
use crate::model::{Ablation, Model};

/// Strategy of a fit: which parameters are fitted together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Strategy {
    /// Fits everything at once.
    #[default]
    Joint,
    /// Fits stiffness, then geometry [Chen2021, sec. 3.3], and repeats both until the cost
    /// converges.
    Sequential,
    /// Fits stiffness, then geometry, once, in the order of the paper.
    OneSweep,
    /// Fits geometry; stiffnesses stay at their nominal values.
    GeometryOnly,
    /// Fits stiffnesses; geometry stays at its nominal values.
    StiffnessOnly,
    /// Fits the geometry of a rigid arm, which the paper calls ignoring elasticity.
    Rigid,
}

impl Strategy {
    /// All strategies, the default first.
    #[doc(hidden)]
    pub const EACH: [Self; 6] = [
        Self::Joint,
        Self::Sequential,
        Self::OneSweep,
        Self::GeometryOnly,
        Self::StiffnessOnly,
        Self::Rigid,
    ];

    /// Names of the strategies.
    pub(crate) const NAMES: [&str; Self::EACH.len()] = {
        let mut names = [""; Self::EACH.len()];
        let mut k = 0;
        while k < names.len() {
            names[k] = Self::EACH[k].as_str();
            k += 1;
        }
        names
    };

    /// Returns the name in results, files and arguments, with a short description.
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

    /// Returns the name in results, files and arguments.
    #[doc(hidden)]
    pub const fn as_str(self) -> &'static str {
        self.words().0
    }

    /// Returns a short description.
    pub(crate) const fn summary(self) -> &'static str {
        self.words().1
    }

    /// Returns the model that is fitted: `declared`, or `declared` without elasticity and its
    /// parameters.
    #[must_use]
    #[doc(hidden)]
    pub fn model(self, declared: Model) -> Model {
        if self == Self::Rigid { declared.ablated(Ablation::Rigid) } else { declared }
    }

    /// Returns the stages of one sweep. Each is a predicate that selects the parameters to vary;
    /// bases and targets vary in every stage.
    pub(crate) fn stages(self) -> &'static [fn(&Parameter) -> bool] {
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
