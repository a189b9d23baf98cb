//! Text of the command `compensate`, and recognition of targets that are given in another frame or
//! unit than stated, or with senseless start configurations.

use std::fmt::Write as _;

use super::document::{Block, percent};
use super::remainder::bound_sentence;
use super::render::text;
use crate::fit::Command;
use crate::measurement::Measurements;
use crate::problem::{Effect, Joint, JointKind, Problem};
use crate::quantity::format::{mm, number};
use crate::remainder::{Bounds, Compensation, Rival, TargetFrame, Uncorrected};
use crate::results::CompensationResult;

/// Returns the summary of the commands as text, with file and line of each target that cannot be
/// reached.
pub fn commands_text(
    problem: &Problem,
    targets: &Measurements,
    commands: &[Command],
    bounds: Option<&Bounds>,
) -> String {
    let result = CompensationResult::new(problem, commands);
    let mut words = format!(
        "{}\n{} of {} targets can be reached",
        problem.title, result.reached, result.targets
    );
    if let (Some(before), Some(after)) = (result.mean_turn_before_deg, result.mean_turn_deg) {
        let _ = write!(
            words,
            "; its orientation errs by {}° on average with the corrected commands, by {}° without",
            number(after, 4),
            number(before, 4)
        );
    }
    if let Some(bounds) = bounds.filter(|_| result.reached > 0) {
        // The text states no distance between target and corrected command, which only the solver
        // leaves: the expected error of the real arm is larger.
        let is_reached = |target: &usize| commands[*target].is_reached();
        let reached: Vec<usize> = (0..commands.len()).filter(is_reached).collect();
        let misses: Vec<f64> = reached.iter().map(|&target| commands[target].seed_miss).collect();
        let _ = write!(words, ".\n{}", bound_sentence(&bounds.of_poses(&reached), &misses, None));
    } else if result.reached > 0 {
        words += ".\nThe expected error of the commands is not known, because the estimate states no uncertainty of positions.";
    }
    let point = |command: &Command| {
        let (place, miss) = (targets.location(command.row), command.miss.norm());
        if miss.is_finite() {
            format!("out of reach: {place}, nearest {} mm away", mm(miss, 2))
        } else {
            format!("out of reach: {place}, the identified arm does not come to rest there")
        }
    };
    let points = commands.iter().filter(|command| !command.is_reached()).map(point).collect();
    text(&[Block::Lines(words, points)])
}

/// Smallest ratio of what an undecided effect would move the commands by to their error bound, at
/// which a warning says so.
const MIN_STATED_DIFFERENCE: f64 = 0.2;

/// Returns a warning that the loop left an effect undecided that would change the commands, and
/// what decides it; `None` if there is none, or if it hardly changes them.
pub fn undecided_commands(found: &Compensation, rivals: &[Rival]) -> Option<(String, String)> {
    let rival = rivals.iter().max_by(|one, other| one.share.total_cmp(&other.share))?;
    let squares: f64 = found.differences.iter().map(|difference| difference.powi(2)).sum();
    let rms = (squares / found.differences.len().max(1) as f64).sqrt();
    let most = found.differences.iter().copied().fold(0.0, f64::max);
    if rms <= MIN_STATED_DIFFERENCE * found.bounds.as_ref()?.mean() {
        return None;
    }
    let said = format!(
        "flexcal loop did not decide whether {} or, with {}, {}: by the errors that these state for \
         the instrument, the commands would differ by {} mm in root mean square, {} mm at most; \
         the bound covers that",
        rival.declared.description,
        percent(rival.share),
        rival.rival.description,
        mm(rms, 3),
        mm(most, 3)
    );
    let effects = [&rival.declared, &rival.rival].map(|side| &side.effect.effect);
    let next = certified_length(effects).unwrap_or_else(|| {
        let [one, other] = effects.map(Effect::declaration);
        format!("flexcal plan --separate '{one}' '{other}' chooses poses that tell the two apart; run flexcal loop again with them")
    });
    Some((said, next))
}

/// Returns a warning that names the effects of the instrument by which the commands are not
/// corrected, and what to declare if they are motions of the arm; `None` if there are none.
/// `is_undecided` is true if another warning names those that the bound does not include. Another
/// warning is of directions of approach that the targets do not state.
pub fn uncorrected_commands(found: &Compensation, is_undecided: bool) -> Vec<String> {
    let sides = unknown_sides(&found.uncorrected, found.bounds.is_some());
    of_instrument(found, is_undecided).into_iter().chain(sides).collect()
}

/// Returns a warning that names the directions of approach that rows do not state although effects
/// depend on them, and the size of these effects; `None` if there are none.
pub fn unknown_sides(uncorrected: &[Uncorrected], has_bounds: bool) -> Option<String> {
    sides_not_stated(uncorrected, if has_bounds { "; the bound covers both" } else { "" })
}

