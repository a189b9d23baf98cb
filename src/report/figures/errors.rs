//! Error of each held-out pose along each axis, state by state.

use nalgebra::Vector3;
use plotters::prelude::*;

use super::data::{PlotData, Stage, StageErrors, own_stages};
use super::frame::{
    ACCENT, Area, Axis, Drawing, FAINT, Failure, INK, MUTED, Mark, WIDTH, chart, every, figure, left_out, legend, line,
    radius, range, stacked, thinned,
};
use crate::identify::{Before, Procedure};
use crate::report::quantity::number;

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
pub fn errors(data: &PlotData) -> Drawing {
    drawn("held-out-errors", "Error of each held-out pose", &data.stages)
}

/// The same of one procedure of a comparison, by its name.
pub fn of_procedure(before: &Before, own: &Procedure) -> Drawing {
    let name = own.name();
    let title = format!("Error of each held-out pose: {name}");
    drawn(&format!("held-out-errors-{name}"), &title, &own_stages(before, own))
}

fn drawn(name: &str, title: &str, states: &[StageErrors]) -> Drawing {
    let count = states.first().map_or(0, |state| state.errors.len());
    let step = every(count, MOST);
    let size = (WIDTH, 24 + 4 * PANEL + 34);
    let mut norms: Vec<f64> =
        states.last().map_or_else(Vec::new, |state| state.errors.iter().map(Vector3::norm).collect());
    norms.retain(|norm| norm.is_finite());
    norms.sort_by(f64::total_cmp);
    let typical = norms.get(norms.len() / 2).copied().unwrap_or(1e-3).max(1e-9);
    let floor = (FLOOR * typical * 1e3).log10();
    let most = range(states.iter().flat_map(|state| &state.errors).map(|error| error.norm() * 1e3)).1;
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
            let bottom = Axis::linear((0.0, count as f64 + 1.0), if last { "held-out pose" } else { "" })
                .numbers(if last { 8 } else { 0 });
            let left = Axis::logarithmic(extent, label).numbers(4);
            draw(panel, &bottom, &left, states, (axis, step))?;
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
        thinned(step)
    );
    Drawing::new(name, title, caption, svg)
}

fn draw(panel: &Area, x: &Axis, y: &Axis, states: &[StageErrors], (axis, step): (usize, usize)) -> Result<(), Failure> {
    let mut chart = chart(panel, x, y)?;
    for (place, state) in states.iter().enumerate() {
        let colour = colour(place, states.len());
        let value = |error: &Vector3<f64>| if axis == 3 { error.norm() } else { error[axis].abs() };
        let points: Vec<(f64, f64)> = (0..state.errors.len())
            .step_by(step)
            .filter(|&k| state.errors[k].norm().is_finite())
            .map(|k| (k as f64 + 1.0, (value(&state.errors[k]) * 1e3).log10().clamp(y.range.0, y.range.1)))
            .collect();
        chart.draw_series(LineSeries::new(points.iter().copied(), colour.mix(0.45).stroke_width(3)))?;
        let style = if place == 0 { line(colour, 1.2) } else { colour.filled() };
        chart.draw_series(points.into_iter().map(|at| Circle::new(at, radius(1.9), style)))?;
    }
    Ok(())
}
