//! What must hold of every case.

use flexcal::fit::{ErrorSummary, Residual};
use flexcal::measurement::Measurements;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use serde_json::Value;

use super::case::Case;
use super::fitted::Fitted;
use super::sight::Sight;
use super::world::World;

/// Disagreement, in words.
pub type Verdict = Result<(), String>;

/// Largest difference between two calculations of one place \[m\].
pub const SAME_PLACE: f64 = 1e-9;
/// Largest relative difference between two sums of the same numbers.
const SAME_SUM: f64 = 1e-9;

/// Returns a disagreement in words unless a condition holds.
macro_rules! ensure {
    ($holds:expr, $($words:tt)+) => {
        let holds: bool = $holds;
        if !holds {
            return Err(format!($($words)+));
        }
    };
}

pub(crate) use ensure;

/// Checks that every row is read as it was written: measured = predicted + residual.
pub fn rows_are_read(case: &Case, fit: &Fitted) -> Verdict {
    ensure!(
        fit.residuals.len() == case.rows.len(),
        "{} residuals of {} rows",
        fit.residuals.len(),
        case.rows.len()
    );
    for residual in &fit.residuals {
        let row = &case.rows[residual.row];
        let line = fit.data.measurements.location(residual.row).line;
        ensure!(
            line == Some(row.line),
            "row {} is of line {line:?} instead of {}",
            residual.row,
            row.line
        );
        let off = (residual.predicted + residual.position - row.position).norm();
        ensure!(
            off < 1e-12,
            "row {}: predicted + residual is {off} m off the measured position",
            residual.row
        );
    }
    Ok(())
}

/// Checks that no number of estimate.json is missing where a fit gives one.
pub fn numbers_are_finite(fit: &Fitted) -> Verdict {
    let may_be_null = |path: &str| {
        let key = path.rsplit('.').next().unwrap_or(path);
        MAY_BE_NULL.contains(&key) || path.starts_with("covariance")
    };
    let mut nulls = Vec::new();
    find_nulls(&fit.estimate, "", &mut nulls);
    match nulls.iter().find(|path| !may_be_null(path)) {
        Some(path) => Err(format!("{path} of estimate.json is null")),
        None => Ok(()),
    }
}

/// Keys of estimate.json that docs/results.md lets be null.
const MAY_BE_NULL: [&str; 26] = [
    "prior",
    "solver_reason",
    "alternation",
    "reduced_chi2",
    "estimated_sigma_mm",
    "chance",
    "remainder",
    "orientation",
    "std_error",
    "prior_sigma",
    "reduced_chi2_without",
    "at_bound",
    "shadow_price",
    "prediction",
    "misfit_carried_by",
    "first_time_s",
    "condition_number",
    "O1",
    "O2",
    "O3",
    "O4",
    "O5",
    "noise_factor",
    "sigma_taken_mm",
    "covariance",
    "correction",
];

fn find_nulls(value: &Value, path: &str, found: &mut Vec<String>) {
    match value {
        Value::Null => found.push(path.to_owned()),
        Value::Object(map) => {
            for (key, value) in map {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                find_nulls(value, &path, found);
            }
        }
        Value::Array(list) => list.iter().for_each(|value| find_nulls(value, path, found)),
        _ => {}
    }
}

/// Checks error summaries against the residuals of their rows.
/// `ranks` are those of the rows' kinds: a summary is of the first kind that there is.
pub fn summaries_are_of_residuals(ranks: &[usize], fit: &Fitted) -> Verdict {
    let leading = ranks.iter().min();
    let of = |held_out: Option<bool>| -> Vec<Vector3<f64>> {
        let chosen = fit.residuals.iter().filter(|residual| {
            held_out.is_none_or(|part| residual.held_out == part)
                && Some(&ranks[residual.row]) == leading
        });
        chosen.map(|row| row.position).collect()
    };
    let stated = &fit.found.fitted;
    summary_is_of("identification", &stated.identification, &of(Some(false)))?;
    summary_is_written(&fit.estimate["identification"], &stated.identification)?;
    if stated.is_left_out {
        return summary_is_written(&fit.estimate["left_out"], &stated.held_out);
    }
    summary_is_of("held out", &stated.held_out, &of(Some(true)))?;
    summary_is_written(&fit.estimate["held_out"], &stated.held_out)
}

/// Returns mean, largest value and root mean square of absolute values along x, y, z, and of the
/// norm.
fn sizes(errors: &[Vector3<f64>]) -> [[f64; 4]; 3] {
    let n = errors.len() as f64;
    let mut sizes = [[0.0; 4]; 3];
    for error in errors {
        for (k, value) in [error.x, error.y, error.z, error.norm()].into_iter().enumerate() {
            sizes[0][k] += value.abs() / n;
            sizes[1][k] = sizes[1][k].max(value.abs());
            sizes[2][k] += value * value / n;
        }
    }
    sizes[2] = sizes[2].map(f64::sqrt);
    sizes
}

pub fn summary_is_of(what: &str, stated: &ErrorSummary, errors: &[Vector3<f64>]) -> Verdict {
    ensure!(
        stated.n == errors.len(),
        "{what}: {} rows are summarised, {} there",
        stated.n,
        errors.len()
    );
    if errors.is_empty() {
        return Ok(());
    }
    let words = ["mean", "max", "rms"];
    for ((stated, found), word) in
        [stated.mean, stated.max, stated.rms].iter().zip(sizes(errors)).zip(words)
    {
        for (stated, found) in [stated.x, stated.y, stated.z, stated.norm].into_iter().zip(found) {
            let same = (stated - found).abs() <= SAME_SUM * found + 1e-15;
            ensure!(same, "{what}: {word} is stated as {stated} m, and is {found} m");
        }
    }
    Ok(())
}

