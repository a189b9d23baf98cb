//! Style sheet of page and figures, for light and dark themes, screens and paper.

use std::fmt::Write as _;

use crate::report::figures::{ACCENT, Colour, FAINT, GRID, INK, MUTED, WARM};

/// Colours of the figures: value in the light theme, name, and value in the dark theme.
const COLOURS: [(Colour, &str, &str); 6] = [
    (INK, "ink", "#e6e9ec"),
    (MUTED, "muted", "#9aa4ae"),
    (FAINT, "faint", "#77828d"),
    (GRID, "grid", "#2a3138"),
    (ACCENT, "accent", "#58a6ff"),
    (WARM, "warm", "#f08c52"),
];
/// Background in the light theme and in print.
const LIGHT_PAPER: &str = "#ffffff";
/// Background in the dark theme.
const DARK_PAPER: &str = "#14181c";

/// Style rules of the page without colours.
const LAYOUT: &str = include_str!("page.css");

/// Returns the style rules that define the colour variables of both themes. Print always uses the
/// light theme.
fn theme_variables() -> String {
    let mut text = format!(":root{{color-scheme:light dark;--paper:{LIGHT_PAPER}");
    for (light, name, _) in COLOURS {
        let _ = write!(text, ";--{name}:{light}");
    }
    let _ = write!(
        text,
        "}}\n@media screen and (prefers-color-scheme:dark){{:root{{--paper:{DARK_PAPER}"
    );
    for (_, name, dark) in COLOURS {
        let _ = write!(text, ";--{name}:{dark}");
    }
    text.push_str("}}\n");
    text
}

/// Returns style rules that replace each colour of the figures by `colour(name, dark value)`.
fn colour_rules(colour: impl Fn(&'static str, &'static str) -> String) -> String {
    let mut text = String::new();
    for (light, name, dark) in COLOURS {
        let colour = colour(name, dark);
        let _ = writeln!(
            text,
            "[fill=\"{light}\"]{{fill:{colour}}}[stroke=\"{light}\"]{{stroke:{colour}}}"
        );
    }
    text
}

/// Returns the style sheet of a page.
pub(super) fn sheet() -> String {
    format!("{}{LAYOUT}{}", theme_variables(), colour_rules(|name, _| format!("var(--{name})")))
}

/// Returns the text of a figure as a separate SVG file: with a background, and with a dark theme
/// for viewers that support styles.
pub(super) fn standalone(svg: &str) -> String {
    let style = format!(
        "<style>@media screen and (prefers-color-scheme:dark){{\n[fill=\"{LIGHT_PAPER}\"]{{fill:{DARK_PAPER}}}\n{}}}</style>",
        colour_rules(|_, dark| dark.to_owned())
    );
    let paper = format!("<rect x=\"-50%\" width=\"200%\" height=\"100%\" fill=\"{LIGHT_PAPER}\"/>");
    match svg.split_once('>') {
        Some((head, body)) => format!("{head}>\n{style}\n{paper}\n{}\n", body.trim_start()),
        None => svg.to_owned(),
    }
}
