//! Conversion of a chain to the text of a problem, with the masses of its links.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Write as _;
use std::path::Path;

use nalgebra::Vector3;

use super::carried::carried_masses;
use super::chain::Chain;
use super::fork::{Fork, trunk};
use super::free::distinguishable_parameters;
use super::lines::Step;
use super::notes;
use super::read::Kind;
use super::row::Row;
use crate::error::{InputError, UrdfErrorKind};
use crate::problem::read::FORBIDDEN_IN_FOLDER_NAMES;
use crate::problem::{Joint, Problem, quoted};
use crate::spatial::Frame;

/// Largest magnitude that counts as zero \[rad\] or \[m\]. Right angles written with eleven
/// decimals have rounding errors of this size.
const MAX_ROUNDING: f64 = 1e-11;
/// Default standard deviation of a measured coordinate, typical of a laser tracker in a workshop
/// \[mm\].
pub const SIGMA_MM: f64 = 0.05;
/// Default fraction of held-out poses.
pub const HELD_OUT: f64 = 0.3;
/// Maximum length of a problem's name taken from the robot's \[characters\].
const MAX_NAME_CHARS: usize = 60;

/// Lines with the range of a joint without limits, from which `check` and `plan` draw poses.
const CONTINUOUS_RANGE: &str = "# A joint without limits: poses are planned within one turn.\n\
     min_deg = -180\nmax_deg = 180\n";

/// Section of the measured point, which the user fills in.
pub(super) const TOOL: &str = "\n[tool]\ntarget_m = [0, 0, 0]                             # fill in: the measured \
                    point, in the frame of the tip\n\
                    # payload_kg = 10                              # if the hand carries a load\n\
                    # payload_at_m = [0, 0, 0.1]                   # its centre of mass, same frame\n";

/// Problem made from a chain of a URDF.
#[derive(Debug, Clone)]
pub struct Description {
    /// Name of the problem.
    pub name: String,
    /// Text of the `problem.toml`.
    pub text: String,
    /// Notes for the user about assumptions and ignored parts.
    pub notes: Vec<String>,
}

/// Converts a chain to a problem whose measurement file does not exist yet.
///
/// # Errors
/// Returns an error if a number of the URDF is too large for a problem.
pub fn describe(chain: &Chain) -> Result<Description, InputError> {
    describe_measured(chain, &[], None)
}

/// Numbers of corners that stand for a tag, which has four.
pub const TAG: [usize; 2] = [1, 1];

/// Converts a chain like [`describe`], with the chains to further tips of the same robot as branches
/// of one tree. A `board` (numbers of corners along and across, or [`TAG`], and their distance \[mm\]) makes a
/// problem of a camera at the tip that sees it, in the world or at the second tip; the other way
/// round if the third value is true. Otherwise positions are measured.
///
/// # Errors
/// Returns the errors of [`describe`].
pub fn describe_measured(
    chain: &Chain,
    further: &[Chain],
    board: Option<([usize; 2], f64, bool)>,
) -> Result<Description, InputError> {
    let mut notes = Vec::new();
    let (mut rows, mut tips) = (Vec::new(), Vec::new());
    let chains: Vec<&Chain> = std::iter::once(chain).chain(further).collect();
    for (of, branch) in chains.iter().enumerate() {
        let more = self::rows(branch, &Fork::new(&chains, of, &rows), &mut notes);
        rows.extend(more);
        tips.push((branch.ends().1, rows.len()));
    }
    let name = name(&chain.robot.name);
    let arm = arm_toml(chain, &name, &rows);
    // Only numbers of excessive size cause an error here.
    let problem = Problem::parse(&arm, Path::new("problem.toml")).map_err(
        |InputError { location, kind }| {
            let key = location.key.unwrap_or_default();
            chain.robot.error(UrdfErrorKind::AsProblem { key, why: kind.to_string() })
        },
    )?;
    let ends: Vec<usize> = tips.iter().map(|(_, end)| *end).collect();
    let mut free = distinguishable_parameters(&problem, &ends, board.is_some())?;
    if board.is_some() && !further.is_empty() {
        // A camera on one branch that looks at another one does not see how the trunk moves.
        let trunk = trunk(&chains);
        let is_of_trunk = |row: &Row| row.joint.is_some_and(|joint| trunk.contains(&joint));
        for (number, _) in (1..).zip(&rows).filter(|(_, row)| is_of_trunk(row)) {
            free.retain(|name| !name.starts_with(&format!("joint{number}.")));
        }
    }
    notes.extend(notes::of_chain(chain, further));
    let mut said = std::collections::HashSet::new();
    notes.retain(|note| said.insert(note.clone()));
    let names: Vec<String> =
        ends.iter().filter_map(|end| Some(rows.get(end - 1)?.name.clone())).collect();
    let view = match board {
        Some((corners, distance, in_world)) => {
            view((corners, distance), in_world, &names, chain.camera.as_deref())
        }
        None if further.is_empty() => TOOL.to_owned(),
        None => targets(&tips),
    };
    let (parameters, data) =
        (parameters(&rows, &free, board.is_some()), data(&chains, &rows, board.is_some()));
    let text = format!("{arm}{view}\n{parameters}\n{data}");
    Ok(Description { name, text, notes })
}

