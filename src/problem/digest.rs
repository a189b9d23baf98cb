//! Digest of a declared arm, which shows whether an estimate still belongs to it.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use nalgebra::Vector3;

use super::quoted;
use super::{
    BasePose, Beam, Body, Effect, Equilibrium, Hoist, Joint, JointKind, Mimic, Placement, Problem,
    Statics, Target, Tool,
};
use crate::files::digest;

/// Name of the part of an arm that is neither a joint nor an effect.
const WHOLE_ARM_NAME: &str = "gravity, statics, tool or base";

impl Problem {
    /// Returns a digest of everything declared that predictions depend on, as 64 hexadecimal
    /// digits. It is the same on every machine and for equal values in other units.
    ///
    /// It is the SHA-256 of a text of words and numbers, each after a space. Numbers are in SI with
    /// twelve digits (`5.00000000000e-1`):
    /// - `undeflected` or `deflected` without a space; beam elements; gravity; target; payload
    ///   position; translation and rotation of the base; payload mass; `payload at the identified
    ///   target` if it follows the target; if the tool has an orientation, `turned` and its rotation
    ///   vector; if another joint than the last carries it, `on` and its number;
    /// - for each target a new line with `target`, its quoted name, the number of its joint, its
    ///   position and rotation vector;
    /// - for each joint a new line with `revolute`, `prismatic` or `fixed`; if its parent is not
    ///   the joint before it, `on` and the parent's number (0 for the base); if it has xyz and rpy,
    ///   `placed` and these; if it follows another joint, `mimic`, that joint's number and the
    ///   ratio; α, a, θ, d, β; its stiffness or `rigid`; `mass`, mass and position of each body;
    ///   with a beam `beam`, its quoted name, mass, EA, `EI_y`, `EI_z`, GJ, each a number or
    ///   `rigid`, its masses; with a hoist `hoist`, force, hook and direction;
    /// - for each effect in alphabetical order a new line with its declaration as in a problem
    ///   file;
    /// - T₀ if an effect depends on the temperature.
    ///
    /// Display names, joint limits, `[parameters]`, constraints, data and noise do not enter.
    #[doc(hidden)]
    pub fn digest(&self) -> String {
        hexadecimal(&self.canonical_text())
    }

    /// Returns the name of each part of the declared arm with its digest, 16 hexadecimal digits.
    /// The parts are the whole (gravity, statics, tool, base), each target, each joint, and each
    /// effect.
    pub(crate) fn digest_parts(&self) -> BTreeMap<String, String> {
        let text = self.canonical_text();
        let mut joints = 0;
        let mut name = |(place, line): (usize, &str)| match line.split(' ').next() {
            _ if place == 0 => WHOLE_ARM_NAME.to_owned(),
            Some("revolute" | "prismatic" | "fixed") => {
                joints += 1;
                format!("joint {joints}")
            }
            // The reference temperature, if any, follows the last effect on the same line.
            _ => line.rfind('}').map_or(line, |end| &line[..=end]).to_owned(),
        };
        let short = |line: &str| hexadecimal(line).chars().take(16).collect::<String>();
        text.split('\n').enumerate().map(|(k, line)| (name((k, line)), short(line))).collect()
    }

    /// Returns the text whose digest is [`digest`](Self::digest).
    fn canonical_text(&self) -> String {
        let Self { gravity, statics, joints, tool, targets, base, effects, data, .. } = self;
        let Statics { equilibrium, beam_elements } = statics;
        let Tool { joint: carrier, target, rotation: turned, payload_at, payload_mass, .. } = tool;
        let BasePose { translation, rotation } = base;
        let mut text = match equilibrium {
            Equilibrium::Undeflected => "undeflected".to_owned(),
            Equilibrium::Deflected => "deflected".to_owned(),
        };
        let _ = write!(text, " {beam_elements}");
        push_vectors(&mut text, &[gravity, target, payload_at, translation, rotation]);
        push_number(&mut text, *payload_mass);
        if tool.payload_follows {
            text.push_str(" payload at the identified target");
        }
        if *turned != Vector3::zeros() {
            text.push_str(" turned");
            push_vectors(&mut text, &[turned]);
        }
        if carrier + 1 != joints.len() {
            let _ = write!(text, " on {}", carrier + 1);
        }
        for Target { name, joint, at, rotation, .. } in targets {
            let _ = write!(text, "\ntarget {} {}", quoted(name), joint + 1);
            push_vectors(&mut text, &[at, rotation]);
        }
        for (index, declared) in joints.iter().enumerate() {
            push_joint(&mut text, index, declared);
        }
        // The order of the declarations has no effect on predictions.
        let mut declared: Vec<String> =
            effects.iter().map(|effect| format!("\n{}", effect.effect.declaration())).collect();
        declared.sort_unstable();
        text.extend(declared);
        if let (true, Some(reference)) = (
            effects.iter().any(|declared| Effect::is_thermal(&declared.effect)),
            data.reference_temperature,
        ) {
            push_number(&mut text, reference);
        }
        text
    }
}

