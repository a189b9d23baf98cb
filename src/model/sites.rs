//! Sites of parameters in the arm.

use crate::mechanics::{
    AddedMass, Angle, Arm, Beam, Compensator, Flexibility, HoistError, Nonlinear, Placement, Strain,
};
use crate::model::parameter::{ArmField, BeamField, JointField, ParameterSite};
use crate::problem::{Argument, Effect};
use crate::scalar::Scalar;
use crate::spatial::rotate;
use nalgebra::{Rotation3, Vector3};

/// Creates the part of the arm that a parameter at `site` needs, if it is absent. With the
/// parameter at `nominal`, the arm behaves as without this part.
pub(super) fn prepare_site(arm: &mut Arm<f64>, site: ParameterSite, nominal: f64) {
    match site {
        ParameterSite::Joint { joint, field } => {
            let joint = &mut arm.joints[joint];
            match field {
                JointField::Compliance => _ = joint.flexibility.get_or_insert(0.0),
                JointField::Cubic | JointField::Play | JointField::SlidingPlay => {
                    joint.nonlinear.get_or_insert(Nonlinear { cubic: 0.0, play: 0.0 });
                }
                JointField::LateralX | JointField::LateralY => {
                    _ = joint.lateral.get_or_insert([0.0; 2]);
                }
                JointField::SlideFlexibility => _ = joint.slide.get_or_insert(0.0),
                JointField::BodyMass => _ = joint.body_error.get_or_insert(0.0),
                JointField::Before(_) | JointField::After(_) => {
                    joint.motion.get_or_insert_with(Box::default);
                }
                _ => {}
            }
        }
        ParameterSite::Beam { joint, field } => {
            let beam = arm.joints[joint].beam.get_or_insert_with(weightless_beam);
            match field {
                BeamField::BowY | BeamField::BowZ | BeamField::Stretch => {
                    beam.strain.get_or_insert(Strain { curvature: [0.0; 2], axial: 0.0 });
                }
                BeamField::CouplingY | BeamField::CouplingZ => {
                    beam.flexibility.coupling.get_or_insert([0.0; 2]);
                }
                BeamField::AddedMass | BeamField::AddedAt => {
                    let added = beam.added.get_or_insert(AddedMass { mass: 0.0, at: 0.0 });
                    if field == BeamField::AddedAt {
                        added.at = nominal;
                    }
                }
                _ => {}
            }
        }
        ParameterSite::Arm(field) => match field {
            ArmField::HoistForce
            | ArmField::HoistLeanX
            | ArmField::HoistLeanY
            | ArmField::HoistTrolley => {
                arm.rope.get_or_insert(HoistError { force: 0.0, lean: [0.0; 2], trolley: 0.0 });
            }
            ArmField::MountingX | ArmField::MountingY => _ = arm.mounting.get_or_insert([0.0; 2]),
            ArmField::Mixing => _ = arm.mixing.get_or_insert(0.0),
            ArmField::Payload
            | ArmField::PayloadAt(_)
            | ArmField::GravityX
            | ArmField::GravityY => {}
        },
        ParameterSite::ArmStrain => {
            let joints = arm.joints.iter_mut();
            joints.for_each(|joint| _ = joint.motion.get_or_insert_with(Box::default));
        }
        ParameterSite::Base { .. }
        | ParameterSite::Target { .. }
        | ParameterSite::Fixture { .. }
        | ParameterSite::FixtureShift { .. }
        | ParameterSite::Shift { .. }
        | ParameterSite::Turn { .. }
        | ParameterSite::Exposure { .. }
        | ParameterSite::Scale
        | ParameterSite::Strain { .. } => {}
    }
}

/// Returns the small motions by which a strain of the arm lengthens it: index of the joint, axis
/// (0 to 2) of the translation before it turns, and length \[m\] that the strain multiplies.
pub(super) fn lengths(arm: &Arm<f64>) -> impl Iterator<Item = (usize, usize, f64)> {
    arm.joints.iter().enumerate().flat_map(|(index, joint)| {
        let mut length = Vector3::new(joint.a, 0.0, joint.d);
        if let Some(Placement { xyz, rpy }) = &joint.placement {
            let [roll, pitch, yaw] = [rpy[0].value, rpy[1].value, rpy[2].value];
            length += Rotation3::from_euler_angles(roll, pitch, yaw).inverse() * xyz;
        }
        let axes = (0..3).filter(move |&axis| length[axis] != 0.0);
        axes.map(move |axis| (index, axis, length[axis]))
    })
}

