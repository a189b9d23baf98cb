//! Calibration of the stated probabilities, and false alarms on several kinds of noise: `cargo test
//! --release --test sweep calibration -- --ignored --nocapture`; `FLEXCAL_SWEEP=1
//! FLEXCAL_FIRST=5027` evaluates one set.

use flexcal::fit::Options;
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::{Effect, Problem};
use flexcal::select::{Site, Status, Verdict, close};
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal, StudentT};
use rayon::prelude::*;

use crate::bench::{LARGE, SIGMA, SMALL, Size, lunar, noiseless};
use crate::families::{Lacking, catalogue, newest};
use crate::full::{first, sets};
use crate::judged::{LoopVerdict, Place, is_the_same, name, named};

/// Probability from which an effect counts as found.
const STATED: f64 = 0.9;

/// Statement with its probability; true if it is correct.
type Statement = (f64, bool);

/// Draws one to three effects of different families, the first from `first`, the others from the
/// catalogue.
fn drawn(first: &[Lacking], seed: u64) -> Vec<Lacking> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (others, count) = (catalogue(), rng.random_range(1..=3));
    let mut chosen: Vec<Lacking> = Vec::new();
    while chosen.len() < count {
        let all = if chosen.is_empty() { first } else { &others };
        let mut one = all[rng.random_range(0..all.len())].clone();
        // The size is between half and twice the listed one.
        let factor = 2.0_f64.powf(rng.random_range(-1.0..1.0));
        let is_size = !matches!(one.effect, Effect::UnmodelledMass { .. });
        one.values
            .iter_mut()
            .take(if is_size { usize::MAX } else { 1 })
            .for_each(|value| *value *= factor);
        if !chosen.iter().any(|known| known.effect.name() == one.effect.name()) {
            chosen.push(one);
        }
    }
    chosen
}

pub struct Set {
    laws: Vec<Statement>,
    places: Vec<Statement>,
    shown: usize,
    named: usize,
    stated: usize,
    ghosts: usize,
    exact: bool,
    close: [bool; 2],
}

fn judge(first: &[Lacking], seed: u64) -> Set {
    let lacking = drawn(first, seed);
    let size = [SMALL, Size { identification: 60, held_out: 50 }, LARGE][(seed % 3) as usize];
    let judged = LoopVerdict::of(&lacking, size, seed);
    println!("{}", judged.line(&name(&lacking), size, seed));
    let effects: Vec<Effect> = lacking.into_iter().map(|one| one.effect).collect();
    Set::of(&judged, &effects, (&lunar(), seed))
}

impl Set {
    /// Returns the statements on the data of a problem, with the true effects.
    pub fn of(judged: &LoopVerdict, truth: &[Effect], (problem, seed): (&Problem, u64)) -> Self {
        if std::env::var_os("FLEXCAL_FIRST").is_some() {
            for found in &judged.closure.effects {
                let others: Vec<String> =
                    found.alternatives.iter().map(|(other, _)| named(other)).collect();
                println!(
                    "  {} instead of {}: {:?}",
                    named(&found.effect),
                    others.join(", "),
                    found.claims
                );
            }
        }
        if let Some(flag) = judged.closure.after.first_error() {
            println!("  {seed} is not to be trusted: {flag}");
        }
        let true_law =
            |effect: &Effect| truth.iter().any(|true_effect| is_the_same(effect, true_effect));
        let found = &judged.closure.effects;
        let part = |effect: &Effect| effect.terms(problem).first().map(|term| Site::of(term.site));
        let true_place =
            |place: Site| truth.iter().any(|true_effect| part(true_effect) == Some(place));
        let claims = || found.iter().filter_map(|found| Some((found, found.claims.as_ref()?)));
        let others = judged.closure.unexplained.iter().filter_map(|left| left.claims.as_ref());
        let [shown, named, stated] = judged.counts();
        let stands = found.iter().filter(|found| found.status == Status::Found);
        Self {
            laws: claims().map(|(found, claims)| (claims.law.1, true_law(&found.effect))).collect(),
            places: claims()
                .map(|(_, claims)| claims)
                .chain(others)
                .map(|claims| (claims.place.1, true_place(claims.place.0)))
                .collect(),
            shown,
            named,
            stated,
            ghosts: stands.filter(|found| !true_law(&found.effect)).count(),
            exact: judged
                .places
                .iter()
                .zip(&judged.chance)
                .all(|(place, chance)| *place == Place::Found || *chance > 1e-4)
                && found.iter().all(|found| true_law(&found.effect)),
            close: [judged.best, judged.alike].map(|truth| judged.after < 1.25 * truth),
        }
    }
}