/// Returns `name`, changed if a joint of the URDF has the same name, because columns are named
/// after joints.
fn avoid_joint_names(chain: &Chain, name: &str) -> String {
    let is_joint_name = chain.robot.joints.iter().any(|joint| joint.name == name);
    if is_joint_name { format!("{name} frame") } else { name.to_owned() }
}

/// Converts a chain, behind a fork, to the joints of a problem; adds notes about assumptions to
/// `notes`.
fn rows(chain: &Chain, fork: &Fork, notes: &mut Vec<String>) -> Vec<Row> {
    let stages = chain.stages.get(fork.shared..).unwrap_or_default();
    let start = stages.first().map(|stage| fork.in_row(&stage.step));
    let steps = start.iter().chain(stages.iter().skip(1).map(|stage| &stage.step));
    let mut steps: Vec<Step> = steps.map(Step::from_frame).collect();
    let mut rows = Vec::new();
    // The parameters α and a may not suffice to reach the first axis from the base.
    if let (Some(first), Some(start)) = (steps.first_mut(), start)
        && [first.theta_before, first.d_before, first.beta]
            .iter()
            .any(|value| value.abs() > MAX_ROUNDING)
    {
        *first = Step::default();
        let tip = fork.parent.map(|_| format!("{} mounting", chain.ends().1));
        rows.push(Row {
            name: avoid_joint_names(chain, tip.as_deref().unwrap_or("mounting")),
            kind: "fixed",
            placement: Some(start),
            ..Row::default()
        });
    }
    let rows_before_chain = rows.len();
    // The transform after the last joint becomes its θ and d if possible, otherwise a fixed joint.
    let [x, _, z] = &chain.end.axes;
    let on_axis = z.xy().norm() + chain.end.origin.xy().norm() < MAX_ROUNDING
        && z.z > 0.0
        && !stages.is_empty();
    let end =
        Step { theta_before: x.y.atan2(x.x), d_before: chain.end.origin.z, ..Step::default() };
    steps.push(if on_axis { end } else { Step::default() });
    for ((stage, step), next) in stages.iter().zip(&steps).zip(steps.iter().skip(1)) {
        let Some(joint) = chain.robot.joints.get(stage.joint) else { continue };
        rows.push(Row {
            name: joint.name.clone(),
            joint: Some(stage.joint),
            kind: if joint.kind == Kind::Prismatic { "prismatic" } else { "revolute" },
            placement: None,
            mimic: stage
                .mimic
                .and_then(|(leader, ratio)| Some((chain.stages.get(leader)?.joint, ratio))),
            numbers: [
                step.alpha,
                step.a,
                step.theta + next.theta_before,
                step.d + next.d_before,
                next.beta,
            ],
            limits: Some(joint.limits).filter(|_| stage.mimic.is_none()),
            ..Row::default()
        });
        if joint.lacks_axis {
            let start = joint.span.start;
            notes.push(format!(
                "{} has no <axis> ({}), so its axis is x of its frame; write <axis xyz=\"…\"/> if \
                 it is another one",
                joint.name,
                chain.robot.source.locate(start..start + 1)
            ));
        }
        if let Some((lower, upper)) = joint.reversed_limits {
            notes.push(format!(
                "{}: the limits {lower} to {upper} exclude each other (the lower one is above \
                 the upper one) and are taken as none",
                joint.name
            ));
        }
        if let (None, Some((leader, ..))) = (stage.mimic, joint.mimic)
            && let Some(leader) = chain.robot.joints.get(leader)
        {
            notes.push(format!(
                "{} follows {}, which is not in the chain: its own value is its q",
                joint.name, leader.name
            ));
        }
    }
    if !on_axis {
        let name = avoid_joint_names(chain, chain.ends().1);
        let end = if stages.is_empty() { fork.in_row(&chain.end) } else { chain.end };
        rows.push(Row { name, kind: "fixed", placement: Some(end), ..Row::default() });
    }
    if let Some(first) = rows.first_mut() {
        first.parent = fork.parent;
    }
    let mut frame = fork.frame;
    for row in &mut rows {
        frame = row.advanced(&frame);
        row.frame = frame;
    }
    let (masses, beside) = carried_masses(chain, &fork.beside);
    for link in masses {
        let place = link.stage.checked_sub(fork.shared).map(|place| place + rows_before_chain);
        if let Some(row) = place.and_then(|place| rows.get_mut(place)) {
            let at = row.frame.resolve(&(link.at - row.frame.origin));
            row.bodies.push((link.name, link.mass, at));
        }
    }
    if !beside.is_empty() {
        notes.push(format!("masses beside the chain are taken with {} at zero", beside.join(", ")));
    }
    rows
}

