//! The page `benches/RESULTS.md`, written as Markdown.

use std::fmt::Write as _;
use std::process::Command;

use crate::case::Class;
use crate::row::Row;

const HEAD: &str = "# Solvers side by side

Written by `cargo bench --bench solvers`; do not edit. What the table means for the choice of a solver: [docs/solvers.md](../docs/solvers.md).

- Solvers that `identify --solver` offers: `levenberg-marquardt`, `bounded` (Levenberg–Marquardt within bounds), where there
  are bounds also `interior-point`, `reflective` and `clamped`,
  `gauss-newton` (argmin's, undamped), `pseudo-inverse` (the paper's iteration, undamped). Beside them argmin's trust region
  (Steihaug, Gauss–Newton Hessian) and L-BFGS on ½‖r‖², unknowns scaled by the columns of the first Jacobian, and the MINPACK
  port of the crate `levenberg-marquardt`, where there are bounds also with every point that it asks for moved into them (`clamped`). All
  see the same residuals and derivatives, evaluated by the same code.
- optimum: yes where ½‖r‖² is within 1e-8 of the best known, with what the solver complains of although it is there; or why not.
- steps: steps tried. r, J: evaluations of the residual alone, and of residual and Jacobian.
- time: median of up to 201 runs in 0.3 s, taken in turn with those of the other solvers, on one thread. A run is ended after 20 s
  (collections: 1 s).
- × fastest: the total time over that which the fastest solver that reaches every optimum of the class takes on the same problems.
  Not every solver takes part in every problem: three of those that keep bounds keep no constraints.
";

/// Returns the whole page.
pub fn page(rows: &[Row]) -> String {
    format!("{HEAD}\nMeasured on {}.\n\n{}", machine(), tables(rows))
}

/// Returns the summary and the tables of all classes.
pub fn tables(rows: &[Row]) -> String {
    let mut out = String::from(
        "## Summary\n\n| class | solver | optimum reached | steps | time [ms] | × fastest |\n|---|---|---|---|---|---|\n",
    );
    for class in Class::EACH {
        summarise(&mut out, class, rows);
    }
    cost_of_limits(&mut out, rows);
    for class in Class::EACH {
        let mut of_class = rows.iter().filter(|row| row.class == class).peekable();
        if of_class.peek().is_none() {
            continue;
        }
        write!(out, "\n## {}\n\n{}\n\n", class.name(), class.about()).unwrap();
        out.push_str("| problem | solver | optimum | steps | r | J | time [ms] |\n|---|---|---|---|---|---|---|\n");
        for row in of_class {
            let Row { problem, solver, iterations, residuals, .. } = row;
            let jacobians = row.jacobians.map_or_else(|| "–".to_owned(), |count| count.to_string());
            let time = milliseconds(row.seconds);
            writeln!(
                out,
                "| {problem} | {solver} | {} | {iterations} | {residuals} | {jacobians} | {time} |",
                verdict(row)
            )
            .unwrap();
        }
    }
    out
}

/// Returns the cell that says whether the optimum is reached.
fn verdict(row: &Row) -> String {
    let complaint = row.complaint.as_ref().map(|complaint| complaint.replace(['|', '\n'], " "));
    match (&row.reached, complaint) {
        (Ok(()), None) => "yes".to_owned(),
        (Ok(()), Some(complaint)) => format!("yes ({complaint})"),
        (Err(why), None) => format!("no: {why}"),
        (Err(why), Some(complaint)) => format!("no: {complaint}; {why}"),
    }
}

/// Writes the cost of limits: `bounded`, which keeps them, in comparison with the unbounded fit.
fn cost_of_limits(out: &mut String, rows: &[Row]) {
    let of = |solver: &'static str| {
        rows.iter().filter(move |row| row.class == Class::Bounded && row.solver == solver)
    };
    let free = |row: &Row| of("levenberg-marquardt").find(|free| free.problem == row.problem);
    let mut pairs = of("bounded").filter_map(|row| Some((row, free(row)?))).peekable();
    if pairs.peek().is_none() {
        return;
    }
    let head = "| limits | steps of `bounded` | of the unbounded fit | time [ms] | of the unbounded fit | ratio |";
    write!(out, "\n{head}\n|---|---|---|---|---|---|\n").unwrap();
    for (row, free) in pairs {
        let [time, other] = [row, free].map(|row| milliseconds(row.seconds));
        let (problem, ratio) = (&row.problem, row.seconds / free.seconds);
        writeln!(
            out,
            "| {problem} | {} | {} | {time} | {other} | {ratio:.2} |",
            row.iterations, free.iterations
        )
        .unwrap();
    }
}

/// Writes the rows of a class in the summary.
fn summarise(out: &mut String, class: Class, rows: &[Row]) {
    let mut solvers: Vec<&str> = Vec::new();
    for row in rows.iter().filter(|row| row.class == class) {
        if !solvers.contains(&row.solver) {
            solvers.push(row.solver);
        }
    }
    let of = |solver: &str| {
        rows.iter()
            .filter(move |row| row.class == class && row.solver == solver)
            .collect::<Vec<_>>()
    };
    let total = |rows: &[&Row]| rows.iter().map(|row| row.seconds).sum::<f64>();
    let all_reached = |rows: &[&Row]| rows.iter().all(|row| row.reached.is_ok());
    let most = solvers.iter().map(|solver| of(solver).len()).max().unwrap_or(0);
    let fastest = solvers
        .iter()
        .map(|solver| of(solver))
        .filter(|rows| rows.len() == most && all_reached(rows));
    let fastest = fastest.min_by(|a, b| total(a).total_cmp(&total(b))).unwrap_or_default();
    for solver in solvers {
        let rows = of(solver);
        let reached = rows.iter().filter(|row| row.reached.is_ok()).count();
        let steps: u64 = rows.iter().map(|row| row.iterations).sum();
        let fastest_time =
            fastest.iter().filter(|row| rows.iter().any(|other| other.problem == row.problem));
        let fastest_time: f64 = fastest_time.map(|row| row.seconds).sum();
        let factor = if all_reached(&rows) {
            format!("{:.2}", total(&rows) / fastest_time)
        } else {
            "–".to_owned()
        };
        let (count, time) = (rows.len(), milliseconds(total(&rows)));
        writeln!(
            out,
            "| {} | {solver} | {reached} of {count} | {steps} | {time} | {factor} |",
            class.name()
        )
        .unwrap();
    }
}

/// Formats a time in milliseconds with three digits.
fn milliseconds(seconds: f64) -> String {
    let time = 1e3 * seconds;
    let digits = [100.0, 10.0, 1.0, 0.1].iter().filter(|&&size| time < size).count();
    format!("{time:.digits$}")
}

/// Describes the machine by processor, cores and compiler.
fn machine() -> String {
    let cpus = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpus.lines().find_map(|line| line.strip_prefix("model name")?.split(": ").nth(1));
    let compiler = Command::new("rustc").arg("-V").output();
    let compiler = compiler.map_or_else(
        |_| "rustc".to_owned(),
        |out| String::from_utf8_lossy(&out.stdout).trim().to_owned(),
    );
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!(
        "{} ({cores} cores, {}), {compiler}",
        model.unwrap_or("an unknown processor"),
        std::env::consts::ARCH
    )
}
