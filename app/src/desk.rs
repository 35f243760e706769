//! What all rooms share: the rig that is open, what is going on, what went wrong, and what the rooms want done.

use crate::names::Taken;
use crate::place::Place;
use crate::rooms::{Room, look};
use crate::settings::Settings;
use crate::worker::Command;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use weavelight::files::one_line;

/// Shared by all rooms.
#[derive(Debug)]
pub struct Desk {
    /// What is remembered from start to start.
    pub settings: Settings,
    /// The rig that is open.
    pub place: Option<Place>,
    /// Which other program holds it, in words: then it is looked at only.
    pub held_by: Option<String>,
    /// Whether its lights are calibrated.
    pub is_calibrated: bool,
    /// How old its calibration is; `None` where there is none.
    pub calibration_age_days: Option<i64>,
    /// What the worker is doing.
    pub activity: Option<Activity>,
    /// What went wrong and nobody has put away yet; the newest last.
    pub problems: Vec<Problem>,
    /// The names that scans of the rig have.
    pub taken: Taken,
    /// A solution is on its way to the Look room.
    is_opening: bool,
    asked: Vec<Command>,
    brakes: Vec<Brake>,
}

/// Acts at once on the work under way, past the queue of commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Brake {
    /// End it.
    Cancel,
    /// Let a scan rest.
    Pause,
    /// Go on with a scan.
    GoOn,
}

/// Something that went wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// What was to be done, as in "Scan".
    pub title: String,
    /// What is wrong, where, and what to do: the library's own words.
    pub text: String,
    /// Whether the work failed, or is done and this ought to be known.
    pub severity: Severity,
    /// What it belongs to; `None` where that is not known.
    pub area: Option<Area>,
}

/// What a problem belongs to: the next try there shows whether it is still one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Area {
    /// Opening a rig.
    Opening,
    /// Board, camera and lights.
    Rig,
    /// Calibrating.
    Calibrate,
    /// Scanning and solving.
    Scan,
    /// Looking at a solution.
    Look,
    /// The gallery of scans.
    Scans,
    /// Keeping the settings.
    Settings,
}

/// Characters of a problem: names of files and what is in them may be any length.
const LONGEST: usize = 1500;

impl Problem {
    /// Work that failed.
    pub fn error(title: impl Into<String>, text: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            text: one_line(&text.into(), LONGEST),
            severity: Severity::Error,
            area: None,
        }
    }

    /// The same, of an area.
    pub fn of(self, area: Area) -> Self {
        Self { area: Some(area), ..self }
    }

    /// Something that ought to be known.
    pub fn warning(title: impl Into<String>, text: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            text: one_line(&text.into(), LONGEST),
            severity: Severity::Warning,
            area: None,
        }
    }
}

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The work is done; this ought to be known.
    Warning,
    /// The work failed.
    Error,
}

/// Work under way.
#[derive(Clone, Debug)]
pub struct Activity {
    /// As in "Solving linen 4021".
    pub title: String,
    /// The step it is at, as in "light 4".
    pub step: String,
    /// Share done, 0 to 1.
    pub share: f64,
    /// When it began.
    pub since: Instant,
    /// Time left as the work itself foresees it.
    pub left: Option<Duration>,
}

impl Activity {
    /// As it begins.
    pub fn new(title: String) -> Self {
        Self { title, step: String::new(), share: 0.0, since: Instant::now(), left: None }
    }

    /// Time left, once it can be foreseen: as the work says, else from the share done.
    pub fn time_left(&self) -> Option<Duration> {
        const FORESEEABLE: f64 = 0.05;
        let by_share = || {
            let spent = self.since.elapsed().as_secs_f64();
            (self.share > FORESEEABLE && spent > 1.0)
                .then(|| Duration::from_secs_f64(spent * (1.0 - self.share).max(0.0) / self.share))
        };
        self.left.or_else(by_share)
    }
}

impl Desk {
    /// An empty desk.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            place: None,
            held_by: None,
            is_calibrated: false,
            calibration_age_days: None,
            activity: None,
            problems: Vec::new(),
            taken: Taken::default(),
            is_opening: false,
            asked: Vec::new(),
            brakes: Vec::new(),
        }
    }

    /// Age of a calibration that counts as too old to go on with, days.
    pub fn expired_days(&self) -> Option<i64> {
        let limit = self.settings.targets.expires_after_days;
        self.calibration_age_days.filter(|days| *days > limit)
    }

    /// Leaves something to be done.
    pub fn ask(&mut self, command: Command) {
        self.asked.push(command);
    }

    /// What was left to be done, once.
    pub fn take_asked(&mut self) -> Vec<Command> {
        std::mem::take(&mut self.asked)
    }

    /// Whether something is left that was not handed over yet.
    pub fn has_asked(&self) -> bool {
        !self.asked.is_empty()
    }

    /// Acts on the work under way.
    pub fn brake(&mut self, brake: Brake) {
        self.brakes.push(brake);
    }

    /// What is to act on the work under way, once.
    pub fn take_brakes(&mut self) -> Vec<Brake> {
        std::mem::take(&mut self.brakes)
    }

    /// Whether the worker has something to do that takes its time.
    pub fn is_busy(&self) -> bool {
        self.activity.is_some()
    }

    /// Whether the rig, its scans and their solutions may be changed now.
    pub fn can_change(&self) -> bool {
        !self.is_busy() && self.held_by.is_none()
    }

    /// Opens a solution in the Look room.
    pub fn look_at(&mut self, solution: PathBuf) {
        self.is_opening = true;
        self.ask(Command::Look(look::Ask::Open(solution)));
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
    pub fn tell(&mut self, problem: Problem) {
        self.problems.retain(|old| *old != problem);
        self.problems.push(problem);
    }
}
