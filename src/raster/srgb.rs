//! sRGB's transfer function: IEC 61966-2-1:1999, sections 4.2 and 4.3, exact and piecewise.

/// Linear light, 0..1, to the encoded value. Values below 0 are mirrored, above 1 extended.
pub fn encode(linear: f32) -> f32 {
    let magnitude = linear.abs();
    let encoded = if magnitude <= 0.003_130_8 {
        12.92 * magnitude
    } else {
        1.055 * magnitude.powf(1.0 / 2.4) - 0.055
    };
    encoded.copysign(linear)
}

/// The encoded value, 0..1, to linear light. Values below 0 are mirrored, above 1 extended.
pub fn decode(encoded: f32) -> f32 {
    let magnitude = encoded.abs();
    let linear = if magnitude <= 0.040_45 {
        magnitude / 12.92
    } else {
        ((magnitude + 0.055) / 1.055).powf(2.4)
    };
    linear.copysign(encoded)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values from the standard's own formula in float64, rounded.
    #[test]
    fn known_values() {
        for (linear, encoded) in
            [(0.0, 0.0), (0.002, 0.025_84), (0.18, 0.461_356_1), (0.5, 0.735_356_9), (1.0, 1.0)]
        {
            assert!((encode(linear) - encoded).abs() < 2e-7, "{linear}: {}", encode(linear));
            assert!((decode(encoded) - linear).abs() < 2e-7, "{encoded}: {}", decode(encoded));
        }
    }

    #[test]
    fn there_and_back_over_all_16_bits_and_beyond() {
        for i in -65_535..=131_070 {
            let encoded = i as f32 / 65_535.0;
            let back = encode(decode(encoded));
            assert!((back - encoded).abs() < 1e-6 + 1e-6 * encoded.abs(), "{encoded}: {back}");
        }
    }
}
