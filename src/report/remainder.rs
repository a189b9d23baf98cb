//! Sentences about a remainder and about bounds of prediction errors.

use std::fmt::Write as _;

use super::document::{Block, Column, Table, code};
use super::errors::with_unit;
use super::figures;
use super::render::text_width;
use crate::fit::{ErrorSummary, FindingCode, Identification};
use crate::quantity::format::{counted, mm, number, percent_of, two_digits};
use crate::remainder::{
    BoundTest, Bounds, Carried, Compared, JointError, MIN_CONFIGURATIONS, Outcome,
};
use crate::results::PlotData;

/// States the result of the search for a remainder; `found` has the errors without a remainder.
pub fn remainder_text(found: &Identification, outcome: &Outcome) -> String {
    let before = number(found.fitted.held_out.mean.norm * 1e3, 4);
    let after = outcome.held_out.map(|errors| number(errors.mean.norm * 1e3, 4));
    if let Some(carried) = outcome.carried.filter(|_| !outcome.is_declared) {
        return carried_text(outcome, carried);
    }
    let Some(gain) = outcome.gain.filter(|_| !outcome.is_declared) else {
        return match after {
            Some(after) => format!(
                "Corrected by the remainder that the problem declares: mean error of held-out \
                 poses {before} mm without it, {after} mm with it."
            ),
            None => "No remainder: too few configurations to fit one.".to_owned(),
        };
    };
    let passes =
        gain.error.ratio() > gain.threshold() && gain.density.ratio() > gain.density_threshold();
    let predicts = if passes {
        "predicts left-out configurations better, but does not raise the likelihood enough"
    } else if gain.error.ratio() > 0.0 {
        "does not clearly predict left-out configurations better"
    } else {
        "predicts left-out configurations no better"
    };
    let [without, with] = [gain.without, gain.with].map(|error| number(error * 1e3, 4));
    match after {
        Some(_) => format!(
            "A remainder (smooth correction) at {} is kept: the mean error of left-out \
             configurations falls from {without} mm to {with} mm{held_out}.",
            counted(outcome.joints, "joint"),
            held_out = if found.fitted.is_left_out {
                String::new()
            } else {
                held_out_gain(&found.fitted.held_out, outcome.held_out.as_ref())
            },
        ),
        None => format!(
            "No remainder (smooth correction) is kept, because it {predicts}: mean error \
             {without} mm without it, {with} mm with it.",
        ),
    }
}

/// States the mean error of held-out poses without and with a remainder, and the largest one if it
/// grows.
fn held_out_gain(before: &ErrorSummary, after: Option<&ErrorSummary>) -> String {
    let Some(after) = after else { return String::new() };
    let shown = |length: f64| number(length * 1e3, 4);
    let [from, to] = [before, after].map(|of| shown(of.mean.norm));
    let ratio = after.mean.norm / before.mean.norm;
    let mut words = if ratio <= MAX_CLEAR_RATIO {
        format!(", that of held-out poses from {from} mm to {to} mm")
    } else if ratio <= MAX_CLEAR_RATIO.recip() {
        format!("; that of held-out poses hardly changes ({from} mm to {to} mm)")
    } else {
        format!("; but that of held-out poses rises from {from} mm to {to} mm")
    };
    if after.max.norm > before.max.norm {
        let [from, to] = [before, after].map(|of| shown(of.max.norm));
        let _ = write!(words, "; the largest rises from {from} mm to {to} mm");
    }
    words
}

/// States the held-out error with and without a remainder that is kept; `None` without one.
pub(super) fn corrected_sentence(
    after: &Identification,
    accuracy: &PredictionAccuracy,
) -> Option<String> {
    let (before, after) = (&after.fitted.held_out, accuracy.corrected.as_ref()?);
    let [with, without] = [after, before].map(|errors| with_unit(errors, errors.mean.norm));
    Some(if after.mean.norm > before.mean.norm {
        format!(
            "A remainder is kept, but with it the mean held-out error rises from {without} to {with}."
        )
    } else {
        format!(
            "A remainder is kept: with it the mean held-out error is {with} instead of {without}."
        )
    })
}

