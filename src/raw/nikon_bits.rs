//! The Huffman code of Nikon's compressed NEF.

use super::bits::Bits;

/// Longest code of any of the trees, bits.
const LONGEST_CODE: u32 = 11;

/// Next bits that the fast table looks at: most differences and their codes fit in.
const FAST: u32 = 13;

/// A code, its symbols' bits included.
#[derive(Debug)]
pub(crate) struct Tree {
    /// For every possible next [`FAST`] bits: the difference they begin with and its length in bits, code included; a
    /// length of 0 where it is longer.
    fast: Vec<(i16, u8)>,
    /// For every possible next [`LONGEST_CODE`] bits: which symbol they begin with.
    ///
    /// Length of the code and its symbol. The symbol's low half is the number of bits of the difference, its high half how many
    /// of those, the lowest, are left out.
    table: Vec<[u8; 2]>,
}

impl Tree {
    pub(crate) fn lossless(bits: u32) -> Self {
        match bits {
            12 => Self::new(&[0, 1, 4, 2, 3, 1, 2], &[5, 4, 6, 3, 7, 2, 8, 1, 9, 0, 10, 11, 12]),
            _ => Self::new(
                &[0, 1, 4, 2, 2, 3, 1, 2],
                &[7, 6, 8, 5, 9, 4, 10, 3, 11, 12, 2, 0, 1, 13, 14],
            ),
        }
    }

    pub(crate) fn lossy(bits: u32) -> Self {
        match bits {
            12 => Self::new(
                &[0, 1, 5, 1, 1, 1, 1, 1, 1, 2],
                &[5, 4, 3, 6, 2, 7, 1, 0, 8, 9, 11, 10, 12, 0],
            ),
            _ => Self::new(
                &[0, 1, 4, 3, 1, 1, 1, 1, 1, 2],
                &[5, 6, 4, 7, 8, 3, 9, 2, 1, 0, 10, 11, 12, 13, 14],
            ),
        }
    }

    pub(crate) fn lossy_after_split(bits: u32) -> Self {
        match bits {
            12 => Self::new(
                &[0, 1, 5, 1, 1, 1, 1, 1, 1, 2],
                &[0x39, 0x5a, 0x38, 0x27, 0x16, 5, 4, 3, 2, 1, 0, 11, 12, 12],
            ),
            _ => Self::new(
                &[0, 1, 5, 1, 1, 1, 1, 1, 1, 1, 2],
                &[8, 0x5c, 0x4b, 0x3a, 0x29, 7, 6, 5, 4, 3, 2, 1, 0, 13, 14],
            ),
        }
    }

    /// A canonical code: `counts[i]` codes of length `i + 1`, and the symbols in the order of their codes.
    fn new(counts: &[usize], symbols: &[u8]) -> Self {
        let mut table = Vec::with_capacity(1 << LONGEST_CODE);
        let lengths =
            (1..).zip(counts).flat_map(|(length, &count)| std::iter::repeat_n(length, count));
        for (length, &symbol) in lengths.zip(symbols) {
            table.extend(std::iter::repeat_n(
                [length, symbol],
                1 << (LONGEST_CODE - u32::from(length)),
            ));
        }
        table.resize(1 << LONGEST_CODE, [LONGEST_CODE as u8, 0]);
        let mut tree = Self { fast: Vec::new(), table };
        tree.fast = (0..1 << FAST).map(|bits: u32| tree.fast_entry(bits)).collect();
        tree
    }

    fn fast_entry(&self, bits: u32) -> (i16, u8) {
        let padded = (bits << (32 - FAST)).to_be_bytes();
        let mut reader = Bits::new(&padded);
        let difference = self.next_by_code(&mut reader);
        match (reader.position(), i16::try_from(difference)) {
            (length, Ok(difference)) if length <= FAST as usize => (difference, length as u8),
            _ => (0, 0),
        }
    }
}

impl Tree {
    /// The next difference.
    #[inline]
    pub(crate) fn next(&self, bits: &mut Bits) -> i32 {
        bits.fill();
        match self.fast[bits.peek(FAST) as usize] {
            (_, 0) => self.next_by_code(bits),
            (difference, length) => {
                bits.skip(length.into());
                difference.into()
            }
        }
    }

