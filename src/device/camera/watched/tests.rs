use super::*;
use std::io::Write;
use std::thread::JoinHandle;

/// A RAW file of the smallest kind, and its bytes.
fn raw() -> Vec<u8> {
    let options = crate::simulate::Options { size_px: Some([16, 16]), ..Default::default() };
    let instrument = crate::simulate::Instrument::from_options(&options).unwrap();
    instrument.encode(&[700; 256], 0.5, 100.0, None).unwrap()
}

fn jpeg() -> Vec<u8> {
    let mut bytes = io::Cursor::new(Vec::new());
    image::RgbImage::new(16, 16).write_to(&mut bytes, image::ImageFormat::Jpeg).unwrap();
    bytes.into_inner()
}

const WAITING: Waiting = Waiting {
    arrival: Duration::from_millis(600),
    completion: Duration::from_millis(400),
    rest: Duration::from_millis(60),
    partner: Duration::from_millis(300),
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
            assert!(watched.path().join(path.file_name().unwrap()).exists(), "theirs stays theirs");
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
}

#[test]
fn what_is_wrong_is_told() {
    let raw = raw();
    let check = |steps: Vec<Step>, exposure_s: f64, expected: &str| {
        let said = capture(&[], steps, exposure_s);
        assert!(said.starts_with(expected), "{expected}: {said}");
    };
    check(vec![], 0.0, "NothingArrived");
    check(vec![(20, "a.jpg", Some(jpeg()))], 0.0, "NotRaw { found: \"JPG\" }");
    check(vec![(20, "a.dng", Some(raw[..300].to_vec()))], 0.0, "Incomplete");
    check(vec![(20, "notes.pdf", Some(b"%PDF".to_vec()))], 0.0, "Incomplete");
    check(vec![(20, "a.dng", Some(raw.clone()))], 0.3, "TooEarly");
    check(
        vec![(20, "a.dng", Some(raw.clone())), (0, "b.dng", Some(raw.clone()))],
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
