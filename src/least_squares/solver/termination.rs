//! Termination reasons of the solvers.

use std::fmt;

worded! {
    /// Reason for which a solver stopped, with the inequality that held.
    ///
    /// The tests on cost and step are those of MINPACK (info 1 to 8), with one exception. A step
    /// that only the radius limits and that agrees with its prediction (λ > 0 and ρ ≥ ¾) is not
    /// tested, since the next one will be longer.
    ///
    /// Symbols: g = Jᵀr, D the scaling, p the last step tried, Δ the radius, ρ the actual over the
    /// predicted reduction of ½‖r‖², and ε = 2⁻⁵².
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    #[non_exhaustive]
    pub enum Termination: as_str, message {
        /// The residual is orthogonal to every derivative column: max |gⱼ| / (‖Jⱼ‖ ‖r‖) ≤
        /// `gradient_tolerance`.
        Gradient = "gradient", "converged: the residual is orthogonal to the derivatives";
        /// The cost no longer falls: |actual| ≤ `cost_tolerance`·½‖r‖², predicted ≤
        /// `cost_tolerance`·½‖r‖², and ρ ≤ 2 or |actual| ≤ 1000 ε·½‖r‖² (rounding).
        Cost = "cost", "converged: the cost no longer falls";
        /// The step is negligible: ‖D p‖ ≤ `step_tolerance` ‖D x‖.
        Step = "step", "converged: the step is negligible";
        /// The data are fitted exactly: ‖r‖ = 0.
        ZeroResidual = "zero-residual", "converged: the residual is zero";
        /// Rounding hides any further reduction: |actual| and predicted ≤ ε·½‖r‖².
        CostPrecision = "cost-precision", "converged to rounding: the cost cannot fall further";
        /// Rounding hides any smaller step: Δ ≤ ε ‖D x‖.
        StepPrecision = "step-precision", "converged to rounding: the step cannot be smaller";
        /// Rounding hides any smaller gradient: max |gⱼ| / (‖Jⱼ‖ ‖r‖) ≤ ε.
        GradientPrecision = "gradient-precision",
            "converged to rounding: the gradient cannot be smaller";
        /// The Gauss–Newton method of argmin made no progress: | ‖Qᵀr‖ₖ₋₁ − ‖Qᵀr‖ₖ | < `tolerance`.
        Unchanged = "unchanged", "converged: the projected residual no longer changes";
        /// The iteration limit was reached: iterations ≥ `max_iterations`.
        IterationLimit = "iteration-limit", "stopped: the limit of iterations was reached";
        /// The cost at the start is not finite.
        OutsideDomainAtStart = "outside-domain-at-start",
            "failed: the start lies outside the model's domain";
        /// The cost is finite at x, but ∂r/∂x is not.
        DerivativesNotFinite = "derivatives-not-finite", "failed: a derivative is not finite";
        /// Every step left the domain, down to the smallest: ½‖r(x + p)‖² = ∞ and ‖D p‖ ≤
        /// `step_tolerance` ‖D x‖.
        DomainEdge = "domain-edge", "failed: every step leaves the model's domain";
        /// No point satisfies all bounds and inequalities.
        Infeasible = "infeasible", "failed: no point satisfies all bounds and constraints";
        /// The start, the bounds and the problem differ in their number of unknowns.
        SizeMismatch = "size-mismatch", "failed: start, bounds and problem differ in size";
        /// An undamped iteration diverged: ½‖r‖² > `growth`·(lowest ½‖r‖² so far) in `patience`
        /// successive iterations, or ∞.
        Diverged = "diverged", "failed: the cost keeps growing";
        /// The matrix JᵀJ that argmin's Gauss–Newton method inverts is singular.
        Singular = "singular", "failed: the derivatives are singular";
        /// An observer failed or interrupted the run.
        Interrupted = "interrupted", "stopped: interrupted from outside";
    }
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
}

impl fmt::Display for Termination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.message())
    }
}
