mod chosen;
mod exposed;
mod written;

use super::*;
use crate::instrument::Calibration;
use crate::raster::{PngContent, write_png_grey16, write_png_rgb16};
use crate::session::Encoding;
use nalgebra::Matrix3;
use std::fs;
use weavelight_calibration::description::Cfa;

/// A folder of small pictures `names` (16 bits unless the name begins with an 8) beside a light list.
struct Set {
    home: tempfile::TempDir,
}

impl Set {
    fn new(list: &str, text: &str, names: &[&str]) -> Self {
        let home = tempfile::tempdir().unwrap();
        fs::write(home.path().join(list), text).unwrap();
        for (k, name) in names.iter().enumerate() {
            picture(&home.path().join(name), 4, 3, k as u16);
        }
        Self { home }
    }

    fn with(self, name: &str, text: &str) -> Self {
        fs::write(self.home.path().join(name), text).unwrap();
        self
    }

    fn path(&self, name: &str) -> PathBuf {
        self.home.path().join(name)
    }

    fn options(&self, list: &str, images: &[&str]) -> Options {
        Options {
            lights: self.path(list),
            images: images.iter().map(|name| self.path(name)).collect(),
            out: self.path("out"),
            encoding: None,
            cfa: None,
            same_exposure: false,
            mask: None,
        }
    }

    fn import(&self, options: &Options) -> Result<(Session, Summary), String> {
        let summary = run(options, &|_, _| {}).map_err(|error| {
            assert!(!self.path("out").exists(), "{error}");
            let left = fs::read_dir(self.home.path())
                .unwrap()
                .map(|e| e.unwrap().file_name().into_string().unwrap());
            assert_eq!(left.filter(|name| name.contains("partial")).count(), 0, "{error}");
            assert!(error.to_string().lines().count() <= 2, "{error}");
            error.to_string().replace(&format!("{}/", self.home.path().display()), "")
        })?;
        let session = Session::load(&summary.session).unwrap();
        for frame in &session.frames {
            session.read_frame(frame).unwrap();
        }
        Ok((session, summary))
    }
}

fn picture(path: &Path, width: u32, height: u32, value: u16) {
    if path.file_name().unwrap().to_string_lossy().starts_with('8') {
        image::GrayImage::from_pixel(width, height, image::Luma([value as u8])).save(path).unwrap();
    } else {
        let image =
            image::ImageBuffer::from_pixel(width, height, image::Rgb([value, value, value]));
        image.save(path).unwrap();
    }
}

fn files(session: &Session) -> Vec<String> {
    session.frames.iter().map(|frame| frame.file.display().to_string()).collect()
}

const DIRECTIONS: &str = "0 0 1\n0.6 0 0.8\n0 0.6 0.8\n";

#[test]
fn a_plain_list_pairs_in_natural_order() {
    let set =
        Set::new("lights.txt", &format!("3\n{DIRECTIONS}"), &["g.2.png", "g.10.png", "g.1.png"]);
    let (session, summary) =
        set.import(&set.options("lights.txt", &["g.10.png", "g.1.png", "g.2.png"])).unwrap();
    assert_eq!(files(&session), ["g.1.png", "g.2.png", "g.10.png"]);
    assert_eq!(
        session.frames.iter().map(|frame| frame.light).collect::<Vec<_>>(),
        [Some(0), Some(1), Some(2)]
    );
    assert_eq!((summary.frames, summary.size_px), (3, [4, 3]));
    let calibration = Calibration::load(&summary.calibration).unwrap();
    assert!(calibration.camera.is_none());
    let Light::Directional(far) = &calibration.lights[1].light else {
        panic!("{:?}", calibration.lights[1])
    };
    assert!((far.direction.into_inner() - nalgebra::Vector3::new(0.6, 0.0, 0.8)).norm() < 1e-15);
    assert_eq!(far.intensity, [1.0; 3]);
    assert_eq!(calibration.provenance.lights.unwrap().inputs[0].name, "lights.txt");
}

