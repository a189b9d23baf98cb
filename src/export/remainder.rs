//! Generator of the C tables of a remainder.

use std::fmt::Write as _;

use nalgebra::DVector;

use super::formula::{array, real};
use crate::remainder::{CorrectionTables, InputSource, InputTable, SiteTable};

/// Half the step of a central difference with respect to a parameter, as a fraction of the σ of the
/// parameter's prior.
const PARAMETER_STEP: f64 = 1e-3;
/// Half the step of a central difference along the change of the parameters that was fitted
/// together with a remainder, as a fraction of that change.
const DELTA_STEP: f64 = 0.05;

/// Returns the tables of a remainder as C, for a model with the full parameter vector `x`.
/// `numbers` returns the model's table of numbers at a full parameter vector.
pub(super) fn remainder_tables(
    tables: &CorrectionTables,
    x: &DVector<f64>,
    numbers: impl Fn(&DVector<f64>) -> Vec<f64>,
) -> String {
    let mut text = include_str!("c/remainder_tables.c").to_owned();
    let here = numbers(x);
    let (mut changed, mut change, mut starts) = (Vec::new(), Vec::new(), vec![0]);
    let mut list = |step: &dyn Fn(&mut DVector<f64>, f64)| {
        let at = |sign: f64| {
            let mut moved = x.clone();
            step(&mut moved, sign);
            numbers(&moved)
        };
        let (above, below) = (at(1.0), at(-1.0));
        for (k, (above, below)) in above.iter().zip(&below).enumerate() {
            if above.to_bits() != here[k].to_bits() || below.to_bits() != here[k].to_bits() {
                changed.push(k.to_string());
                change.push(format!("{{{}, {}}}", real(*above), real(*below)));
            }
        }
        starts.push(changed.len());
    };
    for &(k, _, spread) in &tables.parameters {
        list(&|x, sign| x[k] += sign * PARAMETER_STEP * spread);
    }
    for times in [2.0, 1.0] {
        list(&|x, sign| {
            tables
                .parameters
                .iter()
                .for_each(|&(k, delta, _)| x[k] += sign * times * DELTA_STEP * delta);
        });
    }
    let parameters = tables.parameters.len();
    let words = |of: &[usize]| of.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    let _ = writeln!(
        text,
        "enum {{ SITES = {}, INPUTS = {}, CENTRES = {}, KNOTS = {}, PARAMETERS = {parameters} }};\n\
         enum {{ FEATURES = 3 * CENTRES + KNOTS + PARAMETERS }};\n\
         #define PARAMETER_STEP {}\n#define DELTA_STEP {}\n\n\
         /* Numbers that a parameter changes, with their values above and below. */\n\
         static const int CHANGED[] = {{{}}};\nstatic const real CHANGE[][2] = {{{}}};\n\
         static const int PARAMETER_FIRST[] = {{{}}};\nstatic const int DELTA_FIRST[] = {{{}}};\n",
        tables.sites.len(),
        tables.inputs.len(),
        tables.centres.len(),
        tables.knots.len(),
        real(PARAMETER_STEP),
        real(DELTA_STEP),
        changed.join(", "),
        change.join(", "),
        words(&starts[..=parameters]),
        words(&starts[parameters..]),
    );
    let site = |site: &SiteTable| {
        let [single, all, constant] = site.variances.map(real);
        let (input, scale) = site
            .single
            .map_or_else(|| ("-1".to_owned(), 0.0), |(input, scale)| (input.to_string(), scale));
        let (lever, scale) = (real(site.lever), real(scale));
        let (joint, kind) = (site.joint, u8::from(site.is_compliance));
        format!("{{{joint}, {kind}, {input}, {lever}, {single}, {all}, {constant}, {scale}}}")
    };
    let input = |input: &InputTable| {
        let source = match input.source {
            InputSource::Command(joint) => joint.to_string(),
            InputSource::Temperature => "TEMPERATURE".to_owned(),
            InputSource::Payload => "PAYLOAD_MASS".to_owned(),
            InputSource::Hoist => "HOIST".to_owned(),
        };
        let (offset, unit) = (real(input.standard.0), real(input.standard.1));
        let is_angle = u8::from(input.is_angle);
        format!("{{{source}, {is_angle}, {offset}, {unit}, {}}}", real(input.scale))
    };
    let knot = |(site, at): &(usize, f64)| format!("{{{site}, {}}}", real(*at));
    let row = |row: &Vec<f64>| {
        format!("{{{}}}", row.iter().map(|&x| real(x)).collect::<Vec<_>>().join(", "))
    };
    push_list(&mut text, "site_info SITE[SITES]", tables.sites.iter().map(site));
    push_list(&mut text, "input_info INPUT[INPUTS]", tables.inputs.iter().map(input));
    push_list(
        &mut text,
        "knot_info KNOT[KNOTS + 1]",
        tables.knots.iter().map(knot).chain(["{0, R(0.0)}".to_owned()]),
    );
    push_list(&mut text, "real CENTRE[CENTRES][INPUTS]", tables.centres.iter().map(row));
    push_list(&mut text, "real CENTRE_SLOPE[CENTRES][3 * SITES]", tables.slopes.iter().map(row));
    array(&mut text, "WEIGHT", &tables.weights);
    array(&mut text, "EXPLAINED", &tables.explained);
    text.push('\n');
    text
}

/// Appends the definition of a constant C array called `name`, one entry on a line.
fn push_list(text: &mut String, name: &str, entries: impl Iterator<Item = String>) {
    let entries: Vec<String> = entries.collect();
    let _ = writeln!(text, "static const {name} = {{\n    {}\n}};", entries.join(",\n    "));
}
