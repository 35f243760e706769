use super::*;
use crate::raw::{Frame, Layout, Samples};
use nalgebra::{Point3, UnitVector3, Vector3};
use std::fs;
use std::path::Path;
use weavelight_calibration::description::Image;

const FRAME: &str = "[[frames]]\nfile = \"a.png\"\nlight = 0\nexposure_s = 0.5\niso = 100\n";

/// The example of the format's description, every optional key included.
const EVERYTHING: &str = r#"schema = 1
kind = "white"
name = "linen 4021"
captured = 2026-11-22T10:00:00Z
mask = "mask.png"

[plane]
point_mm = [0.0, 0.0, 5.0]
normal = [0.0, 0.0, 2.0]

[target]
reflectance = 0.99
board = { columns = 9, rows = 6, square_mm = 25.0 }

[[target.patches]]
rect_px = [1200, 800, 1400, 1000]
reflectance = 0.59
lab_d50 = [81.2, -0.6, 0.4]

[[frames]]
file = "light-00.dng"
light = 0
exposure_s = 0.5
iso = 100
sha256 = "BA7816BF8F01CFEA414140DE5DAE2223B00361A396177A9CB410FF61F20015AD"
encoding = "linear"
cfa = "RGGB"
captured = 2026-11-22T10:00:01.5Z
attempts = 2
pins_open = 5
pins_close = 5
board_ms = 123456
drift_check = true

[[frames]]
file = "pictures/table.png"
pose = "table"
exposure_s = 1
iso = 200.0
"#;

fn written(text: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(MANIFEST), text).unwrap();
    folder
}

#[test]
fn every_key_is_read() {
    let folder = written(EVERYTHING);
    let session = Session::load(folder.path()).unwrap();
    assert_eq!((session.kind, session.name.as_str()), (Kind::White, "linen 4021"));
    assert_eq!(session.captured, Some("2026-11-22T10:00:00Z".parse().unwrap()));
    assert_eq!(session.mask_path(), Some(folder.path().join("mask.png")));
    let plane = session.plane.clone().unwrap();
    assert_eq!((plane.point_mm, plane.normal), (Point3::new(0.0, 0.0, 5.0), Vector3::z_axis()));
    let target = session.target.as_ref().unwrap();
    assert_eq!(target.board, Some(Board { columns: 9, rows: 6, square_mm: 25.0 }));
    assert_eq!(target.patches[0].rect_px, [1200.0, 800.0, 1400.0, 1000.0]);
    let [first, second] = &session.frames[..] else { panic!("{} frames", session.frames.len()) };
    let expected = FrameEntry {
        sha256: Some("ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad".into()),
        encoding: Some(Encoding::Linear),
        cfa: Cfa::parse("RGGB"),
        captured: Some("2026-11-22T10:00:01.5Z".parse().unwrap()),
        attempts: Some(2),
        pins_open: Some(5),
        pins_close: Some(5),
        board_ms: Some(123_456),
        drift_check: true,
        ..FrameEntry::new("light-00.dng", Some(0), 0.5, 100.0)
    };
    assert_eq!(*first, expected);
    assert_eq!(second.pose.as_deref(), Some("table"));
    assert_eq!((second.light, second.exposure_s, second.iso), (None, 1.0, 200.0));
}

#[test]
fn what_is_written_is_what_is_read() {
    let folder = written(EVERYTHING);
    let mut session = Session::load(folder.path()).unwrap();
    session.plane = Some(Plane {
        point_mm: Point3::new(0.1, 1.0 / 3.0, -2e-7),
        normal: UnitVector3::new_normalize(Vector3::new(0.3, -0.2, 0.8)),
    });
    session.save().unwrap();
    let again = Session::load(&session.manifest_path()).unwrap();
    let (a, b) = (session.plane.take().unwrap(), again.plane.clone().unwrap());
    assert!((a.normal.into_inner() - b.normal.into_inner()).norm() < 1e-15);
    assert_eq!(a.point_mm, b.point_mm);
    session.plane = again.plane.clone();
    assert_eq!(session, again);
}

/// The error of reading a manifest of `head` and one frame with `extra` keys.
fn check(head: &str, extra: &str, expected: &str) {
    let folder = written(&format!("{head}{FRAME}{extra}"));
    let found = match Session::load(folder.path()) {
        Ok(_) => "fine".to_owned(),
        Err(error) => error.to_string().replace(&folder.path().display().to_string(), "S"),
    };
    assert!(
        found.starts_with(expected),
        "{head:?} {extra:?}:\n found    {found}\n expected {expected}"
    );
    assert!(found.lines().count() <= 2, "{found}");
}

