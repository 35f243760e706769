//! The Calibrate room.

#![allow(missing_docs, reason = "a text says what it is")]

use weavelight::calibrate::wizard::{BOARDS, Entry, Kept, Pose, State, Step, Task};
use weavelight::calibrate::{Action, SeenSheet};

/// The button that takes the pictures of a task.
pub const TAKE: &str = "Take the picture (Space)";
/// The button that starts a fit which was stopped or failed.
pub const FIT: &str = "Calculate (Space)";
/// The button that takes a test shot.
pub const LOOK: &str = "Live";
pub const LOOK_HINT: &str = "Takes test shots continuously and marks what is found; keeps nothing";
/// Where that was ended.
pub const NOT_LOOKED: &str = "The pictures of this rig's calibration have not been checked yet";
pub const LOOK_NOW: &str = "Check them";
/// The button that takes all remaining pictures.
pub const AUTO: &str = "Finish automatically";
pub const AUTO_HINT: &str = "The simulated rig places and photographs all remaining targets";
/// The button that ends that.
pub const STOP: &str = "Stop";
/// The button that starts from the beginning.
pub const START_OVER: &str = "Recalibrate";
pub const START_OVER_HINT: &str =
    "The calibration stays in use until each part is replaced; the old one goes into the history";
/// The button that takes a step's pictures again.
pub const AGAIN: &str = "Again";
pub const AGAIN_HINT: &str =
    "Take the pictures of this step again; the old ones move to the rig's folder “history”";
/// The button that begins a check.
pub const CHECK: &str = "Check now";
pub const CHECK_HINT: &str = "Photograph a tilted sheet that is not used for the calibration";
/// The button that leaves the check for another day.
pub const NOT_NOW: &str = "Not now";
/// Name of the picture.
pub const LAST_PICTURE: &str = "What the camera saw";
/// Before the first picture.
pub const NOTHING_YET: &str = "The picture appears here, with what is found in it.";
/// On a simulated rig.
pub const SIMULATED: &str = "This rig is simulated: the program places the targets for you. Take each picture, or finish automatically.";
/// A build without OpenCV.
pub const NO_CHESSBOARDS: &str = "This window was built without OpenCV and cannot detect chessboards, which the camera calibration needs. Install or build Weavelight with OpenCV (the README says how), and open this rig again. Scanning with an existing calibration still works.";
pub const BOARD: &str = "Inner corners";
pub const STRIP: &str = "Strip beside the sheet: inner corners";
pub const SQUARES: &str = "squares of";
/// The light that boards are photographed under.
pub const LIGHT: &str = "under light";
pub const CHART: &str = "Chart file";
pub const CHART_HINT: &str = "A TOML file with schema = 1 and [[target.patches]]: where each patch lies in the picture, and its colour";
/// Where it is missing.
pub const NO_CHART: &str = "no chart file is chosen; choose one above the button (it lists every patch as [[target.patches]], like a session.toml)";
pub const REFLECTANCE: &str = "Reflectance";
/// The raised sheet's height.
pub const RAISED: &str = "Height over the table";
/// Before the note on a picture that is not of the task in hand.
pub const LAST: &str = "The last picture:";
pub const NEVER: &str = "Not calibrated yet.";
/// The limit of age.
pub const EXPIRES: &str = "Counts as old after";
/// The heading of earlier calibrations and pictures.
pub const HISTORY: &str = "History";
/// While things are put there.
pub const PUTTING_AWAY: &str = "Moving the old pictures into the history";
/// Where there is nothing.
pub const NO_HISTORY: &str =
    "Empty. Earlier calibrations, and pictures that are taken again, are kept here.";
/// The button that leads on.
pub const SCAN: &str = "Start scanning";
/// While pictures are looked at.
pub const LOOKING: &str = "Checking the pictures";
/// While a test shot is taken.
pub const TAKING_LOOK: &str = "Test shot";
/// While the exposure is found.
pub const METERING: &str = "finding the exposure";
/// While the board is gone.
pub const BOARD_LOST: &str = "the light board is gone; plug it in again";
/// A picture without a board.
pub const BOARD_NOT_FOUND: &str = "The board was not found: it must be whole, sharp and evenly lit in the picture. Take another one.";
/// A sheet that cannot serve.
pub const SHEET_REFUSED: &str =
    "This sheet cannot be used; the problem list says why. Take it again.";

