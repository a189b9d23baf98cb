//! Head of every JSON file that flexcal writes.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Version of the result formats. It increases when a key is removed or changes its meaning.
pub const FORMAT_VERSION: u32 = 2;

/// Name and version of the program that writes the files.
pub const PROGRAM: &str = concat!("flexcal ", env!("CARGO_PKG_VERSION"));

/// Name and version of the format of a file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub(crate) struct Format {
    pub name: Cow<'static, str>,
    pub version: u32,
}

impl Format {
    /// Returns the current version of the format with this name.
    pub fn current(name: &'static str) -> Self {
        Self { name: Cow::Borrowed(name), version: FORMAT_VERSION }
    }
}

/// Returns the version of the format of a JSON file if it is newer than this program.
pub(crate) fn newer_version(json: &[u8]) -> Option<u32> {
    /// Head of the file: all that a newer version is sure to share.
    #[derive(Deserialize)]
    struct Head {
        format: Version,
    }
    #[derive(Deserialize)]
    struct Version {
        version: u32,
    }
    let head: Head = serde_json::from_slice(json).ok()?;
    Some(head.format.version).filter(|version| *version > FORMAT_VERSION)
}
