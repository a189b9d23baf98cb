//! Input errors: each message names file, line and key; `tests/fuzz` has random mutations.

mod files;
mod meant;
mod other_names;
mod reading;
mod sections;
mod tables;
mod usual;
