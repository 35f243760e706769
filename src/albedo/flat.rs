//! Where cloth has no structure: there any demosaicer is right, and the best of them serves.

use super::grid::Grid;
use super::numeric::{quantile, smoothstep};
use rayon::prelude::*;
use std::ops::Range;
use weavelight_calibration::description::{Cfa, Image};

const CELL: usize = 32;
const BLOCK: usize = 16;
/// Spread of logs within a block: flat below, structured above.
const STRUCTURE: [f32; 2] = [0.02, 0.04];

/// Share of the method for structured cloth, window by window.
pub(super) struct Structure {
    grid: Grid,
    shares: Vec<f32>,
}

impl Structure {
    pub(super) fn of(logs: &Image<f32>, cfa: Cfa) -> Self {
        let grid = Grid::new([logs.width, logs.height], CELL);
        let cells: Vec<Vec<f32>> = (0..grid.x.cells() * grid.y.cells())
            .into_par_iter()
            .map(|k| {
                let columns = grid.x.cell(k % grid.x.cells());
                deviations(logs, cfa, &columns, &grid.y.cell(k / grid.x.cells()))
            })
            .collect();
        let share = |node: usize| {
            let [column, row] = grid.place_of(node);
            let mut all: Vec<f32> = Vec::new();
            for y in grid.y.cells_of(row) {
                for x in grid.x.cells_of(column) {
                    all.extend(&cells[y * grid.x.cells() + x]);
                }
            }
            let spread = 1.48 * quantile(&mut all, 0.5).unwrap_or(0.0);
            smoothstep(spread, STRUCTURE[0], STRUCTURE[1])
        };
        let shares = (0..grid.nodes()).into_par_iter().map(share).collect();
        Self { grid, shares }
    }

    pub(super) fn at(&self, place: [usize; 2]) -> f32 {
        self.grid.blend(&self.shares, place)
    }

    /// Whether the whole part is structured.
    pub(super) fn fills(&self, columns: &Range<usize>, rows: &Range<usize>) -> bool {
        self.grid.y.windows_around(rows).all(|row| {
            self.grid
                .x
                .windows_around(columns)
                .all(|column| self.shares[row * self.grid.x.nodes() + column] >= 1.0)
        })
    }
}

/// How far photosites are from the mean of their channel in their block; every fourth pair of rows.
fn deviations(
    logs: &Image<f32>,
    cfa: Cfa,
    columns: &Range<usize>,
    rows: &Range<usize>,
) -> Vec<f32> {
    let mut found = Vec::with_capacity(columns.len() * rows.len() / 4);
    for top in rows.clone().step_by(BLOCK) {
        for left in columns.clone().step_by(BLOCK) {
            let (right, bottom) = ((left + BLOCK).min(columns.end), (top + BLOCK).min(rows.end));
            let part = |y: usize| &logs.data[y * logs.width + left..y * logs.width + right];
            let channel = |k: usize, y: usize| cfa.channel(left + k, y) as usize;
            let (mut sum, mut count) = ([0.0f32; 3], [0.0f32; 3]);
            for y in top..bottom {
                for (k, value) in part(y).iter().enumerate().filter(|(_, v)| !v.is_nan()) {
                    sum[channel(k, y)] += value;
                    count[channel(k, y)] += 1.0;
                }
            }
            let mean = [0, 1, 2].map(|c| sum[c] / count[c].max(1.0));
            for y in (top..bottom).filter(|y| (y - top) % 8 < 2) {
                let known = part(y).iter().enumerate().filter(|(_, v)| !v.is_nan());
                found.extend(known.map(|(k, value)| (value - mean[channel(k, y)]).abs()));
            }
        }
    }
    found
}
