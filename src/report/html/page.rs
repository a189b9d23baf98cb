//! The frame of every report.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::figures::Figure;
use super::style;
use crate::problem::Problem;

/// A page with its title; `kind` says what was done.
pub(super) fn whole(problem: &Problem, kind: &str, body: &Markup) -> String {
    let title = if problem.title.is_empty() { &problem.name } else { &problem.title };
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) " – " (kind) }
                // An empty picture of its own, so that no browser asks for one.
                link rel="icon" href="data:,";
                style { (PreEscaped(style::sheet())) }
            }
            body {
                main {
                    header {
                        h1 { (title) }
                        p.kind { (problem.name) ", " (kind) }
                    }
                    (body)
                    footer {
                        "Made by flexcal " (env!("CARGO_PKG_VERSION")) ". Errors are distances between measured and predicted \
                        positions. Held-out poses decided nothing: no parameter was fitted to them and no effect chosen by them. \
                        Every figure is also a file in the folder figures."
                    }
                }
            }
        }
    };
    page.into_string()
}

/// A part of the page.
pub(super) fn section(title: &str, body: &Markup) -> Markup {
    html! { section { h2 { (title) } (body) } }
}

/// Figures side by side where there is room, numbered from `first`.
pub(super) fn grid(figures: &[Figure], first: usize) -> Markup {
    html! {
        @if !figures.is_empty() {
            div.grid {
                @for (k, figure) in figures.iter().enumerate() {
                    figure id=(figure.name) {
                        (PreEscaped(&figure.svg))
                        figcaption { b { "Figure " (first + k) ". " (figure.title) } (figure.caption) }
                    }
                }
            }
        }
    }
}
