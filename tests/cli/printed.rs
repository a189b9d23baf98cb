//! Content and length of printed output.

use std::fs;

use crate::common::arms::path;
use crate::common::program::{
    Folder, assert_contains, in_one_line, items, named, number, run_in_package,
};

#[test]
fn identify_prints_a_table_and_writes_the_estimate() {
    let folder = Folder::with_lunar_sampler();
    let run = folder.flexcal("identify . -v").success();
    let json = folder.json("out/lunar-sampler/estimate.json");
    assert_eq!((&json["held_out"]["n"], &json["rank"]), (&50.into(), &31.into()));
    assert_eq!(
        (&json["solver"], &json["solver_reason"]),
        (&"levenberg-marquardt".into(), &"no bounds".into())
    );
    assert!(number(&json["held_out"]["rms_mm"]["norm"]) < 0.14);
    for key in ["problem", "strategy", "termination", "iterations", "seconds", "reduced_chi2"] {
        assert!(!json[key].is_null(), "{key}");
    }
    let parameters = items(&json["parameters"]);
    assert_eq!(parameters.len(), 32);
    for parameter in parameters {
        for key in ["unit", "nominal", "estimate", "std_error", "identified"] {
            assert!(!parameter[key].is_null(), "{key} in {parameter}");
        }
        assert_contains(&run.stdout, &[parameter["name"].as_str().unwrap()]);
    }
    assert!(named(&json["parameters"], "joint2.stiffness")["at_bound"].is_null());
    let unidentifiable = &json["unidentified"][0];
    let share = number(&unidentifiable["combination"]["joint1.beta"]);
    assert!((share - 0.5_f64.sqrt()).abs() < 1e-6);
    assert!(number(&unidentifiable["singular_value"]) < 1e-9);
    assert_contains(
        &run.stdout,
        &["held out", "mean norm", "Reduced χ²", "rank 31 of 32", "estimate.json"],
    );
    assert!(!run.stdout.contains("no standard error"), "every value has one:\n{}", run.stdout);
    for name in ["report.md", "report.html"] {
        assert_contains(&run.stdout, &[name]);
        assert!(folder.path("out/lunar-sampler").join(name).exists(), "{name}");
    }
}

#[test]
fn a_rule_that_holds_all_that_others_free_is_told() {
    let folder = Folder::with_lunar_sampler();
    folder.map("problem.toml", |text| {
        let held = text.replace("\n[data]", "\n\"*\" = { fixed = true }\n[data]");
        // The noise that the nominal arm would need.
        held.replace("position_sigma_mm = 0.05", "position_sigma_mm = 30")
    });
    let run = folder.flexcal("identify .").success();
    assert_contains(&run.stdout, &["No parameter is free", "nominal arm is judged"]);
    assert_contains(&in_one_line(&run.stderr), &["later lines hold all of them"]);
}

/// Writes arms with measurements, given or simulated; returns problem and data of each.
fn arms(folder: &Folder) -> Vec<[String; 2]> {
    let cases = path("tests/cases").display().to_string();
    let mut arms: Vec<[String; 2]> = ["a-none", "f-two", "g-not-in-catalogue"]
        .map(|name| [cases.clone(), format!("{cases}/{name}.csv")])
        .to_vec();
    for arm in ["lunar-sampler", "service-arm", "panda", "ur10-urdf", "scara", "gantry"] {
        let problem = path("problems").join(arm).display().to_string();
        let mut data = path("problems").join(arm).join("measurements.csv");
        if !data.is_file() {
            data = folder.path(format!("{arm}.csv"));
            folder.simulate(&problem, &problem, 48, 1, &format!("{arm}.csv"));
        }
        arms.push([problem, data.display().to_string()]);
    }
    arms
}

#[test]
fn what_is_printed_fits_on_a_screen_unless_more_is_asked_for() {
    let folder = Folder::new();
    let run = |arguments: &str| {
        let run = folder.flexcal(arguments);
        assert!(run.status < 2, "{run:?}");
        run.stdout
    };
    for (index, [problem, data]) in arms(&folder).into_iter().enumerate() {
        for command in ["identify", "loop"] {
            let arguments = format!("{command} {problem} -o out --data {data}");
            let brief = run(&arguments);
            let lines = |text: &str| text.lines().count();
            assert!(lines(&brief) <= 25, "{command} {data}:\n{brief}");
            if index == 0 {
                let whole = run(&format!("{arguments} -v"));
                assert!(lines(&whole) > lines(&brief), "{command} {data}:\n{whole}");
            }
            // The next command may be longer because of its paths.
            let lines = brief.lines().filter(|line| !line.starts_with("Next: "));
            assert!(
                lines.map(|line| line.chars().count()).all(|width| width <= 110),
                "{command} {data}:\n{brief}"
            );
            assert_contains(&brief, &["held out", "Written to out: ", "\nNext: flexcal "]);
        }
        assert_eq!(run(&format!("identify {problem} -q -o out --data {data}")), "");
    }
}

