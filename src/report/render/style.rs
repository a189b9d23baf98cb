//! How page and figures look, light and dark, on a screen, a phone and paper.

use std::fmt::Write as _;

use plotters::style::RGBColor;

use crate::report::figures::{ACCENT, FAINT, GRID, INK, MUTED, WARM};

/// Colours of the figures with the names and the values that they have on a dark page.
const COLOURS: [(RGBColor, &str, &str); 6] = [
    (INK, "ink", "#e6e9ec"),
    (MUTED, "muted", "#9aa4ae"),
    (FAINT, "faint", "#77828d"),
    (GRID, "grid", "#2a3138"),
    (ACCENT, "accent", "#58a6ff"),
    (WARM, "warm", "#f08c52"),
];
const LIGHT_PAPER: &str = "#ffffff";
const DARK_PAPER: &str = "#14181c";

const LAYOUT: &str = "\
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:var(--paper);color:var(--ink);font:16px/1.5 system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif;font-variant-numeric:tabular-nums}
main{max-width:1120px;margin:0 auto;padding:40px 28px 64px}
h1{font-size:26px;line-height:1.25;font-weight:650;margin:0;letter-spacing:-.01em}
h2{font-size:19px;font-weight:650;margin:52px 0 14px;padding-top:14px;border-top:1px solid var(--grid)}
h3{font-size:16px;font-weight:600;margin:0 0 2px}
p{margin:8px 0;max-width:72ch}
.kind{color:var(--muted);margin:4px 0 0}
.big{display:flex;flex-wrap:wrap;align-items:baseline;gap:6px 18px;margin:30px 0 2px;font-size:50px;line-height:1.1;font-weight:650;letter-spacing:-.02em}
.big .was{color:var(--muted);font-weight:500}
.big .arrow{color:var(--faint);font-weight:400}
.big .now{color:var(--accent)}
.big .unit{font-size:20px;font-weight:500;letter-spacing:0;color:var(--muted)}
.under{color:var(--muted);margin:4px 0 22px}
.note{border-left:3px solid var(--warm);padding:2px 0 2px 14px;margin:16px 0}
dl.facts{max-width:1000px;display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,150px),1fr));gap:14px 24px;margin:22px 0 0}
dl.facts dt{color:var(--muted);font-size:13px}
dl.facts dd{margin:0;font-weight:600}
.grid{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,440px),1fr));gap:36px 40px;align-items:start;margin:16px 0}
figure{margin:0;min-width:0;max-width:560px;break-inside:avoid}
figure svg{display:block;width:100%;height:auto}
figure svg text{font-family:inherit}
figcaption{font-size:14px;color:var(--muted);margin-top:8px}
figcaption b{display:block;color:var(--ink);font-size:15px;font-weight:600;margin-bottom:2px}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:14px;margin:8px 0}
th{text-align:right;font-weight:500;color:var(--muted);font-size:13px;padding:4px 10px;border-bottom:1px solid var(--faint);white-space:nowrap}
td{text-align:right;padding:3px 10px;border-bottom:1px solid var(--grid);white-space:nowrap}
th.l,td.l{text-align:left}
th:first-child,td:first-child{padding-left:0}
td.w{white-space:normal}
td.q{color:var(--muted)}
.bar{display:block;width:150px;height:14px;position:relative}
.bar i,.bar b,.bar u{position:absolute;display:block}
.bar i{left:0;right:0;top:6.5px;height:1px;background:var(--grid)}
.bar u{left:50%;top:1px;width:1px;height:12px;background:var(--faint)}
.bar b{top:5px;height:4px;min-width:2px;background:var(--accent);opacity:.4;border-radius:2px}
.bar b.at{opacity:1;width:4px;margin-left:-2px}
.bar b.out{background:var(--warm)}
ul.plain{list-style:none;padding:0;margin:10px 0}
ul.plain li{padding:3px 0 3px 24px;position:relative;max-width:80ch;font-size:14px;line-height:1.45}
ul.plain li::before{position:absolute;left:2px;font-weight:700}
li.pass::before{content:'\\2713';color:var(--muted)}
li.fail::before{content:'\\2717';color:var(--warm)}
li.skip::before{content:'\\2013';color:var(--faint)}
li.skip{color:var(--muted)}
.columns{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,400px),1fr));gap:8px 40px}
ol{padding-left:24px;max-width:80ch}
ol>li{margin:8px 0;font-weight:600;break-inside:avoid}
ol ul{list-style:none;padding:0;font-weight:400;font-size:14px;line-height:1.45}
details{margin:8px 0}
summary{cursor:pointer;color:var(--accent);font-size:14px}
.folded{display:none}
code{font:13px ui-monospace,SFMono-Regular,Menlo,Consolas,monospace}
footer{margin-top:56px;padding-top:14px;border-top:1px solid var(--grid);font-size:13px;color:var(--muted)}
@media (max-width:560px){main{padding:24px 16px 40px}h1{font-size:22px}.big{font-size:34px;gap:4px 12px}h2{margin-top:40px}.bar{width:64px}td,th{padding:3px 6px}th{white-space:normal}.o{display:none}table{font-size:13px}td.l:first-child{white-space:normal;overflow-wrap:anywhere}}
@media print{@page{margin:12mm}body{font-size:10.5pt}main{max-width:none;padding:0}.grid{grid-template-columns:1fr 1fr;gap:18px 22px}figure:last-child:nth-child(odd){grid-column:1/-1;max-width:98mm}ol>li{margin:4px 0}h3{break-after:avoid}h2{margin:20px 0 8px;padding-top:10px;break-after:avoid}dl.facts{margin:14px 0 0;gap:8px 20px}.big{margin-top:18px}.under{margin-bottom:12px}.big{font-size:34px}.scroll{overflow:visible}table{font-size:8.5pt}td,th{padding:2px 6px}tr{break-inside:avoid}figcaption,ul.plain li{font-size:9pt}.columns{grid-template-columns:1fr 1fr;gap:4px 22px}.bar{width:80px;-webkit-print-color-adjust:exact;print-color-adjust:exact}details:not([open]){display:none}details:not([open])+.folded{display:block}}
";

