//! Random arms, and their text in problem.toml.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write as _;

use nalgebra::Vector3;

use super::arm::{Arm, Geometry, Joint, Kind};
use super::draw::Draw;

/// Arm as drawn, with the way it is written.
pub struct DrawnArm {
    pub arm: Arm,
    /// True if the table of joints is written in the standard, distal form.
    pub is_standard: bool,
    /// Name of each joint, if the problem gives it one.
    pub names: Vec<Option<String>>,
    /// Number of joints that the text has; a standard table has a flange behind them.
    pub written: usize,
    /// First joint of a second branch, counted from 0.
    pub branch: Option<usize>,
}

/// Writes a length or an angle in one of its two units.
fn quantity(draw: &mut Draw, key: &str, value: f64, is_angle: bool) -> String {
    match (is_angle, draw.chance(0.75)) {
        (true, true) => format!("{key}_deg = {:?}", value.to_degrees()),
        (true, false) => format!("{key}_rad = {value:?}"),
        (false, true) => format!("{key}_m = {value:?}"),
        (false, false) => format!("{key}_mm = {:?}", value * 1e3),
    }
}

fn angle(draw: &mut Draw) -> f64 {
    let oblique = draw.number(-120.0, 120.0).to_radians();
    draw.pick(&[0.0, 0.0, FRAC_PI_2, -FRAC_PI_2, FRAC_PI_2, PI, oblique])
}

fn joint(draw: &mut Draw, index: usize, is_standard: bool) -> Joint {
    let kind = match draw.whole(0, 19) {
        0..=3 => Kind::Prismatic,
        4 | 5 if !is_standard && index > 0 => Kind::Fixed,
        _ => Kind::Revolute,
    };
    let geometry = if kind == Kind::Fixed && draw.chance(0.5) {
        let [at, turn] = [draw.vector(0.3), draw.vector(1.2)];
        Geometry::Origin([at.x, at.y, at.z, turn.x, turn.y, turn.z])
    } else {
        let length = |draw: &mut Draw| if draw.chance(0.3) { 0.0 } else { draw.number(-0.2, 0.7) };
        let theta = if draw.chance(0.6) { 0.0 } else { angle(draw) };
        let beta = if is_standard || draw.chance(0.7) { 0.0 } else { draw.number(-0.1, 0.1) };
        Geometry::Hayati([angle(draw), length(draw), theta, length(draw), beta])
    };
    let limits = match kind {
        Kind::Fixed => None,
        Kind::Revolute => draw
            .chance(0.4)
            .then(|| [draw.number(-170.0, -40.0), draw.number(40.0, 170.0)].map(f64::to_radians)),
        Kind::Prismatic => {
            draw.chance(0.4).then(|| [draw.number(-0.1, 0.1), draw.number(0.3, 0.6)])
        }
    };
    Joint {
        kind,
        geometry,
        parent: index,
        limits,
        mimic: None,
        stiffness: None,
        bodies: Vec::new(),
    }
}

/// Gives joints springs, and masses to load them with.
fn load(draw: &mut Draw, arm: &mut Arm, is_standard: bool) {
    arm.deflected = draw.chance(0.8);
    arm.payload_mass = if draw.chance(0.5) { draw.number(0.0, 3.0) } else { 0.0 };
    let turning: Vec<usize> = (0..arm.joints.len())
        .filter(|&k| arm.joints[k].kind == Kind::Revolute && arm.joints[k].mimic.is_none())
        .collect();
    for k in turning {
        if draw.chance(0.7) {
            arm.joints[k].stiffness = Some(draw.number(1.5e4, 9e4).round());
        }
    }
    for joint in arm.joints.iter_mut().filter(|_| !is_standard) {
        if draw.chance(0.5) {
            let mass = draw.number(0.2, 6.0);
            joint.bodies.push((mass, draw.vector(0.2)));
        }
    }
}

