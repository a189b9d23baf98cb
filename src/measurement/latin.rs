//! Text of tables, decoded from UTF-8 or from Windows-1252.

use std::borrow::Cow;

use csv::ByteRecord;

use crate::error::BYTE_ORDER_MARKS;
use crate::files::windows_1252;

/// Returns the number that a text with a decimal point or comma states; `None` for other texts.
pub(super) fn parsed(text: &str) -> Option<f64> {
    text.replace(',', ".").parse().ok()
}

/// Decodes bytes in which a header is searched: as UTF-8, else as Windows-1252, else with
/// replacement characters.
pub(super) fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        // The end of the searched beginning may cut a character.
        Err(error) if error.error_len().is_none() => String::from_utf8_lossy(bytes),
        Err(_) => windows_1252(bytes).map_or_else(|| String::from_utf8_lossy(bytes), Cow::Owned),
    }
}

/// Returns a record in which cells that are not UTF-8 are decoded from Windows-1252. Returns `None`
/// if all cells are UTF-8, if one does not look like text, or if the record is UTF-16.
pub(super) fn decoded_record(record: &ByteRecord) -> Option<ByteRecord> {
    let is_utf16 = BYTE_ORDER_MARKS.iter().any(|mark| record.as_slice().starts_with(mark));
    if is_utf16 || record.iter().all(|cell| std::str::from_utf8(cell).is_ok()) {
        return None;
    }
    let cell = |cell: &[u8]| match std::str::from_utf8(cell) {
        Ok(text) => Some(text.to_owned()),
        Err(_) => windows_1252(cell),
    };
    record.iter().map(cell).collect::<Option<Vec<_>>>().map(ByteRecord::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_that_are_not_utf8_are_decoded() {
        assert_eq!(decoded("°".as_bytes()), "°");
        assert_eq!(decoded_record(&ByteRecord::from(vec!["ä", "b"])), None);
        let mixed = ByteRecord::from(vec![&b"M\xfcller"[..], "ä".as_bytes()]);
        assert_eq!(decoded_record(&mixed), Some(ByteRecord::from(vec!["Müller", "ä"])));
    }
}