    /// The next difference, by its code and its bits.
    fn next_by_code(&self, bits: &mut Bits) -> i32 {
        bits.fill();
        let [code_length, symbol] = self.table[bits.peek(LONGEST_CODE) as usize];
        bits.skip(code_length.into());
        let (length, omitted) = (u32::from(symbol & 15), u32::from(symbol >> 4));
        if length == 0 {
            return 0;
        }
        let stored = bits.peek(length - omitted).cast_signed();
        bits.skip(length - omitted);
        // Omitted bits read as one half: 1 followed by zeros.
        let magnitude = (((stored << 1) | 1) << omitted) >> 1;
        if (magnitude >> (length - 1)) & 1 == 1 {
            magnitude
        } else {
            magnitude - (1 << length) + i32::from(omitted == 0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every tree's codes fill the space exactly, except the one with an unused last code.
    #[test]
    fn codes_are_complete() {
        let complete =
            |counts: &[u32]| counts.iter().zip(1..).map(|(c, l)| c << (11 - l)).sum::<u32>();
        assert_eq!(complete(&[0, 1, 4, 2, 3, 1, 2]), 1 << 11);
        assert_eq!(complete(&[0, 1, 4, 2, 2, 3, 1, 2]), 1 << 11);
        assert_eq!(complete(&[0, 1, 5, 1, 1, 1, 1, 1, 1, 2]), 1 << 11);
        assert_eq!(complete(&[0, 1, 4, 3, 1, 1, 1, 1, 1, 2]), 1 << 11);
        assert_eq!(complete(&[0, 1, 5, 1, 1, 1, 1, 1, 1, 1, 2]), 1 << 11);
    }

    fn check(bits: &str, tree: &Tree, expected: &[i32]) {
        let digits: Vec<u8> =
            bits.bytes().filter(|byte| *byte != b' ').map(|byte| byte - b'0').collect();
        let bytes: Vec<u8> = digits
            .chunks(8)
            .map(|eight| (0..8).fold(0, |byte, i| byte << 1 | eight.get(i).copied().unwrap_or(0)))
            .collect();
        let mut reader = Bits::new(&bytes);
        let found: Vec<i32> = expected.iter().map(|_| tree.next(&mut reader)).collect();
        assert_eq!(found, expected);
        assert!(!reader.overrun());
    }

    #[test]
    fn differences_read_as_in_the_description() {
        // 14 bits lossless: 00 is seven bits long, 010 six, 011 eight, 100 five.
        check(
            "00 1000000 | 00 0000000".replace('|', "").as_str(),
            &Tree::lossless(14),
            &[64, -127],
        );
        check("010 111111 100 00000 100 01111", &Tree::lossless(14), &[63, -31, -16]);
        // After the split, 010 is twelve bits of which seven are stored... the low five read as 10000.
        check("010 1000000 010 0000000", &Tree::lossy_after_split(14), &[2048 + 16, -4096 + 16]);
    }

    /// The fast table against the code, over pseudo-random bits (splitmix64).
    #[test]
    fn both_ways_to_read_agree() {
        let mix = |i: u64| {
            let z = i.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z ^ (z >> 27)
        };
        let bytes: Vec<u8> = (0..4000).flat_map(|i| mix(i).to_le_bytes()).collect();
        for bits in [12, 14] {
            for tree in [Tree::lossless(bits), Tree::lossy(bits), Tree::lossy_after_split(bits)] {
                let (mut fast, mut plain) = (Bits::new(&bytes), Bits::new(&bytes));
                while !fast.overrun() {
                    assert_eq!(tree.next(&mut fast), tree.next_by_code(&mut plain));
                    assert_eq!(fast.position(), plain.position());
                }
                assert!(plain.overrun());
            }
        }
    }

    #[test]
    fn the_end_is_noticed() {
        let mut reader = Bits::new(&[0b0010_0000]);
        Tree::lossless(14).next(&mut reader);
        assert!(reader.overrun());
    }
}