#[test]
fn impossible_manifests_are_told_with_line_and_remedy() {
    const HEAD: &str = "schema = 1\nkind = \"swatch\"\n";
    check(HEAD, "", "fine");
    check(
        "schema = 2\nkind = \"swatch\"\n",
        "",
        "S/session.toml:1: schema 2, but this version reads schema 1",
    );
    check("schema = 1\nkind = \"cloth\"\n", "", "S/session.toml:2: unknown variant `cloth`");
    check("schema = 1\n", "", "S/session.toml:1: missing field `kind`");
    check(HEAD, "gain = 3\n", "S/session.toml:8: unknown field `gain`");
    check(HEAD, "light = 1\n", "S/session.toml:8: duplicate key");
    check(HEAD, "light_index = nan\n", "S/session.toml:8: `frames[0].light_index` is nan");
    check(
        HEAD,
        "[[frames]]\nfile = \"b.png\"\nexposure_s = 0.0\niso = 100\n",
        "S/session.toml:10: `frames[1].exposure_s` is 0",
    );
    check(
        HEAD,
        "[[frames]]\nfile = \"b.png\"\nexposure_s = 1\niso = -100\n",
        "S/session.toml:11: `frames[1].iso` is -100",
    );
    check(
        HEAD,
        "[[frames]]\nfile = \"b.png\"\niso = 100\n",
        "S/session.toml:8: `frames[1].exposure_s` is missing",
    );
    check(
        HEAD,
        "[[frames]]\nfile = \"b.png\"\nexposure_s = 1e300\niso = 100\n",
        "S/session.toml:10: `frames[1].exposure_s` is 1",
    );
    check(
        HEAD,
        "[[frames]]\nfile = \"b.png\"\nexposure_s = 1e-9\niso = 100\n",
        "S/session.toml:10: `frames[1].exposure_s` is 1e-9; exposures are 0.000001 to 86400 seconds",
    );
    check(
        HEAD,
        "[[frames]]\nfile = \"b.png\"\nexposure_s = 1\niso = 0.1\n",
        "S/session.toml:11: `frames[1].iso` is 0.1; sensitivities are 1 to 10000000 ISO",
    );
    check(HEAD, FRAME, "S/session.toml:9: `frames[1].file` is a.png, as in frames[0]");
    check(HEAD, "sha256 = \"12\"\n", "S/session.toml:8: `frames[0].sha256` is no SHA-256");
    check(HEAD, "cfa = \"RGBX\"\n", "S/session.toml:8: `frames[0].cfa` is \"RGBX\"");
    check(HEAD, "encoding = \"gamma\"\n", "S/session.toml:8: unknown variant `gamma`");
    check(
        HEAD,
        "captured = 2026-11-22\n",
        "S/session.toml:8: `frames[0].captured` is 2026-11-22, which is no moment",
    );
    check(
        &format!("{HEAD}[plane]\nnormal = [0, 1, 0]\n"),
        "",
        "S/session.toml:4: `plane.normal` does not point to the camera",
    );
    check(
        &format!("{HEAD}[plane]\nnormal = [0, 0, 0]\n"),
        "",
        "S/session.toml:4: `plane.normal` does not point",
    );
    check(
        &format!("{HEAD}[target]\nreflectance = 99\n"),
        "",
        "S/session.toml:4: `target.reflectance` is 99; reflectances are 0.0001 to 1.5 (1 is perfect white): is this in per cent?",
    );
    check(
        &format!("{HEAD}[target]\nboard = {{ columns = 1, rows = 6, square_mm = 25 }}\n"),
        "",
        "S/session.toml:4: `target.board.columns` is 1",
    );
    check(
        &format!("{HEAD}[[target.patches]]\nrect_px = [9, 0, 3, 4]\nreflectance = 0.5\n"),
        "",
        "S/session.toml:4: `target.patches[0].rect_px` is [9, 0, 3, 4]",
    );
}

#[test]
fn frames_stay_inside_the_folder() {
    for name in ["../a.png", "/etc/passwd", "", "a/../../b", "..", "x\\\\..\\\\b"] {
        let text = format!(
            "schema = 1\nkind = \"swatch\"\n[[frames]]\nfile = \"{name}\"\nexposure_s = 1\niso = 1\n"
        );
        let error = Session::load(written(&text).path()).unwrap_err().to_string();
        assert!(error.contains("session.toml:4: `frames[0].file` is"), "{name}: {error}");
    }
}

#[test]
fn a_board_needs_no_exposure() {
    let folder = written(
        "schema = 1\nkind = \"board\"\n[[frames]]\nfile = \"left01.jpg\"\nencoding = \"srgb\"\n",
    );
    let session = Session::load(folder.path()).unwrap();
    assert_eq!((session.frames[0].exposure_s, session.frames[0].iso), (1.0, 100.0));
}

#[test]
fn a_missing_manifest_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let error = Session::load(folder.path()).unwrap_err().to_string();
    assert!(error.ends_with("session.toml: not found; check the path"), "{error}");
}

#[test]
fn frames_are_checked_against_their_hash() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = SessionWriter::create(Session::new(folder.path(), Kind::Swatch, "x")).unwrap();
    writer.add(FrameEntry::new("a.png", Some(0), 0.5, 100.0), b"one").unwrap();
    let session = Session::load(folder.path()).unwrap();
    assert_eq!(session.read_frame(&session.frames[0]).unwrap(), b"one");
    fs::write(folder.path().join("a.png"), "two").unwrap();
    let error = session.read_frame(&session.frames[0]).unwrap_err().to_string();
    assert!(error.contains("a.png: this frame was altered"), "{error}");
    fs::remove_file(folder.path().join("a.png")).unwrap();
    let error = session.read_frame(&session.frames[0]).unwrap_err().to_string();
    assert!(error.contains("a.png: this frame is missing"), "{error}");
    assert!(session.check_files().is_err());
}

