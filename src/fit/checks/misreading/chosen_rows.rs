//! Choice of the rows to which misreadings are applied.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use crate::fit::stages::fitting::Fitting;
use crate::numeric::spaced;

/// Smallest mean number of chosen rows of a session with which rows of all sessions are chosen.
const MIN_SESSION_ROWS: usize = 8;

/// Returns at most about `count` of the identification rows, evenly spaced. If that leaves few rows
/// of each session, rows of the largest sessions are taken instead, because each session may have a
/// free base of its own.
pub(super) fn chosen_rows(fitting: &Fitting, count: usize) -> Vec<usize> {
    let identification = &fitting.split.identification;
    let session = |row: &usize| fitting.placement.base_of(*row);
    let mut sizes: BTreeMap<usize, usize> = BTreeMap::new();
    for row in identification {
        *sizes.entry(session(row)).or_default() += 1;
    }
    let mut rows = identification.clone();
    if identification.len() > count && count < MIN_SESSION_ROWS * sizes.len() {
        let mut sessions: Vec<(usize, usize)> = sizes.into_iter().collect();
        sessions.sort_by_key(|&(_, size)| Reverse(size));
        let (mut taken, mut total) = (Vec::new(), 0);
        for (session, size) in sessions {
            if total < count {
                taken.push(session);
            }
            total += size;
        }
        rows.retain(|row| taken.contains(&session(row)));
    }
    spaced(rows, count)
}