pub fn drawn(draw: &mut Draw) -> DrawnArm {
    let is_standard = draw.chance(0.25);
    let written = draw.whole(2, 7);
    let mut joints: Vec<Joint> = (0..written).map(|k| joint(draw, k, is_standard)).collect();
    if joints.iter().filter(|joint| joint.kind != Kind::Fixed).count() < 2 {
        joints[0].kind = Kind::Revolute;
        joints[written - 1] =
            Joint { kind: Kind::Revolute, parent: written - 1, ..joints[0].clone() };
        joints[written - 1].limits = None;
    }
    // A mimic joint follows one of its kind.
    if draw.chance(0.08) {
        let pair = (1..written)
            .find(|&k| joints[k].kind == joints[0].kind && joints[0].kind != Kind::Fixed);
        let movers = joints.iter().filter(|joint| joint.kind != Kind::Fixed).count();
        if let Some(k) = pair.filter(|_| movers > 2) {
            joints[k].mimic = Some((0, draw.pick(&[1.0, -1.0, 0.5])));
            joints[k].limits = None;
        }
    }
    // A second branch begins on a joint of the trunk, or on the base.
    let mut branch = None;
    if written > 3
        && !is_standard
        && joints.iter().all(|joint| joint.mimic.is_none())
        && draw.chance(0.08)
    {
        let begins = draw.whole(2, written - 1);
        joints[begins].parent = draw.whole(0, begins - 1);
        branch = Some(begins);
    }
    let gravity = if draw.chance(0.8) {
        Vector3::new(0.0, 0.0, -9.80665)
    } else {
        draw.pick(&[
            Vector3::new(0.0, 0.0, 9.80665),
            Vector3::new(-9.81, 0.0, 0.0),
            Vector3::new(3.0, -4.0, -8.0),
        ])
    };
    let last = joints.len() - 1;
    let mut arm = Arm {
        joints,
        gravity,
        deflected: true,
        payload_on: last,
        payload_at: Vector3::zeros(),
        payload_mass: 0.0,
    };
    if is_standard {
        make_standard(&mut arm);
    }
    if draw.chance(0.35) {
        load(draw, &mut arm, is_standard);
    }
    let names = (0..written)
        .map(|k| draw.chance(0.25).then(|| format!("axis_{}", b"abcdefg"[k] as char)))
        .collect();
    DrawnArm { arm, is_standard, names, written, branch }
}

/// Takes the joints' numbers as rows Rz(θ+q) Tz(d) Tx(a) Rx(α): a and α move to the next joint,
/// those of the last row to a fixed flange.
fn make_standard(arm: &mut Arm) {
    let mut carried = [0.0; 2];
    for joint in &mut arm.joints {
        if let Geometry::Hayati(numbers) = &mut joint.geometry {
            let row = [numbers[0], numbers[1]];
            [numbers[0], numbers[1]] = carried;
            carried = row;
        }
    }
    let parent = arm.joints.len();
    arm.joints.push(Joint {
        kind: Kind::Fixed,
        geometry: Geometry::Hayati([carried[0], carried[1], 0.0, 0.0, 0.0]),
        parent,
        limits: None,
        mimic: None,
        stiffness: None,
        bodies: Vec::new(),
    });
    arm.payload_on = parent;
}

impl DrawnArm {
    /// Writes the sections `[[joint]]`.
    pub fn text(&self, draw: &mut Draw) -> String {
        let mut text = String::new();
        for k in 0..self.written {
            let joint = &self.arm.joints[k];
            text += "[[joint]]\n";
            if let Some(name) = &self.names[k] {
                let _ = writeln!(text, "name = \"{name}\"");
            }
            if joint.parent != k {
                let _ = writeln!(text, "parent = {}", joint.parent);
            }
            match joint.kind {
                Kind::Revolute => {}
                Kind::Prismatic => text += "kind = \"prismatic\"\n",
                Kind::Fixed => text += "kind = \"fixed\"\n",
            }
            match &joint.geometry {
                Geometry::Origin([x, y, z, roll, pitch, yaw]) => {
                    let _ = writeln!(
                        text,
                        "xyz_m = [{x:?}, {y:?}, {z:?}]\nrpy_rad = [{roll:?}, {pitch:?}, {yaw:?}]"
                    );
                }
                Geometry::Hayati(numbers) => {
                    let mut numbers = *numbers;
                    if self.is_standard {
                        let Geometry::Hayati(next) = &self.arm.joints[k + 1].geometry else {
                            continue;
                        };
                        [numbers[0], numbers[1]] = [next[0], next[1]];
                    }
                    let keys = [
                        ("alpha", true),
                        ("a", false),
                        ("theta", true),
                        ("d", false),
                        ("beta", true),
                    ];
                    for ((key, is_angle), value) in keys.into_iter().zip(numbers) {
                        if value != 0.0 {
                            text += &(quantity(draw, key, value, is_angle) + "\n");
                        }
                    }
                }
            }
            if let Some([low, high]) = joint.limits {
                let unit = if joint.kind == Kind::Revolute { "rad" } else { "m" };
                let _ = writeln!(text, "min_{unit} = {low:?}\nmax_{unit} = {high:?}");
            }
            if let Some((leader, ratio)) = joint.mimic {
                let _ = writeln!(text, "mimic = {{ joint = {}, ratio = {ratio:?} }}", leader + 1);
            }
            if let Some(stiffness) = joint.stiffness {
                let _ = writeln!(text, "stiffness_N_m_per_rad = {stiffness:?}");
            }
            for (mass, at) in &joint.bodies {
                let _ = writeln!(
                    text,
                    "[[joint.body]]\nmass_kg = {mass:?}\ncom_m = [{:?}, {:?}, {:?}]",
                    at.x, at.y, at.z
                );
            }
        }
        text
    }
}
