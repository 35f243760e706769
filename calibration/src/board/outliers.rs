//! Corners that do not lie where the others say.

use super::BoardShape;
use nalgebra::{Cholesky, DMatrix, DVector};

/// A corner is out of line from this many robust sigmas on ...
const SIGMAS: f64 = 7.0;
/// ... if that is also this far, in pixels.
const LEAST_PX: f64 = 0.4;
/// Fewest corners of which one can be told from the rest.
const LEAST_CORNERS: usize = 20;

/// Numbers of the corners that lie out of line, ascending; at most every fourth.
///
/// The board's plane is mapped to the picture by a homography, and what the lens and a slightly bent board add by a smooth
/// surface (quartic, with fewer corners cubic or quadratic). The worst corner goes first, and a corner that is out is not used
/// again. `scale`: pixels of the picture per pixel that was searched.
///
/// `corners_px`: in the order of [`BoardShape::corners_mm`].
pub fn outlying_corners(shape: &BoardShape, corners_px: &[[f64; 2]], scale: f64) -> Vec<usize> {
    let count = corners_px.len();
    if count < LEAST_CORNERS || count != shape.columns * shape.rows {
        return Vec::new();
    }
    let mut out: Vec<usize> = Vec::new();
    while out.len() <= count / 4 {
        let Some(off) = off_px(shape, corners_px, &out) else { break };
        let mut inside: Vec<f64> =
            (0..count).filter(|k| !out.contains(k)).map(|k| off[k]).collect();
        inside.sort_unstable_by(f64::total_cmp);
        // The median distance of a Gaussian in two dimensions is 1.18 sigma.
        let sigma = inside[inside.len() / 2] / 1.18;
        let worst =
            (0..count).filter(|k| !out.contains(k)).max_by(|a, b| off[*a].total_cmp(&off[*b]));
        match worst.filter(|k| off[*k] > (SIGMAS * sigma).max(LEAST_PX * scale)) {
            Some(k) => out.push(k),
            None => break,
        }
    }
    out.sort_unstable();
    out
}

/// How far every corner is from where the others (but those `left_out`) put it, pixels, studentised.
fn off_px(shape: &BoardShape, corners_px: &[[f64; 2]], left_out: &[usize]) -> Option<Vec<f64>> {
    let flat = |k: usize| {
        let at = |k: usize, n: usize| 2.0 * k as f64 / (n - 1) as f64 - 1.0;
        [at(k % shape.columns, shape.columns), at(k / shape.columns, shape.rows)]
    };
    let used: Vec<usize> = (0..corners_px.len()).filter(|k| !left_out.contains(k)).collect();
    let (middle, half) = extent(corners_px);
    let unit: Vec<[f64; 2]> =
        corners_px.iter().map(|[u, v]| [(u - middle[0]) / half, (v - middle[1]) / half]).collect();
    let map = homography(&used, &flat, &unit)?;
    let degree = match used.len() {
        48.. => 4,
        30.. => 3,
        _ => 2,
    };
    let basis = |k: usize| {
        let [x, y] = flat(k);
        let of_degree = |n: i32| (0..=n).map(move |j| x.powi(n - j) * y.powi(j));
        DVector::from_vec((0..=degree).flat_map(of_degree).collect())
    };
    let rows: Vec<DVector<f64>> = (0..unit.len()).map(basis).collect();
    let n = rows[0].len();
    let mut normal = DMatrix::<f64>::identity(n, n) * 1e-9;
    used.iter().for_each(|k| normal.syger(1.0, &rows[*k], &rows[*k], 1.0));
    let factor = Cholesky::new(normal)?;
    let mut square = vec![0.0; unit.len()];
    for axis in 0..2 {
        let of_axis = |point: [f64; 2]| point[axis];
        let left = |k: usize| of_axis(unit[k]) - of_axis(mapped(&map, flat(k)));
        let right = used.iter().fold(DVector::zeros(n), |sum, k| sum + rows[*k].clone() * left(*k));
        let surface = factor.solve(&right);
        for (k, square) in square.iter_mut().enumerate() {
            let leverage =
                if left_out.contains(&k) { 0.0 } else { rows[k].dot(&factor.solve(&rows[k])) };
            // Studentised: a corner of the board draws the surface towards itself.
            let off = (left(k) - rows[k].dot(&surface)) / (1.0 - leverage).max(0.05).sqrt();
            *square += off * off;
        }
    }
    Some(square.into_iter().map(|s: f64| s.sqrt() * half).collect())
}

