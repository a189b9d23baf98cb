//! Results of any procedure in the form of tables 2 and 3 of \[Chen2021\].

use super::document::Table;
use crate::fit::{AxisValues, Comparison, ErrorSummary, PaperTableEntry, Procedure};
use crate::paper::published::{BEFORE, Published, WITH_ELASTICITY, WITHOUT_ELASTICITY};
use crate::paper::{Form, StiffnessStage};
use crate::quantity::format::{mm, number, or_dash};
use crate::results::registered_parts;

/// Smallest identified share at which a parameter is shown without a mark.
const MIN_UNMARKED_SHARE: f64 = 0.9;

/// Header of the parameters of a joint in table 2.
const FIELDS: [&str; 5] = ["α °", "a mm", "θ °", "d mm", "β °"];

/// Describes a procedure of the paper, or the joint fit, in words.
pub(super) fn title(procedure: &Procedure) -> String {
    let Some((form, stage)) = procedure.paper else {
        return "Everything fitted at once (joint)".to_owned();
    };
    let form = match form {
        Form::Printed => "as printed",
        _ => "misprints corrected",
    };
    let stage = match stage {
        StiffnessStage::Rigid => "elasticity ignored",
        StiffnessStage::Nominal => "stiffness taken as declared",
        StiffnessStage::Positions => "stiffness from positions at nominal geometry",
        _ => "stiffness from load differences",
    };
    format!(
        "Method of [Chen2021] (stiffness in closed form, then geometry by its equation 45), {form}, {stage} ({})",
        procedure.name()
    )
}

/// Returns table 2: nominal value, identified value and change of each joint's geometry. Brackets
/// mark values that the data determine only in combination with others.
pub(super) fn table_2(procedure: &Procedure) -> Table {
    let show = |column: usize, value: f64| {
        if column.is_multiple_of(2) { number(value.to_degrees(), 3) } else { mm(value, 2) }
    };
    let marked = |entry: &PaperTableEntry, text: String| match entry.seen {
        Some(seen) if seen < MIN_UNMARKED_SHARE => format!("({text})"),
        _ => text,
    };
    let row = |(joint, entries): &(usize, [PaperTableEntry; 5])| {
        let fields = || entries.iter().enumerate();
        let nominal = fields().map(|(column, entry)| show(column, entry.nominal));
        let identified =
            fields().map(|(column, entry)| marked(entry, show(column, entry.identified)));
        let change = fields().map(|(column, entry)| {
            let text = show(column, entry.identified - entry.nominal);
            or_dash(entry.seen, |_| marked(entry, text))
        });
        std::iter::once(joint.to_string()).chain(nominal).chain(identified).chain(change).collect()
    };
    let rows = procedure.geometry.iter().map(row).collect();
    let header =
        [&["joint"], &FIELDS[..], &["→ α °"], &FIELDS[1..], &["Δ α °"], &FIELDS[1..]].concat();
    Table::new(&header, rows, &[])
        .noted(&["( ): determined by these data only in combination with others, or hardly; –: not identified, or fixed"])
}

/// Returns table 3: errors of the held-out poses before identification, with elasticity and with
/// elasticity ignored, and their reductions. For the paper's arm, the published errors are added.
pub(super) fn table_3(comparison: &Comparison, procedure: &Procedure) -> Table {
    let before = ErrorSummary::of(&comparison.before.errors);
    let (after, ignoring) =
        (ErrorSummary::of(&procedure.after), procedure.ignoring.as_deref().map(ErrorSummary::of));
    let elastic = ignoring.is_some();
    let mut header = vec!["held out, mm", "axis", "before"];
    header.extend(if elastic {
        ["with elasticity", "reduction, %"]
    } else {
        ["identified", "reduction, %"]
    });
    header.extend(elastic.then_some(["ignoring it", "reduction, %"]).into_iter().flatten());
    let beside = comparison.is_papers_arm && elastic;
    let published =
        ["paper: before", "with elasticity", "reduction, %", "ignoring it", "reduction, %"];
    header.extend(beside.then_some(published).into_iter().flatten());
    let mut rows = Vec::new();
    for (kind, of, printed) in STATISTICS {
        for (axis, name) in ["x", "y", "z", "norm"].into_iter().enumerate() {
            let value = |summary: &ErrorSummary| along(of(summary), axis) * 1e3;
            let mut row =
                vec![if axis == 0 { kind.to_owned() } else { String::new() }, name.to_owned()];
            row.extend(with_reductions(
                value(&before),
                [Some(value(&after)), ignoring.as_ref().map(value)],
            ));
            if beside {
                let [before, with, without] = [&BEFORE, &WITH_ELASTICITY, &WITHOUT_ELASTICITY]
                    .map(|errors| printed(errors)[axis]);
                row.extend(with_reductions(before, [Some(with), Some(without)]));
            }
            rows.push(row);
        }
    }
    let fitted = registered_parts(&comparison.rigid).filter(|_| comparison.before.registered);
    let placement = match fitted {
        Some(parts) => format!("{parts} fitted first, since the problem leaves this open"),
        None => "base and tool as declared".to_owned(),
    };
    let elasticity = if elastic { " without elasticity" } else { "" };
    let before = format!("before: nominal arm{elasticity}, {placement}");
    let mut notes = vec![before.as_str()];
    notes.extend(beside.then_some(
        "paper: published in [Chen2021, table 3], measured on another specimen, under other loads",
    ));
    Table::new(&header, rows, &[0, 1]).noted(&notes)
}

/// Statistic of the errors in table 3: its name, and functions that return the computed values
/// \[m\] and the published values \[mm\] by axis.
type Statistic = (&'static str, fn(&ErrorSummary) -> &AxisValues, fn(&Published) -> [f64; 4]);
/// Statistics of the errors in table 3.
const STATISTICS: [Statistic; 2] = [
    ("max", |errors| &errors.max, |errors| errors.max),
    ("mean", |errors| &errors.mean, |errors| errors.mean),
];

/// Returns the value along an axis (0 to 2 for x, y, z), or of the norm (3).
fn along(values: &AxisValues, axis: usize) -> f64 {
    [values.x, values.y, values.z, values.norm][axis]
}

/// Formats an error before identification \[mm\], and each error `after` it with its reduction in
/// percent.
fn with_reductions(before: f64, after: [Option<f64>; 2]) -> Vec<String> {
    let pair = |after: f64| [number(after, 4), number(100.0 * (1.0 - after / before), 2)];
    std::iter::once(number(before, 4)).chain(after.into_iter().flatten().flat_map(pair)).collect()
}
