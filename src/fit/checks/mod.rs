//! Checks of a fit: is its result trustworthy, and which input should be examined?
//!
//! Each check is a function of the fit; [`findings`] runs all of them. `docs/findings.md` lists the
//! codes of their findings.

pub(super) mod bounds;
mod changed_rows;
pub(super) mod checked_fit;
mod common_scale;
mod contradicted_entry;
mod convention;
pub(super) mod distance_zero;
mod doubted_columns;
mod doubted_rows;
pub(super) mod finding;
pub(super) mod fitted_rows;
mod followed_commands;
mod freed;
pub(super) mod held_fixtures;
pub(super) mod held_out;
mod held_parameters;
pub(super) mod lens;
mod limits;
pub(super) mod misfit;
mod misread;
pub(super) mod misreading;
mod mistaken_rows;
pub(super) mod nominal_error;
pub(super) mod open_directions;
mod open_scale;
pub(super) mod open_views;
mod orientation;
pub(super) mod outliers;
pub(super) mod parameter_limits;
pub(super) mod payload_place;
pub(super) mod point_spread;
mod pose_range;
pub(super) mod pose_sufficiency;
mod prediction;
pub(super) mod priors;
pub(super) mod required_columns;
pub(super) mod row_kind;
mod row_relation;
mod row_steps;
pub(super) mod set_aside;
mod table_digits;
mod turned_rows;
mod turned_target;
mod two_solutions;
pub(super) mod view_order;

use serde_json::Value;

use checked_fit::CheckedFit;
use finding::{CONSEQUENCES, Finding, FindingCode, MISTAKES, OF_MISFIT, Severity};
use misreading::first_of;

/// Check of a fit: a function that returns its finding, or one for each case.
enum Check {
    One(fn(&CheckedFit) -> Option<Finding>),
    Each(fn(&CheckedFit) -> Vec<Finding>),
}

use Check::{Each, One};

/// All checks, in the order in which their findings are listed. If a fit is not trusted, commands
/// print the first finding that is an error as the reason.
const CHECKS: &[Check] = &[
    One(|fit| fit.poses.finding.clone()),
    One(misread::read_as_meant),
    One(view_order::points_in_order),
    One(table_digits::positions_are_measured),
    Each(misfit::misfit),
    Each(misfit::size_of_arm),
    One(orientation::orientations_fit),
    One(doubted_columns::columns_hold_measurements),
    One(doubted_rows::rows_belong_together),
    One(changed_rows::rows_stay_alike),
    One(|fit| fit.not_converged.cloned()),
    One(two_solutions::one_solution),
    One(common_scale::scale_holds),
    One(parameter_limits::within_priors),
    One(parameter_limits::within_arm_size),
    One(held_out::not_all_copied),
    Each(held_out::held_out_reached),
    One(held_out::better_than_nominal),
    Each(priors::priors_hold),
    One(priors::noise_is_declared),
    One(priors::data_decide),
    One(pose_range::poses_spread),
    One(nominal_error::nominal_is_near),
    One(parameter_limits::gives_way_to_loads),
    One(table_digits::commands_have_digits),
    One(priors::sigma_is_not_overstated),
    One(prediction::prediction_holds),
    One(prediction::not_worse_than_nominal),
    One(prediction::prediction_is_sure),
    Each(bounds::bounds_are_seen),
    One(limits::limits_hold),
    One(held_parameters::held_geometry_is_right),
    One(held_out::not_repeated),
    One(held_out::other_poses_held_out),
    One(held_out::without_outliers),
    One(|fit| fit.poses.held_out.clone()),
    One(set_aside::set_aside_by_chance),
    Each(fitted_rows::steady_points),
    One(fitted_rows::no_outliers),
    Each(priors::prior_widths),
    Each(open_directions::named_directions),
];

/// Codes of findings that name the cause of a misfit.
const CAUSES: [FindingCode; 5] = [
    FindingCode::ColumnDoubted,
    FindingCode::RowsDoubted,
    FindingCode::RowsChanged,
    FindingCode::LimitContradicted,
    FindingCode::CommandsRounded,
];

/// Largest ratio of the rms error without limits to that with another reading of the input, at
/// which both explain the misfit alike.
const MAX_EQUAL_ERRORS: f64 = 1.05;

/// Codes of findings on mistakes of which a change from a row on is only a consequence.
const OF_TABLE: [FindingCode; 4] = [
    FindingCode::Misread,
    FindingCode::ColumnDoubted,
    FindingCode::RowsDoubted,
    FindingCode::LimitContradicted,
];

