//! From the sensor's numbers to what the kernels read, one row at a time.

use multiversion::multiversion;

/// How a row's two colour filters are normalised; entry 0 is for even columns, 1 for odd ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normalisation {
    /// Raw numbers without light (with the ambient frame's share, if it is uniform).
    pub black: [f32; 2],
    /// y per raw number above black: 1 / (range x exposure x ISO / 100 x the light's intensity).
    pub scale: [f32; 2],
    /// Raw numbers from here on are clipped.
    pub saturation: [u16; 2],
}

/// y = (raw - black) x scale, NaN where the sample clips. `raw` and `y` start at an even column of the mosaic and share
/// their length; what is longer in either is left alone.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub fn normalise_row(raw: &[u16], with: &Normalisation, y: &mut [f32]) {
    let [black, scale] = [with.black, with.scale].map(|of| std::array::from_fn(|k| of[k & 1]));
    let saturation: [u16; STRIDE] = std::array::from_fn(|k| with.saturation[k & 1]);
    let one = |raw: u16, k: usize, black: &[f32; STRIDE], scale: &[f32; STRIDE]| {
        let y = (f32::from(raw) - black[k]) * scale[k];
        if raw < saturation[k] { y } else { f32::NAN }
    };
    let length = raw.len().min(y.len());
    let (raw, raw_rest) = raw[..length].as_chunks::<STRIDE>();
    let (y, y_rest) = y[..length].as_chunks_mut::<STRIDE>();
    for (y, raw) in y.iter_mut().zip(raw) {
        for k in 0..STRIDE {
            y[k] = one(raw[k], k, &black, &scale);
        }
    }
    for (k, (y, &raw)) in y_rest.iter_mut().zip(raw_rest).enumerate() {
        *y = one(raw, k, &black, &scale);
    }
}

/// Samples that are normalised side by side.
const STRIDE: usize = 64;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_filters_and_odd_widths() {
        let with =
            Normalisation { black: [100.0, 50.0], scale: [0.5, 0.25], saturation: [1000, 900] };
        let check = |raw: &[u16], expected: &[f32]| {
            let mut y = vec![-1.0; raw.len()];
            normalise_row(raw, &with, &mut y);
            let same = |(a, b): (&f32, &f32)| a == b || a.is_nan() && b.is_nan();
            assert!(y.iter().zip(expected).all(same), "{raw:?}: {y:?}, expected {expected:?}");
        };
        check(&[], &[]);
        check(&[102], &[1.0]);
        check(&[100, 50, 98], &[0.0, 0.0, -1.0]);
        check(&[999, 899, 1000, 900], &[449.5, 212.25, f32::NAN, f32::NAN]);
        check(&[0, 0, u16::MAX, u16::MAX], &[-50.0, -12.5, f32::NAN, f32::NAN]);
        let long: Vec<u16> = (0..77).map(|i| 10 * i).collect();
        let expected: Vec<f32> = (0..77)
            .map(|i| if i % 2 == 0 { 5.0 * i as f32 - 50.0 } else { 2.5 * i as f32 - 12.5 })
            .collect();
        check(&long, &expected);
    }
}
