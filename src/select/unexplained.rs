//! Structure without a law: its site, the quantities on which it depends, and the gain of an
//! empirical correction.

use crate::select::settings::MAX_CORRECTED_ERROR;
use nalgebra::DVector;

use super::data::Data;
use super::evidence::{
    Claims, Evidence, Hypotheses, Hypothesis, HypothesisKind, HypothesisSet, Site, best_form,
    odds_against,
};
use super::fitted::Fitted;
use crate::fit::ErrorSummary;
use crate::quantity::Unit;
use crate::residual_tests::Covariate;
use crate::residual_tests::ResidualTests;

/// Structure in the residual that no effect explains.
#[derive(Debug, Clone)]
pub struct Unexplained {
    /// Part of the arm or measurement at which the structure arises; `None` if unknown.
    pub site: Option<Site>,
    /// Quantities on which the structure depends.
    pub depends_on: Vec<Covariate>,
    /// Upper limit of the probability that noise alone causes the structure, for all hypotheses
    /// together.
    pub p_value: f64,
    /// Claims with their probabilities; `None` if only the residual tests detect the structure.
    pub claims: Option<Claims>,
    /// Empirical correction, computed for the most probable structure only. `None` if it reduces
    /// the error of left-out poses by less than 5 %, if no poses are held out, or if the fit has
    /// cautions.
    pub correction: Option<Correction>,
}

/// Smooth empirical correction of an error at one site, as a function of the quantities on which it
/// depends.
#[derive(Debug, Clone)]
pub struct Correction {
    /// Range of each covariate over the identification poses, in the covariate's unit. Beyond it
    /// the correction is constant.
    pub ranges: Vec<(Covariate, (f64, f64))>,
    /// Number of held-out poses at which a covariate is outside its identification range.
    pub beyond: usize,
    /// Root mean squared error of identification poses that are left out of the fit in ten blocks,
    /// without and with the correction \[m\].
    pub cross_validated: (f64, f64),
    /// Error on held-out poses with the correction.
    pub held_out: ErrorSummary,
    /// Curve of the correction; `None` unless it is a function of one covariate at one coordinate.
    pub curve: Option<Curve>,
}

/// Correction as a function of one covariate, with partial residuals.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Quantity on which the correction depends, the abscissa of the curve.
    pub covariate: Covariate,
    /// Unit of the corrected coordinate: an angle or a length.
    pub unit: Unit,
    /// Correction and partial residual of each identification pose, in the order of the rows.
    pub points: Vec<PartialResidual>,
}

/// Partial residual of one pose: the correction there plus the coordinate error that the corrected
/// fit leaves.
///
/// f(x) + l·r / |l|² with the pose's lever l = ∂p/∂(coordinate) and its residual r after the
/// corrected fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartialResidual {
    /// Value of the covariate of this pose, SI; temperatures in °C.
    pub covariate: f64,
    /// Value at the pose of the correction that the fit found for the coordinate \[rad\] or \[m\].
    pub correction: f64,
    /// Error of the coordinate that the pose alone indicates \[rad\] or \[m\].
    pub value: f64,
    /// Length |l| of the lever \[m/rad\] or \[m/m\]. Poses with a short lever determine the
    /// coordinate poorly.
    pub lever: f64,
}

/// Returns the structure without a law, the most probable first; the first one has its correction.
///
/// All functions of the best set are reported if at least as many hypotheses as it has act with
/// probability `located`. Otherwise those are reported at whose site a function acts with that
/// probability, one for each site.
pub(super) fn without_law(
    fitted: &Fitted,
    data: &Data,
    (evidence, best): (&Evidence, &HypothesisSet),
) -> Vec<Unexplained> {
    let mut listed: Vec<(&Hypothesis, Unexplained)> = Vec::new();
    let are_all_sure = evidence.probability_of_as_many(best) >= data.rules.located;
    for hypothesis in best.hypotheses.iter().filter(|hypothesis| hypothesis.effect().is_none()) {
        let claims = evidence.claims(hypothesis).with_neighbours(&fitted.problem);
        let is_site_listed = listed.iter().any(|(other, _)| other.site == hypothesis.site);
        if !are_all_sure && (claims.law.1 < data.rules.located || is_site_listed) {
            continue;
        }
        let found = Unexplained {
            site: Some(claims.place.0),
            depends_on: hypothesis.depends_on.clone(),
            p_value: evidence.p_value_limit(best).min(odds_against(claims.law.1)),
            claims: Some(claims),
            correction: None,
        };
        listed.push((hypothesis, found));
    }
    let place = |found: &Unexplained| found.claims.as_ref().map_or(0.0, |claims| claims.place.1);
    listed.sort_by(|a, b| place(&b.1).total_cmp(&place(&a.1)));
    // Neither an error with a free value per pose nor a wrong limit has a correction: the former
    // cannot be predicted, the latter is no function.
    let first = listed.iter().position(|(hypothesis, _)| {
        !matches!(hypothesis.kind, HypothesisKind::PerPose | HypothesisKind::Limit(_))
    });
    if let Some(first) = first.filter(|_| fitted.found.describes_arm()) {
        let hypothesis = listed[first].0.clone();
        listed[first].1.correction = correction(fitted, data, best, &hypothesis);
    }
    listed.into_iter().map(|(_, found)| found).collect()
}

