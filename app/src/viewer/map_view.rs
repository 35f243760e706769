//! Maps to look at: panned and zoomed to single photosites, under any light. A widget that any room can show.
//!
//! [`MapView::show`] draws [`Maps`] as an `Appearance` says. Pictures lie in main memory as pyramids of half-precision texels;
//! of these only the tiles that are seen go to the graphics card, a few a frame.

use crate::texts::look as texts;
use crate::ui::widgets::Sign;
use crate::viewer::canvas::Canvas;
use crate::viewer::maps::Maps;
use crate::viewer::viewport::Viewport;
use crate::viewer::{gpu, pace, shade};
use eframe::egui;
use eframe::egui::{Color32, Id, PointerButton, Rect, Response, Role, Sense, WidgetInfo, vec2};
use eframe::egui_wgpu::Callback;

/// What a view remembers: which part is seen.
#[derive(Clone, Debug, Default)]
pub struct MapView {
    viewport: Option<Viewport>,
    /// Which maps it belongs to.
    size: [usize; 2],
    pace: pace::Pace,
}

/// Where things are on the screen.
#[derive(Clone, Debug)]
pub struct MapArea {
    /// What the mouse does.
    pub response: Response,
    /// Where.
    pub rect: Rect,
    /// Pan and zoom.
    pub viewport: Viewport,
}

impl MapArea {
    /// Pixel coordinates under the mouse; centre of the first pixel: 0, 0.
    pub fn pixel_under_mouse(&self) -> Option<[f64; 2]> {
        let at = self.response.hover_pos().or(self.response.interact_pointer_pos())?;
        Some(self.viewport.pixel_at(at, self.rect))
    }
}

/// Whether there is a renderer to draw maps with; where not, a view says so and shows none.
pub fn can_draw(ctx: &egui::Context) -> bool {
    gpu::renderer(ctx).is_some()
}

impl MapView {
    /// All of it again, the next time it is shown.
    pub fn fit(&mut self) {
        self.viewport = None;
    }

    /// One pixel of the picture per pixel of the screen.
    pub fn one_to_one(&mut self, ctx: &egui::Context) {
        let centre = match &self.viewport {
            Some(viewport) => viewport.centre,
            None => self.size.map(|length| length as f64 / 2.0),
        };
        self.viewport = Some(Viewport { centre, zoom: 1.0 / ctx.pixels_per_point() });
    }

    /// Goes to a place: pixels from the top left corner, points per pixel.
    pub fn go_to(&mut self, viewport: Viewport) {
        self.viewport = Some(viewport);
    }

    /// Pan and zoom, once shown.
    pub fn viewport(&self) -> Option<Viewport> {
        self.viewport
    }

    /// Draws in all that is left of `ui`; wheel, pinch and drag act.
    pub fn show(&mut self, ui: &mut egui::Ui, canvas: &Canvas) -> MapArea {
        let shown = self.begin(ui, canvas.maps, (canvas.name, canvas.drag_pans));
        self.paint(ui, &shown, canvas);
        shown
    }

    /// The first half of [`MapView::show`]: takes all that is left of `ui`, and what the mouse does there. What the mouse
    /// carries is moved before [`MapView::paint`], so that it is drawn where the mouse is now.
    pub fn begin(
        &mut self,
        ui: &mut egui::Ui,
        maps: &Maps,
        (name, drag_pans): (&str, bool),
    ) -> MapArea {
        let (_, rect) = ui.allocate_space(ui.available_size());
        // Its own name: what else the room shows must not make another view of it in the middle of a drag.
        let id = Id::unique(("map view", name));
        // No stop for the keyboard, which could do nothing here.
        let response = ui.interact(rect, id, Sense::CLICK | Sense::DRAG);
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
        let size = maps.size();
        if self.size != size {
            // Where a place was chosen before the first maps came, it stays.
            self.viewport = self.viewport.filter(|_| self.size == [0, 0]);
            self.size = size;
        }
        let mut viewport = self.viewport.unwrap_or_else(|| Viewport::fit(size, rect));
        let moved = navigate(&mut viewport, ui, &response, (size, rect), drag_pans);
        if moved || self.viewport.is_some() {
            self.viewport = Some(viewport);
        }
        MapArea { response, rect, viewport }
    }

