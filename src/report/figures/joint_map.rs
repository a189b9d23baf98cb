//! The residual by ranges of each joint.

use super::data::PlotData;
use super::prelude::*;

/// Ranges of a joint.
const PARTS: usize = 12;
const ROW: i32 = 26;
/// Room for names, and for the ends of the ranges.
const NAMES: i32 = 40;
const ENDS: i32 = 52;
const CELL: i32 = (WIDTH - NAMES - 2 * ENDS) / 12;

/// A range of a joint: its ends, and the root mean square of the residuals there \[m\] over how
/// many poses.
struct Part {
    ends: (f64, f64),
    rms: f64,
    count: usize,
}

/// Residuals of a joint's ranges, from the lowest to the highest.
fn parts(data: &PlotData, joint: usize) -> Vec<Part> {
    let of =
        || data.residuals.iter().filter(|pose| pose.has_place() && pose.error.norm().is_finite());
    let (low, high) = range(of().map(|pose| pose.configuration[joint]));
    if high - low <= 0.0 || !(high - low).is_finite() {
        return Vec::new();
    }
    let width = (high - low) / PARTS as f64;
    let mut sums = vec![(0.0, 0_usize); PARTS];
    for pose in of() {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped to the parts"
        )]
        let part =
            ((pose.configuration[joint] - low) / width).clamp(0.0, PARTS as f64 - 1.0) as usize;
        sums[part].0 += pose.error.norm_squared();
        sums[part].1 += 1;
    }
    let part = |(k, (sum, count)): (usize, (f64, usize))| Part {
        ends: (low + width * k as f64, low + width * (k + 1) as f64),
        rms: (sum / count.max(1) as f64).sqrt(),
        count,
    };
    sums.into_iter().enumerate().map(part).collect()
}

/// A row a joint, a box a range, darker where the residual is larger.
pub fn joint_map(data: &PlotData) -> Option<Drawing> {
    let joints: Vec<_> = data
        .commands
        .iter()
        .map(|own| (own, parts(data, own.joint)))
        .filter(|own| !own.1.is_empty())
        .collect();
    let rms = |part: &Part| Some(part.rms).filter(|_| part.count > 0);
    let (least, most) = range(joints.iter().flat_map(|(_, parts)| parts).filter_map(rms));
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
        for (row, (command, parts)) in (0..).zip(&joints) {
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
                parts.first().map_or(0.0, |own| own.ends.0),
                parts.last().map_or(0.0, |own| own.ends.1),
            );
            write(area, &end(first), (NAMES + ENDS - 6, middle), MUTED, HPos::Right)?;
            write(area, &end(last), (NAMES + ENDS + 12 * CELL + 6, middle), MUTED, HPos::Left)?;
            for (k, part) in (0..).zip(parts) {
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
                tags.own(format!(
                    " data-joint=\"{}\" data-low=\"{low:.6}\" data-high=\"{high:.6}\"",
                    command.joint
                ));
                match rms(part) {
                    Some(rms) => {
                        area.draw(&Rectangle::new(corners, WARM.mix(shade(rms)).filled()))?
                    }
                    None => area.draw(&Rectangle::new(corners, line(FAINT, 0.5)))?,
                }
            }
        }
        Ok(())
    });
    let caption = format!(
        "Root mean square of the residual over the poses in which a joint stands in a twelfth of its measured range: pale {} \
         mm, deep {} mm; an empty box has no pose. A joint whose row changes along it is where to look.",
        two_digits(least * 1e3, 4),
        two_digits(most * 1e3, 4)
    );
    let header = ["joint", "unit", "from", "to", "poses", "rms_mm"];
    Some(
        Drawing::new(
            "residual-joints",
            "What is left, by ranges of each joint",
            caption,
            tags.put(&svg),
        )
        .with(Sheet::new(&header, rows)),
    )
}
