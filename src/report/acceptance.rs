//! Record of the command `accept`, to be signed: accuracy before and after, conditions and inputs.

use super::document::{Block, Headline, Table};
use super::errors::NOMINAL_ARM;
use super::remainder::{HELD_OUT, chance_of_bound};
use super::render::{report, text};
use crate::fit::{Severity, Verdict};
use crate::problem::Problem;
use crate::quantity::format::{about_three_digits, counted, number, percent_of};
use crate::results::{AcceptanceResult, PoseAccuracy, TestedTolerance};

/// Number of measurements (cycles) of each pose that ISO 9283 requires.
const ISO_CYCLES: usize = 30;

/// Sentence on the scope of the reported errors.
const SCOPE_NOTE: &str = "These are errors of predicted positions. The accuracy that a controller reaches with corrected commands is not judged.";

/// Returns a summary of the accuracy as text, ending in a line break.
pub fn acceptance_text(problem: &Problem, result: &AcceptanceResult) -> String {
    let poses = counted(result.poses, "held-out pose");
    let chosen = result.protocol.trim_start_matches("held out: ");
    let mut blocks = vec![Block::lines(format!("{}\n{poses}: {chosen}", problem.title))];
    blocks.extend(result.tolerance.as_ref().map(|test| Block::Text(tolerance_text(test))));
    blocks.extend(accuracy_blocks(result));
    text(&blocks)
}

/// Returns the page with the record to be signed.
pub fn acceptance_page(problem: &Problem, result: &AcceptanceResult) -> String {
    let head = Headline {
        unit: "mm",
        states: vec![
            (NOMINAL_ARM, about_three_digits(result.before.mean_mm)),
            ("as identified", about_three_digits(result.after.mean_mm)),
        ],
        of: counted(result.poses, "held-out pose"),
        facts: Vec::new(),
        is_doubtful: !result.trusted,
    };
    let reported = result.findings.iter().filter(|finding| finding.severity() != Severity::Note);
    let reported: Vec<String> = reported.map(ToString::to_string).collect();
    let trust = match (result.trusted, reported.len()) {
        (false, _) => "The fit is not to be trusted".to_owned(),
        (true, 0) => "No check of the fit reports an error or a warning".to_owned(),
        (true, count) => format!("The checks of the fit report {}", counted(count, "warning")),
    };
    let sigma = result.position_sigma_mm.map_or("not declared".to_owned(), |sigma| {
        format!("{} mm per coordinate, 1 σ", number(sigma, 4))
    });
    let instrument = result.instrument.as_deref().unwrap_or("not named");
    let conditions = result.conditions.iter().map(|condition| {
        let [from, to] = [condition.range.0, condition.range.1].map(|value| number(value, 1));
        vec![condition.of.clone(), from, to, condition.unit.clone()]
    });
    let inputs = result.inputs.iter().map(|input| {
        let digest = input.sha256.as_deref().unwrap_or("not a file that can be read again");
        vec![input.file.clone(), digest.to_owned()]
    });
    let conditions =
        Table::new(&["held-out poses", "from", "to", "unit"], conditions.collect(), &[0, 3]);
    let commit = result.commit.as_ref().map(|commit| {
        Block::Text(format!(
            "Git commit of the repository that tracks the problem: {commit}. Files may differ from that \
             commit; the digests below identify them."
        ))
    });
    let mut blocks: Vec<Block> = result.tolerance.iter().map(outcome).collect();
    blocks.push(Block::Headline(head));
    if !reported.is_empty() {
        blocks.push(Block::Lines(format!("{trust}:"), reported.clone()));
    }
    blocks.extend(result.tolerance.as_ref().map(|test| Block::Text(tolerance_text(test))));
    blocks.extend(accuracy_blocks(result));
    blocks.extend([
        Block::heading("How it was measured"),
        Block::Text(format!("Instrument: {instrument}; its noise: {sigma}.")),
        Block::Text(format!(
            "Poses {}. Rows that were fitted: {}.{}",
            result.protocol,
            result.identification_rows,
            if reported.is_empty() { format!(" {trust}.") } else { String::new() }
        )),
        Block::Table(conditions),
        Block::heading("Arm and inputs"),
        Block::Text(format!(
            "Arm {}; strategy {}, solver {}; digest of the declared arm {}.",
            result.problem, result.strategy, result.solver, result.arm_digest
        )),
    ]);
    blocks.extend(commit);
    blocks.extend([
        Block::Table(Table::new(&["input", "SHA-256"], inputs.collect(), &[0, 1])),
        Block::heading("Signatures"),
        Block::Blanks(vec!["arm, serial number", "place, date", "measured by", "signed by"]),
    ]);
    report(problem, "acceptance", &blocks).html
}