#[test]
fn an_lp_file_names_its_pictures() {
    let lp = "3\r\nb.png 0 0 1\r\nC:\\old\\my a.png 0.6 0 0.8\r\nc.png 0 0.6 0.8\r\n";
    let set = Set::new("dome.lp", lp, &["my a.png", "b.png", "c.png"]);
    let (session, _) = set.import(&set.options("dome.lp", &[])).unwrap();
    assert_eq!(files(&session), ["b.png", "my a.png", "c.png"]);
    fs::remove_dir_all(set.path("out")).unwrap();
    let (session, _) =
        set.import(&set.options("dome.lp", &["c.png", "b.png", "my a.png"])).unwrap();
    assert_eq!(files(&session), ["b.png", "my a.png", "c.png"]);
}

#[test]
fn a_folder_with_filenames_intensities_and_mask() {
    let set =
        Set::new("light_directions.txt", DIRECTIONS, &["a.png", "b.png", "c.png", "mask.png"])
            .with("filenames.txt", "c.png\na.png\nb.png\n")
            .with("light_intensities.txt", "1 2 3\n4 5 6\n7 8 9\n");
    let mut options = set.options("light_directions.txt", &[]);
    options.mask = Some(set.path("mask.png"));
    let (session, summary) = set.import(&options).unwrap();
    assert_eq!(files(&session), ["c.png", "a.png", "b.png"]);
    assert_eq!(session.mask, Some("mask.png".into()));
    let mask = image::open(session.mask_path().unwrap()).unwrap();
    assert!(mask.as_luma8().unwrap().pixels().all(|pixel| pixel.0 == [255]));
    let calibration = Calibration::load(&summary.calibration).unwrap();
    let intensities: Vec<_> =
        calibration.lights.iter().map(|light| light.light.intensity()).collect();
    assert_eq!(intensities, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]]);
}

#[test]
fn what_a_list_does_not_name_is_left_out_with_a_word() {
    let set = Set::new(
        "light_directions.txt",
        DIRECTIONS,
        &["a.png", "b.png", "c.png", "mask.png", "x.png"],
    )
    .with("filenames.txt", "a.png\nb.png\nc.png\n");
    let mut options =
        set.options("light_directions.txt", &["a.png", "b.png", "c.png", "mask.png", "x.png"]);
    options.mask = Some(set.path("mask.png"));
    let (session, summary) = set.import(&options).unwrap();
    assert_eq!(session.frames.len(), 3);
    assert!(summary.warnings[0].ends_with("does not name them: x.png"), "{:?}", summary.warnings);
}

#[test]
fn eight_bits_must_say_how_they_encode_light() {
    let set = Set::new("lights.txt", DIRECTIONS, &["8a.png", "8b.png", "8c.png"]);
    let mut options = set.options("lights.txt", &["8a.png", "8b.png", "8c.png"]);
    let error = set.import(&options).unwrap_err();
    assert!(error.starts_with("8a.png: has 8 bits and does not say how"), "{error}");
    options.encoding = Some(Encoding::Srgb);
    let (session, summary) = set.import(&options).unwrap();
    assert!(session.frames.iter().all(|frame| frame.encoding == Some(Encoding::Srgb)));
    let color = Calibration::load(&summary.calibration).unwrap().color;
    assert_eq!(color.camera_to_linear_srgb, Some(Matrix3::identity()));
}

#[test]
fn pictures_of_one_name_from_two_folders_both_arrive() {
    let set = Set::new("lights.txt", DIRECTIONS, &["a.png", "b.png"]);
    fs::create_dir(set.path("more")).unwrap();
    picture(&set.path("more/a.png"), 4, 3, 9);
    let (session, _) =
        set.import(&set.options("lights.txt", &["a.png", "b.png", "more/a.png"])).unwrap();
    assert_eq!(files(&session), ["a.png", "b.png", "1-a.png"]);
}

/// The error of importing all three pictures with this list.
fn check(list: &str, text: &str, beside: (&str, &str), expected: &str) {
    let mut set = Set::new(list, text, &["a.png", "b.png", "c.png"]);
    if !beside.0.is_empty() {
        set = set.with(beside.0, beside.1);
    }
    let found = match set.import(&set.options(list, &["a.png", "b.png", "c.png"])) {
        Ok(_) => "fine".to_owned(),
        Err(error) => error,
    };
    assert!(
        found.starts_with(expected),
        "{text:?} {beside:?}:\n found    {found}\n expected {expected}"
    );
}

