//! What an identification gives.

use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};

use crate::fit::checks::finding::{Finding, FindingCode, Severity};
use crate::fit::stages::fitting::FitEnd;
use crate::fit::stages::noise_model::NoiseModel;
use crate::fit::stages::stage::Stage;
use crate::fit::uncertainty::covariance::{Collected, Correlations, Covariance};
use crate::fit::uncertainty::noise::Noise;
use crate::fit::uncertainty::statistics::Statistics;
use crate::fit::{
    ActiveConstraint, Alternation, Errors, InfluentialRows, OrientationErrors, Outlier,
    PointSpread, PriorSize, ShadowPrice, SolverChoice, Strategy,
};
use crate::least_squares::solver::{AtBound, Termination};
use crate::least_squares::{Identifiability, UnidentifiableCombination};
use crate::model::parameter::Parameter;
use crate::quantity::Unit;

/// Correlations beyond this are reported: of sum and difference of the two, one has less than a
/// nineteenth of the other's variance.
pub const STRONG_CORRELATION: f64 = 0.9;
/// A parameter of which the data gave no more than this part has no standard error.
const NOTHING_LEARNED: f64 = 1e-6;

/// A parameter after the fit; SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Name as in the problem file.
    pub name: String,
    /// Kind of quantity.
    pub unit: Unit,
    /// Nominal value.
    pub nominal: f64,
    /// Estimated value.
    pub estimate: f64,
    /// 1 σ; `None` where nothing was learned, where the value rests on a bound or is part of a
    /// combination that neither data nor priors see, or where it was not fitted.
    pub std_error: Option<f64>,
    /// The bound on which the value rests.
    pub at_bound: Option<AtBound>,
    /// What that costs.
    pub shadow_price: Option<ShadowPrice>,
    /// Part of the value that the data gave, 0…1; the rest is prior, bound, or choice among
    /// unidentifiable combinations.
    pub identified: f64,
    /// Whether the strategy varied it.
    pub fitted: bool,
}

/// An identified arm.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Identification {
    /// Which parameters were fitted together.
    pub strategy: Strategy,
    /// The solver that was used.
    pub solver: SolverChoice,
    /// Why that one, where `auto` chose it.
    pub solver_reason: Option<&'static str>,
    /// Why it stopped.
    pub termination: Termination,
    /// Findings of the checks, errors first; a provisional fit is only checked for convergence.
    pub findings: Vec<Finding>,
    /// Different poses of the arm that were fitted; several targets in one pose make one.
    pub poses: usize,
    /// Whether some pose of the arm shows several targets.
    pub several_targets: bool,
    /// Steps tried, over all stages.
    pub iterations: u64,
    /// Evaluations of the residual, with derivatives or without, over all stages.
    pub evaluations: u64,
    /// How the stages of a sequential strategy took turns.
    pub alternation: Option<Alternation>,
    /// Time taken \[s\].
    pub seconds: f64,
    /// Where the noise comes from.
    pub noise: Noise,
    /// Of the nominal arm, with base and target fitted where they are free.
    pub registered: Errors,
    /// Of the identified arm.
    pub fitted: Errors,
    /// Of each kind of rows, where there are several: before and after; the first are `registered`
    /// and `fitted`.
    pub kinds: Vec<(Errors, Errors)>,
    /// At each point that was touched the spread of the target as the nominal and as the identified
    /// arm have it, and whether all of its rows were held out.
    pub spreads: Vec<(PointSpread, PointSpread, bool)>,
    /// Errors of orientation, where it is fitted.
    pub orientation: Option<OrientationErrors>,
    /// χ² of the identification data over its degrees of freedom; `None` without any, or with the
    /// noise estimated. Where the loss is robust, outliers are left out of it.
    pub reduced_chi2: Option<f64>,
    /// Where chance keeps `reduced_chi2`, with probability 0.999; `None` as there.
    pub chance: Option<(f64, f64)>,
    /// Variance that the fit took over the declared one: 1 where residual and priors do not
    /// contradict that.
    pub noise_factor: f64,
    /// 1 σ of a coordinate that the fit took, of the identification rows together that errors are
    /// told of \[m\]; of tilts \[rad\].
    pub sigma_taken: f64,
    /// By what the declared σ are multiplied because they are too large; 1 where they are not.
    pub sigma_scale: f64,
    /// Combinations of `unknowns` that the data see too weakly to be estimated, held where they
    /// were: weights in units of the arm's size for lengths, 1 rad for angles and a factor of 100
    /// for stiffnesses, and the σ by which that moves all data.
    pub weak: Vec<UnidentifiableCombination>,
    /// Measured coordinates that were fitted.
    pub coordinates: usize,
    /// Names of the fitted parameters, in the order of [`Identification::identifiability`].
    pub unknowns: Vec<String>,
    /// Triangular factor of their whitened Jacobian, data alone, at the registered nominal arm, and
    /// what it tells once that was asked.
    pub(super) sight: (DMatrix<f64>, OnceLock<Identifiability>),
    /// Whether it was fitted in passing: it has neither that factor nor cautions, and nobody judged
    /// whether it is to be trusted.
    pub(crate) provisional: bool,
    /// What the fit made of the σ of positions, and of orientations.
    pub(super) noise_models: (NoiseModel, NoiseModel),
    /// Every free parameter.
    pub estimates: Vec<Estimate>,
    /// Covariance of the estimates.
    pub covariance: Covariance,
    /// Widths of priors that the deviations found contradict; none of a fit in passing.
    pub prior_sizes: Vec<PriorSize>,
    /// Constraints that hold the fitted parameters back, in the order of the file.
    pub active_constraints: Vec<ActiveConstraint>,
    /// Identification rows whose residual is too long to be noise, in the order of the rows.
    pub outliers: Vec<Outlier>,
    /// Held-out rows that are farther from the prediction than its σ allows, in the order of the
    /// rows.
    pub held_out_outliers: Vec<Outlier>,
    /// Those that carry what the fit does not explain, if a few do; looked for where
    /// [`crate::fit::Options::with_influential_rows`] asks, but not with a robust loss.
    pub influential_rows: Option<InfluentialRows>,
    /// Full parameter vector of the model.
    pub x: DVector<f64>,
    /// The same of the nominal arm with base and target fitted where they are free, whose errors
    /// are `registered`.
    pub registered_x: DVector<f64>,
    /// Time from which what follows the time counts: that of the first pose \[s\].
    pub first_time: f64,
    /// 1 σ of a coordinate in rows without one of their own, declared or estimated \[m\].
    pub sigma: f64,
}

