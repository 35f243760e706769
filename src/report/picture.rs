//! Pictures to look at: maps made small, coloured, and encoded as PNG.

use colorgrad::Gradient;
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use weavelight_calibration::description::Image;

/// The longest side of a picture in a report, pixels: enough to judge a fabric, small enough for a page of thirty.
pub const LONGEST_SIDE: usize = 960;

/// A small picture, 8-bit sRGB, ready to be shown.
#[derive(Clone, Debug)]
pub struct Thumbnail {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Colours, row-major.
    pub rgb: Vec<[u8; 3]>,
}

impl Thumbnail {
    /// The picture as a PNG file's bytes.
    pub fn png(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let (width, height) = (self.width as u32, self.height as u32);
        PngEncoder::new(&mut bytes)
            .write_image(self.rgb.as_flattened(), width, height, ExtendedColorType::Rgb8)
            .expect("the buffer has width x height pixels, and memory does not fail to be written");
        bytes
    }
}

/// The mean of every `factor` x `factor` block, unsolved pixels (all zero or not finite) left out, so that holes do not
/// darken their surroundings; `factor` is the smallest that brings the longest side under `longest_side`.
pub fn shrink<const N: usize>(image: &Image<[f32; N]>, longest_side: usize) -> Image<[f32; N]> {
    let factor = image.width.max(image.height).div_ceil(longest_side.max(1)).max(1);
    let (width, height) = (image.width.div_ceil(factor), image.height.div_ceil(factor));
    let mut data = Vec::with_capacity(width * height);
    for y in 0..height {
        for x in 0..width {
            data.push(block_mean(image, x * factor, y * factor, factor));
        }
    }
    Image { width, height, data }
}

fn block_mean<const N: usize>(
    image: &Image<[f32; N]>,
    x0: usize,
    y0: usize,
    factor: usize,
) -> [f32; N] {
    let mut sum = [0.0_f64; N];
    let mut count = 0_usize;
    for y in y0..(y0 + factor).min(image.height) {
        for pixel in &image.row(y)[x0..(x0 + factor).min(image.width)] {
            if solved(pixel) {
                count += 1;
                sum.iter_mut().zip(pixel).for_each(|(s, &p)| *s += f64::from(p));
            }
        }
    }
    sum.map(|s| (s / count.max(1) as f64) as f32)
}

fn solved(pixel: &[f32]) -> bool {
    pixel.iter().all(|v| v.is_finite()) && pixel.iter().any(|&v| v != 0.0)
}

/// Normals as colours, n to (n + 1) / 2, +y up; unsolved pixels black.
pub fn normals(image: &Image<[f32; 3]>) -> Thumbnail {
    paint(image, |n| if solved(n) { n.map(|c| byte(0.5 * c + 0.5)) } else { [0; 3] })
}

/// Linear colours times `gain`, sRGB-encoded.
pub fn colors(image: &Image<[f32; 3]>, gain: f32) -> Thumbnail {
    paint(image, |c| c.map(|v| byte(crate::raster::srgb::encode((v * gain).clamp(0.0, 1.0)))))
}

/// The gain that shows the brightest hundredth of a picture's green just below white.
pub fn display_gain(image: &Image<[f32; 3]>) -> f32 {
    let mut green: Vec<f32> =
        image.data.iter().map(|c| c[1]).filter(|g| g.is_finite() && *g > 0.0).collect();
    if green.is_empty() {
        return 1.0;
    }
    let place = (green.len() * 99 / 100).min(green.len() - 1);
    let (_, bright, _) = green.select_nth_unstable_by(place, f32::total_cmp);
    0.9 / *bright
}

/// Values 0..`top` from dark to bright on a scale that colour-blind people can read; zero and unsolved black.
pub fn heat(image: &Image<[f32; 1]>, top: f32) -> Thumbnail {
    let scale = colorgrad::preset::viridis();
    paint(image, |&[v]| {
        if !v.is_finite() || v == 0.0 {
            return [0; 3];
        }
        let [r, g, b, _] = scale.at((v / top.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0)).to_rgba8();
        [r, g, b]
    })
}

fn paint<const N: usize>(
    image: &Image<[f32; N]>,
    color: impl Fn(&[f32; N]) -> [u8; 3],
) -> Thumbnail {
    Thumbnail {
        width: image.width,
        height: image.height,
        rgb: image.data.iter().map(color).collect(),
    }
}

fn byte(value: f32) -> u8 {
    (value * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shrinking_leaves_unsolved_pixels_out_of_the_mean() {
        let check = |data: [[f32; 1]; 4], expected: f32| {
            let small = shrink(&Image { width: 2, height: 2, data: data.to_vec() }, 1);
            assert_eq!((small.width, small.height, small.data[0][0]), (1, 1, expected), "{data:?}");
        };
        check([[1.0], [2.0], [3.0], [6.0]], 3.0);
        check([[1.0], [0.0], [3.0], [0.0]], 2.0);
        check([[1.0], [f32::NAN], [0.0], [0.0]], 1.0);
        check([[0.0]; 4], 0.0);
    }

    #[test]
    fn shrinking_keeps_the_ragged_edge() {
        let small = shrink(
            &Image { width: 5, height: 1, data: vec![[1.0], [3.0], [5.0], [7.0], [9.0]] },
            3,
        );
        assert_eq!(small.data, vec![[2.0], [6.0], [9.0]]);
    }

    #[test]
    fn colours_of_normals_and_holes() {
        let image =
            Image { width: 3, height: 1, data: vec![[0.0, 0.0, 1.0], [0.0; 3], [-1.0, 0.0, 0.0]] };
        assert_eq!(normals(&image).rgb, vec![[128, 128, 255], [0, 0, 0], [0, 128, 128]]);
    }

    #[test]
    fn a_picture_survives_its_png() {
        let thumbnail = Thumbnail { width: 2, height: 1, rgb: vec![[1, 2, 3], [250, 0, 7]] };
        let read = image::load_from_memory(&thumbnail.png()).unwrap().to_rgb8();
        assert_eq!(read.into_raw(), vec![1, 2, 3, 250, 0, 7]);
    }
}
