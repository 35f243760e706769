//! What a rig's folder holds, and the task that follows from it.

use super::history::Entry;
use super::task::{Pose, Step, Task};
use super::verdict::Verdict;
use crate::calibrate::{BoardsSoFar, Foreseen, Status, StepState};

/// What a rig's folder holds.
#[derive(Clone, Debug)]
pub struct State {
    /// What the calibration says of itself.
    pub status: Status,
    /// Whether a calibration from pictures in the rig's `targets` folder is under way or finished.
    pub begun: bool,
    /// Pictures of the board, and of them those in which it was found.
    pub boards: [usize; 2],
    /// Whether the board on the table was found.
    pub table: bool,
    /// Every corner found so far, pixels.
    pub corners_px: Vec<[f64; 2]>,
    /// What they cover, and how well they fit.
    pub so_far: BoardsSoFar,
    /// Whether the chart is photographed.
    pub chart: bool,
    /// The sheets that are photographed.
    pub sheets: Vec<Pose>,
    /// How well the sheets locate the lights so far, and with the next one.
    pub foreseen: Option<Foreseen>,
    /// Which of camera, colour and lights were made from what lies in `targets` now.
    pub fresh: [bool; 3],
    /// Result of the check; `None` before it.
    pub verdict: Option<Verdict>,
    /// Days since the oldest part was made.
    pub age_days: Option<i64>,
    /// Earlier calibrations and pictures, the newest first.
    pub history: Vec<Entry>,
    /// Whether chessboards can be seen: a build with OpenCV.
    pub sees_chessboards: bool,
}

/// Pictures of the board that a good camera needs.
pub const BOARDS: usize = 12;

impl State {
    /// The one thing to do now.
    pub fn next(&self) -> Task {
        let calibrated = self.status.steps.iter().all(|step| step.state != StepState::Missing);
        if calibrated && !self.begun {
            return Task::Done;
        }
        if !self.fresh[0] {
            return match (self.table, self.boards[1] < BOARDS) {
                (false, _) => Task::Table,
                (true, true) => Task::Board,
                (true, false) => Task::Fit(Step::Camera),
            };
        }
        if !self.fresh[1] {
            return if self.chart { Task::Fit(Step::Color) } else { Task::Chart };
        }
        if let Some(pose) = Pose::FIT.into_iter().find(|pose| !self.sheets.contains(pose)) {
            return Task::Sheet(pose);
        }
        if !self.fresh[2] {
            return Task::Fit(Step::Lights);
        }
        match (self.sheets.contains(&Pose::Check), &self.verdict) {
            (false, _) => Task::Sheet(Pose::Check),
            (true, None) => Task::Fit(Step::Check),
            (true, Some(_)) => Task::Done,
        }
    }

    /// How far a step is: share of its pictures, and whether it is finished.
    pub fn share(&self, step: Step) -> f32 {
        let share = |part: usize, whole: usize| part.min(whole) as f32 / whole as f32;
        let sheets = Pose::FIT.iter().filter(|pose| self.sheets.contains(pose)).count();
        match step {
            Step::Camera => share(self.boards[1], BOARDS),
            Step::Color => share(usize::from(self.chart), 1),
            Step::Lights => share(sheets, Pose::FIT.len()),
            Step::Check => share(usize::from(self.verdict.is_some()), 1),
        }
    }

    /// The part of the picture that has the fewest corners: column and row of three by three.
    pub fn emptiest(&self) -> [usize; 2] {
        let [columns, rows] = self.so_far.coverage_grid;
        let corners = |[i, j]: [usize; 2]| -> usize {
            let inside = |k: &usize| (k % columns * 3 / columns, k / columns * 3 / rows) == (i, j);
            (0..columns * rows).filter(inside).map(|k| self.so_far.coverage[k]).sum()
        };
        // The corners of the picture first: distortion is largest there.
        let order = [[0, 0], [2, 2], [2, 0], [0, 2], [1, 0], [1, 2], [0, 1], [2, 1], [1, 1]];
        if columns == 0 || rows == 0 {
            return [1, 1];
        }
        order.into_iter().min_by_key(|place| corners(*place)).unwrap_or([1, 1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state() -> State {
        let folder = tempfile::tempdir().unwrap();
        State {
            status: crate::calibrate::status(folder.path()).unwrap(),
            begun: false,
            boards: [0, 0],
            table: false,
            corners_px: Vec::new(),
            so_far: BoardsSoFar::default(),
            chart: false,
            sheets: Vec::new(),
            foreseen: None,
            fresh: [false; 3],
            verdict: None,
            age_days: None,
            history: Vec::new(),
            sees_chessboards: true,
        }
    }

    #[test]
    fn one_task_after_the_other() {
        let mut state = state();
        let check = |state: &State, expected: Task| assert_eq!(state.next(), expected);
        check(&state, Task::Table);
        state.boards = [3, 3];
        check(&state, Task::Table);
        state.table = true;
        check(&state, Task::Board);
        state.boards = [14, BOARDS];
        check(&state, Task::Fit(Step::Camera));
        state.fresh[0] = true;
        check(&state, Task::Chart);
        state.chart = true;
        check(&state, Task::Fit(Step::Color));
        state.fresh[1] = true;
        for pose in Pose::FIT {
            check(&state, Task::Sheet(pose));
            state.sheets.push(pose);
        }
        check(&state, Task::Fit(Step::Lights));
        state.fresh[2] = true;
        check(&state, Task::Sheet(Pose::Check));
        state.sheets.push(Pose::Check);
        check(&state, Task::Fit(Step::Check));
        let kept = "schema = 1\nlights_sha256 = \"\"\npassed = false\nslope_rms_deg = 0.3\nlimit_deg = 0.1";
        state.verdict = Some(toml::from_str(kept).unwrap());
        check(&state, Task::Done);
        // A board that is photographed once more makes everything after it stale.
        state.fresh = [false; 3];
        check(&state, Task::Fit(Step::Camera));
    }

    #[test]
    fn a_calibration_from_elsewhere_is_left_alone_until_it_is_begun_again() {
        let mut state = state();
        state.status.steps.iter_mut().for_each(|step| step.state = StepState::Good);
        assert_eq!(state.next(), Task::Done);
        state.begun = true;
        assert_eq!(state.next(), Task::Table);
    }

    #[test]
    fn the_board_goes_where_no_corners_are() {
        let mut state = state();
        assert_eq!(state.emptiest(), [1, 1]);
        let mut coverage = vec![5; 48];
        coverage[47] = 0;
        state.so_far = BoardsSoFar { coverage, coverage_grid: [8, 6], rms_px: None };
        assert_eq!(state.emptiest(), [2, 2]);
    }
}
