//! Source of the configurations of a table.

/// Source of the configurations if a table has both commands and readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum JointSource {
    /// Commanded joint coordinates: columns `q1_deg` …
    #[default]
    Commanded,
    /// Encoder readings: columns `q1_read_deg` …
    Read,
}

impl JointSource {
    /// Words of the sources in the file, in the order of [`ALL`](Self::ALL).
    pub(super) const WORDS: &'static [&'static str] = &["commanded", "read"];
    /// All sources of configurations.
    pub(super) const ALL: [Self; 2] = [Self::Commanded, Self::Read];

    /// Returns the word used in the file.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Commanded => "commanded",
            Self::Read => "read",
        }
    }
}
