//! Reader of the study file `MISPRINTS.toml`.

use std::path::Path;

use super::study::{Case, Load, MisprintStudy};
use crate::error::{InputError, InputErrorKind};
use crate::problem::read::name;
use crate::problem::section::Section;
use crate::quantity::Unit;
use crate::rig::{HeldOutRows, Truth};
use crate::study::input::{above_zero, count, distinct, length, problem_of};

impl MisprintStudy {
    /// Reads the sections of a document; `file` is the path of the document.
    pub(in crate::study) fn of_document(
        mut root: Section<'_, '_>,
        file: &Path,
    ) -> Result<Self, InputError> {
        let folder = file.parent().unwrap_or(Path::new(""));
        let name = name(&mut root)?;
        let title = root.text("title")?.unwrap_or(&name).to_owned();
        let path = root.require("problem", "problem = \"…\", a problem.toml")?;
        let (problem, _, problem_file) = problem_of(&path, folder)?;
        let what = "a study of misprints";
        if !problem.tree().is_chain() {
            return Err(path.error(InputErrorKind::NotAChain { what }));
        }
        if !problem.is_chain() || !problem.targets.is_empty() {
            return Err(path.error(InputErrorKind::NotOneTool { what }));
        }
        let seed = root.require("seed", "seed = …, a whole number")?.whole(0)?;
        let specimens = count(&root.require("specimens", "specimens = …, arms of each case")?)?;
        let identification =
            count(&root.require("identification_poses", "identification_poses = 28")?)?;
        let held_out = count(&root.require("held_out_poses", "held_out_poses = 50")?)?;
        let sigma = length(&mut root, "position_sigma", "position_sigma_mm = 0.05")?;
        let rigid_leaves = length(&mut root, "rigid_leaves", "rigid_leaves_mm = 3.9673")?;
        let shares = root.require("links_over_joints", "links_over_joints = [1.0]")?;
        let mut links_over_joints = distinct(&shares, above_zero)?;
        // The case with the ratio closest to the declared one comes first.
        links_over_joints.sort_by(|a, b| a.ln().abs().total_cmp(&b.ln().abs()));
        let one_load = root.section("one_load")?.map(load).transpose()?;
        let second_load = root.section("second_load")?;
        let missing = || root.missing("second_load", "[second_load] with payload_kg or hoist_N");
        let second_load = load(second_load.ok_or_else(missing)?)?;
        let shares = links_over_joints
            .iter()
            .map(|&links_over_joints| Case { links_over_joints, load: None });
        let main = links_over_joints.first().copied().unwrap_or(1.0);
        let loaded = one_load.map(|load| Case { links_over_joints: main, load: Some(load) });
        let cases = shares.chain(loaded).collect();
        let mut truth = Truth::of_sections(&mut root, &problem)?;
        (truth.noise_sigma, truth.held_out) = (sigma, HeldOutRows::Share(0.0));
        root.finish()?;
        let files = vec![file.to_owned(), problem_file];
        Ok(Self {
            files,
            name,
            title,
            problem,
            truth,
            seed,
            specimens,
            identification,
            held_out,
            rigid_leaves,
            cases,
            second_load,
        })
    }
}

/// Reads a load: a payload, a hoist force or both.
fn load(mut section: Section<'_, '_>) -> Result<Load, InputError> {
    let payload = section.non_negative_number("payload", Unit::Mass)?;
    let hoist = section.non_negative_number("hoist", Unit::Force)?;
    section.finish()?;
    if payload.is_none() && hoist.is_none() {
        return Err(section.missing("payload_kg", "payload_kg = … or hoist_N = …"));
    }
    Ok(Load { payload, hoist })
}
