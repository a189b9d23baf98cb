//! `joint-harmonic`: an error that repeats with the joint, Δθ = Σ_k a_k sin kθ + b_k cos kθ with θ
//! = q as commanded.

use std::collections::BTreeSet;

use super::coverage::STANDS_STILL;
use super::family::{Candidate, Family, Term, USUAL};
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::{Effect, JointKind};

/// Highest order that is a candidate by itself.
pub(crate) const HIGHEST_ORDER: u32 = 60;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "joint-harmonic",
    terms: |effect, problem| match effect {
        Effect::JointHarmonic { joint, orders } => {
            let site = ParameterSite::coordinate(problem, *joint);
            let pair = |&order: &u32| {
                [
                    ("sin", Regressor::Sine(joint - 1, order)),
                    ("cos", Regressor::Cosine(joint - 1, order)),
                ]
                .map(|(wave, regressor)| {
                    Term::driven(&format!("{wave}{order}"), site, regressor, 1e-3)
                })
            };
            orders.iter().flat_map(pair).collect()
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let revolute = problem
            .joints
            .iter()
            .enumerate()
            .filter(|(_, joint)| joint.command_kind() == JointKind::Revolute);
        let effects = |(index, _)| {
            (1..=HIGHEST_ORDER)
                .map(move |order| Effect::JointHarmonic { joint: index + 1, orders: vec![order] })
        };
        let moves = |effect: &Effect| matches!(effect, Effect::JointHarmonic { joint, .. } if data.moves(joint - 1));
        let candidate = |effect: Effect| {
            let moves = moves(&effect);
            Candidate::needing(effect, moves, STANDS_STILL)
        };
        revolute.flat_map(effects).map(candidate).collect()
    },
    describe: |effect| match effect {
        Effect::JointHarmonic { joint, orders } => {
            let cycles = if orders == &[1] { "cycle" } else { "cycles" };
            format!("angle of joint {joint} errs with {} {cycles} a revolution", listed(orders))
        }
        _ => String::new(),
    },
    tries: |effect, members, _| tries(effect, members),
    parts: |effect| match effect {
        Effect::JointHarmonic { joint, orders } => orders
            .iter()
            .map(|&order| Effect::JointHarmonic { joint: *joint, orders: vec![order] })
            .collect(),
        other => vec![other.clone()],
    },
    joined: |one, other| {
        let (joint, orders) = orders_of(one)?;
        let (_, more) = orders_of(other).filter(|(own, _)| *own == joint)?;
        let mut all = orders.to_vec();
        all.extend(more.iter().filter(|order| !orders.contains(order)));
        all.sort_unstable();
        Some(Effect::JointHarmonic { joint, orders: all })
    },
    covers: |one, other| match (orders_of(one), orders_of(other)) {
        (Some((joint, orders)), Some((own, wanted))) => {
            joint == own && wanted.iter().all(|order| orders.contains(order))
        }
        _ => false,
    },
    function_of: |effect| orders_of(effect).map(|(joint, _)| (joint, joint)),
    ..USUAL
};

/// Joint, from 1, and orders.
fn orders_of(effect: &Effect) -> Option<(usize, &[u32])> {
    if let Effect::JointHarmonic { joint, orders } = effect { Some((*joint, orders)) } else { None }
}

/// Of order k of each of n joints n π²/6 k²: low orders have causes, high ones are found by trying.
fn tries(effect: &Effect, members: &[&Effect]) -> f64 {
    let joints: BTreeSet<usize> =
        members.iter().filter_map(|member| Some(orders_of(member)?.0)).collect();
    let order = orders_of(effect).and_then(|(_, orders)| orders.iter().copied().max()).unwrap_or(1);
    joints.len().max(1) as f64 * std::f64::consts::PI.powi(2) / 6.0
        * f64::from(order)
        * f64::from(order)
}

/// Ascending orders in words; three and more in a row as "1 to 5".
fn listed(orders: &[u32]) -> String {
    let runs = orders.chunk_by(|a, b| a + 1 == *b).flat_map(|run| match run {
        [first, _, .., last] => vec![format!("{first} to {last}")],
        few => few.iter().map(u32::to_string).collect(),
    });
    runs.collect::<Vec<String>>().join(", ")
}
