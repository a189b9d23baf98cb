//! Advisory lock of a folder, so that one process at a time writes results there.

use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Maximum time for which a process waits while another one writes to the same folder.
pub const MAX_LOCK_WAIT: Duration = Duration::from_secs(10);
/// Pause between two attempts to take a lock.
const RETRY_INTERVAL: Duration = Duration::from_millis(5);

/// Lock of a folder; the system releases it when the value is dropped or the process ends.
///
/// The lock is on the folder itself, so no lock file is left behind.
#[derive(Debug)]
pub struct FolderLock {
    /// Open folder; `None` where the system cannot lock folders.
    _folder: Option<File>,
}

impl FolderLock {
    /// Locks an existing folder, within `patience`.
    ///
    /// # Errors
    /// Returns [`io::ErrorKind::WouldBlock`] if another process holds the lock for longer.
    pub(super) fn take_within(folder: &Path, patience: Duration) -> io::Result<Self> {
        // Windows does not open folders as files, and some network folders have no locks.
        let Some(open) = folder.is_dir().then(|| File::open(folder).ok()).flatten() else {
            return Ok(Self { _folder: None });
        };
        let begun = Instant::now();
        loop {
            match open.try_lock() {
                Ok(()) => return Ok(Self { _folder: Some(open) }),
                Err(TryLockError::WouldBlock) if begun.elapsed() < patience => {
                    sleep(RETRY_INTERVAL);
                }
                Err(TryLockError::WouldBlock) => return Err(io::ErrorKind::WouldBlock.into()),
                Err(TryLockError::Error(_)) => return Ok(Self { _folder: None }),
            }
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_second_writer_waits_and_is_refused_in_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let first = FolderLock::take_within(folder.path(), Duration::ZERO).unwrap();
        let refused = FolderLock::take_within(folder.path(), 4 * RETRY_INTERVAL).unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::WouldBlock);
        drop(first);
        FolderLock::take_within(folder.path(), Duration::ZERO).unwrap();
        assert!(std::fs::read_dir(folder.path()).unwrap().next().is_none(), "no lock file");
    }
}
