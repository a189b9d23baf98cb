//! What an interrupt from the keyboard (SIGINT, Ctrl-C) does to a command that can end early.

use std::process::exit;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use flexcal::fit::Stop;

/// Exit status of what an interrupt ends with nothing written: 128 + SIGINT, as shells count.
pub const STATUS: u8 = 130;

/// Held while files take their names.
static WRITING: Mutex<()> = Mutex::new(());

/// What the first interrupt asks to end; the second one ends the process at once, between files
/// rather than among them.
///
/// An interrupt that is ignored, or handled by a program that this one is a part of, stays so.
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

/// Keeps interrupts from ending the process as long as what it returns is held.
pub fn unbroken() -> MutexGuard<'static, ()> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}
