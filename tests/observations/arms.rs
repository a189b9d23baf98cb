//! Arms of several kinds, effects that they may have, and fixtures they are measured against.

use std::fmt::Write as _;
use std::path::Path;

use crate::common::arms::parse;
use flexcal::problem::{PoseConditions, Problem};
use flexcal::rig::Rig;
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Key of `[[effect]]` with its value.
pub type Strength = (&'static str, f64);
/// Effect as TRUTH.toml declares it, with its values.
pub type Lacking = (&'static str, &'static [Strength]);

/// Arm with the ranges of its joints, and effects of clearly visible size as TRUTH.toml writes
/// them.
pub struct Kind {
    pub name: &'static str,
    /// Text of its problem up to `[data]`.
    pub text: &'static str,
    /// Range of each joint as `[poses]` writes it.
    pub ranges: &'static [&'static str],
    /// Effects with their values by key.
    pub effects: &'static [Lacking],
}

/// Seven joints without masses, as from a URDF without inertias.
const SEVEN: &str = r#"
name = "seven"
joint = [
    { name = "j1", d_m = 0.333 },
    { name = "j2", alpha_deg = -90 },
    { name = "j3", alpha_deg = 90, d_m = 0.316 },
    { name = "j4", alpha_deg = 90, a_m = 0.0825 },
    { name = "j5", alpha_deg = -90, a_m = -0.0825, d_m = 0.384 },
    { name = "j6", alpha_deg = 90 },
    { name = "j7", alpha_deg = 90, a_m = 0.088, d_m = 0.107 },
]
tool.target_m = [0.05, 0.02, 0.1]

[parameters]
"joint*.*" = { sigma_deg = 0.2, sigma_mm = 1 }
"tool.*" = { sigma_mm = 2 }
"joint*.beta" = { fixed = true }
"joint1.*" = { fixed = true }
"joint7.theta" = { fixed = true }
"joint7.d" = { fixed = true }
"#;

/// Six joints, three of them parallel, with heavy links, declared rigid.
const SIX: &str = r#"
name = "six"
joint = [
    { name = "base", d_m = 0.1273, body = [{ name = "shoulder", mass_kg = 7.8 }] },
    { name = "shoulder", alpha_deg = 90, body = [{ name = "upper", mass_kg = 12.9, com_m = [-0.306, 0, 0.175] }] },
    { name = "elbow", a_m = -0.612, body = [{ name = "fore", mass_kg = 3.9, com_m = [-0.286, 0, 0.039] }] },
    { name = "w1", a_m = -0.5723, d_m = 0.164, body = [{ name = "w1", mass_kg = 2 }] },
    { name = "w2", alpha_deg = 90, d_m = 0.1157, body = [{ name = "w2", mass_kg = 2 }] },
    { name = "w3", alpha_deg = -90, d_m = 0.0922 },
]
tool.target_m = [0.03, 0.02, 0.12]

[parameters]
"joint*.alpha" = { sigma_deg = 0.2 }
"joint*.theta" = { sigma_deg = 0.2 }
"joint*.beta" = { sigma_deg = 0.2 }
"joint*.a" = { sigma_mm = 1 }
"joint*.d" = { sigma_mm = 1 }
"tool.*" = { sigma_mm = 2 }
"joint1.*" = { fixed = true }
"joint6.theta" = { fixed = true }
"joint6.d" = { fixed = true }
"#;

/// SCARA with four joints.
const SCARA: &str = r#"
name = "scara"
dh = "standard"
joint = [
    { name = "arm", d_m = 0.35, a_m = 0.325 },
    { name = "forearm", a_m = 0.275, alpha_deg = 180 },
    { name = "stroke", kind = "prismatic" },
    { name = "spindle" },
]
tool.target_m = [0.06, 0.0, 0.05]

