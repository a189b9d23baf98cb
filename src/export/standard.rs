//! Rigid geometries as modified Denavit–Hartenberg parameters, and as standard ones close to the
//! nominal ones.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt::Write as _;

use nalgebra::Vector3;
use rand::RngExt as _;

use super::answers::command_range;
use super::error::ExportError;
use crate::mechanics::{self, Arm};
use crate::problem::{Joint, JointKind, Problem};
use crate::quantity::format::number;
use crate::random::stream;
use crate::spatial::Frame;
use crate::urdf::{Steps, yaml_key};

/// Largest sine of the angle between consecutive nominal axes between which a row has β: 6°, as for
/// joints of a URDF.
///
/// The common normal of axes with the angle ε moves by δ/ε along them if one of them tilts by δ, so
/// that d would become arbitrarily large.
const MAX_NEARLY_PARALLEL_SINE: f64 = 0.105;
/// Length of the common normal \[m\] up to which its direction, and thus that of a, is
/// undetermined.
const MIN_NORMAL: f64 = 1e-12;
/// Largest deviation of a transform from the form Rx(α) Tx(a) at which the last row can contain it
/// \[1\] or \[m\].
const LAST_ROW_TOLERANCE: f64 = 1e-12;
/// Largest displacement of the target by leaving out β in all rows, up to which the table has no β
/// \[m\].
const MAX_OMITTED_BETA: f64 = 1e-10;
/// Difference between an exported and a nominal length, above which a note mentions it \[m\].
const MAX_UNMENTIONED_CHANGE: f64 = 0.05;
/// Number of random poses in which the effect of β is evaluated, and seed of these poses.
const BETA_POSES: (usize, u64) = (300, 0x6265_7461);

/// Parameters of a row: Rz(θ + q) Tz(d) Tx(a) Rx(α) Ry(β), angles \[rad\] and lengths \[m\].
#[derive(Debug, Clone, Copy, Default)]
struct Row {
    theta: f64,
    d: f64,
    a: f64,
    alpha: f64,
    beta: f64,
}

/// Table of standard DH parameters: base · Π Rz(θ+q) Tz(d) Tx(a) Rx(α) Ry(β) · tool.
///
/// Base, tool and rows have the form of the nominal arm, whose rows are those of a data sheet. If
/// consecutive axes are nearly parallel, d keeps its nominal value and β, the rotation about y by
/// Hayati, is identified instead.
#[derive(Debug, Clone)]
pub struct StandardTable {
    /// Names of the moving joints, one per row.
    names: Vec<String>,
    table: Converted,
    /// Rows of the nominal arm.
    nominal: Vec<Row>,
    /// Largest displacement of the target if β is left out \[m\]; `None` if no row needs β.
    beta_effect: Option<f64>,
}

/// Rows of an arm with the constant transforms before and behind them.
#[derive(Debug, Clone)]
struct Converted {
    base: Frame<f64>,
    rows: Vec<Row>,
    tool: Frame<f64>,
    /// Part of each row but the last that comes from the transform to the next axis.
    links: Vec<Link>,
}

/// Part of a row that comes from the transform between its axis and the next one.
#[derive(Debug, Clone, Copy)]
struct Link {
    /// Part of θ \[rad\].
    theta: f64,
    /// Part of d \[m\].
    d: f64,
    /// True if the axes are nearly parallel, so that the row has β.
    has_beta: bool,
}

/// Transforms between the axes of an arm.
struct Chain {
    /// For each moving joint, the transform before it, and its θ \[rad\] and d \[m\].
    joints: Vec<(Frame<f64>, f64, f64)>,
    /// Transform behind the last moving joint.
    end: Frame<f64>,
}

impl Chain {
    /// Takes the transforms of an arm.
    fn of(arm: &Arm<f64>) -> Self {
        let Steps { before, end } = Steps::new(arm);
        let moving = arm.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
        let joint = |(mut frame, joint): (Frame<f64>, &mechanics::Joint<f64>)| {
            frame.translate_z(-joint.d);
            frame.rotate_z((-joint.theta).sin_cos());
            (frame, joint.theta, joint.d)
        };
        Self { joints: before.into_iter().zip(moving).map(joint).collect(), end }
    }

