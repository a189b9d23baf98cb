//! Text and page of the command `compare-results`: two estimates of one arm side by side.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, SymmetricEigen, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF as _, Normal};

use super::document::{Block, Column, Table};
use super::figures::{ACCENT, Drawing, Forest};
use super::render::Story;
use crate::fit::SavedEstimate;
use crate::numeric::{Interval, mean_interval};
use crate::observation::FixtureKind;
use crate::quantity::Unit;
use crate::quantity::format::{MAX_DECIMALS, counted, decimals, number, or_dash, p_value};

/// Probability that any parameter is said to differ although the arm has not changed, and the same
/// for all parameters together.
const FALSE_ALARM_PROBABILITY: f64 = 0.01;
/// Smallest eigenvalue of the correlation matrix of the differences, relative to the number of
/// parameters, at which its direction is tested. Below it rounding decides.
const MIN_EIGENVALUE: f64 = 1e-12;
/// Smallest eigenvalue that a direction counts with. A combination known still better differs by
/// what linear errors of parameters known far worse leave out.
const EIGENVALUE_FLOOR: f64 = 1e-6;
/// Kinds of fixtures, one for each word that begins names of parameters.
const FIXTURES: [FixtureKind; 5] = [
    FixtureKind::Point,
    FixtureKind::Anchor,
    FixtureKind::Plane,
    FixtureKind::Camera,
    FixtureKind::Marker,
];
/// Maximum number of parameters that the terminal lists.
const MAX_LISTED: usize = 20;
/// Smallest number of common configurations at which the held-out errors of both results are
/// compared.
const MIN_COMMON_CONFIGURATIONS: usize = 8;
/// Largest difference of the nominal values of a parameter of one arm, in σ of its prior.
const MAX_NOMINAL_SIGMAS: f64 = 5.0;
/// Number of bootstrap resamples of an interval.
const RESAMPLES: usize = 5000;
/// Probability with which an interval covers the mean difference of held-out errors.
const INTERVAL_LEVEL: f64 = 0.95;
/// Seed of the bootstrap.
const SEED: u64 = 1;
/// Distance below which two measured positions are those of one row \[mm\]. Tables state positions
/// to 1e-6 mm.
const MAX_SAME_DISTANCE: f64 = 1e-5;

/// One of the two results that are compared: estimate, errors and held-out rows.
pub(crate) struct Side {
    pub estimate: SavedEstimate,
    /// Names of errors with their values in mm, ° or px, for example `held out, mean, mm`.
    pub errors: Vec<(String, f64)>,
    /// Names of errors with their values without the remainder of the estimate; empty if it has
    /// none.
    pub without_remainder: Vec<(String, f64)>,
    /// Held-out rows that measure positions; empty if no file with them was found.
    pub held_out: Vec<HeldOutRow>,
}

/// Held-out row that measures a position. It does not name its file, because problems in other
/// folders name the same file by another path.
pub(crate) struct HeldOutRow {
    /// Line of the row in its table.
    pub line: String,
    /// Configuration as text: the joint commands with commas between them.
    pub configuration: String,
    /// Measured position \[mm\].
    pub measured: Vector3<f64>,
    /// Length of the position error \[mm\].
    pub error: f64,
}

impl HeldOutRow {
    /// Returns true if both are the same row of a table: same line, configuration and measured
    /// position.
    fn is_same(&self, other: &Self) -> bool {
        self.line == other.line
            && self.configuration == other.configuration
            && (self.measured - other.measured).norm() < MAX_SAME_DISTANCE
    }
}

/// Parameter that both estimates have.
struct Difference {
    /// Name and unit of the parameter.
    name: String,
    /// Values of both estimates, in the unit that `name` states.
    values: [f64; 2],
    /// Second value minus first one, and the standard error of this change; `None` unless both
    /// values have a standard error.
    change: (f64, Option<f64>),
}

impl Difference {
    /// Returns the change in units of its standard error; `None` without one.
    fn sigmas(&self) -> Option<f64> {
        self.change.1.filter(|sigma| *sigma > 0.0).map(|sigma| self.change.0 / sigma)
    }
}

