//! Little-endian fields of a record. Every length in a record is checked before use.

/// Remaining bytes of a record.
#[derive(Clone, Copy, Debug)]
pub(super) struct ByteReader<'a>(pub(super) &'a [u8]);

impl<'a> ByteReader<'a> {
    pub(super) fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(taken)
    }

    fn take_array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    pub(super) fn take_u8(&mut self) -> Option<u8> {
        self.take_array::<1>().map(|[byte]| byte)
    }

    pub(super) fn take_u16(&mut self) -> Option<u16> {
        self.take_array().map(u16::from_le_bytes)
    }

    pub(super) fn take_u32(&mut self) -> Option<u32> {
        self.take_array().map(u32::from_le_bytes)
    }

    pub(super) fn take_u64(&mut self) -> Option<u64> {
        self.take_array().map(u64::from_le_bytes)
    }

    /// Returns a block of bytes whose length precedes it in 32 bits.
    pub(super) fn take_block(&mut self) -> Option<&'a [u8]> {
        let length = usize::try_from(self.take_u32()?).ok()?;
        self.take(length)
    }

    pub(super) fn take_text(&mut self) -> Option<&'a str> {
        core::str::from_utf8(self.take_block()?).ok()
    }
}

/// Fields of a chunk before its records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ChunkHead<'a> {
    pub(super) start: u64,
    pub(super) end: u64,
    /// Size of the records without compression \[bytes\].
    pub(super) uncompressed: u64,
    pub(super) crc: u32,
    pub(super) compression: &'a str,
    /// Size of the records that follow \[bytes\].
    pub(super) length: u64,
}

impl<'a> ChunkHead<'a> {
    /// Reads the head; the bytes after it remain in `bytes`.
    pub(super) fn read(bytes: &mut ByteReader<'a>) -> Option<Self> {
        let (start, end) = (bytes.take_u64()?, bytes.take_u64()?);
        let uncompressed = bytes.take_u64()?;
        let crc = bytes.take_u32()?;
        let compression = bytes.take_text()?;
        let length = bytes.take_u64()?;
        let fits = !compression.is_empty() || uncompressed == length;
        fits.then_some(Self { start, end, uncompressed, crc, compression, length })
    }
}