#[test]
fn commands_to_copy_keep_paths_whole_and_one_is_no_plural() {
    let folder = Folder::with_lunar_sampler();
    let run = folder.flexcal("identify . -o 'my results'").success();
    assert_contains(&run.stdout, &[" 'my results/"]);
    folder.copy("tests/cases/a-none.csv", "my arm/a-none.csv");
    folder.keep_marked("my arm/a-none.csv", "validation", 1);
    folder.copy("tests/cases/problem.toml", "my arm/problem.toml");
    let run = folder.flexcal("identify 'my arm'");
    assert_contains(&run.stdout, &["'my arm'", ", 1 pose held out;"]);
}

#[test]
fn json_is_all_there_is_on_standard_output_and_quiet_is_quiet() {
    let folder = Folder::with_lunar_sampler();
    let json = folder.flexcal("identify . --json --out elsewhere").success().json();
    assert_eq!(json["problem"], "lunar-sampler");
    assert!(folder.has("elsewhere/estimate.json") && !folder.has("out"));
    assert!(folder.flexcal("identify . --quiet --out out").success().is_silent());
}

#[test]
fn the_readme_shows_what_is_printed() {
    let readme = std::cell::RefCell::new(fs::read_to_string(path("README.md")).unwrap());
    let refills = std::env::var_os("FLEXCAL_REFILL").is_some();
    // The third line of a fit ends with its duration.
    let timeless = |text: &str| -> Vec<String> {
        text.trim_end()
            .lines()
            .map(|line| line.split(" steps, ").next().unwrap().to_owned())
            .collect()
    };
    let compare = |mark: &str, printed: &str| {
        let fence = format!("<!-- {mark} -->\n```text\n");
        let text = readme.borrow().clone();
        let (before, after) = text.split_once(&fence).unwrap();
        let (shown, rest) = after.split_once("\n```").unwrap();
        if refills {
            *readme.borrow_mut() = format!("{before}{fence}{}\n```{rest}", printed.trim_end());
        } else {
            assert_eq!(timeless(shown), timeless(printed), "FLEXCAL_REFILL=1 prints it anew");
        }
    };
    let folder = Folder::new();
    let lunar = path("problems/lunar-sampler");
    compare("loop", &folder.flexcal(&format!("loop {}", lunar.display())).stdout);
    let drawn = folder.read("out/lunar-sampler/figures/effect-1.svg");
    if refills {
        fs::write(path("docs/effect.svg"), &drawn).unwrap();
    }
    // Coordinates may round differently on another machine.
    let shapes = |svg: &str| svg.replace(|c: char| c.is_ascii_digit() || c == '.', "");
    let kept = fs::read_to_string(path("docs/effect.svg")).unwrap();
    assert_eq!(shapes(&kept), shapes(&drawn), "FLEXCAL_REFILL=1 draws it anew");
    if refills {
        fs::write(path("README.md"), &*readme.borrow()).unwrap();
    }
    assert!(readme.borrow().lines().count() < 130, "one page");
}

#[test]
fn the_screen_of_a_loop_says_what_an_effect_is_not_told_from() {
    let printed =
        run_in_package("loop tests/cases --data tests/cases/c-link-thermal-bending.csv").words();
    let expected = "link-thermal-bending = { link = \"B\" }; not excluded: zero of joint 3 drifts with temperature";
    assert_contains(&printed, &[expected]);
}

#[test]
fn limits_that_hold_the_declared_fit_are_said_beside_what_was_found() {
    let printed = run_in_package("loop tests/cases/bounded/stiffness.toml").words();
    let expected = "Limits are active in the declared fit (joint3.stiffness, A.GJ). If one is wrong, an effect";
    assert_contains(&printed, &[expected, "What was found"]);
    // Without effects no effect replaces a limit; a wrong limit is reported.
    let json = run_in_package("loop problems/service-arm --json").json();
    assert_eq!(
        (&json["unexplained"]["law"], &json["unexplained"]["limit"]),
        (&"limit".into(), &"of joint4.a".into())
    );
    let printed = run_in_package("loop problems/service-arm").words();
    assert_contains(
        &printed,
        &["Check the limit of joint4.a, at which the fit stops: with probability"],
    );
    for printed in [printed, run_in_package("loop tests/cases").words()] {
        assert!(!printed.contains("Limits are active"), "{printed}");
    }
}

#[test]
fn a_fit_that_tells_little_is_followed_by_a_check() {
    let folder = Folder::with_lunar_sampler();
    folder.keep_marked("a-none.csv", ",identification,", 1);
    let run = folder.flexcal("identify . -o out").success();
    let json = folder.json("out/estimate.json");
    assert!(items(&json["parameters"]).iter().all(|p| number(&p["identified"]) < 0.9), "{json}");
    assert_contains(
        &run.stdout,
        &[
            "\nOf 32 parameters the data determine 0 well",
            "\nNext: flexcal check . says what the poses can tell\n",
        ],
    );
}

