//! Maps in files of every kind.

use super::*;
use crate::raster::{
    PngContent, encode_exr, encode_png_rgb8, srgb, write_png_grey16, write_png_rgb16,
};
use exr::prelude as e;
use std::path::PathBuf;

const SIZE: [usize; 2] = [20, 10];

/// Unit vectors, tilted by up to 60 degrees.
fn normal(k: usize) -> [f32; 3] {
    let (x, y) = ((k % 20) as f32 / 20.0 - 0.5, (k / 20) as f32 / 10.0 - 0.5);
    let length = (x * x + y * y + 0.4).sqrt();
    [x / length, y / length, 0.4_f32.sqrt() / length]
}

fn color(k: usize) -> [f32; 3] {
    [0.1 + 0.004 * k as f32, 0.5, 0.02 + 0.003 * k as f32]
}

struct Home(tempfile::TempDir);

impl Home {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn exr(&self, name: &str, channels: [&str; 3], pixel: impl Fn(usize) -> [f32; 3]) {
        let mut bytes = Vec::new();
        encode_exr(&mut bytes, SIZE, &channels, |c, y, row| {
            row.iter_mut().enumerate().for_each(|(x, value)| *value = pixel(y * 20 + x)[c]);
        })
        .unwrap();
        std::fs::write(self.path(name), bytes).unwrap();
    }

    fn png(&self, name: &str, content: PngContent, pixel: impl Fn(usize) -> [f32; 3]) {
        write_png_rgb16(&self.path(name), SIZE, content, |y, row| {
            for (x, out) in row.iter_mut().enumerate() {
                *out = pixel(y * 20 + x).map(|v| (65_535.0 * v).round() as u16);
            }
        })
        .unwrap();
    }

    fn png8(&self, name: &str, content: PngContent, pixel: impl Fn(usize) -> [f32; 3]) {
        let data = (0..200).map(|k| pixel(k).map(|v| (255.0 * v).round() as u8)).collect();
        let bytes = encode_png_rgb8(&Image { width: 20, height: 10, data }, content).unwrap();
        std::fs::write(self.path(name), bytes).unwrap();
    }

    fn compare(&self, a: &str, b: &str, kind: Option<Kind>) -> Result<Figures, String> {
        let (a, b) = (self.path(a), self.path(b));
        run(&Options { a, b, mask: None, kind }).map(|comparison| comparison.figures).map_err(
            |error| {
                assert!(error.to_string().contains("; "), "no remedy: {error}");
                error.to_string()
            },
        )
    }

    /// The largest angle, degrees.
    fn angle(&self, a: &str, b: &str, kind: Option<Kind>) -> f64 {
        match self.compare(a, b, kind).unwrap() {
            Figures::Normal(figures) => figures.max_deg,
            Figures::Color(_) => panic!("{a} and {b} were taken for colours"),
        }
    }

    fn rms(&self, a: &str, b: &str, kind: Option<Kind>) -> f64 {
        match self.compare(a, b, kind).unwrap() {
            Figures::Color(figures) => figures.rms,
            Figures::Normal(_) => panic!("{a} and {b} were taken for normals"),
        }
    }
}

#[test]
fn vectors_are_found_whatever_their_channels_are_called() {
    let home = Home::new();
    home.exr("rgb.exr", ["R", "G", "B"], normal);
    home.exr("xyz.exr", ["X", "Y", "Z"], normal);
    home.exr("blender.exr", ["V.Normal.X", "V.Normal.Y", "V.Normal.Z"], normal);
    for kind in [None, Some(Kind::Normal)] {
        assert_eq!(home.angle("rgb.exr", "xyz.exr", kind), 0.0);
        assert_eq!(home.angle("rgb.exr", "blender.exr", kind), 0.0);
        assert_eq!(home.angle("xyz.exr", "blender.exr", kind), 0.0);
    }
    let error = home.compare("rgb.exr", "xyz.exr", Some(Kind::Color)).unwrap_err();
    assert!(error.contains("xyz.exr: ") && error.contains("X, Y, Z"), "{error}");
    home.exr("odd.exr", ["P", "Q", "S"], normal);
    let error = home.compare("rgb.exr", "odd.exr", None).unwrap_err();
    assert!(error.contains("odd.exr: ") && error.contains("channels P, Q, S"), "{error}");
}

