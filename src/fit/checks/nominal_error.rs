//! Check of the nominal arm: an error comparable to the measured workspace indicates a misread
//! input.

use std::collections::BTreeMap;

use serde_json::json;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use super::misreading::{Explanations, Misreading, first_of, is_of_views};
use super::row_kind::{RowKind, format_error, quantity_noun, suspects};
use crate::model::parameter::ParameterSite;

/// Largest error of the registered nominal arm (rms, or median of images), relative to the spread of
/// the measurements, that is not reported.
pub(super) const MAX_NOMINAL_MISS: f64 = 0.1;
/// Largest rms error of the nominal arm with a misreading corrected, relative to the spread of the
/// measurements, at which the misreading explains its error: nominal arms are wrong by about as
/// much.
const MAX_EXPLAINED_MISS: f64 = 0.02;
/// Largest ratio that is stated in per cent.
const MAX_PERCENTAGE: f64 = 2.0;
/// Smallest spread of the predicted targets of contacts, relative to the arm's reach, with which
/// the error is compared. If it is smaller, all contacts are at one place, and the spread is only
/// the arm's error.
const MIN_RELATIVE_SPREAD: f64 = 0.05;

/// Largest relative difference of the ratios of fitted to declared focal lengths and image centres
/// at which the images have another size than declared.
const MAX_SIZE_DIFFERENCE: f64 = 0.05;
/// Smallest difference from 1 of these ratios at which the images have another size.
const MIN_SIZE_ERROR: f64 = 0.1;

/// Returns the error of the registered nominal arm in rows of the leading kind (positions, if there
/// are any): the rms error, or the median error of images, because a view from near may have errors
/// far above those of all others.
fn nominal_miss(fit: &CheckedFit) -> f64 {
    if is_of_views(fit.table()) {
        fit.fitting.typical_error(fit.registered_x)
    } else {
        fit.registered.identification.rms.norm
    }
}

/// Returns true if the error of the registered nominal arm in rows of the leading kind exceeds
/// [`MAX_NOMINAL_MISS`] times their spread.
pub(super) fn is_nominal_far_off(fit: &CheckedFit) -> bool {
    let rms = nominal_miss(fit);
    let RowKind { observation, spread, .. } = fit.leading();
    let is_measured_directly = observation.is_measured_directly();
    let min_spread =
        if is_measured_directly { 0.0 } else { MIN_RELATIVE_SPREAD * fit.model().reach() };
    spread > min_spread && rms > MAX_NOMINAL_MISS * spread
}

impl CheckedFit<'_> {
    /// Returns true if a parameter of one of some sites is free.
    pub fn frees(&self, is_meant: impl Fn(ParameterSite) -> bool) -> bool {
        self.fitting.model.parameters.iter().any(|parameter| is_meant(parameter.site))
    }

    /// Returns true if a coordinate of the base with the index `base` is a free parameter.
    pub fn frees_base(&self, base: usize) -> bool {
        self.frees(|site| matches!(site, ParameterSite::Base { base: of, .. } if of == base))
    }

    /// Returns true if a coordinate of a base is a free parameter.
    pub fn is_base_free(&self) -> bool {
        self.frees(|site| matches!(site, ParameterSite::Base { .. }))
    }

    /// Returns true if no coordinate of one of the bases is a free parameter.
    pub fn is_a_base_held(&self) -> bool {
        !(0..self.fitting.placement.bases.len()).all(|base| self.frees_base(base))
    }

    /// Returns true if no coordinate of a target is a free parameter.
    pub fn is_target_held(&self) -> bool {
        !self.frees(|site| matches!(site, ParameterSite::Target { .. }))
    }
}

