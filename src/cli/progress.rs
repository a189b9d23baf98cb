//! Progress of long fits, on standard error and only on a terminal.

use std::sync::Arc;
use std::time::Duration;

use flexcal::identify::{Progress, ProgressSink};
use indicatif::{ProgressBar, ProgressStyle};

/// A fit faster than this shows nothing.
const PATIENCE: Duration = Duration::from_millis(500);

/// A line of progress and what feeds it.
pub struct Line {
    bar: ProgressBar,
    begun: std::time::Instant,
}

impl Line {
    /// A line that has not begun to show.
    pub fn new() -> Arc<Self> {
        Arc::new(Self { bar: ProgressBar::new_spinner(), begun: std::time::Instant::now() })
    }

    /// What the library reports to.
    pub fn sink(self: &Arc<Self>) -> ProgressSink {
        let line = Arc::clone(self);
        Arc::new(move |progress| line.show(progress))
    }

    fn show(&self, Progress { iteration, unknowns, poses, cost }: Progress) {
        self.say(|| {
            format!("{poses} poses, {unknowns} parameters: step {iteration}, half the sum of squares {cost:.6e}")
        });
    }

    /// Shows a message, once it is time to show anything.
    pub fn say(&self, message: impl FnOnce() -> String) {
        if self.begun.elapsed() > PATIENCE {
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
        bar.set_style(ProgressStyle::with_template(shown).unwrap_or_else(|_| ProgressStyle::default_bar()));
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