#[test]
fn normals_of_integers_are_decoded_whatever_they_say_of_colour() {
    let home = Home::new();
    home.exr("a.exr", ["R", "G", "B"], normal);
    let stored = |k: usize| normal(k).map(|n| 0.5 * n + 0.5);
    home.png("b.png", PngContent::Data, stored);
    home.png("tagged.png", PngContent::Srgb, stored);
    home.png8("small.png", PngContent::Data, stored);
    for kind in [None, Some(Kind::Normal)] {
        assert!(home.angle("a.exr", "b.png", kind) < 0.003);
        assert!(home.angle("b.png", "tagged.png", kind) == 0.0);
        assert!(home.angle("small.png", "a.exr", kind) < 0.5);
    }
    // Black, grey and transparent pixels are no normals.
    home.png("holes.png", PngContent::Data, |k| match k % 3 {
        0 => [0.0; 3],
        1 => [0.5; 3],
        _ => stored(k),
    });
    let options =
        Options { a: home.path("a.exr"), b: home.path("holes.png"), mask: None, kind: None };
    let found = run(&options).unwrap();
    assert_eq!(found.left_out, 134);
    write_png_grey16(&home.path("grey.png"), SIZE, PngContent::Data, |_, row| row.fill(9)).unwrap();
    let error = home.compare("a.exr", "grey.png", Some(Kind::Normal)).unwrap_err();
    assert!(error.contains("grey.png: a grey picture as normals"), "{error}");
}

#[test]
fn colours_of_integers_are_decoded_by_what_the_file_says() {
    let home = Home::new();
    home.exr("a.exr", ["R", "G", "B"], color);
    let encoded = |k: usize| color(k).map(srgb::encode);
    home.png("b.png", PngContent::Srgb, encoded);
    home.png("silent.png", PngContent::Data, encoded);
    home.png8("small.png", PngContent::Srgb, encoded);
    for kind in [None, Some(Kind::Color)] {
        assert!(home.rms("a.exr", "b.png", kind) < 2e-5);
        assert!(home.rms("a.exr", "silent.png", kind) < 2e-5);
        assert!(home.rms("small.png", "a.exr", kind) < 4e-3);
    }
    let data: Vec<u16> = (0..200).flat_map(|k| color(k).map(|v| (65_535.0 * v) as u16)).collect();
    let tiff: image::ImageBuffer<image::Rgb<u16>, _> =
        image::ImageBuffer::from_raw(20, 10, data).unwrap();
    tiff.save(home.path("c.tif")).unwrap();
    let error = home.compare("a.exr", "c.tif", Some(Kind::Color)).unwrap_err();
    assert!(error.contains("c.tif: a TIFF that does not say how"), "{error}");
}

/// Data windows and primaries through the `exr` crate's writer.
fn write_exr(
    path: &PathBuf,
    place: [i32; 2],
    primaries: Option<[f32; 8]>,
    pixel: impl Fn(usize) -> [f32; 3] + Sync,
) {
    let channels = e::SpecificChannels::rgb(|at: e::Vec2<usize>| {
        let [r, g, b] = pixel(at.y() * 20 + at.x());
        (r, g, b)
    });
    let attributes = e::LayerAttributes {
        layer_position: e::Vec2(place[0], place[1]),
        ..e::LayerAttributes::default()
    };
    let layer = e::Layer::new((20, 10), attributes, e::Encoding::FAST_LOSSLESS, channels);
    let mut attributes = e::ImageAttributes::new(e::IntegerBounds::new((0, 0), (20, 10)));
    attributes.chromaticities = primaries.map(|p| e::attribute::Chromaticities {
        red: e::Vec2(p[0], p[1]),
        green: e::Vec2(p[2], p[3]),
        blue: e::Vec2(p[4], p[5]),
        white: e::Vec2(p[6], p[7]),
    });
    use exr::prelude::WritableImage;
    e::Image::new(attributes, layer).write().non_parallel().to_file(path).unwrap();
}