#[test]
fn impossible_lists_are_told_with_line_and_remedy() {
    const NONE: (&str, &str) = ("", "");
    check("l.txt", DIRECTIONS, NONE, "fine");
    check("l.txt", "# directions\n\n0,0,1\n0.6,0,0.8\n0,0.6,0.8", NONE, "fine");
    check("l.txt", &format!("4\n{DIRECTIONS}"), NONE, "l.txt:1: states 4 lines, but 3 follow");
    check(
        "l.txt",
        &format!("{DIRECTIONS}0 0 1\n"),
        NONE,
        "l.txt: 4 directions, but 3 pictures were given",
    );
    check("l.txt", "0 0 1\n0 1 1\n", NONE, "l.txt: 2 directions; a solve takes 3 to 256");
    check("l.txt", &"0 0 1\n".repeat(257), NONE, "l.txt: 257 directions; a solve takes 3 to 256");
    check("l.txt", "0 0 1\n0 0 0\n0 1 1\n", NONE, "l.txt:2: this direction has no length");
    check("l.txt", "0 0 1\n0 nan 1\n0 1 1\n", NONE, "l.txt:2: \"0 nan 1\" is not 3 finite numbers");
    check("l.txt", "0 0 1\n0 1\n0 1 1\n", NONE, "l.txt:2: \"0 1\" is not 3 finite numbers");
    check(
        "l.txt",
        "0 0 1 0\n0 1 1 0\n1 0 1 0\n",
        NONE,
        "l.txt:1: \"0 0 1 0\" is not 3 finite numbers",
    );
    check("l.txt", "", NONE, "l.txt: 0 directions");
    check("l.lp", "a.png 0 0 1\n0 1 1\nc.png 1 0 1\n", NONE, "l.lp:2: this line names no picture");
    check(
        "l.lp",
        "a.png 0 0 1\nx.png 0 1 1\nc.png 1 0 1\n",
        NONE,
        "l.lp:2: names x.png, which is not among",
    );
    check(
        "l.lp",
        "a.png 0 0 1\na.png 0 1 1\nc.png 1 0 1\n",
        NONE,
        "l.lp:2: names a.png, the picture of line 1 already",
    );
    check(
        "l.txt",
        DIRECTIONS,
        ("filenames.txt", "a.png\nb.png\n"),
        "l.txt: 3 directions, but filenames.txt beside it names 2",
    );
    check(
        "l.txt",
        DIRECTIONS,
        ("light_intensities.txt", "1 1 1\n"),
        "l.txt: 3 directions, but light_intensities.txt beside it has 1",
    );
    check("l.txt", DIRECTIONS, ("light_intensities.txt", "1\n2\n3\n"), "fine");
    check(
        "l.txt",
        DIRECTIONS,
        ("light_intensities.txt", "1 1 1\n1 0 1\n1 1 1\n"),
        "light_intensities.txt:2: an intensity is",
    );
}

#[test]
fn impossible_pictures_are_told() {
    let set = Set::new("l.txt", DIRECTIONS, &["a.png", "b.png"]);
    picture(&set.path("c.png"), 5, 3, 0);
    let options = set.options("l.txt", &["a.png", "b.png", "c.png"]);
    assert!(set.import(&options).unwrap_err().starts_with("c.png: is 5 x 3, but a.png is 4 x 3"));
    fs::write(set.path("c.png"), "no picture").unwrap();
    assert!(set.import(&options).unwrap_err().starts_with("c.png: "));
    fs::remove_file(set.path("c.png")).unwrap();
    assert_eq!(set.import(&options).unwrap_err(), "c.png: not found; check the path");
}

#[test]
fn a_capture_session_is_never_replaced() {
    let set = Set::new("l.txt", DIRECTIONS, &["a.png", "b.png", "c.png"]);
    let options = set.options("l.txt", &["a.png", "b.png", "c.png"]);
    set.import(&options).unwrap();
    let error = run(&options, &|_, _| {}).unwrap_err().to_string();
    assert!(error.contains("a capture session is never replaced"), "{error}");
}

