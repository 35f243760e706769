//! Many lights, and pictures that choose among them; copies; mosaics.

use super::*;
use image::{ImageBuffer, Luma, Rgb};

/// A list of `count` lights of a dome with names, and different pictures of these names.
fn dome(count: usize) -> Set {
    let mut text = format!("{count}\n");
    for k in 0..count {
        let angle = k as f64 * 2.4;
        let height = 0.4 + 0.5 * k as f64 / count as f64;
        text += &format!("d{k}.png {} {} {height}\n", 0.5 * angle.cos(), 0.5 * angle.sin());
    }
    let names: Vec<String> = (0..count).map(|k| format!("d{k}.png")).collect();
    Set::new("dome.lp", &text, &names.iter().map(String::as_str).collect::<Vec<_>>())
}

#[test]
fn as_many_lights_as_a_dome_has() {
    for count in [65, 96, 256] {
        let set = dome(count);
        let (session, summary) = set.import(&set.options("dome.lp", &[])).unwrap();
        assert_eq!((session.frames.len(), summary.lights_in_list), (count, count));
        assert_eq!(Calibration::load(&summary.calibration).unwrap().lights.len(), count);
    }
    let set = dome(257);
    let error = set.import(&set.options("dome.lp", &[])).unwrap_err();
    assert_eq!(error, "dome.lp: 257 directions; a solve takes 3 to 256");
}

#[test]
fn pictures_given_choose_their_lights() {
    let set = dome(300);
    let chosen = ["d250.png", "d2.png", "d10.png", "d299.png"];
    let (session, summary) = set.import(&set.options("dome.lp", &chosen)).unwrap();
    assert_eq!(files(&session), ["d2.png", "d10.png", "d250.png", "d299.png"]);
    assert_eq!((summary.frames, summary.lights_in_list), (4, 300));
    assert!(
        summary.warnings[0].contains("the pictures given choose 4 of its 300 lights"),
        "{:?}",
        summary.warnings
    );
    let lights = Calibration::load(&summary.calibration).unwrap().lights;
    let Light::Directional(far) = &lights[3].light else { panic!("{:?}", lights[3]) };
    let angle = 299.0_f64 * 2.4;
    let expected =
        nalgebra::Vector3::new(0.5 * angle.cos(), 0.5 * angle.sin(), 0.4 + 0.5 * 299.0 / 300.0);
    assert!((far.direction.into_inner() - expected.normalize()).norm() < 1e-12);
    let options = Options { out: set.path("other"), ..set.options("dome.lp", &chosen[..2]) };
    let error = run(&options, &|_, _| {}).unwrap_err().to_string();
    let expected = "dome.lp: 2 of its 300 lights are chosen; a solve takes 3 to 256";
    assert!(error.ends_with(expected), "{error}");
}

#[test]
fn a_name_that_fits_nothing_is_a_mistake() {
    let set = dome(5);
    picture(&set.path("x1.png"), 4, 3, 7);
    let error =
        set.import(&set.options("dome.lp", &["d0.png", "d2.png", "d3.png", "x1.png"])).unwrap_err();
    assert!(
        error.starts_with("dome.lp:3: names d1.png, which is not among the pictures given"),
        "{error}"
    );
}

#[test]
fn copies_are_told() {
    let set = Set::new("l.txt", DIRECTIONS, &["a.png", "b.png", "c.png"]);
    fs::copy(set.path("a.png"), set.path("b.png")).unwrap();
    let (_, summary) = set.import(&set.options("l.txt", &["a.png", "b.png", "c.png"])).unwrap();
    let [warning] = summary.warnings.as_slice() else { panic!("{:?}", summary.warnings) };
    assert!(
        warning.contains("a.png and")
            && warning.contains("b.png (lights 0 and 1) are the same picture"),
        "{warning}"
    );
    // The same samples in another file.
    fs::remove_dir_all(set.path("out")).unwrap();
    let rgb = image::open(set.path("c.png")).unwrap();
    rgb.save(set.path("d.tif")).unwrap();
    let (_, summary) = set.import(&set.options("l.txt", &["a.png", "c.png", "d.tif"])).unwrap();
    assert!(
        summary.warnings[0].contains("(lights 1 and 2) hold the same picture"),
        "{:?}",
        summary.warnings
    );
    fs::remove_dir_all(set.path("out")).unwrap();
    let (_, summary) = set.import(&set.options("l.txt", &["a.png", "c.png", "c.png"])).unwrap();
    assert!(
        summary.warnings[0].contains("c.png is given for lights 1 and 2"),
        "{:?}",
        summary.warnings
    );
}

/// A grey picture whose 2 x 2 cells hold these shares of a smooth shade.
fn cells(path: &Path, shares: [f64; 4], turn: f64) {
    let picture = ImageBuffer::from_fn(64, 48, |x, y| {
        let shade = 20_000.0
            + 10_000.0 * ((f64::from(x) * 0.07 + turn).sin() + (f64::from(y) * 0.09).cos());
        Luma([(shade * shares[(y % 2 * 2 + x % 2) as usize]) as u16])
    });
    picture.save(path).unwrap();
}

#[test]
fn a_mosaic_is_imported_as_one_and_suspected_where_it_is_not_said() {
    let set = Set::new("l.txt", DIRECTIONS, &[]);
    let names = ["a.png", "b.png", "c.png"];
    for (k, name) in names.iter().enumerate() {
        cells(&set.path(name), [0.5, 1.0, 0.96, 0.7], k as f64);
    }
    let mut options = set.options("l.txt", &names);
    let (session, summary) = set.import(&options).unwrap();
    assert_eq!(session.frames[0].cfa, None);
    assert!(
        summary.warnings[0].contains("look like a colour sensor's mosaic"),
        "{:?}",
        summary.warnings
    );
    fs::remove_dir_all(set.path("out")).unwrap();
    options.cfa = Cfa::parse("GBRG");
    let (session, summary) = set.import(&options).unwrap();
    assert!(session.frames.iter().all(|frame| frame.cfa == options.cfa));
    assert_eq!(summary.warnings, Vec::<String>::new());
    // Colour pictures are none.
    ImageBuffer::from_pixel(64, 48, Rgb([1_u16, 2, 3])).save(set.path("a.png")).unwrap();
    fs::remove_dir_all(set.path("out")).unwrap();
    let error = set.import(&options).unwrap_err();
    assert_eq!(
        error,
        "a.png: cfa GBRG is given, but this file holds an RGB picture; leave out cfa, or correct it"
    );
}

#[test]
fn grey_pictures_of_cloth_are_no_mosaic() {
    let set = Set::new("l.txt", DIRECTIONS, &[]);
    let names = ["a.png", "b.png", "c.png"];
    // A weave of 2.1 pixels a thread, alike in every picture.
    for (k, name) in names.iter().enumerate() {
        let picture = ImageBuffer::from_fn(640, 480, |x, y| {
            let thread = (f64::from(x) * 3.0).sin() * (f64::from(y) * 2.9).cos();
            Luma([(20_000.0 + 9_000.0 * thread + 1_000.0 * k as f64) as u16])
        });
        picture.save(set.path(name)).unwrap();
    }
    let (_, summary) = set.import(&set.options("l.txt", &names)).unwrap();
    assert_eq!(summary.warnings, Vec::<String>::new());
}
