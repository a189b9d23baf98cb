//! Formulas of laws: values, derivatives by dual numbers, printing, and mistakes with their columns.

use flexcal::laws::Quantity;
use flexcal::laws::expression::{Expression, FormulaError, Mistake, Names, Vocabulary, parse};
use num_dual::Dual64;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

const SLIDES: [bool; 3] = [false, false, true];

fn read(text: &str) -> Result<Expression, FormulaError> {
    let joints = [("shoulder".to_owned(), 1)];
    let (covariates, parameters) = (["tilt deg".to_owned()], ["k".to_owned(), "c".to_owned()]);
    let vocabulary = Vocabulary {
        slides: &SLIDES,
        joints: &joints,
        covariates: &covariates,
        parameters: &parameters,
    };
    parse(text, &vocabulary).map(|parsed| parsed.expression)
}

/// Value and derivative by q2 where q2 = `q` and everything else is fixed.
fn at(expression: &Expression, q: f64) -> (f64, f64) {
    let quantity = |quantity: Quantity| match quantity {
        Quantity::Command(1) => Dual64::new(q, 1.0),
        Quantity::Command(_) => Dual64::from(0.4),
        Quantity::Warming => Dual64::from(3.0),
        _ => Dual64::from(0.7),
    };
    let found = expression.evaluate(&quantity, &[Dual64::from(0.5), Dual64::from(-1.25)]);
    (found.re, found.eps)
}

#[test]
fn values_are_those_of_the_formulas() {
    let q = 0.3_f64;
    let cases = [
        ("2 + 3*4^2/8 - 1", 7.0),
        ("-2^2", -4.0),
        ("2^-1", 0.5),
        ("2^3^2", 512.0),
        ("-q2^2 + shoulder", -q * q + q),
        ("T*exp(-k*abs(q2))", 3.0 * (-0.5 * q).exp()),
        ("sin(q2)*cos(q1)", q.sin() * 0.4_f64.cos()),
        ("atan2(q2, -1) + min(q2, 1) + max(q2, 1)", q.atan2(-1.0) + q + 1.0),
        ("sqrt(abs(q2 - 1))*sign(-q2)*tanh(q2)", -(0.7_f64.sqrt()) * q.tanh()),
        ("log(k) + 1.5e-1·pi", 0.5_f64.ln() + 0.15 * std::f64::consts::PI),
        ("`tilt deg` − c", 0.7 + 1.25),
    ];
    for (text, expected) in cases {
        let (found, _) = at(&read(text).unwrap(), q);
        let error = (found - expected).abs() / expected.abs().max(1.0);
        assert!(error < 1e-14, "{text}: {found}, not {expected}");
    }
}

#[test]
fn derivatives_are_those_of_extrapolated_differences() {
    let formulas = [
        "sin(3*q2)",
        "cos(q2)",
        "tan(q2)",
        "exp(-q2/2)",
        "expm1(q2)",
        "log(q2 + 4)",
        "sqrt(q2 + 4)",
        "abs(q2 + 0.0123)",
        "sign(q2 + 0.0123)",
        "tanh(7*q2)",
        "tanh(40*q2)",
        "step(q2 + 0.0123)",
        "spline(q2 + 2.0123)",
        "atan2(q2, 0.3)",
        "atan2(0.3, q2 + 0.0123)",
        "min(q2, 0.0123)",
        "max(q2^2, 0.0123)",
        "q2^3",
        "(q2 + 4)^-2",
        "abs(q2)^1.7",
        "(q2 + 4)^q2",
        "2^q2",
        "q2/(1 + q2^2)",
        "q1*q2*sin(q1 + q2)*exp(-k*q2)",
    ];
    for text in formulas {
        let formula = read(text).unwrap();
        for k in -15..=15 {
            let q = 0.0917 * f64::from(k) + 0.004;
            let difference = |h: f64| (at(&formula, q + h).0 - at(&formula, q - h).0) / (2.0 * h);
            // Richardson: errors of the fourth and of the sixth order cancel.
            let halved = |h: f64| (4.0 * difference(h / 2.0) - difference(h)) / 3.0;
            let expected = (16.0 * halved(2.5e-4) - halved(5e-4)) / 15.0;
            let (value, slope) = at(&formula, q);
            let scale = 1.0 + value.abs() + slope.abs();
            assert!(
                (slope - expected).abs() < 1e-9 * scale,
                "{text} at {q}: {slope}, not {expected}"
            );
        }
    }
}

