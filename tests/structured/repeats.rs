//! The same case again: with other threads, and with its rows in another order.

use std::collections::HashMap;
use std::path::Path;

use flexcal::fit::{Options, Residual, identify};
use nalgebra::Vector3;

use super::case::Case;
use super::checks::{SAME_PLACE, Verdict, ensure};
use super::draw::Draw;
use super::fitted::{Fitted, write};

/// Largest movement of a prediction by another order of the rows, in units of σ: steps of the
/// solver end within a thousandth of a standard error.
const SAME_FIT: f64 = 1e-2;

/// Checks that the number of threads changes no bit of the fit.
pub fn threads_change_nothing(fit: &Fitted) -> Verdict {
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = Options::default().with_influential_rows();
        let again = pool.install(|| identify(&fit.problem, &fit.data, &options));
        let again = again.map_err(|error| format!("no fit on {threads} threads: {error}"))?;
        ensure!(again.x == fit.found.x, "{threads} threads give other numbers");
    }
    Ok(())
}

/// Checks that the order of the rows changes neither the split nor, beyond the steps of the solver,
/// the predictions of a fit that is trusted.
pub fn order_changes_nothing(k: u64, case: &Case, fit: &Fitted, folder: &Path) -> Verdict {
    let lines: Vec<&str> = case.table.lines().collect();
    let first = case.rows[0].line - 1;
    let mut shuffled: Vec<usize> = (first..lines.len()).collect();
    Draw::of_change(k, 2).shuffle(&mut shuffled);
    let order: Vec<usize> = (0..first).chain(shuffled).collect();
    let text = order.iter().map(|&line| lines[line]).collect::<Vec<_>>().join("\n") + "\n";
    let path = write(folder, &case.problem, &text);
    let again = Fitted::new(&path).map_err(|error| format!("no fit in another order: {error}"))?;
    let of_line = |fit: &Fitted, line: &dyn Fn(usize) -> usize| -> HashMap<usize, Residual> {
        let line_of =
            |residual: &Residual| fit.data.measurements.location(residual.row).line.unwrap_or(0);
        fit.residuals.iter().map(|residual| (line(line_of(residual)), *residual)).collect()
    };
    let before = of_line(fit, &|line| line);
    let after = of_line(&again, &|line| order[line - 1] + 1);
    let same = (SAME_FIT * fit.found.sigma_taken).max(SAME_PLACE);
    for (line, residual) in &before {
        let other = after.get(line).ok_or(format!("line {line} is lost in another order"))?;
        ensure!(other.held_out == residual.held_out, "line {line} is held out in one order alone");
        let moved: Vector3<f64> = other.predicted - residual.predicted;
        ensure!(
            moved.norm() <= same || !fit.found.is_trusted(),
            "line {line}: another order of the rows moves the prediction by {} m, which is more than \
             {same} m",
            moved.norm()
        );
    }
    Ok(())
}
