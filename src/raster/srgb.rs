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

/// [`encode`] to 16 bits for whole pictures: a table, straight in between. Within one step of the exact value rounded.
///
/// Nodes stand 256 to the octave, so the error of the straight line is at most 0.25 / 8 / 256^2 of the value, 0.03 steps.
#[derive(Clone, Debug)]
pub struct Encode16 {
    /// Encoded values, full scale 65535, at the nodes from [`FIRST_NODE`] on.
    nodes: Vec<f32>,
}

/// Bits of 2^-12, below which the curve is straight (it is, up to 0.0031308), without the lower part of the mantissa.
const FIRST_NODE: u32 = (127 - 12) << 8;

/// Bits of a float's mantissa that say where between two nodes it lies.
const BETWEEN: u32 = 15;

impl Default for Encode16 {
    fn default() -> Self {
        let node = |i: u32| 65_535.0 * encode(f32::from_bits(i << BETWEEN));
        Self { nodes: (FIRST_NODE..=(127 << 8) + 1).map(node).collect() }
    }
}

impl Encode16 {
    /// Linear light to the encoded value, 65535 for 1; beyond 0..1 it is clamped, and not-a-number is 0.
    #[inline]
    pub fn encode(&self, linear: f32) -> u16 {
        let bits = linear.clamp(0.0, 1.0).to_bits();
        let value = match (bits >> BETWEEN).checked_sub(FIRST_NODE) {
            Some(node) if !linear.is_nan() => {
                let share = (bits & ((1 << BETWEEN) - 1)) as f32 / (1 << BETWEEN) as f32;
                let [low, high] = [self.nodes[node as usize], self.nodes[node as usize + 1]];
                low + share * (high - low)
            }
            _ => 65_535.0 * 12.92 * linear.max(0.0),
        };
        (value + 0.5) as u16
    }
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

    /// Every float from 0 to 1 that ends in ten zero bits, and what lies beyond.
    #[test]
    fn the_table_equals_the_formula() {
        let table = Encode16::default();
        for bits in (0..=1_f32.to_bits()).step_by(1 << 10) {
            let linear = f32::from_bits(bits);
            let exact = 65_535.0 * encode(linear);
            let found = f32::from(table.encode(linear));
            assert!((found - exact).abs() < 0.55, "{linear}: {found}, not {exact}");
        }
        let beyond = [-1.0, -f32::INFINITY, f32::NAN, 1.5, f32::INFINITY];
        assert_eq!(beyond.map(|linear| table.encode(linear)), [0, 0, 0, 65_535, 65_535]);
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
