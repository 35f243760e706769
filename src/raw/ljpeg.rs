//! Lossless JPEG, as DNG uses it: ISO/IEC 10918-1 (ITU-T T.81), annex H.

use super::DecodeError;
use super::bits::Bits;

/// Longest code, bits.
const LONGEST_CODE: u32 = 16;

/// Decodes a lossless JPEG of one of the `counts` of samples (a whole tile, or what the picture needs of it), components
/// interleaved, row by row.
///
/// # Errors
/// Anything else than one scan of so many samples of up to 16 bits, neither subsampled nor restarted.
pub(crate) fn decode(bytes: &[u8], counts: [usize; 2]) -> Result<Jpeg, DecodeError> {
    let damaged = || DecodeError::damaged("a tile's lossless JPEG data does not unpack");
    let (header, scan) = Header::parse(bytes).ok_or_else(damaged)?;
    let found = header.columns * header.rows * header.components.len();
    // Every sample takes a bit or more.
    if !counts.contains(&found) || found > scan.len().saturating_mul(8) {
        return Err(DecodeError::damaged(format!(
            "a tile's JPEG data holds {found} of {} samples",
            counts[0]
        )));
    }
    let scan = without_stuffing(scan);
    let samples = header.decode(&scan).ok_or_else(damaged)?;
    let Header { rows, columns, .. } = header;
    Ok(Jpeg { rows, columns, components: header.components.len(), samples })
}

/// A decoded lossless JPEG.
#[derive(Debug)]
pub(crate) struct Jpeg {
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    pub(crate) components: usize,
    /// Row by row, components interleaved.
    pub(crate) samples: Vec<u16>,
}

/// What the markers say.
struct Header {
    rows: usize,
    columns: usize,
    precision: u32,
    /// The code of each component.
    components: Vec<Code>,
    predictor: u8,
}

/// A Huffman code: for every possible next [`LONGEST_CODE`] bits, the length of the code and its symbol.
type Code = Vec<(u8, u8)>;

impl Header {
    /// The header and the scan behind it; `None` for what T.81 does not allow or DNG does not use.
    fn parse(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let mut rest = bytes.strip_prefix(&[0xff, 0xd8])?;
        let mut codes: [Option<Code>; 4] = [const { None }; 4];
        let mut frame = None;
        loop {
            let &[0xff, marker, high, low, ..] = rest else { return None };
            let length = usize::from(u16::from_be_bytes([high, low]));
            let (segment, after) = (rest.get(4..2 + length)?, rest.get(2 + length..)?);
            match marker {
                0xc3 => frame = Some(segment),
                0xc4 => parse_codes(segment, &mut codes)?,
                0xda => return Some((Self::from_segments(frame?, segment, &codes)?, after)),
                // Restart intervals and other kinds of frame.
                0xdd | 0xc0..=0xcf => return None,
                _ => {}
            }
            rest = after;
        }
    }

    fn from_segments(frame: &[u8], scan: &[u8], codes: &[Option<Code>; 4]) -> Option<Self> {
        let (&[precision, r1, r0, c1, c0, count], described) = frame.split_first_chunk()?;
        let (&[scanned], selected) = scan.split_first_chunk()?;
        let count = usize::from(count);
        let sampled_fully = described.chunks(3).all(|component| component.get(1) == Some(&0x11));
        let (selected, tail) = selected.split_at_checked(2 * count)?;
        let &[predictor, _, transform] = tail else { return None };
        let sound = (1..=4).contains(&count)
            && usize::from(scanned) == count
            && described.len() == 3 * count
            && sampled_fully
            && (2..=16).contains(&precision)
            && (1..=7).contains(&predictor)
            && transform == 0;
        let code = |pair: &[u8]| codes.get(usize::from(pair[1] >> 4))?.clone();
        sound.then_some(Self {
            rows: u16::from_be_bytes([r1, r0]).into(),
            columns: u16::from_be_bytes([c1, c0]).into(),
            precision: precision.into(),
            components: selected.chunks(2).map(code).collect::<Option<_>>()?,
            predictor,
        })
    }

