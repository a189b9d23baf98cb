//! Outcome of a command, which decides its exit status.

/// Outcome of a command: success, or a reason for another exit status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The command is done: exit status 0.
    Done,
    /// The fit is not trusted: exit status 1.
    NotTrusted,
    /// An arm does not pass the tolerance that it is tested for: exit status 1.
    NotPassed,
    /// The arm has changed since its estimate: exit status 3.
    Changed,
    /// The command was interrupted and wrote incomplete results: exit status 1.
    Interrupted,
}

impl Outcome {
    /// Returns the outcome of a command whose result is to be trusted or not.
    pub fn from_trust(is_trusted: bool) -> Self {
        if is_trusted { Self::Done } else { Self::NotTrusted }
    }
}
