//! The model as C code equals the library; rigid tables describe the exported arm.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]
#![expect(clippy::print_stderr, reason = "what is not installed is said")]

#[path = "../common/mod.rs"]
mod common;

mod camera;
mod code;
mod rigid;

use common::arms::path;
use common::program::Folder;

/// Returns a folder with the estimate of the lunar sampler in `out`.
fn lunar_sampler() -> Folder {
    let folder = Folder::new();
    let cases = path("tests/cases").display().to_string();
    folder.flexcal(&format!("identify {cases} --out out --quiet")).success();
    folder
}
