//! Check whether all lengths of the fitted arm deviate from nominal by one common factor.

use nalgebra::{DMatrix, DVector, Vector3};
use serde_json::json;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use super::misfit::misfit;
use super::parameter_limits::MAX_PRIOR_SIGMAS;
use crate::model::parameter::{Parameter, ParameterSite};
use crate::problem::{KnownDistance, Observation};
use crate::quantity::Unit;

/// Smallest relative error of the scale that is reported. Instruments and thermal expansion are
/// wrong by less (23 ppm/K for aluminium), and effects of the catalogue describe these.
pub(super) const MIN_SCALE_ERROR: f64 = 3e-3;
/// Smallest score, in standard deviations, that the lengths without the most informative one
/// support. A single wrong length is no common factor.
const MIN_SIGMAS_OF_OTHERS: f64 = 3.0;

/// Relative error of the scale above which no instrument and no temperature is its cause. For such
/// an error, a wrong unit, scale factor or joint table is likely beforehand, so that smaller scores
/// count: [`MIN_GROSS_SIGMAS`] of all lengths and [`MIN_GROSS_SIGMAS_OF_OTHERS`] of the lengths
/// without the most informative one.
const MIN_GROSS_ERROR: f64 = 1e-2;
const MIN_GROSS_SIGMAS: f64 = 3.5;
const MIN_GROSS_SIGMAS_OF_OTHERS: f64 = 2.5;

/// Largest scatter of the lengths about the common factor, beyond that of their priors and relative
/// to what the factor explains, at which they deviate in proportion.
const MAX_UNEXPLAINED: f64 = 0.1;

/// Checks that the lengths of the arm do not deviate from nominal by one common factor, as they do
/// if the lengths that scale the measurements are wrong.
pub(super) fn scale_holds(fit: &CheckedFit) -> Option<Finding> {
    let found = CommonFactor::of(fit).filter(CommonFactor::is_clear)?;
    // A fit that is far off says nothing about a scale.
    if !misfit(fit).is_empty() {
        return None;
    }
    let CommonFactor { error, score, lengths, .. } = found;
    let side = if error > 0.0 { "longer" } else { "shorter" };
    let sigmas = score.abs();
    let text = format!(
        "a common factor of {:.4} explains the {lengths} fitted lengths of the arm: they are \
         {:.2} % {side} than declared, {sigmas:.1} σ beyond what their priors allow",
        1.0 + error,
        100.0 * error.abs()
    );
    let numbers = [error.into(), sigmas.into(), json!(lengths)];
    let finding = Finding::new(FindingCode::ScaleContradicted, numbers, text);
    Some(finding.with_remedy(remedy(fit, 1.0 + error)))
}

/// Smallest common relative deviation of the lengths at which the arm may be one of another size of
/// its series. Instruments err by less.
const MIN_VARIANT_ERROR: f64 = 0.03;

/// Returns the remedy for lengths that are all `factor` times the declared ones.
fn remedy(fit: &CheckedFit, factor: f64) -> String {
    let leading = fit.table().leading();
    let arm = "or the lengths of the joint table and their priors";
    if leading.kind() == Observation::Pixel(0, 0, 0).kind() {
        let marker = leading.fixtures()[1];
        let print = marker.and_then(|marker| spacing(fit.model().marker_points(marker)));
        let print = print.map_or_else(String::new, |spacing| {
            format!(
                " (measure the print: points 0 and 1 are declared {:.3} mm apart, the declared \
                 lengths of the arm say {:.3} mm)",
                spacing * 1e3,
                spacing * 1e3 / factor
            )
        });
        return format!(
            "check the points of the marker, from which all lengths follow{print}, {arm}"
        );
    }
    let lengths = |distance: &KnownDistance| {
        let name = |point: usize| fit.problem.fixtures.get(point).map_or("", |of| of.name.as_str());
        let [from, to] = distance.between.map(name);
        format!(
            "\"{from}\" to \"{to}\" is declared {:.3} mm, the declared lengths of the arm say \
             {:.3} mm",
            distance.length * 1e3,
            distance.length * 1e3 / factor
        )
    };
    match fit.problem.distances.first() {
        Some(distance) if !leading.is_position() => {
            format!(
                "check [[distance]], from which all lengths follow ({}), {arm}",
                lengths(distance)
            )
        }
        _ => format!(
            "check the scale of the measurements (unit, scale factor of the instrument){}, {arm}",
            if (factor - 1.0).abs() > MIN_VARIANT_ERROR {
                ", whether the joint table or the URDF is of another size of this arm"
            } else {
                ""
            }
        ),
    }
}

