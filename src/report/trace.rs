//! Text and page of the command `trace`: the effects that the residual of a fit points to.

use std::fmt::Write as _;

use super::detection::has_no_mass;
use super::document::{Block, MIN_PROBABLE, Point, joined, opening, percent};
use super::errors::{held_out_rows, rows_of, without_equilibrium};
use super::identify::page_warnings;
use super::noise::format_chi2;
use super::render::Story;
use super::unexplained::missing_sigma;
use super::verdict::declared;
use super::{effect, figures, residual_tests};
use crate::fit::Identification;
use crate::laws::Need;
use crate::problem::{Effect, Problem};
use crate::quantity::Unit;
use crate::quantity::format::{counted, number, p_value};
use crate::results::{
    Candidate, Claims, CommandedJoint, Confounded, Hypothesis, HypothesisSet, PlotData,
    SeparatingPose, Summary, TraceResult, at_place, commanded_joints,
};
use crate::select::Trace;

/// Maximum number of candidates that a text lists.
const MAX_SHOWN_CANDIDATES: usize = 6;
/// Maximum number of hypothesis sets that a text lists.
const MAX_SHOWN_SETS: usize = 4;
/// Maximum number of confounded effects that are named for a candidate.
const MAX_SHOWN_CONFOUNDED: usize = 3;

/// Returns the result of the command `trace`; with `plots`, its page has figures of the ranking and
/// of the residuals.
pub fn trace(problem: &Problem, trace: &Trace, plots: Option<&PlotData>) -> Story {
    let result = TraceResult::new(problem, trace);
    let mut blocks = opening(&problem.title, headline(&trace.fit)).to_vec();
    blocks.push(Block::Text(verdict(&result)));
    blocks.push(page_warnings(&trace.fit, plots));
    blocks.extend(missing_sigma(&trace.fit).map(Block::Text));
    // Beside a fit that is not to be trusted, explanations are of its mistake.
    if result.trusted {
        blocks.extend(hypothesis_sets(&result));
    }
    blocks.extend([
        Block::heading("Tests of the residual (measured − predicted) of the identification poses"),
        Block::List(residual_tests::by_outcome(&trace.residual_tests)),
    ]);
    blocks.extend(
        residual_tests::other_reduced_chi2(&trace.residual_tests, &trace.fit).map(Block::Text),
    );
    blocks.extend(ranking(problem, &result, MAX_SHOWN_CANDIDATES, "trace.json holds them all"));
    blocks.extend(plots.map(|plots| {
        Block::figures([
            figures::ranking(trace),
            figures::order(plots),
            figures::joint_map(plots),
            figures::histogram(plots),
        ])
    }));
    blocks.extend(undetectable_effects(problem, trace));
    Story::new(&problem.title, "trace", blocks)
}

fn headline(fit: &Identification) -> String {
    let held_out = &fit.fitted.held_out;
    let size = fit.reduced_chi2.map_or_else(String::new, |chi2| {
        format!("; χ²/ν {}, 1 if only noise is left", format_chi2(chi2))
    });
    let error = match held_out.unpredicted {
        0 => {
            let ([mean, rms, _], unit) = Summary::of(held_out).norms();
            let [mean, rms] = [mean, rms].map(|error| number(error, 4));
            format!(
                "on {} the error is {mean} {unit} in the mean, rms {rms} {unit}",
                held_out_rows(fit)
            )
        }
        _ => without_equilibrium(held_out, "held-out"),
    };
    format!(
        "{} from {}{size}; {error}",
        counted(fit.unknowns.len(), "parameter"),
        rows_of(fit, |errors| errors.identification)
    )
}

/// States whether the residual has structure, and its most probable cause.
fn verdict(result: &TraceResult) -> String {
    if !result.trusted {
        return "No cause is claimed, because the fit is not to be trusted. Correct first what the \
                warnings name."
            .to_owned();
    }
    let structure = if result.size_alone().is_some() {
        "The residual is larger than the declared σ explains, and no residual test by itself shows \
         on what it depends"
            .to_owned()
    } else if result.structured {
        "The residual has structure".to_owned()
    } else if !result.is_testable() {
        "The residual could not be tested for structure".to_owned()
    } else if names_cause(result) {
        "No test finds structure in the residual".to_owned()
    } else {
        "The residual looks like noise".to_owned()
    };
    let groups = groups_of_sets(result);
    let cause = match (groups.first(), result.significant()) {
        (Some(alike), _) if has_cause(alike) => {
            let probability = total_probability(alike);
            let by = match result.size_alone() {
                Some(_) => " by comparison of whole models",
                None => "",
            };
            let causes = causes_of(alike, result);
            format!("most probable cause{by}: {causes} ({})", percent(probability))
        }
        (None, Some(candidate)) => format!("it points to: {}", candidate.effect.description),
        (Some(_), Some(candidate)) => format!(
            "no cause is probable, although one effect is significant by itself: {}",
            candidate.effect.description
        ),
        _ => "no cause is visible".to_owned(),
    };
    format!("{structure}; {cause}.")
}

