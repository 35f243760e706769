//! Reads the wizard's state from a rig's folder.

use super::history;
use super::rig_folder::{RigFolder, age_days};
use super::sheets::Sheets;
use super::state::State;
use super::task::{BOARD_SESSION, GREY_SESSION, Pose, REFUSED};
use super::verdict::Verdict;
use crate::calibrate::{CalibrateError, Progress, SeenBoard, boards_so_far, find_board, status};
use crate::files::{Provenance, sha256_of_file};
use crate::instrument::Calibration;
use crate::session::{FrameEntry, MANIFEST, Session};
use std::collections::HashMap;

/// What was found in pictures so far, so that none is searched twice.
#[derive(Debug, Default)]
pub struct Memory {
    /// Boards by the frame's hash; `None` where there was none.
    boards: HashMap<String, Option<SeenBoard>>,
    /// The white sheets.
    pub sheets: Sheets,
}

/// Reads what is there. Searches every new picture of the chessboard, which takes seconds each: `progress` gets the share
/// done. [`State::foreseen`] stays empty; see [`foresee`].
///
/// # Errors
/// Where a calibration or a frame cannot be read.
pub fn read(
    home: &RigFolder,
    memory: &mut Memory,
    progress: &Progress,
) -> Result<State, CalibrateError> {
    let status = status(&home.calibration())?;
    let calibration = Calibration::load(&home.calibration()).ok();
    let board = Session::load(&home.targets().join(BOARD_SESSION)).ok();
    let seen = board.as_ref().map(|board| look_for_boards(board, memory, progress)).transpose()?;
    let seen = seen.unwrap_or_default();
    let found: Vec<SeenBoard> = seen.iter().flat_map(|(_, seen)| seen.clone()).collect();
    let size_px = [home.rig.camera.width_px, home.rig.camera.height_px];
    let shape = board.as_ref().and_then(|board| board.target.as_ref()?.board);
    let table = seen.iter().any(|(entry, seen)| entry.pose.is_some() && seen.is_some());
    let whole = |pose: Pose| home.is_complete(&home.targets().join(pose.folder()));
    let mut sheets: Vec<Pose> = Pose::FIT.into_iter().filter(|pose| whole(*pose)).collect();
    sheets.extend(Some(Pose::Check).filter(|pose| whole(*pose)));
    let checked = sheets.contains(&Pose::Check);
    Ok(State {
        begun: begun(home),
        boards: [seen.len(), found.len()],
        table,
        corners_px: found.iter().flat_map(|seen| seen.corners_px().to_vec()).collect(),
        so_far: shape.map(|shape| boards_so_far(&found, &shape, size_px)).unwrap_or_default(),
        chart: home.is_complete(&home.targets().join(GREY_SESSION)),
        fresh: fresh(home, calibration.as_ref(), &sheets),
        verdict: Verdict::load(home).filter(|_| checked),
        age_days: calibration.as_ref().and_then(age_days),
        history: history::entries(home),
        sees_chessboards: cfg!(feature = "opencv"),
        sheets,
        foreseen: None,
        status,
    })
}

/// Fills in [`State::foreseen`]: what the sheets so far say of the lights' positions, and what the next one would add.
pub fn foresee(state: &mut State, home: &RigFolder, memory: &mut Memory, progress: &Progress) {
    state.foreseen = memory.sheets.foresee(home, state.next(), progress);
}

/// Whether there are pictures of a calibration, or a new one was begun. A check alone does not count: the calibration that was
/// checked may come from elsewhere.
fn begun(home: &RigFolder) -> bool {
    let Ok(entries) = std::fs::read_dir(home.targets()) else { return false };
    let names: Vec<_> = entries.flatten().map(|entry| entry.file_name()).collect();
    let of_a_check = |name: &std::ffi::OsString| *name == *Pose::Check.folder() || name == REFUSED;
    names.is_empty() || !names.iter().all(of_a_check)
}

/// Every picture of the board with the board that was found in it.
fn look_for_boards(
    session: &Session,
    memory: &mut Memory,
    progress: &Progress,
) -> Result<Vec<(FrameEntry, Option<SeenBoard>)>, CalibrateError> {
    let Some(board) = session.target.as_ref().and_then(|target| target.board) else {
        return Ok(Vec::new());
    };
    let count = session.frames.len();
    let mut all = Vec::new();
    for (k, entry) in session.frames.iter().enumerate() {
        let step = format!("picture {} of {count}", k + 1);
        let tick = || progress(k as f64 / count as f64, &step);
        tick();
        let hash = entry.sha256.clone().unwrap_or_default();
        let seen = match memory.boards.get(&hash) {
            Some(seen) => seen.clone(),
            // Without detection nothing is found; the wizard says what to build.
            None if !cfg!(feature = "opencv") => None,
            None => find_board(&session.frame(entry)?, &board, &tick)?,
        };
        memory.boards.insert(hash, seen.clone());
        all.push((entry.clone(), seen));
    }
    Ok(all)
}

/// Which of camera, colour and lights were made from exactly what lies in `targets` now.
fn fresh(home: &RigFolder, calibration: Option<&Calibration>, sheets: &[Pose]) -> [bool; 3] {
    let from = |provenance: Option<&Provenance>, names: &[String]| {
        let Some(provenance) = provenance else { return false };
        let made_from = |name: &String| {
            let hash = sha256_of_file(&home.targets().join(name).join(MANIFEST));
            hash.is_ok_and(|hash| provenance.inputs.iter().any(|input| input.sha256 == hash))
        };
        !names.is_empty() && names.iter().all(made_from)
    };
    let Some(calibration) = calibration else { return [false; 3] };
    let of = &calibration.provenance;
    let folders: Vec<String> =
        sheets.iter().filter(|pose| **pose != Pose::Check).map(|pose| pose.folder()).collect();
    let stale = calibration.lights_of_another_camera().unwrap_or(true);
    [
        from(of.camera.as_ref(), &[BOARD_SESSION.to_owned()]),
        from(of.color.as_ref(), &[GREY_SESSION.to_owned()]),
        from(of.lights.as_ref(), &folders) && !stale,
    ]
}
