//! What the normals around a photosite say of light that did not reach it. No colour in it, so that moire cannot enter.

use super::relief::{REACH, Relief};
use multiversion::multiversion;

/// Features of a photosite; their squares are used as well.
pub(super) const FEATURES: usize = 10;

/// Features of a row, each by itself.
pub(super) struct FeatureRow {
    pub(super) values: [Vec<f32>; FEATURES],
    /// One less the length of the mean normal under a tent of 7 x 7: 0 where the cloth is even.
    pub(super) rough: Vec<f32>,
    sums: [Vec<f32>; 6],
}

impl FeatureRow {
    pub(super) fn new(width: usize) -> Self {
        let row = || vec![0.0; width];
        let padded = || vec![0.0; width + 2 * REACH];
        Self {
            values: std::array::from_fn(|_| row()),
            rough: row(),
            sums: std::array::from_fn(|_| padded()),
        }
    }

    /// Features of row `k` of the band.
    pub(super) fn fill(&mut self, relief: &Relief, k: usize) {
        self.sum_columns(relief, k);
        fill_row(relief, k, self);
    }

    /// Tents of 3 and 7 rows over the three components.
    fn sum_columns(&mut self, relief: &Relief, k: usize) {
        for (c, component) in [&relief.n_u, &relief.n_v, &relief.n_z].into_iter().enumerate() {
            let row = |d: usize| &component[(k + d) * relief.stride..(k + d + 1) * relief.stride];
            let (three, seven) = self.sums.split_at_mut(3);
            sum_rows(std::array::from_fn(row), &mut three[c], &mut seven[c]);
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn sum_rows(rows: [&[f32]; 7], three: &mut [f32], seven: &mut [f32]) {
    let length = three.len();
    let rows = rows.map(|row| &row[..length]);
    let seven = &mut seven[..length];
    for x in 0..length {
        let [a, b, c, d, e, f, g] = rows.map(|row| row[x]);
        three[x] = (c + e + 2.0 * d) * 0.25;
        seven[x] = (a + g + 2.0 * (b + f) + 3.0 * (c + e) + 4.0 * d) * 0.0625;
    }
}

/// A row of a component, and the rows around it, from `REACH` columns before the first photosite on.
struct Rows<'a> {
    far_up: &'a [f32],
    up: &'a [f32],
    own: &'a [f32],
    down: &'a [f32],
    far_down: &'a [f32],
}

impl<'a> Rows<'a> {
    #[inline(always)]
    fn of(values: &'a [f32], stride: usize, k: usize) -> Self {
        let row = |d: usize| &values[(k + d) * stride..(k + d + 1) * stride];
        Self { far_up: row(1), up: row(2), own: row(3), down: row(4), far_down: row(5) }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn fill_row(relief: &Relief, k: usize, out: &mut FeatureRow) {
    let stride = relief.stride;
    let u = Rows::of(&relief.n_u, stride, k);
    let v = Rows::of(&relief.n_v, stride, k);
    let z = Rows::of(&relief.n_z, stride, k);
    let p = &relief.p[(k + REACH) * stride..(k + REACH + 1) * stride];
    let q = Rows::of(&relief.q, stride, k);
    let width = stride - 2 * REACH;
    let [lean, change, hill, dip, sharp_dip, sharp_hill, spread, rise, far_rise, far_up] =
        &mut out.values;
    for x in 0..width {
        // Borders are `REACH` wide, so that every neighbour is in the row.
        let at = x + REACH;
        let differ = |r: [f32; 3]| {
            let d = [r[0] - u.own[at], r[1] - v.own[at], r[2] - z.own[at]];
            d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
        };
        change[x] = differ([u.own[at - 1], v.own[at - 1], z.own[at - 1]])
            + differ([u.own[at + 1], v.own[at + 1], z.own[at + 1]])
            + differ([u.up[at], v.up[at], z.up[at]])
            + differ([u.down[at], v.down[at], z.down[at]]);
        lean[x] = 1.0 - z.own[at];
        let bend = [
            u.own[at + 1] - u.own[at],
            u.own[at] - u.own[at - 1],
            v.down[at] - v.own[at],
            v.own[at] - v.up[at],
        ];
        let convexity = 0.5 * (bend[0] + bend[1] + bend[2] + bend[3]);
        hill[x] = convexity.max(0.0);
        dip[x] = (-convexity).max(0.0);
        let squares = |d: [f32; 4]| d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + d[3] * d[3];
        sharp_dip[x] = squares(bend.map(|b| b.min(0.0)));
        sharp_hill[x] = squares(bend.map(|b| b.max(0.0)));
        rise[x] = 0.125 * (p[at + 1] - p[at - 1] + q.down[at] - q.up[at]);
        let far = [
            0.25 * (p[at] + 2.0 * p[at + 1] + p[at + 2]),
            -0.25 * (p[at] + 2.0 * p[at - 1] + p[at - 2]),
            0.25 * (q.own[at] + 2.0 * q.down[at] + q.far_down[at]),
            -0.25 * (q.own[at] + 2.0 * q.up[at] + q.far_up[at]),
        ];
        far_rise[x] = 0.25 * (far[0] + far[1] + far[2] + far[3]);
        let above = far.map(|rise| rise.max(0.0));
        far_up[x] = 0.25 * (above[0] + above[1] + above[2] + above[3]);
    }
    let [three_u, three_v, three_z, seven_u, seven_v, seven_z] = &out.sums;
    let tent3 = |s: &[f32], at: usize| 0.25 * (s[at - 1] + s[at + 1] + 2.0 * s[at]);
    let tent7 = |s: &[f32], at: usize| {
        0.0625
            * (s[at - 3]
                + s[at + 3]
                + 2.0 * (s[at - 2] + s[at + 2])
                + 3.0 * (s[at - 1] + s[at + 1])
                + 4.0 * s[at])
    };
    for (x, (spread, rough)) in spread.iter_mut().zip(&mut out.rough).take(width).enumerate() {
        let at = x + REACH;
        let length = |a: f32, b: f32, c: f32| (a * a + b * b + c * c).sqrt();
        *spread = 1.0 - length(tent3(three_u, at), tent3(three_v, at), tent3(three_z, at));
        *rough = 1.0 - length(tent7(seven_u, at), tent7(seven_v, at), tent7(seven_z, at));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use weavelight_calibration::description::Image;

    /// The features of a place away from the borders, by their definitions, in float64.
    fn reference(normal: &Image<[f32; 3]>, x: usize, y: usize) -> ([f64; FEATURES], f64) {
        let n = |u: isize, v: isize| {
            let [a, b, c] =
                normal.at(x.wrapping_add_signed(u), y.wrapping_add_signed(v)).map(f64::from);
            [a, -b, c]
        };
        let slope = |u, v, axis: usize| -(n(u, v)[axis] / n(u, v)[2].max(0.15)).clamp(-4.0, 4.0);
        let sides = [(1, 0), (-1, 0), (0, 1), (0, -1)];
        let own = n(0, 0);
        let mut f = [0.0; FEATURES];
        f[0] = 1.0 - own[2];
        let mut convexity = 0.0;
        for (u, v) in sides {
            let there = n(u, v);
            f[1] += (0..3).map(|c| (there[c] - own[c]).powi(2)).sum::<f64>();
            let axis = usize::from(u == 0);
            let bend = (there[axis] - own[axis]) * (u + v) as f64;
            convexity += 0.5 * bend;
            f[4] += bend.min(0.0).powi(2);
            f[5] += bend.max(0.0).powi(2);
            let rise = |k: isize| {
                let (near, far) = (k * u, (k + 1) * u);
                let (near_v, far_v) = (k * v, (k + 1) * v);
                0.5 * (slope(near, near_v, axis) + slope(far, far_v, axis)) * (u + v) as f64
            };
            f[7] += rise(0) / 4.0;
            f[8] += 0.5 * (rise(0) + rise(1)) / 4.0;
            f[9] += (0.5 * (rise(0) + rise(1))).max(0.0) / 4.0;
        }
        f[2] = convexity.max(0.0);
        f[3] = (-convexity).max(0.0);
        let spread = |reach: isize| {
            let mut sum = [0.0; 3];
            let mut total = 0.0;
            for v in -reach..=reach {
                for u in -reach..=reach {
                    let weight = ((reach + 1 - u.abs()) * (reach + 1 - v.abs())) as f64;
                    (0..3).for_each(|c| sum[c] += weight * n(u, v)[c]);
                    total += weight;
                }
            }
            1.0 - sum.iter().map(|c| (c / total).powi(2)).sum::<f64>().sqrt()
        };
        f[6] = spread(1);
        (f, spread(3))
    }

    #[test]
    fn features_are_those_of_their_definitions() {
        let mut state = 3u64;
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(9);
            (state >> 40) as f32 / 16_777_216.0 - 0.5
        };
        let data = (0..40 * 20)
            .map(|_| {
                let n = [2.4 * random(), 2.4 * random(), 1.0];
                let length = n.iter().map(|c| c * c).sum::<f32>().sqrt();
                n.map(|c| c / length)
            })
            .collect();
        let normal = Image { width: 40, height: 20, data };
        let mask = Image { width: 40, height: 20, data: vec![255; 800] };
        let relief = Relief::of_part(&normal, &mask, 0..40, 4..16);
        let mut row = FeatureRow::new(40);
        for k in 0..12 {
            row.fill(&relief, k);
            for x in 3..37 {
                let (expected, rough) = reference(&normal, x, k + 4);
                for (f, expected) in expected.iter().enumerate() {
                    let found = f64::from(row.values[f][x]);
                    assert!(
                        (found - expected).abs() < 1e-5,
                        "feature {f} at {x}, {k}: {found}, not {expected}"
                    );
                }
                assert!((f64::from(row.rough[x]) - rough).abs() < 1e-6, "{x} {k}");
            }
        }
    }
}
