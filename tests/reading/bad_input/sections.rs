//! Errors in sections of a problem.

use super::reading::{ARM, check, check_problems, problem, table};

#[test]
fn joints_and_beams() {
    const BEAM: &str = "a_m = 1\n[joint.beam]\nname = 'A'\n";
    let beam = |text: &str| format!("{BEAM}{text}");
    let below: [(&str, &[&str]); 11] = [
        ("mass_kg = -1", &[":6: joint[1].beam.mass_kg: -1 is below zero"]),
        ("EA_N = 0", &[":6: joint[1].beam.EA_N: 0 is not above zero"]),
        (
            "EI_N_m2 = 1e4",
            &[":6: joint[1].beam.EI_N_m2: unknown key (did you mean EIy_N_m2 and EIz_N_m2, equal "],
        ),
        ("EA = 1", &[":6: joint[1].beam.EA: ", "EA_N"]),
        ("mass = 1", &[":6: joint[1].beam.mass: a mass needs a unit; write mass_kg"]),
        (
            "[[joint.beam.mass]]\nmass_kg = 1",
            &[":6: joint[1].beam.mass[1].at: missing", "at_m or at_mm"],
        ),
        ("[[joint.beam.mass]]\nat_m = [0, 0, 0]", &[":6: joint[1].beam.mass[1].mass_kg: missing"]),
        ("[joint.beam.hoist]\nforce_N = 1", &[":6: joint[1].beam.hoist.at: missing"]),
        (
            "hoist = { at_m = [0, 0, 0], direction = [0, 0, 0] }",
            &[":6: joint[1].beam.hoist.direction: "],
        ),
        (
            "hoist = { at_m = [0, 0, 0], rope = 3 }",
            &[":6: joint[1].beam.hoist.rope: unknown key; known here: "],
        ),
        ("[[joint]]\na_m = 1\nbeam.name = 'A'", &[":8: joint[2].beam.name: ", "another beam"]),
    ];
    for (text, words) in below {
        check_problems(&[(&beam(text), words)]);
    }
    check_problems(&[
        (
            "alpha = 90",
            &[
                "problem.toml:3: joint[1].alpha: an angle needs a unit; write alpha_deg or alpha_rad",
            ],
        ),
        ("d = 1", &[":3: joint[1].d: a length needs a unit; write d_m or d_mm"]),
        ("a_deg = 1", &[":3: joint[1].a_deg: a length is not given in deg"]),
        ("a_m = 1\n\na_mm = 1000", &[":5: joint[1].a_mm: given already as a_m"]),
        ("a_m = nan", &[":3: joint[1].a_m: nan is not a finite number"]),
        ("a_m = -inf", &[":3: joint[1].a_m: -inf is not a finite number"]),
        ("a_m = 1e999", &[":3: joint[1].a_m: 1e999 is not a finite number"]),
        ("a_m = '1'", &[":3: joint[1].a_m: expected a number, found text"]),
        ("stiffness_N_m_per_rad = 0", &[":3: joint[1].stiffness_N_m_per_rad: 0 is not above zero"]),
        (
            "kind = 'spherical'",
            &[":3: joint[1].kind: \"spherical\" is none of revolute, prismatic, fixed"],
        ),
        (
            "min_deg = 130\nmax_deg = -130",
            &[":3: joint[1].min_deg: min_deg = 130 is above max_deg = -130"],
        ),
        (
            "kind = 'prismatic'\nmin_m = 1\nmax_mm = 5",
            &[":4: joint[1].min_m: min_m = 1 is above max_mm = 5"],
        ),
        ("length_m = 1", &[":3: joint[1].length_m: unknown key"]),
        ("beam.name = 'A'", &[":3: joint[1].beam: ", "a_m or a_mm"]),
        ("a_m = 1\nbeam.mass_kg = 1", &[":4: joint[1].beam.name: missing"]),
        ("a_m = 1\nbeam.name = 'A.B'", &[":4: joint[1].beam.name: ", "cannot name a beam"]),
        ("a_m = 1\nbeam.name = 'tool'", &[":4: joint[1].beam.name: ", "other parameters"]),
        ("a_m = 1\nbeam.name = 'joint2'", &[":4: joint[1].beam.name: ", "other parameters"]),
        ("[[joint.body]]\nmass_kg = -0.5", &[":4: joint[1].body[1].mass_kg: -0.5 is below zero"]),
        (
            "[[joint.body]]\nmass_kg = 1\nat_m = [0, 0, 0]",
            &[":5: joint[1].body[1].at_m: unknown key", "com_m"],
        ),
        ("[[joint]]\n[[joint.body]]", &[":4: joint[2].body[1].mass_kg: missing"]),
    ]);
}

