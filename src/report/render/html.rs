//! Blocks as a page that needs nothing else: nothing to load, and no script to be read; its own
//! adds what one can do with poses. Its figures are files of their own as well.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::markdown::markdown;
use super::poses;
use super::style;
use super::text::marked;
use crate::error::is_hidden;
use crate::problem::Problem;
use crate::report::document::{Bar, Block, CODE, Headline, Mark, Point, Table};
use crate::report::figures::Drawing;

/// Half the width of a bar in standard errors: wider changes run off it.
const REACH: f64 = 10.0;

/// What a page does beyond being read, and the arm in three dimensions.
const SCRIPTS: [&str; 2] = [include_str!("page.js"), include_str!("view.js")];

/// A report for people.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Report {
    /// In brief and without figures.
    pub markdown: String,
    /// The whole page: nothing to load, and no script needed to read it.
    pub html: String,
    /// File name and SVG text of every figure.
    pub figures: Vec<(String, String)>,
}

/// The report of some blocks; `kind` says what was done.
pub(in crate::report) fn report(problem: &Problem, kind: &str, blocks: &[Block]) -> Report {
    let title = if problem.title.is_empty() { &problem.name } else { &problem.title };
    let mut figures = Vec::new();
    let body = sections(blocks, &mut figures);
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
                        positions. Before: the nominal arm, with base and tool fitted where they are free, unless the page says \
                        otherwise. Held-out poses decided nothing: no parameter was fitted to them and no effect chosen by them."
                        @if !figures.is_empty() { " Every figure is also a file in the folder figures." }
                    }
                }
                script { (PreEscaped(SCRIPTS.concat())) }
            }
        }
    };
    let files =
        figures.iter().map(|own| (format!("{}.svg", own.name), printable(&style::alone(&own.svg))));
    let html = printable(&page.into_string());
    Report { markdown: markdown(&problem.title, blocks), figures: files.collect(), html }
}

/// What stands before the first heading, then a section for each heading.
fn sections<'a>(blocks: &'a [Block], figures: &mut Vec<&'a Drawing>) -> Markup {
    let shown = on_page(blocks);
    let starts: Vec<usize> =
        (1..shown.len()).filter(|&k| matches!(shown[k], Block::Heading(_))).collect();
    let ends = starts.iter().copied().chain([shown.len()]);
    let parts = std::iter::once(0).chain(starts.iter().copied()).zip(ends);
    html! {
        @for (from, to) in parts { section { @for block in &shown[from..to] { (one(block, figures)) } } }
    }
}

/// What the page shows, one after another.
fn on_page<'a, 'b>(blocks: &'b [Block<'a>]) -> Vec<&'b Block<'a>> {
    let mut all = Vec::new();
    for block in blocks {
        match block {
            Block::Page(inner) => all.extend(on_page(inner)),
            Block::Words(_) => {}
            shown => all.push(shown),
        }
    }
    all
}

fn one<'a>(block: &'a Block, figures: &mut Vec<&'a Drawing>) -> Markup {
    html! {
        @match block {
            Block::Heading(text) => h2 { (words(text)) },
            Block::Text(text) => p { (words(text)) },
            Block::Note(text) => p.note { (words(text)) },
            Block::Lines(text, points) => {
                p { (words(text)) }
                @if !points.is_empty() { ul.plain { @for point in points { li.skip { (words(point)) } } } }
            },
            Block::List(points) => ul.plain { @for point in points { (item(point)) } },
            Block::Ranking(points) => ol { @for point in points { (item(point)) } },
            Block::Table(own) => (table(own)),
            Block::Headline(own) => (headline(own)),
            Block::Blanks(own) => dl.blanks { @for term in own { div { dt { (term) } dd {} } } },
            Block::Poses(own) => (poses::section(own)),
            Block::Figures(own) => (grid(own, figures)),
            Block::Folded(title, inner, on_paper) => {
                details { summary { (words(title)) } @for block in inner { (one(block, figures)) } }
                p.folded { (words(on_paper)) }
            },
            Block::Page(inner) => @for block in on_page(inner) { (one(block, figures)) },
            Block::Words(_) => "",
        }
    }
}

/// Words with their code.
fn words(text: &str) -> Markup {
    let mut parts = Vec::new();
    for (k, part) in text.split(CODE.0).enumerate() {
        let (code, plain) =
            if k == 0 { ("", part) } else { part.split_once(CODE.1).unwrap_or((part, "")) };
        parts.push([code, plain]);
    }
    html! {
        @for [code, plain] in &parts { @if !code.is_empty() { code { (code) } } (plain) }
    }
}

/// Without control characters, which no page may have, and others that are not seen but do
/// something.
fn printable(text: &str) -> String {
    text.chars().filter(|&c| c == '\n' || !is_hidden(c)).collect()
}