/// Adds the gravity compensator that an effect declares, with zero spring force, unless the joint
/// already has one.
pub(super) fn add_spring(arm: &mut Arm<f64>, effect: &Effect) {
    let argument = |key| effect.argument(key);
    if let Some(joint) = effect.compensated()
        && let Some(joint) = arm.joints.get_mut(joint.wrapping_sub(1))
        && let (Some(Argument::Point(anchor)), Some(Argument::Point(lever))) =
            (argument("anchor_m"), argument("lever_m"))
        && let Some(Argument::Length(free_length)) = argument("free_length_m")
    {
        let spring = Compensator { anchor, lever, free_length, rate: 0.0, preload: 0.0 };
        joint.compensator.get_or_insert(spring);
    }
}

/// Creates a weightless rigid beam, to which flexibility can be added.
fn weightless_beam() -> Beam<f64> {
    Beam {
        mass: 0.0,
        flexibility: Flexibility::RIGID,
        masses: Vec::new(),
        hoist: None,
        strain: None,
        added: None,
    }
}

/// Rotates the gravity vector by the rotation vector (x, y, 0) \[rad\], arm base frame.
pub(super) fn rotate_gravity<S: Scalar>(arm: &mut Arm<S>, [x, y]: [S; 2]) {
    arm.gravity = rotate(&Vector3::new(x, y, S::from(0.0)), &arm.gravity);
}

/// Sets the quantity at a site of the arm to `nominal` plus a deviation `x`. Parameters of effects
/// add to the declared value.
///
/// The angles that rotate gravity are collected in `tilt`, because both belong to one rotation
/// vector.
pub(super) fn set_site<S: Scalar>(
    arm: &mut Arm<S>,
    site: ParameterSite,
    nominal: f64,
    x: S,
    tilt: &mut [S; 2],
) {
    match site {
        ParameterSite::Joint { joint, field } => {
            let joint = &mut arm.joints[joint];
            if let (Some(place), Some(placement)) = (field.placement(), &mut joint.placement) {
                match place.checked_sub(3) {
                    None => placement.xyz[place] = x + nominal,
                    Some(angle) => placement.rpy[angle] = Angle::new(x + nominal),
                }
            }
            match (field, &mut joint.nonlinear, &mut joint.lateral) {
                (JointField::Alpha, ..) => joint.alpha = Angle::new(x + nominal),
                (JointField::A, ..) => joint.a = x + nominal,
                (JointField::Theta, ..) => joint.theta = x + nominal,
                (JointField::D, ..) => joint.d = x + nominal,
                (JointField::Beta, ..) => joint.beta = Angle::new(x + nominal),
                (JointField::Stiffness, ..) => joint.flexibility = Some((-x).exp() / nominal),
                (JointField::Compliance, ..) => {
                    joint.flexibility = Some(joint.flexibility.map_or(x, |c| c + x));
                }
                (JointField::Cubic, Some(nonlinear), _) => nonlinear.cubic += x,
                (JointField::Play | JointField::SlidingPlay, Some(nonlinear), _) => {
                    nonlinear.play += x;
                }
                (JointField::LateralX, _, Some(lateral)) => lateral[0] += x,
                (JointField::LateralY, _, Some(lateral)) => lateral[1] += x,
                (JointField::SpringRate, ..) => {
                    joint.compensator.iter_mut().for_each(|spring| spring.rate += x);
                }
                (JointField::SpringPreload, ..) => {
                    joint.compensator.iter_mut().for_each(|spring| spring.preload += x);
                }
                (JointField::SlideFlexibility, ..) => {
                    joint.slide = Some(joint.slide.map_or(x, |declared| declared + x));
                }
                (JointField::BodyMass, ..) => {
                    let declared: f64 = joint.bodies.iter().map(|body| body.mass).sum();
                    joint.body_error = joint.body_error.map(|error| error + x / declared);
                }
                _ => {}
            }
        }
        ParameterSite::Beam { joint, field } => {
            if let Some(beam) = &mut arm.joints[joint].beam {
                set_beam_field(beam, field, nominal, x);
            }
        }
        ParameterSite::Arm(field) => set_arm_field(arm, field, x, tilt),
        ParameterSite::Base { .. }
        | ParameterSite::Target { .. }
        | ParameterSite::Fixture { .. }
        | ParameterSite::FixtureShift { .. }
        | ParameterSite::Shift { .. }
        | ParameterSite::Turn { .. }
        | ParameterSite::Exposure { .. }
        | ParameterSite::ArmStrain
        | ParameterSite::Scale
        | ParameterSite::Strain { .. } => {}
    }
}

