//! Identification of effects on arms of several kinds from rows of every kind without a tracker;
//! the same poses measured with a tracker are the control.
//!
//! A case is *distinguishable* if an observer who knows the effect can see it. When declared, it
//! reduces the squares of the fit (priors included) by more than 30. No other effect of the
//! catalogue, each in a separate fit, comes within 6 of that.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use flexcal::fit::{Identification, Options, identify};
use flexcal::measurement::Dataset;
use flexcal::problem::{Effect, Problem};
use flexcal::rig::{Cause, Simulation, Truth, simulate, simulate_poses};
use flexcal::select::{ClosedLoop, Site, Status, close};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::arms::{ARMS, Around, Kind, Lacking, Measured, Strength, WITHOUT_TRACKER};
use crate::common::made::model_of;
use crate::common::reading::read_dataset;

/// Reduction of squares from which an effect is visible.
const SEEN: f64 = 30.0;
/// Difference in squares to the next effect from which an effect is distinguishable.
const APART: f64 = 6.0;

/// Outcome of the loop for one effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Outcome {
    /// The true law at the true place, with probability 0.9 or more.
    Named,
    /// The true law with a lower probability, or among the alternatives.
    Listed,
    /// Only the true place.
    Located,
    /// A wrong law with probability 0.9 or more.
    Wrong,
    /// Another law with a lower probability, or at another place.
    Elsewhere,
    Nothing,
}

/// Result of the loop for one data set.
struct LoopVerdict {
    outcome: Outcome,
    /// Number of wrong laws with probability 0.9 or more.
    ghosts: usize,
    said: String,
}

/// One effect of one arm, measured by one kind of rows and by a tracker.
struct Case {
    arm: &'static str,
    how: Measured,
    is_distinguishable: bool,
    is_distinguishable_to_tracker: bool,
    contacts: LoopVerdict,
    tracker: LoopVerdict,
}

fn sets(otherwise: u64) -> u64 {
    std::env::var("FLEXCAL_SWEEP").ok().and_then(|number| number.parse().ok()).unwrap_or(otherwise)
}

/// Returns Σ r²/σ² of the rows and priors.
fn squares(found: &Identification, problem: &Problem, data: &Dataset) -> f64 {
    let model = model_of(problem, &data.measurements);
    let pull =
        |(k, x): (usize, &f64)| model.parameters[k].sigma.map_or(0.0, |sigma| (x / sigma).powi(2));
    let freedom = found.coordinates as f64
        - found.estimates.iter().map(|estimate| estimate.identified).sum::<f64>();
    found.reduced_chi2.unwrap() * freedom + found.x.iter().enumerate().map(pull).sum::<f64>()
}

/// Returns the reduction of squares by an effect, and its lead over the other effects of the
/// ranking.
fn distinguishable(
    problem: &Problem,
    data: &Dataset,
    truth: &Effect,
    closed: &ClosedLoop,
) -> (f64, f64) {
    let plain = &closed.before.fit;
    let start: Vec<(String, f64)> =
        plain.estimates.iter().map(|estimate| (estimate.name.clone(), estimate.estimate)).collect();
    let with = |effect: &Effect| {
        let problem = problem.with_effect(effect.clone());
        let found = identify(
            &problem,
            data,
            &Options::default().with_start(start.clone()).with_max_steps(10),
        )
        .ok()?;
        Some(squares(&found, &problem, data))
    };
    let without = squares(plain, problem, data);
    let true_cost = with(truth).unwrap();
    let others = closed
        .before
        .ranking
        .iter()
        .map(|ranked| &ranked.effect)
        .filter(|other| !is_the_same(other, truth));
    let others: Vec<Effect> = others.cloned().collect();
    let nearest = others.par_iter().filter_map(with).reduce(|| f64::INFINITY, f64::min);
    (without - true_cost, nearest - true_cost)
}

