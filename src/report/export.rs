//! Text of the command `export`: moved origins, errors, and the parts of the model that the
//! exported file cannot represent.

use std::fmt::Write as _;

use super::document::{Block, Table};
use super::render::text;
use crate::fit::{ErrorSummary, Estimate, Identification, SavedEstimate, rows_of_kind};
use crate::model::Model;
use crate::model::parameter::{Parameter, ParameterSite};
use crate::quantity::format::{counted, mm, number};
use crate::results::{ExportResult, ExportedErrors, Origin, Summary};

/// Ratio of the mean error of one geometry to that of another, above which the other one is clearly
/// better.
const MAX_EQUAL_RATIO: f64 = 1.1;

/// Options that export another rigid geometry than the identified one: that nearest to the whole
/// model, and that fitted alone.
const GEOMETRY_OPTIONS: [&str; 2] = ["--best-rigid", "--fitted-alone"];

/// Facts about an export that its JSON result does not contain.
#[derive(Debug, Default)]
pub struct ExportRemarks {
    /// Differences between the whole model and the exported geometry, and between the whole model
    /// and the identified geometry, in poses of the workspace; `None` unless `--best-rigid` was
    /// given.
    pub workspace: Option<[ErrorSummary; 2]>,
    /// Largest payload in these poses \[kg\], the one that the problem declares.
    pub payload: f64,
    /// Values of base and tool of a geometry that was fitted alone, as texts; `None` unless
    /// `--fitted-alone` was given.
    pub set_up: Option<Vec<String>>,
    /// Values of base and tool of the estimate, as texts, for files that do not hold them.
    pub found: Vec<String>,
    /// Lines of an exported table, its header first; empty for other files.
    pub table: Vec<Vec<String>>,
    /// Notes below that table.
    pub notes: Vec<String>,
}

impl ExportRemarks {
    /// Collects the remarks on a geometry, from its errors in a workspace and the fit of a geometry
    /// alone.
    pub fn new(
        (workspace, payload): (Option<[ErrorSummary; 2]>, f64),
        fitted_alone: Option<&Identification>,
    ) -> Self {
        Self { workspace, payload, set_up: fitted_alone.map(set_up_values), ..Self::default() }
    }
}

/// Returns the option that would export a clearly better geometry than the exported one, the best
/// if there are two; `None` if there is none.
pub fn better_geometry(result: &ExportResult) -> Option<&'static str> {
    let errors = result.errors()?;
    let alternatives = [&errors.best_rigid, &errors.fitted_alone].into_iter().zip(GEOMETRY_OPTIONS);
    let compared =
        alternatives.filter_map(|(summary, option)| Some((mean(summary.as_ref()?), option)));
    let (least, option) = compared.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (mean(&errors.rigid) > MAX_EQUAL_RATIO * least).then_some(option)
}

/// Returns a warning if the exported geometry misses the rows farther than the nominal arm.
pub fn worse_than_nominal(result: &ExportResult) -> Option<String> {
    let errors = result.errors()?;
    let (rigid, nominal) = (&errors.rigid, errors.nominal.as_ref()?);
    (mean(rigid) > mean(nominal)).then(|| {
        let unit = rigid.norms().1;
        format!(
            "the exported geometry alone, without the effects that the file cannot hold, is worse than \
             the nominal arm: it misses these rows by {} {unit}, the nominal arm by {} {unit}",
            number(mean(rigid), 4),
            number(mean(nominal), 4)
        )
    })
}

/// Returns false if the exported geometry misses the rows clearly farther than the whole model.
pub fn holds_whole_model(result: &ExportResult) -> bool {
    result
        .errors()
        .is_none_or(|errors| mean(&errors.rigid) <= MAX_EQUAL_RATIO * mean(&errors.whole))
}

/// States that the rotation β of the last `joint` was not fitted, because the URDF has no origin
/// behind it.
pub fn kept_at_end(joint: &str) -> String {
    format!(
        "a tilt behind {joint} (its β), which keeps its identified value: the tip hangs on this moving joint, so that no origin \
         behind it can hold a tilt"
    )
}

/// Returns the values of base and tool at the deviations `x` of all parameters, one text for each;
/// those that the rows leave open in `estimates` have none.
pub fn set_up_at(model: &Model, x: &[f64], estimates: &SavedEstimate) -> Vec<String> {
    let is_set_up = |parameter: &Parameter| {
        matches!(parameter.site, ParameterSite::Base { .. } | ParameterSite::Target { .. })
    };
    let line = |(parameter, x): (&Parameter, &f64)| {
        if !estimates.undetermined(std::slice::from_ref(&parameter.name)).is_empty() {
            return format!("{} = open: the rows do not determine it", parameter.name);
        }
        let unit = parameter.unit().display(parameter.nominal);
        let value = number(parameter.value(*x) * unit.factor, 4);
        format!("{} = {value} {}", parameter.name, unit.symbol)
    };
    let all = model.parameters.iter().zip(x);
    all.filter(|(parameter, _)| is_set_up(parameter)).map(line).collect()
}