#[test]
fn a_data_window_is_where_it_says() {
    let home = Home::new();
    home.exr("a.exr", ["R", "G", "B"], color);
    // Pixel (x, y) of the data is pixel (x + 3, y + 2) of the picture.
    write_exr(&home.path("moved.exr"), [3, 2], None, |k| color(k + 43));
    let options = |b: &str| Options {
        a: home.path("a.exr"),
        b: home.path(b),
        mask: None,
        kind: Some(Kind::Color),
    };
    let found = run(&options("moved.exr")).unwrap();
    // Rows 2 to 9, columns 3 to 19; the last pixels of a row continue in the next, where colours do too.
    assert_eq!(found.left_out, 200 - 8 * 17);
    let Figures::Color(figures) = found.figures else { panic!("normals") };
    assert!(figures.rms < 1e-6, "{figures:?}");
    // Overscan to the left and above is cropped.
    write_exr(&home.path("over.exr"), [-3, -2], None, color);
    let found = run(&options("over.exr")).unwrap();
    assert_eq!(found.left_out, 200 - 8 * 17);
    write_exr(&home.path("away.exr"), [300, 0], None, color);
    let error = home.compare("a.exr", "away.exr", Some(Kind::Color)).unwrap_err();
    assert!(error.contains("no pixel has a value in both"), "{error}");
}

#[test]
fn primaries_are_converted_for_colours_and_never_for_normals() {
    let home = Home::new();
    home.exr("a.exr", ["R", "G", "B"], color);
    let p3 = [0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290];
    let p3_from_srgb = |[r, g, b]: [f32; 3]| {
        // CSS Color 4, inverted.
        [
            0.822_462 * r + 0.177_538 * g,
            0.033_194 * r + 0.966_806 * g,
            0.017_083 * r + 0.072_397 * g + 0.910_520 * b,
        ]
    };
    write_exr(&home.path("p3.exr"), [0, 0], Some(p3), |k| p3_from_srgb(color(k)));
    assert!(home.rms("a.exr", "p3.exr", Some(Kind::Color)) < 2e-5);
    home.exr("n.exr", ["R", "G", "B"], normal);
    write_exr(&home.path("n3.exr"), [0, 0], Some(p3), normal);
    assert!(home.angle("n.exr", "n3.exr", Some(Kind::Normal)) < 1e-5);
}

#[test]
fn sizes_are_named() {
    let home = Home::new();
    home.exr("a.exr", ["R", "G", "B"], color);
    write_png_grey16(&home.path("b.png"), [4, 3], PngContent::Srgb, |_, row| row.fill(9)).unwrap();
    let error = home.compare("a.exr", "b.png", None).unwrap_err();
    assert!(error.contains("4 x 3") && error.contains("20 x 10"), "{error}");
    let options = Options {
        a: home.path("a.exr"),
        b: home.path("a.exr"),
        mask: Some(home.path("b.png")),
        kind: None,
    };
    let error = run(&options).unwrap_err().to_string();
    assert!(error.contains("b.png: is 4 x 3"), "{error}");
}

#[test]
fn the_kind_is_guessed_from_name_then_values() {
    let home = Home::new();
    let check = |name: &str, pixel: &dyn Fn(usize) -> [f32; 3], expected: Kind| {
        home.exr(name, ["R", "G", "B"], pixel);
        let source = Source::open(&home.path(name)).unwrap();
        assert_eq!(guess_kind(&source, &source), expected, "{name}");
    };
    check("normal.exr", &|_| [0.5; 3], Kind::Normal);
    check("albedo.exr", &|_| [0.0, 0.0, 1.0], Kind::Color);
    check("a.exr", &|k| [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0; 3]][k % 3], Kind::Normal);
    check("a.exr", &|_| [0.5, -0.5, 0.5], Kind::Normal);
    check("a.exr", &|k| [[0.5; 3], [0.0, 0.0, 1.0]][k % 2], Kind::Color);
    check("a.exr", &|_| [0.0; 3], Kind::Color);
    assert_eq!(kind_of_name(Path::new("out/Normal_map.png")), Some(Kind::Normal));
    assert_eq!(kind_of_name(Path::new("normal/a.png")), None);
}

#[test]
fn only_pixels_with_a_value_in_both_count() {
    let a = [[1.0, 0.0, 0.0], [0.0; 3], [f32::NAN, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
    let b = [
        [1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, 1.0],
        [0.0, f32::INFINITY, 0.0],
        [0.0, 1.0, 0.0],
    ];
    let (places, pairs) = counted_pairs(&a, &b, None);
    assert_eq!((pairs.len(), places), (2, vec![0, 4]));
    let (places, pairs) = counted_pairs(&a, &b, Some(&[false, true, true, false, true]));
    assert_eq!((pairs.len(), places), (1, vec![4]));
}
