//! Where a map's pixels are on the table.

use nalgebra::{Point3, Vector3};
use weavelight_calibration::description::{Camera, Plane};
use weavelight_calibration::projection::Projector;

/// Nodes along each side of the grid that the shader interpolates.
pub(super) const NODES: usize = 17;
/// Width of what is looked at where no camera says how large it is, millimetres.
const NOMINAL_WIDTH_MM: f64 = 100.0;
/// Height of the eye there.
const NOMINAL_EYE_MM: f64 = 600.0;

/// The surface behind the pixels.
#[derive(Clone, Debug)]
pub struct Geometry {
    size: [usize; 2],
    camera: Option<Camera>,
    plane: Plane,
    /// Photosites along a pixel's side.
    scale: f64,
    grid: Vec<[f32; 4]>,
}

impl Geometry {
    /// Maps of `size` pixels, each `scale` photosites wide, of the surface `plane` as `camera` sees it. Without a camera the
    /// picture counts as 100 mm wide, seen from straight above.
    pub fn new(size: [usize; 2], camera: Option<Camera>, plane: Plane, scale: usize) -> Self {
        let mut geometry = Self { size, camera, plane, scale: scale as f64, grid: Vec::new() };
        geometry.grid = (0..NODES * NODES)
            .map(|k| {
                let at = [k % NODES, k / NODES].map(|n| n as f64 / (NODES - 1) as f64);
                let pixel = [0, 1].map(|axis| at[axis] * size[axis] as f64 - 0.5);
                let point = geometry.on_plane(pixel);
                [point.x as f32, point.y as f32, point.z as f32, 0.0]
            })
            .collect();
        geometry
    }

    /// Pixels across and down.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Whether millimetres are millimetres.
    pub fn is_physical(&self) -> bool {
        self.camera.is_some()
    }

    /// Points of the plane at `NODES` x `NODES` places from corner to corner, rig frame, millimetres.
    pub fn grid(&self) -> &[[f32; 4]] {
        &self.grid
    }

    /// The surface's plane.
    pub fn plane(&self) -> &Plane {
        &self.plane
    }

    /// The point of the plane that a pixel (centre of the first: 0, 0) shows, rig frame, millimetres.
    pub fn on_plane(&self, pixel: [f64; 2]) -> Point3<f64> {
        let seen = self.camera.as_ref().and_then(|camera| {
            let photosite = pixel.map(|at| (at + 0.5) * self.scale - 0.5);
            Projector::new(camera).on_plane(photosite, &self.plane)
        });
        seen.unwrap_or_else(|| self.nominal(pixel))
    }

    /// The pixel that shows a point of the rig frame.
    pub fn pixel_of(&self, point_mm: &Point3<f64>) -> Option<[f64; 2]> {
        match &self.camera {
            Some(camera) => {
                let photosite = Projector::new(camera).project(point_mm)?;
                Some(photosite.map(|at| (at + 0.5) / self.scale - 0.5))
            }
            None => {
                let mm = NOMINAL_WIDTH_MM / self.size[0] as f64;
                let middle = self.size.map(|length| (length as f64 - 1.0) / 2.0);
                Some([middle[0] + point_mm.x / mm, middle[1] - point_mm.y / mm])
            }
        }
    }

    /// Size of the middle pixel on the plane, millimetres.
    pub fn mm_per_px(&self) -> f64 {
        let [u, v] = self.size.map(|length| (length as f64 - 1.0) / 2.0);
        (self.on_plane([u + 0.5, v]) - self.on_plane([u - 0.5, v])).norm()
    }

    /// Where the camera looks from.
    pub fn eye_mm(&self) -> Point3<f64> {
        match &self.camera {
            Some(camera) => Projector::new(camera).centre_in_rig_mm(),
            None => self.plane.point_mm + Vector3::z() * NOMINAL_EYE_MM,
        }
    }

    fn nominal(&self, pixel: [f64; 2]) -> Point3<f64> {
        let mm = NOMINAL_WIDTH_MM / self.size[0].max(1) as f64;
        let middle = self.size.map(|length| (length as f64 - 1.0) / 2.0);
        Point3::new((pixel[0] - middle[0]) * mm, (middle[1] - pixel[1]) * mm, self.plane.point_mm.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            width_px: 640,
            height_px: 480,
            fx: 800.0,
            fy: 800.0,
            cx: 320.0,
            cy: 240.0,
            distortion: [-0.1, 0.02, 0.001, 0.0, 0.0],
            camera_from_rig: Camera::looking_down(600.0),
        }
    }

    #[test]
    fn pixels_and_points_go_back_and_forth() {
        for camera in [Some(camera()), None] {
            let geometry = Geometry::new([160, 120], camera, Plane::table(), 4);
            for pixel in [[0.0, 0.0], [79.5, 59.5], [159.0, 3.25]] {
                let back = geometry.pixel_of(&geometry.on_plane(pixel)).unwrap();
                assert!((0..2).all(|k| (back[k] - pixel[k]).abs() < 1e-6), "{pixel:?} {back:?}");
            }
        }
    }

    #[test]
    fn right_is_plus_x_and_up_is_plus_y() {
        for camera in [Some(camera()), None] {
            let geometry = Geometry::new([160, 120], camera, Plane::table(), 4);
            let (first, last) = (geometry.on_plane([0.0, 0.0]), geometry.on_plane([159.0, 119.0]));
            assert!(first.x < last.x && first.y > last.y);
        }
    }
}