/// Returns true if family and place agree; a harmonic must contain the true orders.
fn is_the_same(named: &Effect, truth: &Effect) -> bool {
    match (named, truth) {
        (
            Effect::JointHarmonic { joint, orders },
            Effect::JointHarmonic { joint: true_joint, orders: wanted },
        ) => joint == true_joint && wanted.iter().all(|order| orders.contains(order)),
        _ => named == truth,
    }
}

fn judged(problem: &Problem, closed: &ClosedLoop, truth: Option<&Effect>) -> LoopVerdict {
    let part = |effect: &Effect| effect.terms(problem).first().map(|term| Site::of(term.site));
    let is_true = |effect: &Effect| truth.is_some_and(|truth| is_the_same(effect, truth));
    let at_place = |at: Option<Site>| truth.is_some_and(|truth| at.is_some() && part(truth) == at);
    let (named, such): (Vec<_>, Vec<_>) =
        closed.effects.iter().partition(|found| found.status == Status::Found);
    let wrong = named.iter().filter(|found| !is_true(&found.effect)).count();
    let listed = closed.effects.iter().any(|found| {
        found.alternatives.iter().map(|known| &known.0).chain([&found.effect]).any(is_true)
    });
    let structure = || closed.unexplained.iter().filter(|left| left.claims.is_some());
    let outcome = match () {
        () if named.iter().any(|found| is_true(&found.effect)) => Outcome::Named,
        () if wrong > 0 => Outcome::Wrong,
        () if listed => Outcome::Listed,
        () if structure().any(|left| at_place(left.site))
            || such.iter().any(|alternative| at_place(part(&alternative.effect))) =>
        {
            Outcome::Located
        }
        () if structure().next().is_some() || !such.is_empty() => Outcome::Elsewhere,
        () => Outcome::Nothing,
    };
    let place = |effect: &Effect| match effect {
        Effect::JointHarmonic { orders, .. } => format!("{}{orders:?}", effect.name_and_place()),
        _ => effect.name_and_place(),
    };
    let mut said: Vec<String> = Vec::new();
    for found in &closed.effects {
        let law = found.claims.as_ref().map_or(-1.0, |claims| claims.law.1);
        said.push(format!("{} {law:.2}", place(&found.effect)));
        said.extend(found.alternatives.iter().map(|(other, _)| format!("or {}", place(other))));
    }
    for left in structure() {
        let claims = left.claims.as_ref().unwrap();
        let of: Vec<String> = left.depends_on.iter().map(ToString::to_string).collect();
        said.push(format!(
            "{} of {} {:.2} {:?}",
            claims.place.0,
            of.join(" "),
            claims.law.1,
            claims.law.0.kind
        ));
    }
    let chi2 = |found: &Identification| found.reduced_chi2.unwrap_or(f64::NAN);
    let said = format!(
        "{} (χ² {:.2} → {:.2})",
        said.join(", "),
        chi2(&closed.before.fit),
        chi2(&closed.after)
    );
    LoopVerdict { outcome, ghosts: wrong, said }
}

/// Reads the rows of a simulation in a problem.
fn rows(problem: &Problem, simulated: &Simulation) -> Dataset {
    read_dataset(problem, &simulated.csv())
}

/// Returns the text of an effect for TRUTH.toml, with a size from a quarter to twice the listed
/// one.
fn written(effect: Option<&Lacking>, seed: u64) -> (String, f64) {
    let factor = 2.0_f64.powf(ChaCha8Rng::seed_from_u64(seed ^ 0x517e).random_range(-2.0..1.0));
    let line = |&(key, value): &Strength| format!("{key} = {}\n", value * factor);
    let text = effect.map(|(effect, values)| {
        format!("[[effect]]\n{effect}\n{}", values.iter().map(line).collect::<String>())
    });
    (text.unwrap_or_default(), factor)
}

