//! Gain maps: what a light's model leaves over, as a small picture that spans the frame.

use crate::description::Image;

/// Texels and weight for one coordinate: the value there is `(1 - weight) * map[low] + weight * map[low + 1]`.
///
/// The map spans the frame as a picture of it would at another resolution: texel k stands where the centre of its
/// share of the frame is, at pixel (k + 1/2) length / texels - 1/2. Beyond the outermost texels the line goes on
/// (weight below 0 or above 1), so that a linear map stays linear up to the border. One texel holds everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Between {
    /// The first of the two texels.
    pub low: usize,
    /// The second; equal to the first where there is only one.
    pub high: usize,
    /// Share of the second.
    pub weight: f64,
}

/// Which texels of a map `texels` wide (or high) surround a pixel coordinate of a frame `length_px` wide (or high).
pub fn between(pixel: f64, length_px: usize, texels: usize) -> Between {
    if texels < 2 || length_px == 0 {
        return Between { low: 0, high: 0, weight: 0.0 };
    }
    let place = (pixel + 0.5) * texels as f64 / length_px as f64 - 0.5;
    let low = (place.floor().max(0.0) as usize).min(texels - 2);
    Between { low, high: low + 1, weight: place - low as f64 }
}

/// Gain R, G, B at pixel (u, v) of a frame `frame_px` = (width, height).
///
/// # Panics
/// Where the map has no texels.
pub fn gain_at(map: &Image<[f32; 3]>, frame_px: (usize, usize), [u, v]: [f64; 2]) -> [f64; 3] {
    let (across, down) = (between(u, frame_px.0, map.width), between(v, frame_px.1, map.height));
    let mix = |row: usize, channel: usize| {
        let texel = |column| f64::from(map.at(column, row)[channel]);
        texel(across.low) * (1.0 - across.weight) + texel(across.high) * across.weight
    };
    [0, 1, 2].map(|channel| {
        mix(down.low, channel) * (1.0 - down.weight) + mix(down.high, channel) * down.weight
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(width: usize, height: usize, value: impl Fn(f64, f64) -> f32) -> Image<[f32; 3]> {
        let texel = |i: usize| {
            let (x, y) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            [value(x / width as f64, y / height as f64); 3]
        };
        Image { width, height, data: (0..width * height).map(texel).collect() }
    }

    #[test]
    fn a_linear_map_is_linear_over_the_whole_frame_at_any_resolution() {
        for (width, height) in [(2, 2), (3, 5), (40, 30), (61, 47)] {
            let map = map(width, height, |x, y| (1.0 + 0.3 * x - 0.2 * y) as f32);
            for [u, v] in [[0.0, 0.0], [39.0, 29.0], [39.0, 0.0], [12.3, 17.9]] {
                let expected = 1.0 + 0.3 * (u + 0.5) / 40.0 - 0.2 * (v + 0.5) / 30.0;
                let found = gain_at(&map, (40, 30), [u, v])[1];
                assert!(
                    (found - expected).abs() < 1e-6,
                    "{width}x{height} at {u}, {v}: {found} not {expected}"
                );
            }
        }
    }

    #[test]
    fn a_map_of_the_frames_size_is_taken_pixel_by_pixel_and_one_texel_holds_everywhere() {
        let map = Image { width: 3, height: 1, data: vec![[1.0; 3], [7.0; 3], [2.0; 3]] };
        assert_eq!(gain_at(&map, (3, 1), [1.0, 0.0]), [7.0; 3]);
        assert_eq!(
            gain_at(&Image::filled(1, 1, [0.5, 1.0, 2.0]), (9, 9), [8.0, 3.0]),
            [0.5, 1.0, 2.0]
        );
    }
}