/// Returns true if the text on a trace names a cause.
pub(crate) fn names_cause(result: &TraceResult) -> bool {
    match groups_of_sets(result).first() {
        Some(alike) => has_cause(alike),
        None => result.significant().is_some(),
    }
}

/// Returns true if the sets contain a cause; the empty set means noise alone.
fn has_cause(alike: &[&HypothesisSet]) -> bool {
    alike.iter().any(|set| !set.hypotheses.is_empty())
}

/// Returns true if the sets differ only in values of searched arguments, such as the distance of a
/// friction law, or in the order of factors in formulas.
fn are_alike(set: &HypothesisSet, other: &HypothesisSet) -> bool {
    let mut left: Vec<&Hypothesis> = set.hypotheses.iter().collect();
    other.hypotheses.len() == left.len()
        && other.hypotheses.iter().all(|hypothesis| {
            let place = left.iter().position(|candidate| candidate.is_alike(hypothesis));
            place.map(|place| left.remove(place)).is_some()
        })
}

fn total_probability(sets: &[&HypothesisSet]) -> f64 {
    sets.iter().map(|set| set.probability).sum()
}

/// Describes the causes of the first of some sets that differ only in values of searched
/// arguments, and states which values the others have.
fn causes_of(alike: &[&HypothesisSet], result: &TraceResult) -> String {
    let Some(first) = alike.first() else { return String::new() };
    let words = |hypothesis: &Hypothesis| {
        let of = alike.iter().flat_map(|set| &set.hypotheses);
        let mut values: Vec<f64> = of
            .filter(|other| other.is_alike(hypothesis))
            .filter_map(Hypothesis::searched_value)
            .collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        match (hypothesis.searched_key(), values.as_slice()) {
            (Some(key), [low, .., high]) => {
                let count = values.len();
                format!("{} [{key} {low} to {high}, {count} values]", hypothesis.description)
            }
            _ => hypothesis.description.clone(),
        }
    };
    let causes: Vec<String> = first.hypotheses.iter().map(words).collect();
    match causes.as_slice() {
        [] if result.size_alone().is_some() => "noise alone, larger than the declared σ".to_owned(),
        [] => "noise alone".to_owned(),
        [cause] => cause.clone(),
        causes => {
            let entries = causes.iter().zip(1..).map(|(cause, k)| format!("({k}) {cause}"));
            entries.collect::<Vec<_>>().join(", ")
        }
    }
}

/// Returns the groups of sets that differ only in values of searched arguments, the most probable
/// group first.
fn groups_of_sets(result: &TraceResult) -> Vec<Vec<&HypothesisSet>> {
    let mut groups: Vec<Vec<&HypothesisSet>> = Vec::new();
    for set in &result.explanations {
        match groups.iter_mut().find(|group| are_alike(group[0], set)) {
            Some(group) => group.push(set),
            None => groups.push(vec![set]),
        }
    }
    groups.sort_by(|a, b| total_probability(b).total_cmp(&total_probability(a)));
    groups
}

/// Lists the most probable hypothesis sets with their probabilities, and the claims about the
/// causes in the first set; nothing if no set was evaluated. Sets that differ only in values of
/// searched arguments count as one.
fn hypothesis_sets<'a>(result: &TraceResult) -> Vec<Block<'a>> {
    let groups = groups_of_sets(result);
    let point = |alike: &Vec<&HypothesisSet>| {
        format!("{}: {}", percent(total_probability(alike)), causes_of(alike, result))
    };
    let shown: Vec<String> = groups.iter().take(MAX_SHOWN_SETS).map(point).collect();
    if shown.is_empty() {
        return Vec::new();
    }
    let legend = effect::legend_of(&shown.join(" "));
    let mut blocks = vec![Block::heading("Most probable explanations"), Block::list(shown)];
    blocks.extend(legend.map(Block::Text));
    // The claims are those of the most probable single set.
    let first = &result.explanations[0];
    if !result.claims.is_empty() && std::ptr::eq(groups[0][0], first) {
        blocks.push(Block::heading(
            "How sure the most probable explanation is: where it acts, what it depends on, and \
             its law",
        ));
        let words = |claims: &Claims| {
            let mut others = first.hypotheses.iter().filter(|other| other.effect.is_none());
            let is_denied = claims.law.value.is_some()
                && claims.law.probability < MIN_PROBABLE
                && others.any(|other| other.place == claims.place.value);
            if is_denied {
                claims_text(claims)
                    + " without a second cause there, but a function of unknown law acts at the same place"
            } else {
                claims_text(claims)
            }
        };
        blocks.push(Block::list(result.claims.iter().map(words)));
    }
    blocks
}

