//! Verdict, statuses and sentences agree in data, JSON, text, Markdown and page on open cases.

use std::path::Path;

use flexcal::fit::{Finding, Options};
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use flexcal::report::{loop_brief, loop_report, loop_text};
use flexcal::results::{Document as _, FoundEffect, LoopResult, PlotData, ResidualTest};
use flexcal::select::{Status, Verdict, close};
use serde_json::Value;

/// Open cases: problem and tables.
const CASES: [(&str, &[&str]); 3] = [
    (
        "cases/problem.toml",
        &[
            "cases/a-none.csv",
            "cases/b-joint-harmonic.csv",
            "cases/c-link-thermal-bending.csv",
            "cases/d-backlash.csv",
            "cases/e-payload-mass.csv",
            "cases/f-two.csv",
            "cases/g-not-in-catalogue.csv",
            "cases/h-none-large.csv",
        ],
    ),
    (
        "honest/out.toml",
        &[
            "honest/out-cable-drag-speed-x-direction-joint-2-28.csv",
            "honest/out-frame-shear-xz-28.csv",
            "honest/out-order-2-43-of-joint-1-28.csv",
            "honest/out-random-walk-of-the-station-28.csv",
        ],
    ),
    ("honest/six.toml", &["honest/six-0.csv", "honest/six-4.csv"]),
];

