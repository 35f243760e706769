//! The maps with what is drawn over them, and what the mouse does there.

use crate::jobs::look::Command;
use crate::jobs::messages::Request;
use crate::jobs::state::AppState;
use crate::rooms::look::lamp::Kind;
use crate::rooms::look::legend::{line, tag};
use crate::rooms::look::{Look, PickedPhotosite, Tool};
use crate::texts::look as texts;
use crate::ui::theme;
use crate::ui::theme::meaning;
use crate::viewer::appearance::Compose;
use crate::viewer::canvas::Canvas as MapCanvas;
use crate::viewer::geometry::Geometry;
use crate::viewer::map_view::MapArea;
use crate::viewer::map_view::can_draw;
use crate::viewer::profile::along;
use eframe::egui;
use eframe::egui::{
    Align2, Color32, ColorImage, CursorIcon, Pos2, Rect, Sense, Stroke, TextureHandle, Ui, Vec2,
    WidgetInfo, pos2, vec2,
};

/// What is being drawn, and what was drawn for the mask.
#[derive(Default)]
pub(super) struct Canvas {
    /// A stroke of the brush or lasso, pixel coordinates.
    stroke: Vec<[f64; 2]>,
    /// Radius of the brush, pixels of the picture.
    pub(super) brush_px: f64,
    /// Whether the stroke takes away; `None` until that is chosen, or something was painted.
    erases: Option<bool>,
    /// Why the last stroke changed nothing.
    pub(super) without_effect: Option<&'static str>,
    overlay: Option<Overlay>,
    /// The pixel under the mouse.
    pub(super) hovered: Option<[usize; 2]>,
}

/// The mask as it is seen.
struct Overlay {
    texture: TextureHandle,
    key: (u64, [u32; 3], [u32; 2]),
}

impl std::fmt::Debug for Canvas {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("Canvas").field("stroke", &self.stroke.len()).finish_non_exhaustive()
    }
}

/// Points between the texels of the mask's overlay.
const OVERLAY_STEP: f32 = 2.0;
/// What is left out.
const OUTSIDE: Color32 = Color32::from_rgba_premultiplied(110, 48, 0, 130);

impl Look {
    /// The maps and everything over them.
    pub(super) fn maps(&mut self, ui: &mut Ui, app: &mut AppState) {
        let Some(maps) = self.opened.as_ref().map(|opened| opened.maps.clone()) else { return };
        self.lamp.advance(f64::from(ui.input(|input| input.stable_dt)));
        if self.lamp.moves && self.lamp.kind == Kind::Sun {
            ui.ctx().request_repaint();
        }
        let drag_pans = self.tool == Tool::Hand && !self.light_is_in_hand();
        let shown = self.view.begin(ui, &maps, (texts::MAPS, drag_pans));
        self.hovered(&shown, maps.size());
        match self.tool {
            Tool::Hand => self.hand(ui, &shown, &maps.geometry, app),
            Tool::Line => self.draw_line(&shown),
            Tool::Brush | Tool::Lasso => self.paint(&shown, maps.size()),
        }
        self.move_divider(ui, &shown);
        // Only now the light is where the hand is.
        let appearance = self.appearance();
        let canvas =
            MapCanvas { maps: &maps, appearance: &appearance, name: texts::MAPS, drag_pans };
        self.view.paint(ui, &shown, &canvas);
        if !can_draw(ui.ctx()) {
            // Nothing to draw over.
            return;
        }
        let ui = &mut ui.new_child(egui::UiBuilder::new().max_rect(shown.rect));
        ui.set_clip_rect(shown.rect);
        self.show_mask(ui, &shown);
        self.show_light(ui, &shown, &maps.geometry);
        self.show_line(ui, &shown);
        self.show_taken(ui, &shown);
        self.divider(ui, &shown);
        self.captions(ui, &shown);
        self.legend(ui, &shown);
    }

    fn hovered(&mut self, shown: &MapArea, size: [usize; 2]) {
        let under = shown.response.hover_pos().map(|at| shown.viewport.pixel_at(at, shown.rect));
        let hovered = under.and_then(|at| inside(at, size));
        if hovered != self.canvas.hovered {
            // Its numbers were drawn before.
            shown.response.ctx.request_repaint();
        }
        self.canvas.hovered = hovered;
    }

