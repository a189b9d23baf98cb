//! What `compare` prints: the paper's tables 2 and 3 for the problem at hand, then every strategy and every ablation.

use super::quantity::{number, table};
use super::text::no_errors;
use crate::identify::{AxisValues, Baseline, Comparison, ErrorSummary, Errors, Identification, SolverChoice};
use crate::least_squares::solver::Termination;
use crate::problem::Problem;

/// Table 3 of [Chen2021], 50 poses, mm: before, with elasticity, geometry alone; x, y, z and sum of each.
const PUBLISHED: [(&str, [[f64; 4]; 3]); 2] = [
    ("max", [[20.91, 22.72, 39.54, 48.9644], [2.5783, 3.4383, 4.3451, 5.5416], [7.8739, 4.1964, 5.9496, 6.4815]]),
    ("mean", [[6.1646, 13.3304, 21.9786, 27.2506], [0.6845, 0.9578, 1.5093, 2.1358], [1.1303, 1.7519, 2.6873, 3.9673]]),
];
const TABLE_3: [&str; 8] =
    ["held out, mm", "axis", "before", "with elasticity", "ignoring it", "paper: before", "with", "ignoring"];

/// Columns of the rows of a comparison, after the first.
pub(super) const ROWS: [&str; 9] =
    ["solver", "held out mean", "rms, mm", "fitted rms", "steps", "evaluations", TIME, "condition", "termination"];
/// The one that differs from run to run.
pub(super) const TIME: &str = "ms";

/// A comparison as text, ending in a line break.
pub fn compare_text(problem: &Problem, comparison: &Comparison) -> String {
    let Comparison { joint, rigid, paper, ablations, .. } = comparison;
    [
        format!(
            "{}\n{} poses to identify, {} held out\n",
            problem.title, joint.fitted.identification.n, joint.fitted.held_out.n
        ),
        geometry(problem, joint),
        errors(joint, rigid, paper.iter().any(|_| ablations.len() > 1)),
        no_errors(joint).map_or_else(String::new, |words| format!("  –: {words}\n")),
        rows("strategy", strategy_rows(comparison)),
        paper_ignores_effects(problem, paper),
        rows("elasticity", ablation_rows(comparison)),
    ]
    .into_iter()
    .filter(|part| !part.is_empty())
    .collect::<Vec<String>>()
    .join("\n")
}

/// One row for each strategy and solver, the paper's own last.
pub(super) fn strategy_rows(comparison: &Comparison) -> Vec<Vec<String>> {
    let strategies = comparison.strategies.iter().map(|result| line(result.strategy.as_str(), result));
    strategies.chain(comparison.paper.iter().map(paper_line)).collect()
}

/// One row for each part of the elasticity.
pub(super) fn ablation_rows(comparison: &Comparison) -> Vec<Vec<String>> {
    comparison.ablations.iter().map(|(ablation, result)| line(ablation.as_str(), result)).collect()
}

/// What the paper's procedure leaves out of the declared model.
fn paper_ignores_effects(problem: &Problem, paper: &[Baseline]) -> String {
    if paper.is_empty() || problem.effects.is_empty() {
        return String::new();
    }
    "  paper: its own closed forms, without the declared effects\n".to_owned()
}

/// Table 2: nominal, identified, error of each joint's geometry.
fn geometry(problem: &Problem, joint: &Identification) -> String {
    let mut body = Vec::new();
    for (number_of, declared) in problem.joints.iter().enumerate() {
        let nominal = [declared.alpha, declared.a, declared.theta, declared.d, declared.beta];
        let mut row = vec![(number_of + 1).to_string()];
        let identified = ["alpha", "a", "theta", "d", "beta"].iter().zip(nominal).map(|(field, nominal)| {
            let name = format!("joint{}.{field}", number_of + 1);
            joint.estimates.iter().find(|estimate| estimate.name == name).map_or(nominal, |found| found.estimate)
        });
        let identified: Vec<f64> = identified.collect();
        let is_angle = [true, false, true, false, true];
        let show = |values: &mut dyn Iterator<Item = f64>| -> Vec<String> {
            values
                .zip(is_angle)
                .map(|(value, angle)| if angle { number(value.to_degrees(), 3) } else { number(value * 1e3, 2) })
                .collect()
        };
        row.extend(show(&mut nominal.iter().copied()));
        row.extend(show(&mut identified.iter().copied()));
        row.extend(show(&mut identified.iter().zip(nominal).map(|(found, nominal)| found - nominal)));
        body.push(row);
    }
    let header = [
        "joint",
        "α °",
        "a mm",
        "θ °",
        "d mm",
        "β °",
        "→ α °",
        "a mm",
        "θ °",
        "d mm",
        "β °",
        "Δ α °",
        "a mm",
        "θ °",
        "d mm",
        "β °",
    ];
    format!("Geometry, nominal → identified, and the difference\n{}", table(&header, body, &[]))
}

/// Table 3: errors before, with elasticity, ignoring it; the published figures beside them.
fn errors(joint: &Identification, rigid: &Identification, beside_the_paper: bool) -> String {
    let columns = [&joint.registered.held_out, &joint.fitted.held_out, &rigid.fitted.held_out];
    let of_kind = |summary: &ErrorSummary, kind: &str| -> [f64; 4] {
        let AxisValues { x, y, z, norm } = if kind == "max" { summary.max } else { summary.mean };
        [x, y, z, norm]
    };
    let mut body = Vec::new();
    for (kind, published) in PUBLISHED {
        for (axis, name) in ["x", "y", "z", "norm"].iter().enumerate() {
            let mut row = vec![if axis == 0 { kind.to_owned() } else { String::new() }, (*name).to_owned()];
            row.extend(columns.iter().map(|summary| number(of_kind(summary, kind)[axis] * 1e3, 4)));
            if beside_the_paper {
                row.extend(published.iter().map(|values| number(values[axis], 4)));
            }
            body.push(row);
        }
    }
    if !beside_the_paper {
        return table(&TABLE_3[..5], body, &[0, 1]);
    }
    let text = table(&TABLE_3, body, &[0, 1]);
    format!("{text}  paper: published in [Chen2021, table 3], measured on another arm\n")
}

/// One line of a comparison.
fn line(name: &str, result: &Identification) -> Vec<String> {
    let condition = format!("{:.1e}", result.identifiability.condition_number());
    let counts = (result.iterations, result.evaluations, result.seconds);
    cells(name, result.solver.as_str(), &result.fitted, counts, condition, result.termination)
}

fn paper_line(result: &Baseline) -> Vec<String> {
    let counts = (result.iterations, result.evaluations, result.seconds);
    let solver = SolverChoice::PseudoInverse.as_str();
    cells(result.strategy(), solver, &result.errors, counts, "–".to_owned(), result.termination)
}

fn cells(
    name: &str,
    solver: &str,
    errors: &Errors,
    (steps, evaluations, seconds): (u64, u64, f64),
    condition: String,
    termination: Termination,
) -> Vec<String> {
    vec![
        name.to_owned(),
        solver.to_owned(),
        number(errors.held_out.mean.norm * 1e3, 4),
        number(errors.held_out.rms.norm * 1e3, 4),
        number(errors.identification.rms.norm * 1e3, 4),
        steps.to_string(),
        evaluations.to_string(),
        number(seconds * 1e3, 1),
        condition,
        termination.as_str().to_owned(),
    ]
}

fn rows(title: &str, body: Vec<Vec<String>>) -> String {
    let header: Vec<&str> = std::iter::once(title).chain(ROWS).collect();
    table(&header, body, &[0, 1, 9])
}