#[test]
fn reports_state_the_verdict_the_bound_and_the_warnings_of_the_screen() {
    let folder = Folder::with_lunar_sampler();
    // A copied row causes a warning on the rows.
    let table = folder.read("a-none.csv");
    let copied = table.lines().nth(5).unwrap();
    folder.write("a-none.csv", format!("{table}{copied}\n"));
    for (command, verdict) in [("identify", "Trusted"), ("loop", "Nothing found: ")] {
        let run = folder.flexcal(&format!("{command} . --out out"));
        assert!(run.status < 2, "{run:?}");
        assert_contains(&run.stderr, &["in all digits"]);
        for report in ["out/report.md", "out/report.html"] {
            let words = [verdict, "Error bound of a prediction", "in all digits"];
            assert_contains(&folder.read(report), &words);
        }
    }
}

#[test]
fn applying_an_estimate_that_leaves_more_than_noise_is_followed_by_a_loop() {
    let folder = Folder::with_lunar_sampler();
    let after = |data: &str| {
        folder.copy(&format!("tests/cases/{data}.csv"), "a-none.csv");
        folder.flexcal("identify . --out out").success();
        let predict = "predict . --estimate out/estimate.json --out p";
        folder.flexcal(predict).success().words()
    };
    let words = "Next: flexcal loop . looks for what the model lacks, because the estimate leaves";
    assert_contains(&after("c-link-thermal-bending"), &[words]);
    assert_contains(&after("a-none"), &["Next: flexcal compensate . --estimate"]);
}

/// What remembers the poses before depends on fitted and held-out ones alike, so that neither error
/// bounds nor the watch may predict held-out poses by themselves.
#[test]
fn held_out_poses_of_an_arm_with_hysteresis_keep_their_past() {
    let folder = Folder::new();
    for name in ["problem.toml", "TRUTH.toml"] {
        folder.copy(&format!("problems/scara/{name}"), name);
    }
    let hysteresis = "joint-hysteresis = { joint = 1, distance_rad = 1.0 }";
    folder.map("problem.toml", |text| format!("{text}\n[[effect]]\n{hysteresis}\n"));
    folder.edit("TRUTH.toml", "gear-ratio = { joint = 2 }", hysteresis);
    folder.edit("TRUTH.toml", "error_relative = 0.001", "amplitude_deg = 0.1");
    folder.simulate(".", "TRUTH.toml", 60, 1, "measurements.csv");
    let said = folder.flexcal("identify . --out id").success().stdout;
    assert!(said.contains("Trusted: ") && !said.contains("exceed their"), "{said}");
    let watched = folder.flexcal("watch . --estimate id/estimate.json --out watched").success();
    assert_contains(&watched.stdout, &["No change shown", "42 rows left out"]);
}

#[test]
fn a_residual_beyond_the_declared_sigma_leaves_predictions_to_be_trusted_alone() {
    let folder = Folder::with_lunar_sampler();
    let identify = |data: &str| {
        folder.copy(&format!("tests/cases/{data}.csv"), "a-none.csv");
        let said = folder.flexcal("identify . --out out -v").success().words();
        let json = folder.json("out/estimate.json");
        assert_eq!(json["trusted"], true);
        (said, json["verdict"].as_str().unwrap().to_owned())
    };
    let doubt = "standard errors assume that the model lacks nothing";
    let (said, verdict) = identify("d-backlash");
    let head = "Predictions are trusted within the error bound below, single parameters are not: the residual is";
    assert_contains(&said, &[head, "may have absorbed what the model lacks. The mean", doubt]);
    assert_eq!(verdict, "predictions");
    let (said, verdict) = identify("a-none");
    assert!(said.contains("Trusted: the mean") && !said.contains(doubt), "{said}");
    assert_eq!(verdict, "trusted");
}

#[test]
fn a_loop_says_what_held_out_rows_say_of_its_fit() {
    let folder = Folder::new();
    folder.copy("problems/scara/problem.toml", "problem.toml");
    folder.copy("problems/scara/TRUTH.toml", "TRUTH.toml");
    // A true arm, of which a fit to 10 poses can only make a worse one.
    folder.map("TRUTH.toml", |text| {
        let (_, rest) = text.split_once("[noise]").unwrap();
        format!("[noise]{rest}")
    });
    folder.edit("problem.toml", "{ column = \"split\" }", "{ fraction = 0.6, seed = 1 }");
    folder.simulate(".", "TRUTH.toml", 24, 1, "measurements.csv");
    let keep = "Next: keep the nominal arm, or flexcal next . chooses";
    for command in ["identify", "loop"] {
        let run = folder.flexcal(&format!("{command} . --out {command}")).success();
        assert_contains(&run.words(), &["the fit made held-out errors worse", keep]);
    }
    assert_eq!(folder.json("identify/estimate.json")["verdict"], "contradicted");
    let folder = Folder::with_lunar_sampler();
    folder.copy("tests/cases/f-two.csv", "a-none.csv");
    let few = "39 of 50 held-out configurations lie within their bounds; as few or fewer do so by chance in";
    assert_contains(&folder.flexcal("loop . --out out").success().words(), &[few]);
}
