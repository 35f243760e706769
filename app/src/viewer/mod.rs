//! Maps to look at: panned and zoomed to single photosites, under any light. Widgets and sums that any room can use.
//!
//! [`map_view::MapView::show`] draws [`maps::Maps`] as an [`appearance::Appearance`] says. Pictures lie in main memory as pyramids
//! of half-precision texels; only the tiles that are seen go to the graphics card, a few a frame.
//!
//! - [`picture`]: frames for the screen; [`target_picture`]: with what was found in them
//! - [`slopes`], [`profile`]: figures of a surface; [`mask`]: painting a mask

pub mod appearance;
pub mod canvas;
mod coarse;
pub mod geometry;
pub mod gpu;
pub mod map_view;
pub mod maps;
pub mod mask;
mod pace;
pub mod picture;
pub mod pool;
pub mod profile;
pub mod pyramid;
pub mod scales;
pub mod shade;
pub mod slopes;
pub mod target_picture;
pub mod viewport;
