//! Work divided among threads.
//!
//! Threads are given their work by [`for_each`], [`write_chunks`] and [`write_chunks_from_last`],
//! which are compiled once. With an iterator of rayon at each call, the division into threads would
//! be compiled anew for every closure.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

/// Calls `task` with each of 0…count − 1, in parallel.
pub(crate) fn for_each(count: usize, task: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(task);
}

/// Returns the values of `of` for 0…count − 1 in this order, computed in parallel.
pub(crate) fn map<T: Send>(count: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let values: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    for_each(count, &|index| {
        let value = of(index);
        *values[index].lock().unwrap_or_else(PoisonError::into_inner) = Some(value);
    });
    let value =
        |value: Mutex<Option<T>>| value.into_inner().unwrap_or_else(PoisonError::into_inner);
    values.into_iter().filter_map(value).collect()
}

/// Does the same as [`map`], with a buffer for each call of `of` that later calls reuse. `new`
/// creates one.
pub(crate) fn map_with<B: Send, T: Send>(
    count: usize,
    new: impl Fn() -> B + Sync,
    of: impl Fn(usize, &mut B) -> T + Sync,
) -> Vec<T> {
    let spare: Mutex<Vec<B>> = Mutex::default();
    let spare = || spare.lock().unwrap_or_else(PoisonError::into_inner);
    map(count, |index| {
        let reused = spare().pop();
        let mut buffer = reused.unwrap_or_else(&new);
        let value = of(index, &mut buffer);
        spare().push(buffer);
        value
    })
}

/// Returns the values of `of` for the items in their order, computed in parallel.
pub(crate) fn map_items<I: Sync, T: Send>(items: &[I], of: impl Fn(&I) -> T + Sync) -> Vec<T> {
    map(items.len(), |index| of(&items[index]))
}

/// Returns the values that `of` returns for chunks of `size` items, computed in parallel, all in
/// the order of the items.
pub(crate) fn map_chunks<I: Sync, T: Send>(
    items: &[I],
    size: usize,
    of: impl Fn(&[I]) -> Vec<T> + Sync,
) -> Vec<T> {
    let chunk = |index: usize| of(&items[index * size..items.len().min((index + 1) * size)]);
    joined(map(items.len().div_ceil(size), chunk))
}

/// Returns all values of the parts in one vector.
pub(crate) fn joined<T>(parts: Vec<Vec<T>>) -> Vec<T> {
    let mut all = Vec::with_capacity(parts.iter().map(Vec::len).sum());
    for mut part in parts {
        all.append(&mut part);
    }
    all
}

/// Calls `write` with the index and the entries of each chunk of `size` entries, in parallel.
pub(crate) fn write_chunks(
    entries: &mut [f64],
    size: usize,
    write: &(dyn Fn(usize, &mut [f64]) + Sync),
) {
    entries.par_chunks_mut(size).enumerate().for_each(|(index, chunk)| write(index, chunk));
}

/// Does the same as [`write_chunks`], beginning with the last chunks, which take longest.
pub(crate) fn write_chunks_from_last(
    entries: &mut [f64],
    size: usize,
    write: &(dyn Fn(usize, &mut [f64]) + Sync),
) {
    entries.par_chunks_mut(size).enumerate().rev().for_each(|(index, chunk)| write(index, chunk));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_in_the_order_of_the_items() {
        let items: Vec<usize> = (0..1000).collect();
        assert_eq!(
            map_items(&items, |item| 2 * item),
            items.iter().map(|item| 2 * item).collect::<Vec<_>>()
        );
        assert_eq!(map_chunks(&items, 7, <[usize]>::to_vec), items);
        assert!(map_chunks(&items[..0], 7, <[usize]>::to_vec).is_empty());
    }
}
