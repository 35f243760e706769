//! A picture larger than what a frame sends to the graphics card: it is there at once, and sharp a few frames later.

use super::bare::Bare;
use egui_kittest::Harness;
use weavelight_app::viewer::appearance::Appearance;
use weavelight_app::viewer::appearance::Mode;
use weavelight_app::viewer::geometry::Geometry;
use weavelight_app::viewer::gpu::install;
use weavelight_app::viewer::map_view::MapView;
use weavelight_app::viewer::maps::Maps;
use weavelight_app::viewer::shade;
use weavelight_app::viewer::viewport::Viewport;
use weavelight_calibration::description::Plane;

/// Pixels of the cloth: 24 tiles, and as many of the albedo.
const SIZE: [usize; 2] = [1500, 1000];
/// Frames until everything must be there, even where memory is so slow that each sends but one tile.
const PATIENCE: usize = 60;

/// Stripes of one pixel, which every coarser level blurs to a grey.
fn albedo(k: usize) -> [f32; 3] {
    if k.is_multiple_of(2) { [0.9; 3] } else { [0.1; 3] }
}

fn window() -> Harness<'static, Bare> {
    let geometry = Geometry::new(SIZE, None, Plane::table(), 1);
    let maps = Maps::new(geometry, &|_| [0.0, 0.0, 1.0], &|_| 0.0, &albedo);
    let mut view = MapView::default();
    view.go_to(Viewport { centre: SIZE.map(|c| c as f64 / 2.0), zoom: 1.0 });
    let size = SIZE.map(|c| c as f32);
    let _quiet = weavelight::machine::Quiet::begin();
    Harness::builder().with_size(size).with_render_cursor(false).wgpu().build_eframe(move |cc| {
        install(&cc.egui_ctx, cc.wgpu_render_state.as_ref());
        Bare { view, maps, appearance: Appearance::of(Mode::Albedo) }
    })
}

/// Share of pixels that show what is there, and share that shows nothing at all.
fn sharp_and_empty(window: &mut Harness<Bare>) -> [f64; 2] {
    let picture = window.render().unwrap();
    let [mut sharp, mut empty] = [0.0; 2];
    for (k, pixel) in picture.pixels().enumerate() {
        let expected = shade::on_screen(albedo(k)).r();
        sharp += if pixel[0].abs_diff(expected) <= 2 { 1.0 } else { 0.0 };
        empty += if pixel[0] < 40 { 1.0 } else { 0.0 };
    }
    [sharp, empty].map(|count: f64| count / (SIZE[0] * SIZE[1]) as f64)
}

#[test]
fn tiles_come_over_several_frames_with_coarser_ones_in_their_place() {
    let mut window = window();
    let [sharp, empty] = sharp_and_empty(&mut window);
    assert!(sharp < 0.9, "{sharp} came in one frame");
    assert!(empty < 0.01, "{empty} of the first frame is empty");
    let mut frames = 1;
    while sharp_and_empty(&mut window)[0] < 1.0 {
        let asks = window.output().viewport_output.values().any(|v| v.repaint_delay.is_zero());
        assert!(frames < PATIENCE, "not sharp after {frames} frames");
        assert!(asks || frames == 1, "nothing asks for frame {frames}");
        window.step();
        frames += 1;
    }
}