/// Returns the comparison; its page has all parameters.
pub(crate) fn difference(sides: &[Side; 2]) -> Story {
    let differences = differences(sides);
    let tested = differences.iter().filter(|of| of.sigmas().is_some()).count();
    let limit =
        Normal::standard().inverse_cdf(1.0 - 0.5 * FALSE_ALARM_PROBABILITY / tested.max(1) as f64);
    let [a, b] = sides.each_ref().map(|side| &side.estimate);
    let files = [("A", a), ("B", b)].map(|(name, side)| format!("{name}: {}", side.file.display()));
    let mut blocks = vec![Block::Lines("Estimates side by side".to_owned(), files.to_vec())];
    let shared = a.posterior.fitted_rows.intersection(&b.posterior.fitted_rows).count();
    if are_two_arms(a, b) {
        blocks.push(Block::Text(format!(
            "Not comparable: A is of the problem {}, B of {}, which declare different arms.",
            a.problem_name(),
            b.problem_name()
        )));
        return Story::new(a.problem_name(), "two results", blocks);
    }
    blocks.extend(notes([a, b], shared).into_iter().map(Block::Note));
    blocks.extend(declaration_note(a, b).map(Block::Note));
    let joint = joint_test([a, b]);
    blocks.push(Block::Text(verdict(&differences, (tested, limit), joint, shared)));
    blocks.extend(held_out_sentence(sides).map(Block::Text));
    let error = |side: &Side, name: &str| {
        let found = side.errors.iter().find(|error| error.0 == name);
        or_dash(found, |error| number(error.1, 4))
    };
    let rows = sides[0]
        .errors
        .iter()
        .map(|(name, _)| vec![name.clone(), error(&sides[0], name), error(&sides[1], name)]);
    blocks.push(Block::Table(Table::new(&["error", "A", "B"], rows.collect(), &[0])));
    blocks.extend(remainder_sentences(sides).into_iter().map(Block::Text));
    blocks.push(Block::figures([draw(&differences, limit)]));
    let listed = &differences[..differences.len().min(MAX_LISTED)];
    blocks.push(Block::Words(vec![Block::Table(table(listed))]));
    if listed.len() < differences.len() {
        let more = differences.len() - listed.len();
        let words = format!(
            "compare-results.html lists {} with smaller differences.",
            counted(more, "more parameter")
        );
        blocks.push(Block::Words(vec![Block::Text(words)]));
    }
    blocks.push(Block::Page(vec![Block::Table(table(&differences))]));
    Story::new(sides[0].estimate.problem_name(), "two results", blocks)
}

/// States the mean errors without the remainder of each side that has one.
fn remainder_sentences(sides: &[Side; 2]) -> Vec<String> {
    let sentence = |(name, side): (&str, &Side)| {
        // Errors of left-out configurations are without the remainder everywhere.
        let is_left_out = |(of, _): &&(String, f64)| of.starts_with("left out");
        let exception = if side.without_remainder.iter().any(|of| is_left_out(&of)) {
            ", except those of left-out configurations, which are without it"
        } else {
            ""
        };
        let means =
            side.without_remainder.iter().filter(|of| of.0.contains("mean") && !is_left_out(of));
        let words: Vec<String> =
            means.map(|(of, error)| format!("{of}: {}", number(*error, 4))).collect();
        (!words.is_empty()).then(|| {
            format!(
                "Errors of {name} are with its remainder{exception}. The parameters below, \
                 without it, give: {}.",
                words.join("; ")
            )
        })
    };
    ["A", "B"].into_iter().zip(sides).filter_map(sentence).collect()
}

/// Units of stiffnesses, which are shown with an SI prefix that suits the value.
const STIFFNESS_UNITS: [Unit; 3] =
    [Unit::TorsionalStiffness, Unit::AxialRigidity, Unit::FlexuralRigidity];

