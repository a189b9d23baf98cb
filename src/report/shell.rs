//! Quoting of paths in commands that the user may copy to a shell.

use std::path::Path;

/// Formats a path as one word of a shell command, in quotes if the shell would split or expand it.
pub fn shell_word(path: &Path) -> String {
    let word = path.display().to_string();
    let is_plain = |letter: char| letter.is_alphanumeric() || "/._-+,:=@%\\".contains(letter);
    match word.chars().all(is_plain) && !word.is_empty() {
        true if cfg!(windows) || !word.contains('\\') => word,
        _ if cfg!(windows) => format!("\"{word}\""),
        _ => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
#[cfg(not(windows))]
mod tests {
    use super::*;

    #[test]
    fn words_stay_whole() {
        for (path, expected) in [
            ("out/lunar-sampler/a.csv", "out/lunar-sampler/a.csv"),
            ("Müller/Arm_1", "Müller/Arm_1"),
            ("my arm", "'my arm'"),
            ("o'clock $HOME", r"'o'\''clock $HOME'"),
            (r"back\slash", r"'back\slash'"),
            ("", "''"),
        ] {
            assert_eq!(shell_word(Path::new(path)), expected);
        }
    }
}