    /// Moves the light; a click takes a photosite.
    fn hand(&mut self, ui: &Ui, shown: &MapArea, geometry: &Geometry, app: &mut AppState) {
        let response = &shown.response;
        if self.light_is_in_hand() {
            if is_dragged(response)
                && let Some(at) = response.interact_pointer_pos()
            {
                self.carry_light(at, shown, geometry);
            }
            let (wheel, shift) =
                ui.input(|input| (input.smooth_scroll_delta, input.modifiers.shift));
            // Some systems turn the wheel sideways while shift is held.
            let turned = if wheel.y == 0.0 { wheel.x } else { wheel.y };
            if shift && turned != 0.0 && response.hovered() {
                let factor = f64::from((turned / 400.0).exp2());
                self.lamp.height_mm = (self.lamp.height_mm * factor).clamp(5.0, 2000.0);
            }
        }
        if response.clicked()
            && let Some(at) = shown.pixel_under_mouse().and_then(|at| inside(at, geometry.size()))
        {
            self.take_photosite(at, app);
        }
    }

    fn carry_light(&mut self, at: Pos2, shown: &MapArea, geometry: &Geometry) {
        if self.lamp.kind == Kind::Sun {
            let rect = shown.rect;
            let from_middle = (at - rect.center()) / (0.5 * rect.size().min_elem());
            let from_zenith = f64::from(from_middle.length()).min(0.99);
            let azimuth = f64::from(-from_middle.y).atan2(f64::from(from_middle.x));
            self.lamp.azimuth_deg = azimuth.to_degrees().rem_euclid(360.0);
            self.lamp.elevation_deg = from_zenith.acos().to_degrees();
            return;
        }
        let point = geometry.on_plane(shown.viewport.pixel_at(at, shown.rect));
        self.lamp.at_mm = [point.x, point.y];
    }

    /// Asks which lights a photosite rests on.
    pub(super) fn take_photosite(&mut self, at: [usize; 2], app: &mut AppState) {
        let Some(opened) = &self.opened else { return };
        let capture = opened.capture();
        let found = if capture.is_some() { None } else { Some(None) };
        if let Some(capture) = capture {
            app.request(Request::Look(Command::Photosite(capture.sources.clone(), at)));
        }
        self.taken = Some(PickedPhotosite { at, found });
    }

    fn draw_line(&mut self, shown: &MapArea) {
        let response = &shown.response;
        let Some(at) = shown.pixel_under_mouse() else { return };
        if response.drag_started_by(egui::PointerButton::Primary) {
            // Where the button went down, not where the mouse is since.
            let start = response.interact_pointer_pos().map_or(at, |now| {
                let moved = response.total_drag_delta().unwrap_or_default();
                shown.viewport.pixel_at(now - moved, shown.rect)
            });
            self.set_line(Some([start, at]));
        }
        if is_dragged(response)
            && let Some(line) = &mut self.line
        {
            line[1] = at;
            self.measure();
        }
        if response.clicked() {
            self.set_line(None);
        }
    }

    /// Looks up what lies along the line.
    pub(super) fn measure(&mut self) {
        let maps = self.opened.as_ref().map(|opened| &opened.maps);
        self.profile = maps.zip(self.line).map(|(maps, line)| along(maps, line));
    }

    /// Draws with the mouse; with the button let go, that is a step of the mask.
    fn paint(&mut self, shown: &MapArea, size: [usize; 2]) {
        let response = &shown.response;
        if response.hovered() {
            response.ctx.set_cursor_icon(CursorIcon::Crosshair);
        }
        if self.awaits_draft {
            return;
        }
        let mask = self.opened.as_ref().and_then(|o| o.capture()).and_then(|c| c.mask.as_ref());
        self.painting.get_or_insert_with(|| crate::viewer::mask::Painting::new(size, mask));
        if self.canvas.follow(shown) {
            self.finish_stroke();
        }
    }

    /// What was drawn so far is a step of the mask.
    pub(super) fn finish_stroke(&mut self) {
        let Some(painting) = &mut self.painting else { return };
        let canvas = &mut self.canvas;
        let stroke = std::mem::take(&mut canvas.stroke);
        if stroke.is_empty() {
            return;
        }
        let erases = canvas.erases(Some(painting));
        canvas.set_erases(erases);
        let mask = painting.mask();
        let radius = canvas.radius_px([mask.width, mask.height]);
        let changed = match self.tool {
            Tool::Lasso => painting.lasso(&stroke, !erases),
            _ => painting.brush(&stroke, radius, !erases),
        };
        canvas.without_effect = match (changed, erases) {
            (true, _) => None,
            (false, true) => Some(texts::LEFT_OUT_ALREADY),
            (false, false) => Some(texts::KEPT_ALREADY),
        };
        if changed {
            self.edits.changed_mask();
        }
    }