#[test]
#[ignore = "minutes"]
fn what_is_stated_is_as_true_as_it_is_probable() {
    calibrated(|seed| judge(&catalogue(), seed), 5000, 300);
}

#[test]
#[ignore = "minutes"]
fn what_is_stated_of_the_newest_effects() {
    calibrated(|seed| judge(&newest(), seed), 7000, 120);
}

/// Evaluates `count` sets from a seed on, and prints how often statements are true at their
/// probabilities.
pub fn calibrated(judge: impl Fn(u64) -> Set + Sync + Send, seed: u64, count: u64) {
    let begin = first(seed);
    let all: Vec<Set> = (begin..begin + sets(count)).into_par_iter().map(judge).collect();
    let count = |of: &dyn Fn(&Set) -> usize| all.iter().map(of).sum::<usize>();
    let bins = [(0.0, 0.5), (0.5, 0.8), (0.8, 0.9), (0.9, 0.95), (0.95, 0.99), (0.99, 1.01)];
    for (what, statements) in [
        ("law", &(|set: &Set| set.laws.clone()) as &dyn Fn(&Set) -> Vec<Statement>),
        ("place", &|set| set.places.clone()),
    ] {
        for (low, high) in bins {
            let within: Vec<Statement> =
                all.iter().flat_map(statements).filter(|(p, _)| (low..high).contains(p)).collect();
            let right = within.iter().filter(|(_, right)| *right).count();
            println!("{what} {low} to {high}: {right} of {} true", within.len());
        }
    }
    let (shown, named, stated) =
        (count(&|set| set.shown), count(&|set| set.named), count(&|set| set.stated));
    let part = |of: &dyn Fn(&Set) -> bool| all.iter().filter(|set| of(set)).count();
    println!("{shown} distinguishable, {named} named, {stated} named or stated as alternatives");
    println!(
        "{} of {} sets exact, {} with a ghost, {} within 1.25 of the truth declared and stiffnesses apart, {} with them as declared",
        part(&|set| set.exact),
        all.len(),
        part(&|set| set.ghosts > 0),
        part(&|set| set.close[0]),
        part(&|set| set.close[1])
    );
    let sure: Vec<Statement> =
        all.iter().flat_map(|set| set.laws.clone()).filter(|(p, _)| *p >= STATED).collect();
    let right = sure.iter().filter(|(_, right)| *right).count();
    assert!(100 * right >= 95 * sure.len(), "{right} of {} laws that were stated", sure.len());
}

/// Kind of noise that differs from the declared one.
#[derive(Debug, Clone, Copy)]
enum Kind {
    White,
    HeavyTails,
    Correlated,
    Outliers,
    FiveTimes,
    Fifth,
    JointReadings,
    ThreePoints,
}

