//! Figures of the error bounds of predictions over the workspace, and of the joint errors that a
//! remainder corrects.

use std::collections::BTreeMap;

use super::chart::{LEFT_SPACE, RIGHT_SPACE};
use super::prelude::*;
use crate::quantity::format::percent_of;
use crate::remainder::{JointError, JointErrorPoint};
use crate::results::{BoundAt, CommandedJoint};

/// Number of square cells along the width of a view of the workspace.
const CELLS_PER_WIDTH: usize = 24;
/// Total number of cells divided by the number of cells that may exceed the end of the colour
/// scale.
const CELLS_PER_SATURATED: usize = 20;
/// Maximum height of a view in displayed pixels.
const MAX_HEIGHT: f64 = 330.0;
/// Height of the panel of a joint in displayed pixels.
const JOINT_HEIGHT: f64 = 64.0;

/// Draws the error bound of predictions over the workspace, from above and from the side; `None` if
/// there are no bounds.
pub fn bounds_over_workspace(data: &PlotData) -> Option<Drawing> {
    let uncertainty = data.uncertainty.as_ref()?;
    let bounds = &uncertainty.bounds;
    let extent = |axis: usize| with_margin(range(bounds.iter().map(|at| at.position[axis])), 0.04);
    let size = |axis: usize| extent(axis).1 - extent(axis).0;
    let finite = |size: f64| size > 0.0 && size.is_finite();
    if bounds.is_empty() || !(finite(size(0)) && finite(size(1)) && finite(size(2))) {
        return None;
    }
    // Both views share the size of their cells and the scale of their colours.
    let width = FIGURE_WIDTH - LEFT_SPACE - RIGHT_SPACE;
    let per_pixel = (size(0) / width).max(size(1).max(size(2)) / MAX_HEIGHT);
    let middle = 0.5 * (extent(0).0 + extent(0).1);
    let across = (middle - 0.5 * width * per_pixel, middle + 0.5 * width * per_pixel);
    let cell = (across.1 - across.0) / CELLS_PER_WIDTH as f64;
    let views = [(1, "y [m]", "x [m], seen from above"), (2, "z [m]", "x [m], seen from the side")];
    let cells = views.map(|(axis, ..)| cells(bounds, (axis, cell), (across.0, extent(axis).0)));
    let mut sorted: Vec<f64> = cells.iter().flatten().map(|cell| cell.bound).collect();
    sorted.sort_by(f64::total_cmp);
    // A few cells far from all poses would leave the others without contrast.
    let deepest = sorted.len() - 1 - sorted.len() / CELLS_PER_SATURATED;
    let (least, most) = (sorted[0], sorted[deepest]);
    let (opacity, scale) = shades((least, most), " or more");
    let shade = |bound: f64| Paint::fill(WARM).faded(opacity(bound));
    let panels = views.iter().zip(&cells).map(|(&(axis, label, below), cells)| {
        // The upper edge is that of the highest cell.
        let height = (size(axis) / cell).ceil() * cell;
        let up = (extent(axis).0, extent(axis).0 + height);
        let boxes = cells.iter().flat_map(|at| {
            let to = (at.from.0 + cell, at.from.1 + cell);
            let middle = (at.from.0 + 0.5 * cell, at.from.1 + 0.5 * cell);
            let mark = Shape::dot(middle, 1.6, Paint::line(INK, 0.8), None);
            [Shape::area(at.from, to, shade(at.bound))]
                .into_iter()
                .chain((2 * at.extrapolated > at.count).then_some(mark))
        });
        let (x, y) = (Axis::linear(across, below, 6), Axis::linear(up, label, 5));
        Panel::new((height / per_pixel).round(), x, y).with(boxes.collect::<Vec<_>>())
    });
    let panels: Vec<Panel> = panels.collect();
    let level = percent_of(uncertainty.level);
    let beyond = match bounds.iter().filter(|at| at.is_extrapolated).count() {
        0 => "none is far from all measured poses".to_owned(),
        1 => "1 is far from all measured poses; a ring marks cells where most are".to_owned(),
        n => format!("{n} are far from all measured poses; a ring marks cells where most are"),
    };
    let caption = format!(
        "{level} % bound of the error (measured − predicted), averaged over the configurations \
         whose target lies in each cell, in the frame of the arm's base: {scale}. Of {} random \
         configurations within the measured range of each joint, {beyond}.",
        bounds.len(),
    );
    let rows = bounds.iter().map(|at| {
        let numbers = at.position.iter().map(|value| fixed(value * 1e3, 3));
        let sizes = [at.bound, at.correction].map(|value| fixed(value * 1e3, 6));
        numbers.chain(sizes).chain([at.is_extrapolated.to_string()]).collect()
    });
    let header = ["x_mm", "y_mm", "z_mm", "bound_mm", "correction_mm", "extrapolated"];
    let title = "Bound of the error over the workspace";
    let svg = chart("Bound of the error from above and from the side", &[], &panels);
    Some(Drawing::new(("bounds", title), caption, svg, sheet(header, rows)))
}

