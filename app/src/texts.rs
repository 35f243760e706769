//! Every word that the window says, by room; what goes wrong is told in the library's own words.

/// The window's title.
pub const TITLE: &str = "Weavelight";
/// Where the program itself is at fault.
pub const BUG: &str = "the program stumbled over itself; nothing was lost. Please try again, and report it if it comes back";
/// The button that ends work.
pub const CANCEL: &str = "Cancel";
/// The button that puts a problem away.
pub const DISMISS: &str = "Dismiss";
/// The button that puts all problems away.
pub const DISMISS_ALL: &str = "Dismiss all";
/// When the worker rests.
pub const READY: &str = "Ready";
/// The heading of the problems' panel.
pub const PROBLEMS: &str = "Problems";
/// The heading of an error.
pub const FAILED: &str = "failed";
/// The menu of colours and sizes.
pub const VIEW: &str = "View";
/// Light and dark.
pub const THEMES: [&str; 3] = ["As the system", "Light", "Dark"];
/// Size of everything.
pub const SCALE: &str = "Size";

/// Time left, in words.
pub fn time_left(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "less than a second left".to_owned(),
        s if s < 90.0 => format!("{s:.0} s left"),
        s => format!("{:.0} min left", s / 60.0),
    }
}

/// Names of the rooms.
pub mod rooms {
    /// The instrument.
    pub const RIG: &str = "Rig";
    /// The wizard.
    pub const CALIBRATE: &str = "Calibrate";
    /// The daily work.
    pub const SCAN: &str = "Scan";
    /// Maps under a light.
    pub const LOOK: &str = "Look";
    /// What was captured.
    pub const SCANS: &str = "Scans";
}

/// Where there is no rig yet.
pub mod welcome {
    /// The heading.
    pub const HEADING: &str = "Welcome to Weavelight";
    /// What this is about.
    pub const WHAT: &str =
        "A camera, some lights and a swatch become the material's normals, colour and height.";
    /// The first choice.
    pub const TRY: &str = "Try it with a simulated rig";
    /// What comes of it.
    pub const TRY_WHAT: &str = "No hardware needed: calibrate, scan a piece of linen and look at it, in about five minutes.";
    /// The second choice.
    pub const OPEN: &str = "Open a rig";
    /// What it wants.
    pub const OPEN_WHAT: &str = "The folder that holds rig.toml; or drag it into this window.";
    /// The path's field.
    pub const PATH: &str = "Folder of the rig";
    /// The button beside it.
    pub const BROWSE: &str = "Browse…";
    /// Name of the simulated rig's folder.
    pub const SIMULATED: &str = "simulated rig";
}

/// The Rig room.
pub mod rig {
    /// The heading of problems when a rig is opened.
    pub const OPENING: &str = "Opening the rig";
    /// And when a simulated one is made.
    pub const MAKING_SIMULATED: &str = "Making the simulated rig";
}
