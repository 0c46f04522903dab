//! Text in UTF-16, as PowerShell writes it, read as UTF-8.

use std::io::{self, BufRead, Read};

use encoding_rs::{Decoder, Encoding};

use super::lines::read_buffered;

/// Size of the buffer of decoded text \[bytes\].
const BUFFER_BYTES: usize = 1 << 15;

/// Returns the encoding of a text in UTF-16, by its byte order mark.
pub(super) fn utf16_encoding(begin: &[u8]) -> Option<&'static Encoding> {
    let (encoding, _) = Encoding::for_bom(begin)?;
    encoding.name().starts_with("UTF-16").then_some(encoding)
}

/// Decodes its input to UTF-8, without the byte order mark.
pub(super) struct Utf16Reader<R> {
    input: R,
    decoder: Decoder,
    /// Decoded bytes, and the number of those that are read.
    decoded: Vec<u8>,
    read_bytes: usize,
    has_ended: bool,
}

impl<R: BufRead> Utf16Reader<R> {
    pub(super) fn new(input: R, encoding: &'static Encoding) -> Self {
        let decoder = encoding.new_decoder_with_bom_removal();
        Self { input, decoder, decoded: Vec::new(), read_bytes: 0, has_ended: false }
    }
}

impl<R: BufRead> BufRead for Utf16Reader<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        while self.read_bytes == self.decoded.len() && !self.has_ended {
            let bytes = self.input.fill_buf()?;
            self.has_ended = bytes.is_empty();
            let mut text = String::with_capacity(BUFFER_BYTES);
            let (_, read, _) = self.decoder.decode_to_string(bytes, &mut text, self.has_ended);
            self.input.consume(read);
            (self.decoded, self.read_bytes) = (text.into_bytes(), 0);
        }
        Ok(&self.decoded[self.read_bytes..])
    }

    fn consume(&mut self, amount: usize) {
        self.read_bytes = (self.read_bytes + amount).min(self.decoded.len());
    }
}

impl<R: BufRead> Read for Utf16Reader<R> {
    fn read(&mut self, output: &mut [u8]) -> io::Result<usize> {
        read_buffered(self, output)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_in_utf16_of_either_order_is_read() {
        let text = "Zeit,q_1\r\n0.004,µ𝛕\r\n".repeat(100);
        let units = || core::iter::once(0xfeff).chain(text.encode_utf16());
        let little: Vec<u8> = units().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = units().flat_map(u16::to_be_bytes).collect();
        for bytes in [little, big] {
            let encoding = utf16_encoding(&bytes).unwrap();
            // A buffer of an odd length splits characters.
            let input = io::BufReader::with_capacity(7, bytes.as_slice());
            let mut read = String::new();
            Utf16Reader::new(input, encoding).read_to_string(&mut read).unwrap();
            assert_eq!(read, text);
        }
        assert_eq!(utf16_encoding(b"\xef\xbb\xbftime"), None);
        assert_eq!(utf16_encoding(b"time"), None);
    }
}
