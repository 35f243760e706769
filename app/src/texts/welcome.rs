//! The first screen, without a rig.

#![allow(missing_docs, reason = "a text says what it is")]

pub const HEADING: &str = "Welcome to Weavelight";
/// What this is about.
pub const WHAT: &str =
    "A camera, some lights and a swatch become the material's normals, colour and height.";
pub const TRY: &str = "Try it with a simulated rig";
/// What comes of it.
pub const TRY_WHAT: &str =
    "No hardware needed: calibrate, scan a piece of linen and look at it, in about five minutes.";
pub const OPEN: &str = "Open a rig";
pub const OPEN_WHAT: &str = "The folder that holds rig.toml; or drag it into this window.";
pub const PATH: &str = "Folder of the rig";
pub const OPEN_IT: &str = "Open";
/// Name of the simulated rig's folder.
pub const SIMULATED: &str = "simulated rig";