#[test]
fn pictures_that_say_their_encoding_are_read_by_it() {
    let names = ["a.png", "b.png", "c.png"];
    let set = Set::new("lights.txt", DIRECTIONS, &names);
    for (k, name) in names.iter().enumerate() {
        write_png_rgb16(&set.path(name), [4, 3], PngContent::Srgb, |y, row| {
            row.fill([(1000 * y + 100 * k) as u16; 3]);
        })
        .unwrap();
    }
    let mut options = set.options("lights.txt", &names);
    let (session, summary) = set.import(&options).unwrap();
    assert!(session.frames.iter().all(|frame| frame.encoding == Some(Encoding::Srgb)));
    assert_eq!(summary.warnings, Vec::<String>::new());
    let color = Calibration::load(&summary.calibration).unwrap().color;
    assert_eq!(color.camera_to_linear_srgb, Some(Matrix3::identity()));
    fs::remove_dir_all(set.path("out")).unwrap();
    options.encoding = Some(Encoding::Linear);
    let (session, summary) = set.import(&options).unwrap();
    assert!(session.frames.iter().all(|frame| frame.encoding == Some(Encoding::Linear)));
    let [warning] = &summary.warnings[..] else { panic!("{:?}", summary.warnings) };
    let expected = "a.png (and 2 others): its sRGB chunk says sRGB, declared is linear. ";
    assert!(warning.contains(expected), "{warning}");
}

#[test]
fn pictures_of_two_encodings_are_named() {
    let names = ["a.png", "b.png", "c.png"];
    let set = Set::new("lights.txt", DIRECTIONS, &names);
    write_png_rgb16(&set.path("b.png"), [4, 3], PngContent::Srgb, |_, row| row.fill([900; 3]))
        .unwrap();
    let (_, summary) = set.import(&set.options("lights.txt", &names)).unwrap();
    let [curves, primaries] = &summary.warnings[..] else { panic!("{:?}", summary.warnings) };
    assert!(curves.contains("a.png is read as linear, but ") && curves.contains("b.png as sRGB"));
    assert!(primaries.starts_with("The pictures differ in their primaries"), "{primaries}");
}

#[test]
fn twelve_bits_in_sixteen_clip_at_4095() {
    let names = ["a.png", "b.png", "c.png"];
    let import = |peak: f64, most: f64| {
        let set = Set::new("lights.txt", DIRECTIONS, &names);
        for (k, name) in names.iter().enumerate() {
            write_png_grey16(&set.path(name), [90, 90], PngContent::Data, |y, row| {
                row.iter_mut().enumerate().for_each(|(x, out)| {
                    let (x, y) = (x as f64 / 45.0 - 1.0, y as f64 / 45.0 - 1.0);
                    let cosine = (1.0 - x * x - y * y).max(0.0).sqrt();
                    *out = (peak * cosine * (1.0 - 0.1 * k as f64)).min(most) as u16;
                });
            })
            .unwrap();
        }
        let (_, summary) = set.import(&set.options("lights.txt", &names)).unwrap();
        let color = Calibration::load(&summary.calibration).unwrap().color;
        (color.saturation_level, summary.warnings)
    };
    let (level, warnings) = import(5000.0, 4095.0);
    assert_eq!(level, Some(4095.0));
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    let expected = "The pictures clip at 4095 (12 bits in a file of more), not at 65535: ";
    assert!(warning.starts_with(expected), "{warning}");
    assert_eq!(import(4000.0, 4095.0), (None, vec![]));
    assert_eq!(import(50_000.0, 65_535.0), (None, vec![]));
}

#[test]
fn a_mask_that_is_transparent_outside() {
    let set = Set::new("lights.txt", DIRECTIONS, &["a.png", "b.png", "c.png"]);
    let inside = |x: u32| x >= 2;
    image::ImageBuffer::from_fn(4, 3, |x, _| {
        image::Rgba([255_u8, 255, 255, if inside(x) { 255 } else { 0 }])
    })
    .save(set.path("mask.png"))
    .unwrap();
    let mut options = set.options("lights.txt", &["a.png", "b.png", "c.png"]);
    options.mask = Some(set.path("mask.png"));
    let (session, _) = set.import(&options).unwrap();
    let mask = image::open(session.mask_path().unwrap()).unwrap();
    let pixels = mask.as_luma8().unwrap().enumerate_pixels();
    assert!(pixels.into_iter().all(|(x, _, pixel)| pixel.0 == [if inside(x) { 255 } else { 0 }]));
    image::RgbaImage::new(4, 3).save(set.path("mask.png")).unwrap();
    fs::remove_dir_all(set.path("out")).unwrap();
    let error = set.import(&options).unwrap_err();
    assert!(error.starts_with("mask.png: the mask is transparent everywhere; "), "{error}");
}