[parameters]
"joint2.*" = { sigma_deg = 0.1, sigma_mm = 0.5 }
"joint3.*" = { sigma_deg = 0.1, sigma_mm = 0.5 }
"joint1.*" = { fixed = true }
"joint*.d" = { fixed = true }
"joint3.theta" = { fixed = true }
"tool.*" = { sigma_mm = 2 }
"tool.z" = { fixed = true }
"#;

/// Gantry of three prismatic joints with a wrist.
const GANTRY: &str = r#"
name = "gantry"
joint = [
    { name = "mount", kind = "fixed", rpy_deg = [0, 90, 0] },
    { name = "rail", kind = "prismatic" },
    { name = "bridge", kind = "prismatic", alpha_deg = -90 },
    { name = "lift", kind = "prismatic", alpha_deg = -90, theta_deg = -90 },
    { name = "turn" },
    { name = "tilt", alpha_deg = 90, d_m = 0.05 },
]
tool.target_m = [0.25, 0.0, 0.03]

[parameters]
"joint3.alpha" = { sigma_deg = 0.2 }
"joint4.alpha" = { sigma_deg = 0.2 }
"joint3.theta" = { sigma_deg = 0.2 }
"joint5.alpha" = { sigma_deg = 0.2 }
"joint6.alpha" = { sigma_deg = 0.2 }
"joint6.a" = { sigma_mm = 1 }
"joint5.theta" = { sigma_deg = 0.2 }
"tool.*" = { sigma_mm = 5 }
"#;

