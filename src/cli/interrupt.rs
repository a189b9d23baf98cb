//! Interrupts from the keyboard (SIGINT, Ctrl-C) during commands that can end early.

use std::process::exit;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use flexcal::fit::Stop;

/// Exit status after an interrupt with nothing written: 128 + SIGINT, as in shells.
pub const STATUS: u8 = 130;

/// Lock that is held while files take their names.
static WRITING: Mutex<()> = Mutex::new(());

/// Returns the stop request that the first interrupt makes. The second interrupt ends the process
/// at once, except while files take their names.
///
/// Interrupts that were ignored, or handled by a host program, before the call remain so.
pub fn stop() -> Stop {
    static STOP: OnceLock<Stop> = OnceLock::new();
    let stop = STOP.get_or_init(|| {
        let stop = Stop::default();
        let asked = stop.clone();
        let handler = move || {
            if asked.request() {
                let _files = unbroken();
                exit(i32::from(STATUS));
            }
        };
        // Where there is a handler already, its program decides.
        let _ = ctrlc::try_set_handler(handler);
        stop
    });
    stop.clone()
}

/// Prevents interrupts from ending the process while the returned guard is held.
pub fn unbroken() -> MutexGuard<'static, ()> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}
