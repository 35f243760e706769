//! What is written is read back, for any numbers in their ranges; and what could not be read back is not written.

use super::*;
use crate::files::Provenance;
use crate::quantity::{self, Quantity};
use crate::session::{FrameEntry, Kind, Patch, Session, Target};
use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};
use proptest::prelude::*;
use weavelight_calibration::description::{DirectionalLight, Plane, PointLight};

/// Values of a quantity: its ends, and between them evenly over the orders of magnitude.
fn of(quantity: &Quantity) -> BoxedStrategy<f64> {
    let (least, most) = (*quantity.range().start(), *quantity.range().end());
    let between = (0.0..1.0f64, any::<bool>()).prop_map(move |(share, negative)| {
        let low = if least > 0.0 { least } else { most * 1e-12 };
        let size = low * (most / low).powf(share);
        let value = if negative { -size } else { size };
        value.clamp(least, most)
    });
    prop_oneof![1 => Just(least), 1 => Just(most), 8 => between].boxed()
}

/// Mostly sensible numbers, and any others.
fn any_of(quantity: &Quantity) -> BoxedStrategy<f64> {
    prop_oneof![3 => of(quantity), 1 => any::<f64>()].boxed()
}

fn three(
    value: fn(&Quantity) -> BoxedStrategy<f64>,
    quantity: &Quantity,
) -> [BoxedStrategy<f64>; 3] {
    [value(quantity), value(quantity), value(quantity)]
}

type Value = fn(&Quantity) -> BoxedStrategy<f64>;

fn color(value: Value) -> impl Strategy<Value = Color> {
    let entry = value(&quantity::COLOR_MATRIX);
    (
        proptest::option::of(value(&quantity::BLACK_DN)),
        proptest::option::of(value(&quantity::SATURATION_DN)),
        (entry.clone(), entry, value(&quantity::RESPONSE)),
        three(value, &quantity::WHITE_BALANCE),
        (
            value(&quantity::ELECTRONS_PER_DN),
            value(&quantity::READ_NOISE_E),
            value(&quantity::KAPPA),
        ),
    )
        .prop_map(|(black, saturation, (a, b, bend), balance, noise)| Color {
            black_level: black.map(|black| [black; 4]),
            saturation_level: saturation,
            response: vec![0.0, 1.0, bend],
            camera_to_linear_srgb: Some(Matrix3::new(
                a,
                b,
                1.0 - a - b,
                0.0,
                1.0,
                0.0,
                0.0,
                0.0,
                1.0,
            )),
            white_balance: vec![balance],
            noise: Some(Noise { electrons_per_dn: noise.0, read_noise_e: noise.1, kappa: noise.2 }),
            ..Color::default()
        })
}

fn lights(value: Value) -> impl Strategy<Value = Vec<CalibratedLight>> {
    let light = (
        three(value, &quantity::INTENSITY),
        [value(&quantity::PLACE_MM), value(&quantity::PLACE_MM), value(&quantity::LIGHT_HEIGHT_MM)],
        value(&quantity::BEAM_EXPONENT),
        proptest::option::of(value(&quantity::POSITION_SIGMA_MM)),
        any::<bool>(),
    );
    let light = light.prop_map(|(intensity, place, exponent, sigma, far)| {
        let light = if far {
            Light::Directional(DirectionalLight { direction: Vector3::z_axis(), intensity })
        } else {
            let axis = -Vector3::z_axis();
            Light::Point(PointLight { position_mm: place.into(), axis, exponent, intensity })
        };
        CalibratedLight { position_sigma_mm: sigma, ..CalibratedLight::new(light) }
    });
    proptest::collection::vec(light, 3..5)
}

fn camera(value: Value) -> impl Strategy<Value = MeasuredCamera> {
    (
        [value(&quantity::FOCAL_LENGTH_PX), value(&quantity::FOCAL_LENGTH_PX)],
        [value(&quantity::PRINCIPAL_POINT_PX), value(&quantity::PRINCIPAL_POINT_PX)],
        value(&quantity::DISTORTION),
        [value(&quantity::PLACE_MM), value(&quantity::CAMERA_HEIGHT_MM)],
        proptest::option::of(value(&quantity::REPROJECTION_PX)),
        1usize..=65_535,
    )
        .prop_map(|([fx, fy], [cx, cy], k1, [x, z], rms_reprojection_px, width_px)| {
            let translation = Translation3::new(x, 0.0, z);
            let camera = Camera {
                width_px,
                height_px: 48,
                fx,
                fy,
                cx,
                cy,
                distortion: [k1, 0.0, 0.0, 0.0, -k1],
                camera_from_rig: IsometryMatrix3::from_parts(translation, Rotation3::identity()),
            };
            MeasuredCamera { rms_reprojection_px, ..MeasuredCamera::new(camera) }
        })
}

