//! The Calibrate room.

use weavelight::calibrate::wizard::{BOARDS, Entry, Kept, Pose, State, Step, Task};
use weavelight::calibrate::{Action, SeenSheet};

/// The button that takes the pictures of a task.
pub const TAKE: &str = "Take the picture (Space)";
/// The button that fits where that did not happen by itself.
pub const FIT: &str = "Calculate (Space)";
/// The button that takes a test shot.
pub const LOOK: &str = "Live";
/// What that does.
pub const LOOK_HINT: &str = "Looks again and again, with what is found drawn over the picture, until it is switched off; nothing is kept";
/// Where that was ended.
pub const NOT_LOOKED: &str = "Nobody has looked at the pictures of this rig's calibration yet";
/// The way out.
pub const LOOK_NOW: &str = "Look at them";
/// The button that goes on by itself.
pub const AUTO: &str = "Do the rest by itself";
/// What that does.
pub const AUTO_HINT: &str = "The simulated rig lays and photographs every target that is left";
/// The button that ends that.
pub const STOP: &str = "Stop";
/// The button that begins everything anew.
pub const ANEW: &str = "Calibrate anew";
/// What that does.
pub const ANEW_HINT: &str =
    "The calibration stays in use until each part is made anew, and goes into the history";
/// The button that takes a step's pictures again.
pub const AGAIN: &str = "Again";
/// What that does.
pub const AGAIN_HINT: &str =
    "Take the pictures of this step again; those there are go into the folder “history” of the rig";
/// The button that begins a check.
pub const CHECK: &str = "Check now";
/// What that does.
pub const CHECK_HINT: &str = "Photograph a tilted sheet that the calibration has not seen";
/// The button that leaves the check for another day.
pub const NOT_NOW: &str = "Not now";
/// Name of the picture.
pub const LAST_PICTURE: &str = "What the camera saw";
/// Before the first picture.
pub const NOTHING_YET: &str = "The picture appears here, with what is found in it.";
/// On a simulated rig.
pub const SIMULATED: &str = "This rig is simulated: the program lays the target there for you. Take each picture, or let it do the rest.";
/// A build without OpenCV.
pub const NO_CHESSBOARDS: &str = "This window was built without OpenCV and cannot see chessboards, which the camera is calibrated with. Install a Weavelight that was built with it, or build it so (the README says how), and open this rig again. Scans with a calibration that is there already work as before.";
/// The board's shape.
pub const BOARD: &str = "Inner corners";
/// The strip's shape.
pub const STRIP: &str = "Strip beside the sheet: inner corners";
/// Of either.
pub const SQUARES: &str = "squares of";
/// The light that boards are photographed under.
pub const LIGHT: &str = "under light";
/// The chart's file.
pub const CHART: &str = "Chart file";
/// What it holds.
pub const CHART_HINT: &str = "A TOML file with schema = 1 and [[target.patches]]: where each patch lies in the picture, and its colour";
/// Where it is missing.
pub const NO_CHART: &str = "the chart is not described: name its file above the button; it lists every patch as [[target.patches]], as a session.toml does";
/// The sheet's reflectance.
pub const REFLECTANCE: &str = "Reflectance";
/// The raised sheet's height.
pub const RAISED: &str = "Height over the table";
/// Before the note on a picture that is not of the task in hand.
pub const LAST: &str = "The last picture:";
/// No calibration yet.
pub const NEVER: &str = "Not calibrated yet.";
/// The limit of age.
pub const EXPIRES: &str = "Counts as old after";
/// The heading of earlier calibrations and pictures.
pub const HISTORY: &str = "History";
/// While things are put there.
pub const PUTTING_AWAY: &str = "Putting what is there into the history";
/// Where there is nothing.
pub const NO_HISTORY: &str =
    "Empty. Earlier calibrations, and pictures that are taken again, are kept here.";