#[test]
fn trees_and_targets() {
    const RIGHT: &str = "[[joint]]\n[[joint]]\nparent = 1\n";
    let ended = format!("{RIGHT}[[joint]]\nparent = 2");
    let twice = "[[target]]\nname = 'a'\n[[target]]\nname = 'a'";
    check_problems(&[
        (
            "parent = 1",
            &[":3: joint[1].parent: joint 1 cannot be mounted on joint 1: list it after"],
        ),
        (
            "parent = 2\n[[joint]]\nparent = 1",
            &[":3: joint[1].parent: joint 1 cannot be mounted on joint 2"],
        ),
        ("[[joint]]\nparent = 7", &[":4: joint[2].parent: no joint 7; the arm has 2"]),
        ("parent = -1", &[":3: joint[1].parent: -1 is not a whole number of at least 0"]),
        (
            &ended,
            &[
                ":7: joint[4].parent: the branch of joint 2 has ended; list everything that a joint carries directly",
            ],
        ),
        ("[tool]\njoint = 2", &[":4: tool.joint: no joint 2; the arm has 1"]),
        ("[[target]]\nname = 'a'\njoint = 0", &[":5: target[1].joint: no joint 0; the arm has 1"]),
        (
            "[[target]]\nat_m = [0, 0, 0]",
            &[":3: target[1].name: missing; write name = \"…\", a word of the column target"],
        ),
        ("[[target]]\nname = 'a b'", &[":4: target[1].name: \"a b\" cannot name a target"]),
        ("[[target]]\nname = 'a'\nat = [0, 0, 0]", &[":5: target[1].at: a length needs a unit"]),
        (twice, &[":6: target[2].name: another target is called \"a\" (line 3)"]),
    ]);
    for (text, key) in
        [("[[joint]]\nparent = 0", "joint[2].parent"), ("[tool]\njoint = 1", "tool.joint")]
    {
        let error = problem(&format!("dh = 'standard'\n{ARM}{text}\n")).expect_err(text);
        check(
            &error,
            text,
            &[&format!(":5: {key}: a standard table describes one chain with one tool")],
        );
    }
    let named = format!("{ARM}[[target]]\nname = 'left'\n[[target]]\nname = 'right'\n");
    for (text, words) in [
        (
            "q1_deg,x_m,y_m,z_m\n1,2,3,4\n",
            "rows.csv:1: column target: the rows name no target; each of them measures one of left, right: add a column target",
        ),
        (
            "q1_deg,x_m,y_m,z_m,target\n1,2,3,4,lft\n",
            "rows.csv:2: column target: no target is called \"lft\" (did you mean left?); there are left, right",
        ),
    ] {
        check(&table(&named, text.as_bytes()).expect_err(text), text, &[words]);
    }
}