fn rig(value: Value) -> impl Strategy<Value = Rig> {
    (
        proptest::option::of(value(&quantity::FOCAL_LENGTH_MM)),
        proptest::option::of(value(&quantity::PIXEL_PITCH_UM)),
        proptest::option::of(value(&quantity::CAMERA_HEIGHT_MM)),
        [value(&quantity::PLACE_MM), value(&quantity::PLACE_MM), value(&quantity::LIGHT_HEIGHT_MM)],
        value(&quantity::POSITION_SIGMA_MM),
    )
        .prop_map(|(focal_length_mm, pixel_pitch_um, height_mm, place, position_sigma_mm)| {
            let place =
                RigLightPlace::Point { position_mm: Point3::from(place), position_sigma_mm };
            let light = RigLight { channel: None, place };
            Rig {
                name: "any".to_owned(),
                camera: RigCamera {
                    kind: CameraKind::Simulated,
                    model: None,
                    width_px: 64,
                    height_px: 48,
                    focal_length_mm,
                    pixel_pitch_um,
                    height_mm,
                },
                controller: None,
                lights: vec![light; 3],
            }
        })
}

fn session(value: Value) -> impl Strategy<Value = Session> {
    (
        value(&quantity::EXPOSURE_S),
        value(&quantity::ISO),
        value(&quantity::REFLECTANCE),
        three(value, &quantity::SURFACE_MM),
        [value(&quantity::LAB_L), value(&quantity::LAB_AB), value(&quantity::LAB_AB)],
        value(&quantity::SQUARE_MM),
        [value(&quantity::PATCH_PX), value(&quantity::PATCH_PX)],
    )
        .prop_map(|(exposure_s, iso, reflectance, point, lab, square_mm, [u, v])| {
            let patch =
                Patch { rect_px: [u, v, u + 1.0, v + 1.0], reflectance, lab_d50: Some(lab) };
            let board = crate::session::Board { columns: 9, rows: 6, square_mm };
            Session {
                plane: Some(Plane { point_mm: point.into(), normal: Vector3::z_axis() }),
                target: Some(Target {
                    reflectance: Some(reflectance),
                    board: Some(board),
                    patches: vec![patch],
                }),
                frames: vec![FrameEntry::new("a.dng", Some(0), exposure_s, iso)],
                ..Session::new("", Kind::Grey, "any")
            }
        })
}

/// Writes and reads everything; what each writer said, if it refused.
fn written(
    rig: &Rig,
    camera: &MeasuredCamera,
    color: &Color,
    lights: &[CalibratedLight],
    session: &Session,
) -> Vec<String> {
    let home = tempfile::tempdir().unwrap();
    let folder = |name: &str| home.path().join(name);
    let none = Provenance::default();
    let path = folder("rig.toml");
    let mut refused = Vec::new();
    let mut is_written = |result: Result<(), String>| match result {
        Ok(()) => true,
        Err(error) => {
            assert!(
                error.contains("cannot be written: `") || error.contains("not a finite"),
                "{error}"
            );
            refused.push(error);
            false
        }
    };
    if is_written(rig.save(&path).map_err(|e| e.to_string())) {
        assert_eq!(Rig::load(&path).unwrap(), *rig);
    }
    if is_written(write_camera(&folder("camera"), camera, &none).map_err(|e| e.to_string())) {
        let read = Calibration::load(&folder("camera")).unwrap();
        assert_eq!(read.camera.unwrap(), camera.camera);
        assert_eq!(read.rms_reprojection_px, camera.rms_reprojection_px);
    }
    if is_written(write_color(&folder("color"), color, &none).map_err(|e| e.to_string())) {
        assert_eq!(Calibration::load(&folder("color")).unwrap().color, *color);
    }
    if is_written(write_lights(&folder("lights"), lights, &none).map_err(|e| e.to_string())) {
        let read = Calibration::load(&folder("lights")).unwrap().lights;
        let told = |lights: &[CalibratedLight]| format!("{lights:?}");
        assert_eq!(told(&read), told(lights));
    }
    let session = Session { folder: folder("session"), ..session.clone() };
    std::fs::create_dir(&session.folder).unwrap();
    if is_written(session.save().map_err(|e| e.to_string())) {
        assert_eq!(Session::load(&session.folder).unwrap(), session);
    }
    refused
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn numbers_in_their_ranges_are_written_and_read_back(
        rig in rig(of),
        camera in camera(of),
        color in color(of),
        lights in lights(of),
        session in session(of),
    ) {
        // Numbers that are each in range may still contradict each other.
        let excused = ["does not fit the rest", "does not rise", "not above the black", "sums to", "camera_to_linear_srgb", "whose distance", "rect_px"];
        for refused in written(&rig, &camera, &color, &lights, &session) {
            prop_assert!(excused.iter().any(|what| refused.contains(what)), "{}", refused);
        }
    }

    #[test]
    fn what_would_not_be_read_back_is_not_written(
        rig in rig(any_of),
        camera in camera(any_of),
        color in color(any_of),
        lights in lights(any_of),
        session in session(any_of),
    ) {
        written(&rig, &camera, &color, &lights, &session);
    }
}
