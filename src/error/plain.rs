//! Text that may go to a terminal: without control characters and other characters that are not
//! seen but do something.

/// Whether a character does something to a terminal or to the order of its neighbours instead of
/// being seen: control characters, line separators, marks of writing direction, tags, and what is
/// no character at all.
pub fn is_hidden(character: char) -> bool {
    let code = u32::from(character);
    character.is_control()
        || matches!(character,
            '\u{061c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
            | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
        || code & 0xfffe == 0xfffe
        || (0xfdd0..=0xfdef).contains(&code)
}

/// Text on one line: hidden characters, line breaks among them, are written as escapes.
pub fn one_line(text: &str) -> String {
    escaped(text, |_| false)
}

/// Text of any number of lines: hidden characters but line feeds are written as escapes.
pub fn visible(text: &str) -> String {
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

/// The text with as many bytes and with another character for each hidden one, so that places in it
/// stay; line feeds stay.
pub fn veiled(text: &str) -> String {
    let veil = |character: char| match character.len_utf8() {
        1 => '?',
        2 => '\u{bf}',
        3 => '\u{fffd}',
        _ => '\u{1fbc4}',
    };
    text.chars()
        .map(|own| if is_hidden(own) && own != '\n' && own != '\t' { veil(own) } else { own })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_hidden_is_left() {
        let text =
            "a\u{1b}[31m\u{9b}2J\u{202e}b\u{200f}\u{2028}\u{e0041}\u{7f}\r\nΩ 日本 שלום\u{200d}";
        for clean in [visible(text), veiled(text)] {
            assert!(clean.chars().all(|own| own == '\n' || !is_hidden(own)), "{clean:?}");
            assert!(clean.contains("\nΩ 日本 שלום\u{200d}"), "what is seen stays: {clean:?}");
        }
        assert!(
            one_line(text).starts_with("a\\u{1b}[31m\\u{9b}2J\\u{202e}b")
                && !one_line(text).contains('\n')
        );
        assert_eq!(veiled(text).len(), text.len());
    }
}
