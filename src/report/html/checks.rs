//! What the checks say of the residual, before and after.

use maud::{Markup, html};

use crate::diagnosis::{Check, Findings};

/// Checks of both fits side by side.
pub(super) fn list(before: &Findings, after: &Findings) -> Markup {
    html! {
        div.columns {
            div { h3 { "Checks before" } (one(before)) }
            div { h3 { "Checks after" } (one(after)) }
        }
    }
}

/// Checks of one fit.
pub(super) fn of(findings: &Findings) -> Markup {
    html! {
        h3 { "Checks" }
        (one(findings))
    }
}

fn one(findings: &Findings) -> Markup {
    let of = |check: &Check| match (&check.outcome, check.failed()) {
        (Err(_), _) => "skip",
        (Ok(_), true) => "fail",
        (Ok(_), false) => "pass",
    };
    html! {
        ul.plain {
            @for check in &findings.checks { li class=(of(check)) { (check.to_string()) } }
        }
    }
}
