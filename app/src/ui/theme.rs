//! Colours, sizes and the icon. Colours that carry meaning are Okabe and Ito's, distinguishable with every kind of colour vision,
//! and never stand without a word or a shape beside them.

use crate::model::settings::{Settings, Theme};
use eframe::egui;
use eframe::egui::{Color32, CornerRadius, FontId, Margin, Stroke, TextStyle, Vec2};

/// Meaning, independent of light and dark.
pub mod meaning {
    use super::Color32;
    /// What is chosen, lit or running.
    pub const ACTIVE: Color32 = Color32::from_rgb(0x56, 0xB4, 0xE9);
    /// Done and good.
    pub const GOOD: Color32 = Color32::from_rgb(0x00, 0x9E, 0x73);
    /// Done, and something ought to be known.
    pub const WARNING: Color32 = Color32::from_rgb(0xE6, 0x9F, 0x00);
    /// Failed.
    pub const BAD: Color32 = Color32::from_rgb(0xD5, 0x5E, 0x00);
    /// A lit LED.
    pub const LIT: Color32 = Color32::from_rgb(0xF0, 0xE4, 0x42);
    /// Channels of a histogram: red, green and blue distinguishable with every kind of colour vision.
    pub const CHANNELS: [Color32; 3] = [
        Color32::from_rgb(0xD5, 0x5E, 0x00),
        Color32::from_rgb(0x00, 0x9E, 0x73),
        Color32::from_rgb(0x00, 0x72, 0xB2),
    ];
}

/// Space between things that belong together, points.
pub const GAP: f32 = 8.0;
/// Space between groups, points.
pub const WIDE_GAP: f32 = 16.0;
/// Side of a big button, points.
pub const BIG: f32 = 44.0;

/// The ring around what has the keyboard: three to one and more against every ground of its theme.
pub fn focus(theme: egui::Theme) -> Color32 {
    match theme {
        egui::Theme::Dark => meaning::LIT,
        egui::Theme::Light => Color32::from_rgb(0x00, 0x3E, 0x73),
    }
}

/// Sets style, theme and scale.
pub fn apply(ctx: &egui::Context, settings: &Settings) {
    ctx.set_theme(match settings.theme {
        Theme::System => egui::ThemePreference::System,
        Theme::Light => egui::ThemePreference::Light,
        Theme::Dark => egui::ThemePreference::Dark,
    });
    ctx.set_zoom_factor(settings.scale);
    ctx.style_mut_of(egui::Theme::Dark, |style| {
        spacing(style);
        dark(&mut style.visuals);
    });
    ctx.style_mut_of(egui::Theme::Light, |style| {
        spacing(style);
        light(&mut style.visuals);
    });
}

fn spacing(style: &mut egui::Style) {
    style.spacing.item_spacing = Vec2::splat(GAP);
    style.spacing.button_padding = Vec2::new(12.0, 6.0);
    style.spacing.interact_size.y = 28.0;
    // A list shows what it has; where the window has no room for that, it scrolls.
    style.spacing.combo_height = 380.0;
    style.spacing.window_margin = Margin::same(16);
    style.text_styles.insert(TextStyle::Heading, FontId::proportional(20.0));
    style.text_styles.insert(TextStyle::Body, FontId::proportional(14.0));
    style.text_styles.insert(TextStyle::Button, FontId::proportional(14.0));
    style.text_styles.insert(TextStyle::Small, FontId::proportional(12.0));
    style.text_styles.insert(TextStyle::Monospace, FontId::monospace(13.0));
}

/// A neutral grey around pictures of cloth, so that no colour of the window tints the eye.
fn dark(visuals: &mut egui::Visuals) {
    visuals.panel_fill = Color32::from_gray(30);
    visuals.window_fill = Color32::from_gray(38);
    visuals.extreme_bg_color = Color32::from_gray(20);
    visuals.faint_bg_color = Color32::from_gray(36);
    visuals.selection.bg_fill = Color32::from_rgb(0x1F, 0x5F, 0x8B);
    visuals.selection.stroke = Stroke::new(1.0, Color32::WHITE);
    visuals.hyperlink_color = meaning::ACTIVE;
    visuals.override_text_color = Some(Color32::from_gray(225));
    round(visuals);
}

fn light(visuals: &mut egui::Visuals) {
    visuals.panel_fill = Color32::from_gray(240);
    visuals.window_fill = Color32::from_gray(250);
    visuals.extreme_bg_color = Color32::from_gray(255);
    visuals.faint_bg_color = Color32::from_gray(230);
    visuals.selection.bg_fill = Color32::from_rgb(0xA8, 0xD5, 0xF2);
    visuals.selection.stroke = Stroke::new(1.0, Color32::BLACK);
    visuals.hyperlink_color = Color32::from_rgb(0x00, 0x5B, 0x8F);
    visuals.override_text_color = Some(Color32::from_gray(25));
    // Buttons stand out from cards and panels alike.
    visuals.widgets.inactive.weak_bg_fill = Color32::from_gray(212);
    visuals.widgets.hovered.weak_bg_fill = Color32::from_gray(200);
    visuals.widgets.inactive.bg_fill = Color32::from_gray(212);
    round(visuals);
}

fn round(visuals: &mut egui::Visuals) {
    let widgets = &mut visuals.widgets;
    for state in [
        &mut widgets.noninteractive,
        &mut widgets.inactive,
        &mut widgets.hovered,
        &mut widgets.active,
        &mut widgets.open,
    ] {
        state.corner_radius = CornerRadius::same(6);
    }
}

/// The window's icon: a weave under a light.
pub fn icon() -> egui::IconData {
    const SIDE: u32 = 64;
    let rgba = (0..SIDE * SIDE).flat_map(|k| icon_pixel(k % SIDE, k / SIDE, SIDE)).collect();
    egui::IconData { rgba, width: SIDE, height: SIDE }
}

/// A plain weave of four by four yarns, lit from the upper left.
fn icon_pixel(x: u32, y: u32, side: u32) -> [u8; 4] {
    let yarns = 4.0;
    let (u, v) = (x as f32 / side as f32, y as f32 / side as f32);
    let (i, j) = ((u * yarns) as u32, (v * yarns) as u32);
    let (a, b) = ((u * yarns).fract() - 0.5, (v * yarns).fract() - 0.5);
    let warp_over = (i + j).is_multiple_of(2);
    let across = if warp_over { a } else { b };
    let shade = (1.0 - 4.0 * (across + 0.15).powi(2)).clamp(0.15, 1.0);
    let glow = (1.2 - ((u - 0.15).powi(2) + (v - 0.15).powi(2)).sqrt()).clamp(0.3, 1.0);
    let tint = if warp_over { [240.0, 228.0, 200.0] } else { [86.0, 180.0, 233.0] };
    let [r, g, b] = tint.map(|c: f32| (c * shade * glow) as u8);
    [r, g, b, 255]
}
