//! Text in Windows-1252, the extension of Latin-1 that spreadsheets and instruments still write.

/// Bytes 0x80 to 0x9f that occur in text, with their characters. Other bytes in this range mark
/// binary data.
const HIGH_CHARACTERS: [(u8, char); 9] = [
    (0x80, '€'),
    (0x85, '…'),
    (0x91, '‘'),
    (0x92, '’'),
    (0x93, '“'),
    (0x94, '”'),
    (0x96, '–'),
    (0x97, '—'),
    (0x99, '™'),
];
/// Characters of the bytes 0xa0 to 0xbf that occur in column names and in words.
const SIGNS: &str = "\u{a0}§ª«°±²³´µ·¹º»¼½¾¿";
/// First byte of the accented letters.
const FIRST_LETTER: u8 = 0xc0;
/// Bytes above [`FIRST_LETTER`] that hardly occur in text: Ð × Þ ð ÷ þ ÿ.
const RARE_LETTERS: [u8; 7] = [0xd0, 0xd7, 0xde, 0xf0, 0xf7, 0xfe, 0xff];

/// Decodes bytes that are not UTF-8 as Windows-1252. Returns `None` if they do not look like text:
/// they contain a control character, a rare character, or an accented letter without a letter next
/// to it.
pub fn windows_1252(bytes: &[u8]) -> Option<String> {
    let is_letter = |place: Option<usize>| {
        let byte = place.and_then(|place| bytes.get(place)).copied().unwrap_or_default();
        byte.is_ascii_alphabetic() || (byte >= FIRST_LETTER && !RARE_LETTERS.contains(&byte))
    };
    let character = |(place, &byte): (usize, &u8)| match byte {
        b'\t' | b'\r' | b'\n' | 0x20..=0x7e => Some(char::from(byte)),
        0x80..=0x9f => {
            HIGH_CHARACTERS.iter().find(|(mark, _)| *mark == byte).map(|(_, mark)| *mark)
        }
        0xa0..=0xbf => Some(char::from(byte)).filter(|sign| SIGNS.contains(*sign)),
        FIRST_LETTER.. => {
            let has_neighbour = is_letter(place.checked_sub(1)) || is_letter(Some(place + 1));
            (has_neighbour && !RARE_LETTERS.contains(&byte)).then(|| char::from(byte))
        }
        _ => None,
    };
    bytes.iter().enumerate().map(character).collect()
}

#[cfg(test)]
mod tests {
    use super::windows_1252;

    #[test]
    fn text_is_told_from_binary_data() {
        for (bytes, text) in [
            (&b"Pr\xfcfer"[..], Some("Prüfer")),
            (b"Winkel (\xb0)", Some("Winkel (°)")),
            (b"\xb5m \x96 \xc4rger", Some("µm – Ärger")),
            (b"\xc3\x28", None),
            (b"\xff\xfe", None),
            (b"a\x00\xfc", None),
            (b"\x81", None),
        ] {
            assert_eq!(windows_1252(bytes).as_deref(), text, "{bytes:?}");
        }
    }
}