/// All arms of the tests.
pub const ARMS: [Kind; 5] = [
    Kind {
        name: "elbow",
        text: crate::bench::ARM,
        ranges: &[
            "q1_deg = [-120, 120]",
            "q2_deg = [-60, 120]",
            "q3_deg = [-140, 100]",
            "q4_deg = [-170, 170]",
            "q5_deg = [-130, 130]",
            "q6_deg = [-150, 150]",
        ],
        effects: &[
            ("gear-ratio = { joint = 3 }", &[("error_relative", 6e-4)]),
            (
                "joint-harmonic = { joint = 2, orders = [1] }",
                &[("sin1_deg", 0.04), ("cos1_deg", 0.02)],
            ),
            (
                "joint-harmonic = { joint = 4, orders = [2] }",
                &[("sin2_deg", 0.06), ("cos2_deg", 0.04)],
            ),
            ("backlash = { joint = 3 }", &[("width_deg", 0.05)]),
            ("joint-compliance = { joint = 4 }", &[("compliance_rad_per_N_m", 5e-5)]),
            ("joint-thermal-drift = { joint = 2 }", &[("rate_deg_per_C", 0.004)]),
            ("joint-coupling = { joint = 5, from = 4 }", &[("factor_relative", 1e-3)]),
            ("payload-mass = true", &[("mass_kg", 0.3)]),
            ("gravity-direction = true", &[("about_x_deg", 0.5)]),
        ],
    },
    Kind {
        name: "seven",
        text: SEVEN,
        ranges: &[
            "q1_deg = [-120, 120]",
            "q2_deg = [-80, 80]",
            "q3_deg = [-120, 120]",
            "q4_deg = [-150, -30]",
            "q5_deg = [-150, 150]",
            "q6_deg = [20, 190]",
            "q7_deg = [-150, 150]",
        ],
        effects: &[
            ("gear-ratio = { joint = 2 }", &[("error_relative", 6e-4)]),
            ("gear-ratio = { joint = 5 }", &[("error_relative", 1.5e-3)]),
            (
                "joint-harmonic = { joint = 3, orders = [2] }",
                &[("sin2_deg", 0.04), ("cos2_deg", 0.02)],
            ),
            (
                "joint-harmonic = { joint = 4, orders = [3] }",
                &[("sin3_deg", 0.03), ("cos3_deg", 0.03)],
            ),
            ("backlash = { joint = 3 }", &[("width_deg", 0.06)]),
            ("backlash = { joint = 6 }", &[("width_deg", 0.12)]),
            ("joint-thermal-drift = { joint = 2 }", &[("rate_deg_per_C", 0.004)]),
            ("joint-coupling = { joint = 6, from = 5 }", &[("factor_relative", 1.5e-3)]),
            ("joint-compliance = { joint = 4 }", &[("compliance_rad_per_N_m", 5e-5)]),
        ],
    },
    Kind {
        name: "six",
        text: SIX,
        ranges: &[
            "q1_deg = [-150, 150]",
            "q2_deg = [-160, -20]",
            "q3_deg = [-140, 140]",
            "q4_deg = [-160, 160]",
            "q5_deg = [-160, 160]",
            "q6_deg = [-160, 160]",
        ],
        effects: &[
            ("gear-ratio = { joint = 2 }", &[("error_relative", 4e-4)]),
            (
                "joint-harmonic = { joint = 1, orders = [2] }",
                &[("sin2_deg", 0.02), ("cos2_deg", 0.02)],
            ),
            (
                "joint-harmonic = { joint = 3, orders = [1] }",
                &[("sin1_deg", 0.03), ("cos1_deg", 0.03)],
            ),
            ("backlash = { joint = 2 }", &[("width_deg", 0.04)]),
            ("backlash = { joint = 4 }", &[("width_deg", 0.1)]),
            ("joint-compliance = { joint = 2 }", &[("compliance_rad_per_N_m", 5e-6)]),
            ("joint-compliance = { joint = 3 }", &[("compliance_rad_per_N_m", 1.5e-5)]),
            ("joint-thermal-drift = { joint = 3 }", &[("rate_deg_per_C", 0.004)]),
            ("joint-coupling = { joint = 5, from = 4 }", &[("factor_relative", 1.5e-3)]),
        ],
    },
    Kind {
        name: "scara",
        text: SCARA,
        ranges: &[
            "q1_deg = [-130, 130]",
            "q2_deg = [-140, 140]",
            "q3_mm = [0, 200]",
            "q4_deg = [-180, 180]",
        ],
        effects: &[
            ("gear-ratio = { joint = 1 }", &[("error_relative", 4e-4)]),
            ("gear-ratio = { joint = 3 }", &[("error_relative", 2e-3)]),
            (
                "joint-harmonic = { joint = 1, orders = [2] }",
                &[("sin2_deg", 0.02), ("cos2_deg", 0.01)],
            ),
            (
                "joint-harmonic = { joint = 2, orders = [1] }",
                &[("sin1_deg", 0.04), ("cos1_deg", 0.03)],
            ),
            ("backlash = { joint = 2 }", &[("width_deg", 0.05)]),
            ("joint-thermal-drift = { joint = 1 }", &[("rate_deg_per_C", 0.004)]),
            ("joint-coupling = { joint = 2, from = 1 }", &[("factor_relative", 8e-4)]),
        ],
    },
    Kind {
        name: "gantry",
        text: GANTRY,
        ranges: &[
            "q2_m = [0, 2]",
            "q3_m = [-1, 1]",
            "q4_m = [0.2, 1.4]",
            "q5_deg = [-170, 170]",
            "q6_deg = [-100, 100]",
        ],
        effects: &[
            ("gear-ratio = { joint = 2 }", &[("error_relative", 2e-4)]),
            ("gear-ratio = { joint = 5 }", &[("error_relative", 1e-3)]),
            (
                "joint-harmonic = { joint = 5, orders = [1] }",
                &[("sin1_deg", 0.06), ("cos1_deg", 0.04)],
            ),
            ("backlash = { joint = 3 }", &[("width_mm", 0.2)]),
            ("backlash = { joint = 6 }", &[("width_deg", 0.08)]),
            ("joint-thermal-drift = { joint = 4 }", &[("rate_mm_per_C", 0.02)]),
        ],
    },
];

/// Way of measuring an arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measured {
    /// A tracker measures positions of other poses.
    Positions,
    /// Six sockets, two of them at a known distance.
    Sockets,
    /// Four draw wires with unknown anchors.
    Wires,
    /// Three ball bars of known length with unknown anchors.
    Bars,
    /// Contacts with a table top, a wall and a ball.
    Touches,
    /// Three sockets, and an inclinometer on the third frame and the last.
    Tilts,
    /// Ten positions, then sockets and contacts.
    Mixed,
}

