//! Which parameters are fitted together, and by which solver.

use crate::model::Model;
use crate::model::parameter::Parameter;

/// Which parameters are fitted together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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
}

/// A solver by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SolverChoice {
    /// Bounded Levenberg–Marquardt where there are bounds or constraints, plain otherwise; `docs/solvers.md` says why.
    #[default]
    Auto,
    /// Levenberg–Marquardt without bounds.
    LevenbergMarquardt,
    /// argmin's Gauss–Newton method: undamped.
    GaussNewton,
    /// The paper's iteration by a truncated pseudo-inverse [Chen2021, eq. 45]: undamped.
    PseudoInverse,
    /// Levenberg–Marquardt within the bounds of `[parameters]` and every `[[constraint]]`.
    Bounded,
}

impl Strategy {
    /// Every strategy.
    pub const EACH: [Self; 5] =
        [Self::Joint, Self::Sequential, Self::OneSweep, Self::GeometryOnly, Self::StiffnessOnly];

    /// Name on the command line and in results.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Sequential => "sequential",
            Self::OneSweep => "sequential-one-sweep",
            Self::GeometryOnly => "geometry-only",
            Self::StiffnessOnly => "stiffness-only",
        }
    }

    /// The stages of one sweep, each as a choice of parameters; bases and targets take part in every stage.
    pub fn stages(self) -> &'static [fn(&Parameter) -> bool] {
        const ALL: fn(&Parameter) -> bool = |_| true;
        const STIFFNESS: fn(&Parameter) -> bool = |p| p.slot.is_elastic() || p.slot.is_placement();
        const GEOMETRY: fn(&Parameter) -> bool = |p| !p.slot.is_elastic();
        match self {
            Self::Joint => &[ALL],
            Self::Sequential | Self::OneSweep => &[STIFFNESS, GEOMETRY],
            Self::GeometryOnly => &[GEOMETRY],
            Self::StiffnessOnly => &[STIFFNESS],
        }
    }
}

impl SolverChoice {
    /// Every solver.
    pub const EACH: [Self; 4] = [Self::LevenbergMarquardt, Self::GaussNewton, Self::PseudoInverse, Self::Bounded];

    /// Name on the command line and in results.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::LevenbergMarquardt => "levenberg-marquardt",
            Self::GaussNewton => "gauss-newton",
            Self::PseudoInverse => "pseudo-inverse",
            Self::Bounded => "bounded",
        }
    }

    /// The solver that `auto` stands for with this model.
    #[must_use]
    pub fn decide(self, model: &Model) -> Self {
        match self {
            Self::Auto if model.is_bounded() => Self::Bounded,
            Self::Auto => Self::LevenbergMarquardt,
            chosen => chosen,
        }
    }

    /// Why [`decide`](Self::decide) takes what it takes, where the choice is left to it.
    pub fn reason(self, model: &Model) -> Option<&'static str> {
        match self {
            Self::Auto if model.is_bounded() => Some("bounds to keep"),
            Self::Auto => Some("no bounds"),
            _ => None,
        }
    }
}
