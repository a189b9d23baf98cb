//! Linearised data that several askers want of one point.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

use nalgebra::DVector;

use super::{Loss, Triangle};

/// Linearisations that are kept: those of the last point and of the one before.
const KEPT: usize = 2;

/// The last linearisations of some data, to be asked for again: reducing many rows costs far more than all that is done with the factor.
#[derive(Debug, Default)]
pub struct Memory {
    kept: Mutex<VecDeque<(Key, Triangle)>>,
}

/// What a linearisation is of.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Key {
    /// Which data.
    pub data: u64,
    pub loss: Loss,
    pub x: DVector<f64>,
}

impl Memory {
    /// What is kept below `key`, or what `reduce` makes of it.
    pub(super) fn recall(&self, key: &Key, reduce: impl FnOnce() -> Triangle) -> Triangle {
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let found = kept().iter().find(|(own, _)| own == key).map(|(_, triangle)| triangle.clone());
        found.unwrap_or_else(|| {
            let triangle = reduce();
            let mut kept = kept();
            kept.truncate(KEPT - 1);
            kept.push_front((key.clone(), triangle.clone()));
            triangle
        })
    }
}