/// Returns the structure that the residual tests detect, with unknown site and the quantity of the
/// test with the smallest p-value; `None` if no test detects structure.
pub(super) fn unlocated(tests: &ResidualTests) -> Option<Unexplained> {
    if !tests.is_structured() {
        return None;
    }
    let strongest = tests.strongest()?;
    Some(Unexplained {
        site: None,
        depends_on: strongest.about().into_iter().collect(),
        p_value: strongest.outcome.as_ref().map_or(1.0, |outcome| outcome.p_value),
        claims: None,
        correction: None,
    })
}

/// Returns the correction by the most probable function of a hypothesis, and its errors on the
/// held-out poses. `None` without such poses, or if it improves the prediction of left-out poses
/// too little.
fn correction(
    fitted: &Fitted,
    data: &Data,
    best: &HypothesisSet,
    hypothesis: &Hypothesis,
) -> Option<Correction> {
    // The peak of a narrow function may have been treated as outliers. Predictions of left-out
    // poses distinguish the two.
    let may_hide_peak = fitted.problem.robust.is_none() && !fitted.set_aside.is_empty();
    let with_all_rows = may_hide_peak.then(|| fitted.with_outliers(Vec::new()));
    let fitted = with_all_rows.as_ref().unwrap_or(fitted);
    let (here, there) = (data.rows(), &data.split.held_out);
    if there.is_empty() {
        return None;
    }
    let evidence_rows = data.evidence_rows();
    let few = Hypotheses::only(fitted, data, &evidence_rows, evidence_rows.len(), hypothesis);
    let (shape, sigma) = best_form(fitted, data, &few, best, hypothesis)?;
    let rows = [here, there.as_slice()].concat();
    let hypotheses = Hypotheses::only(fitted, data, &rows, here.len(), hypothesis);
    let function_columns = hypotheses.form(best, hypothesis, (shape, here.len()))?;
    let linearised = fitted.linearised(data, &[]);
    let fit = fitted.neighbourhood_at_rows(data);
    let first = 3 * here.len();
    let (function_columns, beyond) =
        (function_columns.rows(0, first).into_owned(), function_columns.rows_range(first..));
    let with = fit.with_priors(&function_columns, sigma);
    let rms = |squares: f64| (3.0 * squares / fit.rows() as f64).sqrt() * fitted.sigma;
    let (without, corrected) =
        fit.cross_validate(&data.block).zip(with.cross_validate(&data.block))?;
    let cross_validated = (rms(without), rms(corrected));
    if cross_validated.1 >= MAX_CORRECTED_ERROR * cross_validated.0 {
        return None;
    }
    let step = with.step();
    let (parameters, coefficients) = (
        step.rows(0, step.len() - function_columns.ncols()),
        step.rows_range(step.len() - function_columns.ncols()..),
    );
    let held_out = fitted.linearised_at(data, there, &[]);
    let moved = held_out.fitted() * parameters + beyond * coefficients;
    let reached = hypotheses.is_in_range(hypothesis, here.len());
    let mut errors = fitted.errors(data, there);
    // The change of the parameters that were fitted with the function applies to all poses. Outside
    // its range the function keeps its value at the end.
    for (pose, error) in errors.iter_mut().enumerate() {
        *error += moved.fixed_rows::<3>(3 * pose) * held_out.poses()[pose].sigma;
    }
    let function = function_columns * coefficients;
    let remaining = linearised.residual() + linearised.fitted() * parameters + &function;
    Some(Correction {
        ranges: hypotheses.ranges(hypothesis),
        beyond: reached.iter().filter(|reached| !**reached).count(),
        cross_validated,
        held_out: ErrorSummary::of_rows(data.measurements, there.iter().copied(), &errors),
        curve: curve(&hypotheses, hypothesis, (&function, &remaining)),
    })
}

/// Returns a correction as a function of one covariate, from its part of the residual (`function`)
/// and the remaining residual (`remaining`), both in units of σ. `None` if the hypothesis
/// depends on more than one covariate.
fn curve(
    hypotheses: &Hypotheses,
    hypothesis: &Hypothesis,
    (function, remaining): (&DVector<f64>, &DVector<f64>),
) -> Option<Curve> {
    let (covariate, site, values, lever) = hypotheses.coordinate(hypothesis)?;
    let point = |(pose, &value): (usize, &f64)| {
        // All vectors are in units of σ. The residual is measured − predicted, so the lever is
        // −∂r/∂(coordinate).
        let at = |column: &DVector<f64>| column.fixed_rows::<3>(3 * pose).into_owned();
        let (lever, function, remaining) = (-at(&lever), -at(function), at(remaining));
        let correction = lever.dot(&function) / lever.norm_squared();
        PartialResidual {
            covariate: value,
            correction,
            value: correction + lever.dot(&remaining) / lever.norm_squared(),
            lever: lever.norm() * hypotheses.linearised.poses()[pose].sigma,
        }
    };
    let points = values.iter().take(remaining.len() / 3).enumerate().map(point).collect();
    Some(Curve { covariate, unit: site.unit(), points })
}
