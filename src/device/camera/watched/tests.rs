use super::*;
use std::io::{self, Write};
use std::thread::JoinHandle;

/// A RAW file of the smallest kind.
fn raw() -> Vec<u8> {
    under_light(0, 0)
}

/// A RAW file whose picture leans towards `light`; `take` makes other noise.
fn under_light(light: usize, take: usize) -> Vec<u8> {
    const SIDE: usize = 32;
    let options = crate::simulate::Options { size_px: Some([SIDE; 2]), ..Default::default() };
    let instrument = crate::simulate::Instrument::from_options(&options).unwrap();
    let black = 600;
    let photosite = |k: usize| {
        let (x, y) = (k % SIDE, k / SIDE);
        let lean = if light.is_multiple_of(2) { x } else { y };
        let noise = (k * (2 * take + 7)) % 5;
        (black + 1500 + 40 * (light + 1) * lean + noise) as u16
    };
    let samples: Vec<u16> = (0..SIDE * SIDE).map(photosite).collect();
    instrument.encode(&samples, 0.5, 100.0, None).unwrap()
}

/// The beginning of a Canon CR3, which is not read.
fn cr3() -> Vec<u8> {
    let mut bytes = b"\0\0\0\x18ftypcrx \0\0\0\x01crx isom".to_vec();
    bytes.resize(4096, 7);
    bytes
}

fn jpeg() -> Vec<u8> {
    let mut bytes = io::Cursor::new(Vec::new());
    image::RgbImage::new(16, 16).write_to(&mut bytes, image::ImageFormat::Jpeg).unwrap();
    bytes.into_inner()
}

const WAITING: Waiting = Waiting {
    arrival: Duration::from_millis(2000),
    completion: Duration::from_millis(1000),
    rest: Duration::from_millis(60),
    partner: Duration::from_millis(1500),
    second: Duration::from_millis(1000),
    look: Duration::from_millis(5),
};

