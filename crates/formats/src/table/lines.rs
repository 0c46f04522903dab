//! Maximum length of a line, so that a file without line breaks does not fill the memory.

use std::io::{self, BufRead, Read};

/// Largest length of a line \[bytes\]. Convention: a thousand columns of a thousand bytes.
pub(super) const LONGEST_LINE: usize = 1 << 20;

/// Largest number of bytes read for a record: a line, and what is read ahead of it.
const LONGEST_RECORD: usize = 2 * LONGEST_LINE;

/// Error of a line beyond [`LONGEST_LINE`].
#[derive(Debug, thiserror::Error)]
#[error("line {line} is longer than {LONGEST_LINE} bytes")]
pub(super) struct LongLine {
    /// Number of the line, from 1.
    pub(super) line: u64,
}

/// An input that ends with [`LongLine`] at such a line, and at a record that is longer: an opening
/// quote without a closing one makes the rest of the file one record.
pub(super) struct LimitedLines {
    input: Box<dyn BufRead>,
    line: u64,
    line_bytes: usize,
    record_bytes: usize,
}

impl LimitedLines {
    pub(super) fn new(input: Box<dyn BufRead>) -> Self {
        Self { input, line: 1, line_bytes: 0, record_bytes: 0 }
    }

    /// Starts a record.
    pub(super) fn begin_record(&mut self) {
        self.record_bytes = 0;
    }
}

impl BufRead for LimitedLines {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.line_bytes > LONGEST_LINE || self.record_bytes > LONGEST_RECORD {
            return Err(io::Error::new(io::ErrorKind::InvalidData, LongLine { line: self.line }));
        }
        self.input.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        // The buffer is that of the last `fill_buf`; a file that fails there fails again.
        let read = self.input.fill_buf().map(|buffer| &buffer[..amount.min(buffer.len())]);
        for byte in read.unwrap_or_default() {
            self.line_bytes += 1;
            self.record_bytes += 1;
            if *byte == b'\n' {
                (self.line, self.line_bytes) = (self.line + 1, 0);
            }
        }
        self.input.consume(amount);
    }
}

impl Read for LimitedLines {
    fn read(&mut self, output: &mut [u8]) -> io::Result<usize> {
        read_buffered(self, output)
    }
}

/// Reads from the buffer of an input: [`Read::read`] of an input that implements [`BufRead`].
pub(super) fn read_buffered(input: &mut impl BufRead, output: &mut [u8]) -> io::Result<usize> {
    let buffer = input.fill_buf()?;
    let count = buffer.len().min(output.len());
    output[..count].copy_from_slice(&buffer[..count]);
    input.consume(count);
    Ok(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_without_an_end_is_refused_with_its_number() {
        let text = [b"a\n".as_slice(), &vec![b'0'; 3 * LONGEST_LINE]].concat();
        let limited = || {
            let file = io::BufReader::new(io::Cursor::new(text.clone()));
            LimitedLines::new(Box::new(file))
        };
        let error = io::copy(&mut limited(), &mut io::sink()).unwrap_err();
        let long = error.get_ref().and_then(|error| error.downcast_ref::<LongLine>());
        assert_eq!(long.map(|long| long.line), Some(2));
        let mut line = Vec::new();
        let mut input = limited();
        assert_eq!(input.read_until(b'\n', &mut line).unwrap(), 2);
        assert!(input.read_until(b'\n', &mut line).is_err());
        assert!(line.len() <= 2 * LONGEST_LINE);
    }
}