#[test]
fn other_sections() {
    check_problems(&[
        (
            "[statics]\nequilibrium = 'bent'",
            &[":4: statics.equilibrium: \"bent\" is none of deflected, undeflected"],
        ),
        ("[statics]\nbeam_elements = 0", &[":4: statics.beam_elements: 0 is not a whole number"]),
        (
            "[statics]\nbeam_elements = 1.5",
            &[":4: statics.beam_elements: 1.5 is not a whole number"],
        ),
        (
            "[statics]\nbeam_elements = 33",
            &[":4: statics.beam_elements: 33 beam elements; at most 32"],
        ),
        (
            "[statics]\nbeam_elements = 1_000_000",
            &[":4: statics.beam_elements: 1000000 is too large"],
        ),
        (
            "[statics]\nelements = 1",
            &[":4: statics.elements: unknown key (did you mean beam_elements?)"],
        ),
        ("[tool]\ntarget_m = [1, 2]", &[":4: tool.target_m: a vector has 3 numbers, found 2"]),
        ("[tool]\ntarget_m = [\n1,\n2,\nnan]", &[":7: tool.target_m[3]: nan"]),
        ("[tool]\ntarget = [1, 2, 3]", &[":4: tool.target: a length needs a unit"]),
        ("[tool]\npayload_kg = -1", &[":4: tool.payload_kg: -1 is below zero"]),
        (
            "[tool]\npayload_g = 1",
            &[
                "tool.payload_g: a mass is not given in g; write payload_kg, here payload_kg = 0.001",
            ],
        ),
        (
            "[tool]\ntarget_m = [0,18, 0, 0]",
            &["3 numbers, found 4; if a comma is a decimal one, write a point: 0.18 for 0,18"],
        ),
        (
            "[data]\nposition_sigma_um = 50",
            &[
                ":4: data.position_sigma_um: a length is not given in um; write position_sigma_m or \
                 position_sigma_mm, here position_sigma_mm = 0.05",
            ],
        ),
        (
            "[data]\ngravity_m_s2 = [0, 0, 1]",
            &[
                ":4: data.gravity_m_s2: does not belong here: ",
                "write it above the first [section]",
            ],
        ),
        (
            "[data]\ngear-ratio = { joint = 1 }",
            &[
                ":4: data.gear-ratio: does not belong here: an effect stands below a line [[effect]]",
            ],
        ),
        (
            "[columns]\nA1 = 'q1_deg'",
            &[":3: columns: does not belong here: ", "is a part of [data]; write [data.columns]"],
        ),
        ("[tool]\nfiles = ['a.csv']", &[":4: tool.files: ", "write it below the line [data]"]),
        (
            "[data]\nfiles = [\"C:\\temp\\new.csv\"]",
            &[":4: data.files[1]: a \\ in double quotes", "here of U+0009", "in single quotes"],
        ),
        (
            "[data]\nheld_out = true",
            &[":4: data.held_out: give one of column, fraction (with seed)"],
        ),
        ("[data]\nheld_out = 0.3", &["as in held_out = { fraction = 0.3, seed = 1 }"]),
        ("[base]\nrotation_m = [0, 0, 0]", &[":4: base.rotation_m: an angle is not given in m"]),
        ("[base]\nyaw_deg = 1", &[":4: base.yaw_deg: unknown key"]),
        (
            "[data]\nposition_sigma_mm = 0",
            &[":4: data.position_sigma_mm: 0 is not above zero; without this key, σ is estimated"],
        ),
        (
            "[data]\nposition_sigma_deg = 1",
            &[":4: data.position_sigma_deg: a length is not given in deg"],
        ),
        ("[data]\nposition_sigma = 1", &[":4: data.position_sigma: a length needs a unit"]),
        (
            "[data]\nreference_temperature = 1",
            &[":4: data.reference_temperature: a temperature needs a unit"],
        ),
        ("[data]\nfiles = 'a.csv'", &[":4: data.files: expected a list"]),
        ("[data]\nfiles = [1]", &[":4: data.files[1]: expected text"]),
        ("[data]\nheld_out = {}", &[":4: data.held_out: give one of"]),
        ("[data]\nheld_out = { seed = 1 }", &[":4: data.held_out: give one of"]),
        ("[data]\nheld_out = { column = 'a', session = 'b' }", &[":4: data.held_out: give one of"]),
        (
            "[data]\nheld_out = { fraction = 1 }",
            &[":4: data.held_out.fraction: 1 is not between 0 and 1"],
        ),
        (
            "[data]\nheld_out = { fraction = 0.3, seed = -1 }",
            &[":4: data.held_out.seed: -1 is not a whole number"],
        ),
        ("[data]\nheld_out = { rows = 3 }", &[":4: data.held_out.rows: unknown key"]),
        (
            "[data]\nheld_out = 'split'",
            &[":4: data.held_out: give one of column, fraction (with seed) or session"],
        ),
    ]);
}