fn set_beam_field<S: Scalar>(beam: &mut Beam<S>, field: BeamField, nominal: f64, x: S) {
    let flexibilities = &mut beam.flexibility;
    let flexibility = (-x).exp() / nominal;
    match (field, &mut beam.strain, &mut beam.added) {
        (BeamField::Axial, ..) => flexibilities.axial = flexibility,
        (BeamField::Bending, ..) => {
            (flexibilities.about_y, flexibilities.about_z) = (flexibility, flexibility);
        }
        (BeamField::BendingY, ..) => flexibilities.about_y = flexibility,
        (BeamField::BendingZ, ..) => flexibilities.about_z = flexibility,
        (BeamField::Twist, ..) => flexibilities.twist = flexibility,
        (BeamField::Anisotropy, ..) => flexibilities.about_z *= (-x).exp(),
        (BeamField::Flexibility, ..) => {
            flexibilities.about_y += x;
            flexibilities.about_z += x;
        }
        (BeamField::CouplingY, ..) => {
            flexibilities.coupling = flexibilities.coupling.map(|[y, z]| [y + x, z]);
        }
        (BeamField::CouplingZ, ..) => {
            flexibilities.coupling = flexibilities.coupling.map(|[y, z]| [y, z + x]);
        }
        (BeamField::BowY, Some(strain), _) => strain.curvature[0] += x,
        (BeamField::BowZ, Some(strain), _) => strain.curvature[1] += x,
        (BeamField::Stretch, Some(strain), _) => strain.axial += x,
        (BeamField::AddedMass, _, Some(added)) => added.mass += x,
        (BeamField::AddedAt, _, Some(added)) => added.at += x,
        (BeamField::BowY | BeamField::BowZ | BeamField::Stretch, None, _)
        | (BeamField::AddedMass | BeamField::AddedAt, _, None) => {}
    }
}

fn set_arm_field<S: Scalar>(arm: &mut Arm<S>, field: ArmField, x: S, tilt: &mut [S; 2]) {
    match (field, &mut arm.rope, &mut arm.mounting) {
        (ArmField::Payload, ..) => arm.payload_error += x,
        (ArmField::PayloadAt(axis), ..) => arm.payload_at[axis] += x,
        (ArmField::GravityX, ..) => tilt[0] += x,
        (ArmField::GravityY, ..) => tilt[1] += x,
        (ArmField::Mixing, ..) => arm.mixing = Some(arm.mixing.map_or(x, |declared| declared + x)),
        (ArmField::HoistForce, Some(rope), _) => rope.force += x,
        (ArmField::HoistLeanX, Some(rope), _) => rope.lean[0] += x,
        (ArmField::HoistLeanY, Some(rope), _) => rope.lean[1] += x,
        (ArmField::HoistTrolley, Some(rope), _) => rope.trolley += x,
        (ArmField::MountingX, _, Some(mounting)) => mounting[0] += x,
        (ArmField::MountingY, _, Some(mounting)) => mounting[1] += x,
        (
            ArmField::HoistForce
            | ArmField::HoistLeanX
            | ArmField::HoistLeanY
            | ArmField::HoistTrolley,
            None,
            _,
        )
        | (ArmField::MountingX | ArmField::MountingY, _, None) => {}
    }
}