/// Returns text without line breaks, marks of code, escapes and tags.
fn plain(text: &str) -> String {
    let mut words = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('<') {
        words.push_str(before);
        // A tag begins with a letter or a slash; anything else is "less than".
        let is_tag = after.starts_with(|c: char| c.is_ascii_alphabetic() || c == '/');
        match after.split_once('>') {
            Some((_, behind)) if is_tag => rest = behind,
            _ => {
                words.push('<');
                rest = after;
            }
        }
    }
    words.push_str(rest);
    let words =
        [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&amp;", "&"), ("\\", ""), ("`", "")]
            .into_iter()
            .fold(words, |words, (escape, letter)| words.replace(escape, letter));
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Returns the words with which every list of causes begins the entry of an effect.
fn claim(found: &FoundEffect) -> String {
    let words = plain(&found.effect.description);
    match (found.status, &found.claims) {
        (Status::Located, Some(claims)) if claims.place.probability < 0.5 => {
            "structure of unknown place and law".to_owned()
        }
        (Status::Located, Some(claims)) => {
            format!("located: {} (", claims.place.value)
        }
        (Status::Located, None) => {
            "located: only together with the others, not significant by itself".to_owned()
        }
        (Status::Found, _) => words,
        (status, _) => format!("{}: {words}", status.as_str()),
    }
}

/// Checks that the verdict of a loop agrees with the statuses of its effects, and that no `text` of
/// it states another verdict or doubts a sure effect.
fn check_verdict(result: &LoopResult, texts: &[(&str, String)], table: &str) {
    let has = |status: Status| result.effects.iter().any(|found| found.status == status);
    let is_sure = has(Status::Found);
    let is_left = result.unexplained.is_some() || has(Status::Contradicted);
    let is_doubted = result.effects.iter().any(|found| found.status != Status::Found);
    match result.verdict {
        Verdict::NothingFound => assert!(result.effects.is_empty() && !is_left, "{table}"),
        Verdict::Explained => assert!(is_sure && !is_left, "{table}"),
        Verdict::Unexplained => assert!(is_left || is_doubted, "{table}"),
    }
    for (format, text) in texts {
        let says = |words: &str| text.contains(words);
        assert!(has(Status::Probable) || !says("Probably explained: "), "{table}: {format}");
        let is_unexplained = says("Unexplained: ") || says("Probably explained: ");
        let verdicts = [says("Nothing found: "), says("Explained: "), is_unexplained];
        let expected = [Verdict::NothingFound, Verdict::Explained, Verdict::Unexplained]
            .map(|verdict| verdict == result.verdict);
        assert_eq!(verdicts, expected, "{table}: {format}");
        assert!(!says("No effect is sure") || !is_sure, "{table}: {format}");
    }
}

#[test]
fn every_format_states_the_same_verdict_statuses_and_findings() {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let cases =
        CASES.into_iter().flat_map(|(file, tables)| tables.iter().map(move |table| (file, table)));
    let mut seen = Vec::new();
    for (file, table) in cases {
        let problem = Problem::read(&tests.join(file)).unwrap();
        let (data, _) = Dataset::read_files(&[tests.join(table)], &problem).unwrap();
        let closure = close(&problem, &data, &Options::default()).unwrap();
        let result = LoopResult::new(&problem, &closure);
        let plots = PlotData::of_loop(&problem, &data, &closure).unwrap();
        let report = loop_report(&problem, &closure, &plots);
        let json: Value = serde_json::from_str(&result.to_json()).unwrap();
        let (text, brief) =
            (loop_text(&problem, &closure, None), loop_brief(&problem, &closure, None));
        let formats = [
            ("text", plain(&text)),
            ("screen", plain(&brief)),
            ("Markdown", plain(&report.markdown)),
            ("page", plain(&report.html)),
        ];

        check_verdict(&result, &formats, table);
        // Verdict: the sentence that states it is the same in every format.
        assert_eq!(json["verdict"], result.verdict.as_str());
        let sentence = {
            let text = &formats[0].1;
            let verdicts = [
                "Nothing found: ",
                "Explained: ",
                "Probably explained: ",
                "Unexplained: ",
                "No cause is claimed",
            ];
            let start = verdicts
                .into_iter()
                .find_map(|words| text.find(words))
                .unwrap_or_else(|| panic!("{table} states no verdict: {text}"));
            text[start..].split(". ").next().unwrap().to_owned()
        };
        for (format, text) in &formats {
            assert!(text.contains(&sentence), "{table}: {format} lacks {sentence}");
        }

        // Status of each effect, with the words for it.
        let entries = json["effects"].as_array().unwrap();
        assert_eq!(entries.len(), result.effects.len());
        for (entry, found) in entries.iter().zip(&result.effects) {
            assert_eq!(entry["status"], found.status.as_str());
            assert_eq!(entry["description"], found.effect.description);
            seen.push(found.status.as_str());
            for (format, text) in formats.iter().filter(|(format, _)| *format != "screen") {
                assert!(text.contains(&claim(found)), "{table}: {format} lacks {}", claim(found));
            }
        }
        // A screen shows every cause that acts by itself, with the line that declares it.
        for found in result.effects.iter().filter(|found| !found.is_only_with_others()) {
            assert!(formats[1].1.contains(&claim(found)), "{table}: {brief}");
            assert!(formats[1].1.contains(&plain(&found.effect.declaration)), "{table}: {brief}");
        }

        // Tests of the residual, and findings of the checks of the fit.
        for (kind, tests) in
            [("checks_before", &result.checks_before), ("checks_after", &result.checks_after)]
        {
            let entries = json[kind].as_array().unwrap();
            let failed = entries.iter().filter(|entry| entry["failed"] == true).count();
            assert_eq!(failed, tests.iter().filter(|test| test.failed).count());
            for ResidualTest { words, failed, statistic, .. } in tests {
                let mark = match (failed, statistic) {
                    (true, _) => "failed: ",
                    (false, Some(_)) => "passed: ",
                    (false, None) => "",
                };
                let words = format!("{mark}{}", plain(words));
                assert!(formats[3].1.contains(&words), "{table}: the page lacks {words}");
                let is_told = !failed || formats[2].1.contains(&words);
                assert!(is_told, "{table}: Markdown lacks {words}");
            }
        }
        let codes = json["findings"].as_array().unwrap().iter().map(|entry| &entry["code"]);
        assert!(codes.eq(result.findings.iter().map(|finding| finding.code.entry().code)));
        let warnings: Vec<&Finding> = closure.after.cautions().collect();
        for warning in warnings {
            let words = plain(&warning.to_string());
            for (format, text) in &formats[2..] {
                assert!(text.contains(&words), "{table}: {format} lacks {words}");
            }
        }
    }
    assert!(seen.contains(&"found"), "no case has an effect that is found");
}
