//! The shader against plain code: the same light, the same cloth, the same numbers.

use super::bare::Bare;
use eframe::egui;
use egui_kittest::Harness;
use nalgebra::{Point3, UnitVector3, Vector3};
use weavelight_app::viewer::appearance::Appearance;
use weavelight_app::viewer::appearance::Mode;
use weavelight_app::viewer::appearance::sun;
use weavelight_app::viewer::geometry::Geometry;
use weavelight_app::viewer::gpu::install;
use weavelight_app::viewer::map_view::MapView;
use weavelight_app::viewer::maps::Maps;
use weavelight_app::viewer::maps::surface;
use weavelight_app::viewer::scales;
use weavelight_app::viewer::shade;
use weavelight_app::viewer::viewport::Viewport;
use weavelight_calibration::description::{Camera, Light, Plane, PointLight};

/// The screen has 8 bits, the maps half precision: one step for each.
const TOLERANCE: i32 = 2;
/// Pixels of the cloth.
const SIZE: [usize; 2] = [48, 32];
/// Points on the screen per pixel.
const ZOOM: f32 = 8.0;

fn normal(k: usize) -> [f32; 3] {
    let (x, y) = ((k % SIZE[0]) as f32, (k / SIZE[0]) as f32);
    Vector3::new((0.9 * x).sin() * 0.6, (0.5 * y + 0.3 * x).cos() * 0.5, 1.0).normalize().into()
}

fn albedo(k: usize) -> [f32; 3] {
    [0.15 + 0.01 * (k % 37) as f32, 0.4, 0.9 - 0.015 * (k % 23) as f32]
}

/// What was divided out of it.
fn divided_out(k: usize) -> f32 {
    0.5 + 0.03 * (k % 17) as f32
}

/// What a light meets.
fn seen(k: usize) -> [f32; 3] {
    albedo(k).map(|c| c * divided_out(k))
}

fn geometry() -> Geometry {
    let camera = Camera {
        width_px: SIZE[0],
        height_px: SIZE[1],
        fx: 300.0,
        fy: 300.0,
        cx: 23.5,
        cy: 15.5,
        distortion: [-0.1, 0.0, 0.0, 0.0, 0.0],
        camera_from_rig: Camera::looking_down(600.0),
    };
    Geometry::new(SIZE, Some(camera), Plane::table(), 1)
}

fn screen_of(appearance: Appearance) -> impl Fn(usize, usize) -> [i32; 3] {
    let surface = surface(SIZE, &normal, &|k| k as f32 / 300.0);
    let maps = Maps::over(surface, &albedo, &divided_out, geometry());
    let mut view = MapView::default();
    view.go_to(Viewport { centre: SIZE.map(|c| c as f64 / 2.0), zoom: ZOOM });
    let size = SIZE.map(|c| c as f32 * ZOOM);
    let quiet = weavelight::machine::Quiet::begin();
    let builder = Harness::builder().with_size(size).with_render_cursor(false).wgpu();
    let mut window = builder.build_eframe(move |cc| {
        install(&cc.egui_ctx, cc.wgpu_render_state.as_ref());
        Bare { view, maps, appearance }
    });
    drop(quiet);
    window.run();
    let picture = window.render().unwrap();
    move |x, y| {
        let middle = [x, y].map(|c| ((c as f32 + 0.5) * ZOOM) as u32);
        let [r, g, b, _] = picture.get_pixel(middle[0], middle[1]).0;
        [r, g, b].map(i32::from)
    }
}

fn check(name: &str, appearance: Appearance, expected: impl Fn(usize) -> egui::Color32) {
    let screen = screen_of(appearance);
    let mut seen = std::collections::BTreeSet::new();
    for k in 0..SIZE[0] * SIZE[1] {
        let (x, y) = (k % SIZE[0], k / SIZE[0]);
        let [r, g, b, _] = expected(k).to_array().map(i32::from);
        let found = screen(x, y);
        let off = (0..3).map(|c| (found[c] - [r, g, b][c]).abs()).max().unwrap();
        assert!(off <= TOLERANCE, "{name} ({x}, {y}): {found:?} instead of {:?}", [r, g, b]);
        seen.insert(found);
    }
    assert!(seen.len() > 50, "{name}: {} colours are no proof", seen.len());
}

#[test]
fn every_light_shades_as_in_plain_code() {
    let led = PointLight {
        position_mm: Point3::new(60.0, -30.0, 150.0),
        axis: UnitVector3::new_normalize(Vector3::new(-0.3, 0.2, -1.0)),
        exponent: 1.7,
        intensity: [0.02, 0.022, 0.018],
    };
    let base = Appearance::of(Mode::Relit);
    let glossy = Appearance { gloss: 0.1, shininess: 20.0, ..base.clone() };
    let led = |of: &Appearance| Appearance { light: Light::Point(led.clone()), ..of.clone() };
    let sun = |of: &Appearance| Appearance { light: sun(120.0, 25.0), gain: 1.5, ..of.clone() };
    for (name, appearance) in [
        ("led", led(&base)),
        ("glossy led", led(&glossy)),
        ("sun", sun(&base)),
        ("glossy sun", sun(&glossy)),
    ] {
        let geometry = geometry();
        let plain = appearance.clone();
        check(name, appearance, |k| {
            let point = geometry.on_plane([(k % SIZE[0]) as f64, (k / SIZE[0]) as f64]);
            let eye = geometry.eye_mm();
            shade::on_screen(shade::relit(&plain, normal(k), seen(k), &point, &eye))
        });
    }
}

#[test]
fn maps_are_coloured_as_their_legends_say() {
    let byte = |value: f32| (value * 255.0).round() as u8;
    check("normals", Appearance::of(Mode::Normal), |k| {
        let [r, g, b] = normal(k).map(|c| byte(0.5 * c + 0.5));
        egui::Color32::from_rgb(r, g, b)
    });
    check("albedo", Appearance::of(Mode::Albedo), |k| shade::on_screen(albedo(k)));
    check("error", Appearance::of(Mode::Error), |k| scales::heat(k as f32 / 300.0 / 5.0));
}
