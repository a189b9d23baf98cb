//! Numbers of a model in one list with their names, which becomes the table of numbers of the
//! generated C code.

use crate::laws::expression::Expression;
use crate::mechanics::{Angle, Beam, Joint};
use crate::model::parameter::Regressor;
use crate::model::{ModelParts, PartSite};
use crate::spatial::Frame;

/// Name and unit of each number of a joint, in the order of [`of_joint`].
pub(super) const JOINT: &[(&str, &str)] = &[
    ("X", "m"),
    ("Y", "m"),
    ("Z", "m"),
    ("ROLL_SIN", "1"),
    ("ROLL_COS", "1"),
    ("PITCH_SIN", "1"),
    ("PITCH_COS", "1"),
    ("YAW_SIN", "1"),
    ("YAW_COS", "1"),
    ("ALPHA_SIN", "1"),
    ("ALPHA_COS", "1"),
    ("A", "m"),
    ("THETA", "rad"),
    ("D", "m"),
    ("BETA_SIN", "1"),
    ("BETA_COS", "1"),
    ("FLEXIBILITY", "rad/(N m)"),
    ("CUBIC", "rad/(N m)^3"),
    ("PLAY", "rad or m"),
    ("LATERAL_X", "rad/(N m)"),
    ("LATERAL_Y", "rad/(N m)"),
    ("SLIDE", "1/(N m^2)"),
    ("ANCHOR_X", "m"),
    ("ANCHOR_Y", "m"),
    ("LEVER_X", "m"),
    ("LEVER_Y", "m"),
    ("FREE_LENGTH", "m"),
    ("RATE", "N/m"),
    ("PRELOAD", "N"),
];
/// Name and unit of each number of a beam, in the order of [`of_beam`].
pub(super) const BEAM: &[(&str, &str)] = &[
    ("MASS", "kg"),
    ("AXIAL", "1/N"),
    ("ABOUT_Y", "1/(N m^2)"),
    ("ABOUT_Z", "1/(N m^2)"),
    ("TWIST", "1/(N m^2)"),
    ("COUPLING_Y", "1/(N m^2)"),
    ("COUPLING_Z", "1/(N m^2)"),
    ("STRAIN", "1"),
    ("STRAIN_Y", "1/m"),
    ("STRAIN_Z", "1/m"),
];
/// Name and unit of each number of a point mass.
pub(super) const LOAD: &[(&str, &str)] = &[("MASS", "kg"), ("X", "m"), ("Y", "m"), ("Z", "m")];
/// Name and unit of each number of a hoist.
pub(super) const HOIST: &[(&str, &str)] = &[
    ("X", "m"),
    ("Y", "m"),
    ("Z", "m"),
    ("FORCE", "N"),
    ("DIRECTION_X", "1"),
    ("DIRECTION_Y", "1"),
    ("DIRECTION_Z", "1"),
];
/// Name and unit of each number of a frame.
pub(super) const FRAME: &[(&str, &str)] = &[
    ("XX", "1"),
    ("XY", "1"),
    ("XZ", "1"),
    ("YX", "1"),
    ("YY", "1"),
    ("YZ", "1"),
    ("ZX", "1"),
    ("ZY", "1"),
    ("ZZ", "1"),
    ("X", "m"),
    ("Y", "m"),
    ("Z", "m"),
];

/// Constants of an identified model for the generated C code, in the order of its table of numbers.
#[derive(Debug, Default)]
pub(super) struct Numbers {
    /// Value of each number, SI.
    pub values: Vec<f64>,
    /// Comment that describes each number.
    pub comments: Vec<String>,
    /// Name of each group of numbers, and index of its first number.
    pub groups: Vec<(&'static str, usize)>,
}

impl Numbers {
    /// Appends a number.
    fn push(&mut self, comment: String, value: f64) {
        self.comments.push(comment);
        self.values.push(value);
    }

    /// Begins a group of numbers at the end of the list.
    fn begin(&mut self, group: &'static str) {
        self.groups.push((group, self.values.len()));
    }

    /// Appends the numbers of one part of the arm, whose names and units are `fields`.
    fn push_block(&mut self, owner: &str, fields: &[(&str, &str)], values: &[f64]) {
        for ((name, unit), value) in fields.iter().zip(values) {
            self.push(format!("{owner} {} [{unit}]", name.to_lowercase()), *value);
        }
    }

