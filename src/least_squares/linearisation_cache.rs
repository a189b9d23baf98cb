//! Cache of linearisations that several stages of a fit need at the same point.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::DVector;

use super::chord::BasePoint;
use super::{Loss, Triangle};

/// Largest number of cached linearisations. They are at the last point, at the one before, and at
/// the first point of the same data, which is needed again at the end.
const MAX_CACHED_LINEARISATIONS: usize = 3;

/// Most recent linearisations of a few data sets. Reducing many rows takes far longer than any use
/// of the triangular factor.
#[derive(Debug, Default)]
pub struct LinearisationCache {
    cached: Mutex<VecDeque<(LinearisationKey, f64, Triangle)>>,
    /// Linearisation of all data whose derivatives are reused at later points; `None` unless the
    /// fit is provisional.
    base: Option<Mutex<Option<Arc<BasePoint>>>>,
}

/// Identifier of a linearisation: the data set and the point.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LinearisationKey {
    /// Identifier of the data set, whatever the unit by which residuals are divided.
    pub data: u64,
    pub loss: Loss,
    pub x: DVector<f64>,
}

impl LinearisationCache {
    /// Creates the cache of a provisional fit: one that another fit follows, or of which only the
    /// cost is used. Its steps reuse the derivatives at the start point while these predict the
    /// residuals.
    #[must_use]
    pub fn provisional() -> Self {
        Self { base: Some(Mutex::default()), ..Self::default() }
    }

    /// Returns true for the cache of a provisional fit.
    pub(crate) fn is_provisional(&self) -> bool {
        self.base.is_some()
    }

    /// Returns the linearisation cached under `key`, or calls `reduce` and caches its result.
    /// `unit` is the one by which residuals are divided: with squared loss, another unit only
    /// scales the cached factor.
    pub(super) fn get_or_reduce(
        &self,
        key: &LinearisationKey,
        unit: f64,
        reduce: impl FnOnce() -> Triangle,
    ) -> Triangle {
        let fits = |(other, other_unit, _): &&(LinearisationKey, f64, Triangle)| {
            let same_unit = other_unit.to_bits() == unit.to_bits();
            other == key && (key.loss == Loss::Squares || same_unit)
        };
        let cached = locked(&self.cached)
            .iter()
            .find(fits)
            .map(|(_, other_unit, triangle)| triangle.clone().scaled(other_unit / unit));
        cached.unwrap_or_else(|| {
            let triangle = reduce();
            let mut cached = locked(&self.cached);
            if cached.len() == MAX_CACHED_LINEARISATIONS {
                let of_other_data = cached.iter().rposition(|(other, ..)| other.data != key.data);
                cached.remove(of_other_data.unwrap_or(MAX_CACHED_LINEARISATIONS - 2));
            }
            cached.push_front((key.clone(), unit, triangle.clone()));
            triangle
        })
    }

    /// Returns the linearisation of data set `data` whose derivatives a provisional fit reuses;
    /// `None` if none is stored.
    pub(super) fn base_point(&self, data: u64) -> Option<Arc<BasePoint>> {
        let base = self.base.as_ref()?;
        locked(base).as_ref().filter(|base| base.data == data).map(Arc::clone)
    }

    /// Stores a linearisation that later steps reuse; does nothing unless the fit is provisional.
    pub(super) fn set_base_point(&self, new: Arc<BasePoint>) {
        if let Some(base) = &self.base {
            *locked(base) = Some(new);
        }
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
