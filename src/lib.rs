//! Weavelight: a camera, ten LEDs and an Arduino as a fabric scanner.
//!
//! A capture session (RAW frames, one LED each) and a calibration go in; per photosite the surface normal and the albedo
//! come out. Folders are the architecture:
//!
//! - [`files`]: reading and writing that every format shares (TOML with places, hashes, whole-or-nothing outputs)
//! - [`machine`]: threads and memory, as far as they are to be had
//! - [`quantity`]: the range of every number by its unit
//! - [`raster`]: float and integer pictures (EXR, PNG, TIFF, JPEG) in and out
//! - [`raw`]: a frame as the sensor wrote it; [`linear`]: its raw numbers as linear light
//! - [`session`]: the capture-session folder; [`instrument`]: `rig.toml` and the calibration folder;
//!   [`solution`]: the folder that a solve writes; [`settings`]: how solves are set
//! - [`albedo`]: the colours of a solved mosaic
//! - [`photometry`]: the kernels, on one band of rows; [`gpu`]: their first step on a graphics processor; [`swatch`]: where
//!   the cloth is; [`solve`]: the run around them; [`live`]: maps while a scan runs
//! - [`simulate`]: the simulated rig's folders
//! - [`device`]: the light board, and what else the capture needs of the world
//! - [`report`]: what a command tells; [`mod@bench`]: run time against error

pub mod albedo;
pub mod bench;
pub mod calibrate;
pub mod cli;
pub mod compare;
pub mod demo;
pub mod device;
pub mod doctor;
pub mod files;
pub mod gpu;
pub mod instrument;
pub mod linear;
pub mod live;
pub mod machine;
pub mod photometry;
pub mod quantity;
pub mod raster;
pub mod raw;
pub mod report;
pub mod session;
pub mod settings;
pub mod simulate;
pub mod solution;
pub mod solve;
pub mod swatch;
