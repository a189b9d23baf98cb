//! Errors of each held-out pose along each axis, stage by stage.

use nalgebra::Vector3;

use super::data::{PlotData, Stage, StageErrors, procedure_stages};
use super::pose::{omission_note, sample, thinning_note};
use super::prelude::*;
use crate::fit::{Before, Procedure};

/// Maximum number of poses in the figure.
const MAX_POSES: usize = 90;
/// Error, as a fraction of the median error of the best stage, below which values are drawn at the
/// lower edge.
const FLOOR: f64 = 0.03;
/// Height of a panel in pixels.
const PANEL: i32 = 118;

/// Returns the name of a stage in the legend.
fn stage_name(stage: Stage) -> &'static str {
    match stage {
        Stage::Registered | Stage::Before => "before",
        Stage::Ignoring => "elasticity ignored",
        Stage::Elastic => "with elasticity",
        Stage::Identified => "identified",
        Stage::Closed => "after the loop",
    }
}

/// Returns the colour of stage `index` of `count`; the best stage is accented.
fn colour(index: usize, count: usize) -> RGBColor {
    match (index, count - 1 - index) {
        (_, 0) => ACCENT,
        (0, _) => FAINT,
        (_, 1) => INK,
        _ => MUTED,
    }
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
    let names: Vec<String> =
        stages.iter().map(|stage| format!("{} [mm]", stage_name(stage.stage))).collect();
    let columns: Vec<&str> = names.iter().map(String::as_str).collect();
    let errors = |k: usize| {
        stages.iter().filter_map(|stage| Some(stage.errors.get(k)?.norm() * 1e3)).collect()
    };
    let cells = candidates.iter().map(|&k| (&data.residuals[rows[k]], errors(k)));
    let sheet = Sheet::of_poses(&columns, cells);
    let titles = ("held-out-errors", "Error of each held-out pose");
    Some(draw_stages(titles, &stages, &candidates, &rows).with(sheet))
}

/// Draws the held-out errors of one procedure of a comparison, named after it.
pub fn of_procedure(before: &Before, procedure: &Procedure) -> Drawing {
    let name = procedure.name();
    let title = format!("Error of each held-out pose: {name}");
    let stages = procedure_stages(before, procedure);
    let poses: Vec<usize> = (0..procedure.after.len()).collect();
    let errors = |k: &usize| {
        let norms =
            stages.iter().filter_map(|stage| Some(fixed(stage.errors.get(*k)?.norm() * 1e3, 6)));
        std::iter::once((k + 1).to_string()).chain(norms).collect()
    };
    let names = stages.iter().map(|stage| format!("{} [mm]", stage_name(stage.stage)));
    let header: Vec<String> = std::iter::once("held_out_pose".to_owned()).chain(names).collect();
    let sheet = Sheet { header, rows: poses.iter().map(errors).collect() };
    draw_stages((&format!("held-out-errors-{name}"), &title), &stages, &poses, &[]).with(sheet)
}

/// Draws the errors of all stages. `candidates` are the indices of held-out poses that may be
/// drawn, `rows` the rows of all held-out poses if the page knows them.
fn draw_stages(
    (name, title): (&str, &str),
    stages: &[StageErrors],
    candidates: &[usize],
    rows: &[usize],
) -> Drawing {
    let count = stages.first().map_or(0, |stage| stage.errors.len());
    let last =
        |k: usize| stages.last().and_then(|stage| stage.errors.get(k)).map_or(0.0, Vector3::norm);
    let shown = sample(candidates, MAX_POSES, last);
    let tags = Tags::of_dots();
    let size = (WIDTH, 24 + 4 * PANEL + 34);
    let mut norms: Vec<f64> = stages
        .last()
        .map_or_else(Vec::new, |stage| stage.errors.iter().map(Vector3::norm).collect());
    norms.retain(|norm| norm.is_finite());
    norms.sort_by(f64::total_cmp);
    let typical = norms.get(norms.len() / 2).copied().unwrap_or(1e-3).max(1e-9);
    let floor = (FLOOR * typical * 1e3).log10();
    let largest =
        range(stages.iter().flat_map(|stage| &stage.errors).map(|error| error.norm() * 1e3)).1;
    let extent = (floor, largest.log10() + 0.1);
    let mark = |index: usize| if index > 0 { Mark::Dot } else { Mark::Ring };
    let entries: Vec<(&str, RGBColor, Mark)> = stages
        .iter()
        .enumerate()
        .map(|(index, stage)| (stage_name(stage.stage), colour(index, stages.len()), mark(index)))
        .collect();
    let svg = figure(size, "Error of each held-out pose in x, y, z and norm", |area| {
        let panels = stacked(&legend(area, 22, &entries)?, &[PANEL, PANEL, PANEL, PANEL + 34]);
        let labels = ["|Δx| [mm]", "|Δy| [mm]", "|Δz| [mm]", "norm [mm]"];
        for (axis, (label, panel)) in labels.into_iter().zip(&panels).enumerate() {
            let last = axis == 3;
            let bottom =
                Axis::linear((0.0, count as f64 + 1.0), if last { "held-out pose" } else { "" })
                    .numbers(if last { 8 } else { 0 });
            let left = Axis::logarithmic(extent, label).numbers(4);
            draw_axis(panel, (&bottom, &left), stages, (axis, &shown), |k| {
                tags.pose(rows.get(k).copied());
            })?;
        }
        Ok(())
    });
    // Poses without equilibrium at any stage have no dot there.
    let is_lost = |k: &usize| stages.iter().any(|stage| !stage.errors[*k].norm().is_finite());
    let without = (0..count).filter(is_lost).count();
    let floor = number(10.0_f64.powf(floor), 4);
    let caption = format!(
        "Absolute error in x, y, z of the measuring frame and its norm, on a logarithmic scale: one decade lower is ten \
             times better. None of these poses was used for fitting. Values below {floor} mm are drawn at the lower \
             edge.{}{}",
        omission_note(without),
        thinning_note(shown.len(), count)
    );
    Drawing::new(name, title, caption, tags.insert_into(&svg))
}

/// Draws one panel: axis 0 to 2 is x, y, z, and 3 the norm.
fn draw_axis(
    panel: &Area,
    (x, y): (&Axis, &Axis),
    stages: &[StageErrors],
    (axis, shown): (usize, &[usize]),
    tag: impl Fn(usize),
) -> Result<(), Failure> {
    let mut chart = chart(panel, x, y)?;
    for (index, stage) in stages.iter().enumerate() {
        let colour = colour(index, stages.len());
        let value = |error: &Vector3<f64>| if axis == 3 { error.norm() } else { error[axis].abs() };
        let finite = shown.iter().copied().filter(|&k| stage.errors[k].norm().is_finite());
        let position = |k: usize| {
            (k as f64 + 1.0, (value(&stage.errors[k]) * 1e3).log10().clamp(y.range.0, y.range.1))
        };
        let points: Vec<(usize, (f64, f64))> = finite.map(|k| (k, position(k))).collect();
        chart.draw_series(LineSeries::new(
            points.iter().map(|(_, at)| *at),
            colour.mix(0.45).stroke_width(3),
        ))?;
        let style = if index == 0 { line(colour, 1.2) } else { colour.filled() };
        for (k, _) in &points {
            tag(*k);
        }
        chart.draw_series(points.into_iter().map(|(_, at)| Circle::new(at, pixels(1.9), style)))?;
    }
    Ok(())
}
