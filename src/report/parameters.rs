//! Parameters in words: table of estimates, unidentifiable and weak combinations, correlations.

use super::document::{Bar, Block, Table, code, first_of};
use super::figures::{ACCENT, Drawing, Forest};
use crate::fit::{ActiveConstraint, Estimate, Identification, PriorSize, open_quantities};
use crate::least_squares::solver::AtBound;
use crate::least_squares::{Identifiability, UnidentifiableCombination, WEAK_THRESHOLD};
use crate::problem::{JointKind, Problem};
use crate::quantity::format::{MAX_DECIMALS, counted, decimals, number, or_dash, two_digits};
use crate::results::{Knowledge, LargestHarmonics, exceeds_noise};

/// Number of decimals of a value without a standard error.
const DEFAULT_DECIMALS: usize = 4;
/// Smallest absolute coefficient at which a parameter of a combination is named.
const MIN_NAMED_COEFFICIENT: f64 = 0.02;
/// Maximum number of parameters of a combination that are named.
const MAX_NAMED_PARAMETERS: usize = 8;
/// Maximum number of combinations, and of correlations, that a text lists.
const MAX_LISTED: usize = 12;
/// Header of the table of parameters.
const HEADER: [&str; 7] =
    ["parameter", "nominal", "estimate", "change", "± 1 σ", "unit", "identified"];

/// Cells of a row of the table of parameters, with its bar.
type Line = (Vec<String>, Bar);

/// Returns the table of all free parameters. If a joint has many harmonics, the table shows the
/// largest; the smaller ones are in a folded section of the page, and in `file`.
pub(super) fn parameters<'a>(
    problem: &Problem,
    found: &Identification,
    file: &str,
) -> Vec<Block<'a>> {
    let harmonics = LargestHarmonics::of(problem, &found.estimates);
    let (mut shown, mut lower): (Vec<Line>, Vec<Line>) = Default::default();
    for (k, estimate) in found.estimates.iter().enumerate() {
        let line = (row(estimate, &found.active_constraints), bar(estimate));
        if harmonics.is_smaller(&estimate.name) { &mut lower } else { &mut shown }.push(line);
        let of_joint = harmonics.joint_with_smaller(&estimate.name);
        let is_last = found.estimates[k + 1..]
            .iter()
            .all(|other| harmonics.joint_with_smaller(&other.name) != of_joint);
        if let Some((joint, smaller)) = of_joint.filter(|_| is_last) {
            let mut cells = vec![String::new(); HEADER.len()];
            cells[0] = format!("and {smaller} smaller harmonics of joint {joint}");
            shown.push((cells, Bar::default()));
        }
    }
    let table = |rows: Vec<Line>| {
        let (rows, bars) = rows.into_iter().unzip();
        Table {
            minor: vec![1, 3, 6],
            bars: Some(("change / σ", bars)),
            ..Table::new(&HEADER, rows, &[0, 5, 6])
        }
    };
    let count = lower.len();
    let mut notes: Vec<String> =
        (count > 0).then(|| format!("smaller harmonics: in {file}")).into_iter().collect();
    if found.estimates.iter().any(|estimate| estimate.std_error.is_none()) {
        notes.push(
            "–: no standard error, because the data identify the parameter only in a combination with others or not at all, a limit \
             (bound or constraint) decides it, or it was not fitted"
                .to_owned(),
        );
    }
    notes.push(
        "identified: share of the information that comes from the data or from priors of related parameters; the rest comes from the \
         parameter's prior, a bound or constraint, or the start value along unidentifiable combinations"
            .to_owned(),
    );
    let is_vague = |estimate: &Estimate| {
        Knowledge::of(estimate, &found.active_constraints) == Knowledge::Vaguely
    };
    notes.extend(found.estimates.iter().any(is_vague).then(|| {
        "but vaguely: no standard error, or one above 1°, 10 mm or half of the stiffness".to_owned()
    }));
    notes.extend(rows_of_sheet(problem));
    notes.extend(exceeds_noise(found).then(|| {
        "standard errors assume that the model lacks nothing; the residual is larger than the declared σ explains, so that parameters \
         may be off by many of them"
            .to_owned()
    }));
    notes.extend(suggested_prior_sigmas(&found.prior_sizes).filter(|_| found.is_trusted()));
    let mut blocks = vec![Block::Table(Table { notes, ..table(shown) })];
    if count > 0 {
        let on_paper = format!("The smaller harmonics are left out on paper: they are in {file}.");
        let folded = vec![Block::Table(table(lower))];
        let title = format!("The smaller harmonics: {count} coefficients");
        blocks.push(Block::Folded(title, folded, on_paper));
    }
    blocks
}

