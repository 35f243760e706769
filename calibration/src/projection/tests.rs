use super::*;
use nalgebra::{Rotation3, Translation3};
use proptest::prelude::*;

/// What the project asks of pixel -> table -> pixel.
const ROUND_TRIP_PX: f64 = 1e-6;

fn camera(distortion: [f64; 5], tilt: [f64; 3]) -> Camera {
    let mut pose = Camera::looking_down(610.0);
    pose.rotation = Rotation3::from_euler_angles(tilt[0], tilt[1], tilt[2]) * pose.rotation;
    pose.translation = Translation3::new(12.0, -7.0, 610.0);
    Camera {
        width_px: 4928,
        height_px: 3264,
        fx: 7322.2,
        fy: 7319.0,
        cx: 2470.3,
        cy: 1627.9,
        distortion,
        camera_from_rig: pose,
    }
}

const NONE: [f64; 5] = [0.0; 5];
const MILD: [f64; 5] = [-0.08, 0.05, 0.0004, -0.0003, 0.01];
const BARREL: [f64; 5] = [-0.6, 0.4, 0.004, -0.003, -0.1];
const PINCUSHION: [f64; 5] = [0.9, 1.5, -0.01, 0.008, 2.0];

#[test]
fn a_camera_that_looks_down_has_the_picture_axes_of_the_rig() {
    let plain = Camera { camera_from_rig: Camera::looking_down(610.0), ..camera(NONE, [0.0; 3]) };
    let projector = Projector::new(&plain);
    let [u, v] = projector.project(&Point3::new(61.0, 30.5, 0.0)).unwrap();
    assert!((u - (2470.3 + 732.22)).abs() < 1e-9, "+x goes to the right, u = {u}");
    assert!((v - (1627.9 - 365.95)).abs() < 1e-9, "+y goes up, v = {v}");
    assert!((projector.centre_in_rig_mm() - Point3::new(0.0, 0.0, 610.0)).norm() < 1e-9);
}

#[test]
fn distortion_follows_opencv() {
    // Worked by hand from the formulas of OpenCV's calib3d page.
    let [x, y] = Lens::new([0.1, -0.2, 0.003, -0.004, 0.05]).distort([0.3, -0.2]);
    let radial = 1.0 + 0.1 * 0.13 - 0.2 * 0.0169 + 0.05 * 0.002197;
    assert!((x - (0.3 * radial + 2.0 * 0.003 * -0.06 - 0.004 * (0.13 + 0.18))).abs() < 1e-15);
    assert!((y - (-0.2 * radial + 0.003 * (0.13 + 0.08) + 2.0 * -0.004 * -0.06)).abs() < 1e-15);
}

#[test]
fn every_pixel_finds_its_way_back() {
    let tilted = Plane {
        point_mm: Point3::new(0.0, 0.0, 30.0),
        normal: UnitVector3::new_normalize(Vector3::new(0.3, -0.2, 0.9)),
    };
    for distortion in [NONE, MILD, BARREL, PINCUSHION] {
        let camera = camera(distortion, [0.02, -0.03, 0.4]);
        let projector = Projector::new(&camera);
        for plane in [Plane::table(), tilted.clone()] {
            let pixels: Vec<_> = (0..=3263)
                .step_by(251)
                .flat_map(|v| (0..=4927).step_by(379).map(move |u| [f64::from(u), f64::from(v)]))
                .collect();
            for pixel in &pixels {
                let point = projector.on_plane(*pixel, &plane).unwrap();
                let back = projector.project(&point);
                let off_plane = (point - plane.point_mm).dot(&plane.normal);
                assert!(off_plane.abs() < 1e-9, "{off_plane} mm off the plane");
                let back = back.unwrap();
                let miss = (back[0] - pixel[0]).hypot(back[1] - pixel[1]);
                assert!(miss < ROUND_TRIP_PX, "{distortion:?} at {pixel:?}: {miss} px");
            }
        }
    }
}