#[test]
fn awkward_points_have_finite_derivatives_or_values_that_are_none() {
    // At a kink, an edge, or a tie the derivative is the documented one.
    for (text, q, value, slope) in [
        ("abs(q2)", 0.0, 0.0, 0.0),
        ("sign(q2)", 0.0, 0.0, 0.0),
        ("step(q2)", 0.0, 1.0, 0.0),
        ("sqrt(q2)", 0.0, 0.0, 0.0),
        ("q2^0.5", 0.0, 0.0, 0.0),
        ("q2^1.5", 0.0, 0.0, 0.0),
        ("q2^k", 0.0, 0.0, 0.0),
        ("atan2(q2, 0*q2)", 0.0, 0.0, 0.0),
        ("min(q2, 2*q2)", 0.0, 0.0, 1.0),
        ("max(q2, 2*q2)", 0.0, 0.0, 1.0),
        ("abs(q2)^3", 0.0, 0.0, 0.0),
        ("tanh(q2)", 1e9, 1.0, 0.0),
        ("spline(q2)", 0.0, 0.0, 0.0),
        ("spline(q2)", 4.0, 0.0, 0.0),
        ("spline(q2)", 2.0, 2.0 / 3.0, 0.0),
    ] {
        let (found, by) = at(&read(text).unwrap(), q);
        assert!(
            (found - value).abs() < 1e-15 && (by - slope).abs() < 1e-15,
            "{text}: {found}, {by}"
        );
    }
    for (text, q) in
        [("log(q2)", 0.0), ("log(q2)", -1.0), ("sqrt(q2)", -1.0), ("1/q2", 0.0), ("q2^-1", 0.0)]
    {
        assert!(!at(&read(text).unwrap(), q).0.is_finite(), "{text}");
    }
}

#[test]
fn splines_add_up_to_one() {
    let formula = read("spline(q2) + spline(q2 + 1) + spline(q2 + 2) + spline(q2 + 3)").unwrap();
    for k in 0..40 {
        assert!((at(&formula, 0.025 * f64::from(k)).0 - 1.0).abs() < 1e-14);
    }
}

#[test]
fn mistakes_have_their_column_and_the_word_that_is_meant() {
    let cases = [
        ("sin(q2) + shoulde", 11, "unknown word shoulde (did you mean shoulder?)"),
        ("2*qq", 3, "unknown word qq"),
        ("sinn(q2)", 1, "unknown function sinn (did you mean sin?)"),
        ("q2 + q7", 6, "q7 names no joint; the arm has 3, counted from 1"),
        ("q2 + T", 1, "rad and K cannot be added"),
        ("q3 - t", 1, "m and s cannot be added"),
        ("2*sin(T)", 7, "sin takes an angle or a number without unit, found K"),
        ("exp(-payload*t)", 5, "exp takes an angle or a number without unit, found kg·s"),
        ("(q2 + 1", 8, "expected an operator or ), found the end of the formula"),
        ("q2 q1", 4, "expected an operator or the end of the formula, found q"),
        ("3 + * 2", 5, "found *"),
        ("sin(q2, q1)", 1, "sin takes 1 argument, found 2"),
        ("sin(q2+0,5)", 1, "found 2; a decimal comma is written as a point"),
        ("sin q2", 1, "sin needs parentheses: sin(q1)"),
        ("q2**2", 4, "found *; a power is written with ^"),
        ("min(q2)", 1, "min takes 2 arguments, found 1"),
        ("lag(t, 3)", 1, "write lag(T, seconds)"),
        ("friction(q2, -1)", 1, "write friction(q1, distance)"),
        ("1e999", 1, "1e999 is no finite number"),
        ("q1*M4", 4, "M4 names no joint; the arm has 3, counted from 1"),
        ("q1 + M2", 1, "rad and m·N cannot be added"),
        ("", 1, "found the end of the formula"),
        ("`tilt` + 1", 1, "unknown word tilt"),
        ("sin(q2) é", 9, "found é"),
    ];
    for (text, column, words) in cases {
        let error = read(text).unwrap_err();
        let said = error.to_string();
        assert!(error.column == column && said.contains(words), "{text:?}: {said}");
    }
    let deep = format!("{}1{}", "(".repeat(500), ")".repeat(500));
    assert!(matches!(read(&deep).unwrap_err().mistake, Mistake::TooLarge { .. }));
    assert!(matches!(read(&"1+".repeat(3000)).unwrap_err().mistake, Mistake::TooLarge { .. }));
    assert!(matches!(read(&"-".repeat(900)).unwrap_err().mistake, Mistake::TooLarge { .. }));
}

