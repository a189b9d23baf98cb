//! Generated C code, compiled and compared with the library.

use std::fs;
use std::path::Path;
use std::process::Command;

use flexcal::problem::Problem;
use nalgebra::DVector;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use super::common::arms::path;
use super::common::made::{at_random, csv, divided, measure, model_of};
use super::common::program::{Folder, assert_contains};
use super::lunar_sampler;

/// Options under which the code compiles without a warning.
const STRICT: &str = "-std=c99 -O1 -Wall -Wextra -Werror -pedantic";

/// Compiles the code in a folder with each compiler and set of options, and runs its test.
fn check(folder: &Path) {
    let sources = ["flexcal_model.c", "flexcal_model_test.c"];
    for compiler in ["gcc", "clang"] {
        if Command::new(compiler).arg("--version").output().is_err() {
            eprintln!("skipped: {compiler} is not installed, so it has not compiled the code");
            continue;
        }
        for options in ["", "-DFLEXCAL_FLOAT", "-fsanitize=address,undefined"] {
            let mut command = Command::new(compiler);
            command.args(STRICT.split(' ')).args(options.split_whitespace()).args(sources);
            let built = command.args(["-o", "test", "-lm"]).current_dir(folder).output().unwrap();
            let said = String::from_utf8_lossy(&built.stderr);
            if !built.status.success() && options.contains("sanitize") && said.contains("asan") {
                eprintln!("skipped: the sanitizers of {compiler} are not installed");
                continue;
            }
            assert!(built.status.success(), "{compiler} {options}: {said}");
            let ran = Command::new(folder.join("test")).output().unwrap();
            let (told, said) =
                (String::from_utf8_lossy(&ran.stdout), String::from_utf8_lossy(&ran.stderr));
            assert!(ran.status.success(), "{compiler} {options}: {told}{said}");
        }
    }
}

/// Exports the estimate in `out` of a folder, and checks the code.
fn export(folder: &Folder, problem: &str) {
    let words = format!(
        "export {problem} --estimate out/estimate.json --format c --out code --test-poses 100 --test-commands 20"
    );
    folder.flexcal(&words).success();
    check(&folder.path("code"));
}

#[test]
fn an_elastic_arm_with_hoist_and_loads() {
    let folder = lunar_sampler();
    export(&folder, &path("tests/cases").display().to_string());
}

/// Writes a problem and rows of its arm with drawn parameters, identifies and exports it.
fn made(text: &str) {
    let folder = Folder::with([("problem.toml", text)]);
    let problem = Problem::read(&folder.path("problem.toml")).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut rows = at_random(&problem, 60, 1.0, &mut rng);
    let x = DVector::zeros(model_of(&problem, &rows).parameters.len());
    measure(&problem, &mut rows, &x, 2e-5, &mut rng);
    folder.write("rows.csv", csv(&problem, &divided(40, &rows)));
    let run = folder.flexcal("identify . --data rows.csv --out out --quiet");
    assert!(folder.has("out/estimate.json"), "{run:?}");
    export(&folder, ".");
}

/// Returns the declaration of a law with one term.
fn law(at: &str, term: &str) -> String {
    let name = at.replace('.', "-");
    format!("[[effect]]\nlaw = {{ name = '{name}', at = '{at}', terms = ['{term}'] }}\n")
}

/// Returns laws of small motions before and behind joints, of the tool and of the range.
fn motions() -> String {
    let sites = ["joint3.x", "joint2.ry", "joint2.after.rz", "tool.y", "measurement.range"];
    sites.map(|site| law(site, "sin(q3 + 1)")).concat()
}

