//! Text for terminals: control characters and other invisible characters are escaped or masked.

/// Returns true if a character is invisible and affects a terminal or the text order. These are
/// control characters, line separators, direction marks, tags and noncharacters.
pub fn is_hidden(character: char) -> bool {
    let code = u32::from(character);
    character.is_control()
        || matches!(character,
            '\u{061c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
            | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
        || code & 0xfffe == 0xfffe
        || (0xfdd0..=0xfdef).contains(&code)
}

/// Returns `text` on one line: invisible characters, including line breaks, become escapes.
pub fn one_line(text: &str) -> String {
    escaped(text, |_| false)
}

/// Returns `text` with its line feeds; all other invisible characters become escapes.
pub fn escape_hidden(text: &str) -> String {
    escaped(text, |character| character == '\n')
}

fn escaped(text: &str, passes: impl Fn(char) -> bool) -> String {
    let mut seen = String::with_capacity(text.len());
    for character in text.chars() {
        if is_hidden(character) && !passes(character) {
            seen.extend(character.escape_default());
        } else {
            seen.push(character);
        }
    }
    seen
}

/// Replaces each invisible character by a visible one of the same length in bytes, so that byte
/// offsets stay valid. Line feeds and tabs stay.
pub fn mask_hidden(text: &str) -> String {
    let substitute = |character: char| match character.len_utf8() {
        1 => '?',
        2 => '\u{bf}',
        3 => '\u{fffd}',
        _ => '\u{1fbc4}',
    };
    text.chars()
        .map(|c| if is_hidden(c) && c != '\n' && c != '\t' { substitute(c) } else { c })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invisible_characters_are_replaced() {
        let text =
            "a\u{1b}[31m\u{9b}2J\u{202e}b\u{200f}\u{2028}\u{e0041}\u{7f}\r\nΩ 日本 שלום\u{200d}";
        for clean in [escape_hidden(text), mask_hidden(text)] {
            assert!(clean.chars().all(|c| c == '\n' || !is_hidden(c)), "{clean:?}");
            assert!(clean.contains("\nΩ 日本 שלום\u{200d}"), "what is seen stays: {clean:?}");
        }
        assert!(
            one_line(text).starts_with("a\\u{1b}[31m\\u{9b}2J\\u{202e}b")
                && !one_line(text).contains('\n')
        );
        assert_eq!(mask_hidden(text).len(), text.len());
    }
}
