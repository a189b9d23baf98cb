//! Result of an identification: estimates with their uncertainty, errors, and findings.

use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector, Vector3};

use crate::fit::checks::finding::{
    CONSEQUENCES, Finding, FindingCode, MISTAKES, Severity, doubted_bounds,
};
use crate::fit::checks::misreading::MisreadEffect;
use crate::fit::checks::priors::UNIT_RATIOS;
use crate::fit::stages::fitting::FitEnd;
use crate::fit::stages::noise_model::NoiseModel;
use crate::fit::stages::stage::Stage;
use crate::fit::uncertainty::covariance::{Collected, Correlations, Covariance};
use crate::fit::uncertainty::noise::Noise;
use crate::fit::uncertainty::statistics::Statistics;
use crate::fit::{
    ActiveConstraint, Alternation, Errors, InfluentialRows, OrientationErrors, Outlier,
    PointSpread, PriorComparison, PriorSize, ShadowPrice, SolverChoice, Strategy,
};
use crate::least_squares::solver::{AtBound, Termination};
use crate::least_squares::{Identifiability, UnidentifiableCombination};
use crate::measurement::StartTimes;
use crate::model::parameter::Parameter;
use crate::quantity::Unit;

/// Smallest absolute correlation at which a pair of parameters is reported. In units of σ, the
/// variances of sum and difference then differ at least by a factor of 19.
pub const STRONG_CORRELATION: f64 = 0.9;
/// Largest identified share, 0…1, at which the data do not determine a parameter, so that it has no
/// standard error.
const MAX_UNIDENTIFIED_SHARE: f64 = 1e-6;

/// Free parameter of the problem after a fit; SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Name of the parameter as in the problem file, such as `joint2.stiffness`.
    pub name: String,
    /// Kind of quantity, which determines the SI unit of the values.
    pub unit: Unit,
    /// Nominal value, in the SI unit of the parameter.
    pub nominal: f64,
    /// Estimated value, in the SI unit of the parameter.
    pub estimate: f64,
    /// Standard error of the value, SI. `None` if it was not fitted, rests on a bound, belongs to
    /// an undetermined combination, or if the data do not determine it.
    pub std_error: Option<f64>,
    /// Bound at which the value lies; `None` if it is inside its bounds.
    pub at_bound: Option<AtBound>,
    /// Shadow price of the bound at which the value lies; `None` if the value is inside its bounds.
    #[doc(hidden)]
    pub shadow_price: Option<ShadowPrice>,
    /// Identified share: the part of the value that the data determine, 0…1. The rest comes from
    /// the prior, a bound, or the start of the fit along unidentifiable combinations.
    pub identified: f64,
    /// True if the strategy varied the parameter.
    pub fitted: bool,
    /// Standard deviation (1 σ) of the declared prior of the deviation, SI or of the logarithm;
    /// `None` without a prior.
    #[doc(hidden)]
    pub prior_sigma: Option<f64>,
}

