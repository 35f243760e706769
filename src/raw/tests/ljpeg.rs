//! A lossless JPEG encoder for tests: ISO/IEC 10918-1 annex H, predictor 1, codes of five bits.

/// Encodes `values`, `columns * components` a row, in `precision` bits.
pub(super) fn encode(values: &[u16], columns: usize, components: usize, precision: u8) -> Vec<u8> {
    let rows = values.len() / (columns * components);
    let mut bytes = vec![0xff, 0xd8, 0xff, 0xc4, 0, 36, 0];
    // Seventeen codes of five bits, for differences of 0 to 16 bits.
    bytes.extend((1..=16).map(|length| if length == 5 { 17 } else { 0 }));
    bytes.extend(0..=16);
    let count = components as u8;
    bytes.extend([0xff, 0xc3, 0, 8 + 3 * count, precision]);
    bytes.extend((rows as u16).to_be_bytes());
    bytes.extend((columns as u16).to_be_bytes());
    bytes.push(count);
    (0..count).for_each(|component| bytes.extend([component, 0x11, 0]));
    bytes.extend([0xff, 0xda, 0, 6 + 2 * count, count]);
    (0..count).for_each(|component| bytes.extend([component, 0]));
    bytes.extend([1, 0, 0]);
    for byte in scan(values, columns * components, components, precision) {
        bytes.push(byte);
        if byte == 0xff {
            bytes.push(0);
        }
    }
    bytes.extend([0xff, 0xd9]);
    bytes
}

fn scan(values: &[u16], stride: usize, components: usize, precision: u8) -> Vec<u8> {
    let mut bits: Vec<u8> = Vec::new();
    for (i, &value) in values.iter().enumerate() {
        let predicted = match (i % stride < components, i < stride) {
            (true, true) => 1 << (precision - 1),
            (true, false) => values[i - stride],
            (false, _) => values[i - components],
        };
        let difference = i32::from(value.wrapping_sub(predicted).cast_signed());
        let length = 32 - difference.unsigned_abs().leading_zeros();
        bits.extend((0..5).rev().map(|k| (length >> k & 1) as u8));
        // 16 bits stand for 32768 alone and need no more.
        let stored = if difference < 0 { difference - 1 } else { difference };
        let shown = if length == 16 { 0 } else { length };
        bits.extend((0..shown).rev().map(|k| (stored >> k & 1) as u8));
    }
    bits.resize(bits.len().next_multiple_of(8), 1);
    bits.chunks(8).map(|eight| eight.iter().fold(0, |byte, bit| byte << 1 | bit)).collect()
}
