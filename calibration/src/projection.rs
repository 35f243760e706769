//! Where a point of the scene lands in the picture, and what a pixel sees: OpenCV's pinhole with Brown-Conrady
//! distortion, both ways.
//!
//! Brown, "Close-range camera calibration", Photogrammetric Engineering 37(8), 1971, with OpenCV's symbols: for an
//! undistorted point (x, y) on the plane z = 1 of the camera frame and r^2 = x^2 + y^2,
//!
//! x'' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2)
//! y'' = y (1 + k1 r^2 + k2 r^4 + k3 r^6) + p1 (r^2 + 2 y^2) + 2 p2 x y

use crate::description::{Camera, Plane};
use nalgebra::{Matrix2, Point3, UnitVector3, Vector2, Vector3};

/// A lens: the distortion and how far out it can be undone.
#[derive(Clone, Debug, PartialEq)]
pub struct Lens {
    /// k1, k2, p1, p2, k3.
    coefficients: [f64; 5],
    /// Square of the undistorted radius at which the radial part stops growing (infinite where it never does). Beyond it
    /// the picture folds back on itself and one pixel would show two places.
    fold_radius_squared: f64,
}

/// A line of sight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The camera's centre of projection, rig frame, millimetres.
    pub origin_mm: Point3<f64>,
    /// Away from the camera, rig frame.
    pub direction: UnitVector3<f64>,
}

/// A camera made ready for many points.
#[derive(Clone, Debug)]
pub struct Projector<'a> {
    camera: &'a Camera,
    lens: Lens,
    centre_in_rig_mm: Point3<f64>,
}

/// A Newton step below this (in units of the focal length) ends the search: 1e-10 px at any focal length in use.
const CONVERGED: f64 = 1e-14;
/// Newton converges in four or five steps; strong distortion near the fold takes more.
const MAX_STEPS: usize = 40;
/// Steps of the way from the axis to a point that plain Newton cannot reach.
const CONTINUATION_STEPS: usize = 32;

impl Lens {
    /// A lens with OpenCV's k1, k2, p1, p2, k3.
    pub fn new(coefficients: [f64; 5]) -> Self {
        let [k1, k2, _, _, k3] = coefficients;
        let fold_radius_squared = first_positive_root([1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3]);
        Self { coefficients, fold_radius_squared }
    }

    /// Distorted place of an undistorted point; both in units of the focal length. Defined everywhere, but meaningful
    /// only where [`Lens::is_invertible_at`].
    pub fn distort(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [k1, k2, p1, p2, k3] = self.coefficients;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    }

    /// Derivative of [`Lens::distort`]: rows x'', y''; columns x, y.
    pub fn jacobian(&self, [x, y]: [f64; 2]) -> Matrix2<f64> {
        let [k1, k2, p1, p2, k3] = self.coefficients;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        let mixed = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
        Matrix2::new(
            radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
            mixed,
            mixed,
            radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
        )
    }

    /// Whether an undistorted point lies inside the fold, so that its picture shows it alone.
    pub fn is_invertible_at(&self, point: [f64; 2]) -> bool {
        let [x, y] = point;
        x * x + y * y < self.fold_radius_squared && self.jacobian(point).determinant() > 0.0
    }

    /// Undistorted place of a distorted point, to 1e-12; `None` where the lens shows nothing (beyond the fold) or the
    /// point is not finite.
    pub fn undistort(&self, distorted: [f64; 2]) -> Option<[f64; 2]> {
        if !distorted.iter().all(|c| c.is_finite()) {
            return None;
        }
        self.newton(distorted, distorted).or_else(|| self.continue_from_axis(distorted))
    }

    /// Newton's method for `distort(p) = target`, kept inside the fold by halving steps.
    fn newton(&self, target: [f64; 2], start: [f64; 2]) -> Option<[f64; 2]> {
        let target = Vector2::from(target);
        let mut at = Vector2::from(start);
        for _ in 0..MAX_STEPS {
            let miss = target - Vector2::from(self.distort(at.into()));
            let step = self.jacobian(at.into()).try_inverse()? * miss;
            let next = self.longest_step(at, step)?;
            let moved = (next - at).norm();
            at = next;
            if moved <= CONVERGED * (1.0 + at.norm()) {
                return Some(at.into());
            }
        }
        None
    }

    /// `at + step`, or as much of the step as stays inside the fold.
    fn longest_step(&self, at: Vector2<f64>, step: Vector2<f64>) -> Option<Vector2<f64>> {
        let halvings = (0..20).map(|n| 0.5_f64.powi(n));
        halvings.map(|part| at + step * part).find(|next| self.is_invertible_at((*next).into()))
    }

    /// Follows the solution outwards from the axis, where it is known: finds it wherever it exists.
    fn continue_from_axis(&self, target: [f64; 2]) -> Option<[f64; 2]> {
        (1..=CONTINUATION_STEPS).try_fold([0.0, 0.0], |start, step| {
            let part = step as f64 / CONTINUATION_STEPS as f64;
            self.newton(target.map(|c| c * part), start)
        })
    }
}