/// What the other program does: waits so long, then writes (or, without content, removes) the file.
type Step = (u64, &'static str, Option<Vec<u8>>);

fn other_program(folder: &Path, steps: Vec<Step>) -> JoinHandle<()> {
    let folder = folder.to_owned();
    std::thread::spawn(move || {
        for (ms, name, content) in steps {
            std::thread::sleep(Duration::from_millis(ms));
            let path = folder.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            match content {
                Some(bytes) => {
                    let file = fs::File::options().create(true).append(true).open(path);
                    file.unwrap().write_all(&bytes).unwrap();
                }
                None => fs::remove_file(path).unwrap(),
            }
        }
    })
}

/// The name of what was taken, or the beginning of what was said.
fn capture(before: &[(&str, Vec<u8>)], steps: Vec<Step>, exposure_s: f64) -> String {
    let (watched, target) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    for (name, bytes) in before {
        fs::create_dir_all(watched.path().join(name).parent().unwrap()).unwrap();
        fs::write(watched.path().join(name), bytes).unwrap();
    }
    let mut camera = WatchedCamera::new(watched.path(), None, WAITING);
    let applied = camera.configure(Settings { exposure_s, iso: 100.0 }).unwrap();
    assert_eq!(applied, Applied::ByHand);
    let program = other_program(watched.path(), steps);
    let mut shutter = Heard::default();
    let result = camera.capture(target.path(), &mut shutter);
    program.join().unwrap();
    match result {
        Ok(path) => {
            assert_eq!(shutter.0, ["open", "closed"]);
            assert_eq!(fs::read(&path).unwrap(), raw(), "whole");
            path.file_name().unwrap().to_string_lossy().into_owned()
        }
        Err(error) => format!("{error:?}"),
    }
}

#[derive(Default)]
struct Heard(Vec<&'static str>);

impl Shutter for Heard {
    fn open(&mut self) {
        self.0.push("open");
    }

    fn closed(&mut self) {
        self.0.push("closed");
    }
}

#[test]
fn the_right_file_is_taken_when_it_is_whole() {
    let raw = raw();
    let (head, tail) = raw.split_at(300);
    let check = |name: &str, before: &[(&str, Vec<u8>)], steps: Vec<Step>| {
        assert_eq!(capture(before, steps, 0.0), "b.dng", "{name}");
    };
    let whole = |ms| (ms, "b.dng", Some(raw.clone()));
    check("at once", &[], vec![whole(30)]);
    check("another is there", &[("a.dng", raw.clone())], vec![whole(30)]);
    check(
        "in two pieces with a pause",
        &[],
        vec![(30, "b.dng", Some(head.to_vec())), (150, "b.dng", Some(tail.to_vec()))],
    );
    check(
        "under another name first",
        &[],
        vec![(20, "b.dng.tmp", Some(raw.clone())), (100, "b.dng.tmp", None), whole(0)],
    );
    check("with a JPEG before it", &[], vec![(20, "b.jpg", Some(jpeg())), whole(100)]);
    check("with a JPEG after it", &[], vec![whole(20), (10, "b.jpg", Some(jpeg()))]);
    check("with notes", &[], vec![(20, "b.xmp", Some(b"<x/>".to_vec())), whole(50)]);
    check(
        "after the JPEG of the picture before",
        &[("a.dng", raw.clone())],
        vec![(20, "a.jpg", Some(jpeg())), whole(400)],
    );
    check(
        "its JPEG is there already",
        &[("b.jpg", jpeg()), ("a.dng", raw.clone())],
        vec![whole(100)],
    );
    check("a long time after its JPEG", &[], vec![(20, "b.jpg", Some(jpeg())), whole(250)]);
    check(
        "a name that repeats",
        &[("b.dng", under_light(3, 0)), ("b.jpg", jpeg())],
        vec![(20, "b.jpg", None), (0, "b.jpg", Some(jpeg())), (30, "b.dng", None), whole(0)],
    );
    let by_date = |ms, folder: &'static str| (ms, folder, Some(raw.clone()));
    check(
        "in a folder by date",
        &[("2026/11-29/b.dng", raw.clone())],
        vec![by_date(30, "2026/11-30/b.dng")],
    );
    check(
        "JPEG and RAW in folders of their own",
        &[],
        vec![(20, "JPG/b.jpg", Some(jpeg())), by_date(100, "RAW/b.dng")],
    );
    check("saved twice", &[], vec![whole(20), (0, "RAW/b.dng", Some(raw.clone()))]);
    check(
        "hidden folders are not looked into",
        &[],
        vec![(20, ".cache/x.dng", Some(under_light(2, 0))), whole(60)],
    );
}

/// Knows which outputs are lit.
struct Lit(u32, Vec<String>);

impl Shutter for Lit {
    fn open(&mut self) {}

    fn closed(&mut self) {}

    fn lit(&self) -> Option<u32> {
        Some(self.0)
    }

    fn waiting(&mut self, what: &str) {
        self.1.push(what.to_owned());
    }
}

/// The bytes taken or the error, and what was said meanwhile.
type Outcome = (Result<Vec<u8>, String>, Vec<String>);

/// Takes one picture per light, of which the other program writes `steps`.
fn scan(lights: Vec<(u32, Vec<Step>)>) -> Vec<Outcome> {
    let (watched, target) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let mut camera = WatchedCamera::new(watched.path(), None, WAITING);
    let mut one = |(lit, steps)| {
        let program = other_program(watched.path(), steps);
        let mut shutter = Lit(lit, Vec::new());
        let taken = camera.capture(target.path(), &mut shutter);
        program.join().unwrap();
        let bytes = taken.map(|path| fs::read(path).unwrap()).map_err(|e| format!("{e:?}"));
        (bytes, shutter.1)
    };
    lights.into_iter().map(&mut one).collect()
}

#[test]
fn a_second_picture_of_one_light_is_not_the_next_lights() {
    let (first, again, next) = (under_light(0, 0), under_light(0, 1), under_light(1, 0));
    let write = |ms, name, bytes: &Vec<u8>| (ms, name, Some(bytes.clone()));
    let check = |late: &Vec<u8>, why: &str| {
        let taken = scan(vec![
            (1, vec![write(20, "a.dng", &first)]),
            (2, vec![write(20, "b.dng", late), write(200, "c.dng", &next)]),
        ]);
        assert_eq!(taken[0].0, Ok(first.clone()));
        assert_eq!(taken[1].0, Ok(next.clone()), "{why}");
        assert!(taken[1].1[1].contains(&format!("b.dng {why}, and is left out")), "{taken:?}");
    };
    check(&again, "shows the same as an earlier light's");
    check(&first, "is a copy of an earlier picture");
    // The very light again is no second picture; and two lights before is as bad as one.
    let taken = scan(vec![
        (1, vec![write(20, "a.dng", &first)]),
        (1, vec![write(20, "b.dng", &again)]),
        (2, vec![write(20, "c.dng", &next)]),
        (4, vec![write(20, "d.dng", &again), write(100, "e.dng", &under_light(2, 0))]),
    ]);
    let bytes: Vec<Vec<u8>> = taken.into_iter().map(|(bytes, _)| bytes.unwrap()).collect();
    assert_eq!(bytes, [first, again, next, under_light(2, 0)]);
}

#[test]
fn two_outputs_at_one_led_are_taken_at_the_second_try() {
    let write = |name, take| vec![(20, name, Some(under_light(0, take)))];
    let taken = scan(vec![(1, write("a.dng", 0)), (2, write("b.dng", 1)), (2, write("c.dng", 2))]);
    let error = taken[1].0.as_ref().unwrap_err();
    assert!(error.starts_with("SamePicture"), "{error}");
    assert_eq!(taken[2].0, Ok(under_light(0, 2)));
}

#[test]
fn what_is_wrong_is_reported() {
    let raw = raw();
    let check = |steps: Vec<Step>, exposure_s: f64, expected: &str| {
        let said = capture(&[], steps, exposure_s);
        assert!(said.starts_with(expected), "{expected}: {said}");
    };
    check(vec![], 0.0, "NothingArrived");
    check(vec![(20, "a.jpg", Some(jpeg()))], 0.0, "NotRaw { found: \"JPG\" }");
    check(vec![(20, "a.dng", Some(raw[..300].to_vec()))], 0.0, "Incomplete");
    check(vec![(20, "a.cr3", Some(cr3()))], 0.0, "Unsupported");
    check(vec![(20, "a.dng", Some(raw.clone()))], 0.3, "TooEarly");
    check(
        vec![(20, "a.dng", Some(raw.clone())), (0, "b.dng", Some(under_light(1, 0)))],
        0.0,
        "SeveralArrived",
    );
}

#[test]
fn a_folder_that_cannot_be_watched() {
    let folder = tempfile::tempdir().unwrap();
    let check = |path: PathBuf, expected: &str| {
        let error = WatchedCamera::new(&path, None, WAITING).check().unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    check(folder.path().join("none"), "is not there; make it");
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    check(file, "is a file; name a folder");
}
