//! Line ends made alike, so that lines can be counted.

use std::io::{BufRead, Read, Result};

/// Passes text on with every CRLF or CR as LF, and with an LF at the end.
pub(super) struct Lines<R> {
    inner: R,
    last: u8,
}

impl<R: BufRead> Lines<R> {
    pub fn new(inner: R) -> Self {
        Self { inner, last: b'\n' }
    }
}

impl<R: BufRead> Read for Lines<R> {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        let mut written = 0;
        while written == 0 && !out.is_empty() {
            let input = self.inner.fill_buf()?;
            if input.is_empty() {
                if self.last == b'\n' || self.last == b'\r' {
                    return Ok(0);
                }
                self.last = b'\n';
                out[0] = b'\n';
                return Ok(1);
            }
            let mut read = 0;
            for &byte in input {
                if written == out.len() {
                    break;
                }
                read += 1;
                let second_half = byte == b'\n' && self.last == b'\r';
                self.last = byte;
                if !second_half {
                    out[written] = if byte == b'\r' { b'\n' } else { byte };
                    written += 1;
                }
            }
            self.inner.consume(read);
        }
        Ok(written)
    }
}
