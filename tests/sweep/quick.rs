//! Representative part of the sweep, and the cases of `tests/cases`.

use flexcal::fit::{Options, identify};
use flexcal::measurement::Dataset;
use flexcal::problem::{Effect, EffectDeclaration};
use flexcal::residual_tests::Covariate;
use flexcal::rig::Shape;
use flexcal::select::{Site, Verdict, close};
use rayon::prelude::*;

use crate::bench::{NOISE, SMALL, lunar};
use crate::common::arms::measured as read;
use crate::families::{Lacking, catalogue, pairs};
use crate::judged::{LoopVerdict, is_the_same, name};
use crate::outside::Left;

/// Number of sets with noise only.
const QUIET: u64 = 12;

#[test]
fn noise_alone_says_nothing() {
    let one = |seed| (seed, LoopVerdict::of(&[], SMALL, seed));
    let all: Vec<(u64, LoopVerdict)> = (600..600 + QUIET).into_par_iter().map(one).collect();
    let wrong: Vec<String> = all
        .iter()
        .filter(|(_, judged)| judged.closure.verdict != Verdict::NothingFound)
        .map(|(seed, judged)| judged.line("noise alone", SMALL, *seed))
        .collect();
    // At a rate of 5 %, three or more of 12 occur once in 50 times.
    assert!(wrong.len() <= 2, "{wrong:#?}");
}

/// Runs the loop on sets that lack effects; returns the numbers of true effects that are
/// distinguishable, named, and named or alternatives.
fn named_of(kinds: &[Vec<Lacking>], seed: u64) -> [usize; 3] {
    let one = |(k, kind): (usize, &Vec<Lacking>)| {
        let seed = seed + k as u64;
        let judged = LoopVerdict::of(kind, SMALL, seed);
        println!("{}", judged.line(&name(kind), SMALL, seed));
        assert!(
            judged.after < judged.before + 1.0,
            "{}: {} from {}",
            name(kind),
            judged.after,
            judged.before
        );
        judged.counts()
    };
    kinds
        .par_iter()
        .enumerate()
        .map(one)
        .reduce(|| [0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]])
}

#[test]
fn one_effect_is_named() {
    let every_fifth: Vec<Vec<Lacking>> =
        catalogue().into_iter().step_by(5).map(|one| vec![one]).collect();
    let [shown, named, stated] = named_of(&every_fifth, 700);
    println!("{shown} distinguishable, {named} named, {stated} named or stated as alternatives");
    assert!(shown >= 7);
    assert!(10 * named >= 8 * shown && 10 * stated >= 9 * shown, "{named} and {stated} of {shown}");
}

#[test]
fn a_law_that_bends_the_fit_is_weighed_at_a_fit_of_its_own() {
    // Linear about the fit without it, a function of the same command fits better than the
    // harmonic.
    let harmonic =
        |sin| Lacking::new(Effect::JointHarmonic { joint: 2, orders: vec![3] }, &[sin, 0.0]);
    let coupling = |factor| Lacking::new(Effect::JointCoupling { joint: 4, from: 3 }, &[factor]);
    let kinds = [
        (
            5199,
            vec![
                harmonic(5.39e-4),
                coupling(5.14e-4),
                Lacking::new(Effect::GearRatio { joint: 3 }, &[7.8e-4]),
            ],
        ),
        (
            5211,
            vec![
                coupling(5.97e-4),
                harmonic(6.38e-4),
                Lacking::new(Effect::LinkBending { joint: 4 }, &[]),
            ],
        ),
    ];
    for (seed, kind) in kinds {
        let judged = LoopVerdict::of(&kind, SMALL, seed);
        let line = judged.line(&name(&kind), SMALL, seed);
        let wave = Effect::JointHarmonic { joint: 2, orders: vec![3] };
        assert!(judged.closure.effects.iter().any(|found| found.effect == wave), "{line}");
        assert!(judged.after < 1.25 * judged.alike, "{line}");
    }
}

#[test]
fn two_effects_are_both_named() {
    let [shown, named, stated] = named_of(&pairs()[..2], 800);
    println!("{shown} distinguishable, {named} named, {stated} named or stated as alternatives");
    assert!(shown == 4 && stated == 4 && named >= 3, "{named} and {stated} of {shown}");
}

