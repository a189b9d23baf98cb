//! Axes and law of the figure of an effect, which depend on the site at which the effect acts.

use nalgebra::Vector3;

use super::figure::{Quantity, is_prismatic};
use super::terms::{EffectRows, Law};
use crate::laws::Quantity as LawQuantity;
use crate::model::parameter::{ArmField, BeamField, JointField, ParameterSite};
use crate::problem::{Effect, PoseView, Problem};
use crate::quantity::Unit;
use crate::results::plots::arm::Poses;

/// Caption of a figure whose ordinate is the error of one coordinate.
pub const COORDINATE_CAPTION: &str = "Each dot is the error of the coordinate on the vertical \
                                      axis that one pose alone gives, with all other parameters \
                                      as fitted. \
                          Poses with little sensitivity to the coordinate are omitted.";
/// Caption of a figure whose ordinate is a displacement along that by the effect.
const DISPLACEMENT_CAPTION: &str = "Each dot is the residual of one pose along the displacement by the effect, with all other parameters \
                     as fitted.";
/// Caption of a figure whose ordinate is the size of the effect.
const SIZE_CAPTION: &str = "Each dot is the size of the effect from one pose alone, with all other parameters as fitted. Poses with \
                    little sensitivity to it are omitted.";

/// Axes, law and levers of an effect's figure, before poses are selected.
pub struct View<'a> {
    pub across: Quantity,
    /// Function from the largest ordinate \[SI\] to the vertical axis.
    pub up: Box<dyn Fn(f64) -> Quantity + 'a>,
    /// Abscissa of each row: the value of the regressor, SI.
    pub x: Vec<f64>,
    /// Displacement of the target by a unit of the ordinate in each row \[m per unit\].
    pub levers: Vec<Vector3<f64>>,
    /// Fitted law: function from the abscissa to the ordinate.
    pub law: Law<'a>,
    /// Sentence of the caption that explains what a dot shows.
    pub reading: &'static str,
}

/// Returns the change of a coordinate that best explains a `displacement` \[m\] by least squares.
/// `lever` is the displacement by a unit change of the coordinate \[m per unit\].
pub fn change_along(lever: &Vector3<f64>, displacement: &Vector3<f64>) -> f64 {
    lever.dot(displacement) / lever.norm_squared()
}

/// Returns the view of an effect that changes the coordinate of one joint; `None` for other
/// effects. `levers` are those of the joint coordinates, shape = (joints, rows).
pub fn at_joint<'a>(
    problem: &'a Problem,
    rows: &'a EffectRows,
    levers: &[Vec<Vector3<f64>>],
    poses: &Poses,
) -> Option<View<'a>> {
    let ParameterSite::Joint { joint, field } = rows.site()? else { return None };
    let (number, levers) = (joint + 1, levers.get(joint)?);
    let first = rows.terms.first()?.1;
    let unit = if is_prismatic(problem, number) { Unit::Length } else { Unit::Angle };
    // The law Δθ = c M or c₃ M³ gives the moment M from the fitted change of θ.
    let moments = |of: fn(f64) -> f64| -> (Quantity, Vec<f64>) {
        let moment =
            |(lever, axis): (&Vector3<f64>, &Vector3<f64>)| of(change_along(lever, axis) / first);
        let across = Quantity::new(format!("moment about joint {number} [N·m]"), 1.0);
        (across, levers.iter().zip(&rows.displacements).map(moment).collect())
    };
    let (across, x, law): (_, _, Law) = match field {
        JointField::Theta | JointField::D
            if rows.terms.iter().all(|(regressor, _)| !regressor.is_constant()) =>
        {
            match (rows.quantities().as_slice(), rows.terms.as_slice()) {
                (&[quantity], _) if rows.over_quantity(quantity, problem).is_some() => {
                    rows.over_quantity(quantity, problem)?
                }
                (_, [(regressor, value)]) => {
                    let across = Quantity::new(EffectRows::label(regressor), 1.0);
                    let each = rows.poses.iter().map(|pose| regressor.value(pose)).collect();
                    (across, each, Box::new(move |x| value * x))
                }
                _ => {
                    let across = Quantity::error(&format!("joint {number} by the law"), unit);
                    let each = rows.poses.iter().map(|pose| rows.sum_of_terms(pose)).collect();
                    (across, each, Box::new(|x| x))
                }
            }
        }
        JointField::Play | JointField::SlidingPlay if poses.measurements.approach.is_some() => {
            let label = format!("side from which joint {number} came [−1 … +1]");
            let side = |pose: &PoseView| pose.approach.map_or(0.0, |sides| sides[joint]);
            let sides = rows.poses.iter().map(side).collect();
            (Quantity::new(label, 1.0), sides, Box::new(move |side| 0.5 * first * side))
        }
        JointField::Compliance => {
            let (across, x) = moments(|moment| moment);
            (across, x, Box::new(move |moment| first * moment))
        }
        JointField::Cubic => {
            let (across, x) = moments(f64::cbrt);
            (across, x, Box::new(move |moment| first * moment.powi(3)))
        }
        _ => return None,
    };
    let up = Box::new(move |_| Quantity::error(&format!("joint {number}"), unit));
    Some(View { across, up, x, levers: levers.clone(), law, reading: COORDINATE_CAPTION })
}