/// Names of the steps.
pub fn step(step: Step) -> &'static str {
    match step {
        Step::Camera => "Camera",
        Step::Color => "Colour",
        Step::Lights => "Lights",
        Step::Check => "Check",
    }
}

/// What a step is for.
pub fn what(step: Step) -> &'static str {
    match step {
        Step::Camera => "Lens, sensor and table, from a chessboard",
        Step::Color => "Levels and colour, from a chart",
        Step::Lights => "Where the lights are, from a white sheet",
        Step::Check => "A sheet that was not used for the fit",
    }
}

/// The button's name to those who do not see where it is.
pub fn again(of: Step) -> String {
    format!("{}: take the pictures again", step(of))
}

/// How many pictures are there.
pub fn so_many(step: Step, state: &State) -> String {
    match step {
        Step::Camera => format!("{} / {BOARDS}", state.boards[1]),
        _ => format!("{} / {}", state.sheets.len(), Pose::FIT.len()),
    }
}

/// What to do, in a few words.
pub fn title(task: Task) -> String {
    match task {
        Task::Table => "Lay the chessboard flat in the middle".to_owned(),
        Task::Board => "Hold the chessboard another way".to_owned(),
        Task::Chart => "Lay the colour chart on the table".to_owned(),
        Task::Sheet(pose) => match pose {
            Pose::Flat => "Lay the white sheet on the table".to_owned(),
            Pose::Raised => "Raise the white sheet".to_owned(),
            Pose::Tilt(k) => format!("Tilt the white sheet, {} of 4", k + 1),
            Pose::Check => "Tilt the white sheet once more, to check".to_owned(),
        },
        Task::Fit(_) => "The pictures are there".to_owned(),
        Task::Done => "The rig is calibrated".to_owned(),
    }
}

/// Where in the picture, by column and row of three.
fn place([column, row]: [usize; 2]) -> &'static str {
    const PLACES: [[&str; 3]; 3] = [
        ["the upper left corner", "the upper edge", "the upper right corner"],
        ["the left edge", "the middle", "the right edge"],
        ["the lower left corner", "the lower edge", "the lower right corner"],
    ];
    PLACES[row.min(2)][column.min(2)]
}

/// And how, in a sentence or two.
pub fn how(task: Task, state: &State, simulated: bool) -> String {
    match task {
        Task::Table => "Align its columns with the picture and keep the whole board in view. This picture defines the table. Then press Space.".to_owned(),
        Task::Board => format!(
            "Tilt it by 20 to 40 degrees, in another direction than before, and move it to {} of the picture. Then press Space.",
            place(state.emptiest())
        ),
        Task::Chart => "Place it where the chart file says. It is photographed under every light, and under one light at several exposures.".to_owned(),
        Task::Sheet(Pose::Flat) => "It must be smooth and clean, and cover the whole picture. It is photographed under every light; do not touch it meanwhile.".to_owned(),
        Task::Sheet(Pose::Raised) => "Level, on blocks, about 100 mm above the table. Two heights determine how far away the lights are.".to_owned(),
        Task::Sheet(Pose::Tilt(k)) => format!(
            "Prop it up by about 20 degrees so that it faces {}{}. Tilted sheets determine where the lights are.",
            ["the upper right", "the upper left", "the lower left", "the lower right"][k.min(3)],
            if simulated { "" } else { ", with the whole strip in the picture" }
        ),
        Task::Sheet(Pose::Check) => "Prop it up so that it faces the top of the picture. This sheet is not used for the calibration, so it shows how good the calibration is.".to_owned(),
        Task::Fit(_) => "The calculation was stopped or failed. Start it again, or take the pictures of this step again.".to_owned(),
        Task::Done => "Scans are now solved with this calibration.".to_owned(),
    }
}

/// While pictures are taken.
pub fn taking(task: Task) -> String {
    match task {
        Task::Chart => "Photographing the chart".to_owned(),
        Task::Sheet(_) => "Photographing the white sheet".to_owned(),
        _ => "Photographing the chessboard".to_owned(),
    }
}

/// While a step is calculated.
pub fn fitting(step: Step) -> &'static str {
    match step {
        Step::Camera => "Calibrating the camera",
        Step::Color => "Calibrating levels and colour",
        Step::Lights => "Calibrating the lights",
        Step::Check => "Checking the calibration",
    }
}

