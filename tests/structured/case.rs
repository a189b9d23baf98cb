//! A whole problem with its table, made from a number, and the truth of it.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use nalgebra::{Rotation3, Vector3};

use super::arm::Kind;
use super::draw::Draw;
use super::effect::{Effect, REFERENCE_TEMPERATURE};
use super::freedom;
use super::geometry::{self, DrawnArm};
use super::row::Row;
use super::setup::{Setup, array, set_up};
use super::sight;
use super::table::{self, Columns};
use super::world::World;

/// Case: files, and what is true.
#[expect(clippy::struct_excessive_bools, reason = "independent facts about a case")]
pub struct Case {
    pub problem: String,
    pub table: String,
    pub nominal: World,
    pub truth: World,
    pub rows: Vec<Row>,
    /// Standard deviation of the noise of a coordinate \[m\] and of a rotation \[rad\]; 0 without.
    pub noise: [f64; 2],
    /// True if the true arm is the nominal one.
    pub is_exact: bool,
    /// True if bounds, constraints or a robust loss may keep the fit from the truth.
    pub is_limited: bool,
    pub is_tree: bool,
    pub declares_sigma: bool,
}

/// Draws the conditions of every row, without measurements.
fn conditions(draw: &mut Draw, arm: &DrawnArm, setup: &Setup, has: &Columns) -> Vec<Row> {
    let count = draw.whole(6, 12) + draw.whole(0, 8);
    let mut rows: Vec<Row> = Vec::new();
    let mut time = draw.number(0.0, 500.0);
    for session in &setup.sessions {
        let count = count / 2 + count / (2 * setup.sessions.len());
        let first = time;
        for number in 0..count {
            let target = (!setup.targets.is_empty())
                .then(|| setup.targets[number % setup.targets.len()].clone());
            let mut q: Vec<f64> = Vec::new();
            for joint in &arm.arm.joints {
                let [low, high] = joint.limits.unwrap_or(match joint.kind {
                    Kind::Revolute => [-2.0, 2.0],
                    Kind::Prismatic => [-0.3, 0.3],
                    Kind::Fixed => [0.0, 0.0],
                });
                let drawn = draw.number(low, high).clamp(low, high);
                q.push(joint.mimic.map_or(drawn, |(leader, ratio)| ratio * q[leader]));
            }
            rows.push(Row {
                approach: q.iter().map(|_| draw.pick(&[-1.0, 1.0])).collect(),
                q,
                session: session.clone(),
                tool: target.clone().unwrap_or_else(|| session.clone()),
                target,
                payload: has.payload.then(|| draw.pick(&[0.0, 0.5, 2.0])),
                temperature: draw.number(15.0, 30.0),
                time,
                elapsed: time - first,
                covariate: draw.number(-2.0, 2.0),
                marked: draw.chance(0.3),
                ..Row::default()
            });
            time = (time + draw.number(20.0, 90.0)).round();
        }
    }
    // Neither part may be empty.
    if let [first, second, ..] = &mut rows[..] {
        (first.marked, second.marked) = (false, true);
    }
    rows
}

fn held_out(draw: &mut Draw, setup: &Setup, has: &mut Columns) -> String {
    match draw.whole(0, 9) {
        0 if setup.sessions.len() > 1 => {
            format!("held_out = {{ session = \"{}\" }}\n", setup.sessions[1])
        }
        0 | 1 => "held_out = \"none\"\n".to_owned(),
        2 => {
            has.split = Some("split");
            String::new()
        }
        3 | 4 => {
            let column = draw.pick(&["split", "part"]);
            has.split = Some(column);
            format!("held_out = {{ column = \"{column}\" }}\n")
        }
        _ => format!(
            "held_out = {{ fraction = {}, seed = {} }}\n",
            draw.pick(&[0.2, 0.3, 0.45]),
            draw.whole(0, 9)
        ),
    }
}

/// Draws up to two effects, of which at most one is of the instrument.
fn effects(draw: &mut Draw, arm: &DrawnArm) -> Vec<Effect> {
    let mut effects: Vec<Effect> = Vec::new();
    let count = if draw.chance(0.4) { draw.whole(1, 2) } else { 0 };
    for _ in 0..count {
        let family = |effect: &Effect| effect.declaration.split(' ').next().map(str::to_owned);
        let is_other = |effect: &Effect| {
            effects.iter().all(|one| {
                family(one) != family(effect)
                    && !(one.is_of_instrument() && effect.is_of_instrument())
            })
        };
        let drawn = Effect::drawn(draw, &arm.arm.joints[..arm.written], 900.0).filter(is_other);
        effects.extend(drawn);
    }
    effects
}

/// Writes the problem up to its data; `sections` are those of tools, fixtures and parameters.
fn declared(
    draw: &mut Draw,
    k: u64,
    arm: &DrawnArm,
    nominal: &World,
    [tools, fixtures, parameters]: &[&str; 3],
) -> String {
    let mut text = format!("name = \"case-{k}\"\n");
    if arm.is_standard {
        text += "dh = \"standard\"\n";
    }
    let _ = writeln!(text, "gravity_m_s2 = {}", array(&arm.arm.gravity));
    if !arm.arm.deflected {
        text += "[statics]\nequilibrium = \"undeflected\"\n";
    }
    text += &arm.text(draw);
    text += tools;
    let [at, turned] = nominal.bases.values().next().copied().unwrap_or_default();
    let _ = writeln!(
        text,
        "[base]\ntranslation_m = {}\nrotation_deg = {}",
        array(&at),
        array(&turned.map(f64::to_degrees))
    );
    text += fixtures;
    for effect in &nominal.effects {
        let _ = writeln!(text, "[[effect]]\n{}", effect.declaration);
    }
    text + parameters
}

