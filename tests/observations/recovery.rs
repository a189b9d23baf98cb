//! Recovery of the truth from rows of every kind, within standard errors.

use std::fmt::Write as _;

use flexcal::fit::{Identification, Options, PointSpread, identify};
use nalgebra::Vector3;

use crate::bench::{ANCHORS, AROUND, Bench, CENTRE, POINTS, problem, true_arm};
use crate::common::reading::read_dataset;

/// Returns the deviations from the truth in standard errors.
fn deviations(found: &Identification, truth: &[(String, f64)]) -> Vec<(String, f64)> {
    let one = |(name, value): &(String, f64)| {
        let estimate = found.estimate(name)?;
        Some((name.clone(), (estimate.estimate - value) / estimate.std_error?))
    };
    truth.iter().filter_map(one).collect()
}

fn fixtures() -> Vec<(String, f64)> {
    let of = |word: &'static str, (name, place): (&'static str, [f64; 3])| {
        ["x", "y", "z"]
            .into_iter()
            .zip(place)
            .map(move |(axis, value)| (format!("{word}[{name}].{axis}"), value))
    };
    let points = POINTS.into_iter().flat_map(|name| of("point", name));
    let anchors = ANCHORS.into_iter().flat_map(|name| of("anchor", name));
    points.chain(anchors).chain(of("surface", ("ball", CENTRE))).collect()
}

#[test]
fn each_kind_and_all_together_find_the_arm() {
    let problem = problem(AROUND);
    for (kinds, least) in [
        (&["point"][..], 25),
        (&["distance"], 20),
        (&["plane", "sphere"], 15),
        (&["tilt"], 8),
        (&["position", "point", "distance", "plane", "sphere", "tilt"], 35),
    ] {
        let mut all = Vec::new();
        for seed in 1..=3 {
            let (arm, mut truth) = true_arm(&problem, seed);
            truth.extend(fixtures());
            let data = read_dataset(
                &problem,
                &Bench::new(arm, 100 + seed).table(kinds, 150 / kinds.len()),
            );
            let found = identify(&problem, &data, &Options::default()).unwrap();
            assert!(found.is_trusted(), "{kinds:?}, seed {seed}: {:?}", found.findings);
            let chi2 = found.reduced_chi2.unwrap();
            assert!((0.6..1.5).contains(&chi2), "{kinds:?}, seed {seed}: {chi2}");
            all.extend(deviations(&found, &truth));
        }
        let worst = all.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap();
        let rms = (all.iter().map(|(_, z)| z * z).sum::<f64>() / all.len() as f64).sqrt();
        println!(
            "{kinds:?}: {} deviations, rms {rms:.2} σ, worst {:.1} σ at {}",
            all.len(),
            worst.1,
            worst.0
        );
        assert!(all.len() >= 3 * least, "{kinds:?}: {}", all.len());
        assert!(
            (0.7..1.35).contains(&rms) && worst.1.abs() < 4.5,
            "{kinds:?}: rms {rms}, worst {worst:?}"
        );
    }
}

/// Checks the coverage over random arms: one and two standard errors contain 68.3 and 95.4 % of the
/// estimates of each kind of rows.
#[test]
#[ignore = "a study of some minutes"]
fn coverage_of_each_kind() {
    let problem = problem(AROUND);
    for kinds in [
        &["point"][..],
        &["distance"],
        &["plane", "sphere"],
        &["tilt"],
        &["position", "point", "distance", "plane", "sphere", "tilt"],
    ] {
        let mut all: Vec<f64> = Vec::new();
        let mut chi2 = Vec::new();
        for seed in 1..=60 {
            let (arm, mut truth) = true_arm(&problem, 1000 + seed);
            truth.extend(fixtures());
            let data = read_dataset(
                &problem,
                &Bench::new(arm, 2000 + seed).table(kinds, 150 / kinds.len()),
            );
            let found = identify(&problem, &data, &Options::default()).unwrap();
            assert!(found.is_trusted(), "{kinds:?}, seed {seed}: {:?}", found.findings);
            all.extend(deviations(&found, &truth).into_iter().map(|deviation| deviation.1.abs()));
            chi2.extend(found.reduced_chi2);
        }
        let within = |sigmas: f64| {
            all.iter().filter(|deviation| **deviation < sigmas).count() as f64 / all.len() as f64
        };
        let (one, two) = (within(1.0), within(2.0));
        let mean = chi2.iter().sum::<f64>() / chi2.len() as f64;
        println!(
            "{kinds:?}: {} estimates, {:.1} and {:.1} %, mean χ²/ν {mean:.3}",
            all.len(),
            100.0 * one,
            100.0 * two
        );
        // Estimates of one arm are correlated: 60 arms are the sample size.
        assert!(
            (one - 0.683).abs() < 0.05 && (two - 0.954).abs() < 0.025,
            "{kinds:?}: {one} {two}"
        );
        assert!((mean - 1.0).abs() < 0.03, "{kinds:?}: {mean}");
    }
}

