//! Strategies of a fit: which parameters are fitted together, and in which order.

use crate::model::parameter::Parameter;
use crate::model::{Ablation, Model};

worded! {
    /// Strategy of a fit: which parameters are fitted together, and in which order.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
    #[non_exhaustive]
    pub enum Strategy: as_str, summary {
        /// Fits all free parameters at once.
        #[default]
        Joint = "joint", "Everything at once";
        /// Fits stiffness, then geometry [Chen2021, sec. 3.3], and repeats both until the cost
        /// converges.
        Sequential = "sequential", "Stiffness, then geometry, repeated until it settles";
        /// Fits stiffness, then geometry, once, in the order of the paper.
        OneSweep = "sequential-one-sweep", "Stiffness, then geometry, once: the paper's order";
        /// Fits geometry; stiffnesses stay at their nominal values.
        GeometryOnly = "geometry-only", "Geometry; stiffnesses stay nominal";
        /// Fits stiffnesses; geometry stays at its nominal values.
        StiffnessOnly = "stiffness-only", "Stiffnesses; geometry stays nominal";
        /// Fits the geometry of a rigid arm, which the paper calls ignoring elasticity.
        Rigid = "rigid", "Geometry, of an arm in which nothing gives way: elasticity ignored";
    }
}

impl Strategy {
    /// Returns the model that the strategy fits: `declared`, or `declared` without elasticity if
    /// the strategy ignores it.
    #[must_use]
    #[doc(hidden)]
    pub fn model(self, declared: Model) -> Model {
        if self == Self::Rigid { declared.ablated(Ablation::Rigid) } else { declared }
    }

    /// Returns the strategy that varies the same parameters as this one, but all at once. Both have
    /// the same optimum, which a sequential strategy may need many sweeps to reach.
    pub(crate) fn without_sweeps(self) -> Self {
        match self {
            Self::Sequential | Self::OneSweep => Self::Joint,
            other => other,
        }
    }

    /// Returns the stages of one sweep. Each stage is a predicate that returns true for the
    /// parameters that it varies; bases and targets vary in every stage.
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