    /// Lists the numbers of a model. `names` are those of its joints, bases and targets.
    pub fn of(parts: &ModelParts, names: [&[String]; 3]) -> Self {
        let arm = &parts.arm;
        let mut numbers = Self::default();
        numbers.begin("JOINT");
        for (name, joint) in names[0].iter().zip(&arm.joints) {
            numbers.push_block(&format!("joint {name}:"), JOINT, &of_joint(joint));
        }
        let beams = || (1..).zip(&arm.joints).filter_map(|(n, j)| Some((n, j.a, j.beam.as_ref()?)));
        numbers.begin("BEAM");
        for (number, _, beam) in beams() {
            numbers.push_block(&format!("beam of joint {number}:"), BEAM, &of_beam(beam));
        }
        numbers.begin("LOAD");
        for (number, length, beam) in beams() {
            for mass in &beam.masses {
                let values = [mass.mass, mass.at.x, mass.at.y, mass.at.z];
                numbers.push_block(&format!("load on beam of joint {number}:"), LOAD, &values);
            }
            if let Some(added) = &beam.added {
                let values = [added.mass, added.at * length.signum(), 0.0, 0.0];
                numbers.push_block(&format!("undeclared mass on joint {number}:"), LOAD, &values);
            }
        }
        numbers.begin("HOIST");
        for (number, hoist) in beams().filter_map(|(n, _, beam)| Some((n, beam.hoist?))) {
            let [at, direction] = [hoist.at, hoist.direction];
            let values = [at.x, at.y, at.z, hoist.force, direction.x, direction.y, direction.z];
            numbers.push_block(&format!("hoist of joint {number}:"), HOIST, &values);
        }
        numbers.begin("BODY");
        for (number, joint) in (1..).zip(&arm.joints) {
            for (mass, at) in joint.masses() {
                let values = [mass, at.x, at.y, at.z];
                numbers.push_block(&format!("body on joint {number}:"), LOAD, &values);
            }
        }
        let mut list = |group, what: &str, values: &[f64]| {
            numbers.begin(group);
            for (k, value) in (1..).zip(values) {
                numbers.push(format!("{what} {k}"), *value);
            }
        };
        list("GRAVITY", "gravity [m/s^2]", arm.gravity.as_slice());
        list("PAYLOAD_AT", "position of the payload [m]", arm.payload_at.as_slice());
        list("PAYLOAD_ERROR", "excess of the payload [kg]", &[arm.payload_error]);
        let rope = arm.rope.as_ref();
        let rope = rope.map_or([0.0; 4], |r| [r.force, r.lean[0], r.lean[1], r.trolley]);
        list("ROPE", "relative force, lean x, y [1], trolley [1/m] of ropes", &rope);
        list("MOUNTING", "flexibility of the base [rad/(N m)]", &arm.mounting.unwrap_or_default());
        list("MIXING", "share of the deflected equilibrium", &[arm.mixing.unwrap_or_default()]);
        let instrument = [&[parts.scale][..], &parts.strain].concat();
        list("INSTRUMENT", "scale, strain xx yy zz xy xz yz", &instrument);
        for (group, word, frames, names) in [
            ("BASE", "base", parts.bases.clone(), names[1]),
            ("TARGET", "target", parts.targets.iter().map(|target| target.1).collect(), names[2]),
        ] {
            numbers.begin(group);
            for (name, frame) in names.iter().zip(&frames) {
                numbers.push_block(&format!("{word} {name}:"), FRAME, &of_frame(frame));
            }
        }
        numbers.begin("TERM");
        for term in &parts.terms {
            let inner = inner(&term.regressor);
            let (site, formula) = (site(term.site), term.regressor.text());
            numbers.push(format!("{site}: factor of {formula}"), term.value);
            for (name, value) in inner {
                numbers.push(name.clone(), *value);
            }
        }
        numbers
    }
}

/// Describes in words the quantity to which a term adds, for a comment.
fn site(site: PartSite) -> String {
    let of = |is_error: bool| if is_error { "readings" } else { "base" };
    match site {
        PartSite::Joint(joint) => format!("coordinate of joint {}", joint + 1),
        PartSite::Strain { joint, which } => format!("strain {which} on joint {}", joint + 1),
        PartSite::Motion { joint, which } => format!("motion {which} of joint {}", joint + 1),
        PartSite::Shift { axis, is_error } => format!("shift of {}, axis {axis}", of(is_error)),
        PartSite::Turn { axis, is_error } => format!("rotation of {}, axis {axis}", of(is_error)),
    }
}

/// Returns full names and values of the parameters inside a regressor's formula; empty if there are
/// none.
pub(super) fn inner(regressor: &Regressor) -> &[(String, f64)] {
    match regressor {
        Regressor::Formula(formula) => formula.parameters(),
        _ => &[],
    }
}

/// Returns the expression of a regressor; `None` if it is the constant 1.
pub(super) fn expression(regressor: &Regressor) -> Option<Expression> {
    (!matches!(regressor, Regressor::Unit | Regressor::Constant)).then(|| regressor.expression())
}

/// Returns the numbers of a joint in the order of [`JOINT`].
fn of_joint(joint: &Joint<f64>) -> Vec<f64> {
    let pair = |angle: &Angle<f64>| [angle.sin_cos.0, angle.sin_cos.1];
    let mut values = match &joint.placement {
        Some(placed) => {
            [placed.xyz.as_slice(), placed.rpy.each_ref().map(pair).as_flattened()].concat()
        }
        None => vec![0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0],
    };
    values.extend(pair(&joint.alpha));
    values.extend([joint.a, joint.theta, joint.d]);
    values.extend(pair(&joint.beta));
    values.push(joint.flexibility.unwrap_or(0.0));
    values.extend(joint.nonlinear.as_ref().map_or([0.0; 2], |n| [n.cubic, n.play]));
    values.extend(joint.lateral.unwrap_or_default());
    values.push(joint.slide.unwrap_or(0.0));
    values.extend(joint.compensator.as_ref().map_or([0.0; 7], |spring| {
        let ([ax, ay], [bx, by]) = (spring.anchor, spring.lever);
        [ax, ay, bx, by, spring.free_length, spring.rate, spring.preload]
    }));
    values
}

/// Returns the numbers of a beam in the order of [`BEAM`].
fn of_beam(beam: &Beam<f64>) -> Vec<f64> {
    let k = &beam.flexibility;
    let coupling = k.coupling.unwrap_or_default();
    let strain = beam.strain.as_ref();
    let strain = strain.map_or([0.0; 3], |s| [s.axial, s.curvature[0], s.curvature[1]]);
    let stiff = [beam.mass, k.axial, k.about_y, k.about_z, k.twist];
    [&stiff[..], &coupling, &strain].concat()
}

/// Returns the numbers of a frame in the order of [`FRAME`].
fn of_frame(frame: &Frame<f64>) -> Vec<f64> {
    frame.axes.iter().chain([&frame.origin]).flat_map(|v| v.iter().copied()).collect()
}