/// Ways of measuring without a tracker, with their numbers of rows.
pub const WITHOUT_TRACKER: [(Measured, usize); 6] = [
    (Measured::Sockets, 120),
    (Measured::Wires, 200),
    (Measured::Bars, 200),
    (Measured::Touches, 200),
    (Measured::Tilts, 150),
    (Measured::Mixed, 130),
];

/// Fixtures of an arm: as the problem declares them, and at their true positions.
pub struct Around {
    pub declared: String,
    pub truth: String,
}

impl Kind {
    /// Returns the problem of the arm, measured in a given way.
    pub fn problem(&self, how: Measured, around: &Around) -> Problem {
        let base = if how == Measured::Positions { "\"base.*\" = { free = true }\n" } else { "" };
        let beta = if self.name == "elbow" { "\"joint*.beta\" = { fixed = true }\n" } else { "" };
        let data = "position_sigma_mm = 0.05\npoint_sigma_mm = 0.05\ndistance_sigma_mm = 0.05\nsurface_sigma_mm = 0.05\n\
                    held_out = { column = \"split\" }\nreference_temperature_C = 20\n";
        let tilts = if how == Measured::Tilts { "tilt_sigma_deg = 0.002\n" } else { "" };
        let rules = format!("{}{base}{beta}", self.text);
        parse(&format!("{rules}{}[data]\n{data}{tilts}", around.declared))
    }

    /// Returns the text of TRUTH.toml: true positions of the fixtures, and the poses.
    pub fn truth(&self, how: Measured, around: &Around, effect: &str) -> String {
        let geometry = self.text.split_once("[parameters]").unwrap().1;
        let random = |line: &&str| line.contains("sigma") || line.contains("fixed");
        let still = |line: &str| line.replace("fixed = true", "sigma_deg = 0, sigma_mm = 0");
        // Parameters that the data cannot determine are true as declared.
        let random: String = geometry
            .lines()
            .filter(random)
            .fold(String::new(), |all, line| all + &still(line) + "\n");
        let more = match how {
            Measured::Mixed => "positions = 10\n",
            Measured::Tilts => "tilts = [\"joint3\", \"tool\"]\n",
            _ => "",
        };
        let beta = if self.name == "elbow" { "\"joint*.beta\" = { sigma_deg = 0 }\n" } else { "" };
        format!(
            "[parameters]\n{}[random]\n{random}{beta}[noise]\nposition_sigma_mm = 0.05\n[poses]\n{}\ntemperature_C = [15, 30]\n\
             payload_kg = [0, 1, 2]\n{more}{effect}",
            around.truth,
            self.ranges.join("\n"),
        )
    }

