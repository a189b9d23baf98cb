//! Arguments and input errors: exit status, messages, and no output after bad input.

use std::fs;

use crate::common::program::{Folder, assert_contains, findings};

#[test]
fn the_problem_may_stand_behind_the_data_or_in_the_current_folder() {
    let folder = Folder::with_lunar_sampler();
    let run = |arguments: &str| folder.flexcal(arguments);
    run("identify --quiet --data a-none.csv problem.toml").success();
    run("identify --quiet").success();
    run("identify --quiet --data a-none.csv --out elsewhere").success();
    assert!(folder.has("out/lunar-sampler/estimate.json") && folder.has("elsewhere/estimate.json"));
    // A closed problem gets a separate folder.
    folder.write("problem.closed.toml", folder.read("problem.toml"));
    run("identify problem.closed.toml --quiet").success();
    assert!(folder.has("out/lunar-sampler-closed/estimate.json"));
    // A plan can be simulated.
    folder.copy("tests/cases/truth.toml", "truth.toml");
    let room = "--workspace-mm=-4000,4000,0,4000,-4000,4000 --keep-out-mm 1,0,0,-500";
    run(&format!("plan --truth truth.toml --poses 12 --quiet --out plan {room}"));
    run("simulate --truth truth.toml --data plan/plan.csv --seed 3 --quiet --out rig").success();
    let (planned, measured) = (folder.table("plan/plan.csv"), folder.table("rig/measurements.csv"));
    assert_eq!(planned.numbers("q2_deg"), measured.numbers("q2_deg"));
    assert!(
        measured.numbers("y_mm").iter().all(|y| *y > -100.0)
            && measured.numbers("x_mm").iter().all(|x| *x > -600.0)
    );
    for (arguments, words) in [
        ("--truth truth.toml --workspace-mm 1,0,0,1,0,1", "the box is empty"),
        (
            "--truth truth.toml --workspace-mm=4,4.7,0,0.5,0,0.5",
            "whose longest side is 0.700 mm: if its numbers are metres, multiply them by 1000",
        ),
        (
            "--truth truth.toml --workspace-mm=90000,91000,0,500,0,500",
            "in no pose is the target inside the region; check --workspace-mm",
        ),
        ("--truth a-none.csv", "--truth a TRUTH.toml, and tables of rows or poses follow --data"),
    ] {
        let run = run(&format!("plan --poses 12 {arguments}")).code(2);
        assert_contains(&run.stderr, &[words]);
    }
}

/// Replaces everything from the section `[parameters]` on.
fn replace_parameters(folder: &Folder, parameters: &str) {
    let data = "[data]\nfiles = [\"a-none.csv\"]\nposition_sigma_mm = 0.05\nheld_out = { column = \"split\" }\n";
    folder.map("problem.toml", |text| {
        format!("{}{parameters}{data}", text.split_once("[parameters]").unwrap().0)
    });
}

#[test]
fn too_few_equations_are_not_trusted() {
    let folder = Folder::with_lunar_sampler();
    replace_parameters(&folder, "[parameters]\n\"*\" = { free = true }\n");
    folder.keep_marked(DATA, "identification", 5);
    folder.flexcal("identify .").code(1);
    let json = folder.json("out/lunar-sampler/estimate.json");
    assert_eq!((&json["trusted"], findings(&json)[0]), (&false.into(), "too-few-equations"));
    assert_eq!(json["findings"][0]["numbers"]["coordinates"], 15);
}

