//! One data set through the loop, with the result compared with the truth.

use flexcal::fit::{Identification, Options, identify};
use flexcal::problem::{Effect, EffectDeclaration, Problem};
use flexcal::residual_tests::Covariate;
use flexcal::select::{ClosedLoop, Unexplained, Verdict, close};
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use crate::bench::{NOISE, SIGMA, Set, Size, measured};
use crate::common::made::model_of;
use crate::families::{Lacking, declared};

/// Probability by chance above which an effect is not distinguishable, even for an observer who
/// knows it.
const DISTINGUISHABLE: f64 = 1e-4;

/// Place of a true effect in the result of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Among the effects found.
    Found,
    /// Among the alternatives to an effect found.
    Alternative,
    /// Absent, although other effects were found.
    Confused,
    /// Absent, and no effect was found.
    Missed,
}

/// Data set with the result of the loop.
pub struct LoopVerdict {
    pub closure: ClosedLoop,
    /// Place of each true effect.
    pub places: Vec<Place>,
    /// True if the first effect found is the true one.
    pub first: bool,
    /// Probability by chance of the gain from declaring each true effect after all others.
    pub chance: Vec<f64>,
    /// Held-out rms position error relative to that of the noise: before, after, and with the true
    /// effects declared.
    pub before: f64,
    pub after: f64,
    pub best: f64,
    /// Error with the problem as declared, with equal `EI_y` and `EI_z`.
    pub alike: f64,
}

impl LoopVerdict {
    /// Runs the loop on one set.
    pub fn of(lacking: &[Lacking], size: Size, seed: u64) -> Self {
        let on_the_rig: Vec<_> = lacking.iter().filter_map(Lacking::on_the_rig).collect();
        let set = measured(&on_the_rig, size, seed);
        let all: Vec<Effect> = lacking.iter().map(|one| one.effect.clone()).collect();
        Self::with(declared(lacking), &set, &all)
    }

    /// Runs the loop on a set of another problem that lacks the effects `all`.
    pub fn with(problem: Problem, set: &Set, all: &[Effect]) -> Self {
        let closure = close(&problem, &set.data, &Options::default()).unwrap();
        let full = Squares::of(&problem, all, set);
        let without = |k: usize| {
            let others: Vec<Effect> = all
                .iter()
                .enumerate()
                .filter(|(other, _)| *other != k)
                .map(|(_, effect)| effect.clone())
                .collect();
            Squares::of(&problem, &others, set).chance_beside(&full)
        };
        let found: Vec<&Effect> = closure.effects.iter().map(|found| &found.effect).collect();
        let others: Vec<&Effect> = closure
            .effects
            .iter()
            .flat_map(|found| &found.alternatives)
            .map(|known| &known.0)
            .collect();
        let place = |truth: &Effect| match () {
            () if found.iter().any(|effect| is_the_same(effect, truth)) => Place::Found,
            () if others.iter().any(|effect| is_the_same(effect, truth)) => Place::Alternative,
            () if found.is_empty() => Place::Missed,
            () => Place::Confused,
        };
        let ratio = |found: &Identification| found.fitted.held_out.rms.norm / NOISE;
        Self {
            places: all.iter().map(place).collect(),
            first: found
                .first()
                .is_some_and(|effect| all.iter().any(|truth| is_the_same(effect, truth))),
            chance: (0..all.len()).map(without).collect(),
            before: ratio(&closure.before.fit),
            after: ratio(&closure.after),
            best: full.held_out / NOISE,
            alike: ratio(&identify(&with(problem, all), &set.data, &Options::default()).unwrap()),
            closure,
        }
    }

    /// Returns the number of true effects that are distinguishable, and of those named, and named
    /// or listed as alternatives.
    pub fn counts(&self) -> [usize; 3] {
        let shown =
            self.places.iter().zip(&self.chance).filter(|(_, chance)| **chance < DISTINGUISHABLE);
        let places: Vec<Place> = shown.map(|(place, _)| *place).collect();
        let named = places.iter().filter(|place| **place == Place::Found).count();
        let stated = places
            .iter()
            .filter(|place| matches!(place, Place::Found | Place::Alternative))
            .count();
        [places.len(), named, stated]
    }

    /// Returns the figures as one line.
    pub fn line(&self, name: &str, size: Size, seed: u64) -> String {
        let names = |effects: &mut dyn Iterator<Item = &Effect>| {
            effects.map(named).collect::<Vec<_>>().join(" + ")
        };
        let closure = &self.closure;
        let cause = closure.unexplained.first().map_or_else(String::new, located);
        let failed: Vec<String> = closure
            .residual_tests
            .tests
            .iter()
            .filter(|check| check.failed())
            .map(|check| format!("{} {}", check.name(), words(check.about().as_slice())))
            .collect();
        let p: Vec<String> = self.chance.iter().map(|p| format!("{p:.1e}")).collect();
        let best_p = closure.before.ranking.iter().map(|ranked| ranked.p_value).fold(1.0, f64::min);
        let verdict = match closure.verdict {
            Verdict::NothingFound => "nothing",
            Verdict::Explained => "explained",
            Verdict::Unexplained => "unexplained",
        };
        format!(
            "{name};{};{seed};{:?};{};{};{verdict};{};{};{};{};{:.3};{:.3};{:.3};{:.3};{:.2e};{:.1e}",
            size.identification,
            self.places,
            u8::from(self.first),
            p.join(" "),
            names(&mut closure.effects.iter().map(|found| &found.effect)),
            names(
                &mut closure
                    .effects
                    .iter()
                    .flat_map(|found| &found.alternatives)
                    .map(|known| &known.0)
            ),
            cause,
            failed.join(", "),
            self.before,
            self.after,
            self.best,
            self.alike,
            best_p,
            closure.effects.iter().map(|found| found.p_value).fold(0.0, f64::max),
        )
    }
}

