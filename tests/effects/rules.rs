//! Rules of `[parameters]` for the parameters of effects.

use flexcal::model::parameter::Parameter;
use flexcal::problem::Problem;
use flexcal::select::detectable;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use crate::catalogue::declared;
use crate::common::arms::{ODD, parse};
use crate::common::made::{at_random, model_of};

const EFFECTS: &str = "
[[effect]]
gear-ratio = { joint = 3 }
[[effect]]
gear-ratio = { joint = 5 }
[[effect]]
joint-harmonic = { joint = 3, orders = [1, 4] }
[[effect]]
backlash = { joint = 5 }
[[effect]]
backlash = { joint = 4 }
[[effect]]
joint-coupling = { joint = 5, from = 4 }
[[effect]]
unmodelled-mass = { link = 'lower' }
[[effect]]
station-shift = { at_time_s = 90 }
[[effect]]
payload-mass = true
";

/// Returns the odd arm with effects and only these rules.
fn problem(rules: &str) -> Problem {
    let (arm, _) = ODD.split_once("[parameters]").unwrap();
    parse(&format!("{arm}{EFFECTS}[parameters]\n{rules}\n"))
}

fn resolved(rules: &str) -> Result<Vec<Parameter>, String> {
    let none = [String::new()];
    let model = flexcal::model::Model::new(&problem(rules), &none, &none);
    model.map(|model| model.parameters).map_err(|error| error.to_string())
}

fn find<'a>(parameters: &'a [Parameter], name: &str) -> Option<&'a Parameter> {
    parameters.iter().find(|parameter| parameter.name == name)
}

const NAMES: [&str; 15] = [
    "gear-ratio[3].error",
    "gear-ratio[5].error",
    "joint-harmonic[3].sin1",
    "joint-harmonic[3].cos1",
    "joint-harmonic[3].sin4",
    "joint-harmonic[3].cos4",
    "backlash[5].width",
    "backlash[4].width",
    "joint-coupling[5,4].factor",
    "unmodelled-mass[lower].mass",
    "unmodelled-mass[lower].at",
    "station-shift[90].x",
    "station-shift[90].y",
    "station-shift[90].z",
    "payload-mass.mass",
];

#[test]
fn without_rules_effects_are_free_with_the_prior_of_the_catalogue() {
    let parameters = resolved("").unwrap();
    let names: Vec<&str> = parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    assert_eq!(names, NAMES);
    assert!(
        parameters.iter().all(|parameter| parameter.sigma.is_some() && !parameter.is_bounded())
    );
    assert_eq!(find(&parameters, "gear-ratio[3].error").unwrap().sigma, Some(0.01));
}

#[test]
fn rules_name_effects_with_or_without_their_place() {
    let parameters =
        resolved("\"gear-ratio.*\" = { fixed = true }\n\"backlash[5].*\" = { fixed = true }")
            .unwrap();
    assert!(
        find(&parameters, "gear-ratio[3].error").is_none()
            && find(&parameters, "gear-ratio[5].error").is_none()
    );
    assert!(
        find(&parameters, "backlash[5].width").is_none()
            && find(&parameters, "backlash[4].width").is_some()
    );
    let parameters =
        resolved("\"gear-ratio.*\" = { fixed = true }\n\"gear-ratio[3].error\" = { free = true }")
            .unwrap();
    assert_eq!(find(&parameters, "gear-ratio[3].error").unwrap().sigma, None);
    assert!(find(&parameters, "gear-ratio[5].error").is_none());
}

#[test]
fn angles_and_lengths_take_priors_and_bounds() {
    let parameters = resolved(
        "\"backlash[5].width\" = { sigma_deg = 0.1, min_deg = 0 }\n\"backlash[4].width\" = { max_mm = 2 }\n\
         \"station-shift.*\" = { sigma_mm = 3 }\n\"joint-harmonic.sin*\" = { sigma_deg = 0.2 }",
    )
    .unwrap();
    let play = find(&parameters, "backlash[5].width").unwrap();
    assert!((play.sigma.unwrap() - 0.1_f64.to_radians()).abs() < 1e-15 && play.lower == 0.0);
    let sliding = find(&parameters, "backlash[4].width").unwrap();
    assert_eq!((sliding.sigma, sliding.upper), (None, 2e-3));
    assert_eq!(find(&parameters, "station-shift[90].y").unwrap().sigma, Some(3e-3));
    assert_eq!(find(&parameters, "joint-harmonic[3].cos4").unwrap().sigma, Some(1e-3));
    assert!(
        (find(&parameters, "joint-harmonic[3].sin4").unwrap().sigma.unwrap()
            - 0.2_f64.to_radians())
        .abs()
            < 1e-15
    );
}