#[test]
fn numbers_may_carry_any_unit() {
    for text in [
        "T/10 + q1",
        "exp(-t/300)",
        "sin(k*t)",
        "max(T - 5, 0)",
        "tanh((T - 4)/2)",
        "`tilt deg` + q1",
    ] {
        assert!(read(text).is_ok(), "{text}");
    }
}

/// A random formula of valid words.
fn random(rng: &mut ChaCha8Rng, depth: u32) -> String {
    const WORDS: [&str; 16] = [
        "M1",
        "M3",
        "q1",
        "q2",
        "q3",
        "T",
        "t",
        "payload",
        "approach1",
        "k",
        "c",
        "shoulder",
        "`tilt deg`",
        "pi",
        "lag(T, 30)",
        "friction(q1, 0.8)",
    ];
    const CALLS: [&str; 12] = [
        "sin", "cos", "tan", "exp", "log", "sqrt", "abs", "sign", "tanh", "step", "spline", "expm1",
    ];
    if depth == 0 || rng.random_range(0..5) == 0 {
        return if rng.random_bool(0.4) {
            format!("{}", (rng.random::<f64>() * 10.0 * 8.0).round() / 8.0)
        } else {
            WORDS[rng.random_range(0..WORDS.len())].to_owned()
        };
    }
    let mut inner = || random(rng, depth - 1);
    let (a, b) = (inner(), inner());
    match rng.random_range(0..9) {
        0 => format!("{a} + {b}"),
        1 => format!("{a} - ({b})"),
        2 => format!("({a})*({b})"),
        3 => format!("({a})/({b})"),
        4 => format!("({a})^{}", rng.random_range(-3..4)),
        5 => format!("-({a})"),
        6 => format!("atan2({a}, {b})"),
        7 => format!("max({a}, {b})"),
        _ => format!("{}({a})", CALLS[rng.random_range(0..CALLS.len())]),
    }
}

#[test]
fn ten_thousand_formulas_never_panic_and_print_as_they_are_read() {
    let mut rng = ChaCha8Rng::seed_from_u64(46);
    let names = (["tilt deg".to_owned()], ["k".to_owned(), "c".to_owned()]);
    let names = Names { covariates: &names.0, parameters: &names.1 };
    let (mut accepted, mut refused) = (0, 0);
    for round in 0..10_000 {
        let mut text = random(&mut rng, 4);
        if round % 2 == 1 {
            // Break it: a byte is taken out, doubled or replaced.
            let signs: Vec<char> = text.chars().collect();
            let place = rng.random_range(0..signs.len());
            let other =
                "+-*/^(),.`´q9eMT ñ\u{0}".chars().nth(rng.random_range(0..18)).unwrap_or(' ');
            let change = |(k, c): (usize, &char)| match round % 3 {
                _ if k != place => vec![*c],
                0 => Vec::new(),
                1 => vec![*c, *c],
                _ => vec![other],
            };
            text = signs.iter().enumerate().flat_map(change).collect();
        }
        match read(&text) {
            Ok(formula) => {
                accepted += 1;
                at(&formula, rng.random_range(-2.0..2.0));
                let printed = formula.display(names).to_string();
                assert_eq!(read(&printed).as_ref(), Ok(&formula), "{text} prints as {printed}");
            }
            Err(error) => {
                refused += 1;
                assert!((1..=text.chars().count() + 1).contains(&error.column), "{text}: {error}");
                assert!(text.get(error.span.clone()).is_some(), "{text}: {error}");
            }
        }
    }
    assert!(accepted > 2000 && refused > 2000, "{accepted} accepted, {refused} refused");
}
