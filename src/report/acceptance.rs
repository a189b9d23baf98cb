//! Record of `accept`, to be signed: accuracy before and after, conditions and inputs.

use std::path::PathBuf;

use super::document::{Block, Headline, Table};
use super::errors::rows_in;
use super::figures::range;
use super::identify::BEFORE;
use super::quantity::{about_three_digits, counted, mm, number};
use super::render::{report, text};
use super::table;
use crate::fit::{Acceptance, AcceptancePose, Accuracy, Identification};
use crate::measurement::Measurements;
use crate::problem::{HeldOut, Problem};
use crate::results::{AcceptanceResult, Condition, Input};

/// Cycles in each pose that ISO 9283 requires.
const CYCLES: usize = 30;

/// Scope of the figures.
const SCOPE: &str = "These are errors of predicted positions. The accuracy that a controller reaches with corrected commands is not judged.";

/// Inputs of a record, and facts that no file holds.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct AcceptanceRecord {
    /// Each input file with its SHA-256, `None` if it cannot be read again.
    pub inputs: Vec<(PathBuf, Option<String>)>,
    /// Commit of the repository that holds the problem.
    pub commit: Option<String>,
    /// Description of the instrument.
    pub instrument: Option<String>,
}

fn repeated(judged: &Acceptance) -> impl Iterator<Item = &AcceptancePose> {
    judged.poses.iter().filter(|pose| pose.repeatability.is_some())
}

fn repeatability(judged: &Acceptance) -> Option<f64> {
    repeated(judged).filter_map(|pose| pose.repeatability).max_by(f64::total_cmp)
}

/// Describes how the held-out poses were chosen.
fn protocol(problem: &Problem) -> String {
    let chosen = match &problem.data.held_out {
        Some(HeldOut::Fraction { fraction, seed }) => {
            format!(
                "a random part of {} % of the configurations (seed {seed})",
                number(100.0 * fraction, 1)
            )
        }
        Some(HeldOut::Session(name)) => {
            format!("every row of session {name}, to which its base and tool alone were fitted")
        }
        Some(HeldOut::Column(name)) => format!("rows that the column {name} marks as validation"),
        _ => "rows that the column split marks as validation".to_owned(),
    };
    format!("held out: {chosen}; they took part in no fit of the arm and in no choice")
}

/// Returns the range of each quantity over the held-out poses.
fn conditions(problem: &Problem, rows: &Measurements, judged: &Acceptance) -> Vec<Condition> {
    let rows_judged = || judged.poses.iter().flat_map(|pose| pose.rows.iter().copied());
    let condition = |of: &str, unit: &str, value: &dyn Fn(usize) -> f64| Condition {
        of: of.to_owned(),
        unit: unit.to_owned(),
        range: range(rows_judged().map(value)),
    };
    let joints = table::commands(problem).into_iter().map(|joint| {
        condition(&joint.name(), &joint.symbol(), &|row| {
            rows.configuration(row)[joint.joint] * joint.factor()
        })
    });
    let places = ["x", "y", "z"].into_iter().enumerate();
    let places =
        places.map(|(axis, name)| condition(name, "mm", &|row| rows.positions[row][axis] * 1e3));
    let columns = [
        ("temperature", "°C", &rows.temperature),
        ("payload", "kg", &rows.payload),
        ("hoist", "N", &rows.hoist),
    ];
    let measured = columns.into_iter().filter_map(|(name, unit, values)| {
        values.as_ref().map(|values| condition(name, unit, &|row| values[row]))
    });
    joints.chain(places).chain(measured).collect()
}

/// Collects the record of an acceptance.
pub fn acceptance_result(
    problem: &Problem,
    rows: &Measurements,
    found: &Identification,
    judged: &Acceptance,
    record: &AcceptanceRecord,
) -> AcceptanceResult {
    let input = |(file, sha256): &(PathBuf, Option<String>)| Input {
        file: file.display().to_string(),
        sha256: sha256.clone(),
    };
    AcceptanceResult {
        problem: problem.name.clone(),
        flexcal: env!("CARGO_PKG_VERSION"),
        commit: record.commit.clone(),
        arm_digest: problem.digest(),
        inputs: record.inputs.iter().map(input).collect(),
        instrument: record.instrument.clone(),
        position_sigma_mm: problem.data.position_sigma.map(|sigma| sigma * 1e3),
        protocol: protocol(problem),
        strategy: found.strategy.as_str(),
        solver: found.solver.as_str(),
        trusted: found.is_trusted(),
        conditions: conditions(problem, rows, judged),
        identification_rows: rows_in(found, |errors| errors.identification),
        held_out_rows: found.fitted.held_out.n,
        poses: judged.poses.len(),
        before: (&judged.before).into(),
        after: (&judged.after).into(),
        repeated_poses: repeated(judged).count(),
        repeatability_max_mm: repeatability(judged).map(|most| most * 1e3),
    }
}

