use super::*;
use crate::files::{Input, Provenance};
use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};
use std::fs;
use weavelight_calibration::description::{DirectionalLight, PointLight};

const RIG: &str = r#"schema = 1
name = "bench rig"

[camera]
kind = "simulated"
model = "Nikon D5100"
width_px = 4928
height_px = 3264
focal_length_mm = 35.0
pixel_pitch_um = 4.78
height_mm = 610.0

[controller]
kind = "serial"
port = "/dev/ttyACM0"

[[lights]]
channel = 0
position_mm = [412.0, 0.0, 380.0]
position_sigma_mm = 10.0

[[lights]]
position_mm = [-200.0, 100, 380.0]

[[lights]]
kind = "directional"
direction = [0.0, 3.0, 4.0]
"#;

const SMALLEST: &str = r#"schema = 1
[camera]
width_px = 64
height_px = 48
[[lights]]
position_mm = [100, 0, 100]
[[lights]]
position_mm = [0, 100, 100]
[[lights]]
position_mm = [0, 0, 100]
"#;

fn rig(text: &str) -> Result<Rig, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rig.toml");
    fs::write(&path, text).unwrap();
    Rig::load(&path)
        .map_err(|error| error.to_string().replace(&path.display().to_string(), "rig.toml"))
}

#[test]
fn every_key_of_a_rig_is_read_and_written() {
    let read = rig(RIG).unwrap();
    assert_eq!(read.camera.kind, CameraKind::Simulated);
    assert_eq!((read.camera.width_px, read.camera.height_px), (4928, 3264));
    assert_eq!(read.controller, Some(Controller::Serial { port: Some("/dev/ttyACM0".into()) }));
    assert_eq!((read.channel(0), read.channel(1), read.lights[1].channel), (0, 1, None));
    let expected = RigLightPlace::Point {
        position_mm: Point3::new(-200.0, 100.0, 380.0),
        position_sigma_mm: 10.0,
    };
    assert_eq!(read.lights[1].place, expected);
    let RigLightPlace::Directional { direction } = &read.lights[2].place else {
        panic!("{:?}", read.lights[2])
    };
    assert!((direction.into_inner() - Vector3::new(0.0, 0.6, 0.8)).norm() < 1e-15);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rig.toml");
    read.save(&path).unwrap();
    assert_eq!(Rig::load(&path).unwrap(), read);
}

#[test]
fn a_rig_needs_only_its_size_and_lights() {
    let read = rig(SMALLEST).unwrap();
    assert_eq!((read.camera.kind, read.controller), (CameraKind::Tethered { port: None }, None));
}

/// The error of `text` with `from` replaced by `to`.
fn check_rig(from: &str, to: &str, expected: &str) {
    assert!(SMALLEST.contains(from), "{from}");
    let found = rig(&SMALLEST.replacen(from, to, 1)).err().unwrap_or("fine".into());
    assert!(found.starts_with(expected), "{to:?}:\n found    {found}\n expected {expected}");
}