    /// Converts the chain to rows close to those of the nominal arm, `nominal`; `None` if the chain
    /// is that of the nominal arm itself.
    fn convert(&self, nominal: Option<&Converted>) -> Converted {
        let base = self.joints.first().map_or_else(Frame::identity, |joint| joint.0);
        let (mut rows, mut links) = (Vec::new(), Vec::new());
        // Rotation about and shift along an axis that the previous row leaves to this one.
        let mut rest = (0.0, 0.0);
        for (k, &(_, theta, d)) in self.joints.iter().enumerate() {
            let (theta, d) = (theta + rest.0, d + rest.1);
            let Some((frame, ..)) = self.joints.get(k + 1) else {
                rows.push(Row { theta, d, ..Row::default() });
                break;
            };
            let (row, link) = split(frame, nominal.and_then(|nominal| nominal.links.get(k)));
            let left = row.frame(0.0, true).inverse().compose(frame);
            rest = (left.axes[0].y.atan2(left.axes[0].x), left.origin.z);
            rows.push(Row { theta: theta + row.theta, d: d + row.d, ..row });
            links.push(link);
        }
        let tool = match (rows.last_mut(), nominal) {
            (Some(last), Some(nominal)) => {
                let alpha = nominal.rows.last().map_or(0.0, |row| row.alpha);
                let end = self.end.compose(&nominal.tool.inverse());
                last_row(last, &end, alpha).compose(&nominal.tool)
            }
            (Some(last), None) if is_row(&self.end) => {
                let y = self.end.axes[1];
                last_row(last, &self.end, y.z.atan2(y.y))
            }
            (..) => self.end,
        };
        if let Some(nominal) = nominal {
            for (row, nominal) in rows.iter_mut().zip(&nominal.rows) {
                row.theta -= TAU * ((row.theta - nominal.theta) / TAU).round();
                row.alpha -= TAU * ((row.alpha - nominal.alpha) / TAU).round();
            }
        }
        Converted { base, rows, tool, links }
    }
}

/// Returns true if a transform has the form Rx(α) Tx(a), so that the last row can contain it.
fn is_row(end: &Frame<f64>) -> bool {
    (end.axes[0] - Vector3::x()).norm() < LAST_ROW_TOLERANCE
        && end.origin.yz().norm() < LAST_ROW_TOLERANCE
}

/// Adds to the last row the part that it can contain of the transform `end` behind its axis, and
/// returns the remaining transform. The twist of `end` is near `alpha` \[rad\].
fn last_row(row: &mut Row, end: &Frame<f64>, alpha: f64) -> Frame<f64> {
    // The small rotation before Rx(alpha) is Rz Rx Ry; the rotation about y remains.
    let mut small = *end;
    small.rotate_x((-alpha).sin_cos());
    let y = small.axes[1];
    let theta = (-y.x).atan2(y.y);
    let (sin, cos) = theta.sin_cos();
    let at = end.origin;
    let held = Row {
        theta,
        d: at.z,
        a: cos * at.x + sin * at.y,
        alpha: alpha + y.z.clamp(-1.0, 1.0).asin(),
        beta: 0.0,
    };
    *row = Row { theta: row.theta + theta, d: row.d + held.d, ..held };
    held.frame(0.0, false).inverse().compose(end)
}

/// Splits the transform between two axes into a row, and a rotation about and a shift along the
/// second axis, which are not returned. `nominal` is the split of the nominal arm.
///
/// Axes that are nearly parallel keep the nominal d and get β; others have β = 0.
fn split(frame: &Frame<f64>, nominal: Option<&Link>) -> (Row, Link) {
    let (z, p) = (frame.axes[2], frame.origin);
    let sine = z.xy().norm();
    let near = nominal.map_or(sine < MAX_NEARLY_PARALLEL_SINE, |link| link.has_beta);
    let reference = nominal.map_or(0.0, |link| link.theta);
    let (mut theta, d) = if near {
        // The second axis meets the plane at right angles to the first one at this height.
        let d = nominal.map_or(p.z, |link| link.d);
        let foot = p + z * ((d - p.z) / z.z);
        (if foot.xy().norm() > MIN_NORMAL { foot.y.atan2(foot.x) } else { reference }, d)
    } else {
        let theta = z.x.atan2(-z.y);
        let shift = Vector3::new(theta.sin(), -theta.cos(), 0.0).dot(&p) / sine;
        (theta, p.z - shift * z.z)
    };
    // The common normal has two directions; the one nearer to the nominal one is used.
    let away = theta - reference;
    if (away - TAU * (away / TAU).round()).abs() > FRAC_PI_2 {
        theta -= PI.copysign(theta);
    }
    let (sin, cos) = theta.sin_cos();
    let foot = p + z * if near { (d - p.z) / z.z } else { 0.0 };
    let a = cos * foot.x + sin * foot.y;
    let across = cos * z.y - sin * z.x;
    let beta = if near { (cos * z.x + sin * z.y).clamp(-1.0, 1.0).asin() } else { 0.0 };
    let row = Row { theta, d, a, alpha: (-across).atan2(z.z), beta };
    (row, Link { theta, d, has_beta: near })
}

