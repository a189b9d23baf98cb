//! Contacts with a declared σ that is too large.

use std::path::Path;

use flexcal::fit::Options;
use flexcal::rig::{Truth, simulate};
use flexcal::select::close;

use crate::common::arms::parse;
use crate::common::reading::read_dataset;

/// Four joints whose hand is placed in two sockets and on a table.
const IN_SOCKETS: &str = "name = 'in sockets'
joint = [
  { d_m = 0.5 },
  { alpha_deg = -90, a_m = 0.05, body = [{ mass_kg = 6, com_m = [0.2, 0, 0] }] },
  { a_m = 0.5, body = [{ mass_kg = 4, com_m = [0.2, 0, 0] }] },
  { alpha_deg = -90, a_m = 0.4, body = [{ mass_kg = 1, com_m = [0.05, 0, 0] }] },
  { kind = 'fixed', xyz_m = [0, -0.1, 0], rpy_deg = [90, 0, 0] },
]
point = [{ name = 'left' }, { name = 'right' }]
distance = [{ between = ['left', 'right'], mm = 300 }]
surface = [{ name = 'table', kind = 'plane' }]
[tool]
target_m = [0.03, 0.01, 0.05]
[parameters]
'joint*.*' = { sigma_deg = 0.5, sigma_mm = 2.0 }
'tool.*' = { sigma_mm = 100.0 }
'base.*' = { fixed = true }
'joint*.beta' = { fixed = true }
'joint1.*' = { fixed = true }
'joint2.beta' = { sigma_deg = 0.5 }
'joint2.theta' = { fixed = true }
'joint3.d' = { fixed = true }
'joint4.theta' = { fixed = true }
'joint4.d' = { fixed = true }
'joint5.*' = { fixed = true }
[data]
files = ['measurements.csv']
point_sigma_mm = 0.05
surface_sigma_mm = 0.05
";

/// Truth with one more compliance than declared, and noise of 0.03 mm.
const GIVES_WAY: &str = "[parameters]
'point[left].x' = { mm = 400 }
'point[left].y' = { mm = 150 }
'point[left].z' = { mm = 300 }
'point[right].x' = { mm = 400 }
'point[right].y' = { mm = -150 }
'point[right].z' = { mm = 300 }
'surface[table].d' = { mm = 200 }
'surface[table].rx' = { deg = 0.5 }
'surface[table].ry' = { deg = 0.2 }
[random]
'joint*.alpha' = { sigma_deg = 0.2 }
'joint*.a' = { sigma_mm = 1 }
[[effect]]
joint-compliance = { joint = 2 }
compliance_rad_per_N_m = 4e-5
[noise]
position_sigma_mm = 0.03
[poses]
q1_deg = [-150, 150]
q2_deg = [-110, 25]
q3_deg = [15, 140]
q4_deg = [-110, 110]
";

#[test]
fn the_sigma_that_a_fit_supports_speaks_for_no_effect() {
    // σ is declared too large and therefore estimated by each fit: a smaller σ is no better
    // explanation.
    let problem = parse(IN_SOCKETS);
    let truth = Truth::parse(GIVES_WAY, Path::new("TRUTH.toml"), &problem).unwrap();
    for seed in [1, 2, 3, 4] {
        let data = read_dataset(&problem, &simulate(&problem, &truth, 120, seed).unwrap().csv());
        let closure = close(&problem, &data, &Options::default()).unwrap();
        assert_eq!(closure.effects.len(), 1, "{seed}: {:?}", closure.effects);
        let found = &closure.effects[0];
        let (law, named) = (found.claims.as_ref().unwrap().law.1, found.effect.name_and_place());
        let share = 1.0 / (1 + found.alternatives.len()) as f64;
        println!("{seed}: {named} {law:.3}, an even share {share:.3}");
        // The selected law is the most probable and exceeds its even share: two rigidities, a
        // compliance and a stiffness that changes fit nearly as well.
        assert!(law > share, "{seed}: {named} {law}, {:?}", found.alternatives);
        assert!(
            law > 0.3 && !(law >= 0.9 && named != "joint-compliance 2"),
            "{seed}: {named} {law}"
        );
    }
}
