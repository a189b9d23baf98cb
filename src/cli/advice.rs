//! Suggestions of the next command after a fit, a loop or a trace.

use std::path::{Path, PathBuf};

use flexcal::fit::{Finding, FindingCode, Identification, SavedEstimate, Strategy};
use flexcal::problem::{HeldOut, PoseRanges, Problem};
use flexcal::report::{self, shell_word};
use flexcal::results::{LoopResult, TraceResult, exceeds_noise};
use flexcal::select::Verdict;

use super::camera_advice::{camera_advice, measures_no_position, open_camera, to_export};
use super::input::Common;
use super::output::Results;
use super::plan;

/// Smallest and largest number of poses that a suggested plan has to distinguish two effects.
const MIN_SEPARATING_POSES: usize = 12;
const MAX_SEPARATING_POSES: usize = 60;
/// Odds of an effect against its rival at which the cause counts as certain.
const CERTAIN_ODDS: f64 = 19.0;
/// Smallest number of new poses of which some may be held out without a warning.
const MANY_POSES: usize = 20;

/// Findings that indicate a mistake in the table or the problem, not an effect that the model
/// lacks.
const INPUT_MISTAKES: [FindingCode; 6] = [
    FindingCode::OrientationMisfit,
    FindingCode::MissesMeasurements,
    FindingCode::NoBetterThanNominal,
    FindingCode::OtherSize,
    FindingCode::BeyondPrior,
    FindingCode::BeyondArmSize,
];

/// Findings that name rows or columns of the table that are wrong.
const CORRECTED_IN_TABLE: [FindingCode; 4] = [
    FindingCode::ColumnDoubted,
    FindingCode::RowsDoubted,
    FindingCode::CommandsRounded,
    FindingCode::ViewsReversed,
];

/// Returns the search for causes that follows a fit, or the application of one that a loop has
/// searched already. `is_partial` is true if the fit holds parameters of the problem; `to_apply`
/// returns the command that applies the estimate and does what its argument says.
fn search_or_apply(
    common: &Common,
    (problem, found): (&Problem, &Identification),
    is_partial: bool,
    to_apply: impl Fn(&str) -> String,
) -> String {
    let named = common.problem_arguments();
    // A loop that wrote the problem, or its remainder, has searched for causes already.
    let is_closed = common.problem_file().ends_with("problem.closed.toml");
    if is_partial {
        format!("flexcal identify {named} fits all parameters at once, elasticity included")
    } else if problem.remainder.is_some() {
        format!(
            "flexcal trace {named} ranks candidates for what is left; {}",
            to_apply("applies the estimate with its remainder")
        )
    } else if is_closed && !found.is_trusted() {
        format!("flexcal trace {named} ranks candidates for what is left")
    } else if is_closed && !measures_no_position(problem) {
        let apply = to_apply("corrects commands, with the error bound stated");
        format!("{apply}; flexcal trace {named} ranks candidates for what is left")
    } else {
        format!("flexcal loop {named} looks for what the model lacks")
    }
}