/// The button that leads on.
pub const SCAN: &str = "Go and scan";
/// While pictures are looked at.
pub const LOOKING: &str = "Looking at the pictures";
/// While a test shot is taken.
pub const TAKING_LOOK: &str = "Test shot";
/// While the exposure is found.
pub const METERING: &str = "finding the exposure";
/// While the board is gone.
pub const BOARD_LOST: &str = "the light board is gone; plug it in again";
/// A picture without a board.
pub const BOARD_NOT_FOUND: &str = "The board was not found: it must be whole, sharp and evenly lit in the picture. Take another one.";
/// A sheet that cannot serve.
pub const SHEET_REFUSED: &str = "This sheet cannot serve; the panel below says why. Take it again.";

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
        Step::Check => "A sheet that the fit has not seen",
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
        Task::Table => "Its columns run along the picture, the whole board is in it. This picture says where the table is; then press Space.".to_owned(),
        Task::Board => format!(
            "Tilt it by 20 to 40 degrees, another way than before, and bring it to {} of the picture. Then press Space.",
            place(state.emptiest())
        ),
        Task::Chart => "Where its patches are stated to be. It is photographed under every light, and under one at several exposures.".to_owned(),
        Task::Sheet(Pose::Flat) => "Smooth, clean, and over the whole picture. It is photographed under every light; do not touch it until then.".to_owned(),
        Task::Sheet(Pose::Raised) => "Level, on blocks, about 100 mm over the table. Two heights tell how far the lights are.".to_owned(),
        Task::Sheet(Pose::Tilt(k)) => format!(
            "Prop it up by about 20 degrees so that it faces {}{}. Tilts tell where the lights are.",
            ["the upper right", "the upper left", "the lower left", "the lower right"][k.min(3)],
            if simulated { "" } else { ", with the whole strip in the picture" }
        ),
        Task::Sheet(Pose::Check) => "Prop it up so that it faces the top of the picture. The calibration has not seen this sheet: what it makes of it tells how good it is.".to_owned(),
        Task::Fit(_) => "The calculation was stopped or failed. Start it again, or take the pictures of this step again.".to_owned(),
        Task::Done => "Scans are solved with this calibration from now on.".to_owned(),
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
        0 => format!("The ruler knows where the lights are within {}", about_mm(mm)),
        _ => format!("Finished now, the lights' places would be known within {}", about_mm(mm)),
    }
}

/// And with one sheet more.
pub fn foreseen_then(mm: f64) -> String {
    format!("This sheet should bring that to {}; below 1 mm is good", about_mm(mm))
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
        "A sheet that the calibration has not seen is solved right."
    } else {
        "A sheet that the calibration has not seen is solved wrong; photograph the sheets again, clean, flat and at rest."
    }
}

/// How well the lights' places are known, now and after what is advised.
pub fn sigma(now_mm: f64, then_mm: Option<f64>) -> String {
    let then =
        then_mm.map_or(String::new(), |then| format!(", {then:.2} mm after what is advised below"));
    format!("The lights' places are known within {now_mm:.2} mm{then}.")
}

/// What would make it better; `begun`: its pictures are here, so that single steps can be taken again;
/// `checked`: a sheet that it has not seen was taken, too.
pub fn better(action: &Action, begun: bool, checked: bool) -> String {
    let again = |of: Step| match begun {
        true => format!("Press “{AGAIN}” beside {}", step(of)),
        false => format!("Press “{ANEW}”"),
    };
    match action {
        Action::Boards | Action::BetterBoards => format!(
            "What would improve it most: more pictures of the chessboard, sharp and whole, tilted by 20 to 40 degrees and out to the corners. {}.",
            again(Step::Camera)
        ),
        Action::Chart => {
            format!("What would improve it most: pictures of the chart. {}.", again(Step::Color))
        }
        Action::ColorChart => format!(
            "What would improve it most: a colour chart whose file states the colour of every patch (lab_d50). {}.",
            again(Step::Color)
        ),
        Action::FlatSheet | Action::MoreSheets => format!(
            "What would improve it most: the white sheet flat, raised and tilted. {}.",
            again(Step::Lights)
        ),
        Action::Sheet(pose) => format!(
            "What would improve it most: a white sheet {pose}. {}, and lay one of the sheets like that.",
            again(Step::Lights)
        ),
        Action::LightsAgain => format!(
            "The camera was calibrated after the lights, whose places still stand in its old frame. {}.",
            again(Step::Lights)
        ),
        Action::Check => format!(
            "Nothing is left to improve. Press “{}” beside {} from time to time: a sheet that the calibration has not seen tells whether it still holds.",
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
        "Calibrated {days} days ago: LEDs age and stands get moved. Check it on a tilted sheet, or calibrate anew."
    )
}

/// Where something is that was put away, from the rig's folder on.
pub fn where_kept(name: &str) -> String {
    format!("history/{name}")
}

/// That it is there.
pub fn kept(name: &str) -> String {
    format!(
        "What was there before is kept in the rig's folder, under {}; History takes it back.",
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