#[test]
fn impossible_rigs_are_told_with_line_and_remedy() {
    check_rig("schema = 1", "schema = 3", "rig.toml:1: schema 3, but this version reads schema 1");
    check_rig("width_px = 64", "width_px = 0", "rig.toml:3: `camera.width_px` is 0");
    check_rig("width_px = 64", "", "rig.toml:2: missing field `width_px`");
    check_rig("[100, 0, 100]", "[1, inf, 1]", "rig.toml:6: `lights[0].position_mm[1]` is inf");
    check_rig(
        "[100, 0, 100]",
        "[100, 0, -1]",
        "rig.toml:6: `lights[0].position_mm` is a place whose z is -1; lights above the table",
    );
    check_rig(
        "[100, 0, 100]",
        "[0.412, 0, 0.38]",
        "rig.toml:6: `lights[0].position_mm` is a place whose distance is 0.560",
    );
    for (keys, expected) in [
        (
            "pixel_pitch_um = 0.00478",
            "`camera.pixel_pitch_um` is 0.00478; pixels are 0.4 to 5000 micrometres: is this in millimetres?",
        ),
        ("pixel_pitch_um = 1e9", "`camera.pixel_pitch_um` is 1e9; pixels are"),
        ("focal_length_mm = 1e30", "`camera.focal_length_mm` is 1e30; focal lengths are"),
        (
            "height_mm = 0.61",
            "`camera.height_mm` is 0.61; cameras over the table are 5 to 20000 millimetres: is this in metres?",
        ),
        ("height_mm = -610", "`camera.height_mm` is -610; cameras"),
    ] {
        check_rig(
            "height_px = 48",
            &format!("height_px = 48\n{keys}"),
            &format!("rig.toml:5: {expected}"),
        );
    }
    check_rig(
        "height_px = 48",
        "height_px = 48\nfocal_length_mm = 1\nheight_mm = 20000\npixel_pitch_um = 1000",
        "rig.toml:7: `camera.pixel_pitch_um` does not fit the rest",
    );
    check_rig(
        "[[lights]]\nposition_mm = [0, 0, 100]\n",
        "",
        "rig.toml:5: `lights` are 2; a rig has 3 to 256",
    );
    check_rig(
        "[0, 0, 100]\n",
        "[0, 0, 100]\nchannel = 1\n",
        "rig.toml:9: `lights[2]` is on channel 1, as light 1 is",
    );
    check_rig(
        "[0, 0, 100]\n",
        "[0, 0, 100]\nposition_sigma_mm = 0\n",
        "rig.toml:11: `lights[2].position_sigma_mm` is 0",
    );
    check_rig(
        "position_mm = [0, 0, 100]",
        "direction = [0, 0, 1]",
        "rig.toml:9: `lights[2]` needs position_mm",
    );
    check_rig(
        "position_mm = [0, 0, 100]",
        "kind = \"directional\"",
        "rig.toml:9: `lights[2]` is directional: it needs direction",
    );
    check_rig(
        "position_mm = [0, 0, 100]",
        "kind = \"directional\"\ndirection = [0, 0, 0]",
        "rig.toml:11: `lights[2].direction` points away",
    );
    check_rig(
        "height_px = 48",
        "height_px = 48\nkind = \"watched\"",
        "rig.toml:5: `camera.kind` is \"watched\"",
    );
    // Keys of another kind are left alone.
    check_rig("height_px = 48", "height_px = 48\nfolder = \"x\"", "fine");
    check_rig("height_px = 48", "height_px = 48\nkind = \"simulated\"\nport = \"usb:1\"", "fine");
    check_rig(
        "[[lights]]\nposition_mm = [100",
        "[controller]\nkind = \"simulated\"\nport = \"/dev/ttyACM0\"\n[[lights]]\nposition_mm = [100",
        "fine",
    );
}

fn provenance() -> Provenance {
    let quality = toml::Table::from_iter([("boards".to_owned(), toml::Value::Integer(12))]);
    let inputs = vec![Input { name: "board".into(), sha256: "ab".repeat(32) }];
    Provenance::of_this_program(Some("2026-11-22T10:00:00Z".parse().unwrap()), inputs, quality)
}

fn camera() -> Camera {
    let rotation = Rotation3::from_euler_angles(3.1, 0.02, -0.01);
    let translation = Translation3::new(1.5, -2.25, 610.0);
    Camera {
        width_px: 640,
        height_px: 480,
        fx: 1000.0 / 3.0,
        fy: 333.0,
        cx: 319.5,
        cy: 239.5,
        distortion: [-0.1, 0.02, 1e-4, -2e-4, 1.0 / 7.0],
        camera_from_rig: IsometryMatrix3::from_parts(translation, rotation),
    }
}

fn lights() -> Vec<CalibratedLight> {
    let point = PointLight {
        position_mm: Point3::new(400.0, -1.0 / 3.0, 380.0),
        axis: UnitVector3::new_normalize(Vector3::new(-1.0, 0.1, -1.0)),
        exponent: 1.2,
        intensity: [0.1, 0.2, 0.3],
    };
    let mut near = CalibratedLight::new(Light::Point(point));
    near.gain_map = Some(Image {
        width: 3,
        height: 2,
        data: (0..6).map(|k| [1.0 + k as f32, 0.5, 0.25]).collect(),
    });
    near.position_sigma_mm = Some(0.3);
    near.position_claimed = Some(true);
    near.warnings = vec!["drifts by 2 %".into()];
    let direction = UnitVector3::new_normalize(Vector3::new(0.1, 0.2, 0.9));
    let far = CalibratedLight::new(Light::Directional(DirectionalLight {
        direction,
        intensity: [1.0; 3],
    }));
    vec![near, far.clone(), far]
}