/// Returns the warning of [`unknown_sides`], followed by `covered`.
pub(crate) fn sides_not_stated(uncorrected: &[Uncorrected], covered: &str) -> Option<String> {
    let (mut columns, mut effects) = (Vec::new(), Vec::new());
    for of in uncorrected {
        let Some(joint) = of.side else { continue };
        let (rms, most) = of.sizes();
        let column = format!("approach{}", joint + 1);
        if !columns.contains(&column) {
            columns.push(column);
        }
        let name = of.effect.name_and_place();
        effects.push(format!("{name} (± {} mm rms, {} mm at most)", mm(rms, 3), mm(most, 3)));
    }
    if effects.is_empty() {
        return None;
    }
    let [column, depends] =
        if columns.len() == 1 { ["column", "depends"] } else { ["columns", "depend"] };
    Some(format!(
        "rows do not state from which side joints come: {} {depends} on that, and the middle is \
         taken; add the {column} {}, 1 or -1, the direction of the last motion{covered}",
        effects.join(", "),
        columns.join(", ")
    ))
}

/// Returns the warning about effects of the instrument; `None` if there are none.
fn of_instrument(found: &Compensation, is_undecided: bool) -> Option<String> {
    let of_instrument = found.uncorrected.iter().filter(|of| of.side.is_none());
    let named: Vec<_> = of_instrument.filter(|of| of.is_bounded || !is_undecided).collect();
    let (mut effects, mut remedies) = (Vec::new(), Vec::new());
    for of in &named {
        let (rms, most) = of.sizes();
        let name = match &of.effect {
            Effect::Law(law) => format!("the law {} at {}", law.name(), law.site()),
            effect => effect.name_and_place(),
        };
        effects.push(format!("{name} ({} mm rms, {} mm at most)", mm(rms, 3), mm(most, 3)));
        remedies.push(moved_instead(&of.effect));
    }
    if effects.is_empty() {
        return None;
    }
    remedies.dedup();
    let [is, s, it] =
        if effects.len() == 1 { ["is", "an error", "it"] } else { ["are", "errors", "them"] };
    let covered = match (&found.bounds, named.iter().all(|of| of.is_bounded)) {
        (Some(_), true) => "; the bound covers both",
        (Some(_), false) if named.iter().any(|of| of.is_bounded) => {
            "; the bound covers all but errors of lengths"
        }
        (Some(_), false) => "; the bound does not cover that",
        (None, _) => "",
    };
    Some(format!(
        "targets are true positions: {} {is} taken as {s} of the instrument, and the commands are \
         not corrected for {it}; if the arm or its base moves so instead, {}{covered}",
        effects.join(", "),
        remedies.join(", ")
    ))
}

/// Returns what to declare in the place of an effect of the instrument if the arm or its base moves
/// by it.
fn moved_instead(effect: &Effect) -> String {
    let bases = "at base.x, base.y and base.z";
    match effect {
        Effect::Law(law) => match law.site().strip_prefix("measurement.") {
            Some("range") | None => "declare it where the arm errs".to_owned(),
            Some(axis) => format!("declare it at base.{axis}"),
        },
        Effect::TrackerDrift => format!("declare laws of t {bases}"),
        Effect::TrackerSettling { .. } => format!("declare laws of exp(-t/τ) {bases}"),
        Effect::StationShift { .. } | Effect::StationMove { .. } => {
            "give the rows from then on a session of their own".to_owned()
        }
        _ => "leave it out (a certified length, measured, decides)".to_owned(),
    }
}

/// Returns how to decide between two effects if one of them is a scale of the instrument, which poses
/// hardly tell from errors of the arm; `None` for other effects.
pub fn certified_length(effects: [&Effect; 2]) -> Option<String> {
    let is_scale = |effect: &&Effect| matches!(effect, Effect::TrackerScale | Effect::FrameStrain);
    let scale = effects.into_iter().find(is_scale)?;
    Some(format!(
        "measure a certified length with the instrument; if it reads true, write \"{}*\" = {{ fixed = true }} under \
         [parameters] of the problem that flexcal loop was given, and run flexcal loop again",
        scale.name()
    ))
}

/// Mean distance from the targets to the positions that their joint columns predict, above which
/// another frame or unit is tried \[m\]. Errors of arms are a few millimetres.
const MIN_MISS: f64 = 0.05;
/// Largest ratio of this distance in another frame or unit to the distance as given, at which the
/// other frame or unit is probably meant.
const MAX_MISS_RATIO: f64 = 0.1;

