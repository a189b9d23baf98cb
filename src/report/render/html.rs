//! Rendering of blocks as one self-contained HTML page, and as a report with Markdown and with
//! figures in separate files. Scripts of the page add interaction with poses.

use std::fmt::Write as _;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::markdown::markdown;
use super::poses;
use super::style;
use super::text::{text, with_outcome};
use crate::error::is_hidden;
use crate::problem::Problem;
use crate::report::document::{Bar, Block, CODE, Headline, Mark, Point, Table};
use crate::report::figures::Drawing;

/// Change in standard errors at which a bar ends; larger changes end there too.
const BAR_SIGMAS: f64 = 10.0;

/// Number of characters above which a word in a table may be broken.
const MAX_UNBROKEN_WORD: usize = 32;
/// Number of characters above which a text in a table takes several lines.
const MAX_UNBROKEN_CELL: usize = 60;
/// Number of columns above which the headings of a table may take several lines.
const MAX_ONE_LINE_COLUMNS: usize = 9;

/// Scripts of the page: interaction, and the three-dimensional view of the arm.
const SCRIPTS: [&str; 2] = [include_str!("page.js"), include_str!("view.js")];

/// Sentences at the end of a report that explain its errors.
const ERRORS_NOTE: &str = " Errors are distances between measured and predicted positions. Nominal arm, or before: the arm without a fit, \
                      except for its free base and tool parameters, unless a note under the table \
                      says otherwise. Held-out poses only \
                      judge: no parameter is fitted to them and no effect chosen by them.";

/// Report in two formats, with its figures.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Report {
    /// Short version without figures.
    pub markdown: String,
    /// Self-contained page that is readable without scripts.
    pub html: String,
    /// File name and SVG text of each figure.
    pub figures: Vec<(String, String)>,
}

/// Renders blocks as a report on a problem; `kind` names the analysis in the title of the page.
pub(in crate::report) fn report(problem: &Problem, kind: &str, blocks: &[Block]) -> Report {
    let title = if problem.title.is_empty() { &problem.name } else { &problem.title };
    let (html, figures) =
        render_page(title, [&format!("{}, ", problem.name), kind], ERRORS_NOTE, blocks);
    let files = figures
        .iter()
        .map(|figure| (format!("{}.svg", figure.name), printable(&style::standalone(&figure.svg))));
    Report { markdown: markdown(&problem.title, blocks), figures: files.collect(), html }
}

/// Result of a command in words, for its screen and for a page without separate files.
#[doc(hidden)]
#[derive(Debug)]
pub struct Story {
    title: String,
    /// Name of the analysis in the title of the page.
    kind: &'static str,
    blocks: Vec<Block<'static>>,
}

impl Story {
    pub(in crate::report) fn new(
        title: &str,
        kind: &'static str,
        blocks: Vec<Block<'static>>,
    ) -> Self {
        Self { title: title.to_owned(), kind, blocks }
    }

    /// Returns the text for terminals, ending in a line break.
    pub fn text(&self) -> String {
        text(&self.blocks)
    }

    /// Returns the page.
    pub fn page(&self) -> String {
        render_page(&self.title, ["", self.kind], "", &self.blocks).0
    }
}

/// Renders blocks as a page, and returns it with its figures. `before_kind` precedes the kind in
/// the heading; `note` stands at the end of the page.
fn render_page<'a>(
    title: &str,
    [before_kind, kind]: [&str; 2],
    note: &str,
    blocks: &'a [Block],
) -> (String, Vec<&'a Drawing>) {
    let mut figures = Vec::new();
    let body = sections(blocks, &mut figures);
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) " – " (kind) }
                // The empty icon prevents browsers from requesting one.
                link rel="icon" href="data:,";
                style { (PreEscaped(style::sheet())) }
            }
            body {
                main {
                    header {
                        h1 { (title) }
                        p.kind { (before_kind) (kind) }
                    }
                    (body)
                    footer {
                        "Made by flexcal " (env!("CARGO_PKG_VERSION")) "." (note)
                        @if !figures.is_empty() && !note.is_empty() { " Every figure is also a file in the folder figures." }
                    }
                }
                script { (PreEscaped(SCRIPTS.concat())) }
            }
        }
    };
    (numbered_tables(&printable(&page.into_string())), figures)
}