/// Returns the values of base and tool of a fit, one text for each parameter.
fn set_up_values(found: &Identification) -> Vec<String> {
    let is_set_up = |estimate: &&Estimate| {
        ["base", "tool", "target"].iter().any(|owner| estimate.name.starts_with(owner))
    };
    let line = |estimate: &Estimate| {
        let unit = estimate.unit.display(estimate.nominal);
        format!(
            "{} = {} {}",
            estimate.name,
            number(estimate.estimate * unit.factor, 4),
            unit.symbol
        )
    };
    found.estimates.iter().filter(is_set_up).map(line).collect()
}

/// Words before the values of base and tool of a geometry that was fitted alone.
const SET_UP_WORDS: &str = "Base and tool of this geometry, which replace those of the estimate";
/// Words before those of the estimate.
const FOUND_WORDS: &str = "As estimated, beside the table: base in the measuring frame, and measured \
                           point (a controller's TCP) in the frame of the tool";

/// Returns a comment for the end of an exported file with the values of base and tool that belong
/// to a geometry fitted alone; empty for other geometries. The file is XML if `is_xml`, else YAML.
pub fn set_up_comment(remarks: &ExportRemarks, is_xml: bool) -> String {
    let (words, values) = set_up_lines(remarks);
    if values.is_empty() {
        return String::new();
    }
    if is_xml {
        // Two hyphens are not allowed in a comment.
        let values = values.join("; ").replace('-', "\u{2212}");
        return format!("<!-- {words}: {values} -->\n");
    }
    let lines: String = values.iter().map(|value| ["#   ", value, "\n"].concat()).collect();
    format!("# {words}:\n{lines}")
}

/// Returns the values of base and tool that belong to the file, and the words before them.
fn set_up_lines(remarks: &ExportRemarks) -> (&'static str, &[String]) {
    match &remarks.set_up {
        Some(values) => (SET_UP_WORDS, values),
        None => (FOUND_WORDS, &remarks.found),
    }
}

/// Returns the mean length of the errors, in the unit of the summary.
fn mean(summary: &Summary) -> f64 {
    summary.norms().0[0]
}

/// Returns the result as text: the verdict on the exported geometry first.
pub fn export_text(result: &ExportResult, remarks: &ExportRemarks) -> String {
    let mut blocks = Vec::new();
    if let Some(errors) = result.errors() {
        blocks.extend(comparison_blocks(errors, better_geometry(result), remarks));
    }
    blocks.extend(remarks.workspace.as_ref().map(|[exported, identified]| {
        let [mean, max] = [exported.mean.norm, exported.max.norm].map(|of| mm(of, 4));
        let [other_mean, other_max] =
            [identified.mean.norm, identified.max.norm].map(|of| mm(of, 4));
        Block::Text(format!(
            "In random poses within the joint limits (and --workspace-mm, if given), {}, the whole \
             model differs from the exported geometry by {mean} mm on average ({max} mm at most), from \
             the identified geometry by {other_mean} mm ({other_max} mm at most).",
            if remarks.payload > 0.0 {
                format!("with payloads up to {} kg", number(remarks.payload, 2))
            } else {
                "without payload".to_owned()
            }
        ))
    }));
    if let Some((_, rows)) = remarks.table.split_first() {
        let header = ["joint", "theta, °", "d, mm", "a, mm", "alpha, °", "beta, °"];
        let columns = rows.first().map_or(0, Vec::len).min(header.len());
        let header = header.get(..columns).unwrap_or_default();
        let notes = remarks.notes.clone();
        blocks.push(Block::Table(Table { notes, ..Table::new(header, rows.to_vec(), &[0]) }));
    }
    if let Some(origins) = &result.origins {
        let row = |origin: &Origin| {
            vec![origin.joint.clone(), number(origin.moved_mm, 4), number(origin.turned_deg, 5)]
        };
        let changed =
            origins.iter().filter(|of| of.moved_mm != 0.0 || of.turned_deg != 0.0).count();
        let change = if changed == 1 { "changes" } else { "change" };
        blocks.push(Block::lines(format!(
            "{} {change}, and all others stay:",
            counted(changed, "joint origin")
        )));
        let header = ["origin of", "moved, mm", "turned, °"];
        blocks.push(Block::Table(Table::new(&header, origins.iter().map(row).collect(), &[0])));
    }
    if !result.not_held.is_empty() {
        let words = "Parts of the model that the file cannot hold".to_owned();
        blocks.push(Block::Lines(words, result.not_held.clone()));
    }
    let (words, values) = set_up_lines(remarks);
    if !values.is_empty() {
        blocks.push(Block::Lines(words.to_owned(), values.to_vec()));
    }
    blocks.extend(result.file.iter().map(|file| Block::lines(format!("Written to {file}"))));
    text(&blocks)
}

