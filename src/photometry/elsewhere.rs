//! Neighbours with all their samples may be solved elsewhere, on a graphics processor: what that must know of a row, and what
//! comes back. Everything else of the row is solved here, so that no answer depends on who solved the neighbours.

use std::ops::Range;

use super::block::LANES;
use super::pieces::{Linear, Pieces};
use super::row::{FieldRow, RowError};
use super::surface::Surface;

/// A row cut into pieces on which the light vectors are linear, as [`RowSolver::solve`](super::RowSolver::solve) cuts it.
#[derive(Default)]
pub struct CutRow(pub(crate) Pieces);

/// A piece of a row, in the units of its row.
pub struct CutPiece<'a> {
    /// Columns of the row.
    pub columns: Range<usize>,
    /// N = (L^T L)^-1 (xx, xy, xz, yy, yz, zz): at the first column, and its growth per column.
    pub inverse: [[f32; 6]; 2],
    lights: &'a [Linear],
}

impl CutRow {
    /// Cuts a row of `width` columns.
    pub fn cut(&mut self, field: &FieldRow, width: usize) {
        self.0.cut(field, width);
    }

    pub(crate) fn check_shape(&self, lights: usize, width: usize) -> Result<(), RowError> {
        let same = |part, found, expected| {
            if found == expected { Ok(()) } else { Err(RowError::Length { part, found, expected }) }
        };
        let pieces = &self.0.list;
        same("cut", pieces.last().map_or(0, |piece| piece.end), width)?;
        same("cut's list of light vectors", self.0.light.len(), pieces.len() * lights)
    }

    /// The pieces that float32 carries, left to right.
    pub fn pieces(&self) -> impl Iterator<Item = CutPiece<'_>> {
        let lights = self.0.light.len() / self.0.list.len().max(1);
        self.0.list.iter().filter(|piece| piece.float32).map(move |piece| CutPiece {
            columns: piece.start..piece.end,
            inverse: [piece.inverse.at_start, piece.inverse.per_column],
            lights: &self.0.light[piece.first..][..lights],
        })
    }
}

impl CutPiece<'_> {
    /// Per light: its vector at the first column, and the vector's growth per column.
    pub fn lights(&self) -> impl Iterator<Item = [[f32; 3]; 2]> {
        self.lights.iter().map(|light| [light.at_start, light.per_column])
    }
}

/// What was found elsewhere of a row; one value a photosite in each slice, those of pieces that float32 does not carry unread.
pub struct Found<'a> {
    /// Albedo times normal, x, y and z, in the units of the cut; all zero where the photosite asks for a slower way.
    pub g: [&'a [f32]; 3],
    /// Trace of the covariance of g across the normal.
    pub tangent_variance: &'a [f32],
    /// Sum of squared residuals. Negative where rounding might decide which way the photosite goes: it is solved here then.
    pub squares: &'a [f32],
}

impl Found<'_> {
    pub(crate) fn check_lengths(&self, expected: usize) -> Result<(), RowError> {
        let parts = self.g.into_iter().chain([self.tangent_variance, self.squares]);
        match parts.map(<[f32]>::len).find(|&found| found != expected) {
            Some(found) => Err(RowError::Length { part: "finding", found, expected }),
            None => Ok(()),
        }
    }

    /// Whether every photosite of these columns was decided.
    pub(crate) fn is_decided(&self, columns: &Range<usize>) -> bool {
        self.squares[columns.clone()].iter().fold(true, |all, squares| all & (*squares >= 0.0))
    }

    /// Takes the columns of a block over.
    pub(crate) fn load(&self, columns: &Range<usize>, lights: usize, surface: &mut Surface) {
        let take = |to: &mut [f32; LANES], from: &[f32]| {
            to[..columns.len()].copy_from_slice(&from[columns.clone()]);
        };
        for (to, from) in surface.g.iter_mut().zip(self.g) {
            take(to, from);
        }
        take(&mut surface.tangent_variance, self.tangent_variance);
        take(&mut surface.squares, self.squares);
        surface.count = [lights as f32; LANES];
        surface.carried = [true; LANES];
    }
}
