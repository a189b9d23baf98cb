//! Warnings about values of the arm that are probably in another unit or convention.

use std::f64::consts::TAU;

use super::section::Section;
use super::{Body, Joint, JointKind, Problem};
use crate::error::{Location, Warning, WarningKind};
use crate::quantity::rounded_right_angle;

/// Largest plausible length in the joint table \[m\]. Longer ones are probably in millimetres.
const MAX_PLAUSIBLE_LENGTH: f64 = 20.0;
/// Largest usual limit of a joint, as a number of radians. Limits of that many degrees are suspect.
const MAX_RADIANS: f64 = TAU + 0.02;
/// Minimum number of rows in which the form of a table can be recognised.
const MIN_ROWS: usize = 3;

/// Returns warnings about a `[[joint]]`: angles that look like radians, lengths that look like
/// millimetres.
pub(super) fn joint(section: &Section<'_, '_>) -> Vec<Warning> {
    let mut warnings = Vec::new();
    for key in ["alpha_deg", "theta_deg", "beta_deg"] {
        let Some(item) = section.peek(key) else { continue };
        let angle = item
            .written_number()
            .and_then(|text| Some((text, rounded_right_angle(text)?)))
            .filter(|(_, angle)| angle.abs() <= TAU);
        if let Some((text, angle)) = angle {
            let kind = WarningKind::LooksLikeRadians {
                value: text.to_owned(),
                degrees: format!("{:.0}", angle.to_degrees()),
                radians: format!("{}_rad", key.trim_end_matches("_deg")),
            };
            warnings.push(Warning { location: item.location(), kind });
        }
    }
    for key in ["a_m", "d_m"] {
        let Some(item) = section.peek(key) else { continue };
        let length = item.number().ok().filter(|length| length.abs() > MAX_PLAUSIBLE_LENGTH);
        if let Some(length) = length {
            let millimetres = format!("{}_mm", key.trim_end_matches("_m"));
            let kind = WarningKind::LooksLikeMillimetres { value: length.to_string(), millimetres };
            warnings.push(Warning { location: item.location(), kind });
        }
    }
    warnings
}

/// Returns a warning if a joint table without the key `dh` has the zeros of a standard DH table. In
/// such a table α of the first row is not zero, and both α and a of the last row are.
pub(super) fn form(joints: &[Joint]) -> Option<Warning> {
    let (first, last) = (joints.first()?, joints.last()?);
    let is_standard = joints.len() >= MIN_ROWS
        && first.alpha != 0.0
        && (last.alpha, last.a) == (0.0, 0.0)
        && joints.iter().all(|joint| joint.kind != JointKind::Fixed && joint.beta == 0.0);
    is_standard.then(|| Warning {
        location: first.location.clone(),
        kind: WarningKind::LooksLikeStandardForm,
    })
}

/// Largest plausible mass of one body of an arm \[kg\]. The heaviest industrial arms weigh some
/// thousands of kilograms in all.
const MAX_BODY_MASS: f64 = 1000.0;
/// Largest plausible distance of a centre of mass from the frame of its joint \[m\].
const MAX_BODY_DISTANCE: f64 = 10.0;

impl Problem {
    /// Returns warnings about values of the arm that are probably in another unit or convention.
    #[doc(hidden)]
    pub fn plausibility_warnings(&self) -> Vec<Warning> {
        let warnings = self.warnings.iter().cloned();
        warnings.chain(self.far_target()).chain(self.narrow_limits()).chain(self.bodies()).collect()
    }

    /// Returns a warning for the first mass of a joint that is too heavy for an arm, and for the
    /// first one whose centre is too far away.
    fn bodies(&self) -> Vec<Warning> {
        let bodies = || {
            self.joints.iter().flat_map(|joint| joint.bodies.iter().map(move |body| (joint, body)))
        };
        let warning = |(joint, body): (&Joint, &Body), kind: WarningKind| {
            let location = Location { excerpt: None, ..joint.location.clone() };
            Warning { location: location.with_key(format!("body {}", body.name)), kind }
        };
        let heavy = bodies().find(|(_, body)| body.mass > MAX_BODY_MASS).map(|found| {
            let mass = found.1.mass.to_string();
            warning(found, WarningKind::LooksLikeGrams { mass })
        });
        let far = bodies().find(|(_, body)| body.position.norm() > MAX_BODY_DISTANCE);
        let far = far.map(|found| {
            let distance = format!("{:.3}", found.1.position.norm());
            warning(found, WarningKind::FarBody { distance })
        });
        heavy.into_iter().chain(far).collect()
    }

    /// Returns a warning if all turning joints have limits that would be usual numbers of radians.
    fn narrow_limits(&self) -> Option<Warning> {
        let turning: Vec<&Joint> =
            self.joints.iter().filter(|joint| joint.kind == JointKind::Revolute).collect();
        let widest = |joint: &&Joint| joint.limits.0.abs().max(joint.limits.1.abs());
        let widest = turning.iter().map(widest).fold(0.0, f64::max).to_degrees();
        let first = turning.first().filter(|_| turning.len() >= MIN_ROWS)?;
        (widest > 0.0 && widest <= MAX_RADIANS).then(|| Warning {
            location: first.location.clone(),
            kind: WarningKind::LimitsLookLikeRadians { widest: format!("{widest:.1}") },
        })
    }

    /// Returns a warning if a target is farther from its frame than twice the length of the arm.
    fn far_target(&self) -> Option<Warning> {
        let length = |joint: &Joint| {
            let placed = joint.placement.as_ref().map_or(0.0, |placement| placement.xyz.norm());
            let (min, max) = joint.limits;
            let travel =
                if joint.kind == JointKind::Prismatic { min.abs().max(max.abs()) } else { 0.0 };
            joint.a.hypot(joint.d) + placed + travel
        };
        let tool_location = || Location {
            line: None,
            excerpt: None,
            ..self.data.location.clone().with_key("tool.target")
        };
        let farthest = self.targets.iter().max_by(|a, b| a.at.norm().total_cmp(&b.at.norm()));
        let (location, target) = farthest.map_or_else(
            || (tool_location(), self.tool.target),
            |target| (target.location.clone(), target.at),
        );
        let (links, distance) = (self.joints.iter().map(length).sum::<f64>(), target.norm());
        let kind = WarningKind::FarTarget {
            distance: format!("{distance:.3}"),
            links: format!("{links:.3}"),
        };
        (links > 0.0 && distance > 2.0 * links).then_some(Warning { location, kind })
    }
}
