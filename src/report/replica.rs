//! Text and report of a study of the misprints of \[Chen2021\].

use super::document::{Block, Headline, Table};
use super::figures;
use super::render::{Report, report, text};
use crate::fit::ErrorSummary;
use crate::paper::Misprint;
use crate::paper::published::{BEFORE, Published, WITH_ELASTICITY, WITHOUT_ELASTICITY};
use crate::quantity::format::{mm, number, or_dash};
use crate::study::{
    AlternativeModel, Case, HeldOutError, MisprintStudy, Replica, ReplicaResults, Spread,
};

/// Sources of the stiffness, in the order of the results of a replica.
const STIFFNESS_SOURCES: [&str; 4] =
    ["stiffness known", "as declared", "from positions", "from load differences"];

/// Returns the results of a study of the misprints as text, ending in a line break.
pub fn replica_text(study: &MisprintStudy, found: &ReplicaResults) -> String {
    let mut blocks = vec![Block::lines(format!("{}\n{}", study.title, describe_study(study)))];
    blocks.extend(conclusion(study, found).map(Block::Text));
    blocks.extend(tables(study, found));
    text(&blocks)
}

/// Returns the report of a study of the misprints.
pub fn replica_report(study: &MisprintStudy, found: &ReplicaResults) -> Report {
    let main = main_case(study, found);
    let error = |pick: fn(&Replica) -> HeldOutError| {
        let spread = Spread::of(main.iter().map(|replica| Some(pick(replica)?.mean.norm)));
        or_dash(spread, |spread| mm(spread.mean, 3))
    };
    let head = Headline {
        unit: "mm",
        states: vec![
            ("elasticity ignored", error(|replica| replica.rigid)),
            ("corrected formulas, stiffness known", error(|replica| replica.reading_error(0, 0))),
        ],
        of: "held-out poses".to_owned(),
        facts: vec![(
            "Everything fitted at once",
            format!("{} mm", error(|replica| Some(replica.joint))),
        )],
        is_doubtful: false,
    };
    let mut blocks = vec![Block::Headline(head), Block::Text(describe_study(study))];
    blocks.extend(conclusion(study, found).map(Block::Text));
    blocks.push(Block::Figures(vec![figures::misprints(study, found)]));
    blocks.extend(tables(study, found));
    report(&study.problem, "misprints", &blocks)
}

/// Describes the study: specimens, cases, poses, noise, and scale of the elasticity.
fn describe_study(study: &MisprintStudy) -> String {
    format!(
        "{} specimens of each of {} cases, measured by the virtual test rig: {} poses to identify, {} held out,\n\
         noise {} mm per axis; elasticity scaled so that the rigid fit errs by {} mm",
        study.specimens,
        study.cases.len(),
        study.identification,
        study.held_out,
        mm(study.truth.noise_sigma, 2),
        mm(study.rigid_leaves, 4),
    )
}

/// Compares the corrected procedure, each single misprint and the paper by their mean held-out
/// errors, stiffness known; `None` if the corrected procedure has none.
fn conclusion(study: &MisprintStudy, found: &ReplicaResults) -> Option<String> {
    let main = main_case(study, found);
    let mean = |index: usize| -> Option<f64> {
        let means = main.iter().map(|replica| Some(replica.reading_error(index, 0)?.mean.norm));
        Some(Spread::of(means)?.mean * 1e3)
    };
    let paper = WITH_ELASTICITY.mean[3];
    let distance = |of: &(f64, &str)| (of.0 - paper).abs();
    let single = found.readings.iter().enumerate().filter(|(_, named)| named.misprint.is_some());
    let nearest = single
        .filter_map(|(index, named)| Some((mean(index)?, named.name.as_str())))
        .min_by(|a, b| distance(a).total_cmp(&distance(b)));
    let nearest = nearest.map_or_else(String::new, |(error, name)| {
        format!(" Of single misprints {name} comes nearest to that: {} mm.", number(error, 3))
    });
    Some(format!(
        "Corrected, the procedure errs by {} mm on average at held-out poses (stiffness known); the \
         paper states {} mm.{nearest}",
        number(mean(0)?, 3),
        number(paper, 3)
    ))
}

/// Returns the specimens of the study's first case; empty if it has no case.
fn main_case<'a>(study: &MisprintStudy, found: &'a ReplicaResults) -> Vec<&'a Replica> {
    study.cases.first().map_or_else(Vec::new, |case| found.of_case(case).collect())
}

fn tables<'a>(study: &MisprintStudy, found: &ReplicaResults) -> Vec<Block<'a>> {
    vec![
        Block::heading("Procedures and readings: mean error of the held-out poses, mm"),
        Block::Table(readings_table(study, found)),
        Block::heading("For comparison"),
        Block::Table(comparison_table(study, found)),
        Block::heading("Ratio to the error of the rigid fit, stiffness known"),
        Block::Table(ratio_table(study, found)),
    ]
}

/// Formats mean ± standard deviation over specimens, with the number of converged fits if not all
/// converged; "diverges" for `None`.
fn format_spread(spread: Option<Spread>, show: impl Fn(f64) -> String) -> String {
    let Some(Spread { mean, deviation, count: (there, all) }) = spread else {
        return "diverges".to_owned();
    };
    let few = if there < all { format!(" ({there} of {all})") } else { String::new() };
    format!("{} ± {}{few}", show(mean), show(deviation))
}

