//! The camera as the renderer uses it: where a pixel looks, where a point lands, and how much light the lens loses.

use nalgebra::{Point3, Vector3};
use weavelight_calibration::description::{Camera, Plane};

/// A camera with what its lens does to the light.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Pinhole, distortion, pose.
    pub camera: Camera,
    /// Share of light lost at the corner farthest from the principal point; grows with the square of the distance.
    pub vignetting: f64,
    /// Gaussian blur of lens and optical low-pass filter together: its standard deviation, photosites. 0: none.
    pub psf_px: f64,
}

/// A ray in the rig frame: millimetres, unit direction away from the camera.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// The camera's centre.
    pub origin: Point3<f64>,
    /// Where it looks.
    pub direction: Vector3<f64>,
}

impl Ray {
    /// Where it meets a plane; `None` where it runs along it or away from it.
    pub fn meet(&self, plane: &Plane) -> Option<Point3<f64>> {
        let approach = self.direction.dot(&plane.normal);
        let t = (plane.point_mm - self.origin).dot(&plane.normal) / approach;
        (t.is_finite() && t > 0.0).then(|| self.origin + self.direction * t)
    }
}

impl View {
    /// The camera's centre, rig frame, millimetres.
    pub fn center(&self) -> Point3<f64> {
        self.camera.camera_from_rig.inverse_transform_point(&Point3::origin())
    }

    /// Pixel coordinates of a point in the rig frame; `None` behind the camera.
    pub fn project(&self, point: &Point3<f64>) -> Option<[f64; 2]> {
        let p = self.camera.camera_from_rig.transform_point(point);
        if p.z <= 0.0 {
            return None;
        }
        let (bent, _) = bend(&self.camera.distortion, [p.x / p.z, p.y / p.z]);
        Some([self.camera.fx * bent[0] + self.camera.cx, self.camera.fy * bent[1] + self.camera.cy])
    }

    /// The ray through a pixel coordinate.
    pub fn ray(&self, u: f64, v: f64) -> Ray {
        let straight = self.straighten(u, v);
        let direction = Vector3::new(straight[0], straight[1], 1.0).normalize();
        Ray {
            origin: self.center(),
            direction: self.camera.camera_from_rig.rotation.inverse_transform_vector(&direction),
        }
    }

    /// Normalised coordinates without distortion, by Newton's iteration on the distortion.
    fn straighten(&self, u: f64, v: f64) -> [f64; 2] {
        let target = [(u - self.camera.cx) / self.camera.fx, (v - self.camera.cy) / self.camera.fy];
        let mut at = target;
        for _ in 0..20 {
            let (bent, [[a, b], [c, d]]) = bend(&self.camera.distortion, at);
            let miss = [target[0] - bent[0], target[1] - bent[1]];
            let determinant = a * d - b * c;
            if miss[0].abs().max(miss[1].abs()) < 1e-13 || determinant.abs() < 1e-9 {
                break;
            }
            at[0] += (d * miss[0] - b * miss[1]) / determinant;
            at[1] += (a * miss[1] - c * miss[0]) / determinant;
        }
        at
    }

    /// Share of the light that the lens passes at a pixel coordinate.
    pub fn transmission(&self, u: f64, v: f64) -> f64 {
        let (cx, cy) = (self.camera.cx, self.camera.cy);
        let (right, bottom) =
            (self.camera.width_px as f64 - 1.0, self.camera.height_px as f64 - 1.0);
        let far = cx.max(right - cx).hypot(cy.max(bottom - cy));
        1.0 - self.vignetting * ((u - cx).powi(2) + (v - cy).powi(2)) / far.powi(2)
    }

    /// Millimetres on the table per pixel, at the middle of the picture.
    pub fn mm_per_px(&self) -> f64 {
        let height = self.camera.camera_from_rig.transform_point(&Point3::origin()).z;
        height.abs() / self.camera.fx
    }
}

/// Brown's distortion of a normalised point and its Jacobian (rows: x'', y'').
///
/// D. C. Brown, "Decentering distortion of lenses", 1966, with the coefficients k1, k2, p1, p2, k3.
fn bend(coefficients: &[f64; 5], [x, y]: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
    let [k1, k2, p1, p2, k3] = *coefficients;
    let (xx, yy, xy) = (x * x, y * y, x * y);
    let s = xx + yy;
    let radial = 1.0 + s * (k1 + s * (k2 + s * k3));
    let slope = k1 + s * (2.0 * k2 + 3.0 * k3 * s); // d radial / d s
    let bent = [
        x * radial + 2.0 * p1 * xy + p2 * (s + 2.0 * xx),
        y * radial + p1 * (s + 2.0 * yy) + 2.0 * p2 * xy,
    ];
    let cross = 2.0 * xy * slope + 2.0 * p1 * x + 2.0 * p2 * y;
    let jacobian = [
        [radial + 2.0 * xx * slope + 2.0 * p1 * y + 6.0 * p2 * x, cross],
        [cross, radial + 2.0 * yy * slope + 6.0 * p1 * y + 2.0 * p2 * x],
    ];
    (bent, jacobian)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::reference_camera;

    fn view() -> View {
        View { camera: reference_camera(4928, 3264, 1), vignetting: 0.2, psf_px: 0.0 }
    }

    #[test]
    fn a_pixel_looks_at_the_point_that_lands_on_it() {
        let view = view();
        let plane = Plane::table();
        for (i, j) in (0..=12).flat_map(|i| (0..=8).map(move |j| (i, j))) {
            let (u, v) = (4927.0 * f64::from(i) / 12.0, 3263.0 * f64::from(j) / 8.0);
            let point = view.ray(u, v).meet(&plane).unwrap();
            let [u2, v2] = view.project(&point).unwrap();
            assert!((u - u2).hypot(v - v2) < 1e-8, "({u}, {v}) comes back as ({u2}, {v2})");
        }
    }

    #[test]
    fn the_jacobian_is_the_finite_difference() {
        let coefficients = [-0.09, 0.04, 3e-4, -2e-4, 0.01];
        let (at, step) = ([0.21, -0.17], 1e-6);
        let (_, jacobian) = bend(&coefficients, at);
        for k in 0..2 {
            let moved = |by: f64| {
                let mut p = at;
                p[k] += by;
                bend(&coefficients, p).0
            };
            let (plus, minus) = (moved(step), moved(-step));
            for row in 0..2 {
                let numeric = (plus[row] - minus[row]) / (2.0 * step);
                assert!((numeric - jacobian[row][k]).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn the_picture_is_the_right_way_up() {
        let view = view();
        let at = |x, y| view.project(&Point3::new(x, y, 0.0)).unwrap();
        let (middle, right, top) = (at(0.0, 0.0), at(50.0, 0.0), at(0.0, 50.0));
        assert!(right[0] > middle[0] + 500.0 && top[1] < middle[1] - 500.0);
    }

    #[test]
    fn the_farthest_corner_loses_what_was_asked() {
        let view = view();
        let corners = [(0.0, 0.0), (4927.0, 0.0), (0.0, 3263.0), (4927.0, 3263.0)];
        let darkest = corners.iter().map(|&(u, v)| view.transmission(u, v)).fold(1.0, f64::min);
        assert!((darkest - 0.8).abs() < 1e-12);
        assert_eq!(view.transmission(view.camera.cx, view.camera.cy), 1.0);
    }
}