/// Codes of findings that a strategy causes which leaves out the elasticity, or stops before all
/// parameters agree.
const OF_STRATEGY: [FindingCode; 6] = [
    FindingCode::NoiseBeyondDeclared,
    FindingCode::ResidualBeyondDeclared,
    FindingCode::HeldOutBeyondPrediction,
    FindingCode::HeldOutNotBetter,
    FindingCode::HeldOutOutliers,
    FindingCode::RowsSetAside,
];

/// Codes of findings that the fit is far off, with or without a known cause.
const FAR_OFF: [FindingCode; 2] =
    [FindingCode::MissesMeasurements, FindingCode::NoBetterThanNominal];

/// Remedy of findings that follow from a parameter far beyond its prior.
const BEYOND_PRIOR_FIRST: &str =
    "follow first the warning on the parameter that is far beyond its prior";

/// Codes of findings that the residual of the fitted rows is beyond the declared σ.
const BEYOND_NOISE: [FindingCode; 2] =
    [FindingCode::NoiseBeyondDeclared, FindingCode::ResidualBeyondDeclared];

/// Returns true if one of the findings has one of the codes.
fn has(findings: &[Finding], codes: &[FindingCode]) -> bool {
    findings.iter().any(|found| codes.contains(&found.code))
}

/// Returns true unless a finding states a cause that no fit shows.
fn is_shown(found: &Finding) -> bool {
    !found.value("after").is_some_and(Value::is_null)
}

/// Returns true if a finding has a remedy that is specific to its case.
fn names_remedy(found: &Finding) -> bool {
    found.remedy != found.code.entry().remedy
}

/// Runs every check on a fit.
pub(super) fn findings(fit: &CheckedFit) -> Vec<Finding> {
    let found = |check: &Check| match check {
        One(check) => check(fit).into_iter().collect(),
        Each(check) => check(fit),
    };
    let mut findings: Vec<Finding> = CHECKS.iter().flat_map(found).collect();
    state_limits_first(&mut findings);
    // A change of one place says more about rows than that they contradict the others.
    let is_of_place = |found: &Finding| {
        found.code == FindingCode::RowsChanged && found.word("place") != Some("arm")
    };
    let is_other =
        |found: &Finding| OF_TABLE.contains(&found.code) && !doubted_rows::is_open(found);
    if findings.iter().any(is_of_place) && !findings.iter().any(is_other) {
        findings.retain(|found| !doubted_rows::is_open(found));
    }
    // A mistake in the whole table or in some rows may look like a change from a row on.
    if has(&findings, &OF_TABLE) {
        findings.retain(|found| found.code != FindingCode::RowsChanged);
    }
    // Rows that explain the misfit are shown by a fit, columns without one are only suspected.
    if has(&findings, &[FindingCode::RowsDoubted]) {
        findings.retain(|found| found.code != FindingCode::ColumnDoubted || is_shown(found));
    }
    // A unit that the size of the arm shows is the reason for distrust, unless a reading fits.
    if !has(&findings, &[FindingCode::Misread]) {
        findings.sort_by_key(|found| found.code != FindingCode::OtherSize || !names_remedy(found));
    }
    // Where a check names the cause of a misfit, the findings on the misfit state this cause.
    let cause = CAUSES.iter().find_map(|code| findings.iter().find(|found| found.code == *code));
    let cause = cause.and_then(|found| {
        // The finding on the limits states the errors after its cause.
        let text = match found.code {
            FindingCode::LimitContradicted => found.text.split("; without limits").next()?.into(),
            _ => found.to_string(),
        };
        Some((text, is_shown(found)))
    });
    match &cause {
        Some((text, is_shown)) => {
            for finding in findings.iter_mut().filter(|found| OF_MISFIT.contains(&found.code)) {
                finding.remedy = if *is_shown {
                    text.clone()
                } else {
                    // Without a fit that shows it, a cause is only one that may be.
                    format!("{text}; otherwise {}", finding.code.entry().remedy)
                };
            }
        }
        None => state_explanations(&mut findings),
    }
    // Where the input is wrong, advice on poses, priors or σ would lead away from the mistake.
    if has(&findings, &MISTAKES) {
        for finding in &mut findings {
            if CONSEQUENCES.contains(&finding.code)
                && (cause.is_none() || !OF_MISFIT.contains(&finding.code))
                || finding.code == FindingCode::NominalFarOff
            {
                finding.remedy = "correct first the mistake that another warning names".into();
            }
        }
    } else if cause.is_none() {
        let remedy = if fit.ignores_elasticity() {
            "strategy rigid ignores the elasticity that the problem declares, so fit with \
             strategy joint"
        } else if has(&findings, &[FindingCode::StrategyMisfit]) {
            FindingCode::StrategyMisfit.entry().remedy
        } else {
            ""
        };
        let is_of_strategy = |found: &&mut Finding| OF_STRATEGY.contains(&found.code);
        for finding in findings.iter_mut().filter(is_of_strategy).filter(|_| !remedy.is_empty()) {
            finding.remedy = remedy.into();
        }
    }
    state_held_out_remedies(&mut findings);
    // Other findings say more of the held-out rows.
    let say_more = [FindingCode::HeldOutBeyondPrediction, FindingCode::HeldOutOutliers];
    let is_error = |found: &Finding| found.severity() == Severity::Error;
    if has(&findings, &say_more) || findings.iter().any(is_error) {
        findings.retain(|found| found.code != FindingCode::HeldOutUncertain);
    }
    findings
}

