//! Cache of results that several threads share.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Cache of computed results by key, shared by several threads.
pub(super) struct Cache<K, V>(Mutex<BTreeMap<K, V>>);

impl<K, V> Default for Cache<K, V> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<K: Ord + Clone, V: Clone> Cache<K, V> {
    /// Returns the cached result of `key`, or computes and keeps it.
    pub fn get_or_compute(&self, key: &K, make: impl FnOnce() -> Option<V>) -> Option<V> {
        let entries = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let cached = entries().get(key).cloned();
        cached.or_else(|| {
            let new = make()?;
            entries().insert(key.clone(), new.clone());
            Some(new)
        })
    }
}
