//! The large picture: a test shot with its histogram and advice, or the maps as far as the frames go, under a lamp that the
//! mouse carries.

use crate::rooms::scan::histogram;
use crate::texts::scan as texts;
use crate::viewer::appearance::{Appearance, Mode, first_lamp, lamp_over};
use crate::viewer::canvas::Canvas;
use crate::viewer::geometry::Geometry;
use crate::viewer::map_view::MapView;
use crate::viewer::maps::Maps;
use crate::viewer::picture::test_shot;
use eframe::egui;
use eframe::egui::{PointerButton, RichText, TextureHandle, TextureOptions};
use weavelight::device::scan;

/// Longest side of a test shot on the screen, pixels.
const TEST_SHOT: usize = 1600;

/// What is shown.
#[derive(Default)]
pub(super) struct View {
    shot: Option<(Box<scan::Preview>, Option<TextureHandle>)>,
    mark_clipped: bool,
    maps: Option<Box<Maps>>,
    map_view: MapView,
    layer: Layer,
    /// Over which place of the table the lamp hangs, and how high, millimetres.
    lamp: Option<([f64; 2], f64)>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Layer {
    #[default]
    Relit,
    Normal,
    Albedo,
}

impl Layer {
    const ALL: [Layer; 3] = [Layer::Relit, Layer::Normal, Layer::Albedo];

    fn mode(self) -> Mode {
        match self {
            Layer::Relit => Mode::Relit,
            Layer::Normal => Mode::Normal,
            Layer::Albedo => Mode::Albedo,
        }
    }
}

impl std::fmt::Debug for View {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("View").field("layer", &self.layer).finish_non_exhaustive()
    }
}

impl View {
    /// A new scan: the old pictures go; lamp and layer stay.
    pub(super) fn begin(&mut self) {
        (self.shot, self.maps) = (None, None);
        self.map_view = MapView::default();
    }

    pub(super) fn show_test_shot(&mut self, shot: Box<scan::Preview>) {
        self.begin();
        self.shot = Some((shot, None));
    }

    pub(super) fn show_maps(&mut self, maps: Box<Maps>) {
        self.shot = None;
        self.maps = Some(maps);
    }

    pub(super) fn has_test_shot(&self) -> bool {
        self.shot.is_some()
    }

    /// Draws it; where there is nothing, `empty` says why.
    pub(super) fn ui(&mut self, ui: &mut egui::Ui, empty: &str) {
        match (&self.shot, self.maps.take()) {
            (Some(_), _) => self.test_shot(ui),
            (None, Some(maps)) => {
                self.show(ui, &maps);
                self.maps = Some(maps);
            }
            (None, None) => nothing_yet(ui, empty),
        }
    }

    fn show(&mut self, ui: &mut egui::Ui, maps: &Maps) {
        ui.horizontal(|ui| {
            for (layer, name) in Layer::ALL.into_iter().zip(texts::LAYERS) {
                ui.selectable_value(&mut self.layer, layer, name);
            }
            let how = if self.layer == Layer::Relit { texts::DRAG_LIGHT } else { texts::DRAG_MAPS };
            ui.add(egui::Label::new(RichText::new(how).small().weak()).truncate());
        });
        let drag_pans = self.layer != Layer::Relit;
        let shown = self.map_view.begin(ui, maps, (texts::MAPS, drag_pans));
        self.lamp.get_or_insert_with(|| first_lamp(&maps.geometry));
        let first = PointerButton::Primary;
        let carried = shown.response.dragged_by(first) || shown.response.drag_stopped_by(first);
        if let Some(pixel) = shown.pixel_under_mouse().filter(|_| carried && !drag_pans) {
            self.carry_lamp(pixel, &maps.geometry);
        }
        // Only now the lamp is where the hand is.
        let (at_mm, height_mm) = self.lamp.unwrap_or_else(|| first_lamp(&maps.geometry));
        let light = lamp_over(&maps.geometry, at_mm, height_mm);
        let appearance = Appearance { light, ..Appearance::of(self.layer.mode()) };
        let canvas = Canvas { maps, appearance: &appearance, name: texts::MAPS, drag_pans };
        self.map_view.paint(ui, &shown, &canvas);
    }

    fn carry_lamp(&mut self, pixel: [f64; 2], geometry: &Geometry) {
        let under = geometry.on_plane(pixel);
        if let Some((at_mm, _)) = &mut self.lamp {
            *at_mm = [under.x, under.y];
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