/// The smallest s > 0 with c0 + c1 s + c2 s^2 + c3 s^3 = 0, for c0 > 0; infinite where there is none.
fn first_positive_root(c: [f64; 4]) -> f64 {
    let value = |s: f64| c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    let mut low = 0.0;
    for turn in positive_turning_points(c) {
        if value(turn) <= 0.0 {
            return bisect(value, low, turn);
        }
        low = turn;
    }
    let mut high = 2.0 * low + 1.0;
    // Beyond the last turning point the cubic is monotone: it either crosses within the range of numbers or never.
    while high < 1e12 {
        if value(high) <= 0.0 {
            return bisect(value, low, high);
        }
        high *= 2.0;
    }
    f64::INFINITY
}

/// Where the cubic's derivative vanishes, for s > 0, ascending.
fn positive_turning_points([_, c1, c2, c3]: [f64; 4]) -> Vec<f64> {
    let (a, b, c) = (3.0 * c3, 2.0 * c2, c1);
    let discriminant = b * b - 4.0 * a * c;
    let mut turns = if a == 0.0 {
        vec![-c / b]
    } else if discriminant < 0.0 {
        vec![]
    } else {
        // The form without cancellation.
        let q = -0.5 * (b + discriminant.sqrt().copysign(b));
        vec![q / a, c / q]
    };
    turns.retain(|s| s.is_finite() && *s > 0.0);
    turns.sort_by(f64::total_cmp);
    turns
}

/// The zero of a function that is positive at `low` and not at `high`.
fn bisect(value: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if value(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

impl<'a> Projector<'a> {
    /// Prepares a camera.
    pub fn new(camera: &'a Camera) -> Self {
        let centre_in_rig_mm = camera.camera_from_rig.inverse_transform_point(&Point3::origin());
        Self { camera, lens: Lens::new(camera.distortion), centre_in_rig_mm }
    }

    /// The camera's distortion.
    pub fn lens(&self) -> &Lens {
        &self.lens
    }

    /// Where the camera's centre of projection is, rig frame, millimetres.
    pub fn centre_in_rig_mm(&self) -> Point3<f64> {
        self.centre_in_rig_mm
    }

    /// Pixel (u, v) of a point of the rig frame, in or out of the picture; `None` behind the camera and beyond the
    /// lens's fold.
    pub fn project(&self, point_in_rig_mm: &Point3<f64>) -> Option<[f64; 2]> {
        self.project_from_camera(&(self.camera.camera_from_rig * point_in_rig_mm))
    }

    /// [`Projector::project`] for a point of the camera frame.
    pub fn project_from_camera(&self, point_in_camera_mm: &Point3<f64>) -> Option<[f64; 2]> {
        if point_in_camera_mm.z <= 0.0 {
            return None;
        }
        let undistorted = [
            point_in_camera_mm.x / point_in_camera_mm.z,
            point_in_camera_mm.y / point_in_camera_mm.z,
        ];
        self.lens
            .is_invertible_at(undistorted)
            .then(|| self.pixel_of_distorted(self.lens.distort(undistorted)))
    }

    /// The undistorted point (x, y) at z = 1 of the camera frame that a pixel shows; `None` beyond the fold.
    pub fn undistorted(&self, [u, v]: [f64; 2]) -> Option<[f64; 2]> {
        let camera = self.camera;
        self.lens.undistort([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy])
    }

    /// The pixel at which an undistorted point (x, y) at z = 1 lands; `None` beyond the fold.
    pub fn pixel_of_undistorted(&self, undistorted: [f64; 2]) -> Option<[f64; 2]> {
        self.lens
            .is_invertible_at(undistorted)
            .then(|| self.pixel_of_distorted(self.lens.distort(undistorted)))
    }

    /// What a pixel looks along; `None` beyond the fold.
    pub fn ray(&self, pixel: [f64; 2]) -> Option<Ray> {
        let [x, y] = self.undistorted(pixel)?;
        let direction = self.camera.camera_from_rig.rotation.inverse() * Vector3::new(x, y, 1.0);
        Some(Ray {
            origin_mm: self.centre_in_rig_mm,
            direction: UnitVector3::new_normalize(direction),
        })
    }

    /// The point of a plane that a pixel shows, rig frame, millimetres; `None` where the line of sight misses it.
    pub fn on_plane(&self, pixel: [f64; 2], plane: &Plane) -> Option<Point3<f64>> {
        self.ray(pixel)?.on_plane(plane)
    }

    fn pixel_of_distorted(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.camera.fx * x + self.camera.cx, self.camera.fy * y + self.camera.cy]
    }
}

impl Ray {
    /// Where the line meets a plane in front of the camera.
    pub fn on_plane(&self, plane: &Plane) -> Option<Point3<f64>> {
        let approach = self.direction.dot(&plane.normal);
        let distance_mm = (plane.point_mm - self.origin_mm).dot(&plane.normal) / approach;
        (distance_mm.is_finite() && distance_mm > 0.0)
            .then(|| self.origin_mm + self.direction.scale(distance_mm))
    }
}

#[cfg(test)]
mod tests;
