//! What goes to a graphics processor and what comes back.

use crate::photometry::{CutRow, Found, Method, VarianceModel};

/// Rows that are solved in one go.
pub struct Tile<'a> {
    /// The rows; of any length each.
    pub rows: Vec<TileRow<'a>>,
    /// Lights of every row.
    pub lights: usize,
    /// Per parity of the picture's row and light: variance at even and odd columns.
    pub variance: &'a [Vec<[VarianceModel; 2]>; 2],
    /// Weighted, or plain least squares.
    pub method: Method,
}

/// A row as the kernels read it, cut.
pub struct TileRow<'a> {
    /// Per light: y, one value a photosite, NaN where unusable.
    pub signal: Vec<&'a [f32]>,
    /// Per photosite: what the gain maps do to the noise; `None` means 1 everywhere. In all rows of a tile, or in none.
    pub noise_scale: Option<&'a [f32]>,
    /// The pieces.
    pub cut: &'a CutRow,
    /// Parity of the picture's row.
    pub parity: usize,
}

impl TileRow<'_> {
    /// Photosites.
    pub fn width(&self) -> usize {
        self.signal.first().map_or(0, |signal| signal.len())
    }
}

/// Values a photosite: g, the variance across the normal, the sum of squared residuals.
pub(super) const FOUND_PLANES: usize = 5;

/// What was found of a tile.
pub struct Answer<'a> {
    pub(super) values: &'a [f32],
    /// Photosites before each row, and in all.
    pub(super) before: &'a [usize],
}

impl Answer<'_> {
    /// What was found of row number `row` of the tile.
    pub fn row(&self, row: usize) -> Found<'_> {
        let (start, end) = (self.before[row], self.before[row + 1]);
        let values = &self.values[start * FOUND_PLANES..end * FOUND_PLANES];
        let plane = |k: usize| &values[k * (end - start)..(k + 1) * (end - start)];
        Found { g: [plane(0), plane(1), plane(2)], tangent_variance: plane(3), squares: plane(4) }
    }
}