impl Identification {
    /// Returns true if no finding is an error.
    pub fn is_trusted(&self) -> bool {
        self.first_error().is_none()
    }

    /// Returns the first error among the findings: the reason for which the fit is not to be
    /// trusted.
    pub fn first_error(&self) -> Option<&Finding> {
        self.findings.iter().find(|finding| finding.severity() == Severity::Error)
    }

    /// Returns the first finding with a code.
    pub fn finding(&self, code: FindingCode) -> Option<&Finding> {
        self.findings.iter().find(|finding| finding.code == code)
    }

    /// Returns true if a finding has this code.
    pub fn has(&self, code: FindingCode) -> bool {
        self.finding(code).is_some()
    }

    /// Returns the findings that are warnings, without those that reports show in sections of their
    /// own.
    pub fn cautions(&self) -> impl Iterator<Item = &Finding> {
        let has_section =
            |code| matches!(code, FindingCode::InfluentialRows | FindingCode::UnsteadyPoint);
        self.findings
            .iter()
            .filter(move |own| own.severity() == Severity::Warning && !has_section(own.code))
    }

    /// What the identification data can tell about the fitted parameters, at the registered nominal
    /// arm: worked out when it is first asked for.
    pub fn identifiability(&self) -> &Identifiability {
        let (triangle, found) = &self.sight;
        found.get_or_init(|| Identifiability::of(triangle))
    }

    /// Returns the sentences of [`cautions`](Self::cautions).
    pub fn reasons_to_ask(&self) -> Vec<String> {
        self.cautions().map(ToString::to_string).collect()
    }

    /// A parameter by its name: `joint2.stiffness`.
    pub fn estimate(&self, name: &str) -> Option<&Estimate> {
        self.estimates.iter().find(|estimate| estimate.name == name)
    }

    /// Pairs of [`correlations`](Self::correlations) beyond [`STRONG_CORRELATION`], strongest
    /// first.
    pub fn strong_correlations(&self) -> Vec<(String, String, f64)> {
        let all = self.correlations();
        all.above(STRONG_CORRELATION)
            .into_iter()
            .map(|(a, b, rho)| (a.to_owned(), b.to_owned(), rho))
            .collect()
    }

    /// Correlations of the parameters that were fitted together.
    pub fn correlations(&self) -> Correlations {
        let name = |k: usize| &self.estimates[k].name;
        let Covariance { parameters, .. } = &self.covariance;
        let together: Vec<usize> = (0..parameters.len())
            .filter(|&i| self.unknowns.contains(name(parameters[i])))
            .collect();
        Correlations {
            names: together.iter().map(|&i| name(parameters[i]).clone()).collect(),
            matrix: self.covariance.correlation().select_rows(&together).select_columns(&together),
        }
    }
}

impl Estimate {
    /// A parameter that no stage has varied.
    pub(super) fn unfitted(parameter: &Parameter, time_measured: bool) -> Self {
        let unit = match parameter.unit() {
            Unit::Speed if !time_measured => Unit::LengthPerRow,
            unit => unit,
        };
        Self {
            name: parameter.name.clone(),
            unit,
            nominal: parameter.nominal,
            estimate: parameter.nominal,
            std_error: None,
            at_bound: None,
            shadow_price: None,
            identified: 0.0,
            fitted: false,
        }
    }
}

/// Enters what a stage found into the estimates of its unknowns.
pub(super) fn enter(
    (estimates, covariance): (&mut [Estimate], &mut Collected),
    stage: &Stage,
    end: &FitEnd,
    statistics: &Statistics,
) {
    covariance.enter(stage.model, &stage.unknowns, end.x.as_slice(), &statistics.covariance);
    for (j, (&k, parameter)) in stage.unknowns.iter().zip(stage.parameters()).enumerate() {
        let x = end.x[k];
        let learned = statistics.known[j] && statistics.identified[j] > NOTHING_LEARNED;
        let estimate = &mut estimates[k];
        estimate.estimate = parameter.value(x);
        estimate.std_error = learned.then(|| parameter.value_error(x, statistics.errors[j]));
        estimate.at_bound = end.at_bound[j];
        estimate.shadow_price = statistics.prices.bounds[j];
        estimate.identified = statistics.identified[j];
        estimate.fitted = true;
    }
}