/// Returns the sentences on a remainder as a paragraph of a screen.
pub(crate) fn remainder_paragraph(found: &Identification, outcome: &Outcome) -> String {
    format!("\n{}\n", textwrap::fill(&remainder_text(found, outcome), text_width()))
}

/// States what was carried over from an earlier estimate, and which new rows conditioned it.
fn carried_text(outcome: &Outcome, carried: Carried) -> String {
    let Carried { widening, positions, conditioning } = carried;
    let why_kept = if positions == 0 {
        "no new row measures a position"
    } else {
        "the new positions could not be used, because some have no finite prediction"
    };
    let mut text = match outcome.gain {
        Some(gain) => {
            let [without, with] =
                [gain.without, gain.with].map(|error| number(error * 1e3, 4));
            let rows = if conditioning < positions {
                format!("rows ({conditioning} of {positions} positions)")
            } else {
                "rows that measure positions".to_owned()
            };
            format!(
                "The remainder (smooth correction) of the earlier estimate, at {}, was updated \
                 with the new {rows}, together with the parameters. If each new configuration is \
                 predicted from the earlier rows and the other new ones, the mean error is \
                 {without} mm without the remainder and {with} mm with it.",
                counted(outcome.joints, "joint"),
            )
        }
        None if outcome.joints > 0 => format!(
            "The remainder (smooth correction) of the earlier estimate, at {}, was kept \
             unchanged: {why_kept}.",
            counted(outcome.joints, "joint"),
        ),
        None if conditioning == 0 => format!(
            "The error bounds of the earlier estimate were kept: {why_kept}; it has no remainder."
        ),
        None => "The error bounds of the earlier estimate were updated with the new rows; it has no remainder."
            .to_owned(),
    };
    if widening > 1.0 {
        let _ = write!(
            text,
            " All error bounds were multiplied by {}, because the new rows err more than the \
             earlier ones.",
            number(widening, 2)
        );
    }
    text
}

/// Returns the blocks about the remainder and the uncertainty of predictions; empty if the
/// uncertainty was not estimated.
pub(super) fn uncertainty<'a>(found: &Identification, plots: &'a PlotData) -> Vec<Block<'a>> {
    let Some(uncertainty) = &plots.uncertainty else { return Vec::new() };
    let outcome = &uncertainty.outcome;
    let words = if outcome.gain.is_some() || outcome.is_declared || outcome.carried.is_some() {
        remainder_text(found, outcome)
    } else {
        format!(
            "Predictions are not corrected. {} fits a remainder (a smooth correction of each joint) if at least 20 configurations are \
             measured, and keeps it if it predicts left-out configurations better.",
            code("flexcal identify --remainder")
        )
    };
    let mut blocks = vec![Block::heading("Uncertainty of predictions"), Block::Text(words)];
    let motion = |k: usize| move |of: &JointError| mm(of.motions[k], 4);
    let columns = [
        Column::words("joint", |of: &JointError| format!("{}", of.joint + 1)),
        Column::number("own command, mm", motion(0)),
        Column::number("all commands, mm", motion(1)),
        Column::number("compliance, mm", motion(2)),
    ];
    if !uncertainty.joints.is_empty() {
        let note = "root mean square motion of the target by the errors of each joint: functions of \
                    its own command, functions of all inputs, and its additional compliance";
        blocks.push(Block::Table(Table::of(&uncertainty.joints, &columns).noted(&[note])));
    }
    blocks.push(Block::figures([
        figures::joint_errors(plots),
        if found.is_trusted() { figures::bounds_over_workspace(plots) } else { None },
    ]));
    blocks
}

/// Smallest share of the workspace far from all measured poses that the summaries state \[%\].
const MIN_SAID_FAR_PERCENT: f64 = 1.0;

/// Largest probability that chance alone leaves as few held-out configurations within their bounds,
/// at which the summaries state it.
const MAX_SAID_CHANCE: f64 = 0.05;