/// Checks that the error of the registered nominal arm is small relative to the spread of the
/// measurements.
pub(super) fn nominal_is_near(fit: &CheckedFit) -> Option<Finding> {
    if !is_nominal_far_off(fit) {
        return None;
    }
    let rms = nominal_miss(fit);
    let RowKind { observation, spread, .. } = fit.leading();
    let kind = observation.kind();
    let Explanations { near, near_error, .. } = fit.explanations();
    let explanations = (&near[..], *near_error);
    let finding = far_off_finding(kind, (rms, spread), fit.is_base_free(), explanations);
    Some(finding.with_remedy_of(image_size(fit).filter(|_| near.is_empty())))
}

/// Returns the remedy for a camera whose focal lengths and image centre are all fitted at one
/// multiple of the declared ones, which were those of images of another size; `None` if there is no
/// such camera.
fn image_size(fit: &CheckedFit) -> Option<String> {
    let mut ratios: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for (parameter, x) in fit.model().parameters.iter().zip(&fit.end.x) {
        if let ParameterSite::Fixture { fixture, axis: 6..=9, .. } = parameter.site {
            ratios.entry(fixture).or_default().push(1.0 + x / parameter.nominal);
        }
    }
    let of_camera = |(fixture, ratios): (&usize, &Vec<f64>)| {
        let ratio = ratios.iter().sum::<f64>() / ratios.len() as f64;
        let is_alike = |other: &f64| (other / ratio - 1.0).abs() < MAX_SIZE_DIFFERENCE;
        let is_other = ratios.len() == 4 && (ratio - 1.0).abs() > MIN_SIZE_ERROR;
        (is_other && ratios.iter().all(is_alike)).then(|| {
            let name = fit.model().fixture_name(*fixture);
            format!(
                "fx, fy, cx and cy of camera \"{name}\" are {ratio:.2} of the declared ones: the \
                 images have another size than those that focal_px and centre_px are of; correct \
                 these and image_px"
            )
        })
    };
    ratios.iter().find_map(of_camera)
}

/// Creates the finding that the rms error `rms` of the nominal arm is large relative to the
/// `spread` of rows of a kind \[m\] or \[rad\]. Each of `explanations`, best first, would reduce
/// the error alone; `left` is what the best one leaves.
fn far_off_finding(
    kind: &str,
    (rms, spread): (f64, f64),
    is_base_free: bool,
    (explanations, left): (&[Misreading], f64),
) -> Finding {
    let words: Vec<String> = explanations.iter().map(|of| of.words.clone()).collect();
    let numbers = [kind.into(), rms.into(), spread.into(), json!(words)];
    if !rms.is_finite() {
        let text = "the nominal arm misses the measurements by more than can be computed";
        return Finding::new(FindingCode::NominalFarOff, numbers, text.to_owned())
            .with_remedy("check their units");
    }
    let (what, by, part) = (quantity_noun(kind), format_error(kind, rms, 1), rms / spread);
    let part = if part < MAX_PERCENTAGE {
        format!("{:.0} % of", 100.0 * part)
    } else {
        format!("{part:.0} times")
    };
    let standing = match kind {
        "position" if is_base_free => ", wherever its base stands",
        "position" => ", with its base where the problem holds it",
        _ => "",
    };
    let text = format!("the nominal arm misses the {what} by {by}, {part} their spread{standing}");
    let finding = Finding::new(FindingCode::NominalFarOff, numbers, text);
    match words.is_empty() {
        false if !left.is_finite() => {
            finding.with_remedy(format!("check first for {}", first_of(&words)))
        }
        false => {
            let effect = if left <= MAX_EXPLAINED_MISS * spread {
                "explain it".to_owned()
            } else {
                format!("reduce it to {}", format_error(kind, left, 1))
            };
            finding.with_remedy(format!("this would {effect}: {}", first_of(&words)))
        }
        true if kind == "position" && !is_base_free => finding.with_remedy(
            "free the base in [parameters]: \"base.*\" = { free = true }; or check units and signs of \
             joints"
                .to_owned(),
        ),
        true if kind == "position" => finding,
        true => {
            finding.with_remedy(format!("check units, signs of joints, and {}", suspects(kind)))
        }
    }
}
