//! What the checks say of the residual, before and after.

use maud::{Markup, html};

use crate::diagnose::{ClosedLoop, Findings, ResidualTest};
use crate::report::findings::another_size;

/// Checks of both fits side by side.
pub(super) fn list(closure: &ClosedLoop) -> Markup {
    let (before, after) = (&closure.before, &closure.after);
    let another = another_size(&before.findings, before.fit.reduced_chi2)
        .or_else(|| another_size(&closure.findings, after.reduced_chi2));
    html! {
        div.columns {
            div { h3 { "Checks before" } (one(&before.findings)) }
            div { h3 { "Checks after" } (one(&closure.findings)) }
        }
        @if let Some(words) = another { p { (words) } }
    }
}

/// Checks of one fit with its own χ²/ν.
pub(super) fn of(findings: &Findings, chi2: Option<f64>) -> Markup {
    html! {
        h3 { "Checks" }
        (one(findings))
        @if let Some(words) = another_size(findings, chi2) { p { (words) } }
    }
}

fn one(findings: &Findings) -> Markup {
    let of = |check: &ResidualTest| match (&check.outcome, check.failed()) {
        (Err(_), _) => "skip",
        (Ok(_), true) => "fail",
        (Ok(_), false) => "pass",
    };
    html! {
        ul.plain {
            @for check in &findings.tests { li class=(of(check)) { (check.to_string()) } }
        }
    }
}
