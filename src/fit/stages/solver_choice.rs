//! Choice of the solver.

use crate::least_squares::solver::BoundMethod;
use crate::model::Model;

/// Solver of a fit, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum SolverChoice {
    /// Bounded Levenberg–Marquardt if there are bounds or constraints, plain otherwise;
    /// `docs/solvers.md` explains why.
    #[default]
    Auto,
    /// Levenberg–Marquardt without bounds.
    LevenbergMarquardt,
    /// argmin's Gauss–Newton method: undamped.
    GaussNewton,
    /// The paper's iteration by a truncated pseudo-inverse [Chen2021, eq. 45]: undamped.
    PseudoInverse,
    /// Levenberg–Marquardt within the bounds of `[parameters]` and every `[[constraint]]`, by an
    /// active-set method.
    Bounded,
    /// Levenberg–Marquardt within bounds and constraints, each step by an interior-point method.
    InteriorPoint,
    /// Levenberg–Marquardt within bounds, with steps reflected at bounds [Branch, Coleman & Li
    /// 1999].
    Reflective,
    /// Levenberg–Marquardt whose steps are moved to the nearest point within bounds.
    Clamped,
    /// Solver of the caller, given by
    /// [`Options::with_custom_solver`](crate::fit::Options::with_custom_solver).
    Custom,
}

impl SolverChoice {
    /// All choices by name, `auto` first.
    #[doc(hidden)]
    pub const CHOICES: [Self; 8] = [
        Self::Auto,
        Self::LevenbergMarquardt,
        Self::GaussNewton,
        Self::PseudoInverse,
        Self::Bounded,
        Self::InteriorPoint,
        Self::Reflective,
        Self::Clamped,
    ];
    /// All solvers, without `auto`.
    #[doc(hidden)]
    pub const EACH: [Self; Self::CHOICES.len() - 1] = {
        let mut each = [Self::Auto; Self::CHOICES.len() - 1];
        let mut k = 0;
        while k < each.len() {
            each[k] = Self::CHOICES[k + 1];
            k += 1;
        }
        each
    };

    /// Names of the choices, in the order of [`SolverChoice::CHOICES`].
    pub(crate) const NAMES: [&str; Self::CHOICES.len()] = {
        let mut names = [""; Self::CHOICES.len()];
        let mut k = 0;
        while k < names.len() {
            names[k] = Self::CHOICES[k].as_str();
            k += 1;
        }
        names
    };

    /// Returns the name in results, files and arguments, with a short description.
    const fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Auto => {
                ("auto", "Bounded where there are bounds or constraints, else levenberg-marquardt")
            }
            Self::LevenbergMarquardt => {
                ("levenberg-marquardt", "Levenberg-Marquardt without bounds")
            }
            Self::GaussNewton => ("gauss-newton", "Gauss-Newton: undamped steps"),
            Self::PseudoInverse => {
                ("pseudo-inverse", "Undamped steps by a truncated pseudo-inverse, as in the paper")
            }
            Self::Bounded => (
                "bounded",
                "Levenberg-Marquardt within the bounds of [parameters] and every [[constraint]]",
            ),
            Self::InteriorPoint => {
                ("interior-point", "The same, each step by an interior-point method")
            }
            Self::Reflective => {
                ("reflective", "Levenberg-Marquardt within bounds by reflections; no constraints")
            }
            Self::Clamped => {
                ("clamped", "Levenberg-Marquardt with steps cut at the bounds; no constraints")
            }
            Self::Custom => ("custom", "A solver of the caller"),
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

    /// Returns the method by which the solver keeps bounds; `None` if it cannot.
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
