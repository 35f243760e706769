use super::*;
use crate::device::scan::plan::tests::reference_rig;

const ABOUT: About = About { name: None, thickness_mm: None };

fn plan() -> Plan {
    Plan::new(&reference_rig(), &[]).unwrap()
}

fn open(folder: &Path, begin: Begin) -> Result<(Store, Found), ScanError> {
    Store::open(Place::take(folder)?, (&ABOUT, &Subject::Swatch), begin, &plan())
}

fn keep(store: &mut Store, step: usize, content: &str) {
    let path = store.incoming().join("DSC_1.NEF");
    fs::write(&path, content).unwrap();
    let plan = plan();
    let entry = FrameEntry::new("", plan.steps[step].light, 0.5, 100.0);
    let bytes = content.as_bytes();
    store.keep(&plan, Taken { step, path: &path, bytes, entry }).unwrap();
}

#[test]
fn what_is_kept_is_found_again() {
    let home = tempfile::tempdir().unwrap();
    let folder = home.path().join("scans/linen");
    let (mut store, found) = open(&folder, Begin::Resume).unwrap();
    assert!(found.finished.is_empty());
    for step in [0, 4, 11] {
        keep(&mut store, step, "one");
    }
    keep(&mut store, 4, "two");
    drop(store);
    assert!(!folder.join(WORK_FOLDER).exists());
    let error = open(&folder, Begin::Anew).unwrap_err().to_string();
    assert!(error.contains("(linen, 3 frames); continue it with resume"), "{error}");
    // Files of a killed scan that nobody recorded.
    fs::write(folder.join("light-05.nef"), "half").unwrap();
    fs::create_dir(folder.join(WORK_FOLDER)).unwrap();
    fs::write(folder.join(WORK_FOLDER).join(UNFINISHED), "").unwrap();
    fs::write(folder.join(WORK_FOLDER).join("DSC_2.NEF"), "half").unwrap();
    let (mut store, found) = open(&folder, Begin::Resume).unwrap();
    assert_eq!(found.finished, [0, 4, 11]);
    assert_eq!(found.settings, Some(Settings { exposure_s: 0.5, iso: 100.0 }));
    assert_eq!(store.file(4), Some(folder.join("light-03-take-2.nef")));
    assert!(!folder.join("light-03.nef").exists(), "replaced");
    keep(&mut store, 5, "whole");
    assert_eq!(fs::read_to_string(folder.join("light-04.nef")).unwrap(), "whole");
    store.drop_frame(4).unwrap();
    assert_eq!(store.session().frames.len(), 3);
    assert!(!folder.join("light-03-take-2.nef").exists());
}

#[test]
fn altered_and_missing_frames_are_taken_again() {
    let home = tempfile::tempdir().unwrap();
    let (mut store, _) = open(home.path(), Begin::Resume).unwrap();
    for step in [1, 2, 3] {
        keep(&mut store, step, "one");
    }
    drop(store);
    fs::write(home.path().join("light-00.nef"), "other").unwrap();
    fs::remove_file(home.path().join("light-01.nef")).unwrap();
    let (store, found) = open(home.path(), Begin::Resume).unwrap();
    assert_eq!(found.finished, [3]);
    assert_eq!(found.warnings.len(), 2, "{:?}", found.warnings);
    assert_eq!(store.session().frames.len(), 1);
    assert_eq!(fs::read_to_string(home.path().join("light-00.nef")).unwrap(), "other");
}

/// What somebody put where the scan writes is neither replaced nor deleted.
#[test]
fn files_of_others_stay() {
    let home = tempfile::tempdir().unwrap();
    let at = |name: &str| home.path().join(name);
    fs::write(at("light-00.nef"), "mine").unwrap();
    fs::create_dir(at(WORK_FOLDER)).unwrap();
    fs::write(at(WORK_FOLDER).join("notes.txt"), "mine").unwrap();
    let (mut store, found) = open(home.path(), Begin::Anew).unwrap();
    assert_eq!(found.warnings.len(), 1, "{:?}", found.warnings);
    assert_eq!(fs::read_to_string(at("incoming-1").join("notes.txt")).unwrap(), "mine");
    keep(&mut store, 1, "one");
    assert_eq!(store.file(1), Some(at("light-00-take-2.nef")));
    assert_eq!(fs::read_to_string(at("light-00.nef")).unwrap(), "mine");
    // Altered while the scan runs: taken again, and not deleted.
    fs::write(at("light-00-take-2.nef"), "edited").unwrap();
    keep(&mut store, 1, "two");
    assert_eq!(store.file(1), Some(at("light-00-take-3.nef")));
    assert_eq!(fs::read_to_string(at("light-00-take-2.nef")).unwrap(), "edited");
}