fn extent(corners: &[[f64; 2]]) -> ([f64; 2], f64) {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for corner in corners {
        low = std::array::from_fn(|k| low[k].min(corner[k]));
        high = std::array::from_fn(|k| high[k].max(corner[k]));
    }
    let half = 0.5 * (high[0] - low[0]).max(high[1] - low[1]);
    (std::array::from_fn(|k| 0.5 * (low[k] + high[k])), half.max(f64::MIN_POSITIVE))
}

/// Eight numbers of the homography from the board to the picture, the ninth being 1 (linear least squares on the
/// algebraic distance, both sides in units of about 1).
fn homography(
    used: &[usize],
    flat: &dyn Fn(usize) -> [f64; 2],
    unit: &[[f64; 2]],
) -> Option<[f64; 8]> {
    let (mut normal, mut right) = (DMatrix::<f64>::zeros(8, 8), DVector::<f64>::zeros(8));
    for k in used {
        let ([x, y], [u, v]) = (flat(*k), unit[*k]);
        for (row, value) in [
            ([x, y, 1.0, 0.0, 0.0, 0.0, -u * x, -u * y], u),
            ([0.0, 0.0, 0.0, x, y, 1.0, -v * x, -v * y], v),
        ] {
            let row = DVector::from_column_slice(&row);
            normal.syger(1.0, &row, &row, 1.0);
            right.axpy(value, &row, 1.0);
        }
    }
    let solution = Cholesky::new(normal)?.solve(&right);
    Some(std::array::from_fn(|k| solution[k]))
}

fn mapped(h: &[f64; 8], [x, y]: [f64; 2]) -> [f64; 2] {
    let w = h[6] * x + h[7] * y + 1.0;
    [(h[0] * x + h[1] * y + h[2]) / w, (h[3] * x + h[4] * y + h[5]) / w]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: BoardShape = BoardShape { columns: 9, rows: 6, square_mm: 20.0 };

    /// A tilted board through a barrel lens, with noise of about 0.05 px.
    fn seen() -> Vec<[f64; 2]> {
        let mut seed = 7u64;
        let mut noise = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((seed >> 40) as f64 / (1u64 << 24) as f64 - 0.5) * 0.17
        };
        let see = |p: &nalgebra::Point3<f64>| {
            let z = 400.0 + 0.5 * p.x - 0.3 * p.y;
            let (x, y) = (p.x / z, -p.y / z);
            let radial = 1.0 - 0.25 * (x * x + y * y);
            [1500.0 + 3000.0 * x * radial + noise(), 1000.0 + 3000.0 * y * radial + noise()]
        };
        SHAPE.corners_mm().iter().map(see).collect()
    }

    #[test]
    fn a_lens_and_a_tilt_put_no_corner_out_of_line() {
        assert_eq!(outlying_corners(&SHAPE, &seen(), 1.0), []);
    }

    #[test]
    fn corners_beside_glare_are_told_wherever_they_are() {
        for moved in [&[0][..], &[8], &[22], &[53], &[0, 1], &[13, 40]] {
            let mut corners = seen();
            for k in moved {
                corners[*k][0] += 1.8;
                corners[*k][1] -= 0.9;
            }
            assert_eq!(outlying_corners(&SHAPE, &corners, 1.0), moved, "{moved:?}");
        }
    }
}
