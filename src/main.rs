//! The flexcal command line.

fn main() {}
