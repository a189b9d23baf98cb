//! Section of the page on individual poses: view of the arm, ranges of joints, the largest
//! residuals, and the data of the script.

use maud::{Markup, PreEscaped, html};

use crate::quantity::format::{mm, number};
use crate::results::{PlotData, ScriptData};

/// Maximum number of rows in the table of the largest residuals.
const MAX_LISTED_ROWS: usize = 12;

/// Renders the section on individual poses; a sentence alone if no row can be drawn.
pub(super) fn section(data: &PlotData) -> Markup {
    let without = without_positions(data);
    if data.shown.is_empty() && !without.is_empty() {
        return html! { p { (without) } };
    }
    html! {
        h2 { "Individual poses" }
        @if !without.is_empty() { p { (without) } }
        p hidden data-script { "Point at a dot of any figure to see its row; select it, here or there, and all figures mark it." }
        (view(data))
        (ranges(data))
        div.chosen id="chosen" hidden {
            output aria-live="polite" {}
            " " button type="button" data-do="larger" { "next larger" }
            " " button type="button" data-do="smaller" { "next smaller" }
            " " button type="button" data-do="none" { "none" }
        }
        (largest(data))
        // Escapes keep the data from ending the element that contains them.
        @let json = serde_json::to_string(&ScriptData::of(data)).unwrap_or_default();
        script type="application/json" id="poses" { (PreEscaped(json.replace('<', "\\u003c").replace("//", "/\\/"))) }
    }
}

/// Returns sentences on how figures treat rows that do not measure positions; empty if all rows do.
fn without_positions(data: &PlotData) -> String {
    if data.residuals.iter().all(|residual| residual.observation.is_position()) {
        return String::new();
    }
    let figures = if data.has_positions() {
        "show positions only"
    } else {
        "are omitted: no row measures a position"
    };
    let mut placeless: Vec<&str> = Vec::new();
    for observation in data.residuals.iter().map(|residual| residual.observation) {
        let kind = observation.description();
        let has_place = observation.measures_length() || !observation.is_of_arm();
        if !has_place && !placeless.contains(&kind.measured) {
            placeless.push(kind.measured);
        }
    }
    let placeless = match placeless.join(" and ") {
        words if words.is_empty() => words,
        words => format!("; {words} have no position"),
    };
    format!(
        "Figures of errors along axes, of residual vectors and of residuals in order {figures}. In the view of the arm, contacts and \
         distances are at the target of the fitted arm, single values without a line{placeless}."
    )
}

/// Renders the view of the arm in its poses, which the script shows if WebGL is available, and
/// states the coverage of the workspace.
fn view(data: &PlotData) -> Markup {
    let coverage = &data.coverage;
    let share = 100.0 * (1.0 - coverage.uncovered.len() as f64 / coverage.tried.max(1) as f64);
    html! {
        div.view id="view" hidden {
            canvas tabindex="0" role="img" aria-label="The arm in its poses, with the residual of each: drag or use the arrow keys to turn it, + and − to come closer" {}
            div.controls {
                label { "deflection, times " input type="range" data-view="give" min="0" max="3" step="0.01" value="0"; }
                label { "length of lines " input type="range" data-view="length" min="-1" max="1" step="0.01" value="0"; }
                label { "lines " select data-view="vectors" {
                    option value="after" { "residual" } option value="before" { "error of the nominal arm" } option value="none" { "none" }
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
            p { "Coverage: of " (coverage.tried) " configurations spread evenly over the joint limits (measured ranges where none are declared), "
                (number(share, 0)) " % end within " (mm(coverage.near, 0)) " mm of a fitted pose. That distance is a tenth of the diagonal of the box around the end points of these configurations." }
        }
    }
}

/// Renders two sliders (lower and upper limit) for each joint, by which the script selects poses.
fn ranges(data: &PlotData) -> Markup {
    html! {
        div.brush id="brush" hidden {
            p { "Show only poses with each joint within these limits. A click on a box of the figure “Residual by ranges of each joint” does the same:" }
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

/// Renders the table of the largest residuals.
fn largest(data: &PlotData) -> Markup {
    let mut rows: Vec<usize> =
        data.shown.iter().copied().filter(|&row| data.residual_length(row).is_finite()).collect();
    rows.sort_by(|&a, &b| data.residual_length(b).total_cmp(&data.residual_length(a)));
    rows.truncate(MAX_LISTED_ROWS);
    html! {
        @let all_positions = data.residuals.iter().all(|residual| residual.observation.is_position());
        p { "The largest residuals of " (data.length_count()) @if all_positions { " poses:" } @else { " rows:" } }
        div.scroll tabindex="0" role="region" aria-label="The largest residuals" { table.sort {
            thead { tr {
                th.l { "row" } th.l { "pose" }
                @for command in &data.commands { th.o { (command.name()) ", " (command.symbol()) } }
                th.o { "nominal arm, mm" } th { "residual, mm" } th.o { "in σ" }
            } }
            tbody { @for row in rows {
                @let residual = &data.residuals[row];
                tr data-row=(row) {
                    td.l { (residual.place) } td.l { @if residual.held_out { "held out" } @else { "fitted" } }
                    @for command in &data.commands {
                        td.o { (number(residual.configuration[command.joint] * command.factor(), 2).replace('-', "−")) }
                    }
                    td.o { (mm(residual.before.norm(), 3)) } td { (mm(residual.error.norm(), 4)) } td.o { (number(residual.error.norm() / residual.sigma, 1)) }
                }
            } }
        } }
    }
}
