//! Arms with elastic links, measured on the virtual test rig, which shares no physics with the
//! model.

use std::fmt::Write as _;
use std::path::Path;

use flexcal::measurement::Measurements;
use flexcal::problem::Problem;
use flexcal::remainder::{Compensation, TargetFrame};
use flexcal::rig::{Truth, simulate};

use super::checks::{self, SAME_PLACE, Verdict, ensure};
use super::draw::Draw;
use super::fitted::{Fitted, write};
use super::repeats;

/// Largest error of a held-out row in units of its stated σ.
const MOST_SIGMAS: f64 = 12.0;

/// Problem and truth of a case.
struct Texts {
    problem: String,
    truth: String,
}

fn joint(draw: &mut Draw, index: usize, text: &mut String, limits: &mut String) {
    let alpha = draw.pick(&[0.0, 90.0, -90.0]);
    let _ = writeln!(text, "[[joint]]\nalpha_deg = {alpha}\nd_m = {}", draw.number(-0.2, 0.4));
    let n = index + 1;
    if index > 0 && draw.chance(0.15) {
        let _ = writeln!(text, "kind = \"prismatic\"\na_m = {}", draw.number(-0.2, 0.2));
        let _ = writeln!(limits, "q{n}_m = [0.1, 0.5]");
        return;
    }
    let _ = writeln!(
        limits,
        "q{n}_deg = [{}, {}]",
        draw.number(-120.0, -30.0),
        draw.number(30.0, 120.0)
    );
    if draw.chance(0.6) {
        let _ = writeln!(text, "stiffness_N_m_per_rad = {}", draw.number(2e4, 8e4));
    }
    let length = draw.number(0.3, 1.2);
    let _ = writeln!(text, "a_m = {length}");
    if index > 0 && draw.chance(0.6) {
        let name = b"ABCDEFG"[index] as char;
        let bending = draw.number(8e3, 4e4);
        let other = if draw.chance(0.5) { bending } else { draw.number(8e3, 4e4) };
        let _ = writeln!(
            text,
            "[joint.beam]\nname = \"{name}\"\nmass_kg = {}\nEA_N = 2e7\nEIy_N_m2 = {bending}\nEIz_N_m2 = {other}\nGJ_N_m2 = {}",
            draw.number(0.0, 5.0),
            draw.number(8e3, 3e4)
        );
        if draw.chance(0.4) {
            let place = length * draw.number(0.1, 0.9);
            let _ = writeln!(
                text,
                "[[joint.beam.mass]]\nmass_kg = {}\nat_m = [{place}, 0.02, 0.05]",
                draw.number(0.2, 2.0)
            );
        }
        if draw.chance(0.3) {
            let place = length * draw.number(0.1, 0.9);
            let _ = writeln!(
                text,
                "[joint.beam.hoist]\nat_m = [{place}, 0, 0]\nforce_N = {}",
                draw.number(5.0, 40.0)
            );
        }
    }
    if draw.chance(0.5) {
        let _ = writeln!(
            text,
            "[[joint.body]]\nmass_kg = {}\ncom_m = [0.1, 0, -0.05]",
            draw.number(0.5, 4.0)
        );
    }
}

