//! Error of a URDF in which the closing tag of an element is missing.

use roxmltree::Error;

use crate::error::{InputError, UrdfErrorKind, shortened};
use crate::problem::item::Document;

/// Maximum number of characters of a tag that an error shows.
const MAX_SHOWN: usize = 60;

/// Returns the error of an element that is not closed before the closing tag of another one.
/// `error` is that of the parser; `None` if it has another cause.
pub(super) fn not_closed(source: &Document, error: &Error) -> Option<InputError> {
    if matches!(error, Error::UnexpectedEndOfStream | Error::UnclosedRootNode) {
        return truncated(source);
    }
    let Error::UnexpectedCloseTag(name, before, position) = error else { return None };
    let line = position.row as usize;
    let starts = source.text.split_inclusive('\n').scan(0, |start, line| {
        let this = *start;
        *start += line.len();
        Some(this)
    });
    let line_start = starts.take(line).last()?;
    let rest = source.text.get(line_start..)?;
    let column = rest.char_indices().nth(position.col as usize - 1).map_or(rest.len(), |at| at.0);
    let open = open_tags(source.text.get(..line_start + column)?);
    let (start, tag) = *open.last()?;
    // A tag that closes no open element is itself the mistake.
    let closes = open.iter().any(|(_, tag)| tag.split_whitespace().next() == Some(before));
    let kind = UrdfErrorKind::NotClosed {
        element: shortened(tag, MAX_SHOWN),
        name: shortened(name, MAX_SHOWN),
        before: shortened(before, MAX_SHOWN),
        line,
    };
    (closes && tag.starts_with(name.as_str())).then(|| source.locate(start..start + 1).error(kind))
}

/// Returns the error of a file that ends within an element, at the beginning of the innermost one.
fn truncated(source: &Document) -> Option<InputError> {
    let text: &str = &source.text;
    let open = open_tags(text);
    let last = text.rfind('<')?;
    let rest = text.get(last + 1..)?;
    // A tag that is cut off itself has no end.
    let is_cut = !rest.starts_with(['/', '!', '?']) && tag_end(rest).is_none();
    let (start, tag) = if is_cut { (last, rest.trim_end()) } else { *open.last()? };
    let end = if is_cut { "" } else { ">" };
    let element = shortened(tag.lines().next().unwrap_or_default(), MAX_SHOWN) + end;
    Some(source.locate(start..start + 1).error(UrdfErrorKind::Truncated { element }))
}

/// Returns the tags that are open at the end of a text, outermost first: the byte index of each
/// `<`, and the tag without its brackets.
fn open_tags(text: &str) -> Vec<(usize, &str)> {
    let mut open = Vec::new();
    let mut at = 0;
    while let Some(found) = text.get(at..).and_then(|rest| rest.find('<')) {
        let start = at + found;
        let rest = text.get(start..).unwrap_or_default();
        let end = if rest.starts_with("<!--") {
            rest.find("-->").map(|end| end + 2)
        } else {
            tag_end(rest)
        };
        let Some(end) = end else { break };
        let tag = rest.get(1..end).unwrap_or_default();
        if tag.starts_with('/') {
            open.pop();
        } else if !tag.starts_with(['!', '?']) && !tag.ends_with('/') {
            open.push((start, tag));
        }
        at = start + end + 1;
    }
    open
}

/// Returns the byte index of the `>` that ends a tag; brackets in quotes do not end it.
fn tag_end(tag: &str) -> Option<usize> {
    let mut quote = None;
    tag.char_indices().find_map(|(at, character)| match (quote, character) {
        (None, '>') => Some(at),
        (None, '"' | '\'') => {
            quote = Some(character);
            None
        }
        (Some(open), _) if open == character => {
            quote = None;
            None
        }
        _ => None,
    })
}
