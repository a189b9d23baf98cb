//! Public URDF files compared with pinocchio, if available.
//!
//!     python3 -m venv /tmp/robots && /tmp/robots/bin/pip install pin example-robot-data
//!     FLEXCAL_URDF_PYTHON=/tmp/robots/bin/python cargo test --test urdf public -- --ignored --nocapture
//!
//! Further files may be named in FLEXCAL_URDF_FILES, as `FILE#TIP#BASE` with colons between.

use std::env;
use std::process::Command;

use super::common::arms::path;

#[test]
#[ignore = "needs pinocchio and public URDFs; see the head of this file"]
fn public_arms_are_as_pinocchio_has_them() {
    let python = env::var("FLEXCAL_URDF_PYTHON").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let run = Command::new(python)
        .arg(path("tests/urdf/public.py"))
        .arg(env!("CARGO_BIN_EXE_flexcal"))
        .arg(folder.path())
        .args(
            env::var("FLEXCAL_URDF_FILES")
                .unwrap_or_default()
                .split(':')
                .filter(|file| !file.is_empty()),
        )
        .status()
        .unwrap();
    assert!(run.success());
}
