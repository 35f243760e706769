//! Colour of the solved mosaic: from the albedo under each photosite's own filter to reflectance in three channels.
//!
//! A cloth's yarns are finer than the mosaic's cells, so that neighbours show other parts of a yarn, and interpolation
//! makes coloured bands of them. But neighbours differ in light far more than in dye, and the normals, which hold no
//! colour, say by how much: `shading` takes that out, window by window, and `curve` finds the hidden channels from the
//! distributions of the channels over a window. Each photosite keeps its own value.

mod curve;
mod features;
mod flat;
mod gram;
mod grid;
mod guard;
mod interpolate;
mod numeric;
mod output;
mod pitch;
mod print;
mod published;
#[cfg(test)]
mod reference;
mod relief;
mod shading;
#[cfg(test)]
mod tests;

pub use guard::BRIGHTEST;
pub use output::{Colours, Figures, Input, Refused, find_colours};
pub use pitch::yarn_pitch;
pub use published::Demosaicer;
