//! Outcome of a command, which decides its exit status.

/// Outcome of a command: success, or a reason for another exit status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The command is done: exit status 0.
    Done,
    /// The result is not to be trusted, is incomplete, or does not meet what was asked: exit status
    /// 1.
    NotMet,
    /// The arm has changed since its estimate: exit status 3.
    Changed,
}

impl Outcome {
    /// Returns [`Done`](Self::Done) if the result of a command is trusted, else
    /// [`NotMet`](Self::NotMet).
    pub fn from_trust(is_trusted: bool) -> Self {
        if is_trusted { Self::Done } else { Self::NotMet }
    }
}
