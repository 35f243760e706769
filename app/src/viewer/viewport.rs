//! Which part of a picture is seen, and which tiles that takes.

use crate::viewer::pyramid::{Place, Pyramid, TILE};
use eframe::egui::{Pos2, Rect, Vec2, pos2};

/// The nearest one can go: points on the screen per pixel.
const NEAREST: f32 = 64.0;
/// Share of the rectangle that a fitted picture takes.
const FITTED: f32 = 0.96;
/// Most tiles drawn at once: as many layers as every graphics card has.
const MOST_TILES: usize = 200;

/// Pan and zoom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewport {
    /// The place of the picture in the middle of the screen, pixels from its top left corner.
    pub centre: [f64; 2],
    /// Points on the screen per pixel of the picture.
    pub zoom: f32,
}

impl Viewport {
    /// All of the picture.
    pub fn fit(size: [usize; 2], rect: Rect) -> Self {
        let zoom = (rect.width() / size[0] as f32).min(rect.height() / size[1] as f32) * FITTED;
        Self { centre: size.map(|length| length as f64 / 2.0), zoom: zoom.clamp(1e-3, NEAREST) }
    }

    /// The pixel coordinates (centre of the first pixel: 0, 0) under a place on the screen.
    pub fn pixel_at(&self, at: Pos2, rect: Rect) -> [f64; 2] {
        let offset = (at - rect.center()) / self.zoom;
        [self.centre[0] + f64::from(offset.x) - 0.5, self.centre[1] + f64::from(offset.y) - 0.5]
    }

    /// Where pixel coordinates are on the screen.
    pub fn screen_of(&self, pixel: [f64; 2], rect: Rect) -> Pos2 {
        let offset =
            [0, 1].map(|k| ((pixel[k] + 0.5 - self.centre[k]) * f64::from(self.zoom)) as f32);
        rect.center() + Vec2::from(offset)
    }

    /// Moves the picture with the mouse; some of it stays in sight.
    pub fn pan(&mut self, moved: Vec2, size: [usize; 2]) {
        for (k, moved) in [moved.x, moved.y].into_iter().enumerate() {
            let to = self.centre[k] - f64::from(moved / self.zoom);
            self.centre[k] = to.clamp(0.0, size[k] as f64);
        }
    }

    /// Goes nearer by a factor, with the place under the mouse staying there.
    pub fn zoom_at(&mut self, at: Pos2, factor: f32, size: [usize; 2], rect: Rect) {
        let farthest = (0.5 * Self::fit(size, rect).zoom).min(1.0);
        let before = self.pixel_at(at, rect);
        self.zoom = (self.zoom * factor).clamp(farthest, NEAREST);
        let after = self.pixel_at(at, rect);
        for k in 0..2 {
            self.centre[k] = (self.centre[k] + before[k] - after[k]).clamp(0.0, size[k] as f64);
        }
    }

    /// What is seen, pixels from the picture's top left corner.
    pub fn seen(&self, screen: Vec2) -> Rect {
        let half = screen / (2.0 * self.zoom);
        let centre = pos2(self.centre[0] as f32, self.centre[1] as f32);
        Rect::from_min_max(centre - half, centre + half)
    }

    /// The tiles to draw: of the level whose texels are nearest in size to the screen's, row by row. `screen`: in points.
    pub(super) fn tiles(
        &self,
        pyramid: &Pyramid,
        screen: Vec2,
        pixels_per_point: f32,
    ) -> Vec<Place> {
        let texels_per_pixel = 1.0 / (self.zoom * pixels_per_point);
        let wanted = texels_per_pixel.log2().round().max(0.0) as usize;
        let mut level = wanted.min(pyramid.coarsest());
        loop {
            let places = self.tiles_of(pyramid, screen, level);
            if places.len() <= MOST_TILES || level == pyramid.coarsest() {
                return places;
            }
            level += 1;
        }
    }

