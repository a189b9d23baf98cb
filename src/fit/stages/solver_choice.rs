//! Solvers of the fits, by name.

use crate::least_squares::solver::BoundMethod;
use crate::model::Model;

worded! {
    /// Solver of a fit, by name.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
    #[non_exhaustive]
    pub enum SolverChoice: as_str, summary {
        /// Bounded Levenberg–Marquardt if there are bounds or constraints, plain otherwise;
        /// `docs/solvers.md` explains why.
        #[default]
        Auto = "auto", "Bounded where there are bounds or constraints, else levenberg-marquardt";
        /// Levenberg–Marquardt solver, for problems without bounds and constraints.
        LevenbergMarquardt = "levenberg-marquardt", "Levenberg-Marquardt without bounds";
        /// Gauss–Newton method of the crate argmin, with undamped steps.
        GaussNewton = "gauss-newton", "Gauss-Newton: undamped steps";
        /// The paper's iteration by a truncated pseudo-inverse [Chen2021, eq. 45]: undamped.
        PseudoInverse = "pseudo-inverse",
            "Undamped steps by a truncated pseudo-inverse, as in the paper";
        /// Levenberg–Marquardt within the bounds of `[parameters]` and every `[[constraint]]`, by
        /// an active-set method.
        Bounded = "bounded",
            "Levenberg-Marquardt within the bounds of [parameters] and every [[constraint]]";
        /// Levenberg–Marquardt within bounds and constraints, each step by an interior-point
        /// method.
        InteriorPoint = "interior-point", "The same, each step by an interior-point method";
        /// Levenberg–Marquardt within bounds, with steps reflected at bounds [Branch, Coleman & Li
        /// 1999].
        Reflective = "reflective",
            "Levenberg-Marquardt within bounds by reflections; no constraints";
        /// Levenberg–Marquardt whose steps are moved to the nearest point within bounds.
        Clamped = "clamped", "Levenberg-Marquardt with steps cut at the bounds; no constraints";
        /// Solver of the caller, given by
        /// [`Options::with_custom_solver`](crate::fit::Options::with_custom_solver).
        Custom = "custom", "A solver of the caller";
    }
}

impl SolverChoice {
    /// Every choice that has a name on the command line, `auto` first: all but `Custom`.
    #[doc(hidden)]
    pub const CHOICES: &[Self] = Self::EACH.split_at(Self::EACH.len() - 1).0;
    /// Every solver of flexcal: all choices but `Auto` and `Custom`.
    #[doc(hidden)]
    pub const SOLVERS: &[Self] = Self::CHOICES.split_at(1).1;

    /// Names of [`CHOICES`](Self::CHOICES), in the same order.
    pub(crate) const NAMES: &[&'static str] = Self::WORDS.split_at(Self::CHOICES.len()).0;

    /// Returns the method by which the solver keeps bounds; `None` if the solver cannot keep
    /// bounds.
    #[doc(hidden)]
    pub fn within(self) -> Option<BoundMethod> {
        match self {
            Self::Bounded => Some(BoundMethod::ActiveSet),
            Self::InteriorPoint => Some(BoundMethod::InteriorPoint),
            Self::Reflective => Some(BoundMethod::Reflective),
            Self::Clamped => Some(BoundMethod::Clamped),
            Self::Auto
            | Self::LevenbergMarquardt
            | Self::GaussNewton
            | Self::PseudoInverse
            | Self::Custom => None,
        }
    }

    /// Returns true if the solver keeps the bounds and constraints of `model`.
    #[doc(hidden)]
    pub fn keeps(self, model: &Model) -> bool {
        match self.within() {
            None => !model.is_bounded(),
            Some(BoundMethod::Reflective | BoundMethod::Clamped) => model.constraints.is_empty(),
            Some(_) => true,
        }
    }

    /// Returns the solver that is used for `model`; `auto` is replaced by a specific solver.
    #[must_use]
    #[doc(hidden)]
    pub fn decide(self, model: &Model) -> Self {
        match self {
            Self::Auto if model.is_bounded() => Self::Bounded,
            Self::Auto => Self::LevenbergMarquardt,
            chosen => chosen,
        }
    }

    /// Returns the reason for the solver of [`decide`](Self::decide); `None` unless the choice is
    /// `auto`.
    #[doc(hidden)]
    pub fn reason(self, model: &Model) -> Option<&'static str> {
        match self {
            Self::Auto if model.is_bounded() => Some("bounds to keep"),
            Self::Auto => Some("no bounds"),
            _ => None,
        }
    }
}