/// Equal up to the last bits, which normalising again may change.
fn same_light(a: &Light, b: &Light) -> bool {
    match (a, b) {
        (Light::Point(a), Light::Point(b)) => {
            (a.axis.into_inner() - b.axis.into_inner()).norm() < 1e-15
                && PointLight { axis: b.axis, ..a.clone() } == *b
        }
        (Light::Directional(a), Light::Directional(b)) => {
            (a.direction.into_inner() - b.direction.into_inner()).norm() < 1e-15
                && a.intensity == b.intensity
        }
        _ => false,
    }
}

#[test]
fn a_calibration_grows_file_by_file_and_is_read_as_written() {
    let home = tempfile::tempdir().unwrap();
    let folder = home.path().join("calibration");
    assert!(Calibration::load(&folder).unwrap_err().to_string().contains("lights.toml: not found"));
    let measured = MeasuredCamera {
        camera: camera(),
        rms_reprojection_px: Some(0.24),
        optics: Optics {
            camera_model: Some("Nikon D5100".into()),
            lens: None,
            focal_length_mm: Some(40.0),
        },
    };
    write_camera(&folder, &measured, &provenance()).unwrap();
    let first = Calibration::load(&folder).unwrap();
    assert_eq!((first.camera.as_ref(), first.rms_reprojection_px), (Some(&camera()), Some(0.24)));
    assert_eq!(first.optics, measured.optics);
    assert_eq!((first.color, first.lights.len()), (Color::default(), 0));
    assert_eq!(first.provenance.camera, Some(provenance()));

    let color = Color {
        black_level: Some([600.0, 601.0, 602.0, 600.5]),
        saturation_level: Some(15892.0),
        clip_level: None,
        response: vec![0.0, 0.99, 0.01],
        camera_to_linear_srgb: Some(Matrix3::new(1.5, -0.3, -0.2, -0.1, 1.3, -0.2, 0.0, -0.4, 1.4)),
        white_balance: vec![[2.0, 1.0, 1.5], [1.9, 1.0, 1.6]],
        noise: Some(Noise { electrons_per_dn: 2.5, read_noise_e: 4.0, kappa: 0.001 }),
    };
    write_color(&folder, &color, &provenance()).unwrap();
    write_lights(&folder, &lights(), &provenance()).unwrap();
    let defects = Defects::new(vec![[7, 1], [3, 0]], vec![[5, 5]]);
    write_defects(&folder, &defects, &provenance()).unwrap();
    let whole = Calibration::load(&folder).unwrap();
    assert_eq!((&whole.color, &whole.defects), (&color, &defects));
    for (found, expected) in whole.lights.iter().zip(&lights()) {
        assert!(same_light(&found.light, &expected.light), "{found:?}");
        assert_eq!(found.gain_map, expected.gain_map);
        assert_eq!(
            (found.position_sigma_mm, found.position_claimed),
            (expected.position_sigma_mm, expected.position_claimed)
        );
        assert_eq!(found.warnings, expected.warnings);
    }
}

#[test]
fn gain_maps_of_an_earlier_calibration_go() {
    let folder = tempfile::tempdir().unwrap();
    let exrs = || {
        fs::read_dir(folder.path())
            .unwrap()
            .filter(|e| e.as_ref().unwrap().path().extension().is_some_and(|e| e == "exr"))
            .count()
    };
    write_lights(folder.path(), &lights(), &provenance()).unwrap();
    assert_eq!(exrs(), 1);
    let mut without = lights();
    without[0].gain_map = None;
    write_lights(folder.path(), &without, &provenance()).unwrap();
    assert_eq!(exrs(), 0);
}

