//! Figure of the residual by ranges of each joint's command.

use super::prelude::*;
use crate::numeric::whole;
use crate::results::CommandedJoint;

/// Number of equal ranges into which the commands of a joint are divided.
const COMMAND_RANGES: usize = 12;

/// Largest space for the name of a joint and its lowest command in displayed pixels.
const MAX_NAME_SPACE: f64 = 140.0;
/// Space between the boxes and the highest command in displayed pixels.
const LABEL_GAP: f64 = 6.0;

/// Range of a joint's commands, with the residuals of the poses in it.
struct JointRange {
    /// Lowest and highest command \[rad\] or \[m\].
    ends: (f64, f64),
    /// Root mean square residual \[m\]; `None` without a pose.
    rms: Option<f64>,
    /// Number of poses.
    count: usize,
}

/// Returns the ranges of a joint, numbered from 0, in ascending order; empty if the joint has the
/// same command in all poses.
fn joint_ranges(data: &PlotData, joint: usize) -> Vec<JointRange> {
    let poses = || data.residuals.iter().filter(|pose| pose.has_place());
    let poses = || poses().filter(|pose| pose.error.norm().is_finite());
    let (low, high) = range(poses().map(|pose| pose.configuration[joint]));
    if high - low <= 0.0 || !(high - low).is_finite() {
        return Vec::new();
    }
    let width = (high - low) / COMMAND_RANGES as f64;
    let mut sums = [(0.0, 0_usize); COMMAND_RANGES];
    for pose in poses() {
        let index = whole((pose.configuration[joint] - low) / width).min(COMMAND_RANGES - 1);
        sums[index].0 += pose.error.norm_squared();
        sums[index].1 += 1;
    }
    let part = |(k, (sum, count)): (usize, (f64, usize))| JointRange {
        ends: (low + width * k as f64, low + width * (k + 1) as f64),
        rms: (count > 0).then(|| (sum / count as f64).sqrt()),
        count,
    };
    sums.into_iter().enumerate().map(part).collect()
}

/// Draws a row for each joint and a box for each range, darker for a larger residual. `None` if no
/// joint moves.
pub fn joint_map(data: &PlotData) -> Option<Drawing> {
    let joints: Vec<(CommandedJoint, Vec<JointRange>)> = data
        .commands
        .iter()
        .map(|command| (*command, joint_ranges(data, command.joint)))
        .filter(|(_, ranges)| !ranges.is_empty())
        .collect();
    let (least, most) =
        range(joints.iter().flat_map(|(_, ranges)| ranges).filter_map(|part| part.rms));
    if least > most {
        return None;
    }
    let (shade, scale) = shades((least, most), "");
    let end = |command: CommandedJoint, value: f64| {
        let (symbol, value) = (command.symbol(), number(value * command.factor(), 0));
        let space = if symbol == "°" { "" } else { " " };
        format!("{}{space}{symbol}", value.replace('-', "−"))
    };
    let names = joints.iter().map(|(command, ranges)| {
        (format!("{}   {}", command.name(), end(*command, ranges[0].ends.0)), INK)
    });
    let last = |(command, ranges): &(CommandedJoint, Vec<JointRange>)| {
        end(*command, ranges[COMMAND_RANGES - 1].ends.1)
    };
    let longest = joints.iter().map(|joint| text_width(&last(joint))).fold(0.0, f64::max);
    let shapes = joints.iter().enumerate().flat_map(|(row, joint)| {
        let (command, ranges) = joint;
        let row = row as f64;
        let boxes = ranges.iter().enumerate().map(move |(k, part)| {
            let [low, high] = [part.ends.0, part.ends.1].map(|end| end * command.factor());
            let paint = match part.rms {
                Some(rms) => Paint::fill(WARM).faded(shade(rms)),
                None => Paint::line(FAINT, 0.5),
            };
            let corners = [(k as f64 + 0.02, row - 0.42), (k as f64 + 0.98, row + 0.42)];
            let tag = format!(
                " data-joint=\"{}\" data-low=\"{low:.6}\" data-high=\"{high:.6}\"",
                command.joint
            );
            Shape::Box { corners, paint, tag }
        });
        boxes.chain([Shape::text((COMMAND_RANGES as f64, row), LABEL_GAP, last(joint), MUTED)])
    });
    let sides = (MAX_NAME_SPACE, LABEL_GAP + longest);
    let panel =
        Panel::of_rows(26.0, sides, Axis::bare((0.0, COMMAND_RANGES as f64)), names).with(shapes);
    let caption = format!(
        "Root mean square residual over the poses in which a joint is in one twelfth of its \
         measured range: {scale}; an empty box has no pose. A change along a row \
         may come from an error of that joint, or from whatever varies with it over these poses.",
    );
    let rows = joints.iter().flat_map(|(command, ranges)| {
        ranges.iter().map(|part| {
            let [low, high] =
                [part.ends.0, part.ends.1].map(|end| fixed(end * command.factor(), 4));
            let rms = part.rms.map_or_else(String::new, |rms| fixed(rms * 1e3, 6));
            vec![command.name(), command.symbol(), low, high, part.count.to_string(), rms]
        })
    });
    let title = "Residual by ranges of each joint";
    let data = sheet(["joint", "unit", "from", "to", "poses", "rms_mm"], rows);
    Some(Drawing::new(("residual-joints", title), caption, chart(title, &[], &[panel]), data))
}