/// States the names of those joints that `words` mentions by their numbers, if the numbers mislead: a
/// fixed joint counts, too, or a name holds another number. `None` if there are none.
pub(super) fn joint_names(problem: &Problem, words: &str) -> Option<String> {
    let is_mentioned = |number: usize| {
        let called = format!("joint {number}");
        let mut after = words.split(&called).skip(1);
        after.any(|rest| !rest.starts_with(|next: char| next.is_ascii_digit()))
    };
    let named = (1..).zip(&problem.joints).filter(|(_, joint)| !joint.name.is_empty());
    let named: Vec<(usize, &str, bool)> = named
        .map(|(number, joint)| (number, joint.name.as_str(), joint.kind == JointKind::Fixed))
        .collect();
    let holds_other = |&(number, name, _): &(usize, &str, bool)| {
        let mut numbers = name.split(|letter: char| !letter.is_ascii_digit());
        numbers.any(|digits| digits.parse::<usize>().is_ok_and(|found| found != number))
    };
    if !named.iter().any(|joint| joint.2 || holds_other(joint)) {
        return None;
    }
    let mentioned = named
        .iter()
        .filter(|(number, name, _)| *name != format!("joint {number}") && is_mentioned(*number));
    let mentioned: Vec<String> =
        mentioned.map(|(number, name, _)| format!("joint {number} is {name}")).collect();
    (!mentioned.is_empty()).then(|| format!("In the problem {}.", mentioned.join(", ")))
}

/// States which row of a standard DH table each parameter belongs to; `None` for other tables.
pub(super) fn rows_of_sheet(problem: &Problem) -> Option<String> {
    let flange = problem.standard_rows()?.len() + 1;
    Some(format!(
        "standard DH: θ and d of row i of the sheet are joint(i).theta and joint(i).d; its a and α \
         are joint(i+1).a and joint(i+1).alpha, so that joint{flange}, the flange, has those of \
         row {}; {} writes the table of the sheet",
        flange - 1,
        code("flexcal export --format dh")
    ))
}

/// States the prior σ that the estimated deviations suggest where they contradict the declared one;
/// `None` if they contradict none.
fn suggested_prior_sigmas(sizes: &[PriorSize]) -> Option<String> {
    let rule = |size: &PriorSize| {
        let unit = size.unit.display(size.declared);
        let [found, declared] =
            [size.found, size.declared].map(|sigma| two_digits(sigma * unit.factor, MAX_DECIMALS));
        format!("{} {found} {} instead of {declared}", size.pattern, unit.symbol)
    };
    let rules: Vec<String> = sizes.iter().map(rule).collect();
    (!rules.is_empty()).then(|| {
        format!(
            "priors: the estimated deviations suggest other values of σ: {}; with few poses, \
             priors of this size may predict better",
            rules.join(", ")
        )
    })
}

fn row(estimate: &Estimate, constraints: &[ActiveConstraint]) -> Vec<String> {
    let unit = estimate.unit.display(estimate.nominal);
    let error = estimate.std_error.map(|error| error * unit.factor);
    let digits = error.map_or(DEFAULT_DECIMALS, |error| decimals(error, MAX_DECIMALS));
    let show = |value: f64| number(value * unit.factor, digits);
    vec![
        estimate.name.clone(),
        number(estimate.nominal * unit.factor, digits.min(DEFAULT_DECIMALS)),
        show(estimate.estimate),
        show(estimate.estimate - estimate.nominal),
        or_dash(error, |error| number(error, digits)),
        unit.symbol,
        format_identified(estimate, constraints),
    ]
}

/// Returns the bar of a parameter: its change in units of its standard error, and its active bound.
fn bar(estimate: &Estimate) -> Bar {
    let error = estimate.std_error.filter(|error| *error > 0.0);
    Bar {
        change: error.map(|error| (estimate.estimate - estimate.nominal) / error),
        bound: estimate.at_bound.map(|bound| if bound == AtBound::Lower { 0.0 } else { 1.0 }),
    }
}