    /// Draws the fixtures for one way of measuring at positions that the nominal arm reaches.
    pub fn around(&self, how: Measured, seed: u64) -> Around {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let nothing = Around { declared: String::new(), truth: String::new() };
        let bare = self.problem(Measured::Positions, &nothing);
        let poses = self.truth(Measured::Positions, &nothing, "");
        let truth = flexcal::rig::Truth::parse(&poses, Path::new("truth.toml"), &bare).unwrap();
        let rig = Rig::new(bare, Vec::new());
        let mut reached = || {
            let one =
                |&(from, to): &(f64, f64)| from + (to - from) * random.random_range(0.15..0.85);
            let configuration = truth.poses.joints.iter().map(one).collect();
            rig.position(&PoseConditions { configuration, ..PoseConditions::default() }).unwrap()
        };
        let cloud: Vec<Vector3<f64>> = (0..400).map(|_| reached()).collect();
        let middle = cloud.iter().sum::<Vector3<f64>>() / 400.0;
        let reach =
            (cloud.iter().map(|at| (at - middle).norm_squared()).sum::<f64>() / 400.0).sqrt();
        let mut around = Around { declared: String::new(), truth: String::new() };
        let mut places: Vec<Vector3<f64>> = Vec::new();
        for at in cloud.iter().filter(|at| (*at - middle).norm() < 1.2 * reach) {
            if places.len() < 6 && places.iter().all(|known| (known - at).norm() > 0.5 * reach) {
                places.push(*at);
            }
        }
        match how {
            Measured::Positions => {}
            Measured::Sockets => around.sockets(&places),
            Measured::Tilts => around.sockets(&places[..3]),
            Measured::Wires => {
                let corners =
                    [[1.5, 0.5, 0.9], [-1.3, 1.2, 0.2], [0.3, -1.6, 1.2], [-0.9, -1.0, -0.8]];
                for (k, corner) in corners.into_iter().enumerate() {
                    around.anchor(k, middle + Vector3::from(corner) * reach * 1.5);
                }
            }
            Measured::Bars => {
                for (k, at) in places.iter().take(3).enumerate() {
                    around.sphere(k, *at, 0.6 * reach);
                }
            }
            Measured::Touches => around.touches(&places, &middle, reach),
            Measured::Mixed => {
                around.sockets(&places[..3]);
                around.touches(&places, &middle, reach);
            }
        }
        around
    }
}

impl Around {
    fn places(&mut self, name: &str, numbers: [(&str, f64); 3]) {
        for (field, metres) in numbers {
            let _ = writeln!(self.truth, "\"{name}.{field}\" = {{ mm = {:.6} }}", metres * 1e3);
        }
    }

    fn at(&mut self, name: &str, at: &Vector3<f64>) {
        self.places(name, [("x", at.x), ("y", at.y), ("z", at.z)]);
    }

    fn sockets(&mut self, places: &[Vector3<f64>]) {
        for (k, at) in places.iter().enumerate() {
            let _ = writeln!(self.declared, "[[point]]\nname = \"p{k}\"");
            self.at(&format!("point[p{k}]"), &at.map(|x| (x * 1e9).round() / 1e9));
        }
        let apart = (places[0] - places[1]).norm() * 1e3;
        let _ = writeln!(
            self.declared,
            "[[distance]]\nbetween = [\"p0\", \"p1\"]\nmm = {apart:.6}\nsigma_mm = 0.01"
        );
    }

    fn anchor(&mut self, k: usize, at: Vector3<f64>) {
        let _ = writeln!(self.declared, "[[anchor]]\nname = \"a{k}\"");
        self.at(&format!("anchor[a{k}]"), &at);
    }

    fn sphere(&mut self, k: usize, at: Vector3<f64>, radius: f64) {
        let _ = writeln!(
            self.declared,
            "[[surface]]\nname = \"s{k}\"\nkind = \"sphere\"\nradius_m = {radius:.6}"
        );
        self.at(&format!("surface[s{k}]"), &at);
    }

    fn plane(&mut self, name: &str, turned: [f64; 2], through: &Vector3<f64>) {
        let [rx, ry] = turned;
        let normal = nalgebra::Rotation3::new(Vector3::new(rx, ry, 0.0)) * Vector3::z();
        let _ = writeln!(self.declared, "[[surface]]\nname = \"{name}\"\nkind = \"plane\"");
        let name = format!("surface[{name}]");
        let _ = writeln!(
            self.truth,
            "\"{name}.rx\" = {{ rad = {rx} }}\n\"{name}.ry\" = {{ rad = {ry} }}"
        );
        let _ = writeln!(self.truth, "\"{name}.d\" = {{ mm = {:.6} }}", normal.dot(through) * 1e3);
    }

    fn touches(&mut self, places: &[Vector3<f64>], middle: &Vector3<f64>, reach: f64) {
        self.plane("table", [0.03, -0.02], &(middle - Vector3::z() * 0.2 * reach));
        self.plane("wall", [0.1, 1.4], middle);
        self.sphere(9, places[places.len() - 1], 0.4 * reach);
    }
}