/// Returns the parameters that both estimates have, the largest difference in standard errors
/// first.
fn differences([a, b]: &[Side; 2]) -> Vec<Difference> {
    let variance = |side: &Side, k: usize| side.estimate.posterior.covariance[(k, k)];
    let entries_of_b: Vec<(&str, f64, Option<f64>)> = b.estimate.entries().collect();
    let of = |(k, (name, value, _)): (usize, (&str, f64, Option<f64>))| {
        let index = entries_of_b.iter().position(|entry| entry.0 == name)?;
        let (factor, symbol) = match a.estimate.unit_of(name).unwrap_or_default() {
            "rad" => (1_f64.to_degrees(), "°"),
            "m" => (1e3, "mm"),
            symbol => (1.0, symbol),
        };
        let magnitude = value.abs().max(entries_of_b[index].1.abs());
        let prefixed = STIFFNESS_UNITS.into_iter().find(|unit| unit.symbol() == symbol);
        let (factor, symbol) = prefixed.map_or((factor, symbol.to_owned()), |unit| {
            let display = unit.display(magnitude);
            (display.factor, display.symbol)
        });
        let values = [value, entries_of_b[index].1].map(|value| value * factor);
        let sigma = (variance(a, k) + variance(b, index)).sqrt() * factor;
        let sigma = Some(sigma).filter(|sigma| sigma.is_finite());
        Some(Difference {
            name: format!("{name} [{symbol}]"),
            values,
            change: (values[1] - values[0], sigma),
        })
    };
    let mut found: Vec<Difference> = a.estimate.entries().enumerate().filter_map(of).collect();
    let size = |of: &Difference| of.sigmas().map_or(-1.0, f64::abs);
    found.sort_by(|one, other| size(other).total_cmp(&size(one)));
    found
}

/// Tests whether all common parameters of the arm together differ: χ² = dᵀ (C_A + C_B)⁻¹ d with
/// d = b − a, its degrees of freedom and its p-value. Bases, tools and fixtures do not count: they
/// may be set up anew. Well determined combinations of parameters count, which
/// the single standard errors hide. Rows that both fits use make the test too lenient. `None` if no
/// parameter has a variance in both.
fn joint_test([a, b]: [&SavedEstimate; 2]) -> Option<(f64, f64, f64)> {
    let of_b: Vec<(&str, f64, Option<f64>)> = b.entries().collect();
    let [in_a, in_b] = [a, b].map(|side| &side.posterior.covariance);
    let common: Vec<(usize, usize, f64, f64)> = a
        .entries()
        .enumerate()
        .filter_map(|(k, (name, value, _))| {
            let index = of_b.iter().position(|entry| entry.0 == name && !is_set_up(name))?;
            let sigma = (in_a[(k, k)] + in_b[(index, index)]).sqrt();
            (sigma > 0.0).then_some((k, index, of_b[index].1 - value, sigma))
        })
        .collect();
    let n = common.len();
    let correlation = DMatrix::from_fn(n, n, |i, j| {
        let (of, with) = (&common[i], &common[j]);
        (in_a[(of.0, with.0)] + in_b[(of.1, with.1)]) / (of.3 * with.3)
    });
    if n == 0 || correlation.iter().any(|entry| !entry.is_finite()) {
        return None;
    }
    let scaled = DVector::from_iterator(n, common.iter().map(|of| of.2 / of.3));
    let eigen = SymmetricEigen::new(correlation);
    let along = eigen.eigenvectors.tr_mul(&scaled);
    let kept = eigen.eigenvalues.iter().zip(&along);
    let kept: Vec<f64> = kept
        .filter(|(value, _)| **value > MIN_EIGENVALUE * n as f64)
        .map(|(value, along)| along * along / value.max(EIGENVALUE_FLOOR))
        .collect();
    let (chi2, freedom) = (kept.iter().sum::<f64>(), kept.len() as f64);
    Some((chi2, freedom, ChiSquared::new(freedom).ok()?.sf(chi2)))
}

/// Returns true if a parameter of this name belongs to a base, a tool or a fixture.
fn is_set_up(name: &str) -> bool {
    let word = name.split(['.', '[']).next().unwrap_or_default();
    // A beam may be named "base", too.
    let is_placed = |end: &str| ["x", "y", "z", "rx", "ry", "rz"].contains(&end);
    (["base", "tool"].contains(&word) && name.rsplit('.').next().is_some_and(is_placed))
        || FIXTURES.iter().any(|kind| kind.word() == word)
}

