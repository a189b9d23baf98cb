//! Sessions, targets and tools of a case.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use nalgebra::Vector3;

use super::draw::Draw;
use super::geometry::DrawnArm;
use super::world::Tool;

/// Sessions and targets of a case.
pub struct Setup {
    pub sessions: Vec<String>,
    /// Words of the column `target`; empty without it.
    pub targets: Vec<String>,
    /// Sections `[tool]` and `[[target]]`.
    pub text: String,
}

/// Writes a vector.
pub fn array(v: &Vector3<f64>) -> String {
    format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z)
}

/// Draws sessions, targets and their tools.
pub fn set_up(draw: &mut Draw, arm: &mut DrawnArm) -> (Setup, BTreeMap<String, Tool>) {
    let sessions: Vec<String> = if draw.chance(0.3) {
        ["A", "B", "day3"][..draw.whole(1, 3)].iter().map(|&word| word.to_owned()).collect()
    } else {
        vec![String::new()]
    };
    let last = arm.arm.joints.len() - 1;
    let mut tool = Tool { joint: last, at: draw.vector(0.3), turn: Vector3::zeros() };
    let mut text = format!("[tool]\ntarget_m = {}\n", array(&tool.at));
    if draw.chance(0.1) && !arm.is_standard {
        tool.joint = draw.whole(0, last);
        let _ = writeln!(text, "joint = {}", tool.joint + 1);
    }
    if draw.chance(0.3) {
        tool.turn = draw.vector(60.0).map(f64::to_radians);
        let _ = writeln!(text, "rotation_deg = {}", array(&tool.turn.map(f64::to_degrees)));
    }
    (arm.arm.payload_on, arm.arm.payload_at) = (tool.joint, tool.at);
    if draw.chance(0.3) {
        arm.arm.payload_at = draw.vector(0.3);
        let _ = writeln!(text, "payload_at_m = {}", array(&arm.arm.payload_at));
    }
    if arm.arm.payload_mass > 0.0 {
        let _ = writeln!(text, "payload_kg = {:?}", arm.arm.payload_mass);
    }
    let kind = if arm.branch.is_some() { 1 } else { draw.whole(0, 9) };
    let targets: Vec<String> = match kind {
        0 => ["ball", "nest2"][..draw.whole(1, 2)].iter().map(|&word| word.to_owned()).collect(),
        1 => vec!["tip".to_owned(), "elbow".to_owned()],
        _ => Vec::new(),
    };
    let mut tools: BTreeMap<String, Tool> = BTreeMap::new();
    for word in if targets.is_empty() { &sessions } else { &targets } {
        let mut tool = tool.clone();
        if kind == 1 {
            let _ = writeln!(text, "[[target]]\nname = \"{word}\"");
            if word == "elbow" && !arm.is_standard {
                tool.joint = arm.branch.map_or_else(|| draw.whole(0, last), |branch| branch - 1);
                let _ = writeln!(text, "joint = {}", tool.joint + 1);
            }
            if draw.chance(0.6) {
                tool.at = draw.vector(0.3);
                let _ = writeln!(text, "at_m = {}", array(&tool.at));
            }
        }
        tools.insert(word.clone(), tool);
    }
    (Setup { sessions, targets, text }, tools)
}