#[test]
fn what_no_catalogue_holds_is_located_and_corrected() {
    let kinds = [(2, Shape::Bump, [0.06, 20.0, 8.0]), (3, Shape::Step, [0.05, -70.0, 6.0])];
    kinds.into_par_iter().for_each(|kind| {
        let left = Left::of(kind, SMALL, 900);
        let line = left.line(kind, SMALL, 900);
        println!("{line}");
        assert_eq!(left.closure.verdict, Verdict::Unexplained, "{line}");
        assert!(left.located, "{line}");
        assert!(left.corrected.is_some_and(|corrected| 2.0 * corrected < left.before), "{line}");
    });
}

/// Runs the loop on a case of `tests/cases`: it finds exactly these effects, and its held-out rms
/// is that of a fit with these effects declared, and below `limit_mm`.
fn case(file: &str, effects: &[Effect], limit_mm: f64) {
    let mut problem = lunar();
    let measurements = read(&problem, &[&format!("tests/cases/{file}.csv")]);
    let data = Dataset::from_measurements(&problem, measurements).unwrap();
    let closure = close(&problem, &data, &Options::default()).unwrap();
    let location = problem.data.location.clone();
    problem.effects = effects
        .iter()
        .map(|effect| EffectDeclaration { effect: effect.clone(), location: location.clone() })
        .collect();
    let known = identify(&problem, &data, &Options::default()).unwrap().fitted.held_out.rms.norm;
    let found: Vec<&Effect> = closure.effects.iter().map(|found| &found.effect).collect();
    let after = closure.after.fitted.held_out.rms.norm;
    println!(
        "{file}: {:?}, {found:?}, {:.3} times the noise, {:.3} with the truth declared",
        closure.verdict,
        after / NOISE,
        known / NOISE
    );
    assert_eq!(found.len(), effects.len(), "{file}: {found:?}");
    for effect in effects {
        assert!(found.iter().any(|found| is_the_same(found, effect)), "{file}: {found:?}");
    }
    let verdict = if effects.is_empty() { Verdict::NothingFound } else { Verdict::Explained };
    assert_eq!(closure.verdict, verdict, "{file}");
    assert!(
        after < 1.01 * known && after < limit_mm * 1e-3,
        "{file}: {after} m, {known} m with the truth declared"
    );
}

#[test]
fn cases_without_an_effect() {
    case("a-none", &[], 0.14);
    case("h-none-large", &[], 0.10);
}

#[test]
fn cases_with_effects() {
    case("b-joint-harmonic", &[Effect::JointHarmonic { joint: 2, orders: vec![1] }], 0.14);
    case("c-link-thermal-bending", &[Effect::LinkThermalBending { link: "B".to_owned() }], 0.14);
    case("d-backlash", &[Effect::Backlash { joint: 3 }], 0.14);
    case("e-payload-mass", &[Effect::PayloadMass], 0.14);
    case("f-two", &[Effect::GearRatio { joint: 3 }, Effect::TrackerDrift], 0.14);
}

#[test]
fn a_case_of_what_no_catalogue_holds() {
    let problem = lunar();
    let measurements = read(&problem, &["tests/cases/g-not-in-catalogue.csv"]);
    let data = Dataset::from_measurements(&problem, measurements).unwrap();
    let closure = close(&problem, &data, &Options::default()).unwrap();
    let [left] = closure.unexplained.as_slice() else { panic!("{:?}", closure.unexplained) };
    assert_eq!(
        (left.site, left.depends_on.as_slice()),
        (Some(Site::Joint(1)), [Covariate::Command(1)].as_slice())
    );
    let (before, after) =
        (closure.before.fit.fitted.held_out, left.correction.as_ref().unwrap().held_out);
    println!(
        "g-not-in-catalogue: {:.4} mm, corrected {:.4} mm",
        before.rms.norm * 1e3,
        after.rms.norm * 1e3
    );
    assert!(2.0 * after.rms.norm < before.rms.norm);
}