#[test]
fn rules_of_parameters() {
    let rules: [(&str, &[&str]); 15] = [
        ("'tool.x' = {}", &[":4: parameters.\"tool.x\": the rule is empty"]),
        ("'tool.x' = true", &[":4: parameters.\"tool.x\": expected a table"]),
        ("'base.*' = 'free'", &["expected a table such as { free = true }", "found text"]),
        ("tool.x = { free = true }", &[":4: parameters.tool: ", "needs quotes: \"tool.x\""]),
        ("a = { sigma = 1 }", &[":4: parameters.a.sigma: ", "needs a unit", "sigma_mm"]),
        ("a = { sigma_mm = 0 }", &[":4: parameters.a.sigma_mm: 0 is not above zero; fixed = true"]),
        ("a = { sigma_kg = 1 }", &[":4: parameters.a.sigma_kg: unknown key", "sigma_relative"]),
        (
            "a = { sigma_mm = 1, sigma_m = 1 }",
            &[":4: parameters.a.sigma_m", "given already as sigma_m"],
        ),
        ("a = { sigma_mm = 'x' }", &[":4: parameters.a.sigma_mm: expected a number"]),
        (
            "a = { min_mm = 2, max_mm = 1 }",
            &[":4: parameters.a.min_mm: min_mm = 2 is above max_mm = 1"],
        ),
        ("a = { min_relative = 0 }", &[":4: parameters.a.min_relative: 0 is not above zero"]),
        ("a = { sigma_mm = 1, fixed = true }", &[":4: parameters.a: ", "leave out sigma_mm"]),
        ("a = { free = false, fixed = false }", &[":4: parameters.a: ", "leave out fixed"]),
        ("a = { free = 1 }", &[":4: parameters.a.free: expected true or false"]),
        ("a = { free = true }\na = { free = true }", &[":5: not valid TOML: duplicate key"]),
    ];
    for (rule, words) in rules {
        check_problems(&[(&format!("[parameters]\n{rule}"), words)]);
    }
}

#[test]
fn robust_loss() {
    check_problems(&[
        ("[robust]", &[":3: robust.loss: missing", "huber"]),
        ("[robust]\nloss = 'cauchy'", &[":4: robust.loss: ", "\"cauchy\" is none of huber, l1"]),
        (
            "[robust]\nloss = 'l1'\nthreshold_sigma = 0",
            &[":5: robust.threshold_sigma: 0 is not above zero"],
        ),
        (
            "[robust]\nloss = 'l1'\nthreshold = 1",
            &[":5: robust.threshold: unknown key", "threshold_sigma"],
        ),
        ("robust = 'l1'", &[":3: ", "robust"]),
    ]);
}

#[test]
fn constraints() {
    let constraints: [(&str, &[&str]); 11] = [
        ("", &[":3: constraint[1].terms: missing"]),
        ("terms = {}", &[":4: constraint[1].terms: no terms"]),
        ("terms = 1", &[":4: constraint[1].terms: expected a table"]),
        ("terms = { A.EI = 1 }", &[":4: constraint[1].terms.A: ", "needs quotes: \"A.EI\""]),
        ("terms = { a = 0 }\nat_least = 0", &[":4: constraint[1].terms.a: a coefficient of 0"]),
        ("terms = { a = 'x' }", &[":4: constraint[1].terms.a: expected a number"]),
        ("terms = { a = 1 }", &[":3: constraint[1]: no limit; write at_least or at_most"]),
        (
            "terms = { a = 1 }\nat_least = nan",
            &[":5: constraint[1].at_least: nan is not a finite number"],
        ),
        (
            "terms = { a = 1 }\nat_least = 2\nat_most = 1",
            &[":5: constraint[1].at_least: at_least = 2 is above at_most = 1"],
        ),
        (
            "terms = { a = 1 }\nat_least = 2\nat_least_mm = 1",
            &[":6: constraint[1].at_least_mm: given already"],
        ),
        (
            "terms = { a = 1 }\nat_least = 2\nabove = 1",
            &[":6: constraint[1].above: unknown key", "at_most"],
        ),
    ];
    for (constraint, words) in constraints {
        check_problems(&[(&format!("[[constraint]]\n{constraint}"), words)]);
    }
}

