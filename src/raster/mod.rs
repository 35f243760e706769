//! Float and integer pictures in and out: EXR, PNG, TIFF, JPEG.

mod error;
mod exr_in;
pub(crate) mod guard;
pub(crate) mod limits;
mod picture;
pub mod srgb;

pub use error::{FileError, PictureError};
pub use exr_in::{Exr, decode_exr, read_exr};
pub(crate) use picture::not_a_picture;
pub use picture::{Format, Picture, Values, decode_picture};
