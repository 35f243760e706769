//! Frames and maps as pictures for the screen.

use eframe::egui::{Color32, ColorImage};
use weavelight::instrument::Calibration;
use weavelight::linear::preview;
use weavelight::raw::Frame;
use weavelight_calibration::description::Image;

/// A frame of the strip.
#[derive(Debug)]
pub struct Thumb {
    /// Its light; `None`: every LED off.
    pub light: Option<usize>,
    /// The first light again.
    pub drift_check: bool,
    /// Small, white-balanced.
    pub picture: ColorImage,
}

/// Longest side of a thumbnail, pixels.
const THUMB: usize = 192;
/// From here, as a fraction of the range, a sample counts as clipped.
const CLIPPED: f32 = 0.995;
/// What clips, in a colour that no cloth has.
const CLIPPED_COLOR: Color32 = Color32::from_rgb(255, 0, 255);

/// A frame made small.
pub fn thumb(frame: &Frame, light: Option<usize>, calibration: Option<&Calibration>) -> ColorImage {
    let small = preview(frame, THUMB);
    let balance = light
        .and_then(|light| calibration?.lights.get(light))
        .map_or_else(|| grey_world(&small), |light| balance(light.light.intensity()));
    picture(&small, balance)
}

/// A test shot, `longest_side` pixels at most; with what clips marked, if `mark_clipped`.
pub fn test_shot(frame: &Frame, longest_side: usize, mark_clipped: bool) -> ColorImage {
    let small = preview(frame, longest_side);
    let mut shown = picture(&small, grey_world(&small));
    if mark_clipped {
        let clipped = |rgb: &[f32; 3]| rgb.iter().any(|value| *value >= CLIPPED);
        let pixels = shown.pixels.iter_mut().zip(&small.data);
        pixels.filter(|(_, rgb)| clipped(rgb)).for_each(|(pixel, _)| *pixel = CLIPPED_COLOR);
    }
    shown
}

/// Linear colours for the screen, each channel times its gain.
pub fn picture(linear: &Image<[f32; 3]>, gain: [f32; 3]) -> ColorImage {
    image(linear, |rgb| {
        let [r, g, b] = [0, 1, 2].map(|c| encode(rgb[c] * gain[c]));
        Color32::from_rgb(r, g, b)
    })
}

fn image(source: &Image<[f32; 3]>, color: impl Fn(&[f32; 3]) -> Color32) -> ColorImage {
    let pixels = source.data.iter().map(color).collect();
    ColorImage::new([source.width, source.height], pixels)
}

/// The sRGB curve, 8 bit.
fn encode(linear: f32) -> u8 {
    (255.0 * weavelight::raster::srgb::encode(linear.clamp(0.0, 1.0))).round() as u8
}

/// Gains that show white as white under a light, green = 1.
fn balance(intensity: [f64; 3]) -> [f32; 3] {
    intensity.map(|channel| if channel > 0.0 { (intensity[1] / channel) as f32 } else { 1.0 })
}

/// Gains that make the mean grey: for pictures of lights that are not calibrated yet.
fn grey_world(picture: &Image<[f32; 3]>) -> [f32; 3] {
    let mean = |c: usize| picture.data.iter().map(|rgb| f64::from(rgb[c].max(0.0))).sum::<f64>();
    balance([mean(0), mean(1), mean(2)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unmeasured_lights_picture_is_grey_on_average() {
        let data = vec![[0.1, 0.2, 0.05]; 4];
        let gain = grey_world(&Image { width: 2, height: 2, data });
        assert_eq!(gain.map(|g| (g * 100.0).round()), [200.0, 100.0, 400.0]);
    }
}