/// A board that was found.
pub fn board_found(corners: usize) -> String {
    format!("The board is found: {corners} corners.")
}

/// A chart that was photographed.
pub fn chart_taken(patches: usize, frames: usize) -> String {
    format!("{patches} patches in {frames} frames. Each outline must lie within its patch.")
}

/// A sheet that serves.
pub fn sheet_seen(seen: &SeenSheet) -> String {
    format!(
        "{} cells are measured; tilted by {:.1}°, {:.0} mm over the table, the brightest at {:.0} % of full scale (50 to 90 is good).",
        seen.cells_px.len(),
        seen.tilt_deg,
        seen.height_mm,
        100.0 * seen.brightest
    )
}

/// How many pictures of the board are good.
pub fn boards(found: usize, wanted: usize, lost: usize) -> String {
    let lost = match lost {
        0 => String::new(),
        lost => format!("; {lost} more without a board"),
    };
    format!("{found} of {wanted} pictures{lost}")
}

/// What the corners cover.
pub fn covered(fields: usize, of: usize) -> String {
    match of {
        0 => "No corners yet".to_owned(),
        of => format!("Corners in {fields} of {of} fields"),
    }
}

/// How well the camera fits so far.
pub fn reprojection(rms_px: Option<f64>) -> String {
    match rms_px {
        Some(rms) => format!("Reprojection error now {rms:.3} px; below 0.3 is good"),
        None => "Reprojection error: after four pictures".to_owned(),
    }
}

/// How many sheets are photographed.
pub fn sheets(taken: usize, of: usize) -> String {
    format!("{taken} of {of} sheets")
}

/// A pose of the sheet in a word or two.
fn pose(pose: &Pose) -> &'static str {
    match pose {
        Pose::Flat => "flat",
        Pose::Raised => "raised",
        Pose::Tilt(0) => "facing the upper right",
        Pose::Tilt(1) => "facing the upper left",
        Pose::Tilt(2) => "facing the lower left",
        Pose::Tilt(_) => "facing the lower right",
        Pose::Check => "for the check",
    }
}

/// The sketch of them, to those who do not see it.
pub fn sheets_there(sheets: &[Pose]) -> String {
    match sheets {
        [] => "No sheet yet".to_owned(),
        sheets => {
            format!("Sheets so far: {}", sheets.iter().map(pose).collect::<Vec<_>>().join(", "))
        }
    }
}

/// A length of which two digits are worth reading.
fn about_mm(mm: f64) -> String {
    match mm {
        mm if mm < 1.0 => format!("{mm:.2} mm"),
        mm if mm < 10.0 => format!("{mm:.1} mm"),
        mm => format!("{mm:.0} mm"),
    }
}

/// How well the lights' places would be known if the work ended here.
pub fn foreseen_now(sheets: usize, mm: f64) -> String {
    match sheets {
        0 => format!("Light positions by the ruler: within {}", about_mm(mm)),
        _ => format!("Light positions with these sheets: within {}", about_mm(mm)),
    }
}

/// And with one sheet more.
pub fn foreseen_then(mm: f64) -> String {
    format!("This sheet should improve that to {}; below 1 mm is good", about_mm(mm))
}

/// What came of the camera.
pub fn camera_figures(boards: usize, rms_px: f64, height_mm: f64) -> String {
    format!("{boards} boards, reprojection error {rms_px:.3} px, {height_mm:.1} mm over the table")
}

/// What came of levels and colour.
pub fn color_figures(nonlinearity: Option<f64>, de2000: Option<f64>) -> String {
    let linear = nonlinearity.map_or("linearity not measured".to_owned(), |bend| {
        format!("linear within {:.2} %", 100.0 * bend)
    });
    let color = de2000
        .map_or("no colour patches".to_owned(), |de| format!("colours within CIEDE2000 {de:.2}"));
    format!("{linear}, {color}")
}

/// What came of the lights.
pub fn lights_figures(sigma_mm: f64, moved_mm: f64) -> String {
    format!("Positions within {sigma_mm:.2} mm; the ruler was off by up to {moved_mm:.1} mm")
}

/// What came of the check.
pub fn check_figures(passed: bool, rms_deg: f64, limit_deg: f64) -> String {
    let verdict = if passed { "Passed" } else { "Failed" };
    format!("{verdict}: slopes within {rms_deg:.3}° (limit {limit_deg}°)")
}