fn item(point: &Point) -> Markup {
    let class = point.mark.map(|mark| match mark {
        Mark::Failed => "fail",
        Mark::Passed => "pass",
        Mark::Untested => "skip",
    });
    html! {
        li class=[class] {
            (words(&marked(point)))
            @if !point.details.is_empty() { ul { @for detail in &point.details { li { (words(detail)) } } } }
        }
    }
}

/// Before → after, as large as it deserves, and facts.
fn headline(own: &Headline) -> Markup {
    html! {
        @let last = own.states.len().saturating_sub(1);
        div.big {
            @for (k, (label, error)) in own.states.iter().enumerate() {
                @if k > 0 { span.arrow { "→" } }
                span.state {
                    span class=(if k == last { "now" } else { "was" }) { (error) @if k == last { " " span.unit { (own.unit) } } }
                    span.label { (label) }
                }
            }
        }
        p.under { "mean error on " (own.of) }
        dl.facts { @for (term, value) in &own.facts { div { dt { (term) } dd { (value) } } } }
    }
}

fn table(table: &Table) -> Markup {
    let class = |k: usize| match (table.left.contains(&k), table.minor.contains(&k)) {
        (true, true) => Some("l o"),
        (true, false) => Some("l"),
        (false, true) => Some("o"),
        (false, false) => None,
    };
    // A minus is wider than a hyphen, and names keep their hyphens.
    let cell = |k: usize, text: &str| {
        if table.left.contains(&k) { text.to_owned() } else { text.replace('-', "−") }
    };
    let bars = table.bars.as_ref();
    html! {
        @for note in &table.notes { p.o { (words(note)) } }
        @if bars.is_some() {
            p.o { "bars: the change from nominal in units of its standard error, up to ten either way, with one standard error about \
                it; changes beyond that rest at the end, an orange mark there is a bound" }
        }
        // Rows that continue those above keep their places.
        @let sorts = table.rows.len() > 3 && table.rows.iter().all(|row| row.first().is_some_and(|cell| !cell.is_empty()));
        div.scroll tabindex="0" role="region" aria-label={ "table: " (table.header.iter().find(|head| !head.is_empty()).unwrap_or(&"")) } { table.sort[sorts] {
            thead { tr {
                @for (k, text) in table.header.iter().enumerate() { th class=[class(k)] { (text) } }
                @if let Some((title, _)) = bars { th.l.o { (title) } }
            } }
            tbody {
                @for (index, row) in table.rows.iter().enumerate() { tr {
                    @for (k, text) in row.iter().enumerate() { td class=[class(k)] { (words(&cell(k, text))) } }
                    @if let Some((_, bars)) = bars { td.l.o { (bar(&bars[index])) } }
                } }
            }
        } }
    }
}

/// The change in standard errors about nominal, with one standard error about it.
fn bar(own: &Bar) -> Markup {
    let place = |sigmas: f64| 50.0 + 50.0 * (sigmas / REACH).clamp(-1.0, 1.0);
    html! {
        @if let Some(bound) = own.bound {
            span.bar { i {} u {} b.at.out style=(format!("left:{:.0}%", 100.0 * bound)) {} }
        } @else if let Some(change) = own.change.filter(|change| change.is_finite()) {
            @let (from, to) = (place(change - 1.0), place(change + 1.0));
            span.bar title=(format!("{change:.1} σ")) {
                i {} u {}
                b style=(format!("left:{from:.1}%;width:{:.1}%", to - from)) {}
                b.at style=(format!("left:{:.1}%", place(change))) {}
            }
        }
    }
}

/// A table as an address that holds it.
fn address(csv: &str) -> String {
    let escapes =
        [("%", "%25"), ("#", "%23"), ("\n", "%0A"), ("\r", ""), (" ", "%20"), ("/", "%2F")];
    let csv = escapes
        .into_iter()
        .fold(csv.to_owned(), |text, (letter, escape)| text.replace(letter, escape));
    format!("data:text/csv;charset=utf-8,{csv}")
}

/// Figures side by side where there is room, numbered after those that were shown.
fn grid<'a>(new: &'a [Drawing], shown: &mut Vec<&'a Drawing>) -> Markup {
    let first = shown.len() + 1;
    let grid = html! {
        @if !new.is_empty() {
            div.grid {
                @for (k, figure) in new.iter().enumerate() {
                    figure id=(figure.name) {
                        (PreEscaped(&figure.svg))
                        figcaption {
                            b { "Figure " (first + k) ". " (figure.title) }
                            (figure.caption) " "
                            a.data download={ (figure.name) ".csv" } href=(address(&figure.data.csv())) { "Data of this figure (CSV)" }
                        }
                    }
                }
            }
        }
    };
    shown.extend(new);
    grid
}