#[test]
fn effects() {
    let effects: [(&str, &[&str]); 36] = [
        ("", &[":3: effect[1]: an effect is one key", "found 0"]),
        (
            "payload-mass = {}\nhoist-force = {}",
            &[":3: effect[1]: an effect is one key", "found 2; write each into"],
        ),
        ("wobble = {}", &[":4: effect[1].wobble: unknown effect; known: ", "backlash"]),
        (
            "gear_ratios = {}",
            &[":4: effect[1].gear_ratios: unknown effect (did you mean gear-ratio?)"],
        ),
        ("payload-mass = { joint = 1 }", &[":4: effect[1].payload-mass.joint: unknown key"]),
        ("payload-mass = false", &[":4: effect[1].payload-mass: expected a table"]),
        ("backlash = {}", &[":4: effect[1].backlash.joint: missing"]),
        ("backlash = true", &[":4: effect[1].backlash.joint: missing"]),
        ("backlash = { joint = 2 }", &[":4: effect[1].backlash.joint: no joint 2; the arm has 1"]),
        ("backlash = { joint = 0 }", &[":4: effect[1].backlash.joint: no joint 0"]),
        (
            "unmodelled-mass = { link = 'A' }",
            &[":4: effect[1].unmodelled-mass.link: no beam is called \"A\""],
        ),
        (
            "joint-harmonic = { joint = 1, orders = [] }",
            &[":4: effect[1].joint-harmonic.orders: no order"],
        ),
        (
            "joint-harmonic = { joint = 1, orders = [0] }",
            &[":4: effect[1].joint-harmonic.orders[1]: 0 is not"],
        ),
        (
            "joint-wave = { joint = 1, order = 0 }",
            &[":4: effect[1].joint-wave.order: 0 is not a valid order"],
        ),
        (
            "joint-wave = { joint = 1, order = 1e9 }",
            &[":4: effect[1].joint-wave.order: 1000000000 is not a valid order"],
        ),
        ("joint-wave = { joint = 1 }", &[":4: effect[1].joint-wave.order: missing"]),
        (
            "joint-harmonic = { joint = 1, orders = [1, 1] }",
            &[":4: effect[1].joint-harmonic.orders[2]: order 1"],
        ),
        (
            "joint-harmonic = { joint = 1, order = 1 }",
            &["orders: missing; write orders = [1], the harmonics (is it order?)"],
        ),
        (
            "joint-coupling = { joint = 1, from = 1 }",
            &[":4: effect[1].joint-coupling: ", "gear-ratio"],
        ),
        (
            "station-shift = { at_time = 3 }",
            &[":4: effect[1].station-shift.at_time: a time needs a unit"],
        ),
        (
            "link-bending = { joint = 1 }",
            &[":4: effect[1].link-bending: joint 1 has no link", "its a is 0"],
        ),
        (
            "slide-bending = { joint = 1 }",
            &[":4: effect[1].slide-bending.joint: joint 1 has no slide", "not prismatic"],
        ),
        (
            "slide-bending = { joint = 2 }\n[[joint]]\nkind = 'fixed'",
            &[":4: effect[1].slide-bending.joint: joint 2 is fixed"],
        ),
        (
            "slide-bending = { joint = 2 }\n[[joint]]\nkind = 'prismatic'\nmimic = { joint = 1 }",
            &[":4: effect[1].slide-bending.joint: joint 2 is fixed"],
        ),
        (
            "twist-bending = { link = 'A' }",
            &[":4: effect[1].twist-bending.link: no beam is called \"A\""],
        ),
        (
            "deflected-equilibrium = {}",
            &[":4: effect[1].deflected-equilibrium: ", "already", "[statics]"],
        ),
        ("hoist-direction = {}", &[":4: effect[1].hoist-direction: no beam has a hoist"]),
        (
            "joint-thermal-drift = { joint = 1 }",
            &[":4: effect[1].joint-thermal-drift: ", "reference_temperature_C"],
        ),
        (
            "joint-harmonic = { joint = 1, orders = [1, 2] }\n[[effect]]\njoint-harmonic = { joint = 1, orders = [3, 2] }",
            &[":6: effect[2].joint-harmonic: order 2 of this joint is declared already on line 4"],
        ),
        (
            "joint-harmonic = { joint = 1, orders = [1, 2] }\n[[effect]]\njoint-wave = { joint = 1, order = 2 }",
            &[":6: effect[2].joint-wave: order 2 of this joint is declared already on line 4"],
        ),
        (
            "joint-wave = { joint = 1, order = 2.0 }\n[[effect]]\njoint-harmonic = { joint = 1, orders = [1, 2] }",
            &[":6: effect[2].joint-harmonic: order 2 of this joint is declared already on line 4"],
        ),
        (
            "gear-ratio = { joint = 2 }\n[[joint]]\nkind = 'fixed'",
            &[":4: effect[1].gear-ratio.joint: joint 2 is fixed"],
        ),
        (
            "backlash = { joint = 2 }\n[[joint]]\nkind = 'fixed'",
            &[":4: effect[1].backlash.joint: joint 2 is fixed"],
        ),
        (
            "joint-coupling = { joint = 1, from = 2 }\n[[joint]]\nkind = 'fixed'",
            &[":4: effect[1].joint-coupling.from: joint 2 is fixed"],
        ),
        (
            "joint-harmonic = { joint = 2, orders = [1] }\n[[joint]]\nkind = 'fixed'",
            &[":4: effect[1].joint-harmonic.joint: joint 2 is fixed"],
        ),
        (
            "hoist-force = {}\n[[effect]]\nhoist-force = {}",
            &[":6: effect[2].hoist-force: declared already on line 4"],
        ),
    ];
    for (effect, words) in effects {
        check_problems(&[(&format!("[[effect]]\n{effect}"), words)]);
    }
}

