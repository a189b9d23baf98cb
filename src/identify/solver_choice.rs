//! By which solver parameters are fitted.

use crate::model::Model;

/// A solver by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
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

impl SolverChoice {
    /// Every solver.
    pub const EACH: [Self; 4] = [Self::LevenbergMarquardt, Self::GaussNewton, Self::PseudoInverse, Self::Bounded];
    /// Every choice: a solver, or what fits the problem.
    pub const CHOICES: [Self; 5] =
        [Self::Auto, Self::LevenbergMarquardt, Self::GaussNewton, Self::PseudoInverse, Self::Bounded];

    /// Their names.
    pub const NAMES: [&str; Self::CHOICES.len()] = {
        let mut names = [""; Self::CHOICES.len()];
        let mut k = 0;
        while k < names.len() {
            names[k] = Self::CHOICES[k].as_str();
            k += 1;
        }
        names
    };

    /// Name in results, files and arguments, and what it does in a few words.
    const fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Auto => ("auto", "Bounded where there are bounds or constraints, else levenberg-marquardt"),
            Self::LevenbergMarquardt => ("levenberg-marquardt", "Levenberg-Marquardt without bounds"),
            Self::GaussNewton => ("gauss-newton", "Gauss-Newton: undamped steps"),
            Self::PseudoInverse => ("pseudo-inverse", "Undamped steps by a truncated pseudo-inverse, as in the paper"),
            Self::Bounded => {
                ("bounded", "Levenberg-Marquardt within the bounds of [parameters] and every [[constraint]]")
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
