//! Names with special characters in terminal output, reports and figures.

use std::fs;

use flexcal::error::is_hidden;

use crate::common::program::Folder;

/// Invisible texts: escape sequences of both widths, a bell, a line break, a mark of writing
/// direction, a tag, a non-character.
const HIDDEN: [&str; 8] =
    ["\u{1b}[2J", "\u{9b}31m", "\u{7}", "\n", "\u{202e}", "\u{200f}", "\u{e0041}", "\u{ffff}"];

/// Visible names with a meaning in Markdown, HTML or SVG.
const ACTIVE: [&str; 8] = [
    "`x` ![x](https://example.org/x.png)",
    "[x](javascript:alert(1))",
    "<script>alert(1)</script>",
    "]]>&lt;x&amp;'\"",
    "# x | y",
    "https://example.org www.example.org",
    "<!-- x",
    "$(x) %s {{x}} \\",
];

const TABLE: &str = "q1_deg,q2_deg,x_mm,y_mm,z_mm,session,target,split\n";

/// Returns a planar arm with a title; its session and target have the given name.
fn arm(title: &str, name: &str) -> Folder {
    let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
    let problem = format!(
        "name = 'arm'\ntitle = {}\n[[joint]]\nname = {}\na_m = 0.4\n[[joint]]\na_m = 0.3\n[tool]\ntarget_m = [0.5, 0, 0]\n[parameters]\n\
             'joint2.a' = {{ sigma_mm = 3 }}\n'tool*.y' = {{ sigma_mm = 3 }}\n[data]\nfiles = ['rows.csv']\nposition_sigma_mm = 0.1\n",
        quoted(title),
        quoted(title),
    );
    let name = format!("\"{}\"", name.replace('"', "\"\""));
    let row = |k: i32| {
        let (one, other) = (f64::from(k * 37 % 180), f64::from(k * 71 % 120 - 60));
        let (a, b) = (one.to_radians(), (one + other).to_radians());
        let (x, y) = (400.0 + 301.0 * a.cos() + 500.0 * b.cos(), 301.0 * a.sin() + 500.0 * b.sin());
        let split = if k % 3 == 0 { "validation" } else { "identification" };
        format!("{one},{other},{x:.3},{y:.3},{}.0,{name},{name},{split}\n", k % 2)
    };
    let table = TABLE.to_owned() + &(0..30).map(row).collect::<String>();
    Folder::with([("problem.toml", &problem), ("rows.csv", &table)])
}

/// Runs a command and returns its status and all printed output.
fn run(folder: &Folder, arguments: &str) -> (i32, String) {
    let run = folder.flexcal(arguments);
    (run.status, run.stdout + &run.stderr)
}

#[test]
fn what_is_not_seen_is_refused_by_name_and_never_printed() {
    for hidden in HIDDEN {
        let (name, code) =
            (format!("A{hidden}B"), format!("U+{:04X}", u32::from(hidden.chars().next().unwrap())));
        for (folder, place) in [
            (arm(&name, "A"), "problem.toml:2: title: "),
            (arm("arm", &name), "rows.csv:2: column session: "),
        ] {
            for command in ["identify", "loop", "compare"] {
                let (status, printed) = run(&folder, &format!("{command} . --json"));
                assert!(
                    status == 2 && printed.contains(place) && printed.contains(&code),
                    "{place}{status} {printed:?}"
                );
                assert!(
                    printed.chars().all(|letter| letter == '\n' || !is_hidden(letter)),
                    "{printed:?}"
                );
                assert!(!folder.has("out"));
            }
        }
    }
    // If the name of a file, key, column or word is itself the error, it is shown without the
    // invisible characters.
    let folder = arm("arm", "A");
    for hidden in HIDDEN.iter().filter(|hidden| **hidden != "\n") {
        let (key, column) = (format!("k{hidden}k"), format!("c{hidden}c"));
        let quoted = toml::Value::String(key).to_string();
        let wrong = format!("[tool]\n{quoted} = 1");
        folder.write("wrong.toml", folder.read("problem.toml").replace("[tool]", &wrong));
        let header = format!("split,{column}");
        folder
            .write(format!("{column}.csv"), folder.read("rows.csv").replacen("split", &header, 1));
        for arguments in [
            "identify wrong.toml".to_owned(),
            format!("identify . --data {column}.csv"),
            format!("identify {column}"),
        ] {
            let (status, printed) = run(&folder, &arguments);
            assert!(
                status == 2 && printed.contains("error: "),
                "{arguments:?}: {status} {printed:?}"
            );
            assert!(
                printed.chars().all(|letter| letter == '\n' || !is_hidden(letter)),
                "{arguments:?}: {printed:?}"
            );
        }
    }
}

#[test]
fn what_is_seen_is_text_and_nothing_else() {
    for name in ACTIVE {
        let folder = arm(name, name);
        let (status, printed) = run(&folder, "compare . --out compared");
        assert!(status < 2, "{name}: {printed}");
        let (status, printed) = run(&folder, "identify . --out out");
        assert!(status < 2 && printed.contains(name), "{name}: {printed}");
        let report = folder.read("out/report.md");
        let left = ["](", "](http", "<script", "<!--", "`x`", "![", "https://", "www.e", "&lt;"];
        // Without its escapes, the report contains no markup from a name.
        let unescaped: String = report
            .split("\\\\")
            .map(|part| {
                let mut marks = part.split('\\');
                let first = marks.next().unwrap_or_default().to_owned();
                marks.fold(first, |text, mark| text + "\u{b7}" + mark.get(1..).unwrap_or_default())
            })
            .collect();
        for mark in left.into_iter().filter(|mark| name.contains(*mark)) {
            assert!(!unescaped.contains(mark), "{name}: {mark} is active in\n{report}");
        }
        let mut drawn = 0;
        for figures in ["out/figures", "compared/figures"] {
            for entry in fs::read_dir(folder.path(figures)).unwrap() {
                let path = entry.unwrap().path();
                let text = fs::read_to_string(&path).unwrap();
                assert_eq!(ill_formed(&text), None, "{name}: {}\n{text}", path.display());
                drawn += 1;
            }
        }
        assert!(drawn > 3);
        let page = folder.read("out/report.html");
        // The only scripts are the page's script and its data.
        assert!(page.matches("<script").count() == 2 && !page.contains("<!-- x"), "{name}");
        assert_eq!(page.matches("</script>").count(), 2, "{name}");
    }
}

/// Returns an error of a text as XML, for the subset that figures use.
fn ill_formed(text: &str) -> Option<String> {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('<') {
        if let Some((_, entity)) = before.split_once('&')
            && !["lt;", "gt;", "amp;", "quot;", "apos;", "#"]
                .iter()
                .any(|known| entity.starts_with(known))
        {
            return Some(format!("&{entity}"));
        }
        let Some((tag, next)) = after.split_once('>') else { return Some(after.to_owned()) };
        rest = next;
        let name = tag.trim_start_matches('/').split([' ', '\n', '/']).next().unwrap_or_default();
        if tag.starts_with('/') {
            if open.pop() != Some(name) {
                return Some(tag.to_owned());
            }
        } else if !tag.ends_with('/') {
            if tag.matches('"').count() % 2 == 1 || tag.contains('<') {
                return Some(tag.to_owned());
            }
            open.push(name);
            if name == "style" {
                rest = &rest[rest.find("</style>")?..];
            }
        }
    }
    if text.chars().any(|letter| letter != '\n' && is_hidden(letter)) {
        return Some("a hidden character".to_owned());
    }
    open.pop().map(str::to_owned)
}
