//! Words about the candidates from which poses are chosen.

use super::document::code;
use crate::quantity::format::counted;

/// Number of candidates below which a choice among drawn poses is called one of few.
const FEW_CANDIDATES: usize = 200;

/// Returns the number of `candidates`, with the number of poses `drawn` to find those that cameras
/// see, inside the workspace if it is limited.
pub(super) fn candidates_drawn(
    candidates: usize,
    drawn: Option<usize>,
    is_limited: bool,
) -> String {
    let counts = counted(candidates, "candidate");
    let inside = if is_limited { " and inside the workspace" } else { "" };
    match drawn {
        Some(drawn) => format!("{counts} in view{inside} among {drawn} drawn poses"),
        None => counts,
    }
}

/// States that cameras see a marker in few of the `drawn` poses, and what to do; `None` if there
/// are enough candidates, or if no poses were drawn for cameras. A workspace that is limited leaves
/// out poses, too.
pub(super) fn few_in_view(
    candidates: usize,
    drawn: Option<usize>,
    is_limited: bool,
) -> Option<String> {
    let inside = if is_limited { "lie in the workspace and " } else { "" };
    drawn.filter(|_| candidates < FEW_CANDIDATES).map(|drawn| {
        format!(
            "Only {candidates} of {drawn} drawn poses {inside}show the marker as the measured \
             views do, so that better poses may exist. Give {} a table of poses in which the \
             detector finds the marker, or {} a file with narrower ranges of the joints in {}.",
            code("--pool"),
            code("--truth"),
            code("[poses]")
        )
    })
}