impl Row {
    /// Returns the transform of the row with `q` \[rad\] added to θ; without `with_beta`, β is
    /// taken as 0.
    fn frame(&self, q: f64, with_beta: bool) -> Frame<f64> {
        let mut frame = Frame::identity();
        frame.rotate_z((self.theta + q).sin_cos());
        frame.translate_z(self.d);
        frame.translate_x(self.a);
        frame.rotate_x(self.alpha.sin_cos());
        if with_beta {
            frame.rotate_y(self.beta.sin_cos());
        }
        frame
    }
}

impl StandardTable {
    /// Converts the geometry `arm` of a problem.
    ///
    /// Lengths along parallel axes are divided between rows as in the estimate. The first row
    /// contains θ and d of joint 1, and the last row as much of the transform to the tool as fits.
    ///
    /// # Errors
    /// Returns an error if the joints branch.
    pub fn new(problem: &Problem, arm: &Arm<f64>) -> Result<Self, ExportError> {
        problem.require_chain("export to a table")?;
        let nominal = Chain::of(&Arm::nominal(problem)).convert(None);
        let table = Chain::of(arm).convert(Some(&nominal));
        let moving = problem.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
        let names = moving.map(|joint| joint.name.clone()).collect();
        let beta_effect = table.beta_effect(problem);
        Ok(Self { names, table, nominal: nominal.rows, beta_effect })
    }

    /// Returns the table as the text of a YAML file.
    pub fn yaml(&self) -> String {
        let beta = if self.beta_effect.is_some() { " Ry(beta_1)" } else { "" };
        let mut text = format!(
            "# Standard Denavit-Hartenberg parameters; q adds to theta, of a prismatic joint to d:\n\
             # base Rz(theta_1 + q_1) Tz(d_1) Tx(a_1) Rx(alpha_1){beta} ... tool\n"
        );
        for note in self.notes() {
            let _ = writeln!(text, "# {note}");
        }
        let cells = self.cells();
        let width = |column: usize| {
            cells.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max()
        };
        for row in &cells {
            text.push_str("#  ");
            for (column, cell) in row.iter().enumerate() {
                let _ = write!(text, " {cell:>0$}", width(column).unwrap_or(0) + 1);
            }
            text.push('\n');
        }
        for (name, frame) in [("base", &self.table.base), ("tool", &self.table.tool)] {
            let _ = writeln!(text, "{name}:\n  xyz_m: {}", list(frame.origin.as_slice()));
            let _ = writeln!(text, "  rpy_rad: {}", list(frame.roll_pitch_yaw().as_slice()));
        }
        text.push_str("dh:\n");
        for (name, row) in self.names.iter().zip(&self.table.rows) {
            let _ = writeln!(text, "  {}:", yaml_key(name));
            let values = [
                ("theta_rad", row.theta),
                ("d_m", row.d),
                ("a_m", row.a),
                ("alpha_rad", row.alpha),
            ];
            let beta = self.beta_effect.map(|_| ("beta_rad", row.beta));
            for (name, value) in values.into_iter().chain(beta) {
                let _ = writeln!(text, "    {name}: {}", float(value));
            }
        }
        text
    }

    /// Returns the table in units of a data sheet, \[mm\] and \[°\]: the header and a line for each
    /// row.
    pub fn cells(&self) -> Vec<Vec<String>> {
        let header = ["joint", "theta, °", "d, mm", "a, mm", "alpha, °", "beta, °"];
        let columns = if self.beta_effect.is_some() { header.len() } else { header.len() - 1 };
        let line = |(name, row): (&String, &Row)| {
            let degrees = |angle: f64| number(angle.to_degrees(), 4);
            let length = |length: f64| number(length * 1e3, 3);
            let cells = [degrees(row.theta), length(row.d), length(row.a), degrees(row.alpha)];
            let beta = [degrees(row.beta)];
            std::iter::once(name.clone()).chain(cells).chain(beta).take(columns).collect()
        };
        let header = header.iter().take(columns).map(|&word| word.to_owned()).collect();
        std::iter::once(header).chain(self.names.iter().zip(&self.table.rows).map(line)).collect()
    }