/// Adds the noise, reproducibly for a seed.
fn disturbed(data: Dataset, kind: Kind, seed: u64) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
    let Dataset { mut measurements, mut split } = data;
    if let Kind::ThreePoints = kind {
        let kept: Vec<usize> = (0..measurements.len()).collect();
        let thrice: Vec<usize> = kept.iter().flat_map(|&row| [row; 3]).collect();
        measurements = measurements.select(&thrice);
        let rows = |rows: Vec<usize>| {
            rows.into_iter().flat_map(|row| [3 * row, 3 * row + 1, 3 * row + 2]).collect()
        };
        split = flexcal::measurement::Split {
            identification: rows(split.identification),
            held_out: rows(split.held_out),
        };
    }
    let normal = |rng: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(rng) };
    let three = |rng: &mut ChaCha8Rng, of: &dyn Fn(&mut ChaCha8Rng) -> f64| {
        Vector3::from_fn(|_, _| of(rng))
    };
    let (mut last, mut shared) = (three(&mut rng, &normal), Vector3::zeros());
    for row in 0..measurements.len() {
        let white = three(&mut rng, &normal);
        let noise = match kind {
            Kind::HeavyTails => {
                three(&mut rng, &|rng| StudentT::new(3.0).unwrap().sample(rng) / 3.0_f64.sqrt())
            }
            Kind::Correlated => {
                last = last * 0.8 + white * 0.6;
                last
            }
            Kind::Outliers if rng.random_bool(0.03) => white * 50.0,
            Kind::White | Kind::JointReadings | Kind::Outliers => white,
            Kind::FiveTimes => white * 5.0,
            Kind::Fifth => white / 5.0,
            Kind::ThreePoints => {
                if row % 3 == 0 {
                    shared = three(&mut rng, &normal);
                }
                shared * 0.4_f64.sqrt() + white * 0.6_f64.sqrt()
            }
        };
        measurements.positions[row] += noise * SIGMA;
        if let Kind::JointReadings = kind {
            let joints = measurements.joints;
            for q in &mut measurements.configurations[row * joints..(row + 1) * joints] {
                *q += 0.003_f64.to_radians() * normal(&mut rng);
            }
        }
    }
    Dataset::new(Measurements { ..measurements }, split)
}

#[test]
#[ignore = "minutes"]
fn noise_of_many_kinds_is_no_effect() {
    let problem = lunar();
    let kinds = [
        Kind::White,
        Kind::HeavyTails,
        Kind::Correlated,
        Kind::Outliers,
        Kind::FiveTimes,
        Kind::Fifth,
        Kind::JointReadings,
        Kind::ThreePoints,
    ];
    for kind in kinds {
        let one = |seed: u64| {
            let size = if seed.is_multiple_of(2) {
                SMALL
            } else {
                Size { identification: 60, held_out: 20 }
            };
            let closure = close(
                &problem,
                &disturbed(noiseless(size, seed).data, kind, seed),
                &Options::default(),
            )
            .unwrap();
            let named =
                closure.effects.iter().filter(|found| found.status == Status::Found).count();
            let such = closure.effects.len() - named;
            let located = closure.unexplained.iter().any(|left| left.claims.is_some());
            let names: Vec<String> =
                closure.effects.iter().map(|found| crate::judged::named(&found.effect)).collect();
            let left: Vec<String> =
                closure.unexplained.iter().map(crate::judged::located).collect();
            if closure.verdict != Verdict::NothingFound {
                println!("{kind:?} {seed}: {names:?} {left:?}");
            }
            [
                usize::from(named > 0),
                usize::from(such > 0),
                usize::from(located),
                usize::from(closure.verdict != Verdict::NothingFound),
            ]
        };
        let (begin, count) = (first(6000), sets(100));
        let sums = (begin..begin + count)
            .into_par_iter()
            .map(one)
            .reduce(|| [0; 4], |a, b| [0, 1, 2, 3].map(|k| a[k] + b[k]));
        println!(
            "{kind:?}: of {count} sets {} name an effect, {} one such as, {} locate structure, {} are not nothing-found",
            sums[0], sums[1], sums[2], sums[3]
        );
        let most =
            if let Kind::White = kind { count.div_ceil(100) + 1 } else { count * 3 / 100 + 2 };
        assert!(sums[0] as u64 <= most, "{kind:?}: {} of {count}", sums[0]);
    }
}