fn one(arm: &Kind, (how, count): (Measured, usize), effect: Option<&Lacking>, seed: u64) -> Case {
    let (text, factor) = written(effect, seed);
    let nothing = arm.around(Measured::Positions, seed);
    let bare = arm.problem(Measured::Positions, &nothing);
    let truth_of = |how: Measured, around: &Around, problem: &Problem| -> Truth {
        Truth::parse(&arm.truth(how, around, &text), Path::new("truth.toml"), problem).unwrap()
    };
    let name = format!(
        "{} {how:?} {} ×{factor:.2} seed {seed}",
        arm.name,
        effect.map_or("nothing", |kind| kind.0)
    );
    // The true arm may not reach positions of the nominal one: then others are drawn.
    let (problem, contacts) = (0..10)
        .find_map(|attempt| {
            let around = arm.around(how, seed + 100_000 * attempt);
            let problem = arm.problem(how, &around);
            let contacts =
                simulate(&problem, &truth_of(how, &around, &problem), count, seed).ok()?;
            Some((problem, contacts))
        })
        .unwrap();
    let poses =
        contacts.rows.iter().map(|row| (row.conditions.clone(), row.target.clone())).collect();
    let tracker =
        simulate_poses(&bare, &truth_of(Measured::Positions, &nothing, &bare), poses, seed)
            .unwrap();
    let lacking = contacts.truth.effects.first().and_then(|effect| match effect.cause() {
        Cause::Catalogued(effect) => Some(effect.clone()),
        _ => None,
    });
    let all = [(&problem, &contacts), (&bare, &tracker)].map(|(problem, simulated)| {
        let data = rows(problem, simulated);
        let closed = close(problem, &data, &Options::default()).unwrap();
        let apart = lacking.as_ref().map(|truth| distinguishable(problem, &data, truth, &closed));
        (judged(problem, &closed, lacking.as_ref()), apart)
    });
    let [(contacts, by_contacts), (tracker, by_tracker)] = all;
    let shown =
        |apart: Option<(f64, f64)>| apart.is_some_and(|(seen, apart)| seen > SEEN && apart > APART);
    let figures =
        |apart: Option<(f64, f64)>| apart.map_or(String::new(), |(a, b)| format!("{a:.0}, {b:.0}"));
    println!(
        "{name}\n    contacts [{}] {:?}: {}\n    tracker  [{}] {:?}: {}",
        figures(by_contacts),
        contacts.outcome,
        contacts.said,
        figures(by_tracker),
        tracker.outcome,
        tracker.said
    );
    Case {
        arm: arm.name,
        how,
        is_distinguishable: shown(by_contacts),
        is_distinguishable_to_tracker: shown(by_tracker),
        contacts,
        tracker,
    }
}

/// Counts of data sets: total, distinguishable, and of these named, listed, located, wrong,
/// elsewhere, nothing.
#[derive(Default, Clone)]
struct Row {
    sets: usize,
    shown: usize,
    of_shown: BTreeMap<Outcome, usize>,
    ghosts: usize,
}

impl Row {
    fn add(&mut self, is_shown: bool, judged: &LoopVerdict) {
        self.sets += 1;
        if is_shown {
            self.shown += 1;
            *self.of_shown.entry(judged.outcome).or_default() += 1;
        }
        self.ghosts += usize::from(judged.ghosts > 0);
    }

    fn count(&self, outcome: Outcome) -> usize {
        self.of_shown.get(&outcome).copied().unwrap_or(0)
    }

    fn line(&self) -> String {
        use Outcome::{Elsewhere, Listed, Located, Named, Nothing, Wrong};
        let counts = [Named, Listed, Located, Elsewhere, Nothing, Wrong]
            .map(|outcome| self.count(outcome).to_string());
        format!("{} | {} | {} | {}", self.sets, self.shown, counts.join(" | "), self.ghosts)
    }
}

