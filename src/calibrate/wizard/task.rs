//! Steps of the wizard, poses of the white sheet, and single tasks.

/// The wizard's steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Lens, sensor and table from a chessboard.
    Camera,
    /// Levels and colour from a chart.
    Color,
    /// Places and strengths of the lights from white sheets.
    Lights,
    /// A sheet that the fit has not seen.
    Check,
}

impl Step {
    /// In the order of the work.
    pub const ALL: [Step; 4] = [Step::Camera, Step::Color, Step::Lights, Step::Check];

    /// Folders of its capture sessions.
    pub fn folders(self) -> Vec<String> {
        match self {
            Step::Camera => vec![BOARD_SESSION.to_owned()],
            Step::Color => vec![GREY_SESSION.to_owned()],
            Step::Lights => Pose::FIT.into_iter().map(Pose::folder).collect(),
            Step::Check => vec![Pose::Check.folder()],
        }
    }
}

/// Folder of the chessboard's capture session, below the rig's `targets`.
pub const BOARD_SESSION: &str = "board";
/// Folder of the chart's capture session.
pub const GREY_SESSION: &str = "grey";
/// Folder of the last sheet that could not be used.
pub const REFUSED: &str = "refused";

/// How a white sheet is placed on the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Height of its middle over the table, millimetres.
    pub height_mm: f64,
    /// Angle between the sheet and the table, degrees.
    pub tilt_deg: f64,
    /// Where the tilted sheet faces, degrees: 0 is the picture's right, 90 its top.
    pub faces_deg: f64,
}

/// How a white sheet lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pose {
    /// On the table.
    Flat,
    /// Level, on blocks.
    Raised,
    /// Propped up: towards the upper right, upper left, lower left, lower right.
    Tilt(usize),
    /// Propped up another way, for the check.
    Check,
}

impl Pose {
    /// Those that the lights are calibrated with.
    pub const FIT: [Pose; 6] =
        [Pose::Flat, Pose::Raised, Pose::Tilt(0), Pose::Tilt(1), Pose::Tilt(2), Pose::Tilt(3)];

    /// The capture session's folder.
    pub fn folder(self) -> String {
        match self {
            Pose::Flat => "white-flat".to_owned(),
            Pose::Raised => "white-raised".to_owned(),
            Pose::Tilt(k) => format!("white-tilt-{}", k + 1),
            Pose::Check => "check-tilt".to_owned(),
        }
    }

    /// Where the sheet is to be placed.
    pub fn placement(self) -> Placement {
        let [height_mm, tilt_deg, faces_deg] = match self {
            Pose::Flat => [0.0; 3],
            Pose::Raised => [100.0, 0.0, 0.0],
            Pose::Tilt(k) => [60.0, 20.0, 90.0 * k as f64 + 45.0],
            Pose::Check => [60.0, 18.0, 90.0],
        };
        Placement { height_mm, tilt_deg, faces_deg }
    }
}

/// One thing to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// The chessboard flat on the table.
    Table,
    /// The chessboard once more, another way.
    Board,
    /// The chart.
    Chart,
    /// A white sheet.
    Sheet(Pose),
    /// Pictures are there: the fit, which failed or was stopped.
    Fit(Step),
    /// Nothing.
    Done,
}

impl Task {
    /// The step that it belongs to; `None` where all are done.
    pub fn step(self) -> Option<Step> {
        match self {
            Task::Table | Task::Board => Some(Step::Camera),
            Task::Chart => Some(Step::Color),
            Task::Sheet(Pose::Check) => Some(Step::Check),
            Task::Sheet(_) => Some(Step::Lights),
            Task::Fit(step) => Some(step),
            Task::Done => None,
        }
    }
}
