//! Error of each held-out pose along each axis, state by state.

use nalgebra::Vector3;

use super::data::{PlotData, Stage, StageErrors, own_stages};
use super::pose::{left_out, thin, thinned};
use super::prelude::*;
use crate::fit::{Before, Procedure};

/// Poses that are drawn at most.
const MOST: usize = 90;
/// Errors below this part of the best state's typical one are drawn at the lower edge.
const FLOOR: f64 = 0.03;
const PANEL: i32 = 118;

/// A state of the arm in words.
fn stage_name(stage: Stage) -> &'static str {
    match stage {
        Stage::Registered | Stage::Before => "before",
        Stage::Ignoring => "elasticity ignored",
        Stage::Elastic => "with elasticity",
        Stage::Identified => "identified",
        Stage::Closed => "after the loop",
    }
}

/// Colour of a state; the best one stands out.
fn colour(place: usize, count: usize) -> RGBColor {
    match (place, count - 1 - place) {
        (_, 0) => ACCENT,
        (0, _) => FAINT,
        (_, 1) => INK,
        _ => MUTED,
    }
}

/// The error of every held-out pose in x, y, z and norm [Chen2021, fig. 13].
///
/// None where no held-out row measures a position.
pub fn errors(data: &PlotData) -> Option<Drawing> {
    let all = data.held_out();
    let places: Vec<usize> = (0..all.len()).filter(|&k| data.is_position(all[k])).collect();
    let rows: Vec<usize> = places.iter().map(|&k| all[k]).collect();
    let of_positions = |own: &StageErrors| {
        let errors = places.iter().filter_map(|&k| own.errors.get(k).copied()).collect();
        StageErrors { stage: own.stage, errors }
    };
    let stages: Vec<StageErrors> = data.stages.iter().map(of_positions).collect();
    if rows.is_empty() || stages.is_empty() {
        return None;
    }
    let known: Vec<usize> =
        (0..rows.len()).filter(|&k| data.shown.binary_search(&rows[k]).is_ok()).collect();
    let names: Vec<String> =
        stages.iter().map(|stage| format!("{} [mm]", stage_name(stage.stage))).collect();
    let columns: Vec<&str> = names.iter().map(String::as_str).collect();
    let errors = |k: usize| {
        stages.iter().filter_map(|stage| Some(stage.errors.get(k)?.norm() * 1e3)).collect()
    };
    let sheet =
        Sheet::of_poses(&columns, known.iter().map(|&k| (&data.residuals[rows[k]], errors(k))));
    Some(
        drawn(("held-out-errors", "Error of each held-out pose"), &stages, &known, &rows)
            .with(sheet),
    )
}

/// The same of one procedure of a comparison, by its name.
pub fn of_procedure(before: &Before, own: &Procedure) -> Drawing {
    let name = own.name();
    let title = format!("Error of each held-out pose: {name}");
    let stages = own_stages(before, own);
    let all: Vec<usize> = (0..own.after.len()).collect();
    let errors = |k: &usize| {
        let norms =
            stages.iter().filter_map(|stage| Some(fixed(stage.errors.get(*k)?.norm() * 1e3, 6)));
        std::iter::once((k + 1).to_string()).chain(norms).collect()
    };
    let names = stages.iter().map(|stage| format!("{} [mm]", stage_name(stage.stage)));
    let header: Vec<String> = std::iter::once("held_out_pose".to_owned()).chain(names).collect();
    let sheet = Sheet { header, rows: all.iter().map(errors).collect() };
    drawn((&format!("held-out-errors-{name}"), &title), &stages, &all, &[]).with(sheet)
}

/// Poses `known` by their places among the held-out ones may be drawn; `rows` are those of all,
/// where a page knows them.
fn drawn(
    (name, title): (&str, &str),
    states: &[StageErrors],
    known: &[usize],
    rows: &[usize],
) -> Drawing {
    let count = states.first().map_or(0, |state| state.errors.len());
    let last =
        |k: usize| states.last().and_then(|state| state.errors.get(k)).map_or(0.0, Vector3::norm);
    let shown = thin(known, MOST, last);
    let tags = Tags::of_dots();
    let size = (WIDTH, 24 + 4 * PANEL + 34);
    let mut norms: Vec<f64> = states
        .last()
        .map_or_else(Vec::new, |state| state.errors.iter().map(Vector3::norm).collect());
    norms.retain(|norm| norm.is_finite());
    norms.sort_by(f64::total_cmp);
    let typical = norms.get(norms.len() / 2).copied().unwrap_or(1e-3).max(1e-9);
    let floor = (FLOOR * typical * 1e3).log10();
    let most =
        range(states.iter().flat_map(|state| &state.errors).map(|error| error.norm() * 1e3)).1;
    let extent = (floor, most.log10() + 0.1);
    let mark = |place: usize| if place > 0 { Mark::Dot } else { Mark::Ring };
    let entries: Vec<(&str, RGBColor, Mark)> = states
        .iter()
        .enumerate()
        .map(|(place, state)| (stage_name(state.stage), colour(place, states.len()), mark(place)))
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
            draw(panel, (&bottom, &left), states, (axis, &shown), |k| {
                tags.pose(rows.get(k).copied())
            })?;
        }
        Ok(())
    });
    // In any of the states: their dots are not there.
    let lost = |k: &usize| states.iter().any(|state| !state.errors[*k].norm().is_finite());
    let without = (0..count).filter(lost).count();
    let floor = number(10.0_f64.powf(floor), 4);
    let caption = format!(
        "Absolute error in x, y, z of the measuring frame and its norm, on a logarithmic scale: one division of ten down \
             is ten times better. None of these poses took part in fitting. Values below {floor} mm are drawn at the lower \
             edge.{}{}",
        left_out(without),
        thinned(shown.len(), count)
    );
    Drawing::new(name, title, caption, tags.put(&svg))
}

fn draw(
    panel: &Area,
    (x, y): (&Axis, &Axis),
    states: &[StageErrors],
    (axis, shown): (usize, &[usize]),
    tag: impl Fn(usize),
) -> Result<(), Failure> {
    let mut chart = chart(panel, x, y)?;
    for (place, state) in states.iter().enumerate() {
        let colour = colour(place, states.len());
        let value = |error: &Vector3<f64>| if axis == 3 { error.norm() } else { error[axis].abs() };
        let there = shown.iter().copied().filter(|&k| state.errors[k].norm().is_finite());
        let at = |k: usize| {
            (k as f64 + 1.0, (value(&state.errors[k]) * 1e3).log10().clamp(y.range.0, y.range.1))
        };
        let points: Vec<(usize, (f64, f64))> = there.map(|k| (k, at(k))).collect();
        chart.draw_series(LineSeries::new(
            points.iter().map(|own| own.1),
            colour.mix(0.45).stroke_width(3),
        ))?;
        let style = if place == 0 { line(colour, 1.2) } else { colour.filled() };
        for (k, _) in &points {
            tag(*k);
        }
        chart.draw_series(points.into_iter().map(|(_, at)| Circle::new(at, pixels(1.9), style)))?;
    }
    Ok(())
}
