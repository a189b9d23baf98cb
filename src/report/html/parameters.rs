//! Tables of numbers.

use maud::{Markup, html};

use crate::identify::{Comparison, ErrorSummary, Estimate, Identification};
use crate::least_squares::BlindCombination;
use crate::least_squares::solver::AtBound;
use crate::report::parameters::{blind_words, verdict};
use crate::report::quantity::{decimals, number};
use crate::report::waves::{Line, Shown, shown};

/// Half the width of a bar in standard errors: wider changes run off it.
const REACH: f64 = 10.0;
/// Blind combinations that are not folded.
const SHOWN_BLIND: usize = 10;
/// Decimals of a value that has no error, and of any value at most.
const PLAIN: usize = 4;
const MOST: usize = 6;

/// Nominal, estimate, change and standard error of every free parameter, with the change drawn in standard errors.
pub(super) fn table(found: &Identification, file: &str) -> Markup {
    let Shown { lines: lines_of, lower } = shown(&found.estimates);
    html! {
        // A narrow page hides these columns.
        p.o { "Bars: the change from nominal in units of its standard error, up to ten either way (changes beyond that rest at the end; "
            "an orange mark there is a bound), with one standard error about it. Identified: the share that the data gave; the rest is prior, bound, or choice among blind combinations." }
        (lines(&lines_of))
        @if !lower.is_empty() {
            details {
                summary { "The lower waves: " (lower.len()) " coefficients" }
                (lines(&lower.iter().map(|estimate| Line::Parameter(estimate)).collect::<Vec<_>>()))
            }
            p.folded { "The lower waves are left out on paper: they are in " (file) "." }
        }
        @if !found.active_constraints.is_empty() {
            p { "Held by a constraint: "
                (found.active_constraints.iter().map(|held| held.words.clone()).collect::<Vec<_>>().join("; ")) }
        }
    }
}

fn lines(lines: &[Line]) -> Markup {
    html! {
        div.scroll { table {
            thead { tr {
                th.l { "parameter" } th.o { "nominal" } th { "estimate" } th.o { "change" } th { "± 1 σ" } th.l { "unit" }
                th.l.o { "change / σ" } th.l.o { "identified" }
            } }
            tbody {
                @for line in lines {
                    @match line {
                        Line::Parameter(estimate) => (row(estimate)),
                        Line::Lower(waves, joint) => tr { td.l colspan="8" { "and " (waves) " lower waves of joint " (joint) } },
                    }
                }
            }
        } }
    }
}

fn row(estimate: &Estimate) -> Markup {
    let unit = estimate.unit.display(estimate.nominal);
    let error = estimate.std_error.map(|error| error * unit.factor);
    let digits = error.map_or(PLAIN, |error| decimals(error, MOST));
    let show = |value: f64, digits: usize| number(value * unit.factor, digits).replace('-', "−");
    html! {
        tr {
            td.l { (estimate.name) }
            td.o { (show(estimate.nominal, digits.min(PLAIN))) }
            td { (show(estimate.estimate, digits)) }
            td.o { (show(estimate.estimate - estimate.nominal, digits)) }
            td { (error.map_or_else(|| "–".to_owned(), |error| number(error, digits))) }
            td.l { (unit.symbol) }
            td.l.o { (bar(estimate)) }
            td.l.q.o { (verdict(estimate)) }
        }
    }
}

/// The change in standard errors about nominal.
fn bar(estimate: &Estimate) -> Markup {
    let bound = match estimate.at_bound {
        Some(AtBound::Lower) => Some(0.0),
        Some(AtBound::Upper) => Some(100.0),
        None => None,
    };
    let change =
        estimate.std_error.filter(|error| *error > 0.0).map(|error| (estimate.estimate - estimate.nominal) / error);
    let place = |sigmas: f64| 50.0 + 50.0 * (sigmas / REACH).clamp(-1.0, 1.0);
    html! {
        span.bar {
            i {} u {}
            @if let Some(bound) = bound {
                b.at.out style=(format!("left:{bound:.0}%")) {}
            } @else if let Some(change) = change {
                @let (from, to) = (place(change - 1.0), place(change + 1.0));
                b style=(format!("left:{from:.1}%;width:{:.1}%", to - from)) {}
                b.at style=(format!("left:{:.1}%", place(change))) {}
            }
        }
    }
}

/// The combinations that no measurement sees, in words; many of them folded, and in `file`.
pub(super) fn blind(found: &Identification, file: &str) -> Markup {
    let blind = &found.identifiability.blind;
    let (first, more) = blind.split_at(blind.len().min(SHOWN_BLIND));
    let list = |combinations: &[BlindCombination]| {
        html! { ul.plain { @for one in combinations { li.skip { (blind_words(one, &found.unknowns)) } } } }
    };
    html! {
        @if blind.is_empty() {
            p { "At the nominal arm the data see every combination of the parameters." }
        } @else {
            h3 { "Blind combinations" }
            p { "Their parameters can change together in these proportions, each scaled by its effect, and no predicted position \
                 moves." }
            (list(first))
            @if !more.is_empty() {
                details { summary { (more.len()) " more" } (list(more)) }
                p.folded { (more.len()) " more are left out on paper: they are in " (file) "." }
            }
        }
    }
}

/// Every strategy in numbers.
pub(super) fn comparison_table(comparison: &Comparison) -> Markup {
    let line = |name: &str, solver: &str, errors: (&ErrorSummary, &ErrorSummary), steps: u64, end: &str| {
        let mm = |value: f64| number(value * 1e3, 4);
        html! {
            tr {
                td.l { (name) } td.l { (solver) }
                td.o { (mm(errors.0.mean.norm)) } td { (mm(errors.1.mean.norm)) } td.o { (mm(errors.1.rms.norm)) } td.o { (mm(errors.1.max.norm)) }
                td.o { (steps) } td.l.q.o { (end) }
            }
        }
    };
    html! {
        div.scroll { table {
            thead { tr {
                th.l { "strategy" } th.l { "solver" } th.o { "fitted, mean [mm]" } th { "held out [mm]" } th.o { "rms [mm]" }
                th.o { "largest [mm]" } th.o { "steps" } th.l.o { "ended" }
            } }
            tbody {
                @for found in &comparison.strategies {
                    (line(found.strategy.as_str(), found.solver.as_str(), (&found.fitted.identification, &found.fitted.held_out),
                        found.iterations, found.termination.as_str()))
                }
                @for own in &comparison.paper {
                    (line(own.strategy(), "pseudo-inverse", (&own.errors.identification, &own.errors.held_out), own.iterations,
                        own.termination.as_str()))
                }
            }
        } }
    }
}
