//! Interrupts from the keyboard (SIGINT, Ctrl-C) and requests to end (SIGTERM).

use std::process::exit;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Mutex, MutexGuard, Once, OnceLock, PoisonError};
use std::thread;
use std::time::Duration;

use flexcal::fit::Stop;

/// Exit status after a request to end with nothing written: 128 + SIGTERM, as in shells.
#[cfg(unix)]
const TERMINATED_STATUS: u8 = 143;
/// Exit status after an interrupt with nothing written: 128 + SIGINT, as in shells.
const INTERRUPTED_STATUS: u8 = 130;
/// Time after an interrupt in which a command may finish by itself, so that it ends within 2 s. In
/// builds with debug assertions, as in tests, the time is practically unlimited.
const MAX_FINISHING_TIME: Duration =
    Duration::from_millis(if cfg!(debug_assertions) { 600_000 } else { 1_700 });

/// Last work of a command that has not ended in time after an interrupt; it returns the exit
/// status.
type LastWork = Box<dyn FnOnce() -> u8 + Send>;

/// Lock that is held while finished files are renamed to their final names.
static WRITE_LOCK: Mutex<()> = Mutex::new(());
/// True once a command heeds the stop request, so that the first interrupt does not end it at once.
static HEEDS_STOP_REQUEST: AtomicBool = AtomicBool::new(false);
/// True once the results have their final names, so that the command is as good as done.
static IS_WRITTEN: AtomicBool = AtomicBool::new(false);
/// State of the running command.
static STATE: Mutex<State> = Mutex::new(State::Running(None));

/// Exit status after the signal that came first.
static STATUS: AtomicU8 = AtomicU8::new(INTERRUPTED_STATUS);

/// Returns the exit status of a command that an interrupt or a request to end has ended.
pub fn status() -> u8 {
    STATUS.load(Ordering::Relaxed)
}

/// State of the running command, which decides how an interrupt ends the process.
enum State {
    /// The command is working. If it does not end in time after an interrupt, its last work (if
    /// any) runs and the process ends.
    Running(Option<LastWork>),
    /// The command is writing its results. This takes little time, so the process is not ended.
    Writing,
    /// The time after the interrupt is over, and the process is about to end.
    Over,
}

/// Returns the stop request that the first interrupt makes. The second interrupt ends the process
/// at once, except while files are renamed to their final names.
///
/// Interrupts that were ignored, or handled by a host program, before the call remain so.
pub fn stop() -> Stop {
    HEEDS_STOP_REQUEST.store(true, Ordering::Relaxed);
    install()
}

/// Sets the last work of the running command, which runs if the command has not ended in time after
/// an interrupt.
pub fn at_deadline(work: impl FnOnce() -> u8 + Send + 'static) {
    *lock(&STATE) = State::Running(Some(Box::new(work)));
}

/// Declares that the command is writing its results, so that an interrupt no longer ends the
/// process. Does not return if the time after an interrupt is over, because the process then ends.
pub fn begin_writing() {
    let is_over = {
        let mut state = lock(&STATE);
        let is_over = matches!(*state, State::Over);
        if !is_over {
            *state = State::Writing;
        }
        is_over
    };
    if is_over {
        loop {
            thread::park();
        }
    }
}

/// Prevents interrupts from ending the process while the returned guard is held.
pub fn block_exit() -> MutexGuard<'static, ()> {
    install();
    lock(&WRITE_LOCK)
}

/// Declares that the results have their final names: the first interrupt leaves the command to end
/// by itself. Must be called before the guard of [`block_exit`] is released.
pub fn mark_written() {
    IS_WRITTEN.store(true, Ordering::Relaxed);
}

/// Returns the stop request of this process.
fn stop_request() -> &'static Stop {
    static STOP: OnceLock<Stop> = OnceLock::new();
    STOP.get_or_init(Stop::default)
}

/// Installs the handler of interrupts once and returns the stop request that it makes.
fn install() -> Stop {
    static INSTALLED: Once = Once::new();
    // If the process already has a handler, that one decides what an interrupt does.
    INSTALLED.call_once(|| _ = ctrlc::try_set_handler(|| end_early(INTERRUPTED_STATUS)));
    stop_request().clone()
}

/// Handles interrupts, and requests to end (SIGTERM) in the same way. Must be called before other
/// threads start: they inherit the blocked signal and leave it to the thread that waits for it.
pub fn watch() {
    // The thread that waits for interrupts inherits the blocked SIGTERM, too.
    #[cfg(unix)]
    watch_termination();
    IS_WRITTEN.store(false, Ordering::Relaxed);
    install();
}

/// Makes requests to end (SIGTERM) act as interrupts do.
#[cfg(unix)]
fn watch_termination() {
    use nix::sys::signal::{SigSet, Signal};
    static WATCHED: Once = Once::new();
    WATCHED.call_once(|| {
        let mut signals = SigSet::empty();
        signals.add(Signal::SIGTERM);
        if signals.thread_block().is_ok() {
            let watch = move || {
                while signals.wait().is_ok() {
                    end_early(TERMINATED_STATUS);
                }
            };
            // Without a thread for it, the signal ends the process at once.
            if thread::Builder::new().spawn(watch).is_err() {
                _ = signals.thread_unblock();
            }
        }
    });
}

/// Makes the stop request, and gives a command that heeds it a limited time to end. Ends the
/// process at once for other commands, and at the second interrupt. Waits while files get their
/// final names; a command whose files have them ends by itself.
fn end_early(status: u8) {
    // A command that sees the request may ask for the status at once.
    if !stop_request().is_requested() {
        STATUS.store(status, Ordering::Relaxed);
    }
    let is_repeated = stop_request().request();
    if is_repeated || !HEEDS_STOP_REQUEST.load(Ordering::Relaxed) {
        let _files = lock(&WRITE_LOCK);
        if !is_repeated && IS_WRITTEN.load(Ordering::Relaxed) {
            return;
        }
        super::diagnostic::interrupted("interrupted before the end");
        exit(i32::from(status));
    }
    if thread::Builder::new().spawn(end_in_time).is_err() {
        end_in_time();
    }
}

/// Ends the process if the command has not ended in time after an interrupt.
fn end_in_time() {
    thread::sleep(MAX_FINISHING_TIME);
    let work = {
        let mut state = lock(&STATE);
        if matches!(*state, State::Writing) {
            return;
        }
        match std::mem::replace(&mut *state, State::Over) {
            State::Running(work) => work,
            State::Writing | State::Over => None,
        }
    };
    let status = work.map_or_else(
        || {
            super::diagnostic::interrupted("interrupted before there was a result");
            self::status()
        },
        |work| work(),
    );
    let _files = lock(&WRITE_LOCK);
    exit(i32::from(status));
}

/// Locks a mutex, also if a thread panicked while it held the lock.
fn lock<T>(mutex: &'static Mutex<T>) -> MutexGuard<'static, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