#[test]
fn compensators() {
    let effects: [(&str, &[&str]); 10] = [
        (
            "gravity-compensator = { joint = 1, anchor_m = [0, 1], lever_m = [1, 0], free_length_m = 0 }",
            &[
                ":4: effect[1].gravity-compensator: joint 1 is rigid",
                "joint-compliance = { joint = 1 }",
            ],
        ),
        (
            "gravity-compensator = { joint = 2, anchor_m = [0, 1], lever_m = [1, 0], free_length_m = 0 }\n[[joint]]\nkind = 'prismatic'",
            &[":4: effect[1].gravity-compensator.joint: joint 2 does not rotate"],
        ),
        (
            "gravity-compensator = { joint = 2, anchor_m = [0, 1], lever_m = [1, 0], free_length_m = 0 }\n[[joint]]\nkind = 'fixed'",
            &[":4: effect[1].gravity-compensator.joint: joint 2 is fixed"],
        ),
        (
            "gravity-compensator = { joint = 1 }",
            &[":4: effect[1].gravity-compensator.anchor: missing", "anchor_m or anchor_mm"],
        ),
        (
            "gravity-compensator = { joint = 1, anchor = [0, 1] }",
            &[":4: effect[1].gravity-compensator.anchor: a length needs a unit"],
        ),
        (
            "gravity-compensator = { joint = 1, anchor_m = [0, 1, 0] }",
            &[":4: effect[1].gravity-compensator.anchor_m: expected 2 numbers, found 3"],
        ),
        (
            "gravity-compensator = { joint = 1, anchor_m = [0, 1], lever_mm = [0, 0] }",
            &[":4: effect[1].gravity-compensator.lever_mm: the end of a spring lies on the"],
        ),
        (
            "gravity-compensator = { joint = 1, anchor_m = [0, 1], lever_m = [1, 0] }",
            &[":4: effect[1].gravity-compensator.free_length: missing"],
        ),
        (
            "gravity-compensator = { joint = 1, anchor_m = [0, 1], lever_m = [1, 0], free_length_mm = -1 }",
            &[":4: effect[1].gravity-compensator.free_length_mm: "],
        ),
        (
            "joint-compliance = { joint = 1 }\n[[effect]]\n\
             gravity-compensator = { joint = 1, anchor_m = [0, 1], lever_m = [1, 0], free_length_m = 0 }\n[[effect]]\n\
             gravity-compensator = { joint = 1, anchor_m = [1, 1], lever_m = [1, 0], free_length_m = 0 }",
            &[":8: effect[3].gravity-compensator: joint 1 has a compensator already on line 6"],
        ),
    ];
    for (effect, words) in effects {
        check_problems(&[(&format!("[[effect]]\n{effect}"), words)]);
    }
}
