//! Which of two sets of joint columns counts.

worded! {
    /// Source of the configurations if a table has both commands and readings.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
    pub enum JointSource: as_str {
        /// Commanded joint coordinates: columns `q1_deg` …
        #[default]
        Commanded = "commanded";
        /// Encoder readings: columns `q1_read_deg` …
        Read = "read";
    }
}