/// Beginning of the label of a table's scrolling region, before the region has its number.
const TABLE_LABEL: &str = "table: ";

/// Numbers the labels of the scrolling regions of a page's tables, so that no two are the same.
fn numbered_tables(page: &str) -> String {
    let attribute = format!("aria-label=\"{TABLE_LABEL}");
    let mut parts = page.split(attribute.as_str());
    let mut numbered = parts.next().unwrap_or_default().to_owned();
    for (part, number) in parts.zip(1..) {
        let _ = write!(numbered, "aria-label=\"table {number}: {part}");
    }
    numbered
}

/// Renders the blocks before the first heading, then a section for each heading.
fn sections<'a>(blocks: &'a [Block], figures: &mut Vec<&'a Drawing>) -> Markup {
    let shown = page_blocks(blocks);
    let starts: Vec<usize> =
        (1..shown.len()).filter(|&k| matches!(shown[k], Block::Heading(_))).collect();
    let ends = starts.iter().copied().chain([shown.len()]);
    let parts = std::iter::once(0).chain(starts.iter().copied()).zip(ends);
    html! {
        @for (from, to) in parts { section { @for item in &shown[from..to] { (block(item, figures)) } } }
    }
}

/// Returns the blocks that the page shows, in order, without nesting.
fn page_blocks<'a, 'b>(blocks: &'b [Block<'a>]) -> Vec<&'b Block<'a>> {
    let mut shown = Vec::new();
    for block in blocks {
        match block {
            Block::Page(inner) => shown.extend(page_blocks(inner)),
            Block::Words(_) => {}
            block => shown.push(block),
        }
    }
    shown
}

/// Renders one block, and adds its figures to `figures`.
fn block<'a>(item: &'a Block, figures: &mut Vec<&'a Drawing>) -> Markup {
    html! {
        @match item {
            Block::Heading(text) => h2 { (words(text)) },
            Block::Text(text) => p { (words(text)) },
            Block::Note(text) => p.note { (words(text)) },
            Block::Lines(text, points) => {
                p { (words(text)) }
                @if !points.is_empty() { ul.plain { @for point in points { li.skip { (words(point)) } } } }
            },
            Block::List(points) => ul.plain { @for point in points { (list_item(point)) } },
            Block::Ranking(points) => ol { @for point in points { (list_item(point)) } },
            Block::Table(content) => (table(content)),
            Block::Headline(content) => (headline(content)),
            Block::Outcome { word, of, is_good } => {
                div.big { span.state {
                    span class=(if *is_good { "now" } else { "bad" }) { (word) }
                    span.label { (of) }
                } }
            },
            Block::Blanks(terms) => dl.blanks { @for term in terms { div { dt { (term) } dd {} } } },
            Block::Poses(data) => (poses::section(data)),
            Block::Figures(drawings) => (grid(drawings, figures)),
            Block::Folded(title, inner, on_paper) => {
                details { summary { (words(title)) } @for item in inner { (block(item, figures)) } }
                p.folded { (words(on_paper)) }
            },
            Block::Page(inner) => @for item in page_blocks(inner) { (block(item, figures)) },
            Block::Words(_) => "",
        }
    }
}

/// Renders text with its code spans. Words of code with hyphens are not broken there.
fn words(text: &str) -> Markup {
    let mut parts = Vec::new();
    for (k, part) in text.split(CODE.0).enumerate() {
        let (code, plain) =
            if k == 0 { ("", part) } else { part.split_once(CODE.1).unwrap_or((part, "")) };
        parts.push([code, plain]);
    }
    html! {
        @for [code, plain] in &parts { @if !code.is_empty() { (unbroken(code)) } (with_signs(plain)) }
    }
}

/// Renders code; its words of moderate length are not broken at hyphens.
fn unbroken(code: &str) -> Markup {
    let is_kept = |word: &str| word.contains('-') && word.chars().count() <= MAX_UNBROKEN_WORD;
    html! {
        code {
            @for (k, word) in code.split(' ').enumerate() {
                @if k > 0 { " " }
                @if is_kept(word) { span.w { (word) } } @else { (word) }
            }
        }
    }
}

