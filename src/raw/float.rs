//! Floating-point samples of DNG: 16, 24 and 32 bits, plain or deflated.
//!
//! Adobe, "Digital Negative specification 1.7", 2023, "Floating point image data"; Adobe, "TIFF technical note 3", 2005, for
//! the predictor.

use super::DecodeError;
use super::error::CONVERT_TO_DNG;
use super::tags::{Order, Tiff};
use super::unpack::Storage;

/// Predictors: none, and differences of bytes to the same byte of the sample one, two or four columns before.
const NONE: u32 = 1;
const FLOAT: u32 = 3;
const FLOAT_X2: u32 = 34_894;
const FLOAT_X4: u32 = 34_895;

/// `width * height * samples_per_pixel` samples, row by row.
///
/// # Errors
/// A storage that is none of these, or too few bytes in a strip or tile.
pub(crate) fn unpack(storage: &Storage, tiff: &Tiff) -> Result<Vec<f32>, DecodeError> {
    let Storage { bits, compression, predictor, .. } = *storage;
    let known = matches!(bits, 16 | 24 | 32)
        && matches!(
            (compression, predictor),
            (1, NONE) | (8 | 32_946, NONE | FLOAT | FLOAT_X2 | FLOAT_X4)
        );
    if !known {
        let what = format!(
            "a floating-point DNG of {bits} bits with compression {compression}, predictor {predictor}"
        );
        return Err(DecodeError::unsupported(what, CONVERT_TO_DNG));
    }
    let mut samples = vec![0.0; storage.width * storage.height * storage.samples_per_pixel];
    let distance = match predictor {
        FLOAT_X2 => 2,
        FLOAT_X4 => 4,
        _ => 1,
    } * storage.samples_per_pixel;
    let bytes = bits as usize / 8;
    storage.each_row(tiff, &mut samples, |packed, row| {
        if predictor == NONE {
            for (sample, stored) in row.iter_mut().zip(packed.chunks_exact(bytes)) {
                *sample = number(stored, tiff.block.order);
            }
            return;
        }
        let mut plain = packed.to_vec();
        for i in distance..plain.len() {
            plain[i] = plain[i].wrapping_add(plain[i - distance]);
        }
        // The most significant bytes of all samples stand first, then the next ones.
        for (i, sample) in row.iter_mut().enumerate() {
            let mut stored = [0; 4];
            (0..bytes).for_each(|k| stored[k] = plain[k * (plain.len() / bytes) + i]);
            *sample = number(&stored[..bytes], Order::Big);
        }
    })?;
    Ok(samples)
}

/// IEEE 754 of 16 or 32 bits, or DNG's of 24: one sign, 7 bits of exponent, 16 of mantissa.
fn number(stored: &[u8], order: Order) -> f32 {
    let shift = |bits: u32, &byte: &u8| bits << 8 | u32::from(byte);
    let bits = match order {
        Order::Big => stored.iter().fold(0, shift),
        Order::Little => stored.iter().rev().fold(0, shift),
    };
    match stored.len() {
        2 => narrow(bits, 5, 10),
        3 => narrow(bits, 7, 16),
        _ => f32::from_bits(bits),
    }
}

/// A short floating-point number of so many bits of exponent and mantissa; exact in f32.
fn narrow(bits: u32, exponent_bits: u32, mantissa_bits: u32) -> f32 {
    let largest = (1 << exponent_bits) - 1;
    let exponent = bits >> mantissa_bits & largest;
    let mantissa = bits & ((1 << mantissa_bits) - 1);
    let bias = (largest >> 1) as i32;
    let fraction = f64::from(mantissa) / f64::from(1_u32 << mantissa_bits);
    let magnitude = match exponent {
        0 => fraction * f64::from(1 - bias).exp2(),
        _ if exponent == largest => {
            if mantissa == 0 {
                f64::INFINITY
            } else {
                f64::NAN
            }
        }
        _ => (1.0 + fraction) * f64::from(exponent as i32 - bias).exp2(),
    };
    let negative = bits >> (exponent_bits + mantissa_bits) & 1 == 1;
    (if negative { -magnitude } else { magnitude }) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_numbers_are_those_of_their_formats() {
        let half = |bits: u16| number(&bits.to_le_bytes(), Order::Little);
        assert_eq!([half(0x3c00), half(0xc000), half(0x0001)], [1.0, -2.0, 2.0_f32.powi(-24)]);
        assert_eq!([half(0x7bff), half(0x3555)], [65504.0, 0.333_251_95]);
        assert!(half(0x7e00).is_nan() && half(0x7c00) == f32::INFINITY);
        let of_24 = |bits: u32| number(&bits.to_be_bytes()[1..], Order::Big);
        assert_eq!([of_24(0x3f_0000), of_24(0x3e_8000), of_24(0xc0_0000)], [1.0, 0.75, -2.0]);
        assert_eq!(number(&1.25_f32.to_be_bytes(), Order::Big), 1.25);
    }
}