/// States the claims about a cause with their probabilities: place, inputs, law.
pub(super) fn claims_text(claims: &Claims) -> String {
    let Claims { place, depends_on, law, .. } = claims;
    let words = match &law.value {
        Some(name) if name == "law" => {
            format!("a law of these terms: {}", percent(law.probability))
        }
        Some(name) => format!("law {name}: {}", percent(law.probability)),
        None => "law not known".to_owned(),
    };
    let inputs = if depends_on.value.is_empty() {
        String::new()
    } else {
        let inputs = depends_on.value.iter().map(|name| match name.as_str() {
            "load" => "the moments of the loads",
            name => name,
        });
        let inputs: Vec<&str> = inputs.collect();
        let inputs = match inputs.split_last() {
            Some((last, [])) => (*last).to_owned(),
            Some((last, others)) => format!("{} and {last}", others.join(", ")),
            None => String::new(),
        };
        format!("; depends there on {inputs} alone: {}", percent(depends_on.probability))
    };
    format!("acts {}: {}{inputs}; {words}", at_place(&place.value), percent(place.probability))
}

/// Lists at most `max` significant candidates and explains the list; `where_all` is the clause that
/// states where all of them are listed.
pub(super) fn ranking<'a>(
    problem: &Problem,
    result: &TraceResult,
    max: usize,
    where_all: &str,
) -> Vec<Block<'a>> {
    let TraceResult { level, tried, .. } = result;
    let significant: Vec<&Candidate> =
        result.ranking.iter().filter(|candidate| candidate.p_value < *level).collect();
    let Some(first) = result.ranking.first() else {
        return vec![
            Block::heading("Candidate effects"),
            Block::Text("There is no candidate to try.".to_owned()),
        ];
    };
    if significant.is_empty() {
        return vec![
            Block::heading("Candidate effects"),
            Block::Text(format!(
                "None of {tried} candidates is significant. The best one ({}) is not clearly \
                 better than noise (p {}, corrected for the number of candidates; significant \
                 below {level}).",
                declared(&first.effect),
                p_value(first.p_value),
            )),
        ];
    }
    let ([_, rms, _], unit) = result.errors.identification.norms();
    // Noise of one measured row, if the fit explained all but noise.
    let noise = rms / result.reduced_chi2.unwrap_or(1.0).max(1.0).sqrt();
    let shown = &significant[..max.min(significant.len())];
    let points = shown.iter().map(|candidate| point(problem, candidate, (unit, noise))).collect();
    let mut notes = format!(
        "{tried} candidates were tried one by one. p is the probability that noise alone does as well, corrected for their number; \
         below {level} a candidate is significant. One cause makes similar effects significant, too: the first entry explains most by itself, \
             and several effects together may explain more."
    );
    if significant.len() > max {
        let more = significant.len() - max;
        let are = if more == 1 { "one is" } else { "ones are" };
        let _ = write!(notes, " {more} more significant {are} left out here; {where_all}.");
    }
    if shown.iter().any(|candidate| !candidate.alike.is_empty()) {
        notes.push_str(
            " The angle in brackets lies between the displacements by the two effects after all parameters are fitted. At 0° these \
             poses cannot distinguish the effects, at small angles only precise data can; the \
             probabilities take this into account.",
        );
    }
    if shown.iter().any(|candidate| candidate.alike.len() > MAX_SHOWN_CONFOUNDED) {
        let _ = write!(
            notes,
            " An entry names at most {MAX_SHOWN_CONFOUNDED} similar effects; {where_all}."
        );
    }
    if shown.iter().any(|candidate| separating_pose(candidate, noise).is_some()) {
        notes.push_str(" The pose to measure is within the measured ranges.");
    }
    vec![
        Block::heading("Candidates of the catalogue, best first"),
        Block::Ranking(points),
        Block::Text(notes),
    ]
}

