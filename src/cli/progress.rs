//! Progress of long work, on standard error and only on a terminal.

use std::sync::{Arc, Mutex, Once, PoisonError};
use std::time::{Duration, Instant};

use flexcal::fit::{Progress, ProgressSink, Stop};
use indicatif::{ProgressBar, ProgressStyle};

use super::course::Course;

/// Time after the start before which no progress is shown.
const DELAY_BEFORE_PROGRESS: Duration = Duration::from_millis(500);
/// Time between two refreshes of the line.
const REFRESH_INTERVAL: Duration = Duration::from_millis(200);

/// Line on the terminal that shows the progress of a fit, a loop or a plan in words.
pub struct Line {
    bar: ProgressBar,
    begun: Instant,
    course: Mutex<Course>,
    /// Start of the periodic refresh, with the first message.
    ticking: Once,
    /// Request that ends the work early; the line says so once it is made.
    stop: Option<Stop>,
}

impl Line {
    /// Creates a line that is not shown yet.
    pub fn new() -> Arc<Self> {
        Self::with_stop(None)
    }

    /// Creates a line for work that the request `stop` ends early.
    fn with_stop(stop: impl Into<Option<Stop>>) -> Arc<Self> {
        let bar = ProgressBar::new_spinner();
        let shown = ProgressStyle::with_template("{spinner} {elapsed} {wide_msg}");
        bar.set_style(shown.unwrap_or_else(|_| ProgressStyle::default_spinner()));
        Arc::new(Self {
            bar,
            begun: Instant::now(),
            course: Mutex::default(),
            ticking: Once::new(),
            stop: stop.into(),
        })
    }

    /// Runs `work` with a line of progress if `shown` is true, and removes the line afterwards.
    /// `stop` is the request that ends the work early.
    pub fn during<T>(
        shown: bool,
        stop: impl Into<Option<Stop>>,
        work: impl FnOnce(Option<ProgressSink>) -> T,
    ) -> T {
        let line = shown.then(|| Self::with_stop(stop));
        let done = work(line.as_ref().map(Self::sink));
        if let Some(line) = line {
            line.bar.finish_and_clear();
        }
        done
    }

    /// Returns the sink to which the library reports its progress.
    fn sink(self: &Arc<Self>) -> ProgressSink {
        let line = Arc::clone(self);
        Arc::new(move |progress| line.show(&progress))
    }

    /// Records progress and shows it.
    fn show(&self, progress: &Progress) {
        let mut course = self.course.lock().unwrap_or_else(PoisonError::into_inner);
        course.record(progress, self.begun.elapsed().as_secs_f64());
        let interrupted = self.stop.as_ref().is_some_and(Stop::is_requested);
        self.say(|| {
            let end = if interrupted { "interrupted (Ctrl-C again ends at once): " } else { "" };
            format!("{end}{course}")
        });
    }

    /// Shows a message, unless the work began less than [`DELAY_BEFORE_PROGRESS`] ago.
    pub fn say(&self, message: impl FnOnce() -> String) {
        if self.begun.elapsed() > DELAY_BEFORE_PROGRESS && !self.bar.is_hidden() {
            self.ticking.call_once(|| self.bar.enable_steady_tick(REFRESH_INTERVAL));
            self.bar.set_message(message());
            self.bar.tick();
        }
    }

    /// Removes the line from the terminal.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// Does `work` on `count` items called `noun` (fits, poses), of which `kept` were finished in an
/// earlier run; `work` calls its argument after each item. Meanwhile a progress bar with the
/// remaining time is shown, unless `is_shown` is false.
pub fn count_during<T>(
    is_shown: bool,
    noun: &str,
    (count, kept): (usize, usize),
    work: impl FnOnce(&(dyn Fn() + Sync)) -> T,
) -> T {
    if !is_shown {
        return work(&|| ());
    }
    let bar = ProgressBar::new(count as u64);
    let shown = format!("{{wide_bar}} {{human_pos}} of {{human_len}} {noun}, {{eta}} left");
    bar.set_style(
        ProgressStyle::with_template(&shown).unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar.set_position(kept as u64);
    bar.reset_eta();
    let result = work(&|| bar.inc(1));
    bar.finish_and_clear();
    result
}