/// Square cell of a view, with the mean error bound of the configurations whose position is in it.
struct Cell {
    /// Lower left corner \[m\].
    from: (f64, f64),
    /// Mean error bound \[m\].
    bound: f64,
    /// Number of configurations in the cell.
    count: usize,
    /// Number of configurations in the cell that are far from all measured poses.
    extrapolated: usize,
}

/// Returns the cells of a view that contain at least one configuration. The view is spanned by x
/// and `axis`; `cell` is the side of a cell, `left` and `bottom` are the edges of the view \[m\].
fn cells(bounds: &[BoundAt], (axis, cell): (usize, f64), (left, bottom): (f64, f64)) -> Vec<Cell> {
    let mut cells: BTreeMap<(i64, i64), Cell> = BTreeMap::new();
    for at in bounds {
        let place = |value: f64, from: f64| ((value - from) / cell).floor();
        let (x, y) = (place(at.position.x, left), place(at.position[axis], bottom));
        #[expect(clippy::cast_possible_truncation, reason = "some tens of cells")]
        let entry = cells.entry((x as i64, y as i64)).or_insert(Cell {
            from: (left + x * cell, bottom + y * cell),
            bound: 0.0,
            count: 0,
            extrapolated: 0,
        });
        entry.bound += at.bound;
        entry.count += 1;
        entry.extrapolated += usize::from(at.is_extrapolated);
    }
    let mean = |cell: Cell| Cell { bound: cell.bound / cell.count as f64, ..cell };
    cells.into_values().map(mean).collect()
}

/// Draws the error of each joint that a remainder corrects, as a function of the joint's command;
/// `None` without a remainder.
pub fn joint_errors(data: &PlotData) -> Option<Drawing> {
    let joints = &data.uncertainty.as_ref()?.joints;
    let ends = |of: fn(f64, f64) -> f64| {
        joints
            .iter()
            .flat_map(|joint| &joint.points)
            .map(move |point| of(point.mean, point.sigma) * 1e3)
    };
    let across = range(ends(|mean, sigma| mean + sigma).chain(ends(|mean, sigma| mean - sigma)));
    if joints.is_empty() || !across.0.is_finite() {
        return None;
    }
    let up = with_margin(across, 0.05);
    let command = |joint: usize| data.commands.iter().find(|command| command.joint == joint);
    let panel = |(command, joint): (&CommandedJoint, &JointError)| {
        let at = |point: &JointErrorPoint, shift: f64| {
            (point.command * command.factor(), (point.mean + shift * point.sigma) * 1e3)
        };
        let x = range(joint.points.iter().map(|point| point.command * command.factor()));
        let line = |shift: f64, paint: Paint| {
            Shape::line(joint.points.iter().map(|point| at(point, shift)), paint)
        };
        let pairs = joint.points.iter().zip(joint.points.iter().skip(1));
        let bands = pairs.map(|(point, next)| {
            let (low, high) = (at(point, -1.0), at(next, 1.0));
            Shape::band(low, (high.0, at(point, 1.0).1), ACCENT)
        });
        let label = format!("{} [{}]", command.name(), command.symbol());
        Panel::new(JOINT_HEIGHT, Axis::linear(x, &label, 6), Axis::linear(up, "mm", 3))
            .with_level(0.0)
            .with(bands.collect::<Vec<_>>())
            .with([line(0.0, Paint::line(ACCENT, 1.6))])
    };
    let named: Vec<_> =
        joints.iter().filter_map(|joint| Some((command(joint.joint)?, joint))).collect();
    let caption = "Error of each joint's coordinate that follows its own command, as motion of the \
                   target at the root mean square lever of the joint, with a band of ± 1 σ; the mean \
                   over the range is taken off. Only the part of the remainder along the motion \
                   that each joint gives the target is shown.";
    let rows = named.iter().flat_map(|(command, joint)| {
        joint.points.iter().map(|point| {
            let [mean, sigma] = [point.mean, point.sigma].map(|value| fixed(value * 1e3, 6));
            let value = fixed(point.command * command.factor(), 4);
            vec![command.name(), command.symbol(), value, mean, sigma]
        })
    });
    let data = sheet(["joint", "unit", "command", "error_mm", "sigma_mm"], rows);
    let panels: Vec<Panel> = named.iter().map(|&named| panel(named)).collect();
    let title = "Errors of the joints that the remainder corrects";
    let legend = [("mean error", ACCENT, Mark::Line), ("± 1 σ", ACCENT, Mark::Band)];
    Some(Drawing::new(("remainder-joints", title), caption, chart(title, &legend, &panels), data))
}