#[test]
fn a_point_of_held_out_rows_alone_is_found_on_them() {
    let text = AROUND.replace("{ fraction = 0.2, seed = 1 }", "{ column = \"split\" }");
    let problem = problem(&text);
    let (arm, _) = true_arm(&problem, 4);
    let table = Bench::new(arm, 9).table(&["point"], 90);
    let marked: Vec<String> = table
        .lines()
        .enumerate()
        .map(|(k, line)| match k {
            0 => format!("{line},split"),
            _ if line.contains("top") => format!("{line},validation"),
            _ => format!("{line},identification"),
        })
        .collect();
    let found = identify(
        &problem,
        &read_dataset(&problem, &(marked.join("\n") + "\n")),
        &Options::default(),
    )
    .unwrap();
    assert!(found.is_trusted(), "{:?}", found.findings);
    assert_eq!((found.fitted.held_out.n, found.fitted.held_out.kind), (30, "point"));
    assert!(found.fitted.held_out.rms.norm < 0.3e-3, "{:?}", found.fitted.held_out);
    let top = found.spreads.iter().find(|(before, ..)| before.point == "top").unwrap();
    println!("top: {:.3} mm before, {:.3} mm after", top.0.mean * 1e3, top.1.mean * 1e3);
    assert!(top.2 && top.0.mean > 5.0 * top.1.mean && top.1.mean < 0.2e-3);
}

/// A socket that is compliant along one direction is named, and no other point.
#[test]
fn a_point_that_gives_way_is_named() {
    let text = AROUND.replace("{ fraction = 0.2, seed = 1 }", "{ column = \"split\" }");
    let places = [[0.5, -0.5, 0.4], [0.8, 0.0, 0.6]];
    let points: String =
        ["near", "soft"].map(|name| format!("[[point]]\nname = \"{name}\"\n")).concat();
    let problem = problem(&text.replace("[data]\n", &format!("{points}[data]\n")));
    let (arm, _) = true_arm(&problem, 6);
    let mut bench = Bench::new(arm, 13);
    let mut table = String::new();
    for (k, line) in bench.table(&["point"], 90).lines().enumerate() {
        let _ = writeln!(table, "{line},{}", if k == 0 { "split" } else { "identification" });
    }
    for (name, place) in ["near", "soft"].into_iter().zip(places) {
        for k in 0..20 {
            let way = if name == "soft" { 1e-3 * (f64::from(k % 10) / 4.5 - 1.0) } else { 0.0 };
            let place = Vector3::from(place) + way * Vector3::y();
            let q = bench.contact(&|at| (at - place).as_slice().to_vec());
            let q: Vec<String> = q.iter().map(|q| format!("{q:.12}")).collect();
            let _ = writeln!(table, "{},,,,{name},,,,,,,,validation", q.join(","));
        }
    }
    let found = identify(&problem, &read_dataset(&problem, &table), &Options::default()).unwrap();
    let unsteady = PointSpread::unsteady(found.spreads.iter().map(|spread| &spread.1));
    let [(spread, times)] = unsteady.as_slice() else { panic!("{unsteady:?}") };
    assert!(
        spread.point == "soft" && spread.along.y > 0.95 && spread.share > 0.9 && *times > 3.0,
        "{spread:?} {times}"
    );
}

/// Horizontal planes above and below the arm's base, touched with and without offsets; a free
/// declared normal determines the side.
#[test]
fn planes_of_either_side_are_found() {
    for (height, up) in [(0.2, 1.0), (0.2, -1.0), (-0.2, 1.0), (-0.2, -1.0)] {
        for (step, declared) in [(2e-3, false), (0.0, true), (0.0, false)] {
            // Without offsets the side is that of the arm's base.
            let up = if step == 0.0 && !declared { -f64::signum(height) } else { up };
            let normal = Vector3::new(0.03 * up, -0.02, up).normalize();
            let plane = "name = \"table\"\nkind = \"plane\"\n";
            let known = format!("{plane}normal = [0, 0, {up}]\nat_mm = [0, 0, {}]\n", height * 1e3);
            let around = if declared { AROUND.replace(plane, &known) } else { AROUND.to_owned() };
            let problem = problem(&format!("\"surface[table].*\" = {{ free = true }}\n{around}"));
            let (arm, _) = true_arm(&problem, 5);
            let mut bench = Bench::new(arm, 11);
            let mut table = bench.table(&["position"], 40);
            for k in 0..60 {
                let offset = step * f64::from(k % 3);
                let q = bench.contact(&|at| vec![normal.dot(at) - height * up - offset]);
                let q: Vec<String> = q.iter().map(|q| format!("{q:.12}")).collect();
                let _ = writeln!(table, "{},,,,,,,table,{:.7},,,", q.join(","), offset * 1e3);
            }
            let found =
                identify(&problem, &read_dataset(&problem, &table), &Options::default()).unwrap();
            let what = format!("{height} m, up {up}, step {step}, declared {declared}");
            assert!(found.is_trusted(), "{what}: {:?}", found.findings);
            let value =
                |field: &str| found.estimate(&format!("surface[table].{field}")).unwrap().estimate;
            let lean = [value("rx"), value("ry")];
            let fitted_normal = flexcal::spatial::plane_normal(lean[0], lean[1]);
            assert!(
                (fitted_normal - normal).norm() < 1e-3 && (value("d") - height * up).abs() < 1e-3,
                "{what}: {fitted_normal} {}",
                value("d")
            );
        }
    }
}

