//! Candidates for the next poses, and the workspace over which their predictions are judged.

use super::{Candidates, DesignError, Extremes, Site, Workspace};
use crate::measurement::Measurements;

/// Number of candidates drawn from ranges: uniformly, and with emphasis on the limits.
const DRAWN_CANDIDATES: [usize; 2] = [500, 1500];
/// Maximum number of poses over which the variance of predictions is averaged.
const WORKSPACE_POSES: usize = 500;
/// Random streams of the uniform candidates, of those with emphasis on the limits, and of the poses
/// of the workspace.
const STREAMS: [u64; 3] = [400, 401, 402];
/// Candidates for the next poses.
pub(super) struct Pool {
    pub candidates: Measurements,
    /// Poses over which predictions are averaged.
    pub workspace: Measurements,
    /// Number of poses drawn to find candidates that cameras see.
    pub drawn: Option<usize>,
}

/// Returns the candidates that have not been measured yet, and the poses of the workspace, over
/// which predictions are averaged; an error if all candidates of a table are measured.
pub(super) fn pool_and_workspace(
    candidates: &Candidates,
    site: &Site,
    measured: &Measurements,
    (workspace, poses, seed): (Option<&Workspace>, usize, u64),
) -> Result<Pool, DesignError> {
    let inside = |table: Measurements| match workspace {
        Some(workspace) => table.select(&site.inside(&table, workspace)),
        None => table,
    };
    match candidates {
        Candidates::Rows(rows) => {
            let rows = inside(rows.as_ref().clone().arm_rows());
            let step = rows.len().div_ceil(WORKSPACE_POSES).max(1);
            let some: Vec<usize> = (0..rows.len()).step_by(step).collect();
            let candidates = rows.select(&unmeasured(&rows, measured));
            if candidates.is_empty() && !rows.is_empty() {
                return Err(DesignError::AllMeasured);
            }
            Ok(Pool { candidates, workspace: rows.select(&some), drawn: None })
        }
        Candidates::Within(ranges) => {
            let drawn = |count: usize, extremes, stream| {
                let stream = (seed, STREAMS[stream]);
                let (table, count) = site.draw_in_view(ranges, (count, extremes), stream, inside);
                (in_last_session(table, measured), count)
            };
            let [uniform, often] = DRAWN_CANDIDATES.map(|count| count.max(poses));
            let (pool, count) = drawn(uniform, Extremes::No, 0);
            let (extremes, more) = drawn(often, Extremes::Often, 1);
            Ok(Pool {
                candidates: pool.concatenate(&extremes),
                workspace: drawn(WORKSPACE_POSES, Extremes::No, 2).0,
                drawn: site.is_of_cameras(&pool).then_some(count + more),
            })
        }
    }
}

/// Returns the poses of `table` in the session of the last measured row, in which further poses will
/// be measured.
fn in_last_session(mut table: Measurements, measured: &Measurements) -> Measurements {
    let last = measured.session.of_row.last().and_then(|&k| measured.session.names.get(k));
    if let Some(name) = last.filter(|name| !name.is_empty()) {
        table.session = (0..table.len()).map(|_| name.as_str()).collect();
    }
    table
}

/// Returns the rows of `table` whose commands and payload no row of `measured` has.
fn unmeasured(table: &Measurements, measured: &Measurements) -> Vec<usize> {
    let key = |of: &Measurements, row: usize| -> Vec<u64> {
        let payload = of.payload.as_ref().map(|payload| payload[row]);
        of.configuration(row).iter().copied().chain(payload).map(f64::to_bits).collect()
    };
    let measured_keys: std::collections::HashSet<Vec<u64>> =
        (0..measured.len()).map(|row| key(measured, row)).collect();
    (0..table.len()).filter(|&row| !measured_keys.contains(&key(table, row))).collect()
}
