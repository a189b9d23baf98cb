//! Progress of long fits, on standard error and only on a terminal.

use std::sync::Arc;
use std::time::Duration;

use flexcal::study::{Progress, ProgressSink};
use indicatif::ProgressBar;

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
