//! Float and integer pictures in and out: EXR, PNG, TIFF, JPEG.

mod error;
mod exr_in;
mod exr_out;
mod exr_rows;
pub(crate) mod guard;
pub(crate) mod limits;
mod picture;
mod png_out;
pub mod srgb;

pub use error::{FileError, PictureError};
pub use exr_in::{Exr, decode_exr, read_exr};
pub use exr_out::{encode_exr, write_exr, write_exr_rgb, write_exr_y};
pub use exr_rows::ExrRows;
pub(crate) use picture::not_a_picture;
pub use picture::{Format, Picture, Values, decode_picture, read_mask, read_picture};
pub use png_out::{
    PngContent, encode_png_grey8, encode_png_rgb8, write_png_grey8, write_png_grey16,
    write_png_rgb16,
};
