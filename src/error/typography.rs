//! Characters of word processors and spreadsheets that look like those of the keyboard.

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