#[test]
fn laws_play_springs_and_slides() {
    let text = format!(
        "name = 'odd'\n[[joint]]\nalpha_deg = 10\nstiffness_N_m_per_rad = 2e4\n\
         [[joint]]\na_m = 0.4\nalpha_deg = 90\n[[joint.body]]\nmass_kg = 4\ncom_m = [0.1, 0, 0]\n\
         [[joint]]\na_m = 0.3\nd_m = 0.1\n[[joint]]\nkind = 'prismatic'\nalpha_deg = 90\nd_m = 0.2\nmin_mm = 0\nmax_mm = 300\n\
         [tool]\ntarget_m = [0.1, 0.05, 0.1]\npayload_kg = 3\n{}{}{}{}\
         [[effect]]\njoint-lateral-compliance = {{ joint = 2 }}\n[[effect]]\nbase-compliance = {{}}\n\
         [[effect]]\njoint-compliance = {{ joint = 3 }}\n[[effect]]\njoint-nonlinear-stiffness = {{ joint = 2 }}\n\
         [[effect]]\ntracker-scale = {{}}\n[[effect]]\nlink-bending = {{ joint = 2 }}\n\
         [parameters]\n'joint1.stiffness' = {{ sigma_relative = 0.1 }}\n'joint*.theta' = {{ sigma_deg = 0.1 }}\n\
         [data]\nfiles = ['rows.csv']\nposition_sigma_mm = 0.02\n",
        law("joint3", "sin(2*q2)*max(q3, 0.2) + sign(q2)*spline(q3 + 2)"),
        law("joint2", "tanh(q3)^3 + atan2(q2, 2)"),
        law("measurement.x", "expm1(q2/5) + step(q3)*abs(q2)^1.5"),
        motions(),
    );
    made(&text);
}

#[test]
fn small_motions_of_a_rigid_arm() {
    made(&format!(
        "name = 'rigid'\n[[joint]]\nalpha_deg = 10\n[[joint]]\na_m = 0.4\nalpha_deg = 90\n\
         [[joint]]\na_m = 0.3\nd_m = 0.1\ntheta_deg = 65\nmin_deg = -40\nmax_deg = 40\n[tool]\ntarget_m = [0.1, 0.05, 0.1]\n{}\
         [parameters]\n'joint*.theta' = {{ sigma_deg = 0.1 }}\n\
         [data]\nfiles = ['rows.csv']\nposition_sigma_mm = 0.02\n",
        motions()
    ));
}

#[test]
fn a_remainder_at_the_joints() {
    let problem = Problem::read(&path("problems/panda")).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut rows = at_random(&problem, 180, 1.0, &mut rng);
    let mut moved = rows.clone();
    let n = moved.joints;
    for configuration in moved.configurations.chunks_mut(n) {
        for joint in [1, 3] {
            configuration[joint] += 3e-4 * (5.0 * configuration[joint]).sin();
        }
    }
    let x = DVector::zeros(model_of(&problem, &rows).parameters.len());
    measure(&problem, &mut moved, &x, 2e-5, &mut rng);
    rows.positions = moved.positions;
    let folder = Folder::with([("rows.csv", &csv(&problem, &divided(90, &rows)))]);
    folder.copy("problems/panda/problem.toml", "problem.toml");
    let run = folder.flexcal("identify . --data rows.csv --remainder --out out --quiet");
    assert!(folder.has("out/remainder.json"), "{run:?}");
    export(&folder, ".");
    assert_contains(&folder.read("code/flexcal_model.c"), &["#define REMAINDER 1"]);
}

#[test]
fn effects_with_memory_are_refused() {
    let folder = Folder::with_lunar_sampler();
    let lagging =
        "\n[[effect]]\nlink-thermal-bending-lag = { link = 'A', time_constant_s = 600 }\n";
    folder.map("problem.toml", |text| format!("{text}{lagging}"));
    folder.flexcal("identify . --out out --quiet");
    let run = folder.flexcal("export . --estimate out/estimate.json --format c --out code").code(2);
    assert_contains(&run.stderr, &["depends on earlier poses"]);
    assert!(!folder.has("code"));
}

#[test]
fn the_page_shows_what_is_printed() {
    let folder = lunar_sampler();
    let page = fs::read_to_string(path("docs/accuracy.md")).unwrap();
    let block = page.split("```console\n$ flexcal export ").nth(1).unwrap();
    let (block, _) = block.split_once("```").unwrap();
    let (words, expected) = block.split_once('\n').unwrap();
    let words = words.replace("problems/lunar-sampler", &path("tests/cases").display().to_string());
    assert_eq!(folder.flexcal(&format!("export {words}")).stdout, expected);
}
