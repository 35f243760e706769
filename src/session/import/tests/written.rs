//! Lists as all kinds of programs write them.

use super::*;

/// Imports pictures of these names by a list of these bytes; returns the pictures in the lights' order.
fn import(bytes: &[u8], pictures: &[&str]) -> Result<(Vec<String>, Summary), String> {
    let set = Set::new("l.lp", "", pictures);
    fs::write(set.path("l.lp"), bytes).unwrap();
    let (session, summary) = set.import(&set.options("l.lp", &[]))?;
    let lights = Calibration::load(&summary.calibration).unwrap().lights;
    let Light::Directional(far) = &lights[1].light else { panic!("{:?}", lights[1]) };
    assert!((far.direction.into_inner() - nalgebra::Vector3::new(0.6, 0.0, 0.8)).norm() < 1e-12);
    Ok((files(&session), summary))
}

#[test]
fn the_picture_that_each_line_means() {
    let check = |text: &str, pictures: &[&str], expected: [&str; 3]| {
        let (found, _) = import(text.as_bytes(), pictures).unwrap();
        assert_eq!(found, expected, "{text:?}");
    };
    let plain = ["a.png", "b.png", "c.png"];
    check(
        "3\rc.png 0 0 1\rb.png 0.6 0 0.8\ra.png 0 0.6 0.8\r",
        &plain,
        ["c.png", "b.png", "a.png"],
    );
    check(
        "3\nc.png 0 0 1\nb.png 0,6 0 0,8\na.png 0 0,6 0,8\n\u{1a}",
        &plain,
        ["c.png", "b.png", "a.png"],
    );
    check(
        "3\n1 c.png 0 0 1\n2 b.png .6 0 .8\n3 a.png 0 .6 .8",
        &plain,
        ["c.png", "b.png", "a.png"],
    );
    check("C.PNG 0 0 1\nB.PNG 0.6 0 0.8\nx/A.PNG 0 0.6 0.8", &plain, ["c.png", "b.png", "a.png"]);
    let spaced = ["a  1.png", "a, 2.png", "1 a.png"];
    check(
        "\"1 a.png\" 0 0 1\n\"a, 2.png\" 0.6 0 0.8\n\"a  1.png\" 0 0.6 0.8",
        &spaced,
        ["1 a.png", "a, 2.png", "a  1.png"],
    );
    check(
        "1 a.png 0 0 1\na, 2.png 0.6 0 0.8\na  1.png 0 0.6 0.8",
        &spaced,
        ["1 a.png", "a, 2.png", "a  1.png"],
    );
    // Composed in the list, decomposed on the disk.
    let umlaut = ["mu\u{308}nze.png", "b.png", "c.png"];
    check("m\u{fc}nze.png 0 0 1\nb.png 0.6 0 0.8\nc.png 0 0.6 0.8", &umlaut, umlaut);
    let (found, _) =
        import(b"m\xfcnze.png 0 0 1\nb.png 0.6 0 0.8\nc.png 0 0.6 0.8", &umlaut).unwrap();
    assert_eq!(found, umlaut);
}

#[test]
fn another_extension_is_taken_and_told() {
    let list = b"a.jpg 0 0 1\nb.jpg 0.6 0 0.8\nc.jpg 0 0.6 0.8";
    let (found, summary) = import(list, &["a.png", "b.png", "c.png"]).unwrap();
    assert_eq!(found, ["a.png", "b.png", "c.png"]);
    assert!(
        summary.warnings[0]
            .ends_with("names a.jpg, which is not there; a.png was taken, and so for 2 others"),
        "{:?}",
        summary.warnings
    );
}

#[test]
fn what_cannot_be_told_is_refused_with_its_line() {
    let check = |bytes: &[u8], pictures: &[&str], expected: &str| {
        let error = import(bytes, pictures).unwrap_err();
        assert!(error.starts_with(expected), "{error}, not {expected}");
    };
    let plain = ["a.png", "b.png", "c.png"];
    check(
        b"a.png 0 0 1\nx.png 0.6 0 0.8\nc.png 0 0.6 0.8",
        &plain,
        "l.lp:2: names x.png, which is not there beside it",
    );
    check(
        b"a.png 0 0 1\nB.png 0.6 0 0.8\nc.png 0 0.6 0.8",
        &["a.png", "b.png", "b.PNG", "c.png"],
        "l.lp:2: B.png may be ",
    );
    check(
        b"a.png 0 0 1\nb.png 0.6 0 0.8\nA.png 0 0.6 0.8",
        &plain,
        "l.lp:3: names A.png, the picture of line 1 already",
    );
    check(
        b"a.png 0 0 1\nb.png,0,6,0,0,0,8\nc.png 0 0.6 0.8",
        &plain,
        "l.lp:2: \"b.png,0,6,0,0,0,8\" is not 3 finite numbers",
    );
    check(b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR", &plain, "l.lp: is not a list of text lines");
}

#[test]
fn intensities_and_names_beside_the_list_are_read_as_well() {
    let set = Set::new(
        "light_directions.txt",
        "0;0;1\n0,6;0;0,8\n0;0,6;0,8\n",
        &["a 1.png", "b.png", "c.png"],
    )
    .with("filenames.txt", "3\r\"a 1.png\"\rB.PNG\rc.png\r")
    .with("light_intensities.txt", "1;0,5;1\r\n2;0,5;2\r\n4;0,5;4\r\n");
    let (session, summary) = set.import(&set.options("light_directions.txt", &[])).unwrap();
    assert_eq!(files(&session), ["a 1.png", "b.png", "c.png"]);
    let lights = Calibration::load(&summary.calibration).unwrap().lights;
    let intensities: Vec<_> = lights.iter().map(|light| light.light.intensity()).collect();
    assert_eq!(intensities, [[1.0, 0.5, 1.0], [2.0, 0.5, 2.0], [4.0, 0.5, 4.0]]);
}