/// Returns what to do after a fit, as a command or in words. `is_structured` is true if the
/// residual tests detect structure; `estimate` is the path of the estimate.json that was written.
pub fn after_fit(
    common: &Common,
    (problem, found): (&Problem, &Identification),
    is_structured: bool,
    estimate: &Path,
) -> String {
    let named = common.problem_arguments();
    let file = common.problem_file().display().to_string();
    let to_apply = |what: &str| {
        if measures_no_position(problem) {
            let open = open_camera(found);
            return open.unwrap_or_else(|| to_export(common, problem, estimate));
        }
        let [problem, estimate] = [common.problem(), estimate].map(shell_word);
        format!("flexcal compensate {problem} --estimate {estimate} --data TARGETS.csv {what}")
    };
    let is_partial = match found.strategy {
        Strategy::Rigid => problem.is_elastic(),
        Strategy::OneSweep | Strategy::GeometryOnly | Strategy::StiffnessOnly => true,
        _ => false,
    };
    let as_warned =
        |what: &str| format!("{what} as the warning says, then flexcal identify {named}");
    let correct = || as_warned(&format!("correct the table or {file}"));
    let search = search_or_apply(common, (problem, found), is_partial, to_apply);
    match report::influential_rows_advice(found, &common.problem_file()) {
        _ if !found.is_trusted() && CORRECTED_IN_TABLE.iter().any(|code| found.has(*code)) => {
            as_warned("correct the table")
        }
        _ if report::is_prior_contradicted(found) => {
            format!("flexcal identify {named} fits these rows without the prior")
        }
        // A search for effects would attribute the change to the model, even if the fit is trusted.
        _ if found.has(FindingCode::RowsChanged) => {
            format!("follow the warning on the rows that changed, then flexcal identify {named}")
        }
        Some(look) => format!("{look}; if they are right, {search}"),
        // A misreading with another remedy leaves more than noise, so that it explains a part only.
        None if found
            .finding(FindingCode::Misread)
            .is_some_and(|misread| misread.remedy != FindingCode::Misread.entry().remedy) =>
        {
            format!(
                "check what the warning names, then flexcal identify {named}; if the input is \
                 right, flexcal loop {named} looks for what the model lacks"
            )
        }
        None if found.has(FindingCode::Misread) => correct(),
        None if let Some(what) = camera_advice(found, &file) => {
            format!("{what}, then flexcal identify {named}")
        }
        None if found.has(FindingCode::PositionsComputed) => {
            "measure the poses with an instrument".to_owned()
        }
        None if found.has(FindingCode::LimitContradicted) => format!(
            "check the limits in {file} that the warning names, then flexcal identify {named}"
        ),
        // If a prior contradicts the data, neither a cause nor a correction follows from the fit.
        // If the nominal arm is far off, its declared numbers are wrong, not the priors.
        None if found.has(FindingCode::PriorContradicted)
            && !found.has(FindingCode::NominalFarOff) =>
        {
            widen_prior(found, &file)
        }
        None if held_value(found).is_some() => {
            format!(
                "correct or free in {file} what the warning names, then flexcal identify {named}"
            )
        }
        None if INPUT_MISTAKES.iter().any(|code| found.has(*code)) => format!(
            "correct the table or {file} as the warning says, then flexcal identify {named}; if \
             the input is right, flexcal loop {named} looks for what the model lacks"
        ),
        None if found.has(FindingCode::HeldOutMissed) => as_warned("check the held-out rows"),
        None if found.has(FindingCode::PayloadAtTarget) => format!(
            "declare the place of the payload in {file} as the warning says, then flexcal \
             identify {named}"
        ),
        None if found.doubts_unit_of_sigma() && !is_partial => correct(),
        None if found.has(FindingCode::StrategyMisfit)
            || found.has(FindingCode::NoiseBeyondDeclared) =>
        {
            search
        }
        None if !found.is_trusted() || report::determines_nothing(found) => {
            format!("flexcal check {named} says what the poses can tell")
        }
        None if found.has(FindingCode::PriorsDecide)
            || found.has(FindingCode::HeldOutUncertain) =>
        {
            plan_more(&named)
        }
        None if found.has(FindingCode::BoundInUnidentifiedDirection) => format!(
            "flexcal identify {named} -v shows what the limits cost; widen those that may be wrong"
        ),
        None if is_structured
            || exceeds_noise(found)
            || found.has(FindingCode::HeldOutBeyondPrediction)
            || found.has(FindingCode::RowsSetAside) =>
        {
            search
        }
        None if found.has(FindingCode::HeldOutNotBetter) => keep_nominal(&named),
        None if found.has(FindingCode::HeldOutOutliers) => {
            format!("check the held-out rows that the warning names; if they are right, {search}")
        }
        None if found
            .finding(FindingCode::NarrowPoses)
            .is_some_and(|narrow| narrow.value("alike").is_some_and(|alike| alike == true)) =>
        {
            format!(
                "flexcal plan {named} --poses N chooses poses over the whole range of the joints"
            )
        }
        // A smaller σ changes no estimate: the fit has taken it.
        None if found.noise_factor < 1.0 && !exceeds_noise(found) => {
            let (apply, factor) = (to_apply("corrects commands"), found.noise_factor.sqrt());
            format!("{apply}; {file} may state a σ {factor:.2} times as large, which the fit took")
        }
        None => to_apply("corrects commands"),
    }
}