/// Returns the view of an effect that does not change a joint's coordinate.
pub fn beyond_joints<'a>(found: &Effect, problem: &Problem, rows: &'a EffectRows) -> View<'a> {
    at_link(found, problem, rows)
        .or_else(|| of_time(problem, rows))
        .or_else(|| of_payload(rows))
        .unwrap_or_else(|| View {
            across: Quantity::new("displacement by the law [mm]", 1e3),
            up: Box::new(|_| Quantity::new("displacement, measured [mm]", 1e3)),
            x: rows.displacements.iter().map(Vector3::norm).collect(),
            levers: rows
                .displacements
                .iter()
                .map(|axis| axis.try_normalize(0.0).unwrap_or_default())
                .collect(),
            law: Box::new(|displacement| displacement),
            reading: DISPLACEMENT_CAPTION,
        })
}

/// Returns the view of an effect that strains a link as a function of one temperature; `None` for
/// other effects.
fn at_link<'a>(found: &Effect, problem: &Problem, rows: &'a EffectRows) -> Option<View<'a>> {
    let is_strain = |site: &ParameterSite| matches!(site, ParameterSite::Beam { field, .. } if field.is_strain());
    let &[quantity] = rows.quantities().as_slice() else { return None };
    if !(quantity.is_thermal()
        && rows.sites.iter().all(is_strain)
        && rows.has_only_regressor(quantity))
    {
        return None;
    }
    let (across, values, _) = rows.over_quantity(quantity, problem)?;
    let reference = problem.data.reference_temperature.unwrap_or_default();
    let link = found.link()?;
    let stretches =
        matches!(rows.sites.first(), Some(ParameterSite::Beam { field: BeamField::Stretch, .. }));
    // An expansion has one signed coefficient. The two coefficients of a bending are combined to
    // their norm.
    let sizes = || rows.terms.iter().map(|term| term.1);
    let size = if stretches { sizes().sum() } else { sizes().map(|c| c * c).sum::<f64>().sqrt() };
    let up: Box<dyn Fn(f64) -> Quantity> = if stretches {
        Box::new(move |_| Quantity::new(format!("strain of link {link} [10⁻⁶]"), 1e6))
    } else {
        Box::new(move |most| Quantity::small(&format!("curvature of link {link}"), "rad/m", most))
    };
    Some(View {
        across,
        up,
        levers: rows.displacements_per(values.iter().map(|value| size * (value - reference))),
        x: values,
        law: Box::new(move |value| size * (value - reference)),
        reading: SIZE_CAPTION,
    })
}

/// Returns the view of an effect that displaces the measuring frame as a function of time; `None`
/// for other effects. The effect displaces all poses in the same direction.
fn of_time<'a>(problem: &Problem, rows: &'a EffectRows) -> Option<View<'a>> {
    let is_shift = |site: &ParameterSite| matches!(site, ParameterSite::Shift { axis: 0..3 });
    let &[quantity @ (LawQuantity::Elapsed | LawQuantity::Time)] = rows.quantities().as_slice()
    else {
        return None;
    };
    let (regressor, _) = rows.terms.first()?;
    let is_one = rows.terms.iter().all(|(other, _)| other == regressor);
    if !is_one || !rows.sites.iter().all(is_shift) {
        return None;
    }
    let (across, x, _) = rows.over_quantity(quantity, problem)?;
    let norm = rows.terms.iter().map(|term| term.1 * term.1).sum::<f64>().sqrt();
    let first = rows.poses.first().map_or(0.0, |pose| pose.time - pose.elapsed);
    let longest = |a: Vector3<f64>, b: &Vector3<f64>| if b.norm() > a.norm() { *b } else { a };
    let largest = rows.displacements.iter().fold(Vector3::zeros(), longest);
    let law = move |elapsed: f64| {
        let pose = PoseView::from_configuration(&[]);
        norm * regressor.value(&PoseView { elapsed, time: first + elapsed, ..pose })
    };
    Some(View {
        across,
        up: Box::new(|_| Quantity::new("displacement, measured [mm]", 1e3)),
        x,
        levers: vec![largest.try_normalize(0.0).unwrap_or_default(); rows.displacements.len()],
        law: Box::new(law),
        reading: DISPLACEMENT_CAPTION,
    })
}

/// Returns the view of an effect that adds a mass to the payload; `None` for other effects.
fn of_payload<'a>(rows: &'a EffectRows) -> Option<View<'a>> {
    if rows.site()? != ParameterSite::Arm(ArmField::Payload) {
        return None;
    }
    let sum: f64 = rows.terms.iter().map(|term| term.1).sum();
    Some(View {
        across: Quantity::new("payload [kg]", 1.0),
        up: Box::new(|_| Quantity::new("missing mass [kg]", 1.0)),
        x: rows.poses.iter().map(|pose| pose.payload.copied().unwrap_or_default()).collect(),
        levers: rows.displacements_per(std::iter::repeat(sum)),
        law: Box::new(move |_| sum),
        reading: SIZE_CAPTION,
    })
}