    fn show_mask(&mut self, ui: &Ui, shown: &MapArea) {
        let Some(painting) = &self.painting else { return };
        let canvas = &mut self.canvas;
        let viewport = shown.viewport;
        let key = (
            painting.version,
            [viewport.centre[0] as f32, viewport.centre[1] as f32, viewport.zoom].map(f32::to_bits),
            [shown.rect.width() as u32, shown.rect.height() as u32],
        );
        if canvas.overlay.as_ref().is_none_or(|overlay| overlay.key != key) {
            let image = overlay(painting.mask(), shown);
            let options = egui::TextureOptions::NEAREST;
            match &mut canvas.overlay {
                Some(old) => {
                    old.texture.set(image, options);
                    old.key = key;
                }
                None => {
                    let texture = ui.ctx().load_texture("mask", image, options);
                    canvas.overlay = Some(Overlay { texture, key });
                }
            }
        }
        if let Some(overlay) = &canvas.overlay {
            let all = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            ui.painter().image(overlay.texture.id(), shown.rect, all, Color32::WHITE);
        }
        let points: Vec<Pos2> =
            canvas.stroke.iter().map(|at| viewport.screen_of(*at, shown.rect)).collect();
        let radius =
            (canvas.radius_px([painting.mask().width, 0]) * f64::from(viewport.zoom)) as f32;
        let erases = canvas.erases(Some(painting));
        let color = if erases { meaning::WARNING } else { meaning::ACTIVE };
        if self.tool == Tool::Brush {
            if let Some(at) = shown.response.hover_pos() {
                ui.painter().circle_stroke(at, radius, Stroke::new(1.5, color));
            }
            let stroke = Stroke::new(2.0 * radius, color.gamma_multiply(0.4));
            ui.painter().line(points, stroke);
        } else {
            ui.painter().line(points, Stroke::new(2.0, color));
        }
    }

    /// The lamp, the sun, or the rig's light, where it is.
    fn show_light(&self, ui: &Ui, shown: &MapArea, geometry: &Geometry) {
        if !self.layers.shows(crate::rooms::look::layer::Layer::Relit) {
            return;
        }
        let (at, text) = match self.lamp.kind {
            Kind::Lamp => {
                let mut foot = self.lamp.position_mm(geometry);
                foot.z = geometry.plane().point_mm.z;
                let Some(pixel) = geometry.pixel_of(&foot) else { return };
                let height = if geometry.is_physical() {
                    texts::length(self.lamp.height_mm.round())
                } else {
                    String::new()
                };
                (shown.viewport.screen_of(pixel, shown.rect), height)
            }
            Kind::Sun => {
                let (azimuth, elevation) =
                    (self.lamp.azimuth_deg.to_radians(), self.lamp.elevation_deg.to_radians());
                let reach = 0.5 * f64::from(shown.rect.size().min_elem()) * elevation.cos();
                let offset = vec2((reach * azimuth.cos()) as f32, -(reach * azimuth.sin()) as f32);
                (shown.rect.center() + offset, format!("{:.0}°", self.lamp.elevation_deg))
            }
            Kind::Rig => return,
        };
        let at = shown.rect.shrink(14.0).clamp(at);
        let painter = ui.painter();
        painter.circle_filled(at, 9.0, meaning::LIT);
        painter.circle_stroke(at, 9.0, Stroke::new(2.0, Color32::from_black_alpha(180)));
        if self.lamp.kind == Kind::Sun {
            for k in 0..8 {
                let (sin, cos) = (k as f32 * std::f32::consts::FRAC_PI_4).sin_cos();
                let ray = vec2(cos, sin);
                line(painter, [at + 12.0 * ray, at + 17.0 * ray], meaning::LIT);
            }
        }
        if !text.is_empty() {
            let right = at.x + 90.0 > shown.rect.right();
            let (aside, align) =
                if right { (-24.0, Align2::RIGHT_CENTER) } else { (24.0, Align2::LEFT_CENTER) };
            tag(ui, at + vec2(aside, 0.0), align, &text);
        }
    }

