/// Reads bits, most significant first; zeros follow the end.
#[derive(Debug)]
pub(crate) struct Bits<'a> {
    bytes: &'a [u8],
    /// Next byte to load; counts on beyond the end.
    next: usize,
    /// Loaded bits, from the top.
    buffer: u64,
    /// How many of them are loaded.
    held: u32,
}

impl<'a> Bits<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, next: 0, buffer: 0, held: 0 }
    }

    /// True when bits beyond the end have been used.
    pub(crate) fn overrun(&self) -> bool {
        self.next * 8 > self.bytes.len() * 8 + self.held as usize
    }

    /// At least 32 bits are held afterwards.
    #[inline]
    pub(crate) fn fill(&mut self) {
        if self.held >= 32 {
            return;
        }
        match self.bytes.get(self.next..).and_then(<[u8]>::first_chunk) {
            Some(&eight) => {
                self.buffer |= u64::from_be_bytes(eight) >> self.held;
                self.next += (63 - self.held as usize) / 8;
                self.held |= 56;
            }
            None => self.fill_near_end(),
        }
    }

    #[cold]
    fn fill_near_end(&mut self) {
        while self.held <= 56 {
            let byte = self.bytes.get(self.next).copied().unwrap_or(0);
            self.buffer |= u64::from(byte) << (56 - self.held);
            self.next += 1;
            self.held += 8;
        }
    }

    /// The next `count` bits, 0 to 32.
    #[inline]
    pub(crate) fn peek(&self, count: u32) -> u32 {
        // Twice shifted: `count` may be 0, and no shift may reach 64.
        ((self.buffer >> 1) >> (63 - count)) as u32
    }

    /// Passes over bits that are held.
    #[inline]
    pub(crate) fn skip(&mut self, count: u32) {
        self.buffer <<= count;
        self.held -= count;
    }

    /// Bits passed over so far.
    pub(crate) fn position(&self) -> usize {
        self.next * 8 - self.held as usize
    }
}
