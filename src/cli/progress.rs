//! Progress of long work, on standard error and only on a terminal.

use std::sync::{Arc, Mutex, Once, PoisonError};
use std::time::{Duration, Instant};

use flexcal::fit::{Progress, ProgressSink, Stop};
use indicatif::{ProgressBar, ProgressStyle};

use super::course::Course;

/// Work faster than this shows nothing.
const PATIENCE: Duration = Duration::from_millis(500);
/// Time between two pictures of a line that goes on by itself.
const TICK: Duration = Duration::from_millis(200);

/// A line of progress and what feeds it.
pub struct Line {
    bar: ProgressBar,
    begun: Instant,
    course: Mutex<Course>,
    ticking: Once,
    stop: Option<Stop>,
}

impl Line {
    /// A line that has not begun to show.
    pub fn new() -> Arc<Self> {
        Self::until(None)
    }

    /// The same of work that `stop` ends early.
    fn until(stop: impl Into<Option<Stop>>) -> Arc<Self> {
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

    /// Does some work, which reports to a line of progress where that is `shown`; the line is gone
    /// when the work is done.
    pub fn during<T>(
        shown: bool,
        stop: impl Into<Option<Stop>>,
        work: impl FnOnce(Option<ProgressSink>) -> T,
    ) -> T {
        let line = shown.then(|| Self::until(stop));
        let done = work(line.as_ref().map(Self::sink));
        if let Some(line) = line {
            line.bar.finish_and_clear();
        }
        done
    }

    /// What the library reports to.
    fn sink(self: &Arc<Self>) -> ProgressSink {
        let line = Arc::clone(self);
        Arc::new(move |progress| line.show(&progress))
    }

    fn show(&self, progress: &Progress) {
        let mut course = self.course.lock().unwrap_or_else(PoisonError::into_inner);
        course.take(progress, self.begun.elapsed().as_secs_f64());
        let interrupted = self.stop.as_ref().is_some_and(Stop::is_requested);
        self.say(|| {
            let end = if interrupted { "interrupted (Ctrl-C again ends at once): " } else { "" };
            format!("{end}{course}")
        });
    }

    /// Shows a message, once it is time to show anything.
    pub fn say(&self, message: impl FnOnce() -> String) {
        if self.begun.elapsed() > PATIENCE && !self.bar.is_hidden() {
            self.ticking.call_once(|| self.bar.enable_steady_tick(TICK));
            self.bar.set_message(message());
            self.bar.tick();
        }
    }

    /// Takes the line away.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// A bar of how many fits of a study are done, with the time left.
pub struct FitBar(ProgressBar);

impl FitBar {
    /// A bar of which `kept` of `fits` fits have been done before.
    pub fn new(fits: u64, kept: u64) -> Self {
        let bar = ProgressBar::new(fits);
        let shown = "{wide_bar} {human_pos} of {human_len} fits, {eta} left";
        bar.set_style(
            ProgressStyle::with_template(shown).unwrap_or_else(|_| ProgressStyle::default_bar()),
        );
        bar.set_position(kept);
        bar.reset_eta();
        Self(bar)
    }

    /// One more fit is done.
    pub fn advance(&self) {
        self.0.inc(1);
    }

    /// Takes the bar away.
    pub fn clear(&self) {
        self.0.finish_and_clear();
    }
}