/// Identified arm: estimates with their uncertainty, errors, and the findings of the checks.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Identification {
    /// Strategy of the fit: which parameters are fitted together, in which order.
    pub strategy: Strategy,
    /// Solver that was used; never `Auto`.
    pub solver: SolverChoice,
    /// Reason for the choice of the solver; `None` if the caller chose it.
    pub solver_reason: Option<&'static str>,
    /// Reason why the last least-squares fit stopped.
    pub termination: Termination,
    /// Effect with which the model fits the table as it was read. `None` unless the checks found
    /// that the table was misread, and an effect expresses the mistake.
    pub(crate) misread: Option<MisreadEffect>,
    /// Findings of the checks, errors first; a provisional fit is only checked for convergence.
    pub findings: Vec<Finding>,
    /// Number of different poses of the arm that were fitted; several targets in one pose count
    /// once.
    pub poses: usize,
    /// True if several targets, or several quantities such as the points of an image, are measured
    /// in one pose of the arm.
    pub several_targets: bool,
    /// Number of steps that were tried, over all stages.
    pub iterations: u64,
    /// Number of evaluations of the residual, with or without derivatives, over all stages.
    pub evaluations: u64,
    /// Convergence of the alternating stages of [`Strategy::Sequential`]; `None` for others.
    #[doc(hidden)]
    pub alternation: Option<Alternation>,
    /// Duration of the identification \[s\].
    pub seconds: f64,
    /// Source of the σ of the measurements.
    #[doc(hidden)]
    pub noise: Noise,
    /// Errors of the registered nominal arm, with base and target fitted if they are free.
    pub registered: Errors,
    /// Errors of the identified arm.
    pub fitted: Errors,
    /// Errors measured − predicted of the identification rows \[m\], each predicted by a fit
    /// without its configuration; empty unless the problem holds out no row.
    pub(crate) left_out: Vec<Vector3<f64>>,
    /// Errors of the registered nominal arm and of the identified arm, for each kind of rows. Empty
    /// if there is only one kind.
    pub kinds: Vec<(Errors, Errors)>,
    /// Scatter of the predicted target at each touched point: with the registered nominal arm and
    /// with the identified arm. The flag is true if all rows of the point are held out.
    #[doc(hidden)]
    pub spreads: Vec<(PointSpread, PointSpread, bool)>,
    /// Errors of orientation; `None` if orientation is not fitted.
    #[doc(hidden)]
    pub orientation: Option<OrientationErrors>,
    /// Reduced χ² (χ² over its degrees of freedom) of the identification data; `None` without
    /// degrees of freedom or with estimated noise. A robust loss excludes outliers.
    pub reduced_chi2: Option<f64>,
    /// Interval in which `reduced_chi2` lies with probability 0.999 if the residual is only noise;
    /// `None` if `reduced_chi2` is `None`.
    pub chance: Option<(f64, f64)>,
    /// Noise variance that the fit assumed, relative to the declared one; 1 unless residuals and
    /// priors contradict the declared σ.
    pub noise_factor: f64,
    /// Standard deviation (1 σ) of a measured coordinate that the fit assumed \[m\] (of a tilt
    /// \[rad\]): root mean square over the identification rows of the leading kind (positions, if
    /// there are any).
    pub sigma_taken: f64,
    /// Factor below 1 by which the fit multiplied declared σ that are too large; 1 if it did not
    /// reduce them.
    pub sigma_scale: f64,
    /// Combinations of `unknowns` that the data determine too weakly, which keep their start
    /// values. Weights are in units of the arm's reach for lengths, 1 rad for angles and a factor
    /// of 100 for stiffnesses. The singular value is the change of all data along the combination
    /// \[σ\].
    pub weak: Vec<UnidentifiableCombination>,
    /// Number of measured coordinates that were fitted.
    pub coordinates: usize,
    /// Names of the fitted parameters, in the order of [`Identification::identifiability`].
    pub unknowns: Vec<String>,
    /// Triangular factor of the whitened Jacobian, without priors, at the registered nominal arm,
    /// the column of each unknown in it, and its identifiability analysis, computed on first use.
    pub(super) whitened_triangle: (DMatrix<f64>, Vec<usize>, OnceLock<Identifiability>),
    /// True if the fit is provisional: another one follows, so the identifiability and most checks
    /// are left out.
    pub(crate) provisional: bool,
    /// Noise models of positions and of orientations that the fit assumed.
    pub(super) noise_models: (NoiseModel, NoiseModel),
    /// Estimates of every free parameter, in the order of the model.
    pub estimates: Vec<Estimate>,
    /// Covariance of the estimates \[product of their SI units\].
    pub covariance: Covariance,
    /// Prior widths that the fitted deviations contradict; empty for a provisional fit.
    #[doc(hidden)]
    pub prior_sizes: Vec<PriorSize>,
    /// Constraints that are active (at a limit) in the fit, in the order of the file.
    #[doc(hidden)]
    pub active_constraints: Vec<ActiveConstraint>,
    /// Identification rows whose residual is too large to be noise, in the order of the rows.
    pub outliers: Vec<Outlier>,
    /// Held-out rows whose prediction error is too large for its uncertainty, in the order of the
    /// rows.
    pub held_out_outliers: Vec<Outlier>,
    /// All held-out rows, from whose distances the outliers follow.
    pub(crate) held_out_rows: Vec<Outlier>,
    /// Rows whose removal removes most of the misfit, if a few do. Searched for if
    /// [`Options::with_influential_rows`](crate::fit::Options::with_influential_rows) requests it,
    /// but not with a robust loss.
    #[doc(hidden)]
    pub influential_rows: Option<InfluentialRows>,
    /// Full parameter vector of the identified arm: the deviation of each parameter from nominal.
    pub x: DVector<f64>,
    /// Full parameter vector of the registered nominal arm, whose errors are `registered`.
    pub registered_x: DVector<f64>,
    /// Parts that are free and were therefore fitted in the registered nominal arm: "base", "tool",
    /// "fixtures".
    pub(crate) registered_parts: Vec<&'static str>,
    /// Comparison with the earlier estimate that was the prior; `None` without one.
    pub(crate) prior: Option<PriorComparison>,
    /// Digests of the identification rows; empty for a provisional fit.
    pub(crate) fitted_rows: Vec<String>,
    /// Start time of each session, relative to which time-dependent terms are evaluated.
    pub(crate) start_times: StartTimes,
    /// True if the rows have directions of approach.
    pub(crate) has_approach: bool,
    /// Standard deviation (1 σ) of a coordinate in rows that state none, declared or estimated
    /// \[m\].
    pub sigma: f64,
}

impl Identification {
    /// Returns true if no finding is an error.
    pub fn is_trusted(&self) -> bool {
        self.first_error().is_none()
    }

    /// Returns true if the residual exceeds the declared σ by about the factor between two units.
    #[doc(hidden)]
    pub fn doubts_unit_of_sigma(&self) -> bool {
        self.has(FindingCode::NoiseBeyondDeclared)
            && UNIT_RATIOS.contains(&self.noise_factor.sqrt())
    }