/// Returns the table of mean held-out errors of each reading, by the source of the stiffness.
fn readings_table(study: &MisprintStudy, found: &ReplicaResults) -> Table {
    let main = main_case(study, found);
    let row = |(index, named): (usize, &crate::study::NamedReading)| {
        let size = Misprint::EACH
            .iter()
            .zip(&found.sizes)
            .find(|(misprint, _)| Some(**misprint) == named.misprint);
        let cell = |stage: usize| {
            let means =
                main.iter().map(|replica| Some(replica.reading_error(index, stage)?.mean.norm));
            format_spread(Spread::of(means), |value| mm(value, 3))
        };
        let head =
            [named.name.clone(), named.place.clone(), or_dash(size, |(_, size)| mm(*size, 3))];
        head.into_iter().chain((0..STIFFNESS_SOURCES.len()).map(cell)).collect()
    };
    let rows = found.readings.iter().enumerate().map(row).collect();
    let [known, declared, positions, differences] = STIFFNESS_SOURCES;
    let header = ["as printed", "where", "moves, mm", known, declared, positions, differences];
    Table::new(&header, rows, &[0, 1]).noted(&[
        "moves: largest change of the end point at the errors of the truth, on the arm as declared",
        "± standard deviation over specimens; links and joints share their flexibility as \
         declared; diverges: eq. 45 does not converge",
    ])
}

/// Returns the table of simulated and published held-out errors of some procedures.
fn comparison_table(study: &MisprintStudy, found: &ReplicaResults) -> Table {
    let main = main_case(study, found);
    let row = |name: &str, of: fn(&Replica) -> HeldOutError, published: Option<&Published>| {
        let of_kind = |kind: fn(&ErrorSummary) -> f64| {
            format_spread(
                Spread::of(main.iter().map(|replica| of(replica).as_ref().map(kind))),
                |value| mm(value, 3),
            )
        };
        let [mean, max] =
            [published.map(|table| table.mean[3]), published.map(|table| table.max[3])];
        let paper = [mean, max].map(|value| or_dash(value, |value| number(value, 3)));
        let simulated = [
            of_kind(|errors| errors.mean.norm),
            of_kind(|errors| errors.max.norm),
            of_kind(|errors| errors.mean.z),
        ];
        let z = or_dash(published, |table| number(table.mean[2], 3));
        let [mean, max] = paper;
        [vec![name.to_owned()], simulated.to_vec(), vec![mean, max, z]].concat()
    };
    let rows = vec![
        row("before: nominal arm, rigid", |replica| Some(replica.before), Some(&BEFORE)),
        row("elasticity ignored, eq. 45", |replica| replica.rigid, Some(&WITHOUT_ELASTICITY)),
        row("elasticity considered", |replica| replica.reading_error(0, 0), Some(&WITH_ELASTICITY)),
        row("geometry-only, this model", |replica| Some(replica.geometry_only), None),
        row("joint fit, this model", |replica| Some(replica.joint), None),
        row("joint fit, both loads", |replica| Some(replica.joint_twice), None),
    ];
    let header = ["held out, mm", "mean", "max", "mean |z|", "paper: mean", "max", "mean |z|"];
    Table::new(&header, rows, &[0]).noted(&[
        "elasticity considered: here misprints corrected and stiffness known; geometry-only: \
         stiffness as declared",
    ])
}

/// Returns the table of error ratios of each reading and alternative model to the rigid fit.
fn ratio_table(study: &MisprintStudy, found: &ReplicaResults) -> Table {
    let main = main_case(study, found);
    let row = |name: &str, summary: &str, error_of: &dyn Fn(&Replica) -> HeldOutError| {
        let ratio = |case: &Case| {
            let ratios = found.of_case(case).map(|replica| replica.ratio(error_of(replica)));
            format_spread(Spread::of(ratios), |value| number(value, 3))
        };
        let of_z = |replica: &&Replica| error_of(replica).map(|left| left.mean.z / left.mean.norm);
        let along = format_spread(Spread::of(main.iter().map(of_z)), |value| number(value, 2));
        let largest =
            Spread::of(main.iter().map(|replica| replica.largest_ratio(error_of(replica))));
        let cases: Vec<String> = study.cases.iter().map(ratio).collect();
        let largest = format_spread(largest, |value| number(value, 2));
        [vec![name.to_owned(), summary.to_owned()], cases, vec![along, largest]].concat()
    };
    let mut rows: Vec<Vec<String>> = found
        .readings
        .iter()
        .enumerate()
        .map(|(index, named)| {
            row(&named.name, &named.summary, &|replica| replica.reading_error(index, 0))
        })
        .collect();
    rows.extend(AlternativeModel::EACH.map(|rival| {
        row(rival.as_str(), rival.summary(), &|replica| replica.alternative_error(rival))
    }));
    let [with, without] = [&WITH_ELASTICITY, &WITHOUT_ELASTICITY];
    let paper =
        [with.mean[3] / without.mean[3], with.mean[2] / with.mean[3], with.max[3] / without.max[3]];
    let [ratio, along, largest] = paper;
    let mut last = vec!["the paper".to_owned(), "table 3".to_owned()];
    last.extend(study.cases.iter().map(|_| number(ratio, 3)));
    last.extend([number(along, 2), number(largest, 2)]);
    rows.push(last);
    let names: Vec<String> = study.cases.iter().map(Case::name).collect();
    let mut header = vec!["as printed, or assumed", ""];
    header.extend(names.iter().map(String::as_str));
    header.extend(["z/sum", "max/max"]);
    Table::new(&header, rows, &[0, 1]).noted(&[
        "links, one load: ratio of the mean errors; links: link to joint flexibility, relative to the declared ratio; one load: all \
         poses under one load",
        "z/sum: share of the error along z; max/max: ratio of the largest errors; both of the \
         first case",
    ])
}
