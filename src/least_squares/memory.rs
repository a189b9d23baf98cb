//! Linearised data that several askers want of one point.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::DVector;

use super::chord::Base;
use super::{Loss, Triangle};

/// Linearisations that are kept: those of the last point, of the one before, and of the first one
/// of the same data, which is asked for at the end.
const KEPT: usize = 3;

/// The last linearisations of some data, to be asked for again: reducing many rows costs far more
/// than all that is done with the factor.
#[derive(Debug, Default)]
pub struct Memory {
    kept: Mutex<VecDeque<(Key, f64, Triangle)>>,
    /// Derivatives that serve at later points, too, where they may.
    base: Option<Mutex<Option<Arc<Base>>>>,
}

/// What a linearisation is of.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Key {
    /// Which data, but for the unit of their residuals.
    pub data: u64,
    pub loss: Loss,
    pub x: DVector<f64>,
}

impl Memory {
    /// One for fits after which others follow, or of which little is asked: steps go by the
    /// derivatives of where they began, as long as these foresee what comes.
    #[must_use]
    pub fn provisional() -> Self {
        Self { base: Some(Mutex::default()), ..Self::default() }
    }

    /// Whether it is one for fits after which others follow.
    pub(crate) fn is_in_passing(&self) -> bool {
        self.base.is_some()
    }

    /// What is kept below `key`, or what `reduce` makes of it, for residuals in this `unit`: of
    /// squares another unit is another size.
    pub(super) fn recall(
        &self,
        key: &Key,
        unit: f64,
        reduce: impl FnOnce() -> Triangle,
    ) -> Triangle {
        let is_known = |(own, known, _): &&(Key, f64, Triangle)| {
            own == key && (key.loss == Loss::Squares || known.to_bits() == unit.to_bits())
        };
        let found = locked(&self.kept)
            .iter()
            .find(is_known)
            .map(|(_, known, triangle)| triangle.clone().scaled(known / unit));
        found.unwrap_or_else(|| {
            let triangle = reduce();
            let mut kept = locked(&self.kept);
            if kept.len() == KEPT {
                let other = kept.iter().rposition(|(own, ..)| own.data != key.data);
                kept.remove(other.unwrap_or(KEPT - 2));
            }
            kept.push_front((key.clone(), unit, triangle.clone()));
            triangle
        })
    }

    /// The derivatives of some data that serve at later points.
    pub(super) fn base(&self, data: u64) -> Option<Arc<Base>> {
        let base = self.base.as_ref()?;
        locked(base).as_ref().filter(|own| own.data == data).map(Arc::clone)
    }

    /// Keeps derivatives for later points.
    pub(super) fn keep(&self, new: Arc<Base>) {
        if let Some(base) = &self.base {
            *locked(base) = Some(new);
        }
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