/// Returns a sentence in which negative numbers have a minus sign and stay beside the word before,
/// except in assignments such as `offset_s = -3.5`, which are copied.
fn with_signs(sentence: &str) -> String {
    let mut signed = String::with_capacity(sentence.len());
    let is_number = |rest: &&str| rest.starts_with(|letter: char| letter.is_ascii_digit());
    // Number of open brackets of an assignment; `None` outside of one.
    let mut assigned: Option<usize> = None;
    for (k, word) in sentence.split(' ').enumerate() {
        let count = |brackets: [char; 2]| word.matches(brackets).count();
        let is_value = assigned.is_some();
        assigned = match assigned {
            None => (word == "=").then_some(0),
            Some(open) => Some((open + count(['[', '{'])).saturating_sub(count([']', '}'])))
                .filter(|&open| open > 0),
        };
        let opening = word.find(|letter| letter != '(' && letter != '[').unwrap_or(0);
        let (before, rest) = word.split_at(opening);
        let number = rest.strip_prefix('-').filter(is_number).filter(|_| !is_value);
        match (k, number) {
            (0, Some(number)) if sentence.len() > word.len() => {
                signed.extend([before, "−", number]);
            }
            (0, _) => signed.push_str(word),
            (_, None) => signed.extend([" ", word]),
            (_, Some(number)) => {
                let space = if before.is_empty() { "\u{a0}" } else { " " };
                signed.extend([space, before, "−", number]);
            }
        }
    }
    signed
}

/// Removes control characters (except line breaks) and other invisible characters.
fn printable(text: &str) -> String {
    text.chars().filter(|&c| c == '\n' || !is_hidden(c)).collect()
}

/// Renders a list item with its details.
fn list_item(point: &Point) -> Markup {
    let class = point.mark.map(|mark| match mark {
        Mark::Failed => "fail",
        Mark::Passed => "pass",
        Mark::Untested => "skip",
    });
    html! {
        li class=[class] {
            (words(&with_outcome(point)))
            @if !point.details.is_empty() { ul { @for detail in &point.details { li { (words(detail)) } } } }
        }
    }
}

/// Renders the summary at the top of a page: errors of all states, and facts.
fn headline(headline: &Headline) -> Markup {
    html! {
        @let last = headline.states.len().saturating_sub(1);
        div.big {
            @for (k, (label, error)) in headline.states.iter().enumerate() {
                @if k > 0 { span.arrow { "→" } }
                span.state {
                    span class=(if k == last && !headline.is_doubtful { "now" } else { "was" }) { (error) @if k == last { " " span.unit { (headline.unit) } } }
                    span.label { (label) }
                }
            }
        }
        p.under { "mean error at " (headline.of) }
        dl.facts { @for (term, value) in &headline.facts { div { dt { (term) } dd { (value) } } } }
    }
}

