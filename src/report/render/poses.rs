//! Pose by pose: the arm in three dimensions, ranges of joints to choose by, the largest residuals,
//! and what the script knows.

use maud::{Markup, PreEscaped, html};
use nalgebra::Vector3;
use serde::Serialize;

use crate::model::CentreLine;
use crate::report::figures::{PlotData, Point};
use crate::report::quantity::{mm, number};
use crate::report::table::Command;

/// Poses in the table.
const LISTED: usize = 12;

/// What the script knows of a page.
#[derive(Debug, Serialize)]
struct Store {
    /// Name, unit and number of each joint that takes a command.
    joints: Vec<(String, String, usize)>,
    poses: Vec<Entry>,
    /// What residuals may be traced to: its name, and rows with its value.
    traced: Vec<(String, Vec<(usize, f64)>)>,
    /// Positions that no fitted pose is near \[mm\].
    uncovered: Vec<[f64; 3]>,
}

/// A pose; lengths in mm.
#[derive(Debug, Serialize)]
struct Entry {
    row: usize,
    place: String,
    held_out: bool,
    /// What was measured, where that is no position.
    #[serde(skip_serializing_if = "Option::is_none")]
    kind: Option<&'static str>,
    /// How many poses it stands for, where not all are there.
    #[serde(skip_serializing_if = "Option::is_none")]
    n: Option<f64>,
    q: Vec<f64>,
    position: [f64; 3],
    before: [f64; 3],
    after: [f64; 3],
    /// The arm as a line, and by how much it gives.
    #[serde(skip_serializing_if = "Option::is_none")]
    rigid: Option<Vec<i64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    give: Option<Vec<f64>>,
}

/// With so many decimals; NaN, which JSON does not have, becomes null.
fn rounded(value: f64, decimals: i32) -> f64 {
    let power = 10.0_f64.powi(decimals);
    let rounded = (value * power).round() / power;
    // Never −0.
    rounded + 0.0
}

fn millimetres(length: &Vector3<f64>, decimals: i32) -> [f64; 3] {
    [length.x, length.y, length.z].map(|x| rounded(x * 1e3, decimals))
}

/// Points of the rigid arm \[mm\].
fn rigid(arm: &CentreLine) -> Vec<i64> {
    #[expect(clippy::cast_possible_truncation, reason = "millimetres of an arm")]
    let whole = |x: f64| (x * 1e3).round() as i64;
    arm.rigid.iter().flat_map(|at| [at.x, at.y, at.z]).map(whole).collect()
}

/// How far they give \[mm\].
fn give(arm: &CentreLine) -> Vec<f64> {
    arm.bent
        .iter()
        .zip(&arm.rigid)
        .flat_map(|(bent, rigid)| millimetres(&(bent - rigid), 2))
        .collect()
}

impl Store {
    fn of(data: &PlotData) -> Self {
        let joint = |own: &Command| (own.name(), own.symbol(), own.joint);
        let entry = |((&row, &count), arm): ((&usize, &f64), &Option<CentreLine>)| {
            let own = &data.residuals[row];
            Entry {
                row,
                place: own.place.clone(),
                held_out: own.held_out,
                kind: Some(own.observation.kind()).filter(|_| !own.observation.is_position()),
                n: Some(count).filter(|count| *count > 1.0),
                q: data
                    .commands
                    .iter()
                    .map(|own_q| rounded(own.configuration[own_q.joint] * own_q.factor(), 5))
                    .collect(),
                position: millimetres(&own.position, 2),
                before: millimetres(&own.before, 4),
                after: millimetres(&own.error, 4),
                rigid: arm.as_ref().map(rigid),
                give: arm.as_ref().filter(|arm| arm.bent != arm.rigid).map(give),
            }
        };
        let traced = data.causes.iter().map(|cause| {
            let value = |point: &Point| {
                let row = point.row.filter(|row| data.shown.binary_search(row).is_ok())?;
                Some((row, rounded(point.x * cause.across.factor, 4)))
            };
            (cause.across.label.clone(), cause.points.iter().filter_map(value).collect())
        });
        Self {
            joints: data.commands.iter().map(joint).collect(),
            poses: data.shown.iter().zip(&data.stand_for).zip(&data.arms).map(entry).collect(),
            traced: traced.collect(),
            uncovered: data.coverage.uncovered.iter().map(|at| millimetres(at, 0)).collect(),
        }
    }
}

/// The data of a page for its script; nothing in it ends the element that holds it.
fn store(data: &PlotData) -> String {
    serde_json::to_string(&Store::of(data))
        .unwrap_or_default()
        .replace('<', "\\u003c")
        .replace("//", "/\\/")
}