/// Returns the verdict on a tolerance as the head of the page.
fn outcome<'a>(test: &TestedTolerance) -> Block<'a> {
    let verdicts = [(Verdict::Pass, "Pass"), (Verdict::Fail, "Fail")];
    let word = verdicts.into_iter().find(|(verdict, _)| verdict.as_str() == test.verdict);
    let tolerance = number(test.tolerance_mm, 4);
    let of = format!("at most {tolerance} mm at {} of the poses", percent(test.share));
    let is_good = test.verdict == Verdict::Pass.as_str();
    Block::Outcome { word: word.map_or("Undecided", |(_, word)| word), of, is_good }
}

/// Formats a share in percent with up to two decimals.
fn percent(share: f64) -> String {
    format!("{} %", (share * 1e4).round() / 100.0)
}

/// States the verdict on a tolerance and the reasons for it.
pub fn tolerance_text(test: &TestedTolerance) -> String {
    let (share, risk) = (percent(test.share), percent(test.risk));
    let tolerance = format!("{} mm", number(test.tolerance_mm, 4));
    let [least, most] = test.share_within.map(percent);
    let beyond = match test.beyond {
        0 => format!("none of {} lies beyond", counted(test.poses, "pose")),
        1 => format!("1 of {} lies beyond", counted(test.poses, "pose")),
        n => format!("{n} of {} lie beyond", counted(test.poses, "pose")),
    };
    let verdict = test.verdict;
    if verdict == Verdict::Pass.as_str() {
        format!(
            "Pass: at least {share} of the poses err by no more than {tolerance}. The risk that this is \
             wrong is at most {risk}; {beyond}, so at least {least} are within the tolerance."
        )
    } else if verdict == Verdict::Fail.as_str() {
        format!(
            "Fail: fewer than {share} of the poses err by no more than {tolerance}. The risk that this is \
             wrong is at most {risk}; {beyond}, so at most {most} are within the tolerance."
        )
    } else if let Some(reason) = test.no_test {
        format!(
            "Undecided: {reason}, so the held-out poses do not test whether {share} of the poses err by no more than \
             {tolerance}; {beyond}."
        )
    } else {
        let needed = test.poses_to_pass.map_or_else(String::new, |needed| {
            let more = needed.saturating_sub(test.poses);
            let poses = counted(more, "more held-out pose");
            format!(" Measure {poses}; if all stay within, it passes.")
        });
        format!(
            "Undecided: the held-out poses are too few to say whether {share} of the poses err by no \
             more than {tolerance}; {beyond}, so {least} to {most} are within the tolerance, each \
             bound with a risk of {risk}.{needed}"
        )
    }
}

/// Returns the blocks of the record on accuracy AP before and after identification, on the poses,
/// the error bounds, and the repeatability.
fn accuracy_blocks<'a>(result: &AcceptanceResult) -> Vec<Block<'a>> {
    let row = |name: &str, of: &PoseAccuracy| {
        let [low, high] = of.interval_95_mm;
        let values = [of.mean_mm, low, high, of.rms_mm, of.max_mm].map(|value| number(value, 4));
        [vec![name.to_owned()], values.to_vec()].concat()
    };
    let header = ["pose accuracy AP, mm", "mean", "95 % from", "to", "rms", "max"];
    let after = if result.remainder { "identified and corrected" } else { "as identified" };
    let rows = vec![row(&result.nominal_arm, &result.before), row(after, &result.after)];
    let note = "AP: distance from the predicted position to the barycentre of those measured in \
                the same pose, after ISO 9283; the interval is of the mean, by bootstrap over poses";
    let table = Table::new(&header, rows, &[0]).noted(&[note]);
    let poses = match result.repeated_poses {
        1 => "one pose".to_owned(),
        n => format!("{n} poses"),
    };
    let repeats = match result.repeatability_max_mm {
        Some(most) => format!(
            "Pose repeatability RP (l̄ + 3 S of the distances to the barycentre): at most {} mm \
             over {poses} measured three times or more. ISO 9283 requires {ISO_CYCLES} cycles a pose.",
            number(most, 4),
        ),
        None => format!(
            "No held-out pose was measured three times, so repeatability is not judged; ISO 9283 \
             requires {ISO_CYCLES} cycles a pose."
        ),
    };
    let bound = result.bound.as_ref().map(|bound| {
        Block::Text(format!(
            "Each prediction has a bound that {} % of the errors should stay below ({} mm on average); \
             {:.0} of the {} held-out rows stay below theirs ({} %).{}",
            percent_of(bound.bounds.level),
            number(bound.bounds.mean_bound_mm, 4),
            bound.coverage * bound.rows as f64,
            bound.rows,
            number(bound.coverage * 100.0, 1),
            chance_of_bound(Some(&bound.test), HELD_OUT, bound.test.of == bound.rows),
        ))
    });
    let blocks = [Block::Table(table), Block::Text(SCOPE_NOTE.to_owned())];
    blocks.into_iter().chain(bound).chain([Block::Text(repeats)]).collect()
}
