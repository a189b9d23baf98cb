//! Plan of poses whose measurements distinguish two effects.

use rayon::prelude::*;

use super::drawn::{DRAWN_CANDIDATES, UNIFORM_STREAM};
use super::plan::{RANDOM_SET_STREAM, RANDOM_SETS, choose, fitted_rows, plan_beside};
use super::{Candidates, Criterion, DesignError, Extremes, Plan, PlanOptions, Site};
use crate::measurement::Measurements;
use crate::numeric::median;
use crate::problem::{Effect, EffectDeclaration, Problem};
use crate::select::{Separation, separation};

/// Two effects whose parameters are to be distinguished, with a problem that declares both.
#[derive(Debug, Clone)]
pub struct EffectPair {
    /// The two effects that the measurements are to tell apart.
    pub effects: [Effect; 2],
    /// Problem without the two effects.
    pub plain: Problem,
    /// Problem with both effects.
    pub declared: Problem,
}

impl EffectPair {
    /// Creates a pair of effects that `problem` does not declare. Both problems of the pair contain
    /// only measured positions.
    ///
    /// # Errors
    /// Returns an error if the effects are equal, if one is already declared, or if one depends on
    /// time instead of the poses.
    pub fn new(problem: &Problem, pair: [EffectDeclaration; 2]) -> Result<Self, DesignError> {
        let [first, second] = &pair;
        let compensated = first.effect.compensated();
        if first.effect == second.effect
            || (compensated.is_some() && compensated == second.effect.compensated())
        {
            return Err(DesignError::SameEffect { effect: first.effect.describe() });
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

    /// Returns the criterion: the errors of the parameters of both effects, with all other free
    /// parameters estimated. The smaller these errors, the better the data distinguish the effects.
    /// Parameters without a size, such as the position of a mass, do not count.
    ///
    /// # Errors
    /// Returns the errors of [`Site::new`], or an error if rules of `[parameters]` fix both
    /// effects.
    fn criterion(&self, poses: &Measurements) -> Result<Criterion, DesignError> {
        let site = Site::new(&self.declared, &[poses])?;
        let parameters = self.effects.iter().flat_map(|effect| effect.parameters(&self.declared));
        let sized = parameters.filter(|parameter| parameter.nominal == 0.0);
        let names: Vec<String> = sized.map(|parameter| parameter.name).collect();
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

    /// Returns how well the measurement of these poses distinguishes the effects.
    fn separation(&self, poses: &Measurements) -> Result<Separation, DesignError> {
        let [first, second] = &self.effects;
        Ok(separation(&self.plain, poses, [first, second])?)
    }
}

/// Comparison of a plan and random sets of poses: how well each distinguishes two effects.
#[derive(Debug, Clone)]
pub struct PairSeparation {
    /// Both effects of the pair.
    pub effects: [Effect; 2],
    /// Criterion that the plan minimises.
    pub criterion: Criterion,
    /// Separation of the two effects by the planned poses.
    pub planned: Separation,
    /// Separation of the two effects by each random set of as many poses.
    pub random: Vec<Separation>,
}

/// Chooses the poses that distinguish two effects best. The plan is for the problem with both
/// effects declared, and `options.criterion` is not used.
///
/// # Errors
/// Returns the errors of [`super::plan()`], or an error if no pose distinguishes the effects.
pub fn separate(
    pair: &EffectPair,
    candidates: &Candidates,
    given: Option<&Measurements>,
    options: &PlanOptions,
) -> Result<(Plan, PairSeparation), DesignError> {
    let PlanOptions { poses, seed, .. } = *options;
    let uniform = match candidates {
        Candidates::Within(ranges) => {
            let count = DRAWN_CANDIDATES[0].max(2 * poses);
            ranges.draw(&pair.declared, count, Extremes::No, seed, UNIFORM_STREAM)
        }
        Candidates::Rows(rows) => rows.as_ref().clone(),
    };
    let fitted = fitted_rows(&pair.declared, given);
    let given = fitted.as_ref().map(|(rows, _)| rows);
    let with_given =
        |rows: &Measurements| given.map_or_else(|| rows.clone(), |given| given.concatenate(rows));
    let criterion = pair.criterion(given.unwrap_or(&uniform))?;
    let uniform = Site::new(&pair.declared, &[&uniform])?.in_equilibrium(&uniform).0;
    if pair.separation(&with_given(&uniform))?.is_alike() {
        return Err(DesignError::CausesAlike {
            effects: pair.effects.each_ref().map(Effect::describe),
        });
    }
    let options = PlanOptions { criterion: &criterion, ..*options };
    let plan = plan_beside(&pair.declared, candidates, fitted.as_ref(), &options)?;
    let random = (0..RANDOM_SETS).into_par_iter().map(|set| {
        let rows = choose(uniform.len(), poses, seed, RANDOM_SET_STREAM + set as u64);
        pair.separation(&with_given(&uniform.select(&rows)))
    });
    let separated = PairSeparation {
        effects: pair.effects.clone(),
        planned: pair.separation(&with_given(&plan.poses))?,
        random: random.collect::<Result<_, _>>()?,
        criterion,
    };
    Ok((plan, separated))
}

impl PairSeparation {
    /// Returns the median over the random sets of the quantity that `of` returns; infinite if more
    /// than half of the sets lack it.
    pub fn random(&self, of: impl Fn(&Separation) -> Option<f64>) -> f64 {
        let values = self.random.iter().map(|separation| of(separation).unwrap_or(f64::INFINITY));
        median(values).unwrap_or(f64::NAN)
    }
}
