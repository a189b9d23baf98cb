//! Threads of a command: their number, which the environment variable `RAYON_NUM_THREADS` requests,
//! and their start.

use std::error::Error as _;
use std::{env, io, thread};

use rayon::ThreadPoolBuilder;

/// Environment variable with the number of threads.
const VARIABLE: &str = "RAYON_NUM_THREADS";
/// Number of threads that may be requested on any machine. Idle threads look for work at each other:
/// 1000 of them take 60 times the processor time of two.
const MAX_THREADS: usize = 256;

/// Error for a number of threads that is not valid.
#[derive(Debug, thiserror::Error)]
#[error(
    "{VARIABLE}={text}: a whole number from 0 (as many as processors) to {max} is needed; correct \
     it or unset it"
)]
pub struct BadThreads {
    text: String,
    max: usize,
}

/// Error for threads that the system does not start.
#[derive(Debug, thiserror::Error)]
#[error(
    "no threads for the computation: {reason}; raise the limits of processes and memory (ulimit \
     -u, -v), or set {VARIABLE}=1"
)]
pub struct NoThreads {
    reason: io::Error,
}

/// Starts the threads among which the library divides its work.
pub fn start() -> Result<(), NoThreads> {
    match ThreadPoolBuilder::new().build_global() {
        // An error without a cause means that the threads run already.
        Err(error) if error.source().is_some() => {
            Err(NoThreads { reason: io::Error::other(error) })
        }
        _ => Ok(()),
    }
}

/// Returns an error if the environment requests no valid number of threads. Must be called before
/// the first thread starts.
pub fn check() -> Result<(), BadThreads> {
    let Some(text) = env::var_os(VARIABLE) else { return Ok(()) };
    let text = text.to_string_lossy().into_owned();
    // At least one thread for each processor may be requested.
    let max = MAX_THREADS.max(thread::available_parallelism().map_or(1, usize::from));
    match text.trim().parse::<usize>() {
        _ if text.is_empty() => Ok(()),
        Ok(threads) if threads <= max => Ok(()),
        _ => Err(BadThreads { text, max }),
    }
}
