//! Mutations of a text.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Pieces with a meaning to some reader.
const PIECES: [&[u8]; 24] = [
    b"\0",
    b"\xff",
    b"\"",
    b"'",
    b",",
    b"\n",
    b"\r\n",
    b"[",
    b"]",
    b"{",
    b"}",
    b"=",
    b"nan",
    b"-",
    b"*",
    b".",
    b"1e999",
    b"#",
    b"\xef\xbb\xbf",
    b"\x1b[31m",
    b"\xe2\x80\xae",
    b"\xc2\x9b",
    b"`](<",
    b"true",
];

/// Numbers that are likely to cause failures.
const NUMBERS: [&str; 22] = [
    "0", "-0.0", "1", "-1", "2", "3", "0.5", "1e-9", "-1e-9", "1e-160", "1e-308", "1e9", "-1e9",
    "1e20", "1e77", "1e150", "-1e150", "1e151", "90", "180", "-180", "360",
];

/// Mutates a text in one to three places.
pub fn mutated(text: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut text = text.to_vec();
    for _ in 0..random.random_range(1..4) {
        text = match random.random_range(0..10) {
            0..5 => with_another_number(&text, random),
            5..7 => with_other_lines(&text, random),
            _ => with_other_bytes(text, random),
        };
    }
    text
}

/// Replaces one of the numbers.
fn with_another_number(text: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let is_part = |byte: &u8| byte.is_ascii_digit() || b".-+eE".contains(byte);
    let mut numbers = Vec::new();
    let mut begin = None;
    for (place, byte) in text.iter().chain(b" ").enumerate() {
        match begin {
            None if byte.is_ascii_digit() || *byte == b'-' => begin = Some(place),
            Some(first) if !is_part(byte) => {
                numbers.push((first, place.min(text.len())));
                begin = None;
            }
            _ => {}
        }
    }
    if numbers.is_empty() {
        return text.to_vec();
    }
    let (first, end) = numbers[random.random_range(0..numbers.len())];
    let other = NUMBERS[random.random_range(0..NUMBERS.len())].as_bytes();
    [&text[..first], other, &text[end..]].concat()
}

/// Removes, duplicates or moves a line.
fn with_other_lines(text: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut lines: Vec<&[u8]> = text.split_inclusive(|byte| *byte == b'\n').collect();
    if lines.len() < 2 {
        return text.to_vec();
    }
    let (one, other) = (random.random_range(0..lines.len()), random.random_range(0..lines.len()));
    match random.random_range(0..3) {
        0 => _ = lines.remove(one),
        1 => lines.insert(other, lines[one]),
        _ => lines.swap(one, other),
    }
    lines.concat()
}

/// Truncates the text, or inserts, removes or duplicates a piece.
fn with_other_bytes(mut text: Vec<u8>, random: &mut ChaCha8Rng) -> Vec<u8> {
    let place = random.random_range(0..=text.len());
    let end = (place + random.random_range(0..40)).min(text.len());
    match random.random_range(0..8) {
        0 => text.truncate(place),
        1..4 => {
            let piece = PIECES[random.random_range(0..PIECES.len())];
            text.splice(place..place, piece.iter().copied());
        }
        4..6 => _ = text.drain(place..end),
        _ => {
            let piece = text[place..end].to_vec();
            text.splice(place..place, piece);
        }
    }
    text
}
