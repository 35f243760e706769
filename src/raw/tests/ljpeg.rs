//! A lossless JPEG encoder for tests: ISO/IEC 10918-1 annex H, codes of five bits.

/// Encodes `values`, `columns * components` a row, in `precision` bits.
pub(super) fn encode(
    values: &[u16],
    columns: usize,
    components: usize,
    precision: u8,
    predictor: u8,
) -> Vec<u8> {
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
    bytes.extend([predictor, 0, 0]);
    for byte in scan(values, columns * components, components, [precision, predictor]) {
        bytes.push(byte);
        if byte == 0xff {
            bytes.push(0);
        }
    }
    bytes.extend([0xff, 0xd9]);
    bytes
}

fn scan(
    values: &[u16],
    stride: usize,
    components: usize,
    [precision, predictor]: [u8; 2],
) -> Vec<u8> {
    let mut bits: Vec<u8> = Vec::new();
    for (i, &value) in values.iter().enumerate() {
        let before = |back: usize| i32::from(values[i - back]);
        let predicted = match (i % stride < components, i < stride) {
            (true, true) => 1 << (precision - 1),
            (true, false) => before(stride),
            (false, true) => before(components),
            (false, false) => {
                let (a, b, c) = (before(components), before(stride), before(stride + components));
                [a, b, c, a + b - c, a + ((b - c) >> 1), b + ((a - c) >> 1), (a + b) >> 1]
                    [usize::from(predictor) - 1]
            }
        } as u16;
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

#[test]
fn every_predictor_and_number_of_components() {
    let values: Vec<u16> = (0..24 * 9).map(|i: u32| (i * 40_503 % 65_521) as u16).collect();
    for predictor in 1..=7 {
        for components in 1..=4 {
            let bytes = encode(&values, 24 / components, components, 16, predictor);
            let found = crate::raw::ljpeg::decode(&bytes, [values.len(), 0]);
            assert_eq!(
                found.map(|jpeg| jpeg.samples).as_ref(),
                Ok(&values),
                "predictor {predictor}, {components} components"
            );
        }
    }
}

#[test]
fn a_scan_cut_short_is_an_error() {
    let values: Vec<u16> = (0..24 * 9).map(|i: u32| (i * 40_503 % 65_521) as u16).collect();
    let bytes = encode(&values, 24, 1, 16, 1);
    for length in 0..bytes.len() - 3 {
        assert!(
            crate::raw::ljpeg::decode(&bytes[..length], [values.len(), 0]).is_err(),
            "{length}"
        );
    }
}