    /// The samples; `None` where the scan ends early.
    fn decode(&self, scan: &[u8]) -> Option<Vec<u16>> {
        let count = self.components.len();
        let stride = self.columns * count;
        let mut bits = Bits::new(scan);
        let mut samples: Vec<u16> = Vec::with_capacity(stride * self.rows);
        for y in 0..self.rows {
            for x in 0..stride {
                let i = samples.len();
                let predicted = match (x < count, y) {
                    (true, 0) => 1 << (self.precision - 1),
                    (true, _) => samples[i - stride],
                    (false, 0) => samples[i - count],
                    (false, _) => self.predict(
                        samples[i - count].into(),
                        samples[i - stride].into(),
                        samples[i - stride - count].into(),
                    ),
                };
                let difference = next_difference(&mut bits, &self.components[x % count])?;
                samples.push(predicted.wrapping_add(difference));
            }
            if bits.overrun() {
                return None;
            }
        }
        Some(samples)
    }

    /// T.81, table H.1: from the left, the upper and the upper left neighbour.
    fn predict(&self, left: i32, above: i32, corner: i32) -> u16 {
        let predicted = match self.predictor {
            1 => left,
            2 => above,
            3 => corner,
            4 => left + above - corner,
            5 => left + ((above - corner) >> 1),
            6 => above + ((left - corner) >> 1),
            _ => (left + above) >> 1,
        };
        predicted as u16
    }
}

/// T.81, annex C: codes of growing length, counted upwards.
fn parse_codes(mut segment: &[u8], codes: &mut [Option<Code>; 4]) -> Option<()> {
    while let Some((&kind, rest)) = segment.split_first() {
        let (counts, rest) = rest.split_first_chunk::<16>()?;
        let all = counts.iter().map(|&count| usize::from(count)).sum();
        let (symbols, rest) = rest.split_at_checked(all)?;
        let lengths = (1_u8..)
            .zip(counts)
            .flat_map(|(length, &count)| std::iter::repeat_n(length, count.into()));
        let mut code = Vec::with_capacity(1 << LONGEST_CODE);
        for (length, &symbol) in lengths.zip(symbols) {
            code.extend(std::iter::repeat_n(
                (length, symbol),
                1 << (LONGEST_CODE - u32::from(length)),
            ));
        }
        if code.len() > 1 << LONGEST_CODE || symbols.iter().any(|&symbol| symbol > 16) {
            return None;
        }
        // What no code begins with has length 0.
        code.resize(1 << LONGEST_CODE, (0, 0));
        *codes.get_mut(usize::from(kind))? = Some(code);
        segment = rest;
    }
    Some(())
}

/// T.81, H.1.2.2, modulo 2^16. `None` for bits that no code begins with.
fn next_difference(bits: &mut Bits, code: &Code) -> Option<u16> {
    bits.fill();
    let (length, category) = code[bits.peek(LONGEST_CODE) as usize];
    if length == 0 {
        return None;
    }
    bits.skip(length.into());
    match category {
        0 => Some(0),
        16 => Some(0x8000),
        _ => {
            let value = bits.peek(category.into());
            bits.skip(category.into());
            let negative = value < 1 << (category - 1);
            let offset = if negative { (1_u32 << category) - 1 } else { 0 };
            Some((value as u16).wrapping_sub(offset as u16))
        }
    }
}

/// The scan up to the next marker, without the zero that follows every 0xff in it.
fn without_stuffing(scan: &[u8]) -> Vec<u8> {
    let mut plain = Vec::with_capacity(scan.len());
    let mut rest = scan;
    while let Some(at) = rest.iter().position(|&byte| byte == 0xff) {
        if rest.get(at + 1) != Some(&0) {
            rest = &rest[..at];
            break;
        }
        plain.extend_from_slice(&rest[..=at]);
        rest = &rest[at + 2..];
    }
    plain.extend_from_slice(rest);
    plain
}
