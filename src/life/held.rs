//! Causes that move parameters which the problem holds, and free parameters that move the rows in
//! the same way.

use nalgebra::{DMatrix, DVector};

use super::causes::{Cause, Extended};
use super::column_space::{ColumnSpace, MAX_OUTSIDE};
use super::relocation::is_of_place;
use super::rows::SensitiveRows;
use crate::model::parameter::ParameterSite;

impl Extended {
    /// Returns the free parameters that move the rows as the held ones of a cause do: its name, and
    /// the index and the size of the change of each parameter, for a cause with amplitudes of size
    /// `sizes`. They are those of one placement, else of all bases, else of one joint. `None` if no
    /// such parameters move the rows in all directions of the cause.
    pub fn free_instead(
        &self,
        cause: &Cause,
        sizes: &[f64],
        rows: &SensitiveRows,
    ) -> Option<(String, Vec<(usize, f64)>)> {
        let is_free = |k: &usize| self.model.parameters[*k].regressor.is_constant();
        let free: Vec<usize> = (0..self.declared).filter(is_free).collect();
        let mut groups: Vec<(u8, String, Vec<usize>)> = Vec::new();
        let mut add = |rank: u8, label: &str, k: usize| match groups
            .iter_mut()
            .find(|group| (group.0, &*group.1) == (rank, label))
        {
            Some(group) => group.2.push(k),
            None => groups.push((rank, label.to_owned(), vec![k])),
        };
        for k in free {
            let parameter = &self.model.parameters[k];
            let label = parameter.name.rsplit_once('.').map_or("", |(label, _)| label);
            match parameter.site {
                ParameterSite::Joint { field, .. } if field.is_geometry() => add(2, label, k),
                ParameterSite::Base { .. } => {
                    add(0, label, k);
                    add(1, "all bases", k);
                }
                ParameterSite::Target { .. } => add(0, label, k),
                _ if is_of_place(parameter) => add(0, label, k),
                _ => {}
            }
        }
        groups.sort_by_key(|group| group.0);
        let holds = |group: &&(u8, String, Vec<usize>)| {
            ColumnSpace::new(rows, &group.2).contains(rows, &cause.columns)
        };
        let (_, label, columns) = groups.iter().find(holds)?;
        let scale: Vec<f64> = columns
            .iter()
            .map(|&k| rows.sensitivity.column(k).norm())
            .map(|length| if length > 0.0 { length } else { 1.0 })
            .collect();
        let scaled = DMatrix::from_fn(rows.sensitivity.nrows(), columns.len(), |i, j| {
            rows.sensitivity[(i, columns[j])] / scale[j]
        });
        let inverse = scaled.pseudo_inverse(MAX_OUTSIDE).ok()?;
        let mut squares = DVector::zeros(columns.len());
        for (&k, size) in cause.columns.iter().zip(sizes) {
            let change = &inverse * rows.sensitivity.column(k) * *size;
            squares += change.component_mul(&change);
        }
        let sizes = squares.iter().zip(&scale).map(|(square, scale)| square.sqrt() / scale);
        Some((label.clone(), columns.iter().copied().zip(sizes).collect()))
    }
}
