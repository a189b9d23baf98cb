//! Arm of six joints that touches points and surfaces of its surroundings on the rig.

use std::fmt::Write as _;

use flexcal::problem::{PoseConditions, Problem};
use flexcal::rig::Rig;
use nalgebra::{DMatrix, DVector, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::common::arms::parse;
use crate::common::made::normal;

/// Common beginning of all problems of this arm.
pub const ARM: &str = r#"
name = "arm"
joint = [
    { name = "turn", d_m = 0.4 },
    { name = "shoulder", alpha_deg = 90, stiffness_N_m_per_rad = 4e4, body = [{ name = "upper", mass_kg = 8, com_m = [0.3, 0, 0] }] },
    { name = "elbow", a_m = 0.6, stiffness_N_m_per_rad = 2e4, body = [{ name = "fore", mass_kg = 5, com_m = [0, 0.2, 0] }] },
    { name = "roll", alpha_deg = 90, a_m = 0.1, d_m = 0.55 },
    { name = "pitch", alpha_deg = -90 },
    { name = "flange", alpha_deg = 90, d_m = 0.1, body = [{ name = "hand", mass_kg = 2, com_m = [0, 0, 0.1] }] },
]
tool.target_m = [0.05, 0.02, 0.15]

[parameters]
"joint*.alpha" = { sigma_deg = 0.2 }
"joint*.theta" = { sigma_deg = 0.2 }
"joint*.a" = { sigma_mm = 2 }
"joint*.d" = { sigma_mm = 2 }
"joint*.stiffness" = { sigma_relative = 0.3 }
"tool.*" = { sigma_mm = 2 }
"joint1.*" = { fixed = true }
"joint6.theta" = { fixed = true }
"joint6.d" = { fixed = true }
"#;

/// Fixtures of the arm, and σ of each kind of rows.
pub const AROUND: &str = r#"
[[point]]
name = "left"
[[point]]
name = "right"
[[point]]
name = "top"
[[anchor]]
name = "A"
[[anchor]]
name = "B"
[[surface]]
name = "table"
kind = "plane"
[[surface]]
name = "ball"
kind = "sphere"
radius_m = 0.2
[[distance]]
between = ["left", "right"]
mm = 593.717104
sigma_mm = 0.01
[data]
point_sigma_mm = 0.05
distance_sigma_mm = 0.05
surface_sigma_mm = 0.05
position_sigma_mm = 0.05
tilt_sigma_deg = 0.002
held_out = { fraction = 0.2, seed = 1 }
"#;

/// True positions of the points.
pub const POINTS: [(&str, [f64; 3]); 3] =
    [("left", [0.7, 0.25, 0.3]), ("right", [0.6, -0.3, 0.5]), ("top", [0.4, 0.3, 0.8])];
pub const ANCHORS: [(&str, [f64; 3]); 2] = [("A", [1.5, 0.5, 1.2]), ("B", [-0.3, -1.4, 0.8])];
pub const NORMAL: [f64; 3] = [0.05, -0.02, 0.998_548_446];
pub const HEIGHT: f64 = 0.2;
pub const CENTRE: [f64; 3] = [0.6, 0.3, 0.4];
pub const RADIUS: f64 = 0.2;

/// Standard deviation of every measurement [m].
const SIGMA: f64 = 5e-5;

/// Anchors on a line.
pub const LINE: [(&str, [f64; 3]); 3] =
    [("A", [1.5, 0.5, 1.2]), ("B", [1.5, -0.5, 1.2]), ("C", [1.5, -1.5, 1.2])];

/// Returns a problem with this arm.
pub fn problem(more: &str) -> Problem {
    parse(&format!("{ARM}{more}"))
}

/// Draws the true arm from the priors of the declared one.
pub fn true_arm(problem: &Problem, seed: u64) -> (Problem, Vec<(String, f64)>) {
    let mut arm = problem.clone();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut truth = Vec::new();
    let mut moved = |name: String, value: &mut f64, sigma: f64| {
        *value += sigma * normal(&mut random);
        truth.push((name, *value));
    };
    for (k, joint) in arm.joints.iter_mut().enumerate().skip(1) {
        let angle = 0.2_f64.to_radians();
        moved(format!("joint{}.alpha", k + 1), &mut joint.alpha, angle);
        moved(format!("joint{}.a", k + 1), &mut joint.a, 2e-3);
        if k < 5 {
            moved(format!("joint{}.theta", k + 1), &mut joint.theta, angle);
            moved(format!("joint{}.d", k + 1), &mut joint.d, 2e-3);
        }
        if let Some(stiffness) = &mut joint.stiffness {
            let mut ln = stiffness.ln();
            moved(String::new(), &mut ln, 0.3);
            *stiffness = ln.exp();
        }
    }
    for (axis, name) in ["tool.x", "tool.y", "tool.z"].into_iter().enumerate() {
        moved(name.to_owned(), &mut arm.tool.target[axis], 2e-3);
    }
    truth.retain(|(name, _)| !name.is_empty());
    truth.extend(
        arm.joints
            .iter()
            .enumerate()
            .filter_map(|(k, joint)| Some((format!("joint{}.stiffness", k + 1), joint.stiffness?))),
    );
    (arm, truth)
}

/// Simulator of a table in which the kinds of rows alternate.
pub struct Bench {
    rig: Rig,
    random: ChaCha8Rng,
}

impl Bench {
    pub fn new(arm: Problem, seed: u64) -> Self {
        Self { rig: Rig::new(arm, Vec::new()), random: ChaCha8Rng::seed_from_u64(seed) }
    }

    fn at(&self, q: &[f64]) -> Vector3<f64> {
        let conditions = PoseConditions { configuration: q.to_vec(), ..PoseConditions::default() };
        self.rig.position(&conditions).unwrap()
    }

    /// Returns the tilts of the x and y axes of the last frame [°].
    fn tilts(&self, q: &[f64]) -> [f64; 2] {
        let conditions = PoseConditions { configuration: q.to_vec(), ..PoseConditions::default() };
        let (_, turned) = self.rig.pose(&conditions).unwrap();
        [Vector3::x(), Vector3::y()].map(|axis| (turned * axis).z.asin().to_degrees())
    }

    fn anywhere(&mut self) -> Vec<f64> {
        let reach = [1.5, 0.8, 0.8, 1.5, 1.2, 2.0];
        let middle = [0.0, 0.5, -0.5, 0.0, 0.5, 0.0];
        reach
            .iter()
            .zip(middle)
            .map(|(reach, middle)| middle + reach * self.random.random_range(-1.0..1.0))
            .collect()
    }

    /// Returns a configuration in which `miss` of the target position vanishes, near a random one.
    pub fn contact(&mut self, miss: &dyn Fn(&Vector3<f64>) -> Vec<f64>) -> Vec<f64> {
        loop {
            let mut q = DVector::from_vec(self.anywhere());
            let start = q.clone();
            for _ in 0..30 {
                let now = DVector::from_vec(miss(&self.at(q.as_slice())));
                if now.amax() < 1e-10 && (&q - &start).amax() < 2.5 {
                    return q.as_slice().to_vec();
                }
                let column = |j: usize| {
                    let mut moved = q.clone();
                    moved[j] += 1e-6;
                    (DVector::from_vec(miss(&self.at(moved.as_slice()))) - &now) / 1e-6
                };
                let columns: Vec<DVector<f64>> = (0..q.len()).map(column).collect();
                let jacobian = DMatrix::from_columns(&columns);
                let step = jacobian.svd(true, true).solve(&now, 1e-3).unwrap();
                let length = step.amax();
                q -= step * (0.3 / length.max(0.3));
            }
        }
    }

    fn noise(&mut self) -> f64 {
        SIGMA * normal(&mut self.random)
    }

    /// Returns `rows` rows of each of `kinds`, in turn, as CSV.
    pub fn table(&mut self, kinds: &[&str], rows: usize) -> String {
        let mut text = String::from(
            "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,x_mm,y_mm,z_mm,point,anchor,distance_mm,surface,offset_mm,frame,tilt_x_deg,tilt_y_deg\n",
        );
        for k in 0..rows {
            for &kind in kinds {
                let (q, cells) = self.row(kind, k);
                let q: Vec<String> = q.iter().map(|q| format!("{q:.12}")).collect();
                let _ = writeln!(text, "{},{cells}", q.join(","));
            }
        }
        text
    }

    fn row(&mut self, kind: &str, k: usize) -> (Vec<f64>, String) {
        let mm = |x: f64| format!("{:.7}", x * 1e3);
        match kind {
            "position" => {
                let q = self.anywhere();
                let at = self.at(&q) + Vector3::from_fn(|_, _| self.noise());
                (q, format!("{},{},{},,,,,,,,", mm(at.x), mm(at.y), mm(at.z)))
            }
            "point" => {
                let (name, place) = POINTS[k % 3];
                let place = Vector3::from(place) + Vector3::from_fn(|_, _| self.noise());
                (self.contact(&|at| (at - place).as_slice().to_vec()), format!(",,,{name},,,,,,,"))
            }
            "distance" | "distance on a line" => {
                let (name, place) = if kind == "distance" { ANCHORS[k % 2] } else { LINE[k % 3] };
                let q = self.anywhere();
                let length = (self.at(&q) - Vector3::from(place)).norm() + self.noise();
                (q, format!(",,,,{name},{},,,,,", mm(length)))
            }
            "plane" => {
                let (normal, offset) = (Vector3::from(NORMAL).normalize(), 2e-3 * (k % 3) as f64);
                let q = self.contact(&|at| vec![normal.dot(at) - HEIGHT - offset]);
                (q, format!(",,,,,,table,{},,,", mm(offset + self.noise())))
            }
            "tilt" => {
                let q = self.anywhere();
                let mut tilts = self.tilts(&q);
                for tilt in &mut tilts {
                    *tilt += 0.002 * normal(&mut self.random);
                }
                (q, format!(",,,,,,,,flange,{:.7},{:.7}", tilts[0], tilts[1]))
            }
            _ => {
                let q = self.contact(&|at| vec![(at - Vector3::from(CENTRE)).norm() - RADIUS]);
                (q, format!(",,,,,,ball,{},,,", mm(self.noise())))
            }
        }
    }
}