/// Names the command that chooses poses where those measured tell too little.
fn plan_more(named: &str) -> String {
    format!("flexcal plan {named} --poses N chooses poses to measure that tell more")
}

/// States what to do if the fit predicts held-out rows worse than the nominal arm does.
fn keep_nominal(named: &str) -> String {
    format!("keep the nominal arm, or flexcal next {named} chooses more poses to measure")
}

/// States what to do about a prior that contradicts the data.
fn widen_prior(found: &Identification, file: &str) -> String {
    let contradicted = found.finding(FindingCode::PriorContradicted);
    let rule = contradicted.and_then(|finding| finding.word("rule")).unwrap_or_default();
    format!(
        "give \"{rule}\" in {file} a larger σ, or check the nominal values of these parameters and \
         their units"
    )
}

/// Returns the finding on held parameters that cause most of the misfit. A base is left out, which may
/// take away only half of it.
fn held_value(found: &Identification) -> Option<&Finding> {
    let held = found.finding(FindingCode::HeldParameter)?;
    (!held.word("parameter")?.starts_with("base.")).then_some(held)
}

/// Largest ratio of the rms error with a held parameter free to that with what a loop found, at which
/// the two explain the measurements alike.
const MAX_RATIO_ALIKE: f64 = 1.02;

/// Returns the finding of the fit before a loop on held parameters that explain the measurements as
/// well as what the loop found, with which `after` was fitted.
pub fn held_instead<'a>(before: &'a Identification, after: &Identification) -> Option<&'a Finding> {
    let held = held_value(before)?;
    let found = after.fitted.identification.rms.norm;
    (held.number("after")? <= MAX_RATIO_ALIKE * found).then_some(held)
}

