//! The scales of colours that stand for numbers: even to the eye, and readable with every kind of colour vision.

use colorgrad::Gradient;
use eframe::egui::Color32;

/// Colours of a scale in the shader.
pub const STEPS: usize = 256;

/// From 0 up: dark to bright.
pub fn heat(share: f32) -> Color32 {
    color(&colorgrad::preset::viridis(), share)
}

/// From minus to plus: blue over white to red-brown.
pub fn signed(share: f32) -> Color32 {
    color(&colorgrad::preset::rd_bu(), 1.0 - share)
}

fn color(gradient: &impl Gradient, share: f32) -> Color32 {
    let [r, g, b, _] = gradient.at(share.clamp(0.0, 1.0)).to_rgba8();
    Color32::from_rgb(r, g, b)
}

/// Both scales as the shader's picture: [`STEPS`] x 2 pixels, RGBA.
pub fn table() -> Vec<[u8; 4]> {
    let row = |of: fn(f32) -> Color32| {
        (0..STEPS).map(move |k| of(k as f32 / (STEPS - 1) as f32).to_array())
    };
    row(heat).chain(row(signed)).collect()
}
