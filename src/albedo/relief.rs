//! Normals of a band of rows, each component by itself, with a border, and without holes.

use std::ops::Range;
use weavelight_calibration::description::Image;

/// Rows and columns around a photosite that its features look at.
pub(super) const REACH: usize = 3;
/// Steepest slope that counts: beyond it noise of the normal makes any slope.
const STEEPEST: f32 = 4.0;
const LEAST_NZ: f32 = 0.15;

/// Normals of a part of the picture, padded by `REACH` on every side.
pub(super) struct Relief {
    /// Values in a row, borders included.
    pub(super) stride: usize,
    /// Towards the right of the picture.
    pub(super) n_u: Vec<f32>,
    /// Towards the bottom of the picture.
    pub(super) n_v: Vec<f32>,
    pub(super) n_z: Vec<f32>,
    /// Rise of the surface to the right, a photosite.
    pub(super) p: Vec<f32>,
    /// Rise towards the bottom.
    pub(super) q: Vec<f32>,
}

impl Relief {
    /// Of some columns and rows; where nothing is solved, the mean of the solved neighbours stands in, else upright.
    pub(super) fn of_part(
        normal: &Image<[f32; 3]>,
        mask: &Image<u8>,
        columns: Range<usize>,
        rows: Range<usize>,
    ) -> Self {
        let stride = columns.len() + 2 * REACH;
        let lines = rows.len() + 2 * REACH;
        let size = stride * lines;
        let mut all = Self {
            stride,
            n_u: vec![0.0; size],
            n_v: vec![0.0; size],
            n_z: vec![0.0; size],
            p: vec![0.0; size],
            q: vec![0.0; size],
        };
        for k in 0..lines {
            let y = (rows.start + k).saturating_sub(REACH).min(normal.height - 1);
            all.load_row(k, normal, mask, columns.clone(), y);
        }
        all
    }

    fn load_row(
        &mut self,
        k: usize,
        normal: &Image<[f32; 3]>,
        mask: &Image<u8>,
        columns: Range<usize>,
        y: usize,
    ) {
        let row = k * self.stride;
        let width = normal.width;
        // Columns beyond the picture repeat its first and last.
        let (start, end) = (columns.start.saturating_sub(REACH), (columns.end + REACH).min(width));
        let left = start + REACH - columns.start;
        let solved = &mask.data[y * width..(y + 1) * width];
        for (x, solved) in solved.iter().enumerate().take(end).skip(start) {
            let n = if *solved != 0 { *normal.at(x, y) } else { stand_in(normal, mask, [x, y]) };
            let at = row + left + x - start;
            (self.n_u[at], self.n_v[at], self.n_z[at]) = (n[0], -n[1], n[2]);
        }
        let filled = row + left..row + left + end - start;
        for values in [&mut self.n_u, &mut self.n_v, &mut self.n_z] {
            let (first, last) = (values[filled.start], values[filled.end - 1]);
            values[row..filled.start].fill(first);
            values[filled.end..row + self.stride].fill(last);
        }
        let columns = row..row + self.stride;
        let (n_u, n_v) = (&self.n_u[columns.clone()], &self.n_v[columns.clone()]);
        let n_z = &self.n_z[columns.clone()];
        let slopes = self.p[columns.clone()].iter_mut().zip(&mut self.q[columns]);
        for (((p, q), (u, v)), z) in slopes.zip(n_u.iter().zip(n_v)).zip(n_z) {
            let upright = z.max(LEAST_NZ);
            *p = (-u / upright).clamp(-STEEPEST, STEEPEST);
            *q = (-v / upright).clamp(-STEEPEST, STEEPEST);
        }
    }
}

fn stand_in(normal: &Image<[f32; 3]>, mask: &Image<u8>, [x, y]: [usize; 2]) -> [f32; 3] {
    let mut sum = [0.0f32; 3];
    for v in y.saturating_sub(1)..(y + 2).min(normal.height) {
        for u in x.saturating_sub(1)..(x + 2).min(normal.width) {
            if mask.data[v * normal.width + u] != 0 {
                sum.iter_mut().zip(normal.at(u, v)).for_each(|(sum, n)| *sum += n);
            }
        }
    }
    let length = sum.iter().map(|c| c * c).sum::<f32>().sqrt();
    if length > 1e-3 { sum.map(|c| c / length) } else { [0.0, 0.0, 1.0] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_take_the_mean_of_their_neighbours_and_borders_the_last_value() {
        let tilted = [0.6, 0.0, 0.8];
        let normal = Image { width: 5, height: 3, data: vec![tilted; 15] };
        let mut mask = Image { width: 5, height: 3, data: vec![255; 15] };
        mask.data[7] = 0;
        let relief = Relief::of_part(&normal, &mask, 0..5, 0..3);
        assert_eq!(relief.n_u.len(), 11 * 9);
        assert!(relief.n_u.iter().all(|u| (u - 0.6).abs() < 1e-6));
        assert!(relief.p.iter().all(|p| (p + 0.75).abs() < 1e-6));
        mask.data.fill(0);
        let relief = Relief::of_part(&normal, &mask, 0..5, 0..3);
        assert!(relief.n_z.iter().all(|z| *z == 1.0));
    }
}