/// Runs every effect of every arm, and none, for each seed, and prints a table. `FLEXCAL_ONLY`
/// restricts the names.
fn run(seeds: Range<u64>) -> (Row, Row) {
    let only = std::env::var("FLEXCAL_ONLY").unwrap_or_default();
    let mut work = Vec::new();
    for seed in seeds {
        for (a, arm) in (0..).zip(&ARMS) {
            for (e, effect) in (0..).zip(arm.effects.iter().map(Some).chain([None])) {
                // The way of measuring changes with the seed, so that six seeds cover all of them.
                let measured =
                    WITHOUT_TRACKER[usize::try_from(a + e + seed).unwrap() % WITHOUT_TRACKER.len()];
                let name = format!(
                    "{} {:?} {}",
                    arm.name,
                    measured.0,
                    effect.map_or("nothing", |kind| kind.0)
                );
                if only.split(',').all(|word| name.contains(word)) {
                    work.push((arm, measured, effect, 10_000 * seed + 1000 * a + e));
                }
            }
        }
    }
    let all: Vec<(Case, bool)> = work
        .into_par_iter()
        .map(|(arm, measured, effect, seed)| (one(arm, measured, effect, seed), effect.is_some()))
        .collect();
    let (mut rows, mut quiet): (BTreeMap<String, [Row; 2]>, [Row; 2]) =
        (BTreeMap::new(), Default::default());
    let mut total: [Row; 2] = Default::default();
    for (case, has_effect) in &all {
        let both = [
            (case.is_distinguishable, &case.contacts),
            (case.is_distinguishable_to_tracker, &case.tracker),
        ];
        for (k, (shown, judged)) in both.into_iter().enumerate() {
            if *has_effect {
                for key in [format!("arm {}", case.arm), format!("rows {:?}", case.how)] {
                    rows.entry(key).or_default()[k].add(shown, judged);
                }
                total[k].add(shown, judged);
            } else {
                quiet[k].add(true, judged);
            }
        }
    }
    println!(
        "which | sets | distinguishable | named | listed | located | elsewhere | nothing | wrong law | with a ghost"
    );
    for (key, [contacts, tracker]) in &rows {
        println!("{key} | {}\n    tracker | {}", contacts.line(), tracker.line());
    }
    println!("all | {}\n    tracker | {}", total[0].line(), total[1].line());
    println!("no effect | {}\n    tracker | {}", quiet[0].line(), quiet[1].line());
    let [contacts, _] = total;
    let [quiet, _] = quiet;
    (contacts, quiet)
}

#[test]
fn an_effect_is_named_and_nothing_else() {
    let arm = |name: &str| ARMS.iter().find(|arm| arm.name == name).unwrap();
    let cases = [
        (arm("elbow"), (Measured::Wires, 200), Some(0), 100),
        (arm("elbow"), (Measured::Tilts, 150), Some(3), 3),
        // The x axis of the third frame is vertical, where its tilt has no derivative.
        (arm("gantry"), (Measured::Tilts, 150), Some(1), 54001),
        // A prismatic joint that alone moves along its axis: at each socket its commands differ
        // by noise only.
        (arm("scara"), (Measured::Sockets, 120), None, 3007),
    ];
    cases.into_par_iter().for_each(|(arm, measured, effect, seed)| {
        let case = one(arm, measured, effect.map(|effect: usize| &arm.effects[effect]), seed);
        let expected = if effect.is_some() { Outcome::Named } else { Outcome::Nothing };
        assert_eq!(
            (case.contacts.outcome, case.contacts.ghosts),
            (expected, 0),
            "{}",
            case.contacts.said
        );
    });
}

/// `cargo test --release --test observations -- --ignored --nocapture effects_are_named`
#[test]
#[ignore = "a study of an hour"]
fn effects_are_named_without_a_tracker() {
    let first = std::env::var("FLEXCAL_FIRST").map_or(0, |seed| seed.parse().unwrap());
    let (lacking, quiet) = run(first..first + sets(6));
    let named = lacking.count(Outcome::Named);
    assert!(10 * named >= 9 * lacking.shown, "{named} of {}", lacking.shown);
    assert!(lacking.ghosts * 100 <= 2 * lacking.sets, "{} of {}", lacking.ghosts, lacking.sets);
    assert!(quiet.ghosts * 50 <= quiet.sets, "{} of {}", quiet.ghosts, quiet.sets);
}
