//! Simulations as text: the table of measurements, and what is true about it.

use std::fmt::Write as _;

use serde::Serialize;
use serde_json::{Map, Value, json};

use super::effect::{Cause, Shape, TrueEffect, keys};
use super::parameters::{ParameterKind, TrueParameter};
use super::simulate::Simulation;
use crate::problem::{Effect, Joint, JointKind};

#[derive(Serialize)]
struct Document<'a> {
    problem: &'a str,
    seed: u64,
    poses: usize,
    held_out: usize,
    position_sigma_mm: f64,
    segments: usize,
    effects: Vec<Value>,
    parameters: Vec<Parameter<'a>>,
}

#[derive(Serialize)]
struct Parameter<'a> {
    name: &'a str,
    unit: &'static str,
    nominal: f64,
    #[serde(rename = "true")]
    value: f64,
}

impl<'a> Parameter<'a> {
    fn of(known: &'a TrueParameter) -> Self {
        let unit = match known.kind {
            ParameterKind::Angle => "rad",
            ParameterKind::Length => "m",
            ParameterKind::Relative if known.name.ends_with(".stiffness") => "N·m/rad",
            ParameterKind::Relative if known.name.ends_with(".EA") => "N",
            ParameterKind::Relative => "N·m²",
        };
        Self { name: &known.name, unit, nominal: known.nominal, value: known.value }
    }
}

impl Simulation {
    /// `measurements.csv`.
    pub fn csv(&self) -> String {
        let moving: Vec<usize> = (0..self.joints.len()).filter(|&k| self.joints[k].kind != JointKind::Fixed).collect();
        let ranges = &self.truth.poses;
        let mut text = format!("pose,{}", self.split_column);
        for &k in &moving {
            let unit = if self.joints[k].kind == JointKind::Revolute { "deg" } else { "m" };
            let _ = write!(text, ",q{}_{unit}", k + 1);
        }
        text.push_str(",x_mm,y_mm,z_mm");
        let columns = [
            (!ranges.payloads.is_empty(), ",payload_kg"),
            (ranges.hoist.is_some(), ",hoist_N"),
            (ranges.temperature.is_some(), ",temperature_C"),
            (true, ",time_s"),
        ];
        text.extend(columns.into_iter().filter(|(there, _)| *there).map(|(_, name)| name));
        if ranges.approach {
            moving.iter().for_each(|k| write!(text, ",approach{}", k + 1).unwrap_or_default());
        }
        text.push('\n');
        for (index, row) in self.rows.iter().enumerate() {
            let set = &row.conditions;
            let _ = write!(text, "{},{}", index + 1, if row.held_out { "validation" } else { "identification" });
            for &k in &moving {
                let q = set.configuration[k];
                let _ = match self.joints[k].kind {
                    JointKind::Revolute => write!(text, ",{:.6}", q.to_degrees()),
                    _ => write!(text, ",{q:.9}"),
                };
            }
            for x in &row.position {
                let _ = write!(text, ",{:.6}", x * 1e3);
            }
            let _ = set.payload.map_or(Ok(()), |mass| write!(text, ",{mass}"));
            let _ = set.hoist.map_or(Ok(()), |force| write!(text, ",{force:.3}"));
            let _ = set.temperature.map_or(Ok(()), |temperature| write!(text, ",{temperature:.2}"));
            let _ = write!(text, ",{:.1}", set.time);
            if ranges.approach {
                moving.iter().for_each(|&k| write!(text, ",{}", set.approach[k]).unwrap_or_default());
            }
            text.push('\n');
        }
        text
    }

    /// `truth.json`.
    pub fn truth_json(&self) -> String {
        let document = Document {
            problem: &self.problem,
            seed: self.seed,
            poses: self.rows.len(),
            held_out: self.held_out(),
            position_sigma_mm: self.truth.noise_sigma * 1e3,
            segments: self.truth.segments,
            effects: self.truth.effects.iter().map(|effect| described(effect, &self.joints)).collect(),
            parameters: self.parameters.iter().map(Parameter::of).collect(),
        };
        // Numbers and words always have a JSON text.
        serde_json::to_string_pretty(&document).unwrap_or_default() + "\n"
    }

    /// Names of the effects at work.
    pub fn effect_names(&self) -> Vec<String> {
        let name = |effect| described(effect, &self.joints)["effect"].as_str().unwrap_or_default().to_owned();
        self.truth.effects.iter().map(name).collect()
    }

    /// Number of rows that are held out.
    pub fn held_out(&self) -> usize {
        self.rows.iter().filter(|row| row.held_out).count()
    }
}

/// An effect under its name, with arguments and values.
fn described(effect: &TrueEffect, joints: &[Joint]) -> Value {
    let mut entry = match effect.cause() {
        Cause::Outside { joint, shape } => json!({
            "effect": "outside-catalogue",
            "where": format!("joint {joint}"),
            "depends_on": [format!("q{joint}")],
            "shape": match shape { Shape::Bump => "bump", Shape::Step => "step" },
        }),
        Cause::Catalogued(effect) => catalogued(effect),
    };
    let names = keys(effect.cause(), joints);
    let values: Map<String, Value> = names
        .iter()
        .zip(effect.values())
        .map(|((name, kind), value)| (format!("{name}_{}", kind.si_suffix()), json!(value)))
        .collect();
    entry["values"] = Value::Object(values);
    entry
}

fn catalogued(effect: &Effect) -> Value {
    let at_joint = |name: &str, joint: &usize| json!({"effect": name, "joint": joint});
    let at_link = |name: &str, link: &String| json!({"effect": name, "link": link});
    let plain = |name: &str| json!({"effect": name});
    match effect {
        Effect::JointCompliance { joint } => at_joint("joint-compliance", joint),
        Effect::JointHarmonic { joint, orders } => {
            json!({"effect": "joint-harmonic", "joint": joint, "orders": orders})
        }
        Effect::GearRatio { joint } => at_joint("gear-ratio", joint),
        Effect::Backlash { joint } => at_joint("backlash", joint),
        Effect::JointNonlinearStiffness { joint } => at_joint("joint-nonlinear-stiffness", joint),
        Effect::JointLateralCompliance { joint } => at_joint("joint-lateral-compliance", joint),
        Effect::JointThermalDrift { joint } => at_joint("joint-thermal-drift", joint),
        Effect::JointCoupling { joint, from } => json!({"effect": "joint-coupling", "joint": joint, "from": from}),
        Effect::LinkBending { joint } => at_joint("link-bending", joint),
        Effect::LinkThermalBending { link } => at_link("link-thermal-bending", link),
        Effect::LinkThermalExpansion { link } => at_link("link-thermal-expansion", link),
        Effect::UnmodelledMass { link } => at_link("unmodelled-mass", link),
        Effect::PayloadMass => plain("payload-mass"),
        Effect::HoistForce => plain("hoist-force"),
        Effect::HoistDirection => plain("hoist-direction"),
        Effect::BaseCompliance => plain("base-compliance"),
        Effect::GravityDirection => plain("gravity-direction"),
        Effect::DeflectedEquilibrium => plain("deflected-equilibrium"),
        Effect::TrackerScale => plain("tracker-scale"),
        Effect::TrackerDrift => plain("tracker-drift"),
        Effect::StationShift { at_time } => json!({"effect": "station-shift", "at_time_s": at_time}),
    }
}