/// Maximum number of joints of which two columns are tried as exchanged.
const MAX_EXCHANGED: usize = 8;
/// Minimum number of targets that show a common offset.
const MIN_TARGETS: usize = 3;
/// Smallest common offset of targets that is reported \[m\]. Errors of arms are smaller.
const MIN_COMMON_OFFSET: f64 = 0.02;
/// Largest ratio between the offsets of two targets that count as equal.
const MAX_COMMON_RATIO: f64 = 1.1;
/// Maximum number of targets with which other readings are tried.
const MAX_TRIED_TARGETS: usize = 50;
/// Number of coordinates of a position and an orientation.
const POSE_NUMBERS: usize = 6;

/// Mean distance from the targets to the positions that their joint columns predict, above which
/// these columns do not tell which configuration of the arm is meant \[m\].
const MIN_FAR_START: f64 = 0.3;

/// Warnings about targets and their joint columns.
#[derive(Debug)]
pub struct Doubts {
    /// Warning that names another frame, unit or order of columns that is probably meant; `None` if
    /// none fits better.
    pub misplaced: Option<String>,
    /// Other warnings.
    pub others: Vec<String>,
}

impl Doubts {
    /// Collects the warnings about the targets and their commands. `solve` finds the commands for
    /// targets in a frame, and `option` returns the option of the caller that chooses a frame.
    pub fn new(
        problem: &Problem,
        (targets, frame, commands): (&Measurements, TargetFrame, &[Command]),
        option: impl Fn(TargetFrame) -> String,
        solve: impl Fn(Measurements, TargetFrame) -> Option<Vec<Command>>,
    ) -> Self {
        let misplaced = warning(problem, (targets, frame, commands), option, solve);
        let starts = common_offset(targets, commands).or_else(|| far_starts(targets, commands));
        let starts = starts.filter(|_| misplaced.is_none());
        let others = [starts, too_few_joints(problem, targets, commands)];
        Self { misplaced, others: others.into_iter().flatten().collect() }
    }
}

/// Returns a warning that names the frame or unit in which the targets are much nearer to the
/// positions of their joint columns; `None` if there is no such frame or unit. `solve` finds the
/// commands for targets in a frame.
fn warning(
    problem: &Problem,
    (targets, frame, commands): (&Measurements, TargetFrame, &[Command]),
    option: impl Fn(TargetFrame) -> String,
    solve: impl Fn(Measurements, TargetFrame) -> Option<Vec<Command>>,
) -> Option<String> {
    let given = mean_miss(commands);
    if !targets.position_measured || given <= MIN_MISS {
        return None;
    }
    // Some of the targets tell as much as all of them.
    let step = targets.len().div_ceil(MAX_TRIED_TARGETS).max(1);
    let targets = &targets.select(&(0..targets.len()).step_by(step).collect::<Vec<_>>());
    let other = match frame {
        TargetFrame::Measuring => TargetFrame::Base,
        TargetFrame::Base => TargetFrame::Measuring,
    };
    let scaled = |factor: f64| {
        let mut scaled = targets.clone();
        scaled.positions.iter_mut().for_each(|position| *position *= factor);
        scaled
    };
    let has_unit = |unit: f64| {
        targets.position_unit.is_some_and(|declared| (declared / unit - 1.0).abs() < 1e-9)
    };
    let mut trials = vec![(targets.clone(), other, option(other))];
    if has_unit(1e-3) {
        trials.push((scaled(1e3), frame, "metres instead of the declared millimetres".to_owned()));
        trials.push((scaled(25.4), frame, "inches instead of the declared millimetres".to_owned()));
    } else if has_unit(1.0) {
        trials.push((scaled(1e-3), frame, "millimetres instead of the declared metres".to_owned()));
    }
    let axes = [(0, 1, "x and y"), (0, 2, "x and z"), (1, 2, "y and z")];
    trials.extend(axes.map(|(first, second, names)| {
        let mut exchanged = targets.clone();
        let positions = exchanged.positions.iter_mut();
        positions.for_each(|position| position.swap_rows(first, second));
        (exchanged, frame, format!("the columns of {names} exchanged"))
    }));
    trials.extend(
        of_joints(problem, targets).into_iter().map(|(targets, words)| (targets, frame, words)),
    );
    let misses = trials.into_iter().filter_map(|(targets, frame, words)| {
        let miss = mean_miss(&solve(targets, frame)?);
        (miss < MAX_MISS_RATIO * given).then_some((miss, words))
    });
    let (miss, words) = misses.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(format!(
        "the targets are {:.0} mm from where their joint columns lead, and with {words} {:.1} mm: \
         check frame, units and columns of the targets before the arm is moved",
        given * 1e3,
        miss * 1e3
    ))
}

