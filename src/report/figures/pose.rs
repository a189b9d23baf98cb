//! A pose as the figures show it, and which poses are drawn.

use nalgebra::Vector3;

use crate::problem::Observation;

/// A pose and what arms leave of it.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseError {
    /// File and line of its row, without the folder where the names of the files are distinct.
    pub place: String,
    /// Commands or readings of its joints, 0 at fixed ones \[rad\] or \[m\].
    pub configuration: Vec<f64>,
    /// Whether it was held out.
    pub held_out: bool,
    /// What was measured.
    pub observation: Observation,
    /// Measured position, or where the best arm has its target in a row that measures none,
    /// measuring frame \[m\].
    pub position: Vector3<f64>,
    /// Residual measured − predicted, measuring frame \[m\]; of one number along x, of tilts
    /// \[rad\].
    pub error: Vector3<f64>,
    /// The same of the nominal arm, with base and tool fitted where they are free \[m\].
    pub before: Vector3<f64>,
    /// 1 σ of each coordinate \[m\].
    pub sigma: f64,
    /// Time \[s\], or the row's number where no time was measured.
    pub time: f64,
}

impl PoseError {
    /// Whether its residual is a length at a place of the target.
    pub fn has_place(&self) -> bool {
        self.observation.is_of_arm() && !self.observation.is_angle()
    }
}

/// Of those that are drawn, one in so many is there because its value is among the largest.
const LARGEST: usize = 10;

/// At most `most` of some rows, ascending: those of the largest `size`, and others evenly among the
/// rest.
pub fn thin(rows: &[usize], most: usize, size: impl Fn(usize) -> f64) -> Vec<usize> {
    weighted(rows, most, size).into_iter().map(|(row, _)| row).collect()
}

/// The same, each with the number of rows that it stands for: 1 of the largest, as many as there
/// are for one that is drawn of the others, so that sums over all rows can be told from those that
/// are drawn [Horvitz & Thompson 1952].
pub fn weighted(rows: &[usize], most: usize, size: impl Fn(usize) -> f64) -> Vec<(usize, f64)> {
    if rows.len() <= most {
        return rows.iter().map(|&row| (row, 1.0)).collect();
    }
    let finite = |row: usize| Some(size(row)).filter(|size| size.is_finite()).unwrap_or(0.0);
    let mut by_size = rows.to_vec();
    by_size.sort_by(|&a, &b| finite(b).total_cmp(&finite(a)).then(a.cmp(&b)));
    let (largest, rest) = by_size.split_at_mut((most / LARGEST).max(1));
    rest.sort_unstable();
    let every = rest.len().div_ceil((most - largest.len()).max(1));
    let drawn: Vec<usize> = rest.iter().copied().step_by(every).collect();
    let each = rest.len() as f64 / drawn.len().max(1) as f64;
    let mut kept: Vec<(usize, f64)> = largest
        .iter()
        .map(|&row| (row, 1.0))
        .chain(drawn.into_iter().map(|row| (row, each)))
        .collect();
    kept.sort_unstable_by_key(|own| own.0);
    kept
}

/// " 300 of 6487 poses are drawn, those with the largest residuals among them." where not all are.
pub fn thinned(drawn: usize, all: usize) -> String {
    if drawn < all {
        format!(" {drawn} of {all} poses are drawn, those with the largest residuals among them.")
    } else {
        String::new()
    }
}

/// " 3 poses without an equilibrium are left out." where there are any.
pub fn left_out(poses: usize) -> String {
    match poses {
        0 => String::new(),
        1 => " One pose without an equilibrium is left out.".to_owned(),
        n => format!(" {n} poses without an equilibrium are left out."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_stay() {
        let rows: Vec<usize> = (0..1000).collect();
        let size = |row: usize| if row == 501 { 9.0 } else { 1.0 / (row + 1) as f64 };
        let kept = thin(&rows, 100, size);
        assert!(kept.len() <= 100 && kept.len() > 80, "{}", kept.len());
        assert!(kept.contains(&501) && kept.contains(&0) && kept.is_sorted());
        assert_eq!(thin(&rows[..7], 100, size), rows[..7]);
        assert_eq!(thin(&rows, 100, |_| f64::NAN).len(), kept.len());
        let stands_for: f64 = weighted(&rows, 100, size).into_iter().map(|(_, count)| count).sum();
        assert!((stands_for - 1000.0).abs() < 1e-9, "{stands_for}");
    }
}