/// Returns the readings of the input that a finding names.
fn readings(found: &Finding) -> Vec<String> {
    let words = found.value("explanations").and_then(Value::as_array);
    words.into_iter().flatten().filter_map(Value::as_str).map(str::to_owned).collect()
}

/// Names the limits of the problem before another reading of the input, if the fit without them
/// leaves as little of the error: the reading may then be only another way to get around them.
fn state_limits_first(findings: &mut [Finding]) {
    let of = |code: FindingCode| findings.iter().position(|found| found.code == code);
    let places = of(FindingCode::LimitContradicted).zip(of(FindingCode::Misread));
    let Some((limits, misread)) = places else { return };
    let [without_limits, corrected] =
        [limits, misread].map(|place| findings[place].number("after").unwrap_or(f64::NAN));
    let Some((_, errors)) = findings[limits].text.split_once("; without limits ") else { return };
    if without_limits <= MAX_EQUAL_ERRORS * corrected {
        let text = format!(
            "limits of the problem cause most of the misfit (another warning lists them): without \
             them {errors}; a misreading would explain as much: {}",
            first_of(&readings(&findings[misread]))
        );
        let remedy = "check the limits first".to_owned();
        findings[misread] = Finding { text, remedy, ..findings[misread].clone() };
    }
}

/// Extends the remedy of a misfit by the readings of the input that would explain most of the
/// nominal arm's error.
fn state_explanations(findings: &mut [Finding]) {
    let nominal = findings.iter().find(|found| found.code == FindingCode::NominalFarOff);
    let words = nominal.map_or_else(Vec::new, readings);
    if words.is_empty() {
        return;
    }
    for finding in findings.iter_mut().filter(|found| FAR_OFF.contains(&found.code)) {
        finding.remedy = format!(
            "check first for {}, with which the nominal arm misses far less; otherwise {}",
            first_of(&words),
            finding.remedy
        );
    }
}

/// Replaces remedies about held-out rows that would lead away from a misfit of the fitted rows.
fn state_held_out_remedies(findings: &mut [Finding]) {
    use FindingCode::{
        BeyondPrior, HeldOutBeyondPrediction, HeldOutMissed, HeldOutNotBetter, HeldOutOutliers,
        HeldOutWorse, NominalFarOff, RowsSetAside,
    };
    let [is_far_off, is_beyond_noise, has_cause, is_beyond_prior] =
        [&FAR_OFF[..], &BEYOND_NOISE, &[RowsSetAside], &[BeyondPrior]]
            .map(|codes| has(findings, codes));
    let are_held_out_wrong =
        findings.iter().any(|found| found.code == HeldOutMissed && names_remedy(found));
    // Names of fixtures stand in brackets.
    let is_of_fixture = findings.iter().any(|found| {
        found.code == BeyondPrior && found.word("parameter").is_some_and(|name| name.contains('['))
    });
    for finding in findings {
        let is_default = !names_remedy(finding);
        // Remedies that name a cause stay.
        let remedy = match finding.code {
            NominalFarOff if is_of_fixture && readings(finding).is_empty() => BEYOND_PRIOR_FIRST,
            _ if !is_default => continue,
            HeldOutBeyondPrediction if are_held_out_wrong => {
                "correct first the held-out rows that another warning names"
            }
            HeldOutBeyondPrediction if is_beyond_prior => BEYOND_PRIOR_FIRST,
            HeldOutWorse | HeldOutNotBetter | HeldOutOutliers if is_far_off => {
                "find first why the fitted rows are missed; more poses or other priors do not \
                 mend that"
            }
            HeldOutOutliers if has_cause => {
                "the cause that sets fitted rows aside may act there too: look for it first"
            }
            HeldOutOutliers if is_beyond_noise => {
                "the fitted rows are off too: look first for what the model lacks with flexcal \
                 loop, then at these rows"
            }
            _ => continue,
        };
        remedy.clone_into(&mut finding.remedy);
    }
}