#[test]
fn rules_for_everything_reach_effects_as_far_as_they_fit_them() {
    let all = resolved("\"*\" = { free = true }").unwrap();
    assert!(NAMES.iter().all(|name| find(&all, name).unwrap().sigma.is_none()));
    assert!(resolved("\"*\" = { fixed = true }").unwrap().is_empty());
    // A parameter that is no angle, length or stiffness keeps the prior of the catalogue.
    let sized = resolved("\"*\" = { sigma_deg = 1, sigma_mm = 30, sigma_relative = 0.5 }").unwrap();
    assert_eq!(find(&sized, "gear-ratio[3].error").unwrap().sigma, Some(0.01));
    assert_eq!(find(&sized, "payload-mass.mass").unwrap().sigma, Some(2.0));
    assert_eq!(find(&sized, "station-shift[90].x").unwrap().sigma, Some(0.03));
    assert_eq!(find(&sized, "joint3.a").unwrap().sigma, Some(0.03));
    // A later rule for the arm does not change effects.
    let later = resolved("\"*\" = { fixed = true }\n\"joint*.theta\" = { sigma_deg = 1 }").unwrap();
    assert!(later.len() == 5 && NAMES.iter().all(|name| find(&later, name).is_none()));
}

#[test]
fn rules_that_do_not_fit_are_mistakes() {
    for (rule, words) in [
        (
            "\"gear-ratio.*\" = { sigma_mm = 1 }",
            "gear-ratio[3].error needs free = true or fixed = true",
        ),
        ("\"backlash[5].width\" = { sigma_mm = 1 }", "backlash[5].width needs _deg or _rad"),
        ("\"backlash[4].width\" = { sigma_deg = 1 }", "backlash[4].width needs _mm or _m"),
        ("\"gear-ratio[2].error\" = { free = true }", "matches no parameter"),
        (
            "\"joint*.alfa\" = { free = true }",
            "matches no parameter of this arm (did you mean joint1.alpha?); they are",
        ),
        (
            "\"hoist-force.*\" = { free = true }",
            "parameters of hoist-force exist if an [[effect]] declares it, as in hoist-force = true",
        ),
        (
            "\"link-th*\" = { free = true }",
            "parameters of link-thermal-bending, link-thermal-expansion, link-thermal-bending-lag, link-thermal-expansion-lag exist if",
        ),
        (
            "\"joint-com*[2].*\" = { free = true }",
            "declares it, as in joint-compliance = { joint = ",
        ),
    ] {
        let error = resolved(rule).unwrap_err();
        assert!(error.contains(words), "{rule}: {error}");
    }
}

#[test]
fn what_a_rule_could_not_take_is_not_looked_for() {
    let (arm, _) = ODD.split_once("[parameters]").unwrap();
    // A rule in millimetres applies to the play of the prismatic joint; the other joints rotate.
    let rule = "\"backlash.*\" = { sigma_mm = 1 }";
    let text = format!(
        "{arm}[[effect]]\nbacklash = {{ joint = 4 }}\n[parameters]\n{rule}\n[data]\nposition_sigma_mm = 0.1\n"
    );
    let problem = parse(&text);
    let poses = at_random(&problem, 60, 1.5, &mut ChaCha8Rng::seed_from_u64(1));
    let detection = detectable(&problem, &poses).unwrap();
    let refused: Vec<&str> = detection
        .untestable
        .iter()
        .filter(|(_, why)| why.contains("in another unit"))
        .map(|(e, _)| e.name())
        .collect();
    assert_eq!(refused, ["backlash"; 3], "{:?}", detection.untestable);
    // Every effect that is searched can be declared.
    for found in &detection.effects {
        let both = [problem.effects[0].effect.clone(), found.effect.clone()];
        assert!(
            !model_of(&declared(&problem, &both), &poses).parameters.is_empty(),
            "{:?}",
            found.effect
        );
    }
}
