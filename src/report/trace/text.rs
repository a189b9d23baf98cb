//! What `trace` prints.

use std::fmt::Write as _;

use super::super::document::{Block, Point, to_text};
use super::super::errors::counted;
use super::super::quantity::number;
use super::super::{effect, findings};
use crate::diagnose::{Ranked, TellingPose, Trace};
use crate::identify::Identification;
use crate::problem::{JointKind, Problem};

/// Candidates that fit on a screen.
const SHOWN: usize = 6;
/// Effects alike that are named.
const SHOWN_ALIKE: usize = 3;

/// A trace as text, ending in a line break.
pub fn trace_text(problem: &Problem, trace: &Trace) -> String {
    let mut blocks = vec![
        Block::Text(headline(problem, &trace.fit)),
        Block::heading("What the residual (measured − predicted) of the identification poses looks like"),
        Block::list(findings::all(&trace.findings)),
    ];
    let another = findings::another_size(&trace.findings, trace.fit.reduced_chi2);
    blocks.extend(another.map(|words| Block::Text(words.to_owned())));
    blocks.extend(ranking(problem, trace, SHOWN, "trace.json holds them all"));
    blocks.extend(not_seen(trace));
    to_text(&blocks)
}

fn headline(problem: &Problem, fit: &Identification) -> String {
    let (fitted, held_out) = (&fit.fitted.identification, &fit.fitted.held_out);
    let size =
        fit.reduced_chi2.map_or_else(String::new, |chi2| format!("; χ²/ν {}, 1 for noise alone", number(chi2, 2)));
    let error = match held_out.unpredicted {
        0 => format!(
            "on {} held-out poses the error is {} mm in the mean, rms {} mm",
            held_out.n,
            number(held_out.mean.norm * 1e3, 4),
            number(held_out.rms.norm * 1e3, 4),
        ),
        _ => counted(held_out, "held-out"),
    };
    format!("{}\n{} parameters from {} poses{size}; {error}", problem.title, fit.unknowns.len(), fitted.n)
}

/// The candidates that stand out, at most so many of them, how to read them, and `where_all` are.
pub(in crate::report) fn ranking(problem: &Problem, trace: &Trace, most: usize, where_all: &str) -> Vec<Block> {
    let all: Vec<&Ranked> = trace.ranking.iter().filter(|ranked| ranked.p_value < trace.level).collect();
    let Some(first) = trace.ranking.first() else {
        return vec![Block::heading("What could explain it"), Block::Text("There is no candidate to try.".to_owned())];
    };
    if all.is_empty() {
        return vec![
            Block::heading("What could explain it"),
            Block::Text(format!(
                "None of {} candidates stands out. The best, {}, does no better than chance would ({}, corrected for the \
                 number of candidates; below {} would stand out).",
                trace.tried,
                effect::both(&first.effect, trace),
                effect::p(first.p_value),
                trace.level,
            )),
        ];
    }
    let shown = all.iter().take(most).map(|ranked| point(problem, trace, ranked)).collect();
    let mut notes = format!(
        "{} candidates were tried one by one; p is the probability that chance alone does as well, corrected for their \
         number, and below {} it stands out. One cause makes its neighbours stand out, too: the first is the best \
         explanation, not every entry a finding.",
        trace.tried, trace.level
    );
    if all.len() > most {
        let _ = write!(notes, " {} more that stand out are left out here; {where_all}.", all.len() - most);
    }
    if all.iter().take(most).any(|ranked| !ranked.alike.is_empty()) {
        notes.push_str(
            " The angle between two effects says how alike they are on these poses once all parameters have been fitted: \
             at 0° nothing tells them apart, at 90° they have nothing in common. A pose where they would differ is one \
             within the ranges that were measured.",
        );
    }
    vec![Block::heading("What could explain it, best first"), Block::Ranking(shown), Block::Text(notes)]
}

fn point(problem: &Problem, trace: &Trace, ranked: &Ranked) -> Point {
    let mm = |gain: f64| number(gain * 1e3, 4);
    let mut gain = format!(
        "{}; would take {} mm off the rms error of the identification poses",
        effect::p(ranked.p_value),
        mm(ranked.gain)
    );
    if let Some(cross_validated) = ranked.cross_validated {
        let _ = write!(gain, ", {} mm on poses left out in turn", mm(cross_validated));
    }
    let mut details = vec![gain];
    if !ranked.alike.is_empty() {
        let named = ranked.alike.iter().take(SHOWN_ALIKE);
        let named = named.map(|(other, angle)| format!("{} ({:.0}°)", trace.describe(other), angle.to_degrees()));
        let more = match ranked.alike.len().saturating_sub(SHOWN_ALIKE) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        details.push(format!("hard to tell from: {}{more}", named.collect::<Vec<_>>().join("; ")));
    }
    if let Some(apart) = &ranked.telling_pose {
        let other = trace.describe(&apart.other);
        details.push(format!("“{other}” would differ by {} mm at {}", mm(apart.difference), pose(problem, apart)));
    }
    Point { text: effect::both(&ranked.effect, trace), details }
}

/// A pose in words: joints, payload, hoist, temperature.
fn pose(problem: &Problem, apart: &TellingPose) -> String {
    let joints = problem.joints.iter().zip(&apart.configuration).enumerate();
    let mut words: Vec<String> = joints
        .filter_map(|(index, (joint, q))| match joint.kind {
            JointKind::Revolute => Some(format!("q{} {}°", index + 1, number(q.to_degrees(), 1))),
            JointKind::Prismatic => Some(format!("q{} {} mm", index + 1, number(q * 1e3, 1))),
            JointKind::Fixed => None,
        })
        .collect();
    words.extend(apart.payload.map(|mass| format!("payload {} kg", number(mass, 2))));
    words.extend(apart.hoist.map(|force| format!("hoist {} N", number(force, 1))));
    words.extend(apart.temperature.map(|degrees| format!("{} °C", number(degrees, 1))));
    words.join(", ")
}

/// What these data can say nothing about.
fn not_seen(trace: &Trace) -> Vec<Block> {
    let mut blocks = Vec::new();
    if !trace.untestable.is_empty() {
        let lines = effect::grouped(trace.untestable.iter().cloned());
        blocks.push(Block::heading("What these data cannot show"));
        blocks.push(Block::list(lines.into_iter().map(|(words, reason)| format!("{words}: {reason}"))));
    }
    if !trace.absorbed.is_empty() {
        let lines = effect::grouped(trace.absorbed.iter().cloned().map(|effect| (effect, ())));
        blocks.push(Block::heading("What the fitted parameters take up wholly, so that it would not show"));
        blocks.push(Block::list(lines.into_iter().map(|(words, ())| words)));
    }
    blocks
}