/// Name of the configurations that no fit uses.
pub(super) const HELD_OUT: &str = "held-out configurations";

/// States why the error bound of predictions is not known; `None` if the reason is not known or the
/// fit is not to be trusted.
pub(super) fn why_no_bound(found: &Identification) -> Option<String> {
    let reason = if !found.is_trusted() {
        return None;
    } else if found.prior.is_some() {
        "none is computed from the new rows of a fit with a prior, and none could be carried over"
            .to_owned()
    } else if found.fitted.identification.kind != "position" {
        "no positions are measured".to_owned()
    } else if found.poses < MIN_CONFIGURATIONS {
        format!("it needs {MIN_CONFIGURATIONS} different fitted poses")
    } else {
        return None;
    };
    Some(format!("No error bound of a prediction is stated: {reason}."))
}

/// Accuracy of predictions that the summaries of `identify` and `loop` state.
#[derive(Debug, Clone)]
pub struct PredictionAccuracy {
    /// Sentence on the mean error bound over the workspace; `None` if the bound is not known or the
    /// fit is not to be trusted.
    pub bound: Option<String>,
    /// Test of the bounds at held-out configurations, if more exceed them than chance explains.
    pub contradicted: Option<BoundTest>,
    /// Errors of held-out rows with the remainder; `None` if there is none, or no row is held out.
    pub corrected: Option<ErrorSummary>,
}

impl PredictionAccuracy {
    /// Takes the bounds and the remainder of a fit; `found` contains its errors without remainder.
    /// Returns `None` if the uncertainty of predictions was not estimated.
    pub fn new(found: &Identification, plots: &PlotData) -> Option<Self> {
        let uncertainty = plots.uncertainty.as_ref()?;
        let held_out = uncertainty.outcome.held_out;
        let with = if held_out.is_some() { " with the remainder" } else { "" };
        let bounds = &uncertainty.bounds;
        let mean = bounds.iter().map(|at| at.bound).sum::<f64>() / bounds.len() as f64;
        let percent = percent_of(uncertainty.level);
        let far = bounds.iter().filter(|at| at.is_extrapolated).count() as f64;
        let far = 100.0 * far / bounds.len() as f64;
        let far = if far < MIN_SAID_FAR_PERCENT {
            String::new()
        } else {
            format!(", of which {} % is far from all measured poses", number(far, 0))
        };
        let is_doubtful = |test: &&BoundTest| test.widened > 1.0 || test.chance() < MAX_SAID_CHANCE;
        let doubtful = uncertainty.test.as_ref().filter(is_doubtful);
        let mut kept = chance_of_bound(doubtful, HELD_OUT, false);
        let errors = held_out.as_ref().unwrap_or(&found.fitted.held_out);
        if kept.is_empty() && found.has(FindingCode::HeldOutOutliers) {
            let [rms, max] = [errors.rms.norm, errors.max.norm].map(|of| number(of * 1e3, 2));
            kept = match &uncertainty.test {
                Some(test) => format!(
                    " {} of {} {HELD_OUT} {} ({} by chance); the largest error is {max} mm.",
                    test.beyond(),
                    test.of,
                    exceed(test.beyond()),
                    number(test.expected_beyond(), 1)
                ),
                None => format!(" The held-out poses err by {rms} mm rms, {max} mm at most."),
            };
        }
        let contradicted = uncertainty.test.filter(BoundTest::is_contradicted);
        let bound = (mean.is_finite() && found.is_trusted()).then(|| {
            format!(
                "Error bound of a prediction{with} ({percent} %, measurement noise included): {} \
                 mm, mean over the measured joint ranges{far}.{kept}",
                two_digits(mean * 1e3, 4)
            )
        });
        Some(Self {
            bound,
            contradicted,
            corrected: held_out.filter(|_| !found.fitted.is_left_out),
        })
    }
}