fn texts(k: u64) -> Texts {
    let draw = &mut Draw::new(k);
    let sigma = draw.pick(&[0.05, 0.1, 0.2]);
    let mut text = format!("name = \"case-{k}\"\n[statics]\n");
    let _ = writeln!(text, "beam_elements = {}", draw.whole(1, 3));
    if draw.chance(0.2) {
        text += "equilibrium = \"undeflected\"\n";
    }
    let mut limits = String::new();
    for index in 0..draw.whole(2, 4) {
        joint(draw, index, &mut text, &mut limits);
    }
    let _ = writeln!(
        text,
        "[tool]\ntarget_m = [0.2, {}, -0.1]\npayload_kg = {}",
        draw.number(-0.1, 0.1),
        draw.number(0.0, 2.0)
    );
    let effect = draw.chance(0.3).then(|| {
        draw.pick(&[
            ("gear-ratio = { joint = 1 }", "error_relative = 4e-4"),
            ("base-compliance = true", "about_x_rad_per_N_m = 2e-6\nabout_y_rad_per_N_m = 1e-6"),
            ("gravity-direction = true", "about_x_deg = 0.5\nabout_y_deg = -0.3"),
            ("payload-mass = true", "mass_kg = 0.2"),
        ])
    });
    let mut truth =
        "[random]\n\"*\" = { sigma_deg = 0.1, sigma_mm = 1, sigma_relative = 0.1 }\n".to_owned();
    if let Some((declaration, strength)) = effect {
        let _ = writeln!(text, "[[effect]]\n{declaration}");
        let _ = writeln!(truth, "[[effect]]\n{declaration}\n{strength}");
    }
    text += "[parameters]\n\"joint*.theta\" = { sigma_deg = 0.5 }\n\"joint*.alpha\" = { sigma_deg = 0.5 }\n\"joint*.beta\" = { sigma_deg = 0.5 }\n\
        \"joint*.a\" = { sigma_mm = 5 }\n\"joint*.d\" = { sigma_mm = 5 }\n\"tool.*\" = { sigma_mm = 5 }\n\"base.*\" = { free = true }\n";
    if text.contains("stiffness_N") {
        text += "\"joint*.stiffness\" = { sigma_relative = 0.5 }\n";
    }
    for name in ["A", "B", "C", "D"] {
        if text.contains(&format!("name = \"{name}\"")) {
            let _ = writeln!(text, "\"{name}.*\" = {{ sigma_relative = 0.5 }}");
        }
    }
    let _ = writeln!(
        text,
        "[data]\nfiles = [\"rows.csv\"]\nposition_sigma_mm = {sigma}\nheld_out = {{ column = \"split\" }}"
    );
    let _ = write!(
        truth,
        "[noise]\nposition_sigma_mm = {sigma}\n[poses]\n{limits}payload_kg = [0, 1, 2]\nidentification = 18\n[rig]\nsegments = 4\n"
    );
    Texts { problem: text, truth }
}

/// Judges an elastic case; returns how trusted the fit is, or the disagreement.
pub fn judged(k: u64, folder: &Path) -> Result<&'static str, String> {
    let Texts { problem: text, truth } = texts(k);
    let path = write(folder, &text, "");
    let problem = Problem::read(&path).map_err(|error| format!("no problem: {error}"))?;
    let truth = Truth::parse(&truth, &folder.join("TRUTH.toml"), &problem);
    let truth = truth.map_err(|error| format!("no truth: {error}"))?;
    let Ok(made) = simulate(&problem, &truth, 26, k) else { return Ok("no equilibrium") };
    write(folder, &text, &made.csv());
    let fit = Fitted::new(&path).map_err(|error| format!("no fit: {error}"))?;
    let ranks = vec![0; fit.data.measurements.len()];
    checks::numbers_are_finite(&fit)?;
    checks::summaries_are_of_residuals(&ranks, &fit)?;
    checks::prediction_repeats_the_fit(&ranks, &fit)?;
    commands_reach(&fit)?;
    if k.is_multiple_of(4) {
        repeats::threads_change_nothing(&fit)?;
    }
    if !fit.found.is_trusted() {
        return Ok("elastic, not trusted");
    }
    // The rig is always in equilibrium on the bent arm.
    if !text.contains("undeflected") {
        held_out_rows_are_met(&fit)?;
    }
    Ok("elastic, trusted")
}

/// Checks that the commands for the measured positions bring the arm there by its own predictions.
fn commands_reach(fit: &Fitted) -> Verdict {
    let targets = fit.data.measurements.select(&[0, 5, 11]);
    let fitted = (&fit.saved, fit.correction.as_ref(), &[][..]);
    let found =
        Compensation::new(&fit.problem, fitted, targets.clone(), TargetFrame::Measuring, 0.95);
    let found = found.map_err(|error| format!("no commands: {error}"))?;
    let mut there: Measurements = targets;
    let joints = there.joints;
    for command in &found.commands {
        there.configurations[command.row * joints..][..joints]
            .copy_from_slice(&command.configuration);
    }
    let (prediction, _) = fit.predict(&there).map_err(|error| error.to_string())?;
    for command in &found.commands {
        let miss = there.positions[command.row] - prediction.positions[command.row];
        let off = (miss - command.miss).norm();
        ensure!(
            off < SAME_PLACE,
            "command {}: the miss is {off} m off the prediction",
            command.row
        );
    }
    Ok(())
}

fn held_out_rows_are_met(fit: &Fitted) -> Verdict {
    let (_, poses) = fit.predict(&fit.data.measurements).map_err(|error| error.to_string())?;
    let Some(poses) = poses else { return Ok(()) };
    for residual in fit.residuals.iter().filter(|residual| residual.held_out) {
        let sigma = poses[residual.row].error_sigma();
        let off = (0..3).map(|k| residual.position[k].abs() / sigma[k]).fold(0.0, f64::max);
        ensure!(off < MOST_SIGMAS, "row {}: a held-out error of {off} stated σ", residual.row);
    }
    Ok(())
}
