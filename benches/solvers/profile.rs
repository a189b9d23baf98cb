//! Performance profiles [Dolan & Moré 2002] as an SVG figure.
//!
//! The profile ρ(τ) of a solver is the fraction of the problems on which it reaches the optimum in
//! at most τ times the time of the fastest solver that reaches it.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::case::Class;
use crate::row::Row;

/// Largest τ of the figure.
const LARGEST_RATIO: f64 = 100.0;
/// Width and height of a panel [px].
const SIZE: (f64, f64) = (540.0, 240.0);
/// Left edge of the panels [px].
const LEFT: f64 = 62.0;
/// Distance between the upper edges of the panels [px].
const STEP: f64 = 330.0;
/// Colours and dashes of the lines. The colours are distinguishable with colour blindness [Okabe &
/// Ito 2008], the dashes without colours.
const LINES: [(&str, &str); 7] = [
    ("#000000", ""),
    ("#0072b2", "9 4"),
    ("#d55e00", "2 3"),
    ("#009e73", "12 3 2 3"),
    ("#cc79a7", "6 3"),
    ("#e69f00", "4 2 1 2"),
    ("#56b4e9", "1 2"),
];

/// Solvers that take part in all classes.
const GENERAL_SOLVERS: [&str; 7] = [
    "bounded",
    "levenberg-marquardt",
    "MINPACK port",
    "argmin trust region",
    "argmin L-BFGS",
    "gauss-newton",
    "pseudo-inverse",
];
/// Solvers for bounds.
const BOUND_SOLVERS: [&str; 5] =
    ["bounded", "interior-point", "reflective", "clamped", "MINPACK port, clamped"];

/// Draws the profiles over all classes except `sequential`, which is a strategy, and over the class
/// `bounded`.
pub fn picture(rows: &[Row]) -> String {
    let joint_fits: Vec<&Row> = rows.iter().filter(|row| row.class != Class::Sequential).collect();
    let bounded: Vec<&Row> = rows.iter().filter(|row| row.class == Class::Bounded).collect();
    let mut out = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 860 680\" font-family=\"sans-serif\" font-size=\"13\" fill=\"#222\">\n\
         <title>Performance profiles of solvers</title>\n<rect width=\"860\" height=\"680\" fill=\"#fff\"/>\n",
    );
    panel(&mut out, 40.0, "All classes", &joint_fits, &GENERAL_SOLVERS);
    panel(&mut out, 40.0 + STEP, "Class “bounded”", &bounded, &BOUND_SOLVERS);
    out + "</svg>\n"
}

/// Draws one panel of `solvers` at the height `top` [px].
fn panel(out: &mut String, top: f64, title: &str, rows: &[&Row], solvers: &[&str]) {
    let (width, height) = SIZE;
    let x = |ratio: f64| LEFT + width * ratio.ln() / LARGEST_RATIO.ln();
    let y = |fraction: f64| top + height * (1.0 - fraction);
    let problems: BTreeSet<(Class, &str)> =
        rows.iter().map(|row| (row.class, row.problem.as_str())).collect();
    let (right, below, count) = (LEFT + width, top + height, problems.len());
    writeln!(
        out,
        "<text x=\"{LEFT}\" y=\"{}\" font-weight=\"bold\">{title}: {count} problems</text>",
        top - 12.0
    )
    .unwrap();
    for fraction in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let y = y(fraction);
        writeln!(out, "<path d=\"M{LEFT} {y:.1}H{right}\" stroke=\"#ddd\"/>").unwrap();
        writeln!(
            out,
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{fraction}</text>",
            LEFT - 6.0,
            y + 4.0
        )
        .unwrap();
    }
    for ratio in [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0] {
        let x = x(ratio);
        writeln!(out, "<path d=\"M{x:.1} {top}V{below}\" stroke=\"#ddd\"/>").unwrap();
        writeln!(
            out,
            "<text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{ratio}</text>",
            below + 17.0
        )
        .unwrap();
    }
    let middle = LEFT + width / 2.0;
    writeln!(
        out,
        "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">τ: time over that of the fastest that reaches the optimum</text>",
        below + 36.0
    )
    .unwrap();
    let (side, centre) = (16.0, top + height / 2.0);
    writeln!(
        out,
        "<text transform=\"translate({side} {centre}) rotate(-90)\" text-anchor=\"middle\">part of the problems solved</text>"
    )
    .unwrap();
    for (k, (solver, (colour, dashes))) in solvers.iter().zip(LINES).enumerate() {
        let ratios = ratios(rows, &problems, solvers, solver);
        let mut path = format!("M{LEFT} {:.1}", y(0.0));
        for (solved, ratio) in
            ratios.iter().take_while(|ratio| **ratio <= LARGEST_RATIO).enumerate()
        {
            write!(path, "H{:.1}V{:.1}", x(*ratio), y((solved + 1) as f64 / count as f64)).unwrap();
        }
        let style = format!(
            "fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" stroke-dasharray=\"{dashes}\" stroke-linejoin=\"round\""
        );
        writeln!(out, "<path d=\"{path}H{right}\" {style}/>").unwrap();
        let (begin, height) = (right + 18.0, top + 12.0 + 24.0 * k as f64);
        writeln!(out, "<path d=\"M{begin} {height}h42\" {style}/>").unwrap();
        let reached = ratios.len();
        writeln!(
            out,
            "<text x=\"{}\" y=\"{}\">{solver} ({reached})</text>",
            begin + 50.0,
            height + 4.0
        )
        .unwrap();
    }
}

/// Returns the sorted ratios of the time of `solver` to that of the fastest of `solvers` that
/// reaches the optimum, for the problems on which `solver` reaches it.
fn ratios(
    rows: &[&Row],
    problems: &BTreeSet<(Class, &str)>,
    solvers: &[&str],
    solver: &str,
) -> Vec<f64> {
    let ratio = |&(class, problem): &(Class, &str)| {
        let reached = || {
            let of = rows.iter().filter(move |row| row.class == class && row.problem == problem);
            of.filter(|row| row.reached.is_ok() && solvers.contains(&row.solver))
        };
        let fastest = reached().map(|row| row.seconds).fold(f64::INFINITY, f64::min);
        reached().find(|row| row.solver == solver).map(|row| row.seconds / fastest)
    };
    let mut ratios: Vec<f64> = problems.iter().filter_map(ratio).collect();
    ratios.sort_by(f64::total_cmp);
    ratios
}