/// Returns the words that `count` configurations exceed their bounds.
pub(super) fn exceed(count: usize) -> &'static str {
    if count == 1 { "exceeds its own bound" } else { "exceed their own bound" }
}

/// States how many configurations, which `noun` names, exceed their bounds if chance does not
/// explain their number; otherwise empty. The sentence begins with a space.
fn contradicted_bound(test: Option<&BoundTest>, noun: &str) -> String {
    let is_said = |test: &&BoundTest| test.is_contradicted() || test.widened > 1.0;
    let Some(test) = test.filter(is_said) else { return String::new() };
    let (beyond, of) = (test.beyond(), test.of);
    let expected = number(test.expected_beyond(), 1);
    let so = if test.widened > 1.0 {
        format!(
            "the bound stated is widened by the factor {} that these errors show, and may still not hold \
             for single poses",
            number(test.widened, 2)
        )
    } else {
        "predictions at such poses err more than the bound says".to_owned()
    };
    format!(
        " But {beyond} of {of} {noun} {}, and chance explains {expected}: {so}.",
        exceed(beyond)
    )
}

/// States how likely chance alone leaves so few configurations within their bounds, if these are
/// fewer than expected; otherwise empty. `noun` names the configurations. The sentence begins with
/// a space. `is_said` is true if the text before it says how many lie within their bounds.
pub(super) fn chance_of_bound(test: Option<&BoundTest>, noun: &str, is_said: bool) -> String {
    let contradicted = contradicted_bound(test, noun);
    if !contradicted.is_empty() {
        return contradicted;
    }
    match test.filter(|test| test.beyond() as f64 > test.expected_beyond()) {
        Some(test) => {
            let few = if is_said {
                " As few".to_owned()
            } else {
                format!(" {} of {} {noun} lie within their bounds; as few", test.within, test.of)
            };
            format!(
                "{few} or fewer do so by chance in {} % of cases. The bounds rest on {}.",
                two_digits(100.0 * test.chance(), 2),
                counted(test.learned_from, "fitted configuration")
            )
        }
        None => String::new(),
    }
}

/// Largest ratio of an error with a correction to that without it, at which the correction makes a
/// difference.
const MAX_CLEAR_RATIO: f64 = 0.95;
/// Largest error, relative to the expected error, at which measured positions are probably
/// predictions of the model itself. Tables round positions to 0.1 µm.
const MAX_COMPUTED_ERROR: f64 = 2e-3;

/// Returns true if the errors are so small that the positions of all rows must be predictions of
/// the model, not measurements.
fn are_predicted(bounds: &Bounds, errors: &[(usize, f64)]) -> bool {
    let largest = errors.iter().map(|(_, length)| *length).fold(0.0, f64::max);
    errors.iter().all(|(_, length)| length.is_finite())
        && largest <= MAX_COMPUTED_ERROR * bounds.expected()
}