#[test]
fn a_held_plane_that_lies_elsewhere_is_named() {
    let plane = "name = \"table\"\nkind = \"plane\"\n";
    let known = format!("{plane}normal = [0, 0, 1]\nat_mm = [0, 0, 205]\n");
    let around = AROUND.replace(plane, &known);
    let problem = problem(&format!("\"surface[table].*\" = {{ fixed = true }}\n{around}"));
    let (arm, _) = true_arm(&problem, 5);
    let mut bench = Bench::new(arm, 11);
    let mut table = bench.table(&["position"], 40);
    for _ in 0..60 {
        let q = bench.contact(&|at| vec![at.z - 0.2]);
        let q: Vec<String> = q.iter().map(|q| format!("{q:.12}")).collect();
        let _ = writeln!(table, "{},,,,,,,table,0,,,", q.join(","));
    }
    let found = identify(&problem, &read_dataset(&problem, &table), &Options::default()).unwrap();
    let held = found.finding(flexcal::fit::FindingCode::HeldParameter).map(ToString::to_string);
    let is_named = |text: &String| text.contains("surface[table].d is held at 205 mm and fits as");
    assert!(held.as_ref().is_some_and(is_named), "{:?}", found.findings);
}

#[test]
fn a_fixture_that_lies_far_from_its_prior_is_named() {
    let anchor = "name = \"A\"\n";
    for (at, is_far) in [("[1.4, 0.5, 1.2]", true), ("[1.501, 0.5, 1.2]", false)] {
        let around = AROUND.replace(anchor, &format!("{anchor}at_m = {at}\n"));
        let problem = problem(&format!("\"anchor[A].*\" = {{ sigma_mm = 2 }}\n{around}"));
        let (arm, _) = true_arm(&problem, 5);
        let table = Bench::new(arm, 11).table(&["position", "distance"], 120);
        let found =
            identify(&problem, &read_dataset(&problem, &table), &Options::default()).unwrap();
        let beyond = found.finding(flexcal::fit::FindingCode::BeyondPrior);
        assert_eq!(
            (beyond.is_some(), found.is_trusted()),
            (is_far, !is_far),
            "{:?}",
            found.findings
        );
        let Some(text) = beyond.map(ToString::to_string) else { continue };
        assert!(text.contains("anchor[A].x deviates from nominal by"), "{text}");
        let (_, at) = text.split_once("correct it in [[anchor]] \"A\": at_m = [").unwrap();
        let x: f64 = at.split(',').next().unwrap().parse().unwrap();
        assert!((x - 1.5).abs() < 1e-3, "{text}");
    }
}

#[test]
fn a_wire_whose_zero_is_wrong_is_named() {
    let at = |around: String, (name, at): (&str, [f64; 3])| {
        let anchor = format!("[[anchor]]\nname = \"{name}\"\n");
        around.replace(&anchor, &format!("{anchor}at_m = {at:?}\n"))
    };
    let around = ANCHORS.into_iter().fold(AROUND.to_owned(), at);
    let held = "\"anchor*\" = { fixed = true }\n\"base.*\" = { fixed = true }\n";
    let problem = problem(&format!("{held}{around}"));
    let (arm, _) = true_arm(&problem, 5);
    let table = Bench::new(arm, 11).table(&["distance"], 60);
    let wrong = table.lines().map(|line| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Some(place) = cells.iter().position(|cell| cell == "B") {
            let distance: f64 = cells[place + 1].parse().unwrap();
            cells[place + 1] = (distance + 80.0).to_string();
        }
        cells.join(",") + "\n"
    });
    let data = read_dataset(&problem, &wrong.collect::<String>());
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let first = found.first_error().map(ToString::to_string).unwrap_or_default();
    assert!(first.contains("with distances to B that are 80.0 mm too large"), "{first}");
}