fn hex(colour: RGBColor) -> String {
    format!("#{:02X}{:02X}{:02X}", colour.0, colour.1, colour.2)
}

/// The variables of both themes; paper is always light.
fn themes(root: &str) -> String {
    let mut text = format!("{root}{{color-scheme:light dark;--paper:{LIGHT_PAPER}");
    for (light, name, _) in COLOURS {
        let _ = write!(text, ";--{name}:{}", hex(light));
    }
    let _ = write!(text, "}}\n@media screen and (prefers-color-scheme:dark){{{root}{{--paper:{DARK_PAPER}");
    for (_, name, dark) in COLOURS {
        let _ = write!(text, ";--{name}:{dark}");
    }
    text.push_str("}}\n");
    text
}

/// What the drawings' own colours become.
fn exchanged() -> String {
    let mut text = String::new();
    for (light, name, _) in COLOURS {
        let light = hex(light);
        let _ = writeln!(text, "[fill=\"{light}\"]{{fill:var(--{name})}}[stroke=\"{light}\"]{{stroke:var(--{name})}}");
    }
    text
}

/// The style sheet of a page.
pub(super) fn sheet() -> String {
    format!("{}{LAYOUT}{}", themes(":root"), exchanged())
}

/// A figure that stands alone: with its own themes.
pub(super) fn alone(svg: &str) -> String {
    let style = format!("<style>{}svg{{background:var(--paper)}}\n{}</style>\n", themes("svg"), exchanged());
    match svg.split_once('>') {
        Some((head, body)) => format!("{head}>\n{style}{}\n", body.trim_start()),
        None => svg.to_owned(),
    }
}
