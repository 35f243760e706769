//! A tile as the bytes that the shader reads.

use super::tile::{FOUND_PLANES, Tile, TileRow};
use crate::photometry::{MAX_LIGHTS, VarianceModel, chi_square_limit};
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

/// As in `solve.wgsl`.
const COEFFICIENTS_OF_INVERSE: usize = 12;
const COEFFICIENTS_OF_LIGHT: usize = 6;
const PLACES: usize = 4;
const NOISE_ENTRIES: usize = PLACES * MAX_LIGHTS;
/// In place of infinity, which a shader may not know.
const HUGE: f32 = 3e38;
/// No binding may be empty, or less than an entry.
const SMALLEST: usize = size_of::<Piece>();
/// Where a binding may begin.
const ALIGNMENT: usize = 256;

/// `Settings` of the shader.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Settings {
    lights: u32,
    planes: u32,
    pieces: u32,
    limit: f32,
}

/// `Piece` of the shader.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Piece {
    before: u32,
    width: u32,
    start: u32,
    end: u32,
    row_parity: u32,
}

/// Everything of a tile but its samples.
pub(super) struct Packed {
    settings: Settings,
    noise: Vec<[f32; 4]>,
    pieces: Vec<Piece>,
    coefficients: Vec<f32>,
    /// Photosites before each row, and in all.
    pub(super) before: Vec<usize>,
}

/// Where the bindings stand in the one buffer that goes up, by their number; each begins at an [`ALIGNMENT`].
pub(super) type Regions = [Range<usize>; 5];

impl Packed {
    pub(super) fn new(tile: &Tile) -> Self {
        let mut before = vec![0];
        let (mut pieces, mut coefficients) = (vec![], vec![]);
        for row in &tile.rows {
            let first = before.last().copied().unwrap_or(0);
            pack_pieces(row, first, &mut pieces, &mut coefficients);
            before.push(first + row.width());
        }
        let scaled = tile.rows.iter().any(|row| row.noise_scale.is_some());
        let limit = chi_square_limit(tile.lights.saturating_sub(3)) as f32;
        let settings = Settings {
            lights: tile.lights as u32,
            planes: (tile.lights + usize::from(scaled)) as u32,
            pieces: pieces.len() as u32,
            limit: limit.min(HUGE),
        };
        Self { settings, noise: noise_of(tile), pieces, coefficients, before }
    }

    /// Coefficients of a row, at most: a piece has at least one column.
    pub(super) fn most_coefficients(width: usize, lights: usize) -> usize {
        width * (COEFFICIENTS_OF_INVERSE + lights * COEFFICIENTS_OF_LIGHT)
    }

    /// Pieces: one workgroup each.
    pub(super) fn workgroups(&self) -> usize {
        self.pieces.len()
    }

    /// Photosites.
    fn sites(&self) -> usize {
        self.before.last().copied().unwrap_or(0)
    }

    /// Bytes that come back.
    pub(super) fn found_bytes(&self) -> usize {
        self.sites() * FOUND_PLANES * size_of::<f32>()
    }

    /// Bytes that go up.
    pub(super) fn up_bytes(&self) -> usize {
        self.regions().map(|region| region.end).into_iter().fold(0, usize::max)
    }

    /// Bytes of the largest binding.
    pub(super) fn largest_binding(&self) -> usize {
        self.regions().map(|region| region.len()).into_iter().fold(self.found_bytes(), usize::max)
    }

    /// Where the bindings stand.
    pub(super) fn regions(&self) -> Regions {
        let mut end = 0;
        let samples = self.sites() * self.settings.planes as usize * size_of::<f32>();
        [
            size_of::<Settings>(),
            size_of_val(self.noise.as_slice()),
            samples,
            size_of_val(self.pieces.as_slice()),
            size_of_val(self.coefficients.as_slice()),
        ]
        .map(|bytes| {
            let start = end;
            let bytes = bytes.max(SMALLEST);
            end = (start + bytes).next_multiple_of(ALIGNMENT);
            start..start + bytes
        })
    }

    /// Writes everything by `write(offset, bytes)`, samples straight from the rows.
    pub(super) fn write(&self, tile: &Tile, mut write: impl FnMut(usize, &[u8])) {
        let [settings, noise, samples, pieces, coefficients] = self.regions();
        write(settings.start, bytemuck::bytes_of(&self.settings));
        write(noise.start, bytemuck::cast_slice(&self.noise));
        write(pieces.start, bytemuck::cast_slice(&self.pieces));
        write(coefficients.start, bytemuck::cast_slice(&self.coefficients));
        let mut at = samples.start;
        let mut next = |plane: &[f32]| {
            write(at, bytemuck::cast_slice(plane));
            at += size_of_val(plane);
        };
        let scaled = self.settings.planes > self.settings.lights;
        let mut scale = vec![];
        for row in &tile.rows {
            row.signal.iter().for_each(|plane| next(plane));
            if scaled {
                clean_scale(row, &mut scale);
                next(&scale);
            }
        }
    }
}

fn pack_pieces(row: &TileRow, before: usize, pieces: &mut Vec<Piece>, coefficients: &mut Vec<f32>) {
    for piece in row.cut.pieces() {
        pieces.push(Piece {
            before: before as u32,
            width: row.width() as u32,
            start: piece.columns.start as u32,
            end: piece.columns.end as u32,
            row_parity: (row.parity & 1) as u32,
        });
        coefficients.extend(piece.inverse.as_flattened());
        piece.lights().for_each(|light| coefficients.extend(light.as_flattened()));
    }
}

/// Per light the models of the 2 x 2 cell, padded to what the shader declares.
fn noise_of(tile: &Tile) -> Vec<[f32; 4]> {
    let model = |VarianceModel { shot, floor, kappa }: VarianceModel| [shot, floor, kappa, 0.0];
    let mut noise = vec![[0.0; 4]; NOISE_ENTRIES];
    for (light, cell) in noise.chunks_exact_mut(PLACES).enumerate().take(tile.lights) {
        for (place, entry) in cell.iter_mut().enumerate() {
            let of_light = tile.variance[place / 2].get(light);
            *entry = model(of_light.map_or_else(Default::default, |of| of[place % 2].clean()));
        }
    }
    noise
}

/// A scale that is not positive and finite counts as 1.
fn clean_scale(row: &TileRow, scale: &mut Vec<f32>) {
    scale.clear();
    match row.noise_scale {
        Some(given) => scale.extend(
            given.iter().map(
                |&scale| {
                    if scale > 0.0 && scale < f32::INFINITY { scale } else { 1.0 }
                },
            ),
        ),
        None => scale.resize(row.width(), 1.0),
    }
}