    /// Returns notes for the reader of the table: about the effect of β, and about lengths far from
    /// their nominal values.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if let Some(effect) = self.beta_effect {
            notes.push(format!(
                "beta (Hayati) is the tilt about y of an axis that is nearly parallel to the one before; a controller without beta \
                 misplaces the target by up to {} mm, if the other values stay.",
                number(effect * 1e3, 3)
            ));
        }
        for ((name, row), nominal) in self.names.iter().zip(&self.table.rows).zip(&self.nominal) {
            for (what, value, nominal) in [("d", row.d, nominal.d), ("a", row.a, nominal.a)] {
                if (value - nominal).abs() > MAX_UNMENTIONED_CHANGE {
                    notes.push(format!(
                        "{what} of {name} is {} mm, nominally {} mm: so large a change is no error of manufacture. \
                         Neighbouring rows can share lengths in many ways, and only their sum counts.",
                        number(value * 1e3, 1),
                        number(nominal * 1e3, 1)
                    ));
                }
            }
        }
        notes
    }
}

impl Converted {
    /// Returns the position of the target of `problem` in the arm base frame at the commands `q`
    /// \[m\].
    fn target(&self, problem: &Problem, q: &[f64], with_beta: bool) -> Vector3<f64> {
        let moving = problem.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
        let mut frame = self.base;
        for ((row, joint), &q) in self.rows.iter().zip(moving).zip(q) {
            let slides = joint.kind == JointKind::Prismatic;
            let row = Row { d: row.d + if slides { q } else { 0.0 }, ..*row };
            frame = frame.compose(&row.frame(if slides { 0.0 } else { q }, with_beta));
        }
        frame.compose(&self.tool).point(&problem.tool.target)
    }

    /// Returns the largest displacement of the target in random poses if β is left out \[m\];
    /// `None` if it is negligible.
    fn beta_effect(&self, problem: &Problem) -> Option<f64> {
        let mut random = stream(BETA_POSES.1, 0);
        let moving = || problem.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
        let mut largest = 0.0_f64;
        for _ in 0..BETA_POSES.0 {
            let mut command = |joint: &Joint| {
                let (low, high) = command_range(joint);
                low + (high - low) * random.random::<f64>()
            };
            let q: Vec<f64> = moving().map(&mut command).collect();
            let [with, without] = [true, false].map(|beta| self.target(problem, &q, beta));
            largest = largest.max((with - without).norm());
        }
        (largest > MAX_OMITTED_BETA).then_some(largest)
    }
}

/// Returns the geometry of `arm` as YAML, with the parameters that a problem file has: `T_i` =
/// Rx(α) Tx(a) Rz(θ+q) Tz(d) Ry(β). In a tree each joint states the `parent` on which it stands.
pub fn modified_dh(problem: &Problem, arm: &Arm<f64>) -> String {
    let mut text = "# Modified Denavit-Hartenberg parameters with Hayati's beta; q adds to theta, of a prismatic joint to d:\n\
                    # T_i = Rx(alpha) Tx(a) Rz(theta + q) Tz(d) Ry(beta)\nmdh:\n"
        .to_owned();
    let before = |place: usize| place.checked_sub(1);
    let is_tree = (0..).zip(&problem.joints).any(|(place, joint)| joint.parent != before(place));
    for (declared, joint) in problem.joints.iter().zip(&arm.joints) {
        let _ = writeln!(text, "  {}:", yaml_key(&declared.name));
        if is_tree {
            let parent = declared.parent.and_then(|parent| problem.joints.get(parent));
            let parent = parent.map_or("base".to_owned(), |parent| yaml_key(&parent.name));
            let _ = writeln!(text, "    parent: {parent}");
        }
        if let Some(placed) = &joint.placement {
            let rpy = placed.rpy.each_ref().map(|angle| angle.value);
            let _ = writeln!(text, "    xyz_m: {}", list(placed.xyz.as_slice()));
            let _ = writeln!(text, "    rpy_rad: {}", list(&rpy));
        }
        for (name, value) in [
            ("alpha_rad", joint.alpha.value),
            ("a_m", joint.a),
            ("theta_rad", joint.theta),
            ("d_m", joint.d),
            ("beta_rad", joint.beta.value),
        ] {
            let _ = writeln!(text, "    {name}: {}", float(value));
        }
    }
    text
}

/// Returns a number in a form that YAML reads as a float, rounded to 10⁻¹⁵.
pub(super) fn float(value: f64) -> String {
    format!("{:?}", (value * 1e15).round() / 1e15 + 0.0)
}

/// Returns a YAML list of numbers.
pub(super) fn list(values: &[f64]) -> String {
    format!("[{}]", values.iter().map(|&value| float(value)).collect::<Vec<_>>().join(", "))
}