/// Returns the distance between the first two points of a marker \[m\]; `None` with fewer points.
fn spacing(points: &[Vector3<f64>]) -> Option<f64> {
    Some((points.get(1)? - points.first()?).norm())
}

/// Common factor of the lengths of the arm, estimated from their fitted deviations and priors.
///
/// Score test of s in the prior mean s L of the deviations x, whose prior covariance is Σ = diag σ²
/// and whose posterior covariance is C: g = Lᵀ Σ⁻¹ x, I = Lᵀ Σ⁻¹ (Σ − C) Σ⁻¹ L, ŝ = g / I, and
/// g / √I is standard normal if the priors hold. Lengths that the data do not determine, for which
/// C = Σ, do not count.
struct CommonFactor {
    /// Relative deviation ŝ of all lengths from nominal.
    error: f64,
    /// Score g / √I in standard deviations, divided by the scatter of the lengths about the common
    /// factor if this exceeds their priors.
    score: f64,
    /// Score of the lengths without the most informative one.
    others: f64,
    /// Scatter of the deviations about the common factor, relative to what the factor explains;
    /// both are sums of squares in units of the priors.
    unexplained: f64,
    /// Number of lengths.
    lengths: usize,
}

impl CommonFactor {
    /// Estimates the factor; `None` with fewer than two lengths that the data determine.
    fn of(fit: &CheckedFit) -> Option<Self> {
        let parameters = &fit.model().parameters;
        let later = &fit.fitting.held_out_only.parameters;
        let is_length = |parameter: &Parameter| {
            matches!(parameter.site, ParameterSite::Joint { field, .. } if field.is_geometry())
                && parameter.unit() == Unit::Length
                && parameter.nominal != 0.0
                && parameter.regressor.is_constant()
        };
        let unknowns = fit.whole.unknowns.iter().enumerate();
        let lengths: Vec<(usize, usize, f64)> = unknowns
            .filter(|&(_, &k)| is_length(&parameters[k]) && !later[k])
            .filter(|&(place, _)| fit.covariance[(place, place)] > 0.0)
            .filter_map(|(place, &k)| Some((place, k, parameters[k].sigma?)))
            .collect();
        let n = lengths.len();
        let sigma = DVector::from_iterator(n, lengths.iter().map(|(.., sigma)| *sigma));
        let of_length = |value: &dyn Fn(usize) -> f64| {
            DVector::from_iterator(n, lengths.iter().map(|&(_, k, sigma)| value(k) / sigma))
        };
        let (deviations, nominal) =
            (of_length(&|k| fit.end.x[k]), of_length(&|k| parameters[k].nominal));
        // I − Σ^(-1/2) C Σ^(-1/2): share of each whitened length that the data determine.
        let posterior = DMatrix::from_fn(n, n, |row, column| {
            let covariance = fit.covariance[(lengths[row].0, lengths[column].0)];
            covariance / (sigma[row] * sigma[column])
        });
        let determined = DMatrix::identity(n, n) - posterior;
        let score_of = |nominal: &DVector<f64>| {
            let information = nominal.dot(&(&determined * nominal));
            (nominal.dot(&deviations) / information, information)
        };
        let (error, information) = score_of(&nominal);
        let freedom = determined.trace() - 1.0;
        if !(information > 0.0 && freedom > 0.5) {
            return None;
        }
        let explained = error * (&determined * &nominal);
        let rest = (&deviations - &explained).norm_squared();
        // The usual scatter within the priors, up to two of its standard deviations, is no
        // objection.
        let usual = freedom + 2.0 * (2.0 * freedom).sqrt();
        let unexplained = (rest - usual).max(0.0) / explained.norm_squared();
        let scatter = (rest / freedom).max(1.0).sqrt();
        let mut others = nominal.clone();
        others[nominal.iamax()] = 0.0;
        let (error_of_others, of_others) = score_of(&others);
        let others = error_of_others * of_others.max(0.0).sqrt() / scatter;
        let score = error * information.sqrt() / scatter;
        Some(Self { error, score, others, unexplained, lengths: n })
    }

    /// Returns true if the factor is far beyond what the priors allow, more than one length
    /// supports it, and the lengths deviate in proportion.
    fn is_clear(&self) -> bool {
        let (least, of_others) = if self.error.abs() > MIN_GROSS_ERROR {
            (MIN_GROSS_SIGMAS, MIN_GROSS_SIGMAS_OF_OTHERS)
        } else {
            (MAX_PRIOR_SIGMAS, MIN_SIGMAS_OF_OTHERS)
        };
        self.error.abs() > MIN_SCALE_ERROR
            && self.score.abs() > least
            && self.others * self.error.signum() > of_others
            && self.unexplained < MAX_UNEXPLAINED
    }
}
