//! A stopped loop claims nothing on hypotheses that it did not test.

use std::path::Path;
use std::sync::Arc;

use flexcal::fit::{Options, Progress, ProgressSink, Stop};
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use flexcal::report::{loop_brief, loop_text};
use flexcal::select::close;

#[test]
fn stopped_in_its_first_round_it_names_no_cause_and_rules_none_out() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("problems/lunar-sampler/problem.toml");
    let problem = Problem::read(&file).unwrap();
    let (data, _) = Dataset::read(&problem).unwrap();
    let stop = Stop::default();
    let sink: ProgressSink = {
        let stop = stop.clone();
        Arc::new(move |told| {
            if matches!(told, Progress::Round { .. }) {
                stop.request();
            }
        })
    };
    let closed =
        close(&problem, &data, &Options::default().with_stop(stop.clone()).with_progress(sink))
            .unwrap();
    assert!(
        stop.is_requested()
            && closed.interrupted
            && closed.rounds.is_empty()
            && closed.effects.is_empty()
    );
    for said in [loop_text(&problem, &closed, None), loop_brief(&problem, &closed, None)] {
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(said.contains("Search interrupted before the first round was done"), "{said}");
        assert!(
            said.contains("no cause is named, and none is ruled out")
                && !said.contains("No effect was found"),
            "{said}"
        );
    }
}