/// Formats the identified share of a parameter in percent, with a word for how well the data
/// determine it.
fn format_identified(estimate: &Estimate, constraints: &[ActiveConstraint]) -> String {
    let share = format!("{:3.0} %", estimate.identified * 100.0);
    match Knowledge::of(estimate, constraints) {
        Knowledge::AtBound(AtBound::Lower) => "at its lower bound".to_owned(),
        Knowledge::AtBound(AtBound::Upper) => "at its upper bound".to_owned(),
        Knowledge::NotFitted => "not fitted".to_owned(),
        Knowledge::SetByConstraints => "set by constraints".to_owned(),
        Knowledge::Vaguely => format!("{share}  but vaguely"),
        Knowledge::Well => format!("{share}  well"),
        Knowledge::InPart => format!("{share}  in part"),
        Knowledge::Hardly => format!("{share}  hardly"),
        Knowledge::NotAtAll => format!("{share}  not at all"),
    }
}

/// Draws the change of each parameter from nominal in units of its prior σ; `None` if no fitted
/// parameter has a prior.
pub(super) fn against_priors(found: &Identification) -> Option<Drawing> {
    let row = |estimate: &Estimate| {
        let (prior, error) = (estimate.prior_sigma?, estimate.std_error?);
        let is_logarithm = estimate.unit.is_relative();
        let (change, error) = if is_logarithm {
            ((estimate.estimate / estimate.nominal).ln(), error / estimate.estimate)
        } else {
            (estimate.estimate - estimate.nominal, error)
        };
        Some((estimate.name.clone(), vec![Some((change / prior, error / prior))]))
    };
    Forest {
        names: ("priors", "Estimates against their priors"),
        caption: "Change of each parameter from nominal ± 1 σ, in units of its prior σ. The prior is at 0; its ± 1 σ and ± 3 σ are \
                  lines. A short interval means that the data determine the parameter, one from −1 to 1 that the prior does."
            .to_owned(),
        label: "change from nominal [prior σ]",
        legend: vec![("estimate", ACCENT)],
        references: vec![0.0, -1.0, 1.0, -3.0, 3.0],
        rows: found.estimates.iter().filter_map(row).collect(),
        is_logarithmic: false,
    }
    .drawing()
}

/// Lists the combinations of parameters that the measurements do not determine at the nominal arm.
/// `file` names what contains all of them, and `open_scale` states that the scale is open.
pub(super) fn unidentifiable<'a>(
    found: &Identifiability,
    unknowns: &[String],
    (file, open_scale): (&str, Option<&str>),
) -> Block<'a> {
    let unidentifiable = &found.unidentifiable;
    if let Some(words) = open_scale.filter(|_| unidentifiable.is_empty()) {
        return Block::lines(format!("The measurements alone leave open:\n{words}."));
    }
    if unidentifiable.is_empty() {
        return Block::lines(
            "All combinations of the parameters are identifiable at the nominal arm.",
        );
    }
    let is = if unidentifiable.len() == 1 { "is" } else { "are" };
    let words = format!(
        "{} of {} combinations of parameters {is} not identifiable at the nominal arm. Changed together, these\n\
         parameters move no predicted position (numbers: in proportion to the displacement that each change alone\n\
         would cause; their squares add up to 1):",
        unidentifiable.len(),
        unknowns.len()
    );
    let mut points = first_of(
        unidentifiable.iter().map(|combination| combination_words(combination, unknowns)),
        MAX_LISTED,
        file,
    );
    let quantities = open_quantities(unidentifiable, unknowns);
    points.extend(open_scale.filter(|_| quantities.is_empty()).map(str::to_owned));
    points.extend(quantities);
    points.push(
        "Where no prior decides, fix one parameter of each combination (fixed = true) or give it \
         a prior (sigma_mm, sigma_deg)."
            .to_owned(),
    );
    Block::Lines(words, points)
}

/// Lists the combinations that keep their start values because the data determine them too weakly;
/// `None` if there are none.
pub(super) fn weak<'a>(found: &Identification, file: &str) -> Option<Block<'a>> {
    let count = found.weak.len();
    let (noun, hold) =
        if count == 1 { ("combination", "is held") } else { ("combinations", "are held") };
    let words = format!(
        "{count} {noun} of parameters {hold} at {} start, because the data determine {} too weakly (a change by the size of\n\
         the arm, 1 rad or a factor of 100 moves all measured coordinates together by less than {WEAK_THRESHOLD} σ):",
        if count == 1 { "its" } else { "their" },
        if count == 1 { "it" } else { "them" }
    );
    let points = first_of(
        found.weak.iter().map(|combination| combination_words(combination, &found.unknowns)),
        MAX_LISTED,
        file,
    );
    (count > 0).then_some(Block::Lines(words, points))
}

