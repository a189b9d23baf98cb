//! Words that name the frames of an arm.

use super::joint::Joint;
use crate::error::InputErrorKind;

/// Returns the frame that a word names: `base`, a joint by its name, or `joint3`. The word `tool`
/// means the frame of joint `tool` (counted from 0).
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

/// Returns a word that names a frame: the joint's name if it is unambiguous, otherwise `joint3`.
pub(crate) fn frame_word(place: usize, joints: &[Joint], tool: usize) -> String {
    let Some(joint) = place.checked_sub(1).and_then(|joint| joints.get(joint)) else {
        return "base".to_owned();
    };
    let is_it = frame(&joint.name, joints, tool).is_ok_and(|named| named == place);
    if is_it { joint.name.clone() } else { format!("joint{place}") }
}