/// Of the check, in a sentence.
pub fn verdict(passed: bool) -> &'static str {
    if passed {
        "A sheet that was not used for the calibration is solved correctly."
    } else {
        "A sheet that was not used for the calibration is solved incorrectly; photograph the sheets again: clean, flat and still."
    }
}

/// How well the lights' places are known, now and after what is advised.
pub fn sigma(now_mm: f64, then_mm: Option<f64>) -> String {
    let then = then_mm
        .map_or(String::new(), |then| format!(", {then:.2} mm after the step advised below"));
    format!("Light positions are known within {now_mm:.2} mm{then}.")
}

/// What would make it better; `begun`: its pictures are here, so that single steps can be taken again;
/// `checked`: a sheet that it has not seen was taken, too.
pub fn better(action: &Action, begun: bool, checked: bool) -> String {
    let again = |of: Step| match begun {
        true => format!("Press “{AGAIN}” beside {}", step(of)),
        false => format!("Press “{START_OVER}”"),
    };
    match action {
        Action::Boards | Action::BetterBoards => format!(
            "Best improvement: more pictures of the chessboard, sharp and whole, tilted by 20 to 40 degrees and out to the corners. {}.",
            again(Step::Camera)
        ),
        Action::Chart => {
            format!("Best improvement: pictures of the chart. {}.", again(Step::Color))
        }
        Action::ColorChart => format!(
            "Best improvement: a colour chart whose file states the colour of every patch (lab_d50). {}.",
            again(Step::Color)
        ),
        Action::FlatSheet | Action::MoreSheets => format!(
            "Best improvement: the white sheet flat, raised and tilted. {}.",
            again(Step::Lights)
        ),
        Action::Sheet(pose) => format!(
            "Best improvement: a white sheet {pose}. {}, and lay one of the sheets like that.",
            again(Step::Lights)
        ),
        Action::LightsAgain => format!(
            "The camera was calibrated after the lights, so the light positions belong to its old frame. {}.",
            again(Step::Lights)
        ),
        Action::Check => format!(
            "Nothing is left to improve. Press “{}” beside {} from time to time: a sheet that was not used for the calibration shows whether it still holds.",
            if checked { AGAIN } else { CHECK },
            step(Step::Check)
        ),
    }
}

/// Which picture is looked at.
pub fn picture_of(k: usize, session: &weavelight::session::Session) -> String {
    format!("picture {} of {}", k + 1, session.frames.len())
}

/// How old it is.
pub fn age(days: i64) -> String {
    match days {
        ..=0 => "Calibrated today.".to_owned(),
        1 => "Calibrated yesterday.".to_owned(),
        days => format!("Calibrated {days} days ago."),
    }
}

/// Too old.
pub fn expired(days: i64) -> String {
    format!(
        "Calibrated {days} days ago: LEDs age and stands move. Check it with a tilted sheet, or recalibrate."
    )
}

/// Where something is that was put away, from the rig's folder on.
pub fn where_kept(name: &str) -> String {
    format!("history/{name}")
}

/// That it is there.
pub fn kept(name: &str) -> String {
    format!(
        "The previous files are kept in the rig's folder, under {}; restore them under History.",
        where_kept(name)
    )
}

/// An entry of the history: its stamp, `2026-11-22T1648` in UTC, as the clock on the wall had it.
pub fn entry(entry: &Entry) -> String {
    let stamp = &entry.stamp;
    let when = jiff::civil::DateTime::strptime("%Y-%m-%dT%H%M", stamp)
        .and_then(|when| when.to_zoned(jiff::tz::TimeZone::UTC))
        .map_or_else(|_| stamp.clone(), |when| crate::model::clock::local(when.timestamp()));
    match entry.kept {
        Kept::Calibration => when,
        Kept::Pictures(of) => format!("{}: pictures only\n{when}", step(of)),
    }
}

/// The button beside it.
pub fn restore(kept: Kept) -> &'static str {
    match kept {
        Kept::Calibration => "Restore",
        Kept::Pictures(_) => "Put back",
    }
}

/// Its name to those who do not see where it is.
pub fn restore_name(of: &Entry) -> String {
    format!("{}, {}", restore(of.kept), entry(of).replace('\n', ", "))
}
