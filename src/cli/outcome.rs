//! Outcome of a command, which decides its exit status.

/// Outcome of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The command is done: exit status 0.
    Done,
    /// The fit is not to be trusted: exit status 1.
    NotTrusted,
    /// The results are of work that ended early: exit status 1.
    Interrupted,
}
