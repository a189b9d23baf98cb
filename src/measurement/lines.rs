//! Line ends made alike, so that lines can be counted.

use std::io::{BufRead, Error, ErrorKind, Read, Result};

/// Longest record of a table [KiB].
pub(super) const RECORD_KIB: u64 = 1024;

/// Passes text on with every CRLF or CR as LF, and with an LF at the end; refuses to go on within a
/// record that is too long.
pub(super) struct Lines<R> {
    inner: R,
    last: u8,
    /// Bytes of the record so far, with what is read ahead.
    of_record: u64,
}

impl<R: BufRead> Lines<R> {
    pub fn new(inner: R) -> Self {
        Self { inner, last: b'\n', of_record: 0 }
    }

    /// Says that a record begins.
    pub fn start_record(&mut self) {
        self.of_record = 0;
    }
}

impl<R: BufRead> Read for Lines<R> {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        if self.of_record > RECORD_KIB << 10 {
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
        self.of_record += written as u64;
        Ok(written)
    }
}