/// Returns the parts of an arm as [`Problem::digest_parts`] names them. Files of earlier versions
/// name an effect without the last brace of its declaration.
pub(crate) fn with_whole_names(parts: BTreeMap<String, String>) -> BTreeMap<String, String> {
    let is_cut =
        |name: &str| name.contains(" = {") && !name.ends_with('}') && !name.starts_with("target ");
    let whole = |name: String| if is_cut(&name) { name + "}" } else { name };
    parts.into_iter().map(|(name, digest)| (whole(name), digest)).collect()
}

/// Returns the SHA-256 digest of a text, 64 hexadecimal digits.
pub(crate) fn hexadecimal(text: &str) -> String {
    digest(text.as_bytes())
}

fn push_joint(text: &mut String, index: usize, joint: &Joint) {
    let Joint {
        kind,
        parent,
        placement,
        mimic,
        alpha,
        a,
        theta,
        d,
        beta,
        stiffness,
        beam: elastic,
        bodies,
        ..
    } = joint;
    text.push_str(match kind {
        JointKind::Revolute => "\nrevolute",
        JointKind::Prismatic => "\nprismatic",
        JointKind::Fixed => "\nfixed",
    });
    if *parent != index.checked_sub(1) {
        let _ = write!(text, " on {}", parent.map_or(0, |parent| parent + 1));
    }
    if let Some(Placement { xyz, rpy }) = placement {
        text.push_str(" placed");
        push_vectors(text, &[xyz, rpy]);
    }
    if let Some(Mimic { joint, ratio }) = mimic {
        let _ = write!(text, " mimic {}", joint + 1);
        push_number(text, *ratio);
    }
    for value in [alpha, a, theta, d, beta] {
        push_number(text, *value);
    }
    push_rigidity(text, *stiffness);
    push_masses(text, bodies);
    if let Some(elastic) = elastic {
        push_beam(text, elastic);
    }
}

fn push_beam(text: &mut String, beam: &Beam) {
    // The name enters because parameters and effects use it.
    let Beam { name, mass, ea, ei_y, ei_z, gj, masses: carried, hoist } = beam;
    let _ = write!(text, " beam {}", quoted(name));
    push_number(text, *mass);
    for rigidity in [ea, ei_y, ei_z, gj] {
        push_rigidity(text, *rigidity);
    }
    push_masses(text, carried);
    if let Some(Hoist { at, force, direction }) = hoist {
        text.push_str(" hoist");
        push_number(text, *force);
        push_vectors(text, &[at, direction]);
    }
}

fn push_masses(text: &mut String, bodies: &[Body]) {
    for Body { name: _, mass, position } in bodies {
        text.push_str(" mass");
        push_number(text, *mass);
        push_vectors(text, &[position]);
    }
}

fn push_vectors(text: &mut String, vectors: &[&Vector3<f64>]) {
    for value in vectors.iter().flat_map(|vector| vector.iter()) {
        push_number(text, *value);
    }
}

fn push_rigidity(text: &mut String, value: Option<f64>) {
    match value {
        Some(value) => push_number(text, value),
        None => text.push_str(" rigid"),
    }
}

/// Appends a number with twelve digits, which a change of unit preserves. Adding 0 turns −0 into 0.
fn push_number(text: &mut String, value: f64) {
    let _ = write!(text, " {:.11e}", value + 0.0);
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn parts_have_whole_names() {
        let text = "name = 'arm'\ngravity_m_s2 = [0, 0, -9.8]\n[statics]\nequilibrium = 'undeflected'\nbeam_elements = 1\n\
                    [[joint]]\na_m = 0.5\n[[effect]]\njoint-harmonic = { joint = 1, orders = [1] }\n";
        let problem = Problem::parse(text, Path::new("problem.toml")).unwrap();
        let parts = problem.digest_parts();
        let effect = "joint-harmonic = { joint = 1, orders = [1] }";
        assert!(parts.contains_key(effect), "{parts:?}");
        // Earlier versions left out the last brace.
        let cut = |(name, digest): (&String, &String)| {
            (name.strip_suffix('}').unwrap_or(name).to_owned(), digest.clone())
        };
        assert_eq!(with_whole_names(parts.iter().map(cut).collect()), parts);
    }

    #[test]
    fn effects_enter_as_they_are_declared() {
        let text = "name = 'arm'\ngravity_m_s2 = [0, 0, -9.8]\n[statics]\nequilibrium = 'undeflected'\nbeam_elements = 1\n\
                    [[joint]]\na_m = 0.5\n[[effect]]\njoint-harmonic = { joint = 1, orders = [1, 4] }\n";
        let problem = Problem::parse(text, Path::new("problem.toml")).unwrap();
        let zero = " 0.00000000000e0";
        let canonical = format!(
            "undeflected 1{zero}{zero} -9.80000000000e0{}{zero}\nrevolute{zero} 5.00000000000e-1{zero}{zero}{zero} rigid\n\
             joint-harmonic = {{ joint = 1, orders = [1, 4] }}",
            zero.repeat(12)
        );
        assert_eq!(problem.digest(), hexadecimal(&canonical));
        assert_eq!(
            problem.digest(),
            "3027950590543685817207b2ac35d00da78b76ec6770419be953cf72bc81fabe"
        );
        assert_eq!(quoted("a \"b\" \\"), "\"a \\\"b\\\" \\\\\"");
    }
}
