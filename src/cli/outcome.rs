//! What a command says to the shell.

/// What a command came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Exit status 0.
    Done,
    /// Exit status 1: the fit is not to be trusted.
    NotTrusted,
    /// Exit status 1: what was written is of work that ended early.
    Interrupted,
}
