//! The panel beside the maps: what is shown, the light, the photosite, the slopes, the mask.

use super::lamp::Kind;
use super::layer::Layer;
use super::view::Compose;
use super::{Ask, Look, Tool, plots};
use crate::desk::Desk;
use crate::texts::look as texts;
use crate::theme;
use crate::worker::Command;
use eframe::egui::{self, Button, ComboBox, RichText, ScrollArea, Slider, Ui};

impl Look {
    pub(super) fn side(&mut self, ui: &mut Ui, desk: &mut Desk) {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            ui.spacing_mut().slider_width = 110.0;
            self.layers_section(ui);
            self.light_section(ui);
            if self.painting.is_some() || matches!(self.tool, Tool::Brush | Tool::Lasso) {
                self.mask_section(ui, desk);
            }
            section(ui, texts::PHOTOSITE, |ui| self.loupe(ui));
            let opened = self.opened.as_ref();
            if let Some(slopes) = opened.and_then(|opened| opened.slopes.as_ref()) {
                section(ui, texts::SLOPES, |ui| plots::histogram(ui, texts::SLOPES, slopes));
            }
            self.other_section(ui);
        });
    }

    fn layers_section(&mut self, ui: &mut Ui) {
        section(ui, texts::SHOW, |ui| {
            ui.horizontal(|ui| {
                let ways = [Compose::Single, Compose::Split, Compose::Difference];
                for (compose, name) in ways.into_iter().zip(texts::COMPOSE) {
                    ui.selectable_value(&mut self.layers.compose, compose, name);
                }
            });
            let sides = self.layers.seen().len();
            for k in 0..sides {
                let name = if sides == 1 { texts::MAP } else { texts::SIDES[k] };
                self.layer_choice(ui, k, name);
            }
            self.scale_of_layers(ui);
        });
    }

    fn layer_choice(&mut self, ui: &mut Ui, k: usize, name: &str) {
        ui.horizontal(|ui| {
            let label = ui.label(name);
            let mut chosen = self.layers.sides[k];
            let width = ui.available_width() - 8.0;
            let choice = ComboBox::from_id_salt(("layer", k)).width(width);
            let shown = choice.selected_text(chosen.name()).show_ui(ui, |ui| {
                for layer in Layer::ALL {
                    let why_not = self.why_not(layer);
                    let button = Button::selectable(chosen == layer, layer.name());
                    let entry = ui.add_enabled(why_not.is_none(), button);
                    if entry.on_disabled_hover_text(why_not.unwrap_or_default()).clicked() {
                        chosen = layer;
                    }
                }
            });
            shown.response.labelled_by(label.id);
            self.layers.sides[k] = chosen;
        });
    }

    /// The upper ends of the scales that are seen.
    fn scale_of_layers(&mut self, ui: &mut Ui) {
        let layers = &self.layers;
        let seen = |layer| layers.compose != Compose::Difference && layers.shows(layer);
        let [error, slope, angle, residual] =
            [Layer::Error, Layer::Slope, Layer::Angle, Layer::Residual].map(seen);
        let difference = layers.compose == Compose::Difference;
        let scales = &mut self.layers.scales;
        let degrees = |value, range| Slider::new(value, range).suffix("°").text(texts::UP_TO);
        if error {
            ui.add(degrees(&mut scales.error_deg, 0.5..=30.0).logarithmic(true));
        }
        if slope {
            ui.add(degrees(&mut scales.slope_deg, 5.0..=90.0));
        }
        if angle {
            ui.add(degrees(&mut scales.angle_deg, 0.1..=45.0).logarithmic(true));
        }
        if residual {
            let range = 0.002..=0.5;
            ui.add(Slider::new(&mut scales.residual, range).logarithmic(true).text(texts::UP_TO));
        }
        if difference {
            let range = 0.01..=1.0;
            ui.add(Slider::new(&mut scales.difference, range).logarithmic(true).text(texts::UP_TO));
        }
    }

    fn light_section(&mut self, ui: &mut Ui) {
        let relit = self.layers.shows(Layer::Relit);
        let of_frames = self.layers.shows_frame() || self.layers.shows_residual();
        let bright = relit || of_frames || self.layers.shows(Layer::Albedo);
        if !bright {
            return;
        }
        section(ui, texts::LIGHT, |ui| {
            if relit {
                self.kind_of_light(ui);
            }
            match self.lamp.kind {
                Kind::Lamp if relit => self.lamp_controls(ui),
                Kind::Sun if relit => self.sun_controls(ui),
                _ => {}
            }
            if of_frames || (relit && self.lamp.kind == Kind::Rig) {
                self.rig_lights(ui);
            }
            let stops = Slider::new(&mut self.lamp.stops, -4.0..=4.0).suffix(" EV");
            ui.add(stops.fixed_decimals(1).text(texts::BRIGHTNESS));
            if relit {
                let gloss = Slider::new(&mut self.lamp.gloss, 0.0..=0.2);
                ui.add(gloss.fixed_decimals(2).text(texts::GLOSS));
            }
        });
    }

    fn kind_of_light(&mut self, ui: &mut Ui) {
        let calibrated = self.opened.as_ref().is_some_and(|opened| !opened.lights.is_empty());
        ui.horizontal(|ui| {
            for (kind, name) in [Kind::Lamp, Kind::Sun, Kind::Rig].into_iter().zip(texts::LIGHTS) {
                let enabled = kind != Kind::Rig || calibrated;
                let button = Button::selectable(self.lamp.kind == kind, name);
                let button = ui.add_enabled(enabled, button);
                if button.on_disabled_hover_text(texts::NO_LIGHTS).clicked() {
                    self.lamp.kind = kind;
                }
            }
        });
    }

    fn lamp_controls(&mut self, ui: &mut Ui) {
        let height = Slider::new(&mut self.lamp.height_mm, 5.0..=2000.0).logarithmic(true);
        ui.add(height.suffix(" mm").fixed_decimals(0).text(texts::HEIGHT));
        ui.label(RichText::new(texts::DRAG_LAMP).weak().small());
    }

    fn sun_controls(&mut self, ui: &mut Ui) {
        let elevation = Slider::new(&mut self.lamp.elevation_deg, 1.0..=90.0).suffix("°");
        ui.add(elevation.fixed_decimals(0).text(texts::ELEVATION));
        let azimuth = Slider::new(&mut self.lamp.azimuth_deg, 0.0..=360.0).suffix("°");
        ui.add(azimuth.fixed_decimals(0).text(texts::AZIMUTH));
        ui.checkbox(&mut self.lamp.moves, texts::MOVES);
    }

    /// One button for each of the rig's lights; and the frame beside the relit cloth.
    fn rig_lights(&mut self, ui: &mut Ui) {
        let Some(opened) = &self.opened else { return };
        let count = opened.lights.len();
        let has_frame =
            opened.capture.as_ref().is_some_and(|c| c.lights.contains(&self.lamp.light));
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing = egui::vec2(4.0, 4.0);
            ui.spacing_mut().button_padding.x = 6.0;
            for light in 0..count {
                let button = Button::selectable(self.lamp.light == light, light.to_string());
                let button = ui.add(button.min_size(egui::vec2(26.0, 24.0)));
                if button.on_hover_text(texts::light(light)).clicked() {
                    self.lamp.light = light;
                }
            }
        });
        let why_not = self.why_not(Layer::Frame).or((!has_frame).then_some(texts::NO_FRAME));
        let beside = ui.add_enabled(why_not.is_none(), Button::new(texts::BESIDE_FRAME));
        if beside.on_disabled_hover_text(why_not.unwrap_or_default()).clicked() {
            self.lamp.kind = Kind::Rig;
            self.layers.sides = [Layer::Relit, Layer::Frame];
            self.layers.compose = Compose::Split;
        }
    }

    fn mask_section(&mut self, ui: &mut Ui, desk: &mut Desk) {
        section(ui, texts::MASK, |ui| {
            ui.horizontal(|ui| {
                ui.selectable_value(&mut self.canvas.erases, false, texts::KEEP);
                ui.selectable_value(&mut self.canvas.erases, true, texts::LEAVE_OUT);
            });
            let Some(opened) = &self.opened else { return };
            let size = opened.maps.size();
            let mut radius = self.canvas.radius_px(size);
            let most = (size[0] as f64 / 4.0).max(2.0);
            let slider = Slider::new(&mut radius, 0.5..=most).logarithmic(true).suffix(" px");
            if ui.add(slider.fixed_decimals(0).text(texts::BRUSH)).changed() {
                self.canvas.brush_px = radius;
            }
            let (Some(painting), Some(capture)) = (&mut self.painting, &opened.capture) else {
                return;
            };
            ui.horizontal(|ui| {
                if ui.button(texts::ALL).clicked() {
                    painting.fill(true);
                }
                if ui.button(texts::NONE).clicked() {
                    painting.fill(false);
                }
            });
            let session = capture.session.clone();
            let something = painting.mask().data.contains(&true);
            let ready = painting.changed && something && !desk.is_busy();
            let save = ui.add_enabled(ready, Button::new(texts::SAVE_AND_SOLVE));
            if save.on_disabled_hover_text(texts::PAINT_FIRST).clicked() {
                let mask = Box::new(painting.mask().clone());
                desk.ask(Command::Look(Ask::Mask(session.clone(), mask)));
                desk.ask(Command::Look(Ask::Solve(session, desk.settings.solve)));
            }
        });
    }

    fn other_section(&self, ui: &mut Ui) {
        let Some(other) = &self.other else { return };
        section(ui, &texts::against(&other.name), |ui| match &other.angles {
            Some(angles) => plots::histogram(ui, texts::ANGLE, angles),
            None => {
                ui.label(RichText::new(texts::NOTHING_IN_COMMON).weak());
            }
        });
    }
}

fn section(ui: &mut Ui, title: &str, contents: impl FnOnce(&mut Ui)) {
    ui.add_space(theme::GAP);
    ui.label(RichText::new(title).strong());
    contents(ui);
    ui.add_space(theme::GAP / 2.0);
    ui.separator();
}