/// Returns the accuracy in brief, ending in a line break.
pub fn acceptance_text(problem: &Problem, judged: &Acceptance) -> String {
    let poses = counted(judged.poses.len(), "held-out pose");
    let mut blocks =
        vec![Block::lines(format!("{}\n{poses}; {}", problem.title, protocol(problem)))];
    blocks.extend(judgement(judged));
    text(&blocks)
}

/// Returns the page to sign.
pub fn acceptance_page(
    problem: &Problem,
    rows: &Measurements,
    found: &Identification,
    judged: &Acceptance,
    record: &AcceptanceRecord,
) -> String {
    let head = Headline {
        unit: "mm",
        states: vec![
            (BEFORE, about_three_digits(judged.before.mean.value * 1e3)),
            ("as identified", about_three_digits(judged.after.mean.value * 1e3)),
        ],
        of: counted(judged.poses.len(), "held-out pose"),
        facts: Vec::new(),
    };
    let trust = if found.is_trusted() {
        "The fit is trusted."
    } else {
        "Warning: the fit is not to be trusted."
    };
    let sigma = problem.data.position_sigma.map_or("not declared".to_owned(), |sigma| {
        format!("{} mm per coordinate, 1 σ", mm(sigma, 4))
    });
    let instrument = record.instrument.as_deref().unwrap_or("not named");
    let conditions = conditions(problem, rows, judged).into_iter().map(|condition| {
        let shown = [condition.range.0, condition.range.1].map(|value| number(value, 1));
        [vec![condition.of], shown.to_vec(), vec![condition.unit]].concat()
    });
    let inputs = record.inputs.iter().map(|(file, digest)| {
        vec![
            file.display().to_string(),
            digest.clone().unwrap_or_else(|| "not a file that can be read again".to_owned()),
        ]
    });
    let mut blocks = vec![Block::Headline(head)];
    blocks.extend(judgement(judged));
    blocks.extend([
        Block::heading("How it was measured"),
        Block::Text(format!("Instrument: {instrument}; its noise: {sigma}.")),
        Block::Text(format!(
            "Poses {}. Rows that were fitted: {}. {trust}",
            protocol(problem),
            rows_in(found, |errors| errors.identification)
        )),
        Block::Table(Table::new(
            &["held-out poses", "from", "to", "unit"],
            conditions.collect(),
            &[0, 3],
        )),
        Block::heading("Arm and inputs"),
        Block::Text(format!(
            "Arm {}; strategy {}, solver {}; digest of the declared arm {}.",
            problem.name,
            found.strategy.as_str(),
            found.solver.as_str(),
            problem.digest()
        )),
    ]);
    blocks.extend(record.commit.as_ref().map(|commit| Block::Text(format!("HEAD of the repository around the problem: {commit}. Only the digests show whether files differ from it."))));
    blocks.extend([
        Block::Table(Table::new(&["input", "SHA-256"], inputs.collect(), &[0, 1])),
        Block::heading("Accepted"),
        Block::Blanks(vec!["arm, serial number", "place, date", "measured by", "accepted by"]),
    ]);
    report(problem, "acceptance", &blocks).html
}

/// Returns AP before and after, the scope of the figures, and the repeatability.
fn judgement<'a>(judged: &Acceptance) -> [Block<'a>; 3] {
    [Block::Table(accuracy(judged)), Block::Text(SCOPE.to_owned()), Block::Text(repeats(judged))]
}

/// Returns the table of AP before and after.
fn accuracy(judged: &Acceptance) -> Table {
    let row = |name: &str, of: &Accuracy| {
        let values =
            [of.mean.value, of.mean.low, of.mean.high, of.rms, of.max].map(|value| mm(value, 4));
        [vec![name.to_owned()], values.to_vec()].concat()
    };
    let header = ["pose accuracy AP, mm", "mean", "95 % from", "to", "rms", "max"];
    let rows = vec![
        row("nominal arm, base and tool fitted", &judged.before),
        row("as identified", &judged.after),
    ];
    let notes = "AP: distance from the predicted position to the barycentre of those measured in the same pose, after ISO 9283; \
                 the interval is of the mean, by bootstrap over poses";
    Table::new(&header, rows, &[0]).noted(&[notes])
}

/// States the repeatability of repeated poses.
fn repeats(judged: &Acceptance) -> String {
    match repeatability(judged) {
        Some(most) => format!(
            "Pose repeatability RP (l̄ + 3 S of the distances to the barycentre): at most {} mm over {}. ISO 9283 requires {CYCLES} cycles \
             a pose.",
            mm(most, 4),
            match repeated(judged).count() {
                1 => "one pose measured three times or more".to_owned(),
                n => format!("{n} poses measured three times or more"),
            }
        ),
        None => format!(
            "No held-out pose was measured three times, so repeatability is not judged; ISO 9283 requires {CYCLES} cycles a pose."
        ),
    }
}
