//! Figure of the errors of each held-out pose along each axis, at each stage of the calibration.

use nalgebra::Vector3;

use super::prelude::*;
use crate::fit::{ErrorsBefore, Procedure};
use crate::report::errors::{CORRECTED_ARM, DECLARED_ARM, EXTENDED_ARM, NOMINAL_ARM};
use crate::results::{Stage, StageErrors, procedure_stages};

/// Maximum number of poses that the figure shows.
const MAX_SHOWN_POSES: usize = 90;
/// Smallest error that is drawn at its value, as a fraction of the median error of the last stage.
/// Smaller errors are drawn at the lower edge.
const MIN_DRAWN_FRACTION: f64 = 0.03;

/// Returns the name of a stage in the legend.
fn stage_name(stage: Stage) -> &'static str {
    match stage {
        Stage::Registered => NOMINAL_ARM,
        Stage::Before => "before",
        Stage::Ignoring => "elasticity ignored",
        Stage::Elastic => "with elasticity",
        Stage::Identified => "identified",
        Stage::Declared => DECLARED_ARM,
        Stage::Closed => EXTENDED_ARM,
        Stage::Corrected => CORRECTED_ARM,
    }
}

/// Returns the colour of stage `index` (from 0) of `count`; the last stage is accented.
fn colour(index: usize, count: usize) -> Colour {
    match (index, count - 1 - index) {
        (_, 0) => ACCENT,
        (0, _) => FAINT,
        (_, 1) => INK,
        _ => MUTED,
    }
}

/// Returns the names of the columns of the data: the norm of the error at each stage \[mm\].
fn column_names(stages: &[StageErrors]) -> Vec<String> {
    stages.iter().map(|stage| format!("{} [mm]", stage_name(stage.stage))).collect()
}

/// Returns the norm of the error of a pose at each stage \[mm\].
fn norms(stages: &[StageErrors], pose: usize) -> Vec<f64> {
    stages.iter().filter_map(|stage| Some(stage.errors.get(pose)?.norm() * 1e3)).collect()
}

/// Draws the error of every held-out pose in x, y, z and norm [Chen2021, fig. 13].
///
/// Returns `None` if no held-out row measures a position.
pub fn errors(data: &PlotData) -> Option<Drawing> {
    let held_out = data.held_out();
    let indices: Vec<usize> =
        (0..held_out.len()).filter(|&k| data.is_position(held_out[k])).collect();
    let rows: Vec<usize> = indices.iter().map(|&k| held_out[k]).collect();
    let of_positions = |stage: &StageErrors| {
        let errors = indices.iter().filter_map(|&k| stage.errors.get(k).copied()).collect();
        StageErrors { stage: stage.stage, errors }
    };
    let stages: Vec<StageErrors> = data.stages.iter().map(of_positions).collect();
    if rows.is_empty() || stages.is_empty() {
        return None;
    }
    let candidates: Vec<usize> =
        (0..rows.len()).filter(|&k| data.shown.binary_search(&rows[k]).is_ok()).collect();
    let names = column_names(&stages);
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let cells = candidates.iter().map(|&k| (&data.residuals[rows[k]], norms(&stages, k)));
    let data = pose_sheet(&names, cells);
    let title = "Error of each held-out pose";
    Some(draw_stages(("held-out-errors", title), &stages, &candidates, &rows, data))
}

/// Draws the held-out errors of one procedure of a comparison. The figure is named after the
/// procedure.
pub fn of_procedure(before: &ErrorsBefore, procedure: &Procedure) -> Drawing {
    let name = procedure.name();
    let title = format!("Error of each held-out pose: {name}");
    let stages = procedure_stages(before, procedure);
    let poses: Vec<usize> = (0..procedure.after.len()).collect();
    let cells = poses.iter().map(|&k| {
        let norms = norms(&stages, k).into_iter().map(|norm| fixed(norm, 6));
        std::iter::once((k + 1).to_string()).chain(norms).collect()
    });
    let names = column_names(&stages);
    let header = std::iter::once("held_out_pose").chain(names.iter().map(String::as_str));
    let data = sheet(header, cells);
    draw_stages((&format!("held-out-errors-{name}"), &title), &stages, &poses, &[], data)
}