#[test]
fn rounded_rotations_are_made_rotations_again() {
    let folder = tempfile::tempdir().unwrap();
    let rows = "[[1.0, 0.0, 0.0], [0.0, -0.9998, 0.0175], [0.0, -0.0175, -0.9998]]";
    fs::write(folder.path().join(CAMERA_FILE), camera_text(rows, "[0.0, 0.0, 610.0]")).unwrap();
    let read = Calibration::load(folder.path()).unwrap().camera.unwrap();
    let rotation = read.camera_from_rig.rotation.matrix();
    assert!((rotation * rotation.transpose() - Matrix3::identity()).norm() < 1e-14);
    assert!((rotation.determinant() - 1.0).abs() < 1e-14);
}

fn camera_text(rotation: &str, translation: &str) -> String {
    format!(
        "schema = 1\nwidth_px = 64\nheight_px = 48\nfx = 100\nfy = 100\ncx = 31.5\ncy = 23.5\n\
         rotation = {rotation}\ntranslation_mm = {translation}\n"
    )
}

/// The error of a calibration folder with one file of this text.
fn check_file(name: &str, text: &str, expected: &str) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(name), text).unwrap();
    let found = match Calibration::load(folder.path()) {
        Ok(_) => "fine".to_owned(),
        Err(error) => error.to_string().replace(&format!("{}/", folder.path().display()), ""),
    };
    assert!(found.starts_with(expected), "{text}:\n found    {found}\n expected {expected}");
    assert!(found.lines().count() <= 2, "{found}");
}

#[test]
fn impossible_cameras_are_told() {
    let down = "[[1, 0, 0], [0, -1, 0], [0, 0, -1]]";
    check_file(CAMERA_FILE, &camera_text(down, "[0, 0, 610]"), "fine");
    check_file(
        CAMERA_FILE,
        &camera_text(down, "[0, 0, -610]"),
        "camera.toml:9: `translation_mm` puts the scan area behind",
    );
    let mirror = "[[1, 0, 0], [0, 1, 0], [0, 0, -1]]";
    check_file(
        CAMERA_FILE,
        &camera_text(mirror, "[0, 0, 610]"),
        "camera.toml:8: `rotation` is no rotation",
    );
    let skewed = "[[1, 0.1, 0], [0, -1, 0], [0, 0, -1]]";
    check_file(
        CAMERA_FILE,
        &camera_text(skewed, "[0, 0, 610]"),
        "camera.toml:8: `rotation` is no rotation",
    );
    check_file(
        CAMERA_FILE,
        &camera_text(down, "[0, nan, 610]"),
        "camera.toml:9: `translation_mm[1]` is nan",
    );
}

#[test]
fn impossible_colours_are_told() {
    let check = |keys: &str, expected: &str| {
        check_file(COLOR_FILE, &format!("schema = 1\n{keys}\n"), expected);
    };
    check("", "fine");
    check("response = [0, 1]", "fine");
    check("response = [0.5]", "color.toml:2: `response` needs 2 to 16 coefficients");
    check(
        "response = [0, 4e9]",
        "color.toml:2: `response[1]` is 4e9; response coefficients are -100 to 100",
    );
    check("response = [0, -1]", "color.toml:2: `response` does not rise");
    check("response = [0, 2, -2]", "color.toml:2: `response` does not rise");
    check("response = [0, 0]", "color.toml:2: `response` does not rise");
    check(
        "black_level = [0, 0, 0, -1e30]",
        "color.toml:2: `black_level[3]` is -1e30; black levels are",
    );
    check(
        "camera_to_linear_srgb = [[1e300,-1e300,1],[0,1,0],[0,0,1]]",
        "color.toml:2: `camera_to_linear_srgb[0][0]` is 1e300",
    );
    check(
        "black_level = [600, 600, 600, 600]\nsaturation_level = 600",
        "color.toml:3: `saturation_level` is 600, not above",
    );
    check(
        "camera_to_linear_srgb = [[1,0,0],[0,2,0],[0,0,1]]",
        "color.toml:2: `camera_to_linear_srgb[1]` sums to 2",
    );
    check(
        "[[lights]]\nwhite_balance = [1, 1, 0]",
        "color.toml:3: `lights[0].white_balance[2]` is 0",
    );
    check(
        "[noise]\nelectrons_per_dn = 1\nread_noise_e = -1",
        "color.toml:4: `noise.read_noise_e` is -1",
    );
}