/// Returns what to do after a loop, as a command or in words. `fit` is the fit of the declared
/// problem to rows of `measured_poses` poses, `after` that with what was added, and `results` are the
/// files that the loop wrote.
pub fn after_loop(
    common: &Common,
    problem: &Problem,
    (fit, after, measured_poses): (&Identification, &Identification, usize),
    result: &LoopResult,
    results: &Results,
) -> String {
    let named = common.problem_arguments();
    let file = common.problem_file().display().to_string();
    let spoilt = after.has(FindingCode::ExcludedRowsFitted).then_some(after);
    if let Some(spoilt) = spoilt.or_else(|| result.is_misfit_of_rows().then_some(fit))
        && let Some(look) = report::influential_rows_advice(spoilt, &common.problem_file())
    {
        return look;
    }
    if result.interrupted {
        return "the same command again, to search to the end".to_owned();
    }
    if !result.trusted {
        return format!("flexcal identify {named} -v, once what the warnings name is corrected");
    }
    if fit.has(FindingCode::RowsChanged) && result.effects.is_empty() {
        return format!("follow the warning on the rows that changed, then flexcal loop {named}");
    }
    if held_instead(fit, after).is_some() {
        return format!(
            "correct or free in {file} what the warning names, then flexcal loop {named}"
        );
    }
    if report::lacks_masses(result) {
        return format!("declare the masses in {file}, then flexcal loop {named}");
    }
    if let Some(held) = after.finding(FindingCode::HeldParameter)
        && let Some(name) =
            held.word("parameter").filter(|_| result.verdict == Verdict::Unexplained)
    {
        return format!("free {name} in {file}, as the warning says, then flexcal loop {named}");
    }
    if result.structures().any(|left| left.limit.is_some()) {
        return format!(
            "flexcal identify {named} -v shows how far the error would fall if a limit moved out; \
             widen those that may be wrong"
        );
    }
    if after.has(FindingCode::HeldOutNotBetter) {
        return keep_nominal(&named);
    }
    if result.effects.is_empty() && fit.has(FindingCode::PriorsDecide) {
        return plan_more(&named);
    }
    if result.is_contradicted() {
        if result.effects.is_empty() && !problem.effects.is_empty() {
            return format!(
                "measure poses like the held-out rows that the warnings name, then this command \
                 with them; or flexcal identify {named}, then flexcal compensate with its bound"
            );
        }
        return format!(
            "follow the warnings on held-out rows before anything is applied; flexcal trace {named} \
             ranks further candidates"
        );
    }
    // A plan can distinguish two effects if the ranges of the poses are known, and if the effects
    // do not depend on time.
    let doubted = result.effects.iter().filter(|found| found.is_doubted());
    let mut pairs = doubted.filter_map(|found| {
        let rival = found.alternatives.iter().find(|rival| !rival.alike)?;
        let pair = [found.effect.declaration.clone(), rival.effect.declaration.clone()];
        let law = found.claims.as_ref().map_or(0.0, |claims| claims.law.probability);
        let odds = rival.ln_odds_of_poses.map_or(law / rival.probability, f64::exp);
        Some((pair, separating_poses(odds, measured_poses)))
    });
    let can_be_planned = |(pair, _): &([String; 2], (usize, bool))| {
        PoseRanges::of(problem).is_ok() && plan::effect_pair(pair, problem).is_ok()
    };
    let closed = shell_word(&results.path("problem.closed.toml"));
    let undecided = result.effects.iter().find_map(|found| {
        let rival = found.alternatives.first().filter(|rival| rival.is_undecided())?;
        report::certified_length([&found.effect.effect, &rival.effect.effect])
    });
    if let Some(decided) = undecided {
        return format!(
            "flexcal identify {closed} writes the estimate to apply; to be sure of the cause, \
             {decided}"
        );
    }
    if let Some(([effect, rival], (poses, is_enough))) = pairs.find(can_be_planned) {
        // The plan counts measured poses only if their files are named.
        let measured: Vec<String> = match common.data() {
            [] => problem.data.files.iter().map(|file| shell_word(file)).collect(),
            _ => Vec::new(),
        };
        let data = if measured.is_empty() {
            String::new()
        } else {
            format!(" --data {}", measured.join(" "))
        };
        let choice = if is_enough {
            "chooses about as many further poses as it takes to tell the two apart"
        } else {
            "chooses further poses that tell the two apart best, though more may be needed"
        };
        let plan = format!(
            "flexcal plan {named}{data} --poses {poses} --separate '{effect}' '{rival}' {choice}"
        );
        return format!(
            "flexcal identify {closed} writes the estimate to apply; to be sure of the cause, \
             {plan}"
        );
    }
    to_identify(result, &named, &closed)
}

/// Names the command that identifies the problem as it is after a loop, or that ranks candidates
/// for what is left. `closed` is the path of the problem that the loop wrote.
fn to_identify(result: &LoopResult, named: &str, closed: &str) -> String {
    match result.verdict {
        Verdict::Unexplained if result.is_probably_explained() => {
            format!("flexcal identify {closed} writes the estimate to apply")
        }
        Verdict::Unexplained => {
            let trace = format!(
                "flexcal trace {named} ranks candidates and lists effects that these data cannot \
                 show, if there are any"
            );
            let is_better = !result.effects.is_empty() || result.remainder.is_some();
            if is_better {
                format!("flexcal identify {closed} writes the estimate to apply; {trace}")
            } else {
                trace
            }
        }
        Verdict::NothingFound => format!("flexcal identify {named} writes the estimate to apply"),
        Verdict::Explained => {
            format!(
                "flexcal identify {closed} writes the estimate to apply; -v lists its parameters"
            )
        }
    }
}