/// Returns the pose that distinguishes a candidate from the first effect that is hard to tell from
/// it; `None` if the predictions differ there by no more than `noise`.
fn separating_pose(candidate: &Candidate, noise: f64) -> Option<(&SeparatingPose, &Confounded)> {
    let pose = candidate.told_apart.as_ref()?;
    let is_above_noise = pose.difference().unwrap_or(f64::NAN).abs() > noise;
    Some((pose, candidate.alike.first()?)).filter(|_| is_above_noise)
}

/// Describes a candidate. `unit` is that of the errors, and `noise` the root mean square noise of a
/// row in that unit: no pose is recommended where two predictions differ by less.
fn point(problem: &Problem, candidate: &Candidate, (unit, noise): (&str, f64)) -> Point {
    let show = |value: f64| format!("{} {unit}", number(value.abs(), 4));
    let gain = candidate.expected_gain().unwrap_or(f64::NAN);
    let change = |gain: f64| if gain < 0.0 { "rise" } else { "fall" };
    let mut words = format!(
        "p {}; the rms error of the identification poses would {} by {}",
        p_value(candidate.p_value),
        change(gain),
        show(gain)
    );
    if let Some(left_out) = candidate.cross_validated_gain() {
        let changes =
            if change(left_out) == change(gain) { "" } else { &format!("{} ", change(left_out)) };
        let _ = write!(words, ", that of poses left out in turn {changes}by {}", show(left_out));
    }
    let mut details = vec![words];
    if !candidate.alike.is_empty() {
        let alike =
            |other: &Confounded| format!("{} ({:.0}°)", other.effect.description, other.angle_deg);
        details.push(format!(
            "hard to tell from: {}",
            joined(candidate.alike.iter().map(alike), MAX_SHOWN_CONFOUNDED, "; ")
        ));
    }
    if let Some((pose, first)) = separating_pose(candidate, noise) {
        details.push(format!(
            "to distinguish “{}”, measure at {}: the predictions differ by {}",
            first.effect.description,
            pose_words(problem, pose),
            show(pose.difference().unwrap_or(f64::NAN))
        ));
    }
    Point { text: declared(&candidate.effect), details, mark: None }
}

/// Describes a pose: joints, target, payload, hoist, temperature.
fn pose_words(problem: &Problem, pose: &SeparatingPose) -> String {
    let value = |joint: CommandedJoint| {
        let unit = if joint.unit == Unit::Angle { "°" } else { " mm" };
        format!("{} {}{unit}", joint.name(), number(pose.q[joint.joint] * joint.factor(), 1))
    };
    let mut words: Vec<String> = commanded_joints(problem).into_iter().map(value).collect();
    words.extend(pose.target.as_ref().map(|target| format!("target {target}")));
    words.extend(pose.payload_kg.map(|mass| format!("payload {} kg", number(mass, 2))));
    words.extend(pose.hoist.map(|force| format!("hoist {} N", number(force, 1))));
    words.extend(pose.temperature.map(|degrees| format!("{} °C", number(degrees, 1))));
    words.join(", ")
}

/// Lists the effects that these data cannot show, by the reason.
pub(super) fn undetectable_effects<'a>(problem: &Problem, trace: &Trace) -> Vec<Block<'a>> {
    let is_listed = |of: &Effect| effect::is_at_moving_joint(problem, of);
    let untestable: Vec<_> =
        trace.untestable.iter().filter(|(of, _)| is_listed(of)).cloned().collect();
    let absorbed: Vec<&Effect> = trace.absorbed.iter().filter(|of| is_listed(of)).collect();
    let mut blocks = Vec::new();
    if !untestable.is_empty() {
        blocks.push(Block::heading("Effects that these data cannot show"));
        blocks.push(Block::List(effect::reasons(untestable, trace.time_measured)));
    }
    // Where a direction of approach is recorded, play moves the arm without loads and is testable.
    let (unloaded, absorbed): (Vec<&Effect>, Vec<&Effect>) = absorbed
        .into_iter()
        .partition(|of| has_no_mass(problem) && of.has_need(&[Need::Loads, Need::Play]));
    if !unloaded.is_empty() {
        blocks.push(Block::heading(
            "Effects that these data cannot show, because no mass is declared, so that no load \
             acts",
        ));
        blocks.push(Block::list(effect::listed(unloaded, trace.time_measured)));
    }
    if !absorbed.is_empty() {
        blocks.push(Block::heading(
            "Effects that these poses cannot show, because fitted parameters make up for them \
             exactly",
        ));
        blocks.push(Block::list(effect::listed(absorbed, trace.time_measured)));
    }
    blocks
}
