//! Residual by ranges of each joint.

use super::data::PlotData;
use super::prelude::*;

/// Number of ranges of a joint.
const RANGES: usize = 12;
/// Height of a row in pixels.
const ROW: i32 = 26;
/// Width for names in pixels.
const NAMES: i32 = 40;
/// Width for the ends of the ranges in pixels.
const ENDS: i32 = 52;
/// Width of a cell in pixels.
const CELL: i32 = (WIDTH - NAMES - 2 * ENDS) / 12;

/// Range of a joint with its ends and the root mean square residual of the poses in it \[m\].
struct JointRange {
    ends: (f64, f64),
    rms: f64,
    count: usize,
}

/// Returns the ranges of a joint in ascending order.
fn joint_ranges(data: &PlotData, joint: usize) -> Vec<JointRange> {
    let positions =
        || data.residuals.iter().filter(|pose| pose.has_place() && pose.error.norm().is_finite());
    let (low, high) = range(positions().map(|pose| pose.configuration[joint]));
    if high - low <= 0.0 || !(high - low).is_finite() {
        return Vec::new();
    }
    let width = (high - low) / RANGES as f64;
    let mut sums = vec![(0.0, 0_usize); RANGES];
    for pose in positions() {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped to the ranges"
        )]
        let index =
            ((pose.configuration[joint] - low) / width).clamp(0.0, RANGES as f64 - 1.0) as usize;
        sums[index].0 += pose.error.norm_squared();
        sums[index].1 += 1;
    }
    let part = |(k, (sum, count)): (usize, (f64, usize))| JointRange {
        ends: (low + width * k as f64, low + width * (k + 1) as f64),
        rms: (sum / count.max(1) as f64).sqrt(),
        count,
    };
    sums.into_iter().enumerate().map(part).collect()
}

/// Draws a row per joint and a box per range, darker for a larger residual.
pub fn joint_map(data: &PlotData) -> Option<Drawing> {
    let joints: Vec<_> = data
        .commands
        .iter()
        .map(|command| (command, joint_ranges(data, command.joint)))
        .filter(|(_, ranges)| !ranges.is_empty())
        .collect();
    let rms = |part: &JointRange| Some(part.rms).filter(|_| part.count > 0);
    let (least, most) = range(joints.iter().flat_map(|(_, ranges)| ranges).filter_map(rms));
    if least > most {
        return None;
    }
    let count = i32::try_from(joints.len()).unwrap_or_default();
    let shade = |value: f64| {
        if most > least { 0.08 + 0.92 * (value - least) / (most - least) } else { 0.5 }
    };
    let tags = Tags::of_boxes();
    let mut rows = Vec::new();
    let svg = figure((WIDTH, 34 + ROW * count), "Residual by ranges of each joint", |area| {
        for (row, (command, ranges)) in (0..).zip(&joints) {
            let unit = command.unit.display(1.0);
            let (top, middle) = (28 + ROW * row, 28 + ROW * row + ROW / 2);
            write(area, &command.name(), (NAMES - 8, middle), INK, HPos::Right)?;
            let end = |value: f64| {
                format!(
                    "{}{}{}",
                    number(value * unit.factor, 0).replace('-', "−"),
                    if unit.symbol == "°" { "" } else { " " },
                    unit.symbol
                )
            };
            let (first, last) = (
                ranges.first().map_or(0.0, |part| part.ends.0),
                ranges.last().map_or(0.0, |part| part.ends.1),
            );
            write(area, &end(first), (NAMES + ENDS - 6, middle), MUTED, HPos::Right)?;
            write(area, &end(last), (NAMES + ENDS + 12 * CELL + 6, middle), MUTED, HPos::Left)?;
            for (k, part) in (0..).zip(ranges) {
                let left = NAMES + ENDS + CELL * k;
                let corners =
                    [(px(left) + 2, px(top + 2)), (px(left + CELL) - 2, px(top + ROW - 2))];
                let (low, high) = (part.ends.0 * unit.factor, part.ends.1 * unit.factor);
                rows.push(vec![
                    command.name(),
                    unit.symbol.clone(),
                    fixed(low, 4),
                    fixed(high, 4),
                    part.count.to_string(),
                    rms(part).map_or_else(String::new, |rms| fixed(rms * 1e3, 6)),
                ]);
                tags.push(format!(
                    " data-joint=\"{}\" data-low=\"{low:.6}\" data-high=\"{high:.6}\"",
                    command.joint
                ));
                match rms(part) {
                    Some(rms) => {
                        area.draw(&Rectangle::new(corners, WARM.mix(shade(rms)).filled()))?;
                    }
                    None => area.draw(&Rectangle::new(corners, line(FAINT, 0.5)))?,
                }
            }
        }
        Ok(())
    });
    let caption = format!(
        "Root mean square residual over the poses in which a joint is in one twelfth of its measured range: pale {} \
         mm, deep {} mm; an empty box has no pose. A change along a row points to an error of that joint.",
        two_digits(least * 1e3, 4),
        two_digits(most * 1e3, 4)
    );
    let header = ["joint", "unit", "from", "to", "poses", "rms_mm"];
    Some(
        Drawing::new(
            "residual-joints",
            "Residual by ranges of each joint",
            caption,
            tags.insert_into(&svg),
        )
        .with(Sheet::new(&header, rows)),
    )
}
