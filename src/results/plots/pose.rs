//! Residual of a row, and selection of the rows that a figure draws.

use nalgebra::Vector3;

use crate::problem::Observation;

/// Row of the measurements with its residual.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseError {
    /// File and line of the pose's row, without the folder if the file names are unique.
    pub place: String,
    /// Joint commands, or encoder readings, shape = (joints) \[rad\] or \[m\]; 0 for fixed joints.
    pub configuration: Vec<f64>,
    /// True for a held-out row.
    pub held_out: bool,
    /// Kind of measurement of the row.
    pub observation: Observation,
    /// Measured position, measuring frame \[m\]. For a row that measures no position, the target's
    /// position as the best arm predicts it.
    pub position: Vector3<f64>,
    /// Residual measured − predicted of the best arm, measuring frame \[m\]; of tilts \[rad\]. A
    /// row with a single number has it along x.
    pub error: Vector3<f64>,
    /// Residual measured − predicted of the registered nominal arm, in the same frame and unit as
    /// `error`.
    pub before: Vector3<f64>,
    /// Standard deviation (1 σ) of each measured coordinate, in the unit of `error`.
    pub sigma: f64,
    /// Time of the row \[s\], or its number, counted from 1, if no time was measured.
    pub time: f64,
}

impl PoseError {
    /// Returns true if the residual is a length, so that it can be drawn at the target's position.
    pub fn has_place(&self) -> bool {
        self.observation.measures_length()
    }
}

/// Size of a sample divided by the number of its rows that are included because of their large
/// residual.
const SAMPLE_PER_LARGEST: usize = 10;

/// Returns at most `limit` of the indices `rows` in ascending order: the rows with the largest
/// `size`, and an even sample of the others.
pub fn sample(rows: &[usize], limit: usize, size: impl Fn(usize) -> f64) -> Vec<usize> {
    weighted_sample(rows, limit, size).into_iter().map(|(row, _)| row).collect()
}

/// Returns a sample like [`sample`], each row with the number of rows that it represents. That is 1
/// for the rows with the largest `size`, and the inverse sampling fraction for the others. Weighted
/// sums over the sample estimate sums over all rows [Horvitz & Thompson 1952].
pub fn weighted_sample(
    rows: &[usize],
    limit: usize,
    size: impl Fn(usize) -> f64,
) -> Vec<(usize, f64)> {
    if rows.len() <= limit {
        return rows.iter().map(|&row| (row, 1.0)).collect();
    }
    let finite = |row: usize| Some(size(row)).filter(|size| size.is_finite()).unwrap_or(0.0);
    let mut by_size = rows.to_vec();
    by_size.sort_by(|&a, &b| finite(b).total_cmp(&finite(a)).then(a.cmp(&b)));
    let (largest, others) = by_size.split_at_mut((limit / SAMPLE_PER_LARGEST).max(1));
    others.sort_unstable();
    let step = others.len().div_ceil((limit - largest.len()).max(1));
    let drawn: Vec<usize> = others.iter().copied().step_by(step).collect();
    let weight = others.len() as f64 / drawn.len().max(1) as f64;
    let mut sampled: Vec<(usize, f64)> = largest
        .iter()
        .map(|&row| (row, 1.0))
        .chain(drawn.into_iter().map(|row| (row, weight)))
        .collect();
    sampled.sort_unstable_by_key(|(row, _)| *row);
    sampled
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_stay() {
        let rows: Vec<usize> = (0..1000).collect();
        let size = |row: usize| if row == 501 { 9.0 } else { 1.0 / (row + 1) as f64 };
        let sampled = sample(&rows, 100, size);
        assert!(sampled.len() <= 100 && sampled.len() > 80, "{}", sampled.len());
        assert!(sampled.contains(&501) && sampled.contains(&0) && sampled.is_sorted());
        assert_eq!(sample(&rows[..7], 100, size), rows[..7]);
        assert_eq!(sample(&rows, 100, |_| f64::NAN).len(), sampled.len());
        let weighted = weighted_sample(&rows, 100, size);
        let stands_for: f64 = weighted.into_iter().map(|(_, count)| count).sum();
        assert!((stands_for - 1000.0).abs() < 1e-9, "{stands_for}");
    }
}