/// Renders a table with its notes above it.
fn table(table: &Table) -> Markup {
    // On narrow pages the unit stands behind the name, because the numbers fill the width.
    let unit = table.header.iter().position(|head| head == "unit").filter(|&k| k > 0);
    let class = |k: usize| match (table.left.contains(&k), table.minor.contains(&k)) {
        (true, _) if unit == Some(k) => Some("l wide"),
        (true, true) => Some("l o"),
        (true, false) => Some("l"),
        (false, true) => Some("o"),
        (false, false) => None,
    };
    // Long words, such as digests, may be broken anywhere.
    let classes = |k: usize, text: &str| {
        let is_long = text.split_whitespace().any(|word| word.chars().count() > MAX_UNBROKEN_WORD);
        let is_sentence = text.chars().count() > MAX_UNBROKEN_CELL;
        let is_short = text.chars().count() <= MAX_UNBROKEN_WORD && text.contains(' ');
        match class(k) {
            Some(class) if is_long => Some(format!("{class} long")),
            Some(class) if is_sentence => Some(format!("{class} text")),
            Some(class) if is_short && k > 0 => Some(format!("{class} s")),
            class => class.map(str::to_owned),
        }
    };
    // Numbers get a minus sign instead of a hyphen; names keep their hyphens.
    let cell = |k: usize, text: &str| {
        if table.left.contains(&k) { text.to_owned() } else { text.replace('-', "−") }
    };
    let bars = table.bars.as_ref();
    html! {
        @for note in &table.notes { p { (words(note)) } }
        @if bars.is_some() {
            p.wide { "bars: the change from nominal in units of its standard error, limited to ±10, with an interval of one standard error; \
                larger changes are drawn at the edge; an orange mark is the bound at which the parameter rests" }
        }
        // Rows that continue the row above cannot be sorted.
        @let sorts = table.rows.len() > 3 && table.rows.iter().all(|row| row.first().is_some_and(|cell| !cell.is_empty()));
        div.scroll tabindex="0" role="region" aria-label={ (TABLE_LABEL) (table.header.iter().find(|head| !head.is_empty()).map_or("", String::as_str)) } { table.sort[sorts].many[table.header.len() > MAX_ONE_LINE_COLUMNS] {
            thead { tr {
                // An empty cell is no header.
                @for (k, text) in table.header.iter().enumerate() {
                    @if text.is_empty() { td class=[class(k)] {} } @else { th class=[class(k)] { (text) } }
                }
                @if let Some((title, _)) = bars { th.l.wide { (title) } }
            } }
            tbody {
                @for (index, row) in table.rows.iter().enumerate() { tr {
                    @for (k, text) in row.iter().enumerate() { td class=[classes(k, text)] {
                        (words(&cell(k, text)))
                        @if let Some(unit) = unit.and_then(|unit| row.get(unit)).filter(|unit| k == 0 && !unit.is_empty()) {
                            span.narrow { " [" (unit) "]" }
                        }
                    } }
                    @if let Some((_, bars)) = bars { td.l.wide { (bar(&bars[index])) } }
                } }
            }
        } }
    }
}

/// Renders the change of a parameter from nominal as a bar with an interval of ± 1 standard error,
/// or as a mark at an active bound.
fn bar(bar: &Bar) -> Markup {
    let position = |sigmas: f64| 50.0 + 50.0 * (sigmas / BAR_SIGMAS).clamp(-1.0, 1.0);
    html! {
        @if let Some(bound) = bar.bound {
            span.bar { i {} u {} b.at.out style=(format!("left:{:.0}%", 100.0 * bound)) {} }
        } @else if let Some(change) = bar.change.filter(|change| change.is_finite()) {
            @let (from, to) = (position(change - 1.0), position(change + 1.0));
            span.bar title=(format!("{change:.1} σ")) {
                i {} u {}
                b style=(format!("left:{from:.1}%;width:{:.1}%", to - from)) {}
                b.at style=(format!("left:{:.1}%", position(change))) {}
            }
        }
    }
}

/// Returns a data URL that contains a CSV table.
fn data_url(csv: &str) -> String {
    let escapes =
        [("%", "%25"), ("#", "%23"), ("\n", "%0A"), ("\r", ""), (" ", "%20"), ("/", "%2F")];
    let csv = escapes
        .into_iter()
        .fold(csv.to_owned(), |text, (letter, escape)| text.replace(letter, escape));
    format!("data:text/csv;charset=utf-8,{csv}")
}

/// Renders figures in a grid, numbered after those in `shown`, and adds them to `shown`.
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
                            a.data download={ (figure.name) ".csv" } href=(data_url(&figure.data)) { "Data of this figure (CSV)" }
                        }
                    }
                }
            }
        }
    };
    shown.extend(new);
    grid
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_numbers_in_sentences_have_a_minus_sign() {
        let poses = "measure at q1 -47.2°, q2 5.0°";
        assert_eq!(with_signs(poses), "measure at q1\u{a0}−47.2°, q2 5.0°");
        let range = "-0.24 mm, -0.29 to -0.19";
        assert_eq!(with_signs(range), "−0.24 mm,\u{a0}−0.29 to\u{a0}−0.19");
        for name in ["2025-03-18 --poses 3", " out-of-range", "-5"] {
            assert_eq!(with_signs(name), name);
        }
    }
}
