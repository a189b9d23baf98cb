//! Outcome of a command, which decides its exit status.

/// Outcome of a command: success, or a reason for another exit status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The command is done: exit status 0.
    Done,
    /// The fit is not trusted: exit status 1.
    NotTrusted,
    /// The arm does not pass a tolerance, or further poses cannot reach it: exit status 1.
    NotPassed,
    /// The arm has changed since its estimate: exit status 3.
    Changed,
    /// The command was interrupted and wrote incomplete results: exit status 1.
    Interrupted,
}

impl Outcome {
    /// Returns [`Done`](Self::Done) if the result of a command is trusted, else
    /// [`NotTrusted`](Self::NotTrusted).
    pub fn from_trust(is_trusted: bool) -> Self {
        if is_trusted { Self::Done } else { Self::NotTrusted }
    }
}
