//! Masses and payloads that are not as declared, as causes.

use std::fs;
use std::path::Path;

use flexcal::fit::Options;
use flexcal::measurement::{Dataset, Split};
use flexcal::problem::Problem;
use flexcal::rig::{Truth, simulate};
use flexcal::select::{Status, Verdict, close};
use flexcal::study::table;

const POSES: &str = "[random]\n'joint*.*' = { sigma_deg = 0.05, sigma_mm = 0.5, sigma_relative = 0.1 }\n\
    'tool.*' = { sigma_mm = 1 }\n[noise]\nposition_sigma_mm = 0.05\n[poses]\nq1_deg = [-160, 160]\n\
    q2_deg = [-150, -10]\nq3_deg = [-80, 150]\nq4_deg = [-170, 170]\nq5_deg = [-110, 110]\n\
    q6_deg = [-350, 350]\npayload_kg = [0, 12, 25]\n";

#[test]
fn wrong_masses_and_a_payload_elsewhere_are_named() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/honest/six.toml");
    let problem = Problem::parse(&fs::read_to_string(&path).unwrap(), &path).unwrap();
    for (name, effect) in [
        ("body-mass", "body-mass = { joint = 4 }\nmass_kg = 8"),
        ("payload-position", "payload-position = true\nx_m = 0.1\ny_m = -0.05\nz_m = 0.15"),
    ] {
        let truth = format!("[[effect]]\n{effect}\n{POSES}");
        let truth = Truth::parse(&truth, Path::new("TRUTH.toml"), &problem).unwrap();
        let rows = simulate(&problem, &truth, 90, 5).unwrap().rows;
        let split = Split { identification: (0..60).collect(), held_out: (60..90).collect() };
        let data = Dataset::new(table(&rows), split);
        let closure = close(&problem, &data, &Options::default()).unwrap();
        let found: Vec<_> =
            closure.effects.iter().map(|found| (found.effect.name(), found.status)).collect();
        assert_eq!(found, [(name, Status::Found)]);
        assert_eq!(closure.verdict, Verdict::Explained);
    }
}