/// Returns the number of further poses after which an effect is expected to have [`CERTAIN_ODDS`]
/// against its rival, if its odds are `odds` after `measured` poses, and true; or the largest number
/// and false if that does not suffice. The logarithm of the odds grows in proportion to the poses.
fn separating_poses(odds: f64, measured: usize) -> (usize, bool) {
    let wanted = measured as f64 * (CERTAIN_ODDS.ln() / odds.max(1.0).ln() - 1.0);
    let is_enough = (MIN_SEPARATING_POSES..=MAX_SEPARATING_POSES)
        .find(|&poses| poses as f64 >= wanted)
        .map(|poses| (poses, true));
    is_enough.unwrap_or((MAX_SEPARATING_POSES, false))
}

/// Returns what to do after an estimate was applied to rows that do not contradict it. `path` is the
/// path of the estimate. The advice is that after the fit of the estimate: commands are corrected
/// only if the fit is trusted and left no more than noise.
pub fn after_applying(
    common: &Common,
    problem: &Problem,
    estimate: &SavedEstimate,
    path: &Path,
) -> String {
    let [named, file] = [common.problem(), path].map(shell_word);
    let fitted = fitted_arguments(common, problem, estimate);
    if !estimate.trusted {
        return format!(
            "flexcal identify {fitted}{} says why the estimate is not to be trusted",
            strategy_argument(estimate)
        );
    }
    // A remainder in the problem comes from a loop, which has searched for causes already.
    // The new rows of an update are too few for a search.
    let is_searched = problem.remainder.is_some() || estimate.posterior.has_prior;
    if estimate.posterior.noise_factor > 1.0 && !is_searched {
        return format!(
            "flexcal loop {fitted} looks for what the model lacks, because the estimate leaves \
             more than noise"
        );
    }
    if measures_no_position(problem) {
        return to_export(common, problem, path);
    }
    format!("flexcal compensate {named} --estimate {file} --data TARGETS.csv corrects commands")
}

/// Formats the problem and the measurement files to which an estimate was fitted as arguments of a
/// suggested command. Those of the problem are meant if the estimate names none, or names files
/// that do not exist as seen from the current folder.
pub fn fitted_arguments(common: &Common, problem: &Problem, estimate: &SavedEstimate) -> String {
    let named = shell_word(common.problem());
    let files = &estimate.measurement_files;
    let real = |files: &[PathBuf]| -> Vec<PathBuf> {
        let of = |file: &PathBuf| file.canonicalize().unwrap_or_else(|_| file.clone());
        files.iter().map(of).collect()
    };
    if files.is_empty()
        || !files.iter().all(|file| file.is_file())
        || real(files) == real(&problem.data.files)
    {
        return named;
    }
    let files: Vec<String> = files.iter().map(|file| shell_word(file)).collect();
    format!("{named} --data {}", files.join(" "))
}

/// Formats the argument of `identify` that fits all of a few new poses, beginning with a space;
/// empty if the problem holds no fraction of them out, or if there are many. `poses` holds the
/// number of each row's pose, from 0.
pub fn held_out_argument(held_out: Option<&HeldOut>, poses: &[usize]) -> &'static str {
    let are_few = poses.iter().all(|&pose| pose + 1 < MANY_POSES);
    match held_out {
        Some(HeldOut::Fraction { .. }) if are_few => " --held-out none",
        _ => "",
    }
}

/// Formats the strategy of an estimate as an argument of `identify`, beginning with a space; empty
/// for the default strategy.
pub fn strategy_argument(estimate: &SavedEstimate) -> String {
    match estimate.strategy {
        Strategy::Joint => String::new(),
        strategy => format!(" --strategy {}", strategy.as_str()),
    }
}

/// Returns the command to run after a trace.
pub fn after_trace(common: &Common, result: &TraceResult) -> String {
    let named = common.problem_arguments();
    if !result.trusted {
        format!("flexcal identify {named} says what to correct")
    } else if report::names_cause(result) {
        format!("flexcal loop {named} adds what is missing and fits again")
    } else if result.structured || result.significant().is_some() {
        format!("flexcal loop {named} says what these data can decide")
    } else {
        format!("flexcal identify {named} writes the estimate to apply")
    }
}