/// Draws the held-out errors of all stages. `candidates` are the indices of those held-out poses
/// that may be drawn. `rows` are the rows (from 0) of all held-out poses, empty if the page does
/// not list them.
fn draw_stages(
    titles: (&str, &str),
    stages: &[StageErrors],
    candidates: &[usize],
    rows: &[usize],
    data: String,
) -> Drawing {
    let count = stages.first().map_or(0, |stage| stage.errors.len());
    let best = stages.last().map_or(&[][..], |stage| &stage.errors);
    let shown = sample(candidates, MAX_SHOWN_POSES, |k| best.get(k).map_or(0.0, Vector3::norm));
    let mut sizes: Vec<f64> =
        best.iter().map(Vector3::norm).filter(|norm| norm.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    let typical = sizes.get(sizes.len() / 2).copied().unwrap_or(1e-3).max(1e-9);
    let floor = (MIN_DRAWN_FRACTION * typical * 1e3).log10();
    let largest =
        range(stages.iter().flat_map(|stage| &stage.errors).map(|error| error.norm() * 1e3)).1;
    // Without a finite positive error the axis has another range.
    let extent = Axis::bare((floor, largest.log10() + 0.1)).range;
    let panel = |(axis, label): (usize, &str)| {
        let poses = (0.0, count as f64 + 1.0);
        let x = if axis == 3 { Axis::linear(poses, "held-out pose", 8) } else { Axis::bare(poses) };
        let series = stages.iter().enumerate().flat_map(|(index, stage)| {
            let colour = colour(index, stages.len());
            let dot = if index == 0 { Paint::line(colour, 1.2) } else { Paint::fill(colour) };
            let size = |error: &Vector3<f64>| match axis {
                3 => error.norm(),
                _ => error[axis].abs(),
            };
            let finite = shown.iter().copied().filter(|&k| stage.errors[k].norm().is_finite());
            let at = |k: usize| {
                let value = (size(&stage.errors[k]) * 1e3).log10();
                (k as f64 + 1.0, value.clamp(extent.0, extent.1))
            };
            let line = Shape::line(finite.clone().map(at), Paint::line(colour, 0.75).faded(0.45));
            let dots = finite.map(|k| Shape::dot(at(k), 1.9, dot, rows.get(k).copied()));
            std::iter::once(line).chain(dots).collect::<Vec<_>>()
        });
        Panel::new(104.0, x, Axis::logarithmic(extent, label, 4)).with(series)
    };
    let labels = ["|Δx| [mm]", "|Δy| [mm]", "|Δz| [mm]", "norm [mm]"];
    let panels: Vec<Panel> = labels.into_iter().enumerate().map(panel).collect();
    let entry = |(index, stage): (usize, &StageErrors)| {
        let mark = if index > 0 { Mark::Dot } else { Mark::Ring };
        (stage_name(stage.stage), colour(index, stages.len()), mark)
    };
    let legend: Vec<_> = stages.iter().enumerate().map(entry).collect();
    // A pose without equilibrium at a stage has no dot there.
    let is_lost = |k: &usize| stages.iter().any(|stage| !stage.errors[*k].norm().is_finite());
    let caption = format!(
        "Absolute error in x, y, z of the measuring frame and its norm, on a logarithmic scale: \
         one decade lower is ten times better. None of these poses was used for fitting. Values \
         below {} mm are drawn at the lower edge.{}{}",
        number(10.0_f64.powf(floor), 4),
        omission_note((0..count).filter(is_lost).count()),
        thinning_note(shown.len(), count)
    );
    let label = "Error of each held-out pose in x, y, z and norm";
    Drawing::new(titles, caption, chart(label, &legend, &panels), data)
}