/// Sum of squares of a fit with some effects declared, with the quantities of its comparison.
struct Squares {
    sum: f64,
    freedom: f64,
    parameters: usize,
    held_out: f64,
}

impl Squares {
    /// Fits as an observer who knows the arm: `EI_y` and `EI_z` are separate.
    fn of(problem: &Problem, effects: &[Effect], set: &Set) -> Self {
        let mut problem = problem.clone();
        for beam in problem.joints.iter_mut().filter_map(|joint| joint.beam.as_mut()) {
            beam.ei_z = beam.ei_y.map(|ei| ei * (1.0 + 1e-12));
        }
        let problem = with(problem, effects);
        let found = identify(&problem, &set.data, &Options::default()).unwrap();
        let errors = found.fitted.identification;
        let model = model_of(&problem, &set.data.measurements);
        let pull = |(k, x): (usize, &f64)| {
            model.parameters[k].sigma.map_or(0.0, |sigma| (x / sigma).powi(2))
        };
        let priors = found.x.iter().enumerate().map(pull);
        let given: f64 = found.estimates.iter().map(|estimate| estimate.identified).sum();
        Self {
            sum: errors.n as f64 * (errors.rms.norm / SIGMA).powi(2) + priors.sum::<f64>(),
            freedom: found.coordinates as f64 - given,
            parameters: found.unknowns.len(),
            held_out: found.fitted.held_out.rms.norm,
        }
    }

    /// Returns the p value of the F test for the additional effects of `full`.
    fn chance_beside(&self, full: &Self) -> f64 {
        let more = full.parameters.saturating_sub(self.parameters).max(1) as f64;
        let f = (self.sum - full.sum).max(0.0) / more / (full.sum / full.freedom);
        FisherSnedecor::new(more, full.freedom).unwrap().sf(f)
    }
}

/// Declares effects in a problem.
fn with(mut problem: Problem, effects: &[Effect]) -> Problem {
    let location = problem.data.location.clone();
    let declare =
        |effect: &Effect| EffectDeclaration { effect: effect.clone(), location: location.clone() };
    problem.effects = effects.iter().map(declare).collect();
    problem
}

/// Returns true if a named effect is the true one: equal family and place, orders contained, orders
/// of waves within a third of a cycle, times within a few poses, time constants and distances
/// within a factor of two.
pub fn is_the_same(named: &Effect, truth: &Effect) -> bool {
    let within_two = |one: &f64, other: &f64| (one / other).ln().abs() < std::f64::consts::LN_2;
    match (named, truth) {
        (
            Effect::JointWave { joint, order },
            Effect::JointWave { joint: true_joint, order: wanted },
        ) => joint == true_joint && (order - wanted).abs() < 1.0 / 3.0,
        (
            Effect::JointHysteresis { joint, distance },
            Effect::JointHysteresis { joint: true_joint, distance: wanted },
        ) => joint == true_joint && within_two(distance, wanted),
        (
            Effect::JointThermalDriftLag { joint, time_constant },
            Effect::JointThermalDriftLag { joint: true_joint, time_constant: wanted },
        ) => joint == true_joint && within_two(time_constant, wanted),
        (
            Effect::LinkThermalBendingLag { link, time_constant },
            Effect::LinkThermalBendingLag { link: true_link, time_constant: wanted },
        )
        | (
            Effect::LinkThermalExpansionLag { link, time_constant },
            Effect::LinkThermalExpansionLag { link: true_link, time_constant: wanted },
        ) => link == true_link && within_two(time_constant, wanted),
        (
            Effect::JointHarmonic { joint, orders },
            Effect::JointHarmonic { joint: true_joint, orders: wanted },
        ) => joint == true_joint && wanted.iter().all(|order| orders.contains(order)),
        (Effect::StationShift { at_time }, Effect::StationShift { at_time: true_time }) => {
            (at_time - true_time).abs() < 900.0
        }
        (
            Effect::TrackerSettling { time_constant },
            Effect::TrackerSettling { time_constant: true_constant },
        ) => within_two(time_constant, true_constant),
        _ => named == truth,
    }
}

/// Returns name, place and orders of an effect.
pub fn named(effect: &Effect) -> String {
    let orders = match effect {
        Effect::JointHarmonic { orders, .. } => format!("{orders:?}"),
        _ => String::new(),
    };
    format!("{} {}{orders}", effect.name(), effect.place()).trim().to_owned()
}

/// Returns the effects that a set lacks, with values.
pub fn name(lacking: &[Lacking]) -> String {
    let one = |one: &Lacking| format!("{} {:?}", named(&one.effect), one.values);
    lacking.iter().map(one).collect::<Vec<_>>().join(" & ")
}

/// Returns covariates by name, separated by spaces.
pub fn words(covariates: &[Covariate]) -> String {
    covariates.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

/// Returns the place of unexplained structure, and the covariates it depends on.
pub fn located(left: &Unexplained) -> String {
    let place = left.site.map_or_else(|| "nowhere".to_owned(), |part| part.to_string());
    format!("{place} {} p {:.1e}", words(&left.depends_on), left.p_value)
}