#[test]
fn impossible_lights_are_told() {
    const FAR: &str =
        "[[lights]]\nkind = \"directional\"\ndirection = [0, 0, 1]\nintensity = [1, 1, 1]\n";
    let check = |third: &str, expected: &str| {
        check_file(LIGHTS_FILE, &format!("schema = 1\n{FAR}{FAR}{third}"), expected);
    };
    check(FAR, "fine");
    check("", "lights.toml:2: `lights` are 2; a normal needs 3 lights");
    check(
        &FAR.replace("[1, 1, 1]", "[1, 0, 1]"),
        "lights.toml:13: `lights[2].intensity` is [1.0, 0.0, 1.0]",
    );
    check(
        &FAR.replace("[0, 0, 1]", "[0, 0, 0]"),
        "lights.toml:12: `lights[2].direction` has no length",
    );
    check(
        &FAR.replace("directional", "point"),
        "lights.toml:10: `lights[2]` is a point light: it needs position_mm",
    );
    check(
        &format!("{FAR}gain_map = \"../x.exr\"\n"),
        "lights.toml:14: `lights[2].gain_map` is \"../x.exr\"",
    );
    check(&format!("{FAR}gain_map = \"x.exr\"\n"), "x.exr: not found");
}

#[test]
fn a_gain_map_that_is_no_picture_is_told() {
    let folder = tempfile::tempdir().unwrap();
    write_lights(folder.path(), &lights(), &provenance()).unwrap();
    let map = fs::read_dir(folder.path())
        .unwrap()
        .map(|e| e.unwrap().path())
        .find(|p| p.extension().is_some_and(|e| e == "exr"));
    let map = map.unwrap();
    let bytes = fs::read(&map).unwrap();
    for broken in [&b"text"[..], &bytes[..bytes.len() / 2], &[]] {
        fs::write(&map, broken).unwrap();
        let error = Calibration::load(folder.path()).unwrap_err().to_string();
        assert!(error.contains(".exr: is no RGB OpenEXR picture"), "{error}");
        assert!(error.lines().count() <= 2, "{error}");
    }
}

#[test]
fn a_gain_map_that_leaves_part_of_the_frame_open_is_refused() {
    use exr::prelude::{Encoding, Image, Layer, LayerAttributes, SpecificChannels, WritableImage};
    let folder = tempfile::tempdir().unwrap();
    write_lights(folder.path(), &lights(), &provenance()).unwrap();
    let mut maps = fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().path());
    let map = maps.find(|p| p.extension().is_some_and(|e| e == "exr")).unwrap();
    // Gains of 4 x 4 texels at (at, at) of a display window of 4 x 4.
    let load = |at: i32| {
        let gain = |place: exr::prelude::Vec2<usize>| {
            let gain = 1.0 + place.x() as f32;
            (gain, gain, gain)
        };
        let attributes = LayerAttributes {
            layer_position: exr::prelude::Vec2(at, at),
            ..LayerAttributes::default()
        };
        let size = if at < 0 { (6, 6) } else { (4, 4) };
        let layer =
            Layer::new(size, attributes, Encoding::UNCOMPRESSED, SpecificChannels::rgb(gain));
        let mut image = Image::from_layer(layer);
        image.attributes.display_window =
            exr::meta::attribute::IntegerBounds::from_dimensions((4, 4));
        image.write().non_parallel().to_file(&map).unwrap();
        Calibration::load(folder.path())
    };
    let whole = load(0).unwrap().lights[0].gain_map.clone().unwrap();
    assert_eq!((whole.width, whole.height, whole.data[3]), (4, 4, [4.0; 3]));
    // What lies beyond the frame is cut off, and the rest in its place.
    let cut = load(-1).unwrap().lights[0].gain_map.clone().unwrap();
    assert_eq!((cut.width, cut.height, cut.data[0]), (4, 4, [2.0; 3]));
    let error = load(1).unwrap_err().to_string();
    assert!(error.contains("covers only part of its display window"), "{error}");
}
