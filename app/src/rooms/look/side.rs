//! The panel beside the maps: what is shown, the light, the photosite, the slopes, the mask.

use crate::jobs::look::opened::Opened;
use crate::jobs::look::{Command, EditedMask};
use crate::jobs::messages::Request;
use crate::jobs::state::AppState;
use crate::model::number::Unit;
use crate::model::settings::{MethodName, SolveSettings};
use crate::rooms::look::lamp::Kind;
use crate::rooms::look::layer::Layer;
use crate::rooms::look::{Look, Tool, plots};
use crate::texts::look as texts;
use crate::ui::number::Number;
use crate::ui::widgets;
use crate::ui::widgets::Sign;
use crate::viewer::appearance::Compose;
use eframe::egui;
use eframe::egui::emath::Numeric;
use eframe::egui::{Button, ComboBox, RichText, ScrollArea, Slider, Ui, vec2};

/// Width of the panel, points.
pub(super) const WIDTH: f32 = 296.0;
/// Width of the names at the left, which the controls stand right of.
const NAME: f32 = 72.0;
/// Width of a slider's value.
const VALUE: f32 = 66.0;
/// Height of a row of controls: all that relighting takes is seen at once in a window of 1280 x 800.
const ROW: f32 = 24.0;

impl Look {
    pub(super) fn side(&mut self, ui: &mut Ui, app: &mut AppState) {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let spacing = ui.spacing_mut();
            spacing.interact_size = vec2(VALUE, ROW);
            spacing.button_padding = vec2(8.0, 3.0);
            spacing.item_spacing = vec2(4.0, 4.0);
            ui.add_space(4.0);
            self.layers_section(ui);
            self.light_section(ui);
            if self.painting.is_some() || matches!(self.tool, Tool::Brush | Tool::Lasso) {
                self.mask_section(ui, app);
            }
            section(ui, texts::PHOTOSITE, |ui| self.loupe(ui));
            let opened = self.opened.as_ref();
            if let Some(slopes) = opened.and_then(|opened| opened.slopes.as_ref()) {
                section(ui, texts::SLOPES, |ui| plots::histogram(ui, texts::SLOPES, slopes));
            }
            self.other_section(ui);
            widgets::reveal_focus(ui);
        });
    }

    fn layers_section(&mut self, ui: &mut Ui) {
        named(ui, RichText::new(texts::SHOW).strong(), |ui, _| {
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
        self.why_no_frames(ui);
        rule(ui);
    }

    /// Where the frames cannot be looked at: that, why, and what to do.
    fn why_no_frames(&self, ui: &mut Ui) {
        let Some(Err(why)) = self.opened.as_ref().map(|opened| &opened.frames) else { return };
        ui.horizontal_top(|ui| {
            Sign::Warning.ui(ui);
            let text = RichText::new(format!("{}. {why}", texts::FRAMES_MISSING)).size(12.0);
            ui.add(egui::Label::new(text).wrap());
        });
    }

    fn layer_choice(&mut self, ui: &mut Ui, k: usize, name: &str) {
        let mut chosen = self.layers.sides[k];
        named(ui, name, |ui, label| {
            // All maps at once where the window has room for them.
            let height = 0.6 * ui.ctx().content_rect().height();
            let choice = ComboBox::from_id_salt(("layer", k)).width(ui.available_width());
            let choice = choice.height(height.min(400.0));
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
            shown.response.labelled_by(label);
        });
        self.layers.sides[k] = chosen;
    }

    /// The upper ends of the scales that are seen.
    fn scale_of_layers(&mut self, ui: &mut Ui) {
        let layers = &self.layers;
        let seen = |layer| layers.compose != Compose::Difference && layers.shows(layer);
        let [error, slope, angle, residual] =
            [Layer::Error, Layer::Slope, Layer::Angle, Layer::Residual].map(seen);
        let difference = layers.compose == Compose::Difference;
        let scales = &mut self.layers.scales;
        let degrees = |range| Number::of(Unit::Degrees, range).decimals(0..=2);
        let share = |range| Number::of(Unit::Share, range).speed(0.005);
        let rows = [
            (error, &mut scales.error_deg, degrees(0.5..=30.0), Steps::Logarithmic),
            (slope, &mut scales.slope_deg, degrees(5.0..=90.0), Steps::Even),
            (angle, &mut scales.angle_deg, degrees(0.1..=45.0), Steps::Logarithmic),
            (residual, &mut scales.residual, share(0.002..=0.5), Steps::Logarithmic),
            (difference, &mut scales.difference, share(0.01..=1.0), Steps::Logarithmic),
        ];
        for (seen, value, number, steps) in rows {
            if seen {
                slider(ui, texts::UP_TO, value, (number, steps));
            }
        }
    }

    fn light_section(&mut self, ui: &mut Ui) {
        let relit = self.layers.shows(Layer::Relit);
        let of_frames = self.layers.shows_frame() || self.layers.shows_residual();
        let bright = relit || of_frames || self.layers.shows(Layer::Albedo);
        if !bright {
            return;
        }
        named(ui, RichText::new(texts::LIGHT).strong(), |ui, _| {
            if relit {
                self.kind_of_light(ui);
            }
        });
        match self.lamp.kind {
            Kind::Lamp if relit => self.lamp_controls(ui),
            Kind::Sun if relit => self.sun_controls(ui),
            _ => {}
        }
        if of_frames || (relit && self.lamp.kind == Kind::Rig) {
            self.rig_lights(ui);
        }
        let stops = Number::of(Unit::Stops, -4.0..=4.0).decimals(1..=1);
        slider(ui, texts::BRIGHTNESS, &mut self.lamp.stops, (stops, Steps::Even));
        if relit {
            let gloss = Number::of(Unit::Share, 0.0..=0.2).speed(0.002).decimals(2..=2);
            slider(ui, texts::GLOSS, &mut self.lamp.gloss, (gloss, Steps::Even));
        }
        rule(ui);
    }

    fn kind_of_light(&mut self, ui: &mut Ui) {
        let calibrated = self.opened.as_ref().is_some_and(|opened| !opened.lights.is_empty());
        for (kind, name) in [Kind::Lamp, Kind::Sun, Kind::Rig].into_iter().zip(texts::LIGHTS) {
            let enabled = kind != Kind::Rig || calibrated;
            let button = Button::selectable(self.lamp.kind == kind, name);
            let button = ui.add_enabled(enabled, button);
            if button.on_disabled_hover_text(texts::NO_LIGHTS).clicked() {
                self.lamp.kind = kind;
            }
        }
    }

    fn lamp_controls(&mut self, ui: &mut Ui) {
        let height = Number::of(Unit::Millimetres, 5.0..=2000.0).speed(1.0).decimals(0..=0);
        slider(ui, texts::HEIGHT, &mut self.lamp.height_mm, (height, Steps::Logarithmic));
        ui.label(RichText::new(texts::DRAG_LAMP).weak().small());
    }

    fn sun_controls(&mut self, ui: &mut Ui) {
        let degrees = |range| Number::of(Unit::Degrees, range).speed(0.5).decimals(0..=0);
        let elevation = (degrees(1.0..=90.0), Steps::Even);
        slider(ui, texts::ELEVATION, &mut self.lamp.elevation_deg, elevation);
        let azimuth = (degrees(0.0..=360.0), Steps::Even);
        slider(ui, texts::AZIMUTH, &mut self.lamp.azimuth_deg, azimuth);
        ui.checkbox(&mut self.lamp.moves, texts::MOVES);
    }

    /// One button for each of the rig's lights; and the frame beside the relit cloth.
    fn rig_lights(&mut self, ui: &mut Ui) {
        let Some(opened) = &self.opened else { return };
        let count = opened.lights.len();
        let capture = opened.capture();
        let has_frame = capture.is_some_and(|c| c.lights.contains(&self.lamp.light));
        let mut chosen = self.lamp.light;
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing = vec2(3.0, 3.0);
            ui.spacing_mut().button_padding.x = 2.0;
            // Ten in a row.
            let size = vec2((ui.available_width() - 9.0 * 3.0) / 10.0 - 0.5, ROW);
            for light in 0..count {
                let button = Button::selectable(chosen == light, light.to_string());
                if ui.add(button.min_size(size)).on_hover_text(texts::light(light)).clicked() {
                    chosen = light;
                }
            }
        });
        let why_not = self.why_not(Layer::Frame).or((!has_frame).then_some(texts::NO_FRAME));
        let beside = ui.add_enabled(why_not.is_none(), Button::new(texts::BESIDE_FRAME));
        let beside = beside.on_disabled_hover_text(why_not.unwrap_or_default()).clicked();
        self.lamp.light = chosen;
        if beside {
            self.lamp.kind = Kind::Rig;
            self.layers.sides = [Layer::Relit, Layer::Frame];
            self.layers.compose = Compose::Split;
        }
    }

    fn mask_section(&mut self, ui: &mut Ui, app: &mut AppState) {
        named(ui, RichText::new(texts::MASK).strong(), |ui, _| {
            let mut erases = self.canvas.erases(self.painting.as_ref());
            let keep = ui.selectable_value(&mut erases, false, texts::KEEP).clicked();
            let leave_out = ui.selectable_value(&mut erases, true, texts::LEAVE_OUT).clicked();
            if keep || leave_out {
                self.canvas.set_erases(erases);
            }
        });
        if let Some(why) = self.canvas.without_effect {
            ui.add(egui::Label::new(RichText::new(why).weak()).wrap());
        }
        let Some(opened) = &self.opened else { return };
        let size = opened.maps.size();
        let mut radius = self.canvas.radius_px(size);
        let most = (size[0] as f64 / 4.0).max(2.0);
        let brush = Number::of(Unit::Pixels, 0.5..=most).decimals(0..=0);
        if slider(ui, texts::BRUSH, &mut radius, (brush, Steps::Logarithmic)) {
            self.canvas.brush_px = radius;
        }
        let (Some(painting), Some(capture)) = (&mut self.painting, opened.capture()) else {
            return rule(ui);
        };
        ui.horizontal(|ui| {
            let all = ui.button(texts::ALL).clicked() && painting.fill(true);
            let none = ui.button(texts::NONE).clicked() && painting.fill(false);
            if all || none {
                self.edits.changed_mask();
            }
        });
        let ready = painting.changed && !painting.is_empty() && app.can_change();
        let save = ui.add_enabled(ready, Button::new(texts::SAVE_AND_SOLVE));
        if save.on_disabled_hover_text(texts::PAINT_FIRST).clicked() {
            let (sources, key) = (capture.sources.clone(), capture.key.clone());
            let edited =
                EditedMask { mask: painting.mask().clone(), key, version: painting.version };
            app.request(Request::Look(Command::Mask(sources.clone(), edited)));
            let (folder, how) = (opened.folder.clone(), as_it_was(opened, app.settings.solve));
            app.request(Request::Look(Command::Solve(sources, folder, how)));
        }
        rule(ui);
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

/// How a solution was solved, so that its mask is all that changes; `settings`: what it does not say.
fn as_it_was(opened: &Opened, settings: SolveSettings) -> SolveSettings {
    let method = match opened.method.as_str() {
        "auto" => MethodName::Auto,
        "least-squares" => MethodName::LeastSquares,
        "robust" => MethodName::Robust,
        _ => settings.method,
    };
    // Maps that were undistorted have no frames on their grid, and so no mask.
    SolveSettings { method, undistort: false, ..settings }
}

fn section(ui: &mut Ui, title: &str, contents: impl FnOnce(&mut Ui)) {
    ui.label(RichText::new(title).strong());
    contents(ui);
    rule(ui);
}

/// The end of a section.
fn rule(ui: &mut Ui) {
    ui.add(egui::Separator::default().spacing(10.0));
}

/// A name with controls right of it, aligned with those above and below. They are handed the name's id, to be labelled by.
fn named<R>(
    ui: &mut Ui,
    name: impl Into<egui::WidgetText>,
    controls: impl FnOnce(&mut Ui, egui::Id) -> R,
) -> R {
    ui.horizontal(|ui| {
        let start = ui.cursor().left();
        let label = ui.label(name);
        ui.add_space((start + NAME - ui.cursor().left()).max(0.0));
        controls(ui, label.id)
    })
    .inner
}

/// How a slider goes from one end to the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Steps {
    Even,
    Logarithmic,
}

/// A slider with its name, and its value to be written. True when it was changed.
fn slider<N: Numeric>(
    ui: &mut Ui,
    name: &str,
    value: &mut N,
    (number, steps): (Number, Steps),
) -> bool {
    named(ui, name, |ui, label| {
        ui.spacing_mut().slider_width = ui.available_width() - VALUE - ui.spacing().item_spacing.x;
        let range = N::from_f64(*number.range().start())..=N::from_f64(*number.range().end());
        let slider = Slider::new(value, range).show_value(false);
        let moved = ui.add(slider.logarithmic(steps == Steps::Logarithmic)).labelled_by(label);
        let written = number.show(ui, name, value).response.labelled_by(label);
        moved.changed() || written.changed()
    })
}