#[test]
fn what_the_lens_cannot_show_is_none() {
    let fold = Lens::new([-0.5, 0.0, 0.0, 0.0, 0.0]);
    // d/dr (r - r^3/2) = 0 at r^2 = 2/3, where the picture ends at r'' = r (1 - 1/3).
    let edge = (2.0_f64 / 3.0).sqrt();
    let check = |radius: f64, expected: bool| {
        let found = fold.undistort([radius, 0.0]);
        assert_eq!(found.is_some(), expected, "radius {radius}: {found:?}");
    };
    check(0.99999 * edge * 2.0 / 3.0, true);
    check(1.00001 * edge * 2.0 / 3.0, false);
    check(f64::NAN, false);
    check(f64::INFINITY, false);
    assert!(
        fold.is_invertible_at([0.99 * edge, 0.0]) && !fold.is_invertible_at([1.01 * edge, 0.0])
    );

    let folding = camera([-0.5, 0.0, 0.0, 0.0, 0.0], [0.0; 3]);
    let projector = Projector::new(&folding);
    assert_eq!(projector.project(&Point3::new(0.0, 0.0, 700.0)), None, "behind the camera");
    assert_eq!(projector.project(&Point3::new(600.0, 0.0, 0.0)), None, "beyond the fold");
    assert!(projector.on_plane([0.0, 0.0], &Plane::table()).is_some());
    let behind = Plane { point_mm: Point3::new(0.0, 0.0, 700.0), ..Plane::table() };
    assert_eq!(projector.on_plane([0.0, 0.0], &behind), None, "a plane behind the camera");
}

#[test]
fn folds_are_found_exactly() {
    let check = |c: [f64; 4], expected: f64| {
        let found = first_positive_root(c);
        let same = found == expected || (found - expected).abs() < 1e-9 * expected;
        assert!(same, "{c:?}: {found} instead of {expected}");
    };
    check([1.0, 0.0, 0.0, 0.0], f64::INFINITY);
    check([1.0, -2.0, 0.0, 0.0], 0.5);
    check([1.0, 2.0, 0.0, 0.0], f64::INFINITY);
    check([6.0, -11.0, 6.0, -1.0], 1.0); // (1-s)(2-s)(3-s)
    check([1.0, -2.0, 1.0001, 0.0], f64::INFINITY); // almost touches at s = 1
    check([1.0, -2.0, 0.9999, 0.0], 1.0 / 1.01);
    check([1.0, 0.0, 0.0, -8.0], 0.5);
}

proptest! {
    #[test]
    fn the_jacobian_is_the_derivative(x in -0.6..0.6_f64, y in -0.6..0.6_f64, k in proptest::array::uniform5(-0.3..0.3_f64)) {
        let lens = Lens::new(k);
        let h = 1e-6;
        let jacobian = lens.jacobian([x, y]);
        for (column, (dx, dy)) in [(h, 0.0), (0.0, h)].into_iter().enumerate() {
            let (a, b) = (lens.distort([x + dx, y + dy]), lens.distort([x - dx, y - dy]));
            for row in 0..2 {
                let numeric = (a[row] - b[row]) / (2.0 * h);
                prop_assert!((jacobian[(row, column)] - numeric).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn undistort_undoes_distort_inside_the_fold(
        x in -0.7..0.7_f64, y in -0.7..0.7_f64,
        k in proptest::array::uniform3(-0.8..0.8_f64), p in proptest::array::uniform2(-0.01..0.01_f64),
    ) {
        let lens = Lens::new([k[0], k[1], p[0], p[1], k[2]]);
        // Along the whole way from the axis: behind a tangential fold two places share a pixel.
        let connected = (1..=50).all(|i| lens.is_invertible_at([x * f64::from(i) / 50.0, y * f64::from(i) / 50.0]));
        prop_assume!(connected && lens.jacobian([x, y]).determinant() > 1e-2);
        let target = lens.distort([x, y]);
        let found = lens.undistort(target);
        prop_assert!(found.is_some(), "nothing found for {target:?}");
        let [fx, fy] = found.unwrap();
        prop_assert!((fx - x).hypot(fy - y) < 1e-12, "{} off", (fx - x).hypot(fy - y));
    }
}