/// Compares the held-out or fitted errors of the exported geometry with those of the whole model and
/// of the geometries that could be exported instead, the best first. `better` is the option that
/// exports a clearly better geometry.
fn comparison_blocks<'a>(
    errors: &ExportedErrors,
    better: Option<&'static str>,
    remarks: &ExportRemarks,
) -> Vec<Block<'a>> {
    let ExportedErrors { are_held_out, whole, rigid, identified, best_rigid, fitted_alone, .. } =
        errors;
    let judged = if *are_held_out { "held-out" } else { "fitted" };
    let unit = rigid.norms().1;
    let size = |summary: &Summary| format!("{} {unit}", number(mean(summary), 4));
    let rows = rows_of_kind(whole.kind.unwrap_or("position"));
    let exported = match identified {
        None => "identified geometry, exported",
        Some(_) if remarks.set_up.is_some() => {
            "geometry fitted alone, without effects and elasticity, exported"
        }
        Some(_) => "geometry nearest to the whole model (--best-rigid), exported",
    };
    let nearest = "geometry nearest to the whole model (--best-rigid)";
    let alone = "geometry fitted alone (--fitted-alone)";
    let mut geometries: Vec<(&str, &Summary)> = vec![(exported, rigid)];
    geometries.extend(identified.as_ref().map(|errors| ("identified geometry", errors)));
    geometries.extend(best_rigid.as_ref().map(|errors| (nearest, errors)));
    geometries.extend(fitted_alone.as_ref().map(|errors| (alone, errors)));
    geometries.sort_by(|(_, a), (_, b)| mean(a).total_cmp(&mean(b)));
    let least = geometries.first().map_or(0.0, |(_, summary)| mean(summary));
    let is_worse = mean(rigid) > MAX_EQUAL_RATIO * least;
    let [alone_size, whole_size] = [rigid, whole].map(size);
    let mut verdict = if alone_size == whole_size {
        format!(
            "The exported geometry alone misses {} {judged} {rows} by {alone_size} on average, as \
             the whole model does.",
            whole.n
        )
    } else {
        format!(
            "The exported geometry alone misses {} {judged} {rows} by {alone_size} on average, the \
             whole model by {whole_size}.",
            whole.n
        )
    };
    let better_summary = match better {
        Some(option) if option == GEOMETRY_OPTIONS[0] => best_rigid.as_ref(),
        Some(_) => fitted_alone.as_ref(),
        None => None,
    };
    if let Some((option, summary)) = better.zip(better_summary) {
        let _ = write!(
            verdict,
            " Not the best that a rigid controller can have: with {option} it would be {}.",
            size(summary)
        );
    } else if is_worse && let Some((name, best)) = geometries.first() {
        let _ = write!(verdict, " The best of them, {name}, would have {}.", size(best));
    } else if geometries.len() > 1 {
        verdict += " No other geometry alone is clearly better.";
    }
    let nearest_summary = best_rigid.as_ref().or_else(|| remarks.workspace.and(Some(rigid)));
    let is_surpassed =
        |(nearest, alone): (&Summary, &Summary)| mean(nearest) > MAX_EQUAL_RATIO * mean(alone);
    if remarks.workspace.is_some()
        && nearest_summary.zip(fitted_alone.as_ref()).is_some_and(is_surpassed)
    {
        verdict += " --best-rigid is worse here than a geometry fitted alone, because it approximates the whole model over the \
                    whole range of the joints (or --workspace-mm) with base and tool of the whole model; a fit alone adapts base and \
                    tool as well, to the measured poses.";
    }
    let row = |&(name, summary): &(&str, &Summary)| {
        let [mean, rms, max] = summary.norms().0.map(|value| number(value, 4));
        vec![name.to_owned(), mean, rms, max]
    };
    let listed = [("whole model", whole)].into_iter().chain(geometries);
    let heading = if *are_held_out { "held-out error" } else { "error of fitted rows" };
    let rows = listed.map(|entry| row(&entry)).collect();
    vec![
        Block::Text(verdict),
        Block::Table(Table::new(
            &[&format!("{heading}, {unit}"), "mean", "rms", "max"],
            rows,
            &[0],
        )),
    ]
}
