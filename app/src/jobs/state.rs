//! What all rooms share: the open rig, the work under way, problems, and the queue of requests to the worker.

use crate::jobs::control::JobAction;
use crate::jobs::look;
use crate::jobs::messages::Request;
use crate::model::activity::Activity;
use crate::model::names::ScanNames;
use crate::model::problem::{Area, Problem, Severity};
use crate::model::project::Project;
use crate::model::room::Room;
use crate::model::settings::Settings;
use std::path::{Path, PathBuf};

/// Shared by all rooms.
#[derive(Debug)]
pub struct AppState {
    /// What is remembered from start to start.
    pub settings: Settings,
    /// The rig that is open.
    pub project: Option<Project>,
    /// Which other program holds it, in words: then it is looked at only.
    pub held_by: Option<String>,
    /// Whether its lights are calibrated.
    pub is_calibrated: bool,
    /// How old its calibration is; `None` where there is none.
    pub calibration_age_days: Option<i64>,
    /// What the worker is doing.
    pub activity: Option<Activity>,
    /// Problems that are not dismissed yet; the newest last.
    pub problems: Vec<Problem>,
    /// The names that scans of the rig have.
    pub names: ScanNames,
    /// A solution is on its way to the Look room.
    is_opening: bool,
    requests: Vec<Request>,
    actions: Vec<JobAction>,
}

impl AppState {
    /// The state before a rig is open.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            project: None,
            held_by: None,
            is_calibrated: false,
            calibration_age_days: None,
            activity: None,
            problems: Vec::new(),
            names: ScanNames::default(),
            is_opening: false,
            requests: Vec::new(),
            actions: Vec::new(),
        }
    }

    /// Age of a calibration that counts as too old to go on with, days.
    pub fn expired_days(&self) -> Option<i64> {
        let limit = self.settings.targets.expires_after_days;
        self.calibration_age_days.filter(|days| *days > limit)
    }

    /// Leaves something to be done.
    pub fn request(&mut self, command: Request) {
        self.requests.push(command);
    }

    /// What was left to be done, once.
    pub fn take_requests(&mut self) -> Vec<Request> {
        std::mem::take(&mut self.requests)
    }

    /// Whether something is left that was not handed over yet.
    pub fn has_requests(&self) -> bool {
        !self.requests.is_empty()
    }

    /// Acts on the work under way.
    pub fn control(&mut self, control: JobAction) {
        self.actions.push(control);
    }

    /// What is to act on the work under way, once.
    pub fn take_actions(&mut self) -> Vec<JobAction> {
        std::mem::take(&mut self.actions)
    }

    /// Whether the worker has something to do that takes its time.
    pub fn is_busy(&self) -> bool {
        self.activity.is_some()
    }

    /// Whether the rig, its scans and their solutions may be changed now.
    pub fn can_change(&self) -> bool {
        !self.is_busy() && self.held_by.is_none()
    }

    /// Whether the rig in this folder is the one that is open.
    pub fn is_open(&self, folder: &Path) -> bool {
        self.project.as_ref().is_some_and(|project| project.folder == folder)
    }

    /// Opens a solution in the Look room.
    pub fn look_at(&mut self, solution: PathBuf) {
        self.is_opening = true;
        self.request(Request::Look(look::Command::Open(solution)));
        self.go_to(Room::Look);
    }

    /// Whether a solution was asked for that the Look room is to show, once.
    pub fn take_opening(&mut self) -> bool {
        std::mem::take(&mut self.is_opening)
    }

    /// Opens another room.
    pub fn go_to(&mut self, room: Room) {
        self.settings.room = room;
    }

    /// Puts away the errors of an area, where it is tried once more.
    pub fn forget_errors(&mut self, area: Area) {
        let stays =
            |problem: &Problem| problem.area != Some(area) || problem.severity == Severity::Warning;
        self.problems.retain(stays);
    }

    /// Puts up a problem; the same one twice is one.
    pub fn report(&mut self, problem: Problem) {
        self.problems.retain(|old| *old != problem);
        self.problems.push(problem);
    }
}