/// Returns the targets with other readings of their joint columns, each with its words: radians
/// under degrees, and two columns exchanged.
fn of_joints(problem: &Problem, targets: &Measurements) -> Vec<(Measurements, String)> {
    let kinds: Vec<JointKind> = problem.joints.iter().map(Joint::command_kind).collect();
    let with = |change: &dyn Fn(&mut [f64])| {
        let mut changed = targets.clone();
        changed.configurations.chunks_exact_mut(targets.joints.max(1)).for_each(change);
        changed
    };
    let turning = |joint: usize| kinds.get(joint) == Some(&JointKind::Revolute);
    let are_degrees = targets.command_columns.iter().all(|column| column.unit < 1.0);
    let mut trials = Vec::new();
    if are_degrees && !targets.command_columns.is_empty() {
        let to_degrees = |q: &mut [f64]| {
            let angles = q.iter_mut().enumerate().filter(|(joint, _)| turning(*joint));
            angles.for_each(|(_, angle)| *angle = angle.to_degrees());
        };
        let words = "start joints in radians instead of the declared degrees".to_owned();
        trials.push((with(&to_degrees), words));
    }
    let moving: Vec<usize> = (0..targets.joints.min(MAX_EXCHANGED))
        .filter(|&joint| kinds.get(joint).is_some_and(|kind| *kind != JointKind::Fixed))
        .collect();
    for (k, &first) in moving.iter().enumerate() {
        for &second in moving.iter().skip(k + 1) {
            if kinds.get(first) == kinds.get(second) {
                let words =
                    format!("the columns of joints {} and {} exchanged", first + 1, second + 1);
                trials.push((with(&|q: &mut [f64]| q.swap(first, second)), words));
            }
        }
    }
    trials
}

/// Returns a warning if all targets are about as far from where their joint columns lead, as they
/// are if they belong to another point of the tool or to another frame.
fn common_offset(targets: &Measurements, commands: &[Command]) -> Option<String> {
    let misses = || commands.iter().map(|command| command.seed_miss);
    let least = misses().fold(f64::INFINITY, f64::min);
    let most = misses().fold(0.0, f64::max);
    let is_common = commands.len() >= MIN_TARGETS && most < MAX_COMMON_RATIO * least;
    (targets.position_measured && is_common && least > MIN_COMMON_OFFSET).then(|| {
        format!(
            "every target is {:.1} to {:.1} mm from where its joint columns lead: are the targets of \
             another point of the tool, or in another frame?",
            least * 1e3,
            most * 1e3
        )
    })
}

/// Returns a warning if the joint columns lead so far from the targets that they do not tell which
/// of the configurations that reach a target is meant, or if such targets are out of reach.
fn far_starts(targets: &Measurements, commands: &[Command]) -> Option<String> {
    let is_far = |command: &&Command| command.seed_miss > MIN_FAR_START;
    let (mut far, missed): (Vec<&Command>, Vec<&Command>) =
        commands.iter().filter(is_far).partition(|command| command.is_reached());
    let so = if far.is_empty() {
        far = missed;
        ", and out of reach"
    } else {
        ", so that their commands may be of another configuration of the arm than is meant"
    };
    let is_warned = targets.position_measured && mean_miss(commands) > MIN_FAR_START;
    let first = targets.location(far.first().filter(|_| is_warned)?.row);
    let what = if 2 * far.len() > commands.len() {
        "units, order and names of the joint columns".to_owned()
    } else {
        format!("the positions and joint angles of these targets, the first at {first},")
    };
    Some(format!(
        "{} of {} targets are {} mm or more from where their joint columns lead{so}: check {what} before \
         the arm is moved",
        far.len(),
        commands.len(),
        MIN_FAR_START * 1e3
    ))
}

/// Returns a warning if targets with orientations are not reached by an arm of fewer than six
/// joints.
fn too_few_joints(
    problem: &Problem,
    targets: &Measurements,
    commands: &[Command],
) -> Option<String> {
    let moving = problem.joints.iter().filter(|joint| joint.command_kind() != JointKind::Fixed);
    let (joints, missed) =
        (moving.count(), commands.iter().filter(|command| !command.is_reached()).count());
    (targets.orientations.is_some() && joints < POSE_NUMBERS && missed > 0).then(|| {
        format!(
            "{joints} joints cannot hold both a position and an orientation, which are {POSE_NUMBERS} \
             numbers; leave the columns of the orientation out to reach positions alone"
        )
    })
}

/// Returns the mean distance from the targets to the positions that their joint columns predict
/// \[m\].
fn mean_miss(commands: &[Command]) -> f64 {
    commands.iter().map(|command| command.seed_miss).sum::<f64>() / commands.len().max(1) as f64
}
