//! Poses that tell two effects apart.

use rayon::prelude::*;

use super::plan::{DRAWN, DRAWS, EVENLY, FIRST_DRAW, choose};
use super::{Candidates, Criterion, DesignError, Extremes, Plan, PlanOptions, Site, plan};
use crate::measurement::Measurements;
use crate::numeric::median;
use crate::problem::{Effect, EffectDeclaration, Problem};
use crate::select::{Separation, separation};

/// Two effects to tell apart, and a problem that declares both.
#[derive(Debug, Clone)]
pub struct Pair {
    /// The effects.
    pub effects: [Effect; 2],
    /// The problem without them.
    pub plain: Problem,
    /// The problem with both.
    pub declared: Problem,
}

impl Pair {
    /// Two effects that `problem` does not declare; positions alone tell them apart.
    ///
    /// # Errors
    /// They are the same, one of them is declared, or follows the time and not the poses.
    pub fn new(problem: &Problem, pair: [EffectDeclaration; 2]) -> Result<Self, DesignError> {
        let [one, other] = &pair;
        let relieved = one.effect.compensated();
        if one.effect == other.effect
            || (relieved.is_some() && relieved == other.effect.compensated())
        {
            return Err(DesignError::SameEffect { effect: one.effect.describe() });
        }
        for EffectDeclaration { effect, .. } in &pair {
            if problem.effects.iter().any(|declared| declared.effect == *effect) {
                return Err(DesignError::DeclaredEffect { effect: effect.describe() });
            }
            if effect.follows_time() {
                return Err(DesignError::FollowsTime { effect: effect.describe() });
            }
        }
        let plain = problem.positions_alone();
        let mut declared = plain.clone();
        declared.effects.extend(pair.clone());
        Ok(Self { effects: pair.map(|declared| declared.effect), plain, declared })
    }

    /// The errors of the effects' parameters, each beside the other effect and everything else that
    /// is free: an effect whose own part is known so well is told from the other. Where a mass is,
    /// and what else has no size, does not count.
    ///
    /// # Errors
    /// As for [`Site::new`], or rules of `[parameters]` fix both effects.
    fn criterion(&self, poses: &Measurements) -> Result<Criterion, DesignError> {
        let site = Site::new(&self.declared, &[poses])?;
        let own = self.effects.iter().flat_map(|effect| effect.parameters(&self.declared));
        let names: Vec<String> = own.filter(|own| own.nominal == 0.0).map(|own| own.name).collect();
        let parameters = site.model.parameters.iter().enumerate();
        let columns: Vec<usize> = parameters
            .filter(|(_, parameter)| names.contains(&parameter.name))
            .map(|(k, _)| k)
            .collect();
        if columns.is_empty() {
            return Err(DesignError::nothing_free(&self.declared));
        }
        Ok(Criterion::Each(columns))
    }

    fn told(&self, poses: &Measurements) -> Result<Separation, DesignError> {
        let [one, other] = &self.effects;
        Ok(separation(&self.plain, poses, [one, other])?)
    }
}

/// How well a plan tells two effects apart, beside random poses.
#[derive(Debug, Clone)]
pub struct Separated {
    /// The effects.
    pub effects: [Effect; 2],
    /// What the plan is made for.
    pub criterion: Criterion,
    /// How well it tells them apart.
    pub planned: Separation,
    /// How well random poses do, each draw by itself.
    pub random: Vec<Separation>,
}

/// Chooses the poses that tell two effects apart best, both effects declared; `options.criterion`
/// is not used.
///
/// # Errors
/// As for [`plan`].
pub fn separate(
    pair: &Pair,
    candidates: &Candidates,
    given: Option<&Measurements>,
    options: &PlanOptions,
) -> Result<(Plan, Separated), DesignError> {
    let PlanOptions { poses, seed, .. } = *options;
    let usual = match candidates {
        Candidates::Within(ranges) => {
            ranges.draw(&pair.declared, DRAWN[0].max(2 * poses), Extremes::No, seed, EVENLY)
        }
        Candidates::Rows(rows) => rows.as_ref().clone(),
    };
    let criterion = pair.criterion(given.unwrap_or(&usual))?;
    let plan = plan(
        &pair.declared,
        candidates,
        given,
        &PlanOptions { criterion: &criterion, ..*options },
    )?;
    let with_given =
        |own: &Measurements| given.map_or_else(|| own.clone(), |given| given.concatenate(own));
    let usual = Site::new(&pair.declared, &[&usual])?.at_rest(&usual).0;
    let random = (0..DRAWS).into_par_iter().map(|draw| {
        pair.told(&with_given(&usual.select(&choose(
            usual.len(),
            poses,
            seed,
            FIRST_DRAW + draw as u64,
        ))))
    });
    let separated = Separated {
        effects: pair.effects.clone(),
        planned: pair.told(&with_given(&plan.poses))?,
        random: random.collect::<Result<_, _>>()?,
        criterion,
    };
    Ok((plan, separated))
}

impl Separated {
    /// The median over random poses of something about a separation; infinite where most of them
    /// say nothing.
    pub fn random(&self, of: impl Fn(&Separation) -> Option<f64>) -> f64 {
        median(self.random.iter().map(|own| of(own).unwrap_or(f64::INFINITY))).unwrap_or(f64::NAN)
    }
}