/// States whether the estimates differ by more than their standard errors allow. `tested` is the
/// number of parameters with standard errors, `limit` the largest change \[standard errors\],
/// `joint` the [`joint_test`], and `shared` the number of rows to which both were fitted.
fn verdict(
    differences: &[Difference],
    (tested, limit): (usize, f64),
    joint: Option<(f64, f64, f64)>,
    shared: usize,
) -> String {
    let beyond = differences
        .iter()
        .filter(|of| of.sigmas().is_some_and(|sigmas| sigmas.abs() > limit))
        .count();
    let most = differences.first().and_then(|of| Some((of, of.sigmas()?)));
    let Some((first, sigmas)) = most else {
        return "No parameter has a standard error in both results, so they cannot be compared."
            .to_owned();
    };
    let digits = first.change.1.map_or(4, |sigma| decimals(sigma, MAX_DECIMALS));
    let [change, sigma] =
        [first.change.0, first.change.1.unwrap_or(f64::NAN)].map(|value| number(value, digits));
    let most = format!("the largest: {} {change} ± {sigma}, {} σ", first.name, number(sigmas, 1));
    let test = format!(
        "limit {} σ for {}, false alarms {} %",
        number(limit, 1),
        counted(tested, "parameter"),
        number(100.0 * FALSE_ALARM_PROBABILITY, 0)
    );
    let together = joint.map_or_else(String::new, |(chi2, freedom, p)| {
        let chi2 = number(chi2, 1);
        format!(" (χ² = {chi2} with {freedom} degrees of freedom, p {})", p_value(p))
    });
    let differ_together = joint.is_some_and(|(.., p)| p < FALSE_ALARM_PROBABILITY);
    match beyond {
        0 if differ_together => format!(
            "They differ in combinations of parameters{together}, though in no single one by more \
             than its error allows ({most}; {test})."
        ),
        0 if shared > 0 => format!(
            "No difference is shown, of single parameters ({most}; {test}) or of all of the arm \
             together{together}. \
             That does not show that they agree: both fits use {}, so these errors are too large.",
            counted(shared, "common row")
        ),
        0 => format!(
            "No difference is shown, of single parameters ({most}; {test}) or of all of \
             the arm together{together}."
        ),
        count => format!(
            "They differ: {} by more than the errors allow ({most}; {test}).",
            counted(count, "parameter")
        ),
    }
}

/// Returns true if the second result predicts the common held-out rows significantly better than
/// the first; `None` if the results are of two arms.
pub fn predicts_better(sides: &[Side; 2]) -> Option<bool> {
    (!are_two_arms(&sides[0].estimate, &sides[1].estimate))
        .then(|| paired_change(sides).is_some_and(|(_, change)| change.high < 0.0))
}

/// Returns the number of held-out rows that both results predict, and the mean of error B − A
/// \[mm\] with its interval over configurations; `None` if fewer than [`MIN_COMMON_CONFIGURATIONS`]
/// configurations are common, or if both are one file.
fn paired_change([a, b]: &[Side; 2]) -> Option<(f64, Interval)> {
    let mut of_lines: BTreeMap<&str, Vec<&HeldOutRow>> = BTreeMap::new();
    for row in &a.held_out {
        of_lines.entry(&row.line).or_default().push(row);
    }
    let mut of_configurations: BTreeMap<&str, (f64, f64)> = BTreeMap::new();
    for row in &b.held_out {
        let same = of_lines.get(row.line.as_str()).into_iter().flatten();
        let Some(of_a) = same.copied().find(|of_a| of_a.is_same(row)) else { continue };
        let sum = of_configurations.entry(&row.configuration).or_default();
        *sum = (sum.0 + row.error - of_a.error, sum.1 + 1.0);
    }
    let changes: Vec<(f64, f64)> = of_configurations.into_values().collect();
    if changes.len() < MIN_COMMON_CONFIGURATIONS || a.estimate.file == b.estimate.file {
        return None;
    }
    let rows = changes.iter().map(|(_, count)| count).sum::<f64>();
    Some((rows, mean_interval(&changes, RESAMPLES, INTERVAL_LEVEL, SEED)))
}

/// States which result predicts the common held-out rows better, and the mean difference of their
/// errors; `None` if there are too few of these rows.
fn held_out_sentence(sides: &[Side; 2]) -> Option<String> {
    let (rows, Interval { value, low, high }) = paired_change(sides)?;
    let verdict = match (low > 0.0, high < 0.0) {
        (true, _) => "B predicts them worse",
        (_, true) => "B predicts them better",
        _ => "neither predicts them better",
    };
    let [value, low, high] = [value, low, high].map(|length| number(length, 4));
    Some(format!(
        "On the {rows} rows that both predict and neither fitted: {verdict} (mean error of B \
         minus A {value} mm, {low} to {high} mm, {} %).",
        number(100.0 * INTERVAL_LEVEL, 0)
    ))
}