impl Case {
    /// Makes case `k`.
    pub fn new(k: u64) -> Self {
        let draw = &mut Draw::new(k);
        let mut drawn = geometry::drawn(draw);
        let (setup, tools) = set_up(draw, &mut drawn);
        let follows = drawn.arm.joints.iter().any(|joint| joint.mimic.is_some());
        let mut effects = if follows { Vec::new() } else { effects(draw, &drawn) };
        let is_needed = !effects.is_empty();
        let mut some = |probability: f64| is_needed || draw.chance(probability);
        let mut has = Columns {
            session: setup.sessions.len() > 1 || !setup.sessions[0].is_empty(),
            target: !setup.targets.is_empty(),
            payload: some(0.3),
            temperature: some(0.2),
            time: some(0.3),
            approach: some(0.2),
            covariate: some(0.1),
            pose: some(0.4),
            ..Columns::default()
        };
        let held_out = held_out(draw, &setup, &mut has);
        let mut rows = conditions(draw, &drawn, &setup, &has);
        let fits_orientation = draw.chance(0.2);
        has.sights = !fits_orientation && draw.chance(0.15);
        let (fixtures, fixture_text) =
            if has.sights { sight::fixtures(draw) } else { (BTreeMap::new(), String::new()) };
        if has.sights {
            effects.retain(|effect| !effect.is_of_instrument());
            let joints = drawn.written;
            for row in rows.iter_mut().skip(2) {
                row.sight = sight::drawn(draw, joints);
            }
        }
        let mounting = if draw.chance(0.5) {
            [draw.vector(1.5), draw.vector(80.0).map(f64::to_radians)]
        } else {
            [Vector3::zeros(); 2]
        };
        let nominal = World {
            arm: drawn.arm.clone(),
            bases: setup.sessions.iter().map(|word| (word.clone(), mounting)).collect(),
            tools,
            fixtures,
            effects,
            values: BTreeMap::new(),
        };
        let measures_orientation = fits_orientation || !has.sights && draw.chance(0.05);
        let mut truth = nominal.clone();
        let is_exact = draw.chance(0.25);
        let freedom = freedom::drawn(draw, &mut truth, is_exact, fits_orientation);
        let sigma = draw.pick(&[0.02, 0.05, 0.2]) * 1e-3;
        let noise = if draw.chance(0.3) { [0.0; 2] } else { [sigma, sigma] };
        for row in &mut rows {
            let pose = truth.pose(row).unwrap_or_default();
            let exact = truth.numbers(row).unwrap_or_default();
            let measured = [3, 1, 1, 2][row.sight.rank()];
            let error = draw.normals(noise[0]);
            row.position =
                Vector3::from_fn(|k, _| exact[k] + if k < measured { error[k] } else { 0.0 });
            let turned =
                Rotation3::from_matrix_unchecked(pose.fixed_view::<3, 3>(0, 0).into_owned());
            let turned = Rotation3::from_scaled_axis(draw.normals(noise[1])) * turned;
            row.orientation = measures_orientation.then_some(turned);
        }
        let declares_sigma = fits_orientation || has.sights || draw.chance(0.85);
        has.sigma = (declares_sigma && draw.chance(0.1)).then_some(sigma);
        let written = table::written(draw, &drawn, &mut rows, &has);
        let robust = draw.chance(0.08).then(|| draw.pick(&["huber", "l1"]));
        let mut text =
            declared(draw, k, &drawn, &nominal, &[&setup.text, &fixture_text, &freedom.text]);
        if let Some(loss) = robust {
            let _ = writeln!(text, "[robust]\nloss = \"{loss}\"");
        }
        let _ = write!(
            text,
            "[data]\nfiles = [\"rows.csv\"]\nreference_temperature_C = {REFERENCE_TEMPERATURE}\n{held_out}"
        );
        if declares_sigma {
            let _ = writeln!(text, "position_sigma_mm = {:?}", sigma * 1e3);
        }
        if has.sights {
            let of_lengths = sigma * 1e3;
            let _ = writeln!(
                text,
                "distance_sigma_mm = {of_lengths:?}\nsurface_sigma_mm = {of_lengths:?}\ntilt_sigma_rad = {sigma:?}"
            );
        }
        if fits_orientation {
            let _ = writeln!(text, "orientation_sigma_deg = {:?}", sigma.to_degrees());
        }
        if has.covariate {
            text += "[data.covariates]\n\"oil_bar\" = \"pressure of the oil\"\n";
        }
        text += &written.sections;
        Self {
            problem: text,
            table: written.text,
            nominal,
            truth,
            rows,
            noise,
            is_exact,
            is_tree: drawn.branch.is_some(),
            is_limited: freedom.is_limited || robust.is_some(),
            declares_sigma,
        }
    }
}
