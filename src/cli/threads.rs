//! Check of the number of threads that the environment variable `RAYON_NUM_THREADS` requests.

use std::env;

/// Environment variable with the number of threads.
const VARIABLE: &str = "RAYON_NUM_THREADS";
/// Maximum number of threads that may be requested; more threads would only wait for each other.
pub const MAX_THREADS: usize = 1024;

/// Error for a number of threads that is not valid.
#[derive(Debug, thiserror::Error)]
#[error(
    "{VARIABLE}={text}: a whole number from 0 (as many as processors) to {MAX_THREADS} is needed; correct it or unset it"
)]
pub struct BadThreads {
    text: String,
}

/// Returns an error if the environment requests no valid number of threads. Must be called before
/// the first thread starts.
pub fn check() -> Result<(), BadThreads> {
    let Some(text) = env::var_os(VARIABLE) else { return Ok(()) };
    let text = text.to_string_lossy().into_owned();
    match text.trim().parse::<usize>() {
        _ if text.is_empty() => Ok(()),
        Ok(threads) if threads <= MAX_THREADS => Ok(()),
        _ => Err(BadThreads { text }),
    }
}