/// Lists on the page the combinations that [`unidentifiable`] omits; `None` if it omits none.
pub(super) fn more_unidentifiable<'a>(found: &Identification, file: &str) -> Option<Block<'a>> {
    let unidentifiable = found.identifiability().unidentifiable.iter().skip(MAX_LISTED);
    let words: Vec<String> =
        unidentifiable.map(|combination| combination_words(combination, &found.unknowns)).collect();
    let count = words.len();
    let title = counted(count, "more combination");
    let on_paper = format!("{title} left out on paper: see {file}.");
    (count > 0).then(|| Block::Folded(title, vec![Block::list(words)], on_paper))
}

/// Formats a combination as a sum of parameters with their coefficients, the largest first.
fn combination_words(combination: &UnidentifiableCombination, unknowns: &[String]) -> String {
    let name = |k: usize| unknowns[k].as_str();
    if let [(k, _)] = combination.weights[..] {
        return format!("{} alone", name(k));
    }
    let mut named: Vec<&(usize, f64)> = combination
        .weights
        .iter()
        .filter(|(_, weight)| weight.abs() > MIN_NAMED_COEFFICIENT)
        .collect();
    // The rounding of equal weights differs between machines: sort by the shown digits.
    let shown = |weight: f64| (weight.abs() * 100.0).round();
    named.sort_by(|a, b| shown(b.1).total_cmp(&shown(a.1)).then(a.0.cmp(&b.0)));
    let mut terms: Vec<String> = named
        .iter()
        .take(MAX_NAMED_PARAMETERS)
        .map(|(k, weight)| {
            format!("{} {:.2} {}", if *weight < 0.0 { '−' } else { '+' }, weight.abs(), name(*k))
        })
        .collect();
    if named.len() > MAX_NAMED_PARAMETERS {
        terms.push(format!("… and {} smaller", named.len() - MAX_NAMED_PARAMETERS));
    }
    terms.join(" ")
}

/// Returns pairs of strongly correlated parameters with their correlation, except pairs within one
/// unidentifiable combination.
pub(super) fn correlated(found: &Identification) -> Vec<(String, String, f64)> {
    let tied = |a: &str, b: &str| {
        let holds = |combination: &UnidentifiableCombination, name: &str| {
            combination.weights.iter().any(|&(k, _)| found.unknowns[k] == name)
        };
        let mut combinations = found.identifiability().unidentifiable.iter();
        combinations.any(|combination| holds(combination, a) && holds(combination, b))
    };
    found.strong_correlations().into_iter().filter(|(a, b, _)| !tied(a, b)).collect()
}

/// Lists pairs of strongly correlated parameters. `file` names what contains all of them.
pub(super) fn correlations<'a>(found: &Identification, file: &str) -> Block<'a> {
    let pairs = correlated(found).into_iter().map(|(a, b, correlation)| {
        let sign = if correlation < 0.0 { '−' } else { '+' };
        format!("{a} and {b}: {sign}{:.3}", correlation.abs())
    });
    let points = first_of(pairs, MAX_LISTED, file);
    let words = match points.as_slice() {
        [] if found.identifiability().unidentifiable.is_empty() => {
            "No two parameters are correlated by more than 0.9."
        }
        [] => "No two other parameters are correlated by more than 0.9.",
        _ => {
            "Correlated by more than 0.9 (the data determine their sum or difference better than \
             each):"
        }
    };
    Block::Lines(words.to_owned(), points)
}

/// States rank, condition number and observability indices at the nominal arm in one line.
pub(super) fn conditioning<'a>(
    found: &Identifiability,
    unknowns: usize,
    coordinates: usize,
) -> Block<'a> {
    let [o1, o2, o3, o4, o5] = found.observability(coordinates);
    Block::lines(format!(
        "At the nominal arm: rank {} of {unknowns}, condition number {:.3e}; observability O1 \
         {o1:.3e}, O2 {o2:.3e}, O3 {o3:.3e}, O4 {o4:.3e}, O5 {o5:.3e}",
        found.rank,
        found.condition_number(),
    ))
}
