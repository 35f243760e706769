//! Logarithm and exponential that a compiler can turn into vector instructions.

/// Natural logarithm of a positive, finite, normal number; relative error below 2e-7, absolute below 1e-7 near 1.
#[inline(always)]
pub(super) fn ln(x: f32) -> f32 {
    // Mantissa between sqrt(1/2) and sqrt(2), so that the series is short.
    let bits = x.to_bits().wrapping_sub(0x3f35_04f3) as i32;
    let exponent = (bits >> 23) as f32;
    let mantissa = f32::from_bits(((bits & 0x007f_ffff) as u32).wrapping_add(0x3f35_04f3));
    let f = mantissa - 1.0;
    let mut series = 7.037_683_6e-2;
    for c in [
        -1.151_461e-1,
        1.167_699_9e-1,
        -1.242_014_1e-1,
        1.424_932_3e-1,
        -1.666_805_8e-1,
        2.000_071_5e-1,
        -2.499_999_4e-1,
        3.333_333e-1,
    ] {
        series = series * f + c;
    }
    let squared = f * f;
    let tail = series * f * squared - 0.5 * squared - 2.121_944_4e-4 * exponent;
    f + tail + 0.693_359_4 * exponent
}

/// Exponential of a number between -80 and 80; beyond, of the limit. Relative error below 3e-7.
#[inline(always)]
pub(super) fn exp(x: f32) -> f32 {
    // Adding and subtracting 1.5 x 2^23 rounds to a whole number, which is then in the low bits.
    const ROUND: f32 = 12_582_912.0;
    let x = x.clamp(-80.0, 80.0);
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let whole = shifted - ROUND;
    let r = x - whole * 0.693_359_4 + whole * 2.121_944_4e-4;
    let mut series = 1.987_569_1e-4;
    for c in [1.398_2e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 0.5] {
        series = series * r + c;
    }
    let power = shifted.to_bits().wrapping_sub(ROUND.to_bits()).wrapping_add(127) << 23;
    (series * r * r + r + 1.0) * f32::from_bits(power)
}

/// 0 below `low`, 1 above `high`, smooth between.
#[inline(always)]
pub(super) fn smoothstep(value: f32, low: f32, high: f32) -> f32 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The value below which `share` of them lie, between neighbours; sorts a part of `values`. `None` of nothing.
pub(super) fn quantile(values: &mut [f32], share: f64) -> Option<f32> {
    if values.is_empty() {
        return None;
    }
    let place = share * (values.len() - 1) as f64;
    let below = place.floor() as usize;
    let (_, &mut low, above) = values.select_nth_unstable_by(below, f32::total_cmp);
    let high = above.iter().copied().min_by(f32::total_cmp).unwrap_or(low);
    Some(low + (high - low) * (place - below as f64) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithm_and_exponential_agree_with_float64() {
        for k in 0..200_000 {
            let x = 1e-4 * 1.000_07_f64.powi(k) as f32;
            let exact = f64::from(x).ln();
            let off = (f64::from(ln(x)) - exact).abs();
            assert!(off < 1.5e-7 * exact.abs().max(1.0), "ln {x}: off by {off}");
            let y = -20.0 + 2e-4 * k as f32;
            let exact = f64::from(y).exp();
            assert!((f64::from(exp(y)) / exact - 1.0).abs() < 3e-7, "exp {y}");
        }
        assert!(exp(-1e9) > 0.0 && exp(1e9).is_finite());
    }

    #[test]
    fn quantiles_lie_between_neighbours() {
        let mut values = [4.0, 1.0, 3.0, 2.0];
        assert_eq!(quantile(&mut values, 0.5), Some(2.5));
        assert_eq!(quantile(&mut values, 0.0), Some(1.0));
        assert_eq!(quantile(&mut values, 1.0), Some(4.0));
        assert_eq!(quantile(&mut [], 0.5), None);
    }
}
