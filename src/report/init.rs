//! What `init` says.

use std::fmt::Write as _;
use std::path::Path;

use super::json::{object, to_text};
use crate::urdf::{Chain, Description};

object! {
    Document<'a>(chain: &'a Chain<'_>, description: &'a Description, file: &Path) {
        problem: &'a str = &description.name,
        file: String = file.display().to_string(),
        base: &'a str = chain.ends().0,
        tip: &'a str = chain.ends().1,
        /// Those that move, from base to tip.
        joints: Vec<String> = chain.joint_names(),
        notes: &'a [String] = &description.notes,
    }
}

/// What was made, as JSON text.
pub fn init_json(chain: &Chain, description: &Description, file: &Path) -> String {
    to_text(&Document::of(chain, description, file))
}

/// What was made, in words, and what comes next.
pub fn init_text(chain: &Chain, description: &Description, folder: &Path) -> String {
    let (base, tip) = chain.ends();
    let joints = chain.joint_names();
    let mut words =
        format!("{}: {} moving joints from {base} to {tip}\n  {}\n", description.name, joints.len(), joints.join(", "));
    for note in &description.notes {
        let _ = writeln!(words, "  note: {note}");
    }
    let folder = folder.display();
    let _ = write!(
        words,
        "\nWritten to {folder}/problem.toml. Put measurements.csv beside it (its columns stand in problem.toml) and\n\
         position_sigma_mm of your instrument into it, then\n  flexcal identify {folder}\n  flexcal loop {folder}\n"
    );
    words
}