/// The section.
pub(super) fn section(data: &PlotData) -> Markup {
    let without = without_positions(data);
    if data.shown.is_empty() && !without.is_empty() {
        return html! { p { (without) } };
    }
    html! {
        h2 { "Pose by pose" }
        @if !without.is_empty() { p { (without) } }
        p hidden data-script { "Point at a dot of any figure to see which row it is; choose it, here or there, and all figures mark it." }
        (view(data))
        (ranges(data))
        div.chosen id="chosen" hidden {
            output aria-live="polite" {}
            " " button type="button" data-do="larger" { "next larger" }
            " " button type="button" data-do="smaller" { "next smaller" }
            " " button type="button" data-do="none" { "none" }
        }
        (largest(data))
        script type="application/json" id="poses" { (PreEscaped(store(data))) }
    }
}

/// What is not drawn of rows that measure no positions; nothing to say where all do.
fn without_positions(data: &PlotData) -> String {
    if data.residuals.iter().all(|own| own.observation.is_position()) {
        return String::new();
    }
    let figures = if data.has_positions() {
        "show positions alone"
    } else {
        "are left out: no row measures a position"
    };
    let tilts = if data.residuals.iter().any(|own| own.observation.is_angle()) {
        "; tilts have no place"
    } else {
        ""
    };
    format!(
        "Figures of errors along axes, of residual vectors and of residuals in order {figures}. In the view of the arm, contacts and \
         distances stand where the fitted arm has its target, those of one number without a stroke{tilts}."
    )
}

/// The arm in its poses; shown by the script where there is WebGL. The figure of residual vectors
/// is the same without.
fn view(data: &PlotData) -> Markup {
    let coverage = &data.coverage;
    let share = 100.0 * (1.0 - coverage.uncovered.len() as f64 / coverage.tried.max(1) as f64);
    html! {
        div.view id="view" hidden {
            canvas tabindex="0" role="img" aria-label="The arm in its poses, with the residual of each: drag or use the arrow keys to turn it, + and − to come closer" {}
            div.controls {
                label { "deflection, times " input type="range" data-view="give" min="0" max="3" step="0.01" value="0"; }
                label { "length of strokes " input type="range" data-view="length" min="-1" max="1" step="0.01" value="0"; }
                label { "strokes " select data-view="vectors" {
                    option value="after" { "residual after" } option value="before" { "residual before" } option value="none" { "none" }
                } }
                label { "colour by " select data-view="colour" {
                    option value="kind" { "held out or fitted" } option value="size" { "size of the residual" }
                } }
                label { input type="checkbox" data-view="fitted" checked; " fitted" }
                label { input type="checkbox" data-view="held_out" checked; " held out" }
                label { input type="checkbox" data-view="arms" checked; " arms" }
                label { input type="checkbox" data-view="uncovered"; " workspace not covered" }
            }
            p.under { output {} }
        }
        @if coverage.tried > 0 {
            p { (number(share, 0)) " % of " (coverage.tried) " positions evenly drawn from the joints' limits (or measured ranges, where no \
                limit is declared) lie within " (mm(coverage.near, 0)) " mm of a fitted pose." }
        }
    }
}

/// Two ends of a range for each joint.
fn ranges(data: &PlotData) -> Markup {
    html! {
        div.brush id="brush" hidden {
            p { "Keep the poses in which each joint stands between two angles; a box of the map of joints does the same:" }
            @for (k, command) in data.commands.iter().enumerate() {
                fieldset {
                    legend { (command.name()) " " span data-range=(k) {} }
                    input type="range" data-joint=(k) aria-label={ (command.name()) " from" };
                    input type="range" data-joint=(k) aria-label={ (command.name()) " to" };
                }
            }
            p { output aria-live="polite" {} " " button type="button" { "all" } }
        }
    }
}

/// The largest residuals with their rows.
fn largest(data: &PlotData) -> Markup {
    let mut rows: Vec<usize> =
        data.shown.iter().copied().filter(|&row| data.size(row).is_finite()).collect();
    rows.sort_by(|&a, &b| data.size(b).total_cmp(&data.size(a)));
    rows.truncate(LISTED);
    html! {
        @let all = data.residuals.iter().all(|own| own.observation.is_position());
        p { "The largest residuals of " (data.placed()) @if all { " poses:" } @else { " rows:" } }
        div.scroll tabindex="0" role="region" aria-label="The largest residuals" { table.sort {
            thead { tr {
                th.l { "row" } th.l { "pose" }
                @for own in &data.commands { th.o { (own.name()) ", " (own.symbol()) } }
                th.o { "before, mm" } th { "residual, mm" } th.o { "in σ" }
            } }
            tbody { @for row in rows {
                @let own = &data.residuals[row];
                tr data-row=(row) {
                    td.l { (own.place) } td.l { @if own.held_out { "held out" } @else { "fitted" } }
                    @for command in &data.commands {
                        td.o { (number(own.configuration[command.joint] * command.factor(), 2).replace('-', "−")) }
                    }
                    td.o { (mm(own.before.norm(), 3)) } td { (mm(own.error.norm(), 4)) } td.o { (number(own.error.norm() / own.sigma, 1)) }
                }
            } }
        } }
    }
}