/// Returns the robot's name, changed so that it is a valid folder name; `arm` if nothing is left.
fn name(robot: &str) -> String {
    let fit: String = robot
        .chars()
        .map(|c| if FORBIDDEN_IN_FOLDER_NAMES.contains(c) || c.is_whitespace() { '-' } else { c })
        .collect();
    let fit: String =
        fit.trim_matches(|c| c == '.' || c == '-').chars().take(MAX_NAME_CHARS).collect();
    if fit.is_empty() || fit.chars().any(crate::error::is_hidden) { "arm".to_owned() } else { fit }
}

/// Formats a number with at most twelve decimals.
fn number(value: f64) -> String {
    let rounded = (value * 1e12).round() / 1e12;
    if rounded.is_finite() { (rounded + 0.0).to_string() } else { value.to_string() }
}

/// Formats an angle \[rad\] in degrees between −180 and 180; right angles are written exactly.
fn degrees(angle: f64) -> String {
    let within = angle - (angle / TAU).round() * TAU;
    let right = (within / FRAC_PI_2).round();
    number(if (within - right * FRAC_PI_2).abs() < MAX_ROUNDING {
        right * 90.0
    } else {
        within.to_degrees()
    })
}

/// Formats a vector as a TOML list; `text` formats each number.
fn list(values: &Vector3<f64>, text: impl Fn(f64) -> String) -> String {
    format!("[{}]", values.iter().map(|value| text(*value)).collect::<Vec<_>>().join(", "))
}

/// Returns the text of the problem up to the section `[tool]`.
fn arm_toml(chain: &Chain, name: &str, rows: &[Row]) -> String {
    let (base, tip) = chain.ends();
    let file = chain.robot.file().file_name().unwrap_or_default().to_string_lossy().into_owned();
    let title: String = format!("{}, {base} to {tip}", chain.robot.name);
    let title: String = title.chars().filter(|&c| !crate::error::is_hidden(c)).collect();
    let file: String = file.chars().filter(|&c| !crate::error::is_hidden(c)).collect();
    let mut text = format!(
        "# From {file}: every [[joint]] is T = Rx(alpha) Tx(a) Rz(theta + q) Tz(d) Ry(beta); docs/problem.md explains all keys.\n\
         name = {}\ntitle = {}\n\n[urdf]\nbase = {}\ntip = {}\n",
        quoted(name),
        quoted(&title),
        quoted(base),
        quoted(tip)
    );
    let number_of = |joint: usize| rows.iter().position(|row| row.joint == Some(joint));
    for row in rows {
        let _ = write!(text, "\n[[joint]]\nname = {}\n", quoted(&row.name));
        if let Some(parent) = row.parent {
            let _ = writeln!(text, "parent = {parent}");
        }
        if row.kind != "revolute" {
            let _ = writeln!(text, "kind = \"{}\"", row.kind);
        }
        let mimic = row.mimic.and_then(|(leader, ratio)| Some((number_of(leader)? + 1, ratio)));
        if let Some((leader, ratio)) = mimic {
            let _ = writeln!(text, "mimic = {{ joint = {leader}, ratio = {} }}", number(ratio));
        }
        if let Some(frame) = &row.placement {
            let rpy = frame.roll_pitch_yaw();
            let _ = writeln!(
                text,
                "xyz_m = {}\nrpy_deg = {}",
                list(&frame.origin, number),
                list(&rpy, degrees)
            );
        }
        let [alpha, a, theta, d, beta] = row.numbers;
        let parameters = [
            ("alpha_deg", alpha, true),
            ("a_m", a, false),
            ("theta_deg", theta, true),
            ("d_m", d, false),
            ("beta_deg", beta, true),
        ];
        for (key, value, is_angle) in parameters {
            if value.abs() > MAX_ROUNDING {
                let _ = writeln!(
                    text,
                    "{key} = {}",
                    if is_angle { degrees(value) } else { number(value) }
                );
            }
        }
        if let Some((min, max)) = row.limits {
            if row.kind == "revolute" && !min.is_finite() && !max.is_finite() {
                text.push_str(CONTINUOUS_RANGE);
            }
            let (unit, scale) = if row.kind == "prismatic" {
                ("m", 1.0)
            } else {
                ("deg", 180.0 / std::f64::consts::PI)
            };
            for (key, limit) in
                [("min", min), ("max", max)].into_iter().filter(|(_, limit)| limit.is_finite())
            {
                let rounded = (limit * scale * 1e6).round() / 1e6;
                let _ = writeln!(text, "{key}_{unit} = {}", number(rounded));
            }
        }
        for (name, mass, com) in &row.bodies {
            let (name, com) = (quoted(name), list(com, number));
            let _ =
                write!(text, "\n[[joint.body]]\nname = {name}\nmass_kg = {mass}\ncom_m = {com}\n");
        }
    }
    text
}