/// File edit that makes an error, and the words that the message must contain.
type Mistake = (&'static str, fn(&Folder), &'static [&'static str]);

const DATA: &str = "a-none.csv";
const PROBLEM: &str = "problem.toml";

#[test]
fn where_nothing_is_free_every_command_that_fits_says_so() {
    let folder = Folder::new();
    let problem = "name = 'arm'\n[[joint]]\na_m = 1\n[[joint]]\na_m = 1\n[data]\nfiles = ['rows.csv']\n\
                   position_sigma_mm = 0.1\nheld_out = { fraction = 0.3, seed = 1 }\n";
    folder.write("problem.toml", problem);
    folder.write(
        "TRUTH.toml",
        "[noise]\nposition_sigma_mm = 0.1\n[poses]\nq1_deg = [-90, 90]\nq2_deg = [-90, 90]\n",
    );
    folder.simulate(".", "TRUTH.toml", 20, 1, "rows.csv");
    for command in ["identify", "trace", "loop"] {
        let run = folder.flexcal(command);
        assert_contains(&run.stderr, &["no parameter is free, so the nominal arm is judged"]);
    }
}

#[test]
#[expect(clippy::too_many_lines, reason = "a table of mistakes")]
fn bad_input_is_named_and_leaves_nothing_behind() {
    let mistakes: &[Mistake] = &[
        ("empty file", |b| b.write(DATA, ""), &[DATA, "empty"]),
        ("header only", |b| b.map_rows(DATA, |_, _| None), &[DATA, "no rows"]),
        (
            "NaN",
            |b| b.edit(DATA, "1840.7678", "NaN"),
            &["a-none.csv:2", "x_mm", "missing = \"NaN\""],
        ),
        ("infinity", |b| b.edit(DATA, "1840.7678", "inf"), &["a-none.csv:2", "x_mm", "finite"]),
        (
            "text in a number",
            |b| b.edit(DATA, "1840.7678", "far"),
            &["a-none.csv:2", "x_mm", "far"],
        ),
        (
            "short row",
            |b| {
                b.map_rows(DATA, |n, l| {
                    Some(if n == 5 { "4,identification".into() } else { l.into() })
                });
            },
            &["a-none.csv:5", "fields"],
        ),
        ("missing column", |b| b.edit(DATA, ",z_mm,", ",height_mm,"), &[DATA, "z_mm"]),
        ("doubled column", |b| b.edit(DATA, ",payload_kg,", ",x_m,"), &[DATA, "x_m"]),
        ("no unit in the data", |b| b.edit(DATA, "q2_deg", "q2"), &[DATA, "q2", "unit"]),
        (
            "no unit in the problem",
            |b| b.edit(PROBLEM, "alpha_deg = 90.0", "alpha = 90.0"),
            &["problem.toml:15", "alpha", "unit"],
        ),
        (
            "no held-out rows",
            |b| b.map_rows(DATA, |_, l| Some(l.replace("validation", "identification"))),
            &["held out"],
        ),
        (
            "no identification rows",
            |b| b.map_rows(DATA, |_, l| Some(l.replace("identification", "validation"))),
            &["no rows are left to fit"],
        ),
        (
            "unknown split word",
            |b| b.edit(DATA, ",validation,", ",test,"),
            &["a-none.csv:2", "split", "test"],
        ),
        ("binary junk", |b| b.write(DATA, [0xff, 0xfe, 0x00, 0x80, b'\n']), &[DATA]),
        ("binary problem", |b| b.write(PROBLEM, [0xff, 0xfe, 0x00]), &[PROBLEM]),
        (
            "unknown key",
            |b| b.edit(PROBLEM, "beam_elements = 1", "beam_pieces = 1"),
            &["problem.toml:7", "beam_pieces"],
        ),
        (
            "negative mass",
            |b| b.edit(PROBLEM, "mass_kg = 4.2", "mass_kg = -4.2"),
            &["problem.toml:27", "mass_kg"],
        ),
        (
            "zero stiffness",
            |b| b.edit(PROBLEM, "5.2e4", "0.0"),
            &["problem.toml:17", "stiffness_N_m_per_rad"],
        ),
        (
            "no joints",
            |b| b.write(PROBLEM, "name = \"none\"\n[data]\nfiles = [\"a-none.csv\"]\n"),
            &[PROBLEM, "joint"],
        ),
        ("broken TOML", |b| b.edit(PROBLEM, "[statics]", "[statics"), &["problem.toml:5"]),
        (
            "pattern that matches nothing",
            |b| b.edit(PROBLEM, "\"B.*\"", "\"C.*\""),
            &["problem.toml:77", "C.*", "matches no parameter of this arm; they are"],
        ),
        (
            "min above max",
            |b| {
                b.edit(
                    PROBLEM,
                    "\"tool.*\" = { sigma_mm = 5.0 }",
                    "\"tool.*\" = { min_mm = 2, max_mm = -2 }",
                );
            },
            &["problem.toml:78", "min"],
        ),
        (
            "σ of the wrong kind",
            |b| {
                b.edit(
                    PROBLEM,
                    "\"tool.*\" = { sigma_mm = 5.0 }",
                    "\"tool.*\" = { sigma_deg = 5.0 }",
                );
            },
            &["problem.toml:78", "tool.x", "_mm"],
        ),
        (
            "missing data file",
            |b| fs::remove_file(b.path(DATA)).unwrap(),
            &["problem.toml:81", DATA],
        ),
        (
            "no data file",
            |b| b.edit(PROBLEM, "files = [\"a-none.csv\"]\n", ""),
            &["problem.toml:80", "`files` or with --data"],
        ),
        ("missing problem", |b| fs::remove_file(b.path(PROBLEM)).unwrap(), &["no such file"]),
        (
            "zero sigma",
            |b| b.edit(PROBLEM, "position_sigma_mm = 0.05", "position_sigma_mm = 0.0"),
            &["problem.toml:82", "position_sigma_mm"],
        ),
        (
            "an arm too soft to stand",
            |b| b.edit(PROBLEM, "5.2e4", "1.0"),
            &["a-none.csv:2", "equilibrium", "joint 2 (./problem.toml:13) may be too soft"],
        ),
        (
            "masses in grams",
            |b| {
                b.edit(PROBLEM, "mass_kg = ", "mass_kg = 10000");
            },
            &["equilibrium", "too heavy for an arm", "check its unit (kg)"],
        ),
    ];
    for (what, spoil, expected) in mistakes {
        let folder = Folder::with_lunar_sampler();
        spoil(&folder);
        let run = folder.flexcal("identify .").code(2);
        assert_contains(&run.stderr, expected);
        assert!(
            run.stderr.starts_with("error: ") && !run.stderr.contains("panicked"),
            "{what}: {run:?}"
        );
        assert!(run.stdout.is_empty() && !folder.has("out"), "{what} left something behind");
    }
}

#[test]
fn wrong_arguments_end_with_status_two_and_help_with_zero() {
    let folder = Folder::new();
    folder.flexcal("identify").code(2);
    folder.flexcal("identify . --strategy guess").code(2);
    folder.write("problem.toml", "");
    for (arguments, words) in [
        ("identify . --heldout 0.3", "tip: the problem says which poses are held out"),
        ("loop . -d x.csv", "tip: --data FILE names measurement files"),
        ("check . --poses -3", "'-3' for '--poses <N>': a whole number from 1 to 10000 is needed"),
        ("check . --poses 40.5", "'40.5' for '--poses <N>': a whole number from 1 to 10000"),
        (
            "-v identify .",
            "tip: write options behind the command, as in flexcal identify PROBLEM -v",
        ),
        ("problem.toml", "tip: write a command first, as in flexcal identify problem.toml"),
        ("export . --estimate e.json --format URDF", "tip: leave --format out to write a URDF"),
        ("init .", "it is a folder; give the URDF of the arm"),
        ("identify . --ouput out", "tip: --out DIR names the folder of the results"),
        ("loop . --solver lm", "tip: loop takes no --solver; it is an option of identify"),
        (
            "loop . --tolerance 0.2",
            "tip: loop takes no --tolerance; --tolerance-mm is an option of accept",
        ),
        ("accept . --tolerance 0.2", "'--tolerance-mm'"),
        ("next . --estimate e.json", "tip: next takes no --estimate, because it fits by itself"),
        ("export . --estimate e.json", "<--urdf <ARM.urdf>|--format <FORMAT>>"),
        ("compensate . --data t.csv", "flexcal identify writes estimate.json"),
        ("export . --estimate e.json", "the values of --format are ur-yaml, ros-yaml, mdh, dh"),
        ("export . --estimate e.json --format csv", "tip: mdh or dh write the table"),
        ("accept . --tolerance-mm -0.1", "--tolerance-mm is followed by -0.1"),
        (
            "identify . rows.csv",
            "tip: tables of measurements follow --data, as in flexcal identify PROBLEM --data rows.csv",
        ),
        (
            "compare a/estimate.json b/estimate.json",
            "flexcal compare-results a/estimate.json b/estimate.json",
        ),
        ("identify .\\problem.toml", "on this system write ./problem.toml"),
        ("calibrate .", "tip: flexcal identify may be meant"),
    ] {
        assert_contains(&folder.flexcal(arguments).code(2).stderr, &[words]);
    }
    let sampler = Folder::with_lunar_sampler();
    sampler.write("my data.csv", "");
    let spaced = sampler.flexcal("identify . --data my").code(2);
    assert_contains(&spaced.stderr, &["quotes: there is \"my data.csv\""]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("gone.csv", sampler.path("latest.csv")).unwrap();
        let linked = sampler.flexcal("identify . --data latest.csv").code(2);
        assert_contains(&linked.stderr, &["latest.csv is a link to gone.csv, which is not there"]);
    }
    let commas = Folder::with_lunar_sampler().flexcal("identify . --data=a.csv,b.csv").code(2);
    assert_contains(&commas.stderr, &["spaces separate files, as in --data a.csv b.csv"]);
    folder.flexcal("--help").success();
    folder.flexcal("identify --help").success();
}
