//! Verdict and statuses agree in data, text, report and JSON.

use std::path::Path;

use flexcal::fit::Options;
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use flexcal::report::{loop_brief, loop_report, loop_text};
use flexcal::results::{Document as _, LoopResult, PlotData};
use flexcal::select::{Status, Verdict, close};
use serde_json::Value;

/// Open cases: problem and tables, of which some have no effect, one, two, or one outside the
/// catalogue.
const CASES: [(&str, &[&str]); 3] = [
    (
        "cases/problem.toml",
        &["cases/a-none.csv", "cases/f-two.csv", "cases/g-not-in-catalogue.csv"],
    ),
    ("honest/out.toml", &["honest/out-order-2-43-of-joint-1-28.csv"]),
    ("honest/six.toml", &["honest/six-4.csv"]),
];

#[test]
fn verdict_and_statuses_agree_in_data_text_report_and_json() {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let cases =
        CASES.into_iter().flat_map(|(file, tables)| tables.iter().map(move |table| (file, table)));
    for (file, table) in cases {
        let problem = Problem::read(&tests.join(file)).unwrap();
        let (data, _) = Dataset::read_files(&[tests.join(table)], &problem).unwrap();
        let closure = close(&problem, &data, &Options::default()).unwrap();
        let result = LoopResult::new(&problem, &closure);
        let statuses: Vec<Status> = result.effects.iter().map(|found| found.status).collect();
        let is_sure = statuses.contains(&Status::Found);
        let is_left = result.unexplained.is_some() || statuses.contains(&Status::Contradicted);
        match result.verdict {
            Verdict::NothingFound => assert!(statuses.is_empty() && !is_left, "{table}"),
            Verdict::Explained => assert!(is_sure && !is_left, "{table}: {statuses:?}"),
            Verdict::Unexplained => assert!(
                is_left || statuses.iter().any(|status| *status != Status::Found),
                "{table}: {statuses:?}"
            ),
        }
        let json: Value = serde_json::from_str(&result.to_json()).unwrap();
        assert_eq!(json["verdict"], result.verdict.as_str());
        for (entry, status) in json["effects"].as_array().unwrap().iter().zip(&statuses) {
            assert_eq!(entry["status"], status.as_str());
        }
        let plots = PlotData::of_loop(&problem, &data, &closure).unwrap();
        let report = loop_report(&problem, &closure, &plots);
        let texts = [
            loop_text(&problem, &closure),
            loop_brief(&problem, &closure, None),
            report.markdown,
            report.html,
        ];
        for text in texts {
            let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
            let says = |words: &str| text.contains(words);
            let is_probable = result.effects.iter().any(|found| found.status == Status::Probable);
            assert!(is_probable || !says("Probably explained: "), "{text}");
            let is_unexplained = says("Unexplained: ") || says("Probably explained: ");
            let verdicts = [says("Nothing found: "), says("Explained: "), is_unexplained];
            let expected = [Verdict::NothingFound, Verdict::Explained, Verdict::Unexplained]
                .map(|verdict| verdict == result.verdict);
            assert_eq!(verdicts, expected, "{table}: {text}");
            assert!(!says("No effect is sure") || !is_sure, "{table}");
        }
    }
}