/// Returns true if the estimates are of problems with other names and nominal values, farther apart
/// than [`MAX_NOMINAL_SIGMAS`] σ of the prior.
fn are_two_arms(a: &SavedEstimate, b: &SavedEstimate) -> bool {
    let is_apart = |(name, _, sigma): (&str, f64, Option<f64>)| {
        let symbol = a.unit_of(name).unwrap_or_default();
        // The prior of a stiffness is that of the logarithm of its ratio to the nominal value.
        let is_relative = STIFFNESS_UNITS.iter().any(|unit| unit.symbol() == symbol);
        let nominal = a.nominal_of(name).zip(b.nominal_of(name));
        nominal.zip(sigma).is_some_and(|((a, b), sigma)| {
            let change = if is_relative { (a / b).ln() } else { a - b };
            change.abs() > MAX_NOMINAL_SIGMAS * sigma
        })
    };
    a.problem_name() != b.problem_name() && a.entries().any(is_apart)
}

/// States that the two results are of arms with different declarations; `None` if they are not.
fn declaration_note(a: &SavedEstimate, b: &SavedEstimate) -> Option<String> {
    if let Some([of_a, of_b]) = a.joint_counts(b) {
        return Some(format!(
            "These are two different arms: A has {of_a} joints, B has {of_b}. The differences below \
             compare parameters that only have the same name."
        ));
    }
    let part = a.differing_part(b)?;
    let name = part.name;
    let differs = match part.is_declared {
        [true, false] => format!("Only A declares {name}"),
        [false, true] => format!("Only B declares {name}"),
        _ => format!("The arms are declared differently in {name}"),
    };
    Some(format!("{differs}. The parameters may differ for that reason alone."))
}

/// Lists what limits the comparison: fits that are not trusted, and `shared` common rows.
fn notes([a, b]: [&SavedEstimate; 2], shared: usize) -> Vec<String> {
    let untrusted = [("A", a), ("B", b)].into_iter().filter(|(_, estimate)| !estimate.trusted);
    let mut notes: Vec<String> = untrusted
        .map(|(name, _)| {
            format!(
                "The fit of {name} is not to be trusted (see its findings), so differences from it \
                 say little."
            )
        })
        .collect();
    if shared > 0 {
        notes.push(format!(
            "Both fits use {}: the true standard errors of the differences are smaller than shown.",
            counted(shared, "common row")
        ));
    }
    if a.strategy != b.strategy {
        let [of_a, of_b] = [a, b].map(|estimate| estimate.strategy.as_str());
        notes.push(format!(
            "A was fitted with strategy {of_a}, B with strategy {of_b}, so that \
             parameters can differ for that reason alone."
        ));
    }
    notes
}

fn table(differences: &[Difference]) -> Table {
    let digits = |of: &Difference| of.change.1.map_or(4, |sigma| decimals(sigma, MAX_DECIMALS));
    let value = |k: usize| move |of: &Difference| number(of.values[k], digits(of));
    let sigma = |of: &Difference| or_dash(of.change.1, |sigma| number(sigma, digits(of)));
    let columns = [
        Column::words("parameter", |of: &Difference| of.name.clone()),
        Column::number("A", value(0)).minor(),
        Column::number("B", value(1)).minor(),
        Column::number("B − A", move |of: &Difference| number(of.change.0, digits(of))),
        Column::number("± 1 σ", sigma),
        Column::number("in σ", |of: &Difference| or_dash(of.sigmas(), |sigmas| number(sigmas, 1))),
    ];
    Table::of(differences, &columns)
}

/// Draws the change of each parameter in standard errors, with the limits of the test.
fn draw(differences: &[Difference], limit: f64) -> Option<Drawing> {
    let row = |of: &Difference| Some((of.name.clone(), vec![Some((of.sigmas()?, 1.0))]));
    Forest {
        names: ("differences", "Differences of the two results"),
        caption: "Second estimate minus first one with an interval of ± 1 σ, in standard errors of the difference. Beyond the outer \
                  lines the standard errors alone do not explain the difference."
            .to_owned(),
        label: "B − A [standard errors]",
        legend: vec![("difference", ACCENT)],
        references: vec![0.0, -limit, limit],
        rows: differences.iter().filter_map(row).collect(),
        is_logarithmic: false,
    }
    .drawing()
}