    /// Most tiles that [`Viewport::tiles`] can ask for at any place and zoom, and the one that shows all of the picture: what a
    /// view makes room for once, so that zooming never empties it.
    pub(super) fn most_tiles(pyramid: &Pyramid, screen: Vec2, pixels_per_point: f32) -> usize {
        // The level is the nearest one, so that its texels are at least 1 / sqrt 2 of a pixel wide.
        let across = |points: f32| {
            let texels = f64::from(points * pixels_per_point) * std::f64::consts::SQRT_2;
            (texels / TILE as f64).ceil().max(0.0) as usize + 1
        };
        let of_screen = across(screen.x).saturating_mul(across(screen.y)).min(MOST_TILES);
        let of_level = |level| pyramid.tiles(level).iter().product::<usize>();
        of_screen.min(of_level(0)) + 1
    }

    fn tiles_of(&self, pyramid: &Pyramid, screen: Vec2, level: usize) -> Vec<Place> {
        let seen = self.seen(screen);
        let side = (TILE << level) as f32;
        let [across, down] = pyramid.tiles(level);
        let range = |from: f32, to: f32, count: usize| {
            let first = (from / side).floor().max(0.0) as usize;
            first..((to / side).ceil().max(0.0) as usize).min(count)
        };
        let columns = range(seen.min.x, seen.max.x, across);
        range(seen.min.y, seen.max.y, down)
            .flat_map(|y| columns.clone().map(move |x| Place { level, x, y }))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::vec2;
    use half::f16;

    const RECT: Rect = Rect { min: pos2(100.0, 50.0), max: pos2(900.0, 650.0) };

    #[test]
    fn the_place_under_the_mouse_stays_there() {
        let size = [4928, 3264];
        let mut viewport = Viewport::fit(size, RECT);
        let mouse = pos2(333.0, 222.0);
        let before = viewport.pixel_at(mouse, RECT);
        for factor in [1.5, 7.0, 0.9] {
            viewport.zoom_at(mouse, factor, size, RECT);
            let after = viewport.pixel_at(mouse, RECT);
            assert!((0..2).all(|k| (after[k] - before[k]).abs() < 0.01), "{before:?} {after:?}");
        }
        let back = viewport.screen_of(viewport.pixel_at(mouse, RECT), RECT);
        assert!((back - mouse).length() < 0.01);
    }

    #[test]
    fn tiles_cover_what_is_seen_at_about_the_screens_own_scale() {
        let pyramid = Pyramid::new([2000, 1000], &|_, _| [0.0; 4], |_| [f16::ZERO; 4]);
        let check = |zoom: f32, level: usize, count: usize| {
            let viewport = Viewport { centre: [1000.0, 500.0], zoom };
            let tiles = viewport.tiles(&pyramid, vec2(800.0, 600.0), 1.0);
            assert!(tiles.iter().all(|tile| tile.level == level), "zoom {zoom}: {:?}", tiles[0]);
            assert_eq!(tiles.len(), count, "zoom {zoom}");
        };
        check(1.0, 0, 4 * 4);
        check(64.0, 0, 1);
        check(0.4, 1, 4 * 2);
        check(0.01, 3, 1);
    }

    #[test]
    fn there_is_room_for_every_place_and_zoom() {
        let check = |size: [usize; 2], screen: Vec2, pixels_per_point: f32| {
            let pyramid = Pyramid::new(size, &|_, _| [0.0; 4], |_| [f16::ZERO; 4]);
            let room = Viewport::most_tiles(&pyramid, screen, pixels_per_point);
            let mut most = 0;
            for k in 0..400 {
                let zoom = 0.05 * 1.02_f32.powi(k);
                let place = |axis: usize| (k as usize * 7919 % size[axis]) as f64;
                let viewport = Viewport { centre: [place(0), place(1)], zoom };
                most = most.max(viewport.tiles(&pyramid, screen, pixels_per_point).len());
            }
            assert!(most < room && room <= 2 * most + 1, "{size:?}: {most} tiles, room for {room}");
        };
        check([3000, 2000], vec2(800.0, 600.0), 1.0);
        check([3000, 2000], vec2(800.0, 600.0), 1.5);
        check([3000, 2000], vec2(8000.0, 6000.0), 2.0);
        check([144, 96], vec2(800.0, 600.0), 1.0);
    }
}
