//! Counter-based random numbers: a value depends on its key alone, so that neither the order of evaluation nor the
//! number of threads can change a picture.

/// A key that grows by what it is combined with; every key is a stream of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key(u64);

impl Key {
    /// The key of a seed.
    pub fn new(seed: u64) -> Self {
        Self(mix(seed ^ 0x9e37_79b9_7f4a_7c15))
    }

    /// This key and one more number.
    #[inline]
    pub fn with(self, value: u64) -> Self {
        Self(mix(self.0 ^ value.wrapping_mul(0xd6e8_feb8_6659_fd93)))
    }

    /// This key and a signed number.
    #[inline]
    pub fn with_signed(self, value: i64) -> Self {
        self.with(value as u64)
    }

    /// 64 well-mixed bits.
    #[inline]
    pub fn bits(self) -> u64 {
        self.0
    }

    /// Uniform in the open interval (0, 1).
    #[inline]
    pub fn unit(self) -> f64 {
        ((self.0 >> 11) as f64 + 0.5) * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform in (-1, 1).
    #[inline]
    pub fn signed_unit(self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Standard normal, by Box and Muller's transform of the two halves of the bits (tails end at 6.7 sigma).
    #[inline]
    pub fn gaussian(self) -> f32 {
        let radius = ((self.0 >> 32) as f32 + 0.5) * (1.0 / 4_294_967_296.0);
        let angle = (self.0 as u32 as f32) * (std::f32::consts::TAU / 4_294_967_296.0);
        (-2.0 * radius.min(1.0).ln()).sqrt() * angle.cos()
    }
}

/// The finaliser of SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014).
#[inline]
fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The whole number below and what is over it. Through a cast: `floor` is a call where the processor's own instruction may
/// be missing, and this is asked some hundred times a photosite.
#[inline]
pub(crate) fn split(t: f64) -> (i64, f64) {
    let whole = t as i64;
    let below = whole - i64::from(t < whole as f64);
    (below, t - below as f64)
}

/// Smooth step with zero slope at both ends, and its derivative; `t` in 0..1.
#[inline]
pub(crate) fn smooth_step(t: f64) -> (f64, f64) {
    (t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t))
}

/// Two independent smooth noises along a line, each within -1..1, with derivatives: `[(value, slope); 2]`.
#[inline]
pub(crate) fn line_noise(key: Key, t: f64) -> [(f64, f64); 2] {
    let (cell, share) = split(t);
    let (s, ds) = smooth_step(share);
    let here = key.with_signed(cell).bits();
    let next = key.with_signed(cell + 1).bits();
    let blend = |a: u32, b: u32| {
        let scale = 2.0 / 4_294_967_295.0;
        let (a, b) = (f64::from(a) * scale - 1.0, f64::from(b) * scale - 1.0);
        (a + (b - a) * s, (b - a) * ds)
    };
    [blend(here as u32, next as u32), blend((here >> 32) as u32, (next >> 32) as u32)]
}

/// Smooth noise on a plane within -1..1, with its gradient.
#[inline]
pub(crate) fn plane_noise(key: Key, x: f64, y: f64) -> (f64, [f64; 2]) {
    let ((column, across), (row, down)) = (split(x), split(y));
    let ((sx, dx), (sy, dy)) = (smooth_step(across), smooth_step(down));
    let at = |i: i64, j: i64| key.with_signed(column + i).with_signed(row + j).signed_unit();
    let (a, b, c, d) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
    let twist = a - b - c + d;
    let value = a + (b - a) * sx + (c - a) * sy + twist * sx * sy;
    (value, [(b - a + twist * sy) * dx, (c - a + twist * sx) * dy])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaussian_has_unit_variance_and_no_mean() {
        let n = 400_000u64;
        let draws: Vec<f64> = (0..n).map(|i| f64::from(Key::new(7).with(i).gaussian())).collect();
        let mean = draws.iter().sum::<f64>() / n as f64;
        let variance = draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n as f64;
        let kurtosis =
            draws.iter().map(|x| (x - mean).powi(4)).sum::<f64>() / n as f64 / variance.powi(2);
        assert!(mean.abs() < 4.0 / (n as f64).sqrt(), "mean {mean}");
        assert!((variance - 1.0).abs() < 0.01, "variance {variance}");
        assert!((kurtosis - 3.0).abs() < 0.05, "kurtosis {kurtosis}");
    }

    #[test]
    fn whole_parts_are_floors() {
        for t in [0.0, -0.0, 0.3, 1.0, -1.0, -0.3, -2.7, 5.999, 1e9 + 0.5, -1e9 - 0.5] {
            assert_eq!(split(t), (f64::floor(t) as i64, t - f64::floor(t)), "{t}");
        }
    }

    #[test]
    fn noise_slopes_are_finite_differences() {
        let (key, step) = (Key::new(3), 1e-5);
        for i in 0..500 {
            let (x, y) = (-7.3 + 0.031 * f64::from(i), 4.1 - 0.027 * f64::from(i));
            for which in 0..2 {
                let slope = (line_noise(key, x + step)[which].0
                    - line_noise(key, x - step)[which].0)
                    / (2.0 * step);
                assert!((slope - line_noise(key, x)[which].1).abs() < 1e-4);
            }
            let slope =
                (plane_noise(key, x + step, y).0 - plane_noise(key, x - step, y).0) / (2.0 * step);
            assert!((slope - plane_noise(key, x, y).1[0]).abs() < 1e-4);
            let slope =
                (plane_noise(key, x, y + step).0 - plane_noise(key, x, y - step).0) / (2.0 * step);
            assert!((slope - plane_noise(key, x, y).1[1]).abs() < 1e-4);
        }
    }
}