    fn show_line(&self, ui: &Ui, shown: &MapArea) {
        let (Some(ends), Some(profile)) = (self.line, &self.profile) else { return };
        let [from, to] = ends.map(|at| shown.viewport.screen_of(at, shown.rect));
        line(ui.painter(), [from, to], meaning::LIT);
        for end in [from, to] {
            ui.painter().circle_filled(end, 4.0, meaning::LIT);
        }
        let physical =
            self.opened.as_ref().is_some_and(|opened| opened.maps.geometry.is_physical());
        let length = match physical {
            true => texts::length(profile.length_mm),
            false => texts::pixels((ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1])),
        };
        tag(ui, from + (to - from) / 2.0 + vec2(0.0, -16.0), Align2::CENTER_BOTTOM, &length);
    }

    fn show_taken(&self, ui: &Ui, shown: &MapArea) {
        let Some(taken) = &self.taken else { return };
        let [x, y] = taken.at.map(|c| c as f64);
        let rect = Rect::from_two_pos(
            shown.viewport.screen_of([x - 0.5, y - 0.5], shown.rect),
            shown.viewport.screen_of([x + 0.5, y + 0.5], shown.rect),
        );
        let rect = Rect::from_center_size(rect.center(), rect.size().max(vec2(9.0, 9.0)));
        let outside = egui::StrokeKind::Outside;
        ui.painter().rect_stroke(rect.expand(1.0), 1.0, Stroke::new(3.0, Color32::BLACK), outside);
        ui.painter().rect_stroke(rect.expand(1.0), 1.0, Stroke::new(1.5, meaning::LIT), outside);
    }

    /// The line between two sides is dragged.
    fn move_divider(&mut self, ui: &Ui, shown: &MapArea) {
        if self.layers.compose != Compose::Split {
            return;
        }
        let [top, bottom] = self.divider_ends(shown);
        let grip = Rect::from_two_pos(top, bottom).expand2(vec2(6.0, 0.0));
        let response = ui.interact(grip, egui::Id::unique("divider"), Sense::DRAG);
        let share = f64::from(self.layers.divider);
        response.widget_info(|| WidgetInfo::slider(true, share, texts::DIVIDER));
        if response.dragged() {
            let moved = response.drag_delta().x / shown.rect.width().max(1.0);
            self.layers.divider = (self.layers.divider + moved).clamp(0.02, 0.98);
        }
        if response.hovered() || response.dragged() {
            ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
        }
    }

    fn divider_ends(&self, shown: &MapArea) -> [Pos2; 2] {
        let x = shown.rect.left() + self.layers.divider * shown.rect.width();
        [pos2(x, shown.rect.top()), pos2(x, shown.rect.bottom())]
    }

    /// The line between two sides.
    fn divider(&self, ui: &Ui, shown: &MapArea) {
        if self.layers.compose != Compose::Split {
            return;
        }
        let ends = self.divider_ends(shown);
        line(ui.painter(), ends, Color32::WHITE);
        let knob = pos2(ends[0].x, shown.rect.center().y);
        ui.painter().circle_filled(knob, 8.0, Color32::WHITE);
        ui.painter().circle_stroke(knob, 8.0, Stroke::new(2.0, Color32::from_black_alpha(160)));
    }

    /// What each side shows, where there are two; and what is still being made.
    fn captions(&self, ui: &Ui, shown: &MapArea) {
        let rect = shown.rect.shrink(theme::GAP + 4.0);
        let named = |k: usize| {
            let layer = self.layers.sides[k];
            match layer {
                crate::rooms::look::layer::Layer::Frame
                | crate::rooms::look::layer::Layer::Residual => {
                    format!("{} · {}", layer.name(), texts::light(self.lamp.light))
                }
                _ => layer.name().to_owned(),
            }
        };
        match self.layers.compose {
            Compose::Single => {}
            Compose::Split => {
                tag(ui, rect.left_top(), Align2::LEFT_TOP, &named(0));
                tag(ui, rect.right_top(), Align2::RIGHT_TOP, &named(1));
            }
            Compose::Difference => {
                let both = format!("{} − {}", named(0), named(1));
                tag(ui, rect.left_top(), Align2::LEFT_TOP, &both);
            }
        }
        if self.awaited.is_some() {
            tag(ui, rect.center_top(), Align2::CENTER_TOP, texts::BEING_MADE);
        }
    }
}

