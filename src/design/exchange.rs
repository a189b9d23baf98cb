//! Poses exchanged one by one for better candidates.

use nalgebra::{DMatrix, DVector};

use super::criterion::{Criterion, Yardstick};
use super::scan::Scan;
use super::sensitivity::Sensitivity;
use crate::least_squares::Identifiability;
use crate::model::parameter::Parameter;

/// Part of the information of average poses that every plan has: keeps plans with too few poses
/// comparable.
const RIDGE: f64 = 1e-6;
/// Information on combinations that neither candidates nor priors see: they stay where they are.
const HELD: f64 = 1e4;
/// A sweep that lowers the logarithm of the criterion by less than this is the last.
const SETTLED: f64 = 1e-6;
/// Sweeps after which the exchange stops.
const SWEEPS: usize = 50;

/// Candidates and a criterion, ready to exchange poses.
///
/// Unknowns are scaled by the information that average candidates and priors give on each.
#[derive(Debug, Clone)]
pub struct Exchange {
    /// Jᵀ of the candidates, scaled.
    candidates: DMatrix<f64>,
    /// Measured coordinates of each of them.
    coordinates: usize,
    /// By what each unknown is multiplied.
    scale: DVector<f64>,
    /// Information that is there without any candidate, scaled.
    ground: DMatrix<f64>,
    yardstick: Yardstick,
}

/// A set of poses that no exchange of one of them makes better.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Exchanged {
    /// Numbers of the candidates, ascending.
    pub chosen: Vec<usize>,
    /// ln of the criterion at the start and after each sweep; never rises.
    pub values: Vec<f64>,
}

impl Exchanged {
    /// ln of the criterion at the end.
    pub fn value(&self) -> f64 {
        self.values.last().copied().unwrap_or(f64::INFINITY)
    }
}

impl Exchange {
    /// Of `poses` poses beside those `given`, which are measured in any case.
    ///
    /// `None` where the information on the parameters is not finite: some candidate has no
    /// equilibrium.
    pub fn new(
        parameters: &[Parameter],
        candidates: &Sensitivity,
        given: Option<&Sensitivity>,
        poses: usize,
        criterion: &Criterion,
    ) -> Option<Self> {
        let n = parameters.len();
        let prior = DMatrix::from_diagonal(&DVector::from_iterator(
            n,
            parameters.iter().map(|parameter| parameter.sigma.map_or(0.0, |sigma| sigma.powi(-2))),
        ));
        let mut average =
            candidates.information() * (poses as f64 / candidates.len().max(1) as f64);
        let mut ground = &prior + &average * RIDGE;
        if let Some(given) = given {
            let known = given.information();
            average += &known;
            ground += known;
        }
        let mut all = &average + &prior;
        let scale =
            DVector::from_fn(n, |k, _| if all[(k, k)] > 0.0 { all[(k, k)].sqrt() } else { 1.0 });
        let scaled = |mut matrix: DMatrix<f64>| {
            for j in 0..n {
                for i in 0..n {
                    matrix[(i, j)] /= scale[i] * scale[j];
                }
            }
            matrix
        };
        let rows = in_scale(candidates, &scale);
        let (scaled_prior, mut ground) = (scaled(prior), scaled(ground));
        all = scaled(all);
        if all.iter().any(|value| !value.is_finite()) {
            return None;
        }
        let seen = DMatrix::from_fn(n + candidates.rows.ncols(), n, |i, j| match i {
            i if i < n => scaled_prior[(i, j)].sqrt(),
            i => rows[(j, i - n)],
        });
        let unidentifiable = Identifiability::of(&seen.qr().r()).gauge;
        let held = unidentifiable.transpose() * &unidentifiable * HELD;
        ground += &held;
        all += &held;
        let yardstick = criterion.yardstick(parameters, &all, &scaled_prior)?;
        Some(Self {
            candidates: rows,
            coordinates: candidates.coordinates,
            scale,
            ground,
            yardstick,
        })
    }

    /// Other candidates, measured by the same criterion in the same units.
    #[must_use]
    pub fn with_candidates(&self, candidates: &Sensitivity) -> Self {
        Self {
            candidates: in_scale(candidates, &self.scale),
            coordinates: candidates.coordinates,
            ..self.clone()
        }
    }

    /// Number of candidates.
    pub fn candidates(&self) -> usize {
        self.candidates.ncols() / self.coordinates
    }

    /// ln of the criterion for a set of candidates.
    pub fn value(&self, chosen: &[usize]) -> f64 {
        self.yardstick.value(&self.information(chosen.iter().copied()))
    }

    /// Exchanges each pose in turn for the best candidate, until a sweep over all of them gains
    /// nothing  [Cook & Nachtsheim 1980: the modified Fedorov exchange].
    ///
    /// No candidate is taken twice. `swept` is told of every sweep.
    pub fn improve(&self, mut chosen: Vec<usize>, mut swept: impl FnMut(usize, f64)) -> Exchanged {
        let mut values = vec![self.value(&chosen)];
        for sweep in 1..=SWEEPS {
            let before = values[values.len() - 1];
            let mut value = before;
            for place in 0..chosen.len() {
                let others =
                    (0..chosen.len()).filter(|&other| other != place).map(|other| chosen[other]);
                let Some(scan) = Scan::new(&self.yardstick, &self.information(others)) else {
                    continue;
                };
                // Rounding must not pass for a gain.
                let least = value - 1e-10 * value.abs().max(1.0);
                if let Some((better, gained)) =
                    scan.best((&self.candidates, self.coordinates), |k| !chosen.contains(&k), least)
                {
                    (chosen[place], value) = (better, gained);
                }
            }
            let value = self.value(&chosen).min(before);
            values.push(value);
            swept(sweep, value);
            if before - value < SETTLED {
                break;
            }
        }
        chosen.sort_unstable();
        Exchanged { chosen, values }
    }

    fn information(&self, poses: impl Iterator<Item = usize>) -> DMatrix<f64> {
        let mut information = self.ground.clone();
        for pose in poses {
            let rows = self.candidates.columns(self.coordinates * pose, self.coordinates);
            information.gemm(1.0, &rows, &rows.transpose(), 1.0);
        }
        information
    }
}

/// Jᵀ per unit of the scaled unknowns.
fn in_scale(candidates: &Sensitivity, scale: &DVector<f64>) -> DMatrix<f64> {
    let mut rows = candidates.rows.clone();
    rows.column_iter_mut().for_each(|mut column| column.component_div_assign(scale));
    rows
}
