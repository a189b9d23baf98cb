//! Long work on a thread of its own, without Python's lock; meanwhile signals are seen and progress
//! is told.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use flexcal::fit::{Progress, ProgressSink};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::pool::{STACK, pool};

/// How long a signal waits at most.
const PATIENCE: Duration = Duration::from_millis(50);

/// What the thread says.
enum Event<T> {
    Step(Progress),
    Ended(thread::Result<T>),
}

/// Unwinds the thread whose result nobody waits for.
struct Abandoned;

/// Runs `work` on a thread; `progress` is called with iteration, unknowns, poses and cost of every
/// step.
///
/// A signal (KeyboardInterrupt) or an error of `progress` is raised at once; the thread ends at its
/// next step. The same `work` gives the same result however it is watched.
///
/// # Errors
/// What was raised meanwhile, or RuntimeError if the work panicked.
pub fn supervised<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(ProgressSink) -> T + Send + 'static,
) -> PyResult<T> {
    let pool = pool()?;
    let (sender, receiver) = channel();
    let abandoned = Arc::new(AtomicBool::new(false));
    let sink: ProgressSink = {
        let (sender, abandoned, told) =
            (sender.clone(), Arc::clone(&abandoned), progress.is_some());
        Arc::new(move |step| {
            if abandoned.load(Ordering::Relaxed) {
                resume_unwind(Box::new(Abandoned));
            }
            if told {
                // Who does not listen any more has abandoned the work.
                let _ = sender.send(Event::Step(step));
            }
        })
    };
    let body = move || {
        let ended = catch_unwind(AssertUnwindSafe(|| pool.install(|| work(sink))));
        let _ = sender.send(Event::Ended(ended));
    };
    thread::Builder::new().stack_size(STACK).spawn(body)?;
    watched(py, progress, receiver).inspect_err(|_| abandoned.store(true, Ordering::Relaxed))
}

fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    mut receiver: Receiver<Event<T>>,
) -> PyResult<T> {
    loop {
        let receiver = &mut receiver;
        match py.detach(move || receiver.recv_timeout(PATIENCE)) {
            Ok(Event::Step(told)) => {
                if let (Some(progress), Progress::Step { iteration, unknowns, poses, cost }) =
                    (progress, told)
                {
                    progress.call1((iteration, unknowns, poses, cost))?;
                }
                py.check_signals()?;
            }
            Ok(Event::Ended(Ok(result))) => return Ok(result),
            Ok(Event::Ended(Err(panic))) => return Err(panicked(panic.as_ref())),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => return Err(panicked(&"the thread has ended")),
        }
    }
}

fn panicked(panic: &(dyn Any + Send)) -> PyErr {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("unknown");
    PyRuntimeError::new_err(format!("a mistake in flexcal itself: {text}; please report it"))
}
