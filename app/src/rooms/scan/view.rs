//! The large picture: a test shot with its histogram and advice, or the maps as far as the frames go.

use super::histogram;
use super::picture::{normals, picture, test_shot};
use crate::texts::scan as texts;
use eframe::egui::{self, ColorImage, RichText, TextureHandle, TextureOptions};
use weavelight::device::scan;
use weavelight::solve::preview::Preview;

/// Longest side of a test shot on the screen, pixels.
const TEST_SHOT: usize = 1600;

/// What is shown.
#[derive(Default)]
pub(super) struct View {
    shot: Option<(Box<scan::Preview>, Option<TextureHandle>)>,
    mark_clipped: bool,
    maps: Option<Maps>,
    fresh: Option<[ColorImage; 2]>,
    layer: Layer,
}

struct Maps {
    textures: [TextureHandle; 2],
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Layer {
    #[default]
    Normal,
    Albedo,
}

impl std::fmt::Debug for View {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("View").field("layer", &self.layer).finish_non_exhaustive()
    }
}

impl View {
    /// A new scan: the old pictures go.
    pub(super) fn begin(&mut self) {
        *self = Self { layer: self.layer, mark_clipped: self.mark_clipped, ..Self::default() };
    }

    pub(super) fn show_test_shot(&mut self, shot: Box<scan::Preview>) {
        self.begin();
        self.shot = Some((shot, None));
    }

    pub(super) fn show_preview(&mut self, preview: &Preview) {
        self.shot = None;
        self.fresh = Some([normals(&preview.normal), picture(&preview.albedo, [1.0; 3])]);
    }

    pub(super) fn has_test_shot(&self) -> bool {
        self.shot.is_some()
    }

    /// Draws it; where there is nothing, `empty` says why.
    pub(super) fn ui(&mut self, ui: &mut egui::Ui, empty: &str) {
        if let Some([normal, albedo]) = self.fresh.take() {
            let load =
                |name: &str, image| ui.ctx().load_texture(name, image, TextureOptions::LINEAR);
            self.maps = Some(Maps { textures: [load("normal", normal), load("albedo", albedo)] });
        }
        match (&self.shot, &self.maps) {
            (Some(_), _) => self.test_shot(ui),
            (None, Some(_)) => self.maps(ui),
            (None, None) => nothing_yet(ui, empty),
        }
    }

    fn maps(&mut self, ui: &mut egui::Ui) {
        ui.horizontal(|ui| {
            ui.selectable_value(&mut self.layer, Layer::Normal, texts::NORMALS);
            ui.selectable_value(&mut self.layer, Layer::Albedo, texts::ALBEDO);
        });
        if let Some(maps) = &self.maps {
            let (texture, name) = match self.layer {
                Layer::Normal => (&maps.textures[0], texts::NORMALS),
                Layer::Albedo => (&maps.textures[1], texts::ALBEDO),
            };
            fit(ui, texture, name);
        }
    }

    fn test_shot(&mut self, ui: &mut egui::Ui) {
        let Some((shot, texture)) = &mut self.shot else { return };
        ui.label(RichText::new(&shot.advice).strong());
        let before = self.mark_clipped;
        ui.checkbox(&mut self.mark_clipped, texts::MARK_CLIPPED);
        if before != self.mark_clipped {
            *texture = None;
        }
        let mark = self.mark_clipped;
        let texture = texture.get_or_insert_with(|| {
            let image = test_shot(&shot.frame, TEST_SHOT, mark);
            ui.ctx().load_texture("test shot", image, TextureOptions::LINEAR)
        });
        egui::Panel::bottom("histogram").exact_size(histogram::HEIGHT).show(ui, |ui| {
            histogram::ui(ui, &shot.look);
        });
        fit(ui, texture, texts::TEST_SHOT);
    }
}

/// A picture as large as there is room, in the middle.
fn fit(ui: &mut egui::Ui, texture: &TextureHandle, name: &str) {
    let room = ui.available_size();
    let size = texture.size_vec2();
    let scale = (room.x / size.x).min(room.y / size.y);
    ui.vertical_centered(|ui| {
        let image = egui::Image::new(texture).fit_to_exact_size(size * scale).alt_text(name);
        ui.add(image);
    });
}

fn nothing_yet(ui: &mut egui::Ui, why: &str) {
    ui.vertical_centered(|ui| {
        ui.add_space(ui.available_height() * 0.35);
        ui.label(RichText::new(why).size(16.0).weak());
        ui.label(RichText::new(texts::HOW_TO).weak());
    });
}