/// Killed between the renaming of a frame and its record, or between that and the deletion of the earlier one.
#[test]
fn a_frame_that_a_killed_scan_did_not_record_goes() {
    let home = tempfile::tempdir().unwrap();
    let at = |name: &str| home.path().join(name);
    let (mut store, _) = open(home.path(), Begin::Anew).unwrap();
    keep(&mut store, 1, "one");
    let recorded = fs::read(at(MANIFEST)).unwrap();
    keep(&mut store, 1, "two");
    let work = at(WORK_FOLDER);
    let notes = fs::read(work.join(crate::files::LIST_FILE)).unwrap();
    drop(store);
    for (manifest, left) in
        [(recorded, "light-00.nef"), (fs::read(at(MANIFEST)).unwrap(), "light-00-take-2.nef")]
    {
        fs::write(at(MANIFEST), manifest).unwrap();
        fs::write(at("light-00.nef"), "one").unwrap();
        fs::write(at("light-00-take-2.nef"), "two").unwrap();
        fs::create_dir(&work).unwrap();
        fs::write(work.join(UNFINISHED), "").unwrap();
        fs::write(work.join(crate::files::LIST_FILE), &notes).unwrap();
        let (store, found) = open(home.path(), Begin::Resume).unwrap();
        assert_eq!(found.finished, [1]);
        assert_eq!(store.file(1), Some(at(left)));
        let other =
            ["light-00.nef", "light-00-take-2.nef"].into_iter().find(|name| *name != left).unwrap();
        assert!(!at(other).exists(), "{other}");
    }
}

#[test]
fn two_scans_cannot_write_one_capture_session() {
    let home = tempfile::tempdir().unwrap();
    let (store, _) = open(home.path(), Begin::Anew).unwrap();
    let error = open(home.path(), Begin::Resume).unwrap_err().to_string();
    assert!(error.contains("in use by") && error.contains("(this program: scan, "), "{error}");
    drop(store);
    open(home.path(), Begin::Resume).unwrap();
}

#[test]
fn another_capture_session_is_refused() {
    let home = tempfile::tempdir().unwrap();
    let (mut store, _) = open(home.path(), Begin::Anew).unwrap();
    keep(&mut store, 9, "one");
    drop(store);
    let check = |about: About, plan: &Plan, expected: &str| {
        let whose = (&about, &Subject::Swatch);
        let error =
            Store::open(Place::take(home.path()).unwrap(), whose, Begin::Resume, plan).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    };
    check(About { name: Some("denim".into()), ..ABOUT }, &plan(), "not \"denim\"");
    check(About { thickness_mm: Some(2.0), ..ABOUT }, &plan(), "thickness or plane point");
    let mut fewer = reference_rig();
    fewer.lights.truncate(5);
    check(ABOUT, &Plan::new(&fewer, &[]).unwrap(), "light-08.nef is no frame of this scan");
    fs::write(home.path().join(MANIFEST), "schema = 1\nkind = \"white\"\n").unwrap();
    check(ABOUT, &plan(), "no scan of a swatch");
}

#[test]
fn pictures_of_a_board_come_one_by_one() {
    let home = tempfile::tempdir().unwrap();
    let board = crate::session::Board { columns: 9, rows: 6, square_mm: 25.0 };
    let picture = |pose: Pose, content: &str| {
        let subject = Subject::Board { board, pose, light: 0 };
        let there = Session::load(home.path()).map_or(Vec::new(), |session| session.frames);
        let plan = Plan::of(&reference_rig(), &subject, &[], &there).unwrap();
        let whose = (&ABOUT, &subject);
        let (mut store, found) =
            Store::open(Place::take(home.path()).unwrap(), whose, Begin::Resume, &plan).unwrap();
        assert!(found.finished.is_empty());
        let path = store.incoming().join("DSC_1.NEF");
        fs::write(&path, content).unwrap();
        let entry = FrameEntry::new("", None, 0.1, 100.0);
        let taken = Taken { step: 0, path: &path, bytes: content.as_bytes(), entry };
        store.keep(&plan, taken).unwrap();
        let session = Session::load(home.path()).unwrap();
        assert_eq!((session.kind, session.target.unwrap().board), (Kind::Board, Some(board)));
        let said = |entry: &FrameEntry| {
            let bytes = fs::read_to_string(home.path().join(&entry.file)).unwrap();
            (bytes, entry.pose.clone())
        };
        session.frames.iter().map(said).collect::<Vec<_>>()
    };
    let table = || Some("table".to_owned());
    picture(Pose::Table, "flat");
    picture(Pose::Free, "left");
    let all = picture(Pose::Free, "right");
    let expected =
        [("flat".to_owned(), table()), ("left".to_owned(), None), ("right".to_owned(), None)];
    assert_eq!(all, expected);
    // Laid flat again: the new picture is the table's, and there is no other.
    let all = picture(Pose::Table, "flatter");
    assert_eq!(all.len(), 3);
    assert!(all.contains(&("flatter".to_owned(), table())), "{all:?}");
    let other = crate::session::Board { square_mm: 20.0, ..board };
    let subject = Subject::Board { board: other, pose: Pose::Free, light: 0 };
    let plan = Plan::of(&reference_rig(), &subject, &[], &[]).unwrap();
    let whose = (&ABOUT, &subject);
    let error = Store::open(Place::take(home.path()).unwrap(), whose, Begin::Resume, &plan)
        .unwrap_err()
        .to_string();
    assert!(error.contains("its [target] is another one"), "{error}");
}

#[test]
fn room_on_the_disk() {
    let home = tempfile::tempdir().unwrap();
    let folder = home.path().join("not/there/yet");
    check_room(&folder, [32, 32], 12).unwrap();
    let error = check_room(&folder, [60_000, 60_000], 1_000_000).unwrap_err().to_string();
    assert!(error.contains("MB free, but the frames need about"), "{error}");
}