/// Checks that a summary stands in the file as it was found.
fn summary_is_written(json: &Value, found: &ErrorSummary) -> Verdict {
    for (key, values) in [("mean_mm", &found.mean), ("max_mm", &found.max), ("rms_mm", &found.rms)]
    {
        let axes = [("x", values.x), ("y", values.y), ("z", values.z), ("norm", values.norm)];
        for (axis, value) in axes {
            let written = json[key][axis].as_f64();
            let is_same = written
                .is_some_and(|written| (written - value * 1e3).abs() <= 1e-12 * (1.0 + value));
            ensure!(is_same || found.n == 0, "{key}.{axis}: {written:?} is written for {value} m");
        }
    }
    Ok(())
}

/// Checks that the saved estimate predicts the table as the fit did.
pub fn prediction_repeats_the_fit(ranks: &[usize], fit: &Fitted) -> Verdict {
    let rows = Measurements::read_to_predict(&fit.problem.data.files, &fit.problem);
    let rows = rows.map_err(|error| format!("predict does not read the table: {error}"))?.0;
    let (prediction, _) = fit.predict(&rows).map_err(|error| format!("no prediction: {error}"))?;
    let residuals = prediction.residuals.ok_or("predict sees no measurement")?;
    ensure!(residuals.len() == fit.residuals.len(), "predict has {} residuals", residuals.len());
    for (again, residual) in residuals.iter().zip(&fit.residuals) {
        let off = (again.position - residual.position).norm();
        ensure!(off < SAME_PLACE, "row {}: predict is {off} m off the fit", residual.row);
        let turned =
            again.orientation.zip(residual.orientation).map_or(0.0, |(a, b)| (a - b).norm());
        ensure!(
            turned < SAME_PLACE,
            "row {}: predict is turned by {turned} from the fit",
            residual.row
        );
        ensure!(
            again.orientation.is_some() == residual.orientation.is_some(),
            "predict and fit differ in orientations"
        );
    }
    let errors = prediction.errors.ok_or("predict has no errors")?;
    let leading = |chosen: &[&Residual]| -> Vec<Vector3<f64>> {
        let rank = |residual: &Residual| ranks[residual.row];
        let first = chosen.iter().map(|residual| rank(residual)).min();
        chosen
            .iter()
            .filter(|residual| Some(rank(residual)) == first)
            .map(|residual| residual.position)
            .collect()
    };
    summary_is_of("all", &errors.all, &leading(&residuals.iter().collect::<Vec<_>>()))?;
    for (name, summary) in &errors.sessions {
        let labels = &rows.session;
        let of_session: Vec<&Residual> = residuals
            .iter()
            .filter(|residual| labels.names[labels.of_row[residual.row]] == *name)
            .collect();
        summary_is_of(name, summary, &leading(&of_session))?;
    }
    Ok(())
}

/// Returns the arm with the estimated parameters.
pub fn identified(case: &Case, fit: &Fitted) -> Result<World, String> {
    let mut world = case.nominal.clone();
    for estimate in &fit.found.estimates {
        let value = world
            .parameter(&estimate.name)
            .ok_or(format!("{} is no parameter of the arm", estimate.name))?;
        let off = (*value - estimate.nominal).abs();
        ensure!(
            off <= 1e-12 * (1.0 + value.abs()),
            "{} is nominally {value}, but {} is stated",
            estimate.name,
            estimate.nominal
        );
        *value = estimate.estimate;
    }
    Ok(world)
}

/// Checks predicted positions and orientations against products of matrices.
pub fn kinematics_agree(case: &Case, fit: &Fitted, world: &World) -> Verdict {
    for residual in &fit.residuals {
        let row = &case.rows[residual.row];
        let at_rest = "the identified arm does not come to rest";
        let expected = world.numbers(row).ok_or(at_rest)?;
        let off = if matches!(row.sight, Sight::Tilt(_)) {
            // An upright axis tells its angle by rounding alone, its sine well.
            (expected.map(f64::sin) - residual.predicted.map(f64::sin)).norm()
        } else {
            (expected - residual.predicted).norm()
        };
        ensure!(
            off < SAME_PLACE,
            "row {}: the prediction is {off} m off the matrices",
            residual.row
        );
        if let Some((left, measured)) = residual.orientation.zip(row.orientation) {
            let pose = world.pose(row).ok_or(at_rest)?;
            let predicted =
                Rotation3::from_matrix_unchecked(pose.fixed_view::<3, 3>(0, 0).into_owned());
            let error = measured * predicted.inverse();
            let error = UnitQuaternion::from_rotation_matrix(&error).scaled_axis();
            // The rotation vector of half a turn has two signs.
            let off = (error - left).norm();
            ensure!(
                off < SAME_PLACE || left.norm() > 3.1,
                "row {}: the turn is {off} rad off the matrices",
                residual.row
            );
        }
    }
    Ok(())
}

/// Checks that a fit to noise-free data of the nominal arm stays there.
pub fn exact_data_are_met(case: &Case, fit: &Fitted) -> Verdict {
    if !case.is_exact || case.noise[0] > 0.0 || case.is_limited {
        return Ok(());
    }
    let largest = fit.residuals.iter().map(|residual| residual.position.norm()).fold(0.0, f64::max);
    ensure!(largest < SAME_PLACE, "measurements of the nominal arm are missed by {largest} m");
    Ok(())
}