    /// The second half of [`MapView::show`].
    pub fn paint(&mut self, ui: &mut egui::Ui, shown: &MapArea, canvas: &Canvas) {
        let coarse = self.is_coarse(ui.ctx(), shown.rect);
        paint(ui, shown, coarse, canvas);
    }

    /// Whether this frame is drawn at half resolution.
    fn is_coarse(&mut self, ctx: &egui::Context, rect: Rect) -> bool {
        let (dt_s, moved) =
            ctx.input(|input| (input.unstable_dt, input.pointer.delta() != egui::Vec2::ZERO));
        let dragged = ctx.dragged_id().is_some();
        let pixels = rect.area() * ctx.pixels_per_point().powi(2);
        let drawn = self.pace.next((dragged, moved), dt_s, pixels);
        if drawn.again {
            ctx.request_repaint();
        }
        drawn.coarse
    }
}

/// Wheel and pinch zoom, dragging pans. True where something moved.
fn navigate(
    viewport: &mut Viewport,
    ui: &egui::Ui,
    response: &Response,
    (size, rect): ([usize; 2], Rect),
    drag_pans: bool,
) -> bool {
    const POINTS_PER_DOUBLING: f32 = 240.0;
    let before = *viewport;
    let pans = |button| response.dragged_by(button);
    if pans(PointerButton::Middle)
        || pans(PointerButton::Secondary)
        || (drag_pans && pans(PointerButton::Primary))
    {
        viewport.pan(response.drag_delta(), size);
    }
    if let Some(mouse) = response.hover_pos() {
        let (wheel, pinch, shift) = ui.input(|input| {
            (input.smooth_scroll_delta.y, input.zoom_delta(), input.modifiers.shift)
        });
        let factor = if shift { 1.0 } else { (wheel / POINTS_PER_DOUBLING).exp2() * pinch };
        if factor != 1.0 {
            viewport.zoom_at(mouse, factor, size, rect);
        }
    }
    *viewport != before
}

/// There is nothing to draw maps with: that, and the remedy.
fn say_no_graphics(ui: &mut egui::Ui, rect: Rect) {
    let size = vec2(rect.width().min(460.0), rect.height().min(64.0));
    let card = Rect::from_center_size(rect.center(), size);
    ui.painter().rect_filled(card, 6.0, ui.visuals().panel_fill);
    let inside = egui::UiBuilder::new().max_rect(card.shrink(14.0));
    ui.scope_builder(inside, |ui| {
        ui.horizontal_top(|ui| {
            Sign::Bad.ui(ui);
            ui.add(egui::Label::new(texts::NO_GRAPHICS).wrap());
        });
    });
}

fn paint(ui: &mut egui::Ui, shown: &MapArea, coarse: bool, canvas: &Canvas) {
    let (rect, viewport) = (shown.rect, shown.viewport);
    // Neutral, and not so bright that it blinds the eye to the cloth.
    let ground = Color32::from_gray(if ui.visuals().dark_mode { 20 } else { 200 });
    ui.painter().rect_filled(rect, 0.0, ground);
    let Some(renderer) = gpu::renderer(ui.ctx()) else {
        return say_no_graphics(ui, rect);
    };
    let pixels_per_point = ui.ctx().pixels_per_point();
    let drawn_per_point = if coarse { 0.5 * pixels_per_point } else { pixels_per_point };
    let uniform = shade::uniform(
        canvas.appearance,
        &viewport,
        &canvas.maps.geometry,
        (rect.size(), drawn_per_point),
        ground,
        renderer.encoding_target,
    );
    let frame = gpu::Frame {
        id: shown.response.id,
        ctx: ui.ctx().clone(),
        pictures: gpu::Frame::pictures(canvas),
        viewport,
        screen: (rect.size(), pixels_per_point),
        coarse,
        uniform: Box::new(uniform),
    };
    ui.painter().with_clip_rect(rect).add(Callback::new_paint_callback(rect, frame));
}
