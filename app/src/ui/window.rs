//! The size of the window: chosen for the screen at the first start, remembered from then on.
//!
//! Sizes are in the system's logical pixels, which the window's own scale does not change: 200 % makes everything in the window
//! larger, not the window smaller at the next start.

use crate::model::settings::Settings;
use eframe::egui;
use eframe::egui::{Vec2, ViewportCommand, vec2};

/// Size of the first window until the screen is known, logical pixels.
const FIRST: Vec2 = vec2(1120.0, 700.0);
/// What the rooms are laid out for, logical pixels.
const IDEAL: Vec2 = vec2(1280.0, 800.0);
/// Share of a screen that is left by panels and the window's title bar.
const SHARE: Vec2 = vec2(0.92, 0.85);
/// The smallest window in which every room can be used, logical pixels.
const SMALLEST: Vec2 = vec2(640.0, 400.0);
/// A size counts when it has not changed for this long, seconds: while a window is being maximised, its size changes first.
const SETTLED_S: f64 = 0.5;

/// The window as it was when it was closed.
pub fn builder(settings: &Settings) -> egui::ViewportBuilder {
    egui::ViewportBuilder::default()
        .with_inner_size(settings.window_size.map_or(FIRST, Vec2::from))
        .with_min_inner_size(SMALLEST)
        .with_maximized(settings.maximized)
}

/// The first window on a screen of this size, logical pixels.
fn first_on(screen: Vec2) -> Vec2 {
    IDEAL.min(screen * SHARE).max(SMALLEST)
}

/// Follows the size of the window.
#[derive(Debug)]
pub struct Geometry {
    /// The screen is still to be asked for the first size.
    first: bool,
    /// There is a screen; not every frame says so.
    on_screen: bool,
    /// It is to be maximised as it was, once it is on the screen.
    maximizes: bool,
    /// The number of the first frame.
    first_frame: Option<u64>,
    size: Vec2,
    since_s: f64,
}

/// What the system says of the window.
struct Seen {
    /// Logical pixels.
    size: Vec2,
    maximized: bool,
    /// Not as large as the user has made it.
    hidden: bool,
    now_s: f64,
}

impl Geometry {
    /// Begins with the settings as they were kept.
    pub fn new(settings: &Settings) -> Self {
        Self {
            first: settings.window_size.is_none(),
            on_screen: false,
            maximizes: settings.maximized,
            first_frame: None,
            size: Vec2::ZERO,
            since_s: 0.0,
        }
    }

    /// A window is created hidden and shown with its first frame. A window manager of X11 ignores that a hidden one is to be
    /// maximised, so it is asked once more.
    fn maximize(&mut self, ctx: &egui::Context, seen: &Seen) {
        let frame = ctx.cumulative_frame_nr();
        if frame <= *self.first_frame.get_or_insert(frame) {
            return ctx.request_repaint();
        }
        self.maximizes = false;
        if !seen.maximized {
            ctx.send_viewport_cmd(ViewportCommand::Maximized(true));
        }
    }

    /// Remembers size and scale; the first time, fits the window to the screen.
    pub fn follow(&mut self, ctx: &egui::Context, settings: &mut Settings) {
        let scale = ctx.zoom_factor();
        // Control with plus and minus changes it, too.
        settings.scale = scale;
        let (seen, screen) = ctx.input(|input| {
            let window = input.viewport();
            let is = |state: Option<bool>| state.unwrap_or(false);
            let seen = Seen {
                size: input.content_rect().size() * scale,
                maximized: is(window.maximized),
                hidden: is(window.minimized) || is(window.fullscreen),
                now_s: input.time,
            };
            (seen, window.monitor_size.map(|points| points * scale))
        });
        self.on_screen |= screen.is_some();
        if let Some(screen) = screen.filter(|screen| self.first && screen.min_elem() > 0.0) {
            self.first = false;
            if !seen.maximized {
                let size = first_on(screen) / scale;
                ctx.send_viewport_cmd(ViewportCommand::InnerSize(size));
            }
        }
        if self.maximizes {
            return self.maximize(ctx, &seen);
        }
        if !self.remember(&seen, settings) && self.on_screen {
            // A window that nothing happens in draws no frame.
            ctx.request_repaint_after_secs(SETTLED_S as f32);
        }
    }

    /// Whether the size has settled.
    fn remember(&mut self, seen: &Seen, settings: &mut Settings) -> bool {
        if seen.size != self.size {
            (self.size, self.since_s) = (seen.size, seen.now_s);
        }
        if seen.hidden {
            return true;
        }
        if seen.now_s - self.since_s < SETTLED_S {
            return false;
        }
        settings.maximized = seen.maximized;
        if !seen.maximized {
            settings.window_size = Some(self.size.round().into());
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_window_fits_its_screen() {
        let check = |screen: [f32; 2], expected: [f32; 2]| {
            assert_eq!(first_on(screen.into()).round(), Vec2::from(expected), "{screen:?}");
        };
        check([1280.0, 800.0], [1178.0, 680.0]);
        check([1920.0, 1080.0], [1280.0, 800.0]);
        check([1366.0, 768.0], [1257.0, 653.0]);
        check([1024.0, 600.0], [942.0, 510.0]);
        check([600.0, 300.0], SMALLEST.into());
    }

    #[test]
    fn a_maximised_window_keeps_the_size_that_it_goes_back_to() {
        let mut settings = Settings::default();
        let mut geometry = Geometry::new(&settings);
        let mut see = |size: [f32; 2], maximized, now_s| {
            let seen = Seen { size: size.into(), maximized, hidden: false, now_s };
            geometry.remember(&seen, &mut settings);
            (settings.window_size, settings.maximized)
        };
        let normal = [1000.0, 700.0];
        see(normal, false, 0.0);
        assert_eq!(see(normal, false, 1.0), (Some(normal), false));
        // The size comes first, the word that it is maximised after it.
        assert_eq!(see([1920.0, 1040.0], false, 1.1), (Some(normal), false));
        assert_eq!(see([1920.0, 1040.0], true, 1.2), (Some(normal), false));
        assert_eq!(see([1920.0, 1040.0], true, 2.0), (Some(normal), true));
        assert_eq!(see(normal, true, 2.1), (Some(normal), true));
        assert_eq!(see(normal, false, 2.2), (Some(normal), true));
        assert_eq!(see(normal, false, 3.0), (Some(normal), false));
    }
}
