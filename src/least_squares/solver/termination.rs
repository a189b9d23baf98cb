//! Termination reasons of the solvers.

use std::fmt;

/// Reason for which a solver stopped, with the inequality that held.
///
/// The tests on cost and step are those of MINPACK (info 1 to 8), with one exception. A step that
/// only the radius limits and that agrees with its prediction (λ > 0 and ρ ≥ ¾) is not tested,
/// since the next one will be longer.
///
/// Symbols: g = Jᵀr, D the scaling, p the last step tried, Δ the radius, ρ the actual over the
/// predicted reduction of ½‖r‖², and ε = 2⁻⁵².
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Termination {
    /// The residual is orthogonal to every derivative column: max |gⱼ| / (‖Jⱼ‖ ‖r‖) ≤
    /// `gradient_tolerance`.
    Gradient,
    /// The cost no longer falls: |actual| ≤ `cost_tolerance`·½‖r‖², predicted ≤
    /// `cost_tolerance`·½‖r‖², and ρ ≤ 2 or |actual| ≤ 1000 ε·½‖r‖² (rounding).
    Cost,
    /// The step is negligible: ‖D p‖ ≤ `step_tolerance` ‖D x‖.
    Step,
    /// The data are fitted exactly: ‖r‖ = 0.
    ZeroResidual,
    /// Rounding hides any further reduction: |actual| and predicted ≤ ε·½‖r‖².
    CostPrecision,
    /// Rounding hides any smaller step: Δ ≤ ε ‖D x‖.
    StepPrecision,
    /// Rounding hides any smaller gradient: max |gⱼ| / (‖Jⱼ‖ ‖r‖) ≤ ε.
    GradientPrecision,
    /// The Gauss–Newton method of argmin made no progress: | ‖Qᵀr‖ₖ₋₁ − ‖Qᵀr‖ₖ | < `tolerance`.
    Unchanged,
    /// The iteration limit was reached: iterations ≥ `max_iterations`.
    IterationLimit,
    /// The cost at the start is not finite.
    OutsideDomainAtStart,
    /// The cost is finite at x, but ∂r/∂x is not.
    DerivativesNotFinite,
    /// Every step left the domain, down to the smallest: ½‖r(x + p)‖² = ∞ and ‖D p‖ ≤
    /// `step_tolerance` ‖D x‖.
    DomainEdge,
    /// No point satisfies all bounds and inequalities.
    Infeasible,
    /// The start, the bounds and the problem differ in their number of unknowns.
    SizeMismatch,
    /// An undamped iteration diverged: ½‖r‖² > `growth`·(lowest ½‖r‖² so far) in `patience`
    /// successive iterations, or ∞.
    Diverged,
    /// The matrix JᵀJ that argmin's Gauss–Newton method inverts is singular.
    Singular,
    /// An observer failed or interrupted the run.
    Interrupted,
}

impl Termination {
    /// Returns true if x is a minimum within the tolerances or the precision of the arithmetic.
    pub fn converged(self) -> bool {
        match self {
            Self::Gradient
            | Self::Cost
            | Self::Step
            | Self::ZeroResidual
            | Self::CostPrecision
            | Self::StepPrecision
            | Self::GradientPrecision
            | Self::Unchanged => true,
            Self::IterationLimit
            | Self::OutsideDomainAtStart
            | Self::DerivativesNotFinite
            | Self::DomainEdge
            | Self::Infeasible
            | Self::SizeMismatch
            | Self::Diverged
            | Self::Singular
            | Self::Interrupted => false,
        }
    }

    /// Returns the stable name for files, in kebab case.
    #[doc(hidden)]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Gradient => "gradient",
            Self::Cost => "cost",
            Self::Step => "step",
            Self::ZeroResidual => "zero-residual",
            Self::CostPrecision => "cost-precision",
            Self::StepPrecision => "step-precision",
            Self::GradientPrecision => "gradient-precision",
            Self::Unchanged => "unchanged",
            Self::IterationLimit => "iteration-limit",
            Self::OutsideDomainAtStart => "outside-domain-at-start",
            Self::DerivativesNotFinite => "derivatives-not-finite",
            Self::DomainEdge => "domain-edge",
            Self::Infeasible => "infeasible",
            Self::SizeMismatch => "size-mismatch",
            Self::Diverged => "diverged",
            Self::Singular => "singular",
            Self::Interrupted => "interrupted",
        }
    }
}

impl fmt::Display for Termination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Gradient => "converged: the residual is orthogonal to the derivatives",
            Self::Cost => "converged: the cost no longer falls",
            Self::Step => "converged: the step is negligible",
            Self::ZeroResidual => "converged: the residual is zero",
            Self::CostPrecision => "converged to rounding: the cost cannot fall further",
            Self::StepPrecision => "converged to rounding: the step cannot be smaller",
            Self::GradientPrecision => "converged to rounding: the gradient cannot be smaller",
            Self::Unchanged => "converged: the projected residual no longer changes",
            Self::IterationLimit => "stopped: the limit of iterations was reached",
            Self::OutsideDomainAtStart => "failed: the start lies outside the model's domain",
            Self::DerivativesNotFinite => "failed: a derivative is not finite",
            Self::DomainEdge => "failed: every step leaves the model's domain",
            Self::Infeasible => "failed: no point satisfies all bounds and constraints",
            Self::SizeMismatch => "failed: start, bounds and problem differ in size",
            Self::Diverged => "failed: the cost keeps growing",
            Self::Singular => "failed: the derivatives are singular",
            Self::Interrupted => "stopped: interrupted from outside",
        })
    }
}
