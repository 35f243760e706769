//! What a view draws.

use crate::viewer::appearance::Appearance;
use crate::viewer::maps::Maps;

/// What is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Canvas<'a> {
    /// The maps.
    pub maps: &'a Maps,
    /// How they are shown.
    pub appearance: &'a Appearance,
    /// What is drawn, in words, for those who do not see it.
    pub name: &'a str,
    /// Whether dragging with the first button pans; where not, only the others do.
    pub drag_pans: bool,
}
