//! Characters in messages and input: invisible ones are escaped or masked for terminals, typographic
//! ones are recognised.

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

/// Groups of typographic characters, each with its description and the remedy, for messages.
const TYPOGRAPHIC_CHARACTERS: [(&str, &str, &str); 4] = [
    (
        "\u{2212}\u{2010}\u{2011}\u{2012}\u{2013}\u{2014}",
        "a typographic minus sign or dash",
        "write the - of the keyboard",
    ),
    (
        "\u{201c}\u{201d}\u{201e}\u{201f}\u{2018}\u{2019}\u{201a}\u{201b}«»",
        "a typographic quotation mark",
        "write the straight \" of the keyboard",
    ),
    (
        "\u{a0}\u{2007}\u{2009}\u{200b}\u{202f}\u{3000}",
        "an invisible or no-break space",
        "write a plain space, or none",
    ),
    ("°", "a degree sign", "write the number alone, because its name ends in the unit"),
];

/// Returns the description, with its code, of the first typographic character of a text, and the
/// remedy. Returns `None` if the text has none.
pub(crate) fn typographic(text: &str) -> Option<(String, &'static str)> {
    text.chars().find_map(|character| {
        let (_, what, remedy) = TYPOGRAPHIC_CHARACTERS
            .iter()
            .find(|(characters, ..)| characters.contains(character))?;
        Some((format!("{what} (U+{:04X})", u32::from(character)), *remedy))
    })
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
