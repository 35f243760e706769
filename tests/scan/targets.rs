//! Calibration targets, photographed with the sequencer and the simulated board and camera: the same pictures as `simulate` writes.

use std::path::{Path, PathBuf};
use weavelight::device::scan::{
    About, Begin, Control, Instruments, Options, Pose, Sheet, Subject, open, scan,
};
use weavelight::instrument::Rig;
use weavelight::raw::{Hint, Samples, decode};
use weavelight::session::{FrameEntry, Kind, Session};
use weavelight::simulate::{self, Laid, Lying, Part, lay};

/// A simulated rig's folder with every target as `simulate` photographs it, without noise.
fn simulated(home: &Path) -> PathBuf {
    let mut options = simulate::Options {
        out: home.join("rig"),
        size_px: Some([156, 104]),
        only: vec![Part::Board, Part::Grey, Part::WhiteFlat, Part::WhiteRaised, Part::WhiteTilt],
        ..simulate::Options::default()
    };
    options.flaws.noise = false;
    simulate::run(&options, &|_, _| ()).unwrap();
    options.out
}

/// Lays something on the table, photographs it, and hands over its capture session.
fn photograph(rig: &Path, (lying, laid): (Lying, Subject), exposure_s: f64) -> Session {
    let file = rig.join("rig.toml");
    lay(&file, lying).unwrap();
    let described = Rig::load(&file).unwrap();
    let Instruments { board, mut camera, lock: _lock } = open(&described, &file).unwrap();
    let options = Options {
        folder: rig.join("scanned").join(format!("{:?}", laid.kind())),
        subject: laid,
        about: About { name: None, thickness_mm: None },
        begin: Begin::Resume,
        exposure_s: Some(exposure_s),
        iso: 100.0,
        bracket: vec![],
    };
    scan(&described, &options, &board, camera.as_mut(), &Control::default(), &|_| ()).unwrap();
    Session::load(&options.folder).unwrap()
}

/// Raw numbers over black.
fn signal(session: &Session, entry: &FrameEntry) -> Vec<f64> {
    let frame = decode(&session.read_frame(entry).unwrap(), &Hint::default()).unwrap();
    let Samples::U16(samples) = frame.samples else { panic!("not integers") };
    samples.iter().map(|&sample| f64::from(sample) - f64::from(frame.black[0])).collect()
}

fn known(rig: &Path, lying: Lying) -> Laid {
    lay(&rig.join("rig.toml"), lying).unwrap()
}

/// Every frame of the scan is the one of the simulation that has its light and exposure.
fn check_same(scanned: &Session, simulated: &Session, most_dn: f64) {
    assert_eq!(scanned.kind, simulated.kind);
    assert_eq!(scanned.target, simulated.target);
    assert_eq!(scanned.frames.len(), simulated.frames.len());
    for entry in &scanned.frames {
        let same = |other: &&FrameEntry| {
            (other.light, other.drift_check) == (entry.light, entry.drift_check)
                && (other.exposure_s / entry.exposure_s - 1.0).abs() < 1e-3
        };
        let twin = simulated.frames.iter().find(same).unwrap_or_else(|| panic!("{entry:?}"));
        let scale = twin.exposure_s / entry.exposure_s;
        let (a, b) = (signal(scanned, entry), signal(simulated, twin));
        let worst = a.iter().zip(&b).map(|(a, b)| (a * scale - b).abs()).fold(0.0, f64::max);
        assert!(worst <= most_dn, "{:?} differs by {worst} raw numbers", entry.file);
    }
}

/// Rounding, and exposures that `simulate` rounds to microseconds.
const SAME_DN: f64 = 4.0;

#[test]
fn a_white_sheet_is_the_same_picture() {
    let home = tempfile::tempdir().unwrap();
    let rig = simulated(home.path());
    let level = |height_mm| Lying::White { height_mm, tilt_deg: 0.0, towards_deg: 0.0 };
    let tilted = Lying::White { height_mm: 60.0, tilt_deg: 20.0, towards_deg: 135.0 };
    for (name, lying) in
        [("white-flat", level(0.0)), ("white-raised", level(100.0)), ("white-tilt-2", tilted)]
    {
        let simulated = Session::load(&rig.join(name)).unwrap();
        let Laid { target, plane } = known(&rig, lying);
        let target = target.unwrap();
        let sheet = Sheet { reflectance: target.reflectance, plane, strip: target.board };
        let exposure_s = simulated.frames[0].exposure_s;
        let scanned = photograph(&rig, (lying, Subject::White(sheet)), exposure_s);
        check_same(&scanned, &simulated, SAME_DN);
        let planes = [scanned.plane_or_table(), simulated.plane_or_table()];
        assert!(planes[0].normal.angle(&planes[1].normal) < 1e-9, "{planes:?}");
        assert!((planes[0].point_mm - planes[1].point_mm).norm() < 1e-9, "{planes:?}");
        std::fs::remove_dir_all(&scanned.folder).unwrap();
    }
}

#[test]
fn a_grey_chart_is_the_same_picture() {
    let home = tempfile::tempdir().unwrap();
    let rig = simulated(home.path());
    let simulated = Session::load(&rig.join("grey")).unwrap();
    let patches = known(&rig, Lying::Grey).target.unwrap().patches;
    let exposure_s = simulated.frames[0].exposure_s;
    let scanned = photograph(&rig, (Lying::Grey, Subject::Grey { patches }), exposure_s);
    check_same(&scanned, &simulated, SAME_DN);
}

/// `simulate` photographs boards in a lit room, a scan under one LED: what is black and what is white must be the same.
#[test]
fn a_board_is_in_the_same_place() {
    let home = tempfile::tempdir().unwrap();
    let rig = simulated(home.path());
    let simulated = Session::load(&rig.join("board")).unwrap();
    for (k, pose) in [(0, Pose::Table), (1, Pose::Free), (7, Pose::Free)] {
        let lying = Lying::Board { pose: k };
        let board = known(&rig, lying).target.unwrap().board.unwrap();
        let subject = Subject::Board { board, pose, light: 4 };
        let scanned = photograph(&rig, (lying, subject), 0.05);
        assert_eq!((scanned.kind, &scanned.target), (Kind::Board, &simulated.target));
        let entry = scanned.frames.last().unwrap();
        assert_eq!(entry.pose.as_deref(), (k == 0).then_some("table"));
        assert_eq!((entry.light, entry.pins_open), (None, Some(1 << 4)));
        let (a, b) = (signal(&scanned, entry), signal(&simulated, &simulated.frames[k]));
        let most = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        // The LED lights one side three times as much as the other; ink differs by nineteen.
        let (threshold, brightest) = (0.12 * most(&a), most(&b));
        let clear: Vec<(bool, bool)> = a
            .iter()
            .zip(&b)
            .filter(|(_, b)| !(0.08 * brightest..0.35 * brightest).contains(*b))
            .map(|(a, b)| (*a > threshold, *b > 0.2 * brightest))
            .collect();
        let wrong = clear.iter().filter(|(a, b)| a != b).count();
        assert!(clear.len() > a.len() / 3, "only {} of {} photosites", clear.len(), a.len());
        assert!(wrong * 200 < clear.len(), "pose {k}: {wrong} of {} photosites", clear.len());
    }
    assert_eq!(Session::load(&rig.join("scanned/Board")).unwrap().frames.len(), 3);
}
