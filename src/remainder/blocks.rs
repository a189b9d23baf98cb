//! Blocks of neighbouring configurations, which are left out together to test predictions far from
//! the data.

use rand::seq::SliceRandom as _;

use super::rows::{Inputs, Rows};
use crate::random::stream;

/// Seed of the random choice of initial block centres.
const SEED: u64 = 0x0062_6c6f_636b;
/// Maximum number of passes of Lloyd's method (k-means), each of which assigns rows and moves the
/// centres.
const MAX_PASSES: usize = 30;

/// Returns the index of each row's block. Blocks are at most `count` clusters by k-means, in (sin
/// q, cos q) of angles and standardised values of other inputs. [Lloyd 1982] The rows of one
/// configuration share a block.
pub(super) fn blocks(rows: &Rows, inputs: &Inputs, count: usize) -> Vec<usize> {
    let points: Vec<Vec<f64>> =
        (0..rows.len()).map(|row| point(rows.inputs_of(row), inputs)).collect();
    let mut first: Vec<usize> = rows.configurations().iter().map(|group| group[0]).collect();
    first.shuffle(&mut stream(SEED, 0));
    first.truncate(count.max(1));
    let mut centres: Vec<Vec<f64>> = first.into_iter().map(|row| points[row].clone()).collect();
    let mut block = vec![0; rows.len()];
    for _ in 0..MAX_PASSES {
        let next: Vec<usize> = points.iter().map(|point| nearest(point, &centres)).collect();
        if next == block {
            break;
        }
        block = next;
        for (number, centre) in centres.iter_mut().enumerate() {
            let members: Vec<&Vec<f64>> = points
                .iter()
                .zip(&block)
                .filter(|(_, block)| **block == number)
                .map(|(p, _)| p)
                .collect();
            if members.is_empty() {
                continue;
            }
            for (k, value) in centre.iter_mut().enumerate() {
                *value = members.iter().map(|point| point[k]).sum::<f64>() / members.len() as f64;
            }
        }
    }
    block
}

/// Returns the coordinates in which the distances of rows are measured: sine and cosine of each
/// angle, and the standardised value of each other input.
fn point(values: &[f64], inputs: &Inputs) -> Vec<f64> {
    let each = values.iter().zip(&inputs.angles);
    each.flat_map(
        |(&value, &is_angle)| {
            if is_angle { vec![value.sin(), value.cos()] } else { vec![value] }
        },
    )
    .collect()
}

/// Returns the index of the centre that is nearest to a point.
fn nearest(point: &[f64], centres: &[Vec<f64>]) -> usize {
    let distance = |centre: &Vec<f64>| -> f64 {
        centre.iter().zip(point).map(|(a, b)| (a - b) * (a - b)).sum()
    };
    let each = centres.iter().map(distance).enumerate();
    each.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(index, _)| index)
}
