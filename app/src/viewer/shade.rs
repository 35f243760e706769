//! The shader's inputs, and its shading in plain code: the reference that it is tested against.

use crate::viewer::appearance::{Appearance, Compose};
use crate::viewer::geometry::{Geometry, NODES};
use crate::viewer::viewport::Viewport;
use eframe::egui::{Color32, Rgba, Vec2};
use nalgebra::{Point3, Vector3};
use weavelight_calibration::description::Light;
use weavelight_calibration::irradiance::light_vector_in_rig;

/// The shader's `View`: eleven vectors and the grid.
pub type Uniform = [[f32; 4]; 11 + NODES * NODES];

/// The shader's inputs of one frame. `screen`: points.
pub fn uniform(
    appearance: &Appearance,
    viewport: &Viewport,
    geometry: &Geometry,
    (screen, pixels_per_point): (Vec2, f32),
    ground: Color32,
    encoding_target: bool,
) -> Uniform {
    let a = appearance;
    let clip = [2.0 * viewport.zoom / screen.x, -2.0 * viewport.zoom / screen.y];
    let divider = if a.compose == Compose::Split { 2.0 * a.divider - 1.0 } else { 1.0 };
    let (lamp, axis) = lamp_and_axis(&a.light);
    let [red, green, blue] = a.light.intensity().map(|c| c as f32);
    let eye = geometry.eye_mm().coords.map(|c| c as f32);
    let [width, height] = geometry.size().map(|length| length as f32);
    let [x, y] = viewport.centre.map(|c| c as f32);
    let s = &a.scales;
    let mut all = [[0.0; 4]; 11 + NODES * NODES];
    let head = [
        [x, y, clip[0], clip[1]],
        [
            viewport.zoom * pixels_per_point,
            divider,
            a.compose as u32 as f32,
            if encoding_target { 1.0 } else { 0.0 },
        ],
        [a.sides[0].mode as u32 as f32, a.sides[1].mode as u32 as f32, a.gain, a.picture_gain],
        [width, height, 0.0, 0.0],
        lamp,
        axis,
        [red, green, blue, 0.0],
        [a.gloss, a.shininess, 0.0, 0.0],
        [s.error_deg, s.slope_deg, s.angle_deg, s.residual],
        [eye.x, eye.y, eye.z, s.difference],
        encoded(ground),
    ];
    all[..head.len()].copy_from_slice(&head);
    all[head.len()..].copy_from_slice(geometry.grid());
    all
}

fn lamp_and_axis(light: &Light) -> ([f32; 4], [f32; 4]) {
    let four = |v: Vector3<f64>, w: f64| [v.x, v.y, v.z, w].map(|c| c as f32);
    match light {
        Light::Point(light) => {
            (four(light.position_mm.coords, 1.0), four(light.axis.into_inner(), light.exponent))
        }
        Light::Directional(light) => (four(light.direction.into_inner(), 0.0), [0.0; 4]),
    }
}

fn encoded(color: Color32) -> [f32; 4] {
    let [r, g, b, _] = color.to_array().map(|c| f32::from(c) / 255.0);
    [r, g, b, 1.0]
}

/// Linear colour of a matte, perhaps slightly glossy cloth at a point: the reference of the shader's `relit`.
///
/// Matte: albedo times n . l, with l the light vector of [`light_vector_in_rig`]. Gloss: Blinn and Phong's lobe as wide as
/// `shininess` says, normalised to keep its energy: (s + 8) / 8 pi (n . h)^s.
pub fn relit(
    appearance: &Appearance,
    normal: [f32; 3],
    albedo: [f32; 3],
    point_mm: &Point3<f64>,
    eye_mm: &Point3<f64>,
) -> [f32; 3] {
    let normal = Vector3::from(normal).cast::<f64>();
    let light = light_vector_in_rig(&appearance.light, point_mm);
    let shading = normal.dot(&light).max(0.0);
    let gloss = match appearance.gloss > 0.0 && shading > 0.0 {
        true => {
            let half_way = (light.normalize() + (eye_mm - point_mm).normalize()).normalize();
            let shininess = f64::from(appearance.shininess);
            let lobe = normal.dot(&half_way).max(0.0).powf(shininess);
            f64::from(appearance.gloss) * (shininess + 8.0) / (8.0 * std::f64::consts::PI) * lobe
        }
        false => 0.0,
    };
    let intensity = appearance.light.intensity();
    std::array::from_fn(|c| {
        let value = (f64::from(albedo[c]) + gloss) * shading * intensity[c];
        value as f32 * appearance.gain
    })
}

/// The colour of a linear value on the screen.
pub fn on_screen(linear: [f32; 3]) -> Color32 {
    let [r, g, b] = linear.map(|c| c.clamp(0.0, 1.0));
    Color32::from(Rgba::from_rgb(r, g, b))
}