impl Canvas {
    /// Whether strokes take away: as chosen, else they do, so that the first one over the cloth changes something.
    pub(super) fn erases(&self, painting: Option<&crate::viewer::mask::Painting>) -> bool {
        self.erases.unwrap_or_else(|| painting.is_none_or(|painting| !painting.is_empty()))
    }

    pub(super) fn set_erases(&mut self, erases: bool) {
        self.erases = Some(erases);
        self.without_effect = None;
    }

    /// Follows the first button through everything that happened since the last frame: where frames are slow, a whole stroke.
    /// True when the button was let go.
    fn follow(&mut self, shown: &MapArea) -> bool {
        let response = &shown.response;
        let ctx = &response.ctx;
        let first = egui::PointerButton::Primary;
        let (events, down) =
            ctx.input(|input| (input.events.clone(), input.pointer.button_down(first)));
        let begins_here = |at: Pos2| {
            let on_top = ctx.layer_id_at(at).is_none_or(|layer| layer == response.layer_id);
            let free = ctx.dragged_id().is_none_or(|id| id == response.id);
            shown.rect.contains(at) && on_top && free
        };
        let mut drawing = !self.stroke.is_empty();
        for event in events {
            let (at, ends) = match event {
                egui::Event::PointerButton { pos, button, pressed, .. } if button == first => {
                    drawing |= pressed && begins_here(pos);
                    (pos, !pressed)
                }
                egui::Event::PointerMoved(pos) => (pos, false),
                _ => continue,
            };
            if drawing {
                self.stroke.push(shown.viewport.pixel_at(at, shown.rect));
            }
            if drawing && ends {
                return true;
            }
        }
        // It was let go while another room was drawn.
        drawing && !down
    }

    /// Radius of the brush: as set, else a fiftieth of the picture.
    pub(super) fn radius_px(&self, size: [usize; 2]) -> f64 {
        if self.brush_px > 0.0 { self.brush_px } else { (size[0] as f64 / 50.0).max(1.0) }
    }
}

/// Whether the first button drags, or has just let go: where it did so is the last place of the drag.
fn is_dragged(response: &egui::Response) -> bool {
    let button = egui::PointerButton::Primary;
    response.dragged_by(button) || response.drag_stopped_by(button)
}

/// The pixel at pixel coordinates.
fn inside(at: [f64; 2], size: [usize; 2]) -> Option<[usize; 2]> {
    let [x, y] = at.map(f64::round);
    let within = x >= 0.0 && y >= 0.0 && x < size[0] as f64 && y < size[1] as f64;
    within.then_some([x as usize, y as usize])
}

/// What is outside the mask, as it is seen.
fn overlay(mask: &weavelight_calibration::description::Image<bool>, shown: &MapArea) -> ColorImage {
    let (columns, rows) = (
        (shown.rect.width() / OVERLAY_STEP).ceil().max(1.0) as usize,
        (shown.rect.height() / OVERLAY_STEP).ceil().max(1.0) as usize,
    );
    // The picture is not turned: columns of the screen are columns of the picture, and rows rows.
    let at = |share: Vec2| shown.viewport.pixel_at(shown.rect.min + share, shown.rect);
    let place = |k: usize, count: usize, length: f32| (k as f32 + 0.5) / count as f32 * length;
    let within = |at: f64, length: usize| {
        let at = at.round();
        (at >= 0.0 && at < length as f64).then_some(at as usize)
    };
    let of_columns: Vec<Option<usize>> = (0..columns)
        .map(|k| within(at(vec2(place(k, columns, shown.rect.width()), 0.0))[0], mask.width))
        .collect();
    let mut pixels = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        let y = at(vec2(0.0, place(row, rows, shown.rect.height())))[1];
        let line = within(y, mask.height).map(|y| mask.row(y));
        let left_out = |x: &Option<usize>| line.zip(*x).is_some_and(|(line, x)| !line[x]);
        let color = |x| if left_out(x) { OUTSIDE } else { Color32::TRANSPARENT };
        pixels.extend(of_columns.iter().map(color));
    }
    ColorImage::new([columns, rows], pixels)
}
