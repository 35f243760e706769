//! The first screen, without a rig.

/// The heading.
pub const HEADING: &str = "Welcome to Weavelight";
/// What this is about.
pub const WHAT: &str =
    "A camera, some lights and a swatch become the material's normals, colour and height.";
/// The first choice.
pub const TRY: &str = "Try it with a simulated rig";
/// What comes of it.
pub const TRY_WHAT: &str =
    "No hardware needed: calibrate, scan a piece of linen and look at it, in about five minutes.";
/// The second choice.
pub const OPEN: &str = "Open a rig";
/// What it wants.
pub const OPEN_WHAT: &str = "The folder that holds rig.toml; or drag it into this window.";
/// The path's field.
pub const PATH: &str = "Folder of the rig";
/// Its button.
pub const OPEN_IT: &str = "Open";
/// Name of the simulated rig's folder.
pub const SIMULATED: &str = "simulated rig";
