//! Threads of the calculations, a pool for each process: the threads of a pool do not survive a
//! fork.

use std::env;
use std::process;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::of_argument;

/// Variable with the number of threads.
const VARIABLE: &str = "RAYON_NUM_THREADS";
/// Number of threads that may be requested on any machine; the command line has the same limit.
const MAX_THREADS: usize = 256;
/// Stack size of a thread, as much as a main thread has [bytes].
pub const STACK: usize = 8 << 20;

/// Pool of the process with this number.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Returns the pool of this process; a forked child makes its own.
///
/// # Errors
/// `InputError` if the environment asks for an impossible number of threads.
pub fn pool() -> PyResult<Arc<ThreadPool>> {
    let mut kept = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((process, pool)) = &*kept
        && *process == process::id()
    {
        return Ok(Arc::clone(pool));
    }
    let builder = ThreadPoolBuilder::new().num_threads(threads()?).stack_size(STACK);
    let pool = builder.build().map_err(|error| {
        of_argument(VARIABLE, format!("{VARIABLE}: the threads cannot be started: {error}"))
    })?;
    let pool = Arc::new(pool);
    // The threads of the parent's pool are not here, so it must not be dropped.
    std::mem::forget(kept.replace((process::id(), Arc::clone(&pool))));
    Ok(pool)
}

/// Runs `work` on the pool of this process without Python's lock.
///
/// # Errors
/// See [`pool`].
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let pool = pool()?;
    Ok(py.detach(move || pool.install(work)))
}

/// Returns the number of threads that the environment asks for, 0 for as many as processors.
fn threads() -> PyResult<usize> {
    let Some(text) = env::var_os(VARIABLE).filter(|text| !text.is_empty()) else { return Ok(0) };
    let text = text.to_string_lossy().into_owned();
    let max = MAX_THREADS.max(thread::available_parallelism().map_or(1, usize::from));
    match text.trim().parse::<usize>() {
        Ok(threads) if threads <= max => Ok(threads),
        _ => Err(of_argument(
            VARIABLE,
            format!(
                "{VARIABLE}={text}: a whole number from 0 (as many as processors) to {max} \
                 is needed; correct it or unset it"
            ),
        )),
    }
}
