//! Combinations of the unknowns of a stage that keep their start values, because data and priors do
//! not determine them.

use nalgebra::DMatrix;

use super::active_limits::ActiveLimit;
use crate::least_squares::{Triangle, UnidentifiableCombination, UnidentifiableSpace, Weak};

/// Combinations of the unknowns of a stage that data and priors leave undetermined or determine too
/// weakly. They keep their start values.
#[derive(Debug, Clone, Default)]
pub(in crate::fit) struct Gauge {
    /// Rows that span the combinations, shape = (combinations, unknowns).
    pub rows: DMatrix<f64>,
    /// Part of each unknown outside the combinations, 0…1; 0 for unknowns at a bound.
    pub visible: Vec<f64>,
    /// Change of each unknown where the weak combinations move by their plausible sizes, in SI
    /// units.
    pub moves: Vec<f64>,
    /// Combinations that data and priors determine too weakly; those that they leave undetermined
    /// are not in this list.
    pub weak: Vec<UnidentifiableCombination>,
}

impl Gauge {
    /// Finds the combinations that data, priors and `active` constraints do not determine, among
    /// the unknowns that are not marked in `held`.
    ///
    /// `data` is the triangular factor of the whitened Jacobian, and `priors` holds the rows of the
    /// priors. `sizes` are the plausible sizes of the unknowns; `None` for unknowns without one.
    pub fn new(
        data: &DMatrix<f64>,
        priors: &DMatrix<f64>,
        sizes: &[Option<f64>],
        held: &[bool],
        active: &[ActiveLimit],
    ) -> Self {
        let n = data.ncols();
        let data_rows = n + priors.nrows();
        let stacked = DMatrix::from_fn(data_rows + active.len(), n, |i, j| match i {
            i if i < n => data[(i, j)],
            i if i < data_rows => priors[(i - n, j)],
            // A constraint is weighted like a measurement of each of its parameters.
            i => {
                active[i - data_rows].row[j].signum()
                    * f64::from(active[i - data_rows].row[j] != 0.0)
                    * data.column(j).norm()
            }
        });
        let free: Vec<usize> = (0..n).filter(|&j| !held[j]).collect();
        let factor = Triangle::factor(&stacked.select_columns(&free));
        let UnidentifiableSpace { gauge: undetermined, visible: outside } =
            UnidentifiableSpace::in_triangle(&factor);
        let sizes: Vec<Option<f64>> = free.iter().map(|&k| sizes[k]).collect();
        let weak = Weak::of(&factor_of_stacked(&factor, &undetermined), &sizes);
        let unidentifiable = undetermined.nrows();
        let count = unidentifiable + weak.as_ref().map_or(0, |weak| weak.rows.nrows());
        let mut gauge = Gauge {
            rows: DMatrix::zeros(count, n),
            visible: vec![0.0; n],
            moves: vec![0.0; n],
            weak: Vec::new(),
        };
        for (j, &k) in free.iter().enumerate() {
            gauge.rows.view_mut((0, k), (unidentifiable, 1)).copy_from(&undetermined.column(j));
            gauge.visible[k] = outside[j];
            if let Some(weak) = &weak {
                gauge
                    .rows
                    .view_mut((unidentifiable, k), (count - unidentifiable, 1))
                    .copy_from(&weak.rows.column(j));
                gauge.visible[k] = outside[j].min(weak.visible[j]);
                gauge.moves[k] = weak.moves[j];
            }
        }
        let renumbered = |weak: UnidentifiableCombination| UnidentifiableCombination {
            weights: weak.weights.into_iter().map(|(j, weight)| (free[j], weight)).collect(),
            ..weak
        };
        gauge.weak = weak.into_iter().flat_map(|weak| weak.combinations).map(renumbered).collect();
        gauge
    }
}

/// Returns combinations of unknowns for the unknowns in another order: unknown j of the result is
/// `order[j]`. The first weight of a combination is positive.
pub(in crate::fit) fn in_order(
    combinations: &[UnidentifiableCombination],
    order: &[usize],
) -> Vec<UnidentifiableCombination> {
    let mut place = vec![0; order.len()];
    order.iter().enumerate().for_each(|(j, &k)| place[k] = j);
    let renumbered = |combination: &UnidentifiableCombination| {
        let moved = combination.weights.iter().map(|&(k, weight)| (place[k], weight));
        let mut weights: Vec<(usize, f64)> = moved.collect();
        weights.sort_by_key(|&(j, _)| j);
        let sign = weights.first().map_or(1.0, |(_, weight)| weight.signum());
        for (_, weight) in &mut weights {
            *weight *= sign;
        }
        UnidentifiableCombination { weights, ..*combination }
    };
    combinations.iter().map(renumbered).collect()
}

/// Returns the triangular factor of `triangle` with `rows` appended below.
pub(super) fn factor_of_stacked(triangle: &DMatrix<f64>, rows: &DMatrix<f64>) -> DMatrix<f64> {
    let n = triangle.ncols();
    let mut stack =
        triangle.clone().resize_vertically((triangle.nrows() + rows.nrows()).max(n), 0.0);
    stack.view_mut((triangle.nrows(), 0), rows.shape()).copy_from(rows);
    if rows.nrows() == 0 { stack } else { Triangle::factor(&stack) }
}