/// States the expected error and its bound, both as root mean squares, for the poses within the
/// range of the fitted ones and for the others. `misses` are the position errors \[m\] of uncorrected
/// commands by pose, measurement noise left out; empty if no commands are corrected. With
/// `compared`, adds the share of rows within their bounds and what the test says.
pub(super) fn bound_sentence(
    bounds: &Bounds,
    misses: &[f64],
    compared: Option<Compared>,
) -> String {
    let compared = compared.filter(|compared| !compared.errors.is_empty());
    let (beyond, within): (Vec<usize>, Vec<usize>) =
        (0..bounds.poses.len()).partition(|&pose| bounds.poses[pose].is_extrapolated);
    let rms = |poses: &[usize], of: &dyn Fn(usize) -> f64| {
        let squares = poses.iter().map(|&pose| of(pose).powi(2));
        (squares.sum::<f64>() / poses.len() as f64).sqrt()
    };
    let expected = |poses: &[usize]| rms(poses, &|pose| bounds.expected_at(pose));
    let shown = |length: f64| number(length * 1e3, 3);
    let bound = |poses: &[usize]| shown(rms(poses, &|pose| bounds.bound(pose)));
    let main = if within.is_empty() { &beyond } else { &within };
    let level = percent_of(bounds.level);
    let of = if beyond.is_empty() || within.is_empty() {
        ""
    } else {
        " within the range of the fitted poses"
    };
    let mut words = if misses.is_empty() {
        format!("Expected error{of}: {} mm rms, measurement noise included.", shown(expected(main)))
    } else {
        let uncorrected = rms(main, &|pose| {
            bounds.expected_at(pose).hypot(misses.get(pose).copied().unwrap_or(0.0))
        });
        let hardly = if expected(main) > MAX_CLEAR_RATIO * uncorrected {
            " The correction hardly changes it."
        } else {
            ""
        };
        format!(
            "Expected error at the targets{of}, measurement noise included: {} mm rms with the \
             commands of the table, {} mm rms with the corrected ones.{hardly}",
            shown(uncorrected),
            shown(expected(main))
        )
    };
    let _ = write!(words, " The {level} % bounds: {} mm, rms over these poses.", bound(main));
    if let Some(chi2) = bounds.misfit {
        let _ = write!(
            words,
            " Structure remains: the fit misses its rows by more than the declared σ (reduced χ² {}), \
             and the bound does not hold for what the model lacks.",
            number(chi2, 2)
        );
    }
    if let Some(compared) = compared
        && are_predicted(bounds, compared.errors)
    {
        words += " The positions of these rows are predictions of the model, such as targets of commands.csv, so their errors verify \
                  nothing.";
    } else if let Some(compared) = compared {
        let share = bounds.coverage(compared.errors.iter().copied());
        let share = number(share * 100.0, 1);
        let _ = write!(words, " {share} % of these rows lie within their bounds.");
    }
    if !beyond.is_empty() {
        let poses = counted(beyond.len(), "pose");
        let lie = if beyond.len() == 1 { "lies" } else { "lie" };
        let _ = write!(words, " {poses} {lie} outside the range of the fitted poses");
        let _ = if within.is_empty() {
            write!(words, ", where errors may be larger.")
        } else {
            let (rms, bound) = (shown(expected(&beyond)), bound(&beyond));
            write!(words, ": {rms} mm rms there, bound {bound} mm.")
        };
    }
    let test = compared.and_then(|compared| compared.test);
    words + &chance_of_bound(test, "configurations that were not fitted", false)
}

/// States that rows contradict an estimate that was fitted to none of them: their error, the
/// expected one, and how many lie within their bounds; `None` if they do not. `lacks_loads` is true if
/// the table lacks a column of loads that the rows of the estimate had.
pub(super) fn contradiction(compared: Compared, lacks_loads: bool) -> Option<String> {
    let test = compared.test.filter(|test| test.is_contradicted())?;
    let squares = compared.errors.iter().map(|(_, length)| length * length);
    let rms = (squares.sum::<f64>() / compared.errors.len() as f64).sqrt();
    let are_outside = compared.bounds.poses.iter().all(|pose| pose.is_extrapolated);
    let before = if lacks_loads {
        "The table lacks loads, as the warning says; or this"
    } else if are_outside {
        "These rows lie outside the range of the fitted poses, where errors may be larger; or this"
    } else {
        "This"
    };
    Some(format!(
        "The rows contradict the estimate: {} mm rms, {} mm expected, {} of {} configurations \
         within their bounds. {before} arm has changed, it is another one, or the table is \
         misread (units, signs).",
        number(rms * 1e3, 3),
        number(compared.bounds.expected() * 1e3, 3),
        test.within,
        test.of
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_that_too_many_held_out_positions_exceed_are_said_to_be_too_small() {
        let words = |within| {
            let test = BoundTest { level: 0.95, within, of: 50, learned_from: 28, widened: 1.0 };
            contradicted_bound(Some(&test), HELD_OUT)
        };
        assert_eq!([50, 41].map(words), [""; 2]);
        let said = words(16);
        assert!(said.starts_with(" But 34 of 50 held-out configurations exceed"), "{said}");
    }
}