/// Returns the sections of the measured points of a tree, one for each of its `tips`: name and number
/// of the joint that carries it.
fn targets(tips: &[(&str, usize)]) -> String {
    let of_tip = |(name, joint): &(&str, usize)| {
        format!(
            "\n[[target]]\nname = {}\njoint = {joint}\n\
             at_m = [0, 0, 0]                                 # fill in: the measured point, in the frame of this tip\n",
            quoted(name)
        )
    };
    let main = tips.first().map_or(0, |(_, joint)| *joint);
    let of_tips: String = tips.iter().map(of_tip).collect();
    format!(
        "\n[tool]\njoint = {main}                                        # the frame that carries the payload\n{of_tips}"
    )
}

/// Returns the sections of a camera on the tip and a board in the world, or on the second of several
/// `tips`; the other way round if `is_camera_in_world`. The board has `columns` × `rows` corners at a `distance` \[mm\], in the order of OpenCV; a
/// tag has four, in the order of its detector.
fn view(
    ([columns, rows], distance): ([usize; 2], f64),
    is_camera_in_world: bool,
    tips: &[String],
    name: Option<&str>,
) -> String {
    let on = |tip: usize| tips.get(tip).filter(|_| tips.len() > 1).map(|name| quoted(name));
    let place = |tip, place: &str| on(tip).unwrap_or_else(|| quoted(place));
    let (mut camera, mut board) = (place(0, "tool"), place(1, "world"));
    if is_camera_in_world {
        std::mem::swap(&mut camera, &mut board);
    }
    let corner = |k: usize| {
        let place = |count: usize| number(count as f64 * distance);
        format!("[{}, {}, 0]", place(k % columns), place(k / columns))
    };
    let half = number(distance / 2.0);
    let (word, corners) = if [columns, rows] == TAG {
        let round = [("-", ""), ("", ""), ("", "-"), ("-", "-")];
        ("tag", round.map(|(x, y)| format!("[{x}{half}, {y}{half}, 0]")).to_vec())
    } else {
        ("board", (0..columns * rows).map(corner).collect::<Vec<_>>())
    };
    format!(
        "\n[[camera]]\nname = {}\non = {camera}                                     # the frame that carries it; \"world\" if it stands apart\n\
         focal_px = [900, 900]                            # fill in, roughly: it is fitted\n\
         centre_px = [640, 360]                           # fill in: half of the image\n\
         image_px = [1280, 720]                           # fill in: width and height\n\
         distortion = [0, 0, 0, 0, 0]                     # k1, k2, p1, p2, k3\n\
         pixel_sigma = 0.3                                # fill in: 1 σ of u and v of a found corner\n\n\
         [[marker]]\nname = \"{word}\"\non = {board}                                     # or a frame of the arm, \"tool\" for one\n\
         points_mm = [{}]\n",
        quoted(name.unwrap_or("camera")),
        corners.join(", ")
    )
}

