//! Formats of files, recognised by their beginning, for messages about a file of the wrong format.

/// Name of the JSON format in messages.
pub(crate) const JSON: &str = "a JSON file";
/// Name of the format of tables in messages.
pub(crate) const TABLE: &str = "a table in text (CSV)";
/// Name of the format of problems, truths and studies in messages.
pub(crate) const TOML: &str = "a TOML file";
/// Name of the format of URDFs in messages.
pub(crate) const XML: &str = "an XML file";

/// Name of archives and workbooks in messages.
pub(super) const ZIP: &str = "a ZIP archive or a workbook (XLSX, ODS)";
/// Name of the format of word processors in messages.
pub(super) const RICH_TEXT: &str = "rich text (RTF)";

/// Formats of binary files by their first bytes.
const BINARY_SIGNATURES: [(&[u8], &str); 18] = [
    (b"PK\x03\x04", ZIP),
    (b"\xd0\xcf\x11\xe0", "a workbook or document of old Office programs (XLS, DOC)"),
    (b"%PDF", "a PDF document"),
    (b"\x1f\x8b", "a file compressed by gzip"),
    (b"\xfd7zXZ", "a file compressed by xz"),
    (b"\x28\xb5\x2f\xfd", "a file compressed by zstd"),
    (b"7z\xbc\xaf", "a 7-Zip archive"),
    (b"\x93NUMPY", "a NumPy array"),
    (b"\x80\x04\x95", "a Python pickle"),
    (b"MATLAB ", "a MATLAB file"),
    (b"\x89HDF", "an HDF5 file"),
    (b"PAR1", "a Parquet file"),
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"#ROSBAG", "a ROS bag"),
    (b"\x89MCAP", "a ROS 2 bag (MCAP)"),
    (b"SQLite format 3", "a SQLite database (such as a ROS 2 bag)"),
    (b"PXR-USDC", "a USD scene"),
];

/// Formats of text files by their first characters, in lower case.
const TEXT_MARKS: [(&str, &str); 10] = [
    ("<!doctype html", "an HTML page"),
    ("<html", "an HTML page"),
    ("<", XML),
    ("#usda", "a USD scene"),
    ("solid ", "a mesh (STL)"),
    ("iso-10303-21", "a STEP file"),
    ("%yaml", YAML),
    ("{\\rtf", RICH_TEXT),
    ("{", JSON),
    ("---\n", YAML),
];
const YAML: &str = "a YAML file";

/// Returns the format of a binary file from its first bytes; `None` for text and unknown formats.
pub(crate) fn binary_format(bytes: &[u8]) -> Option<&'static str> {
    BINARY_SIGNATURES
        .iter()
        .find(|(signature, _)| bytes.starts_with(signature))
        .map(|(_, format)| *format)
}

/// Returns the format of a text by its first line with content; `None` if the format is unknown.
///
/// Lines that begin with `#` are skipped as comments.
pub(crate) fn text_format(text: &str) -> Option<&'static str> {
    let start = text.trim_start_matches(|c: char| c.is_whitespace() || c == '\u{feff}');
    let beginning: String =
        start.chars().filter(|&c| c != '\r').take(20).collect::<String>().to_ascii_lowercase();
    if let Some((_, format)) = TEXT_MARKS.iter().find(|(mark, _)| beginning.starts_with(mark)) {
        return Some(format);
    }
    let mut lines = start.lines().map(str::trim);
    let line = lines.find(|line| !line.is_empty() && !line.starts_with(['#', '%']))?;
    if line.starts_with("//") {
        // Neither TOML nor YAML has this mark of comments; tables of other programs do.
        return has_rows(start).then_some(TABLE);
    }
    let is_key = |key: &str| {
        !key.is_empty() && key.chars().all(|c| c.is_alphanumeric() || "_-.\"' ".contains(c))
    };
    let has_key = |sign| line.split_once(sign).is_some_and(|(key, _)| is_key(key.trim()));
    let is_value = |c: char| c.is_ascii_digit() || "{[]\"'-".contains(c);
    let is_list = |inner: &str| {
        let inner = inner.trim_start();
        let nested = inner.strip_prefix('[').map(str::trim_start);
        inner.is_empty()
            || inner.starts_with('{')
            || nested.is_some_and(|nested| nested.is_empty() || nested.starts_with(is_value))
    };
    if line != "[[" && line.strip_prefix('[').is_some_and(is_list) && !line.ends_with("]]") {
        Some(JSON)
    } else if has_key('=') || (line.starts_with('[') && is_key(line.trim_matches(['[', ']']))) {
        Some(TOML)
    } else if has_key(':') && !line.contains(['\t', ';']) {
        Some(YAML)
    } else {
        line.contains([',', ';', '\t']).then_some(TABLE)
    }
}

/// Returns true if a line of the text has at least three numbers between delimiters.
fn has_rows(text: &str) -> bool {
    let is_number = |cell: &&str| cell.trim().replace(',', ".").parse::<f64>().is_ok();
    let counts = |line: &str| {
        [',', ';', '\t', ' '].map(|delimiter| line.split(delimiter).filter(is_number).count())
    };
    text.lines().any(|line| counts(line).into_iter().any(|count| count >= 3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_recognised_by_the_first_line_with_content() {
        for (text, format) in [
            ("\u{feff}\n<!DOCTYPE HTML>", Some("an HTML page")),
            ("<?xml version='1.0'?>", Some(XML)),
            ("{\\rtf1\\ansi", Some(RICH_TEXT)),
            ("{\n \"a\": 1}", Some(JSON)),
            ("[ {\"q1\": 1}]", Some(JSON)),
            ("[\n {\n \"q1\": 1}]", Some(JSON)),
            ("---\r\na: 1", Some(YAML)),
            ("# arm\nname: arm", Some(YAML)),
            ("# arm\n\nname = 'arm'", Some(TOML)),
            ("[[joint]]\n", Some(TOML)),
            ("q1_deg,x_mm\n1,2", Some(TABLE)),
            ("// Export\n// q1, x\nP1, 1.5, 2, 3\n", Some(TABLE)),
            ("// Export\nname = 'arm'\n", None),
            ("-----\nq1 x\n", None),
            ("", None),
        ] {
            assert_eq!(text_format(text), format, "{text:?}");
        }
        assert_eq!(binary_format(b"%PDF-1.7"), Some("a PDF document"));
        assert_eq!(binary_format(b"q1_deg"), None);
    }
}