/// An 8-bit picture does not say how it encodes light, nor a grey one its mosaic: the manifest does, for everybody who decodes.
#[test]
fn frames_are_decoded_as_the_manifest_says() {
    let grey = Image { width: 2, height: 2, data: vec![0_u8, 128, 128, 255] };
    let bytes = crate::raster::encode_png_grey8(&grey).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut writer = SessionWriter::create(Session::new(folder.path(), Kind::Swatch, "x")).unwrap();
    let entry = |name: &str| FrameEntry::new(name, Some(0), 0.5, 100.0);
    let bggr = Cfa::parse("BGGR");
    let says = [
        FrameEntry { encoding: Some(Encoding::Srgb), ..entry("srgb.png") },
        FrameEntry { encoding: Some(Encoding::Linear), cfa: bggr, ..entry("mosaic.png") },
        entry("silent.png"),
    ];
    for entry in says {
        writer.add(entry, &bytes).unwrap();
    }
    let session = Session::load(folder.path()).unwrap();
    let share = |frame: &Frame| match &frame.samples {
        Samples::U16(samples) => f64::from(samples[1]) / f64::from(samples[3]),
        Samples::F32(samples) => f64::from(samples[1] / samples[3]),
    };
    let [srgb, mosaic, silent] = [0, 1, 2].map(|k| session.frame(&session.frames[k]));
    let (srgb, mosaic) = (srgb.unwrap(), mosaic.unwrap());
    // sRGB's 128 is 21.6 % of white.
    assert!((share(&srgb) - 0.2159).abs() < 1e-3, "{srgb:?}");
    assert!((share(&mosaic) - 128.0 / 255.0).abs() < 1e-3, "{mosaic:?}");
    assert_eq!((srgb.layout, mosaic.layout), (Layout::Grey, Layout::Mosaic(bggr.unwrap())));
    let error = silent.unwrap_err().to_string();
    assert!(error.contains("silent.png: an 8-bit picture does not say"), "{error}");
    fs::write(folder.path().join("srgb.png"), "other").unwrap();
    let error = session.frame(&session.frames[0]).unwrap_err().to_string();
    assert!(error.contains("srgb.png: this frame was altered"), "{error}");
}

#[test]
fn a_growing_session_is_whole_after_every_frame() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = SessionWriter::create(Session::new(folder.path(), Kind::Swatch, "x")).unwrap();
    for light in 0..3 {
        writer
            .add(
                FrameEntry::new(format!("light-{light}.png"), Some(light), 0.5, 100.0),
                &[light as u8],
            )
            .unwrap();
        let session = Session::load(folder.path()).unwrap();
        assert_eq!(session.frames.len(), light + 1);
        session.check_files().unwrap();
    }
    let mut writer = SessionWriter::resume(folder.path()).unwrap();
    writer.add(FrameEntry::new("light-1.png", Some(1), 0.25, 100.0), b"again").unwrap();
    assert_eq!(writer.session().frames.len(), 3);
    assert!(writer.add(FrameEntry::new("../x.png", Some(1), 0.25, 100.0), b"outside").is_err());
    assert!(!folder.path().join("../x.png").exists());
    assert!(writer.add(FrameEntry::new("y.png", Some(1), f64::NAN, 100.0), b"no time").is_err());
    assert_eq!(Session::load(folder.path()).unwrap().frames.len(), 3);
    assert!(SessionWriter::create(Session::new(folder.path(), Kind::Swatch, "x")).is_err());
}

#[test]
fn a_light_beyond_the_rig_is_named() {
    let mut session = Session::new(Path::new("S"), Kind::Swatch, "x");
    session.frames = vec![
        FrameEntry::new("a.dng", None, 1.0, 100.0),
        FrameEntry::new("b.dng", Some(10), 1.0, 100.0),
    ];
    session.check_lights(11).unwrap();
    let error = session.check_lights(10).unwrap_err().to_string();
    assert!(error.contains("b.dng is of light 10, but there are lights 0 to 9 only"), "{error}");
}

/// Manifests cut off anywhere, or with any byte replaced, are read or refused; they never panic.
#[test]
fn damaged_manifests_never_panic() {
    let path = Path::new("session.toml");
    let bytes = EVERYTHING.as_bytes();
    let check = |damaged: &[u8]| {
        let text = String::from_utf8_lossy(damaged).into_owned();
        let document = crate::files::Document::new(path, text);
        if let Err(error) = super::format::session_from_manifest(Path::new("s"), &document) {
            assert!(error.to_string().lines().count() <= 2, "{error}");
        }
    };
    for place in 0..bytes.len() {
        check(&bytes[..place]);
        for replacement in [b'"', b'[', b'9', b'\n', b'=', 0xff] {
            let mut damaged = bytes.to_vec();
            damaged[place] = replacement;
            check(&damaged);
        }
    }
}