/// Returns the section `[parameters]` for the joints of a problem, of which those named in `free` are
/// free.
pub(super) fn parameters_of(problem: &Problem, free: &[String]) -> String {
    let row = |joint: &Joint| {
        let placement = joint.placement.as_ref().map(|_| Frame::identity());
        Row { placement, ..Row::default() }
    };
    parameters(&problem.joints.iter().map(row).collect::<Vec<_>>(), free, false)
}

/// Returns the section `[parameters]`: priors for all parameters, and rules that fix those which
/// positions, or the views of a camera, cannot distinguish. `free` are the names of the others.
fn parameters(rows: &[Row], free: &[String], has_camera: bool) -> String {
    let mut text = "[parameters]                                     # how far off the nominal arm may be, 1 σ\n\
                    \"joint*.*\" = { sigma_deg = 0.5, sigma_mm = 2.0 }\n"
        .to_owned();
    text.push_str(if has_camera {
        "\"camera*.f*\" = { free = true }                    # the lens; poses of camera and board are free, too\n\
         \"camera*.c*\" = { free = true }\n\
         \"camera*.k*\" = { free = true }\n\
         \"camera*.p*\" = { free = true }\n\
         # Of a lens that is calibrated already: { sigma_px = 1 } for f and c, { fixed = true } \
         for k and p.\n\
         # Held are those that views of the board cannot tell from the ones above.\n"
    } else {
        "\"tool.*\" = { sigma_mm = 100.0 }                    # where the target sits on the tip\n\
         \"base.*\" = { free = true }                       # pose in the measuring frame, found from the points\n\
         # Held are those that positions cannot tell from the ones above.\n"
    });
    text.push_str("\"joint*.beta\" = { fixed = true }\n");
    for (number, row) in (1..).zip(rows) {
        let is_free =
            |field: &str| free.iter().any(|name| *name == format!("joint{number}.{field}"));
        let fields = ["alpha", "a", "theta", "d"];
        let held: Vec<&str> = fields.into_iter().filter(|field| !is_free(field)).collect();
        let mut hold =
            |name: &str| _ = writeln!(text, "\"joint{number}.{name}\" = {{ fixed = true }}");
        if row.placement.is_some() || held.len() == fields.len() && !is_free("beta") {
            hold("*");
        } else {
            held.into_iter().for_each(&mut hold);
            if is_free("beta") {
                let _ = writeln!(text, "\"joint{number}.beta\" = {{ sigma_deg = 0.5 }}");
            }
        }
    }
    text
}

/// Returns the section `[data]`, with the names of the columns as comments.
fn data(chains: &[&Chain], rows: &[Row], has_camera: bool) -> String {
    let moving = rows.iter().filter(|row| row.kind != "fixed" && row.mimic.is_none());
    let column =
        |row: &Row| format!("{}_{}", row.name, if row.kind == "prismatic" { "m" } else { "rad" });
    let columns: Vec<String> = moving.map(column).collect();
    let mut text = "# Columns of the measurements (q1_deg, … and x_m, … do as well):\n".to_owned();
    columns.chunks(4).for_each(|some| _ = writeln!(text, "#   {},", some.join(", ")));
    if has_camera {
        let _ = write!(
            text,
            "#   camera, marker: the names above; point: number of the corner from 0, row by row as OpenCV counts; u_px, v_px\n\
             [data]\nfiles = [\"measurements.csv\"]\n\
             held_out = {{ fraction = {HELD_OUT}, seed = 1 }}          # images that judge and are not fitted\n"
        );
        return text;
    }
    let tips: Vec<&str> = chains.iter().map(|chain| chain.ends().1).collect();
    if tips.len() > 1 {
        let _ = writeln!(text, "#   target: which of {} a row measures", tips.join(", "));
    }
    let _ = write!(
        text,
        "#   x_mm, y_mm, z_mm: the target, which moves with {}, in the measuring frame\n\
         [data]\nfiles = [\"measurements.csv\"]\n\
         position_sigma_mm = {SIGMA_MM}                         # 1 σ of a measured coordinate: put in that of your instrument\n\
         # orientation_sigma_deg = 0.02                   # 1 σ of a measured orientation; without it orientations in the table are not fitted\n\
         held_out = {{ fraction = {HELD_OUT}, seed = 1 }}          # poses that judge and are not fitted\n",
        tips.join(" or ")
    );
    text
}
