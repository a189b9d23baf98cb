//! Inputs beyond any arm (too large, too many, too long) end at once with status 2 and a message.

use std::time::{Duration, Instant};

use crate::common::program::{Folder, Run};

/// Upper limit of the duration; without limits on input these cases took 8 s or did not end.
const PATIENCE: Duration = Duration::from_secs(20);

/// Runs a command, which must end quickly.
fn run(folder: &Folder, arguments: &str) -> Run {
    let clock = Instant::now();
    let run = folder.flexcal(arguments);
    assert!(clock.elapsed() < PATIENCE, "{arguments}: {:?}", clock.elapsed());
    assert!(!run.stderr.contains("panicked"), "{run:?}");
    run
}

#[test]
fn tables_beyond_any_size() {
    let folder = Folder::with_lunar_sampler();
    let table = folder.read("a-none.csv");
    let widened = |columns: usize| -> String {
        let mut rows = table.lines();
        let more = (0..columns).map(|k| format!(",extra{k}")).collect::<Vec<_>>().concat();
        let header = format!("{}{more}\n", rows.next().unwrap());
        header
            + &rows
                .map(|row| format!("{row}{}\n", ",1".repeat(columns)))
                .collect::<Vec<_>>()
                .concat()
    };
    let cases: [(&str, String, i32, &str); 6] = [
        ("wide", widened(9900), 0, "extra98, extra99 and 9800 more"),
        ("wider", widened(10_000), 2, "wider.csv:1: 10017 columns; at most 10000"),
        (
            "long-name",
            format!("{}\n1\n", "x".repeat(10_000_000)),
            2,
            "long-name.csv:1: the line is longer than 1024 KiB",
        ),
        ("no-line", "1,".repeat(30_000_000), 2, "no-line.csv:1: the line is longer than 1024 KiB"),
        (
            "quote",
            format!("{}\"{}", table, "1,\n".repeat(3_000_000)),
            2,
            "quote.csv:80: the line is longer",
        ),
        (
            "near",
            format!("{},{}\n1\n", "q1".repeat(200_000), "p1".repeat(200_000)),
            2,
            "column q1: missing",
        ),
    ];
    for (name, text, status, said) in cases {
        folder.write(format!("{name}.csv"), text);
        let run = run(&folder, &format!("identify . --data {name}.csv"));
        assert!(
            run.status == status && run.stderr.contains(said),
            "{name}: status {}, {:.2000}",
            run.status,
            run.stderr
        );
    }
    #[cfg(unix)]
    for arguments in ["identify . --data /dev/zero", "identify /dev/zero"] {
        run(&folder, arguments).code(2);
    }
}

#[test]
fn problems_beyond_any_size() {
    let folder = Folder::with_lunar_sampler();
    let joint = "[[joint]]\n";
    let arm = "name = 'arm'\n[[joint]]\n";
    let effects = (1..=500)
        .map(|k| format!("[[effect]]\nstation-shift = {{ at_time_s = {k} }}\n"))
        .collect::<Vec<_>>()
        .concat();
    let orders: Vec<String> = (1..=1000).map(|k| k.to_string()).collect();
    let rules = (0..3000)
        .map(|k| format!("'joint1.a{}' = {{ free = true }}\n", "*".repeat(k)))
        .collect::<Vec<_>>()
        .concat();
    let cases = [
        (
            format!("name = 'arm'\n{}", joint.repeat(300_000)),
            "problem.toml:2: joint: 300000 tables; at most 100",
        ),
        (format!("name = 'arm'\n{}", joint.repeat(1_000_000)), "problem.toml: larger than 4 MiB"),
        (format!("{arm}{effects}"), "problem.toml:3: effect: 500 tables; at most 100"),
        (
            format!(
                "{arm}[[effect]]\njoint-harmonic = {{ joint = 1, orders = [{}] }}\n",
                orders.join(", ")
            ),
            "problem.toml:4: effect[1].joint-harmonic.orders: 1000 orders; at most 100",
        ),
        (format!("{arm}[parameters]\n{}", &rules[..2_400_000]), "problem.toml:"),
        (format!("{arm}{} = 1\n", "k".repeat(3_000_000)), "unknown key"),
        (format!("{arm}a_m = 1e151\n"), "problem.toml:3: joint[1].a_m: 1e151 is larger than 1e150"),
    ];
    for (text, said) in cases {
        folder.write("problem.toml", text);
        let Run { status, stderr: message, .. } = run(&folder, "check . --poses 10");
        assert!(status == 2 && message.contains(said), "{said}: status {status}, {message:.500}");
        let first = message.lines().next().unwrap_or_default();
        assert!(first.len() < 3000, "{said}: a message of {} bytes", first.len());
    }
}

#[test]
fn a_coordinate_beyond_all_measure_is_no_panic() {
    let folder = Folder::with_lunar_sampler();
    let table = folder.read("a-none.csv");
    let place = table.lines().next().unwrap().split(',').position(|name| name == "x_mm").unwrap();
    let line = table.lines().position(|row| row.contains("identification")).unwrap();
    for (value, statuses) in [
        ("1e160", [2, 2]),
        ("-1.7e308", [2, 2]),
        ("1e150", [1, 1]),
        ("1e149", [1, 1]),
        ("1e80", [1, 1]),
        ("1e20", [1, 1]),
    ] {
        let rows = table.lines().enumerate().map(|(k, row)| {
            let mut cells: Vec<&str> = row.split(',').collect();
            if k == line {
                cells[place] = value;
            }
            cells.join(",") + "\n"
        });
        folder.write("huge.csv", rows.collect::<String>());
        // Smaller values than the largest that is read are given to `identify` alone.
        let commands = if statuses == [1, 1] && value != "1e150" { 1 } else { 4 };
        for command in &["identify", "trace", "loop", "compare"][..commands] {
            let run = run(&folder, &format!("{command} . --data huge.csv --out out"));
            let Run { status, stderr: message, .. } = run;
            assert!(
                statuses.contains(&status),
                "{command} with {value}: status {status}, {message}"
            );
            let named = format!("huge.csv:{}: column x_mm: {value} is larger than 1e150", line + 1);
            assert!(status == 1 || message.contains(&named), "{message}");
            assert!(!message.contains("inf ") && !message.contains("NaN"), "{message}");
        }
    }
}
