//! Float and integer pictures in and out: EXR, PNG, TIFF, JPEG.

mod decode;
mod encoding;
mod error;
mod exr_in;
mod exr_layers;
mod exr_out;
mod exr_rows;
mod foreign;
pub(crate) mod guard;
mod icc;
mod jpeg_in;
pub(crate) mod limits;
mod mask;
mod picture;
mod png_in;
mod png_out;
mod primaries;
pub mod srgb;
#[cfg(test)]
mod tests;
mod tiff_in;

pub use decode::{decode_picture, read_picture};
pub use encoding::{Curve, Said, SaidCurve, Tone};
pub use error::PictureError;
pub use exr_in::{Exr, decode_exr, read_exr};
pub(crate) use exr_layers::Choice;
pub use exr_layers::{Group, Role};
pub use exr_out::{encode_exr, write_exr, write_exr_rgb, write_exr_y};
pub use exr_rows::ExrRows;
pub use mask::{decode_mask, read_mask};
pub(crate) use picture::not_a_picture;
pub use picture::{Alpha, Format, Picture, Values};
pub use png_out::{
    PngContent, encode_png_grey8, encode_png_rgb8, write_png_grey8, write_png_grey16,
    write_png_rgb16,
};