    /// Returns true if the fit describes the measured arm well enough to search for effects. No
    /// finding may be an error, except one about a residual beyond the declared noise.
    pub(crate) fn describes_arm(&self) -> bool {
        let is_noise = |finding: &Finding| finding.code == FindingCode::NoiseBeyondDeclared;
        let mut findings = self.findings.iter();
        findings.all(|finding| finding.severity() != Severity::Error || is_noise(finding))
    }

    /// Returns the first finding that is an error, which is the reason not to trust the fit; `None`
    /// if the fit is to be trusted.
    #[doc(hidden)]
    pub fn first_error(&self) -> Option<&Finding> {
        self.findings.iter().find(|finding| finding.severity() == Severity::Error)
    }

    /// Returns true if a finding names a mistake of the input.
    pub(crate) fn names_mistake(&self) -> bool {
        MISTAKES.iter().any(|code| self.has(*code))
    }

    /// Returns true if another finding names a mistake of the input from which this one follows.
    #[doc(hidden)]
    pub fn is_consequence(&self, finding: &Finding) -> bool {
        self.names_mistake() && CONSEQUENCES.contains(&finding.code)
    }

    /// Returns the first finding with the code `code`; `None` if no check reported it.
    pub fn finding(&self, code: FindingCode) -> Option<&Finding> {
        self.findings.iter().find(|finding| finding.code == code)
    }

    /// Returns true if a finding has this code.
    pub fn has(&self, code: FindingCode) -> bool {
        self.finding(code).is_some()
    }

    /// States that held-out rows contradict the error bounds of predictions; `None` if they do not.
    #[doc(hidden)]
    pub fn doubted_bounds(&self) -> Option<String> {
        let findings = self.findings.iter();
        doubted_bounds(findings.map(|finding| (finding.code.entry().code, finding.text.as_str())))
    }

    /// Returns the findings that are warnings, except those for which reports have a section.
    pub fn cautions(&self) -> impl Iterator<Item = &Finding> {
        let has_section =
            |code| matches!(code, FindingCode::InfluentialRows | FindingCode::UnsteadyPoint);
        self.findings
            .iter()
            .filter(move |it| it.severity() == Severity::Warning && !has_section(it.code))
    }

    /// Returns the identifiability of the fitted parameters at the registered nominal arm; it is
    /// computed on the first call.
    pub fn identifiability(&self) -> &Identifiability {
        let (triangle, columns, found) = &self.whitened_triangle;
        found.get_or_init(|| Identifiability::in_order(triangle, columns))
    }

    /// Returns the texts of the findings in [`cautions`](Self::cautions), with their remedies.
    #[doc(hidden)]
    pub fn reasons_to_ask(&self) -> Vec<String> {
        self.cautions().map(ToString::to_string).collect()
    }

    /// Returns the estimate of a parameter by its name, such as `joint2.stiffness`; `None` if no
    /// parameter has this name.
    pub fn estimate(&self, name: &str) -> Option<&Estimate> {
        self.estimates.iter().find(|estimate| estimate.name == name)
    }

    /// Returns the pairs of [`correlations`](Self::correlations) whose absolute value is at least
    /// [`STRONG_CORRELATION`], strongest first.
    #[doc(hidden)]
    pub fn strong_correlations(&self) -> Vec<(String, String, f64)> {
        let correlations = self.correlations();
        correlations
            .above(STRONG_CORRELATION)
            .into_iter()
            .map(|(a, b, rho)| (a.to_owned(), b.to_owned(), rho))
            .collect()
    }

    /// Returns the correlations of the parameters that were fitted together to the identification
    /// rows and have a variance.
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
    /// Creates the estimate of a parameter that no stage varied, at its nominal value. If
    /// `time_measured` is false, speeds are per row instead of per second.
    pub(super) fn unfitted(parameter: &Parameter, time_measured: bool) -> Self {
        let unit = parameter.unit();
        let unit = if time_measured { unit } else { unit.per_row() };
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
            prior_sigma: parameter.sigma,
        }
    }
}

/// Writes the values of a stage's unknowns at its `end` into `estimates`, with their standard
/// errors, bounds and identified shares, and their covariance into `covariance`.
pub(super) fn enter(
    (estimates, covariance): (&mut [Estimate], &mut Collected),
    stage: &Stage,
    end: &FitEnd,
    statistics: &Statistics,
) {
    covariance.enter(stage.model, &stage.unknowns, end.x.as_slice(), &statistics.covariance);
    for (j, (&k, parameter)) in stage.unknowns.iter().zip(stage.parameters()).enumerate() {
        let x = end.x[k];
        let learned = statistics.determined[j] && statistics.identified[j] > MAX_UNIDENTIFIED_SHARE;
        let estimate = &mut estimates[k];
        estimate.estimate = parameter.value(x);
        estimate.std_error = learned.then(|| parameter.value_error(x, statistics.errors[j]));
        estimate.at_bound = end.at_bound[j];
        estimate.shadow_price = statistics.prices.bounds[j];
        estimate.identified = statistics.identified[j];
        estimate.fitted = true;
    }
}
