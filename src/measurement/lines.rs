//! Normalisation of line ends, so that lines can be counted.

use std::io::{BufRead, Error, ErrorKind, Read, Result};

/// Maximum size of a record \[KiB\].
pub(super) const MAX_RECORD_KIB: u64 = 1024;

/// Reader that converts CRLF and CR to LF and adds a final LF. It refuses records that are too
/// long.
pub(super) struct Lines<R> {
    inner: R,
    /// Last byte that was read.
    last: u8,
    /// Bytes of the current record, including read-ahead.
    record_bytes: u64,
    /// True if the text ended without a line end, so that one was added.
    pub has_added_line_end: bool,
}

impl<R: BufRead> Lines<R> {
    pub fn new(inner: R) -> Self {
        Self { inner, last: b'\n', record_bytes: 0, has_added_line_end: false }
    }

    /// Marks the start of a record, from which its length is counted.
    pub fn start_record(&mut self) {
        self.record_bytes = 0;
    }
}

impl<R: BufRead> Read for Lines<R> {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        if self.record_bytes > MAX_RECORD_KIB << 10 {
            return Err(Error::from(ErrorKind::FileTooLarge));
        }
        let mut written = 0;
        while written == 0 && !out.is_empty() {
            let input = self.inner.fill_buf()?;
            if input.is_empty() {
                if self.last == b'\n' || self.last == b'\r' {
                    return Ok(0);
                }
                self.last = b'\n';
                self.has_added_line_end = true;
                out.iter_mut().take(1).for_each(|first| *first = b'\n');
                return Ok(1);
            }
            let mut read = 0;
            for (&byte, place) in input.iter().zip(0..) {
                let second_half = byte == b'\n' && self.last == b'\r';
                if !second_half {
                    let Some(place) = out.get_mut(written) else { break };
                    *place = if byte == b'\r' { b'\n' } else { byte };
                    written += 1;
                }
                self.last = byte;
                read = place + 1;
            }
            self.inner.consume(read);
        }
        self.record_bytes += written as u64;
        Ok(written)
    }
}
