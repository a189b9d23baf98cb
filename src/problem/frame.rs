//! Words that name the frames of an arm.

use super::joint::Joint;
use crate::error::InputErrorKind;

/// Returns the frame that a word names: 0 for `base`, i for joint i by its name or as `joint3`. The
/// word `tool` names the frame of the joint with index `tool`.
///
/// # Errors
/// Returns an error if the word names no frame.
pub(crate) fn frame(word: &str, joints: &[Joint], tool: usize) -> Result<usize, InputErrorKind> {
    let named = || joints.iter().position(|joint| joint.name == word).map(|index| index + 1);
    let numbered = || {
        word.strip_prefix("joint")?
            .parse()
            .ok()
            .filter(|number| (1..=joints.len()).contains(number))
    };
    match word {
        "base" => Ok(0),
        "tool" => Ok(tool + 1),
        _ => named().or_else(numbered).ok_or_else(|| {
            let joints = joints.iter().map(|joint| joint.name.clone());
            let known = std::iter::once("base".to_owned())
                .chain(joints)
                .chain(["tool".to_owned()])
                .collect();
            InputErrorKind::UnknownFixture { what: "frame", name: word.to_owned(), known }
        }),
    }
}

/// Returns a word that names the frame with this index: the joint's name if it is unambiguous,
/// otherwise `joint3`.
pub(crate) fn frame_word(index: usize, joints: &[Joint], tool: usize) -> String {
    let Some(joint) = index.checked_sub(1).and_then(|joint| joints.get(joint)) else {
        return "base".to_owned();
    };
    let is_it = frame(&joint.name, joints, tool).is_ok_and(|named| named == index);
    if is_it { joint.name.clone() } else { format!("joint{index}") }
}
