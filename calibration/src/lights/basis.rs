//! Smooth functions over the frame: products of Legendre polynomials.

/// Values at (x, y) in [-1, 1] of all products P_a(x) P_b(y) with `least` <= a + b <= `most`, each scaled to unit mean
/// square over the square, ordered by degree.
pub(super) fn legendre_products([x, y]: [f64; 2], least: usize, most: usize) -> Vec<f64> {
    let (in_x, in_y) = (legendre(x, most), legendre(y, most));
    degrees(least, most).map(|(a, b)| in_x[a] * in_y[b]).collect()
}

/// The pairs (a, b) in the order of [`legendre_products`].
pub(super) fn degrees(least: usize, most: usize) -> impl Iterator<Item = (usize, usize)> {
    (least..=most).flat_map(|total| (0..=total).map(move |b| (total - b, b)))
}

/// P_0..P_most at x (Bonnet's recursion), scaled to unit mean square over [-1, 1].
fn legendre(x: f64, most: usize) -> Vec<f64> {
    let mut values = vec![1.0, x];
    for n in 1..most {
        let n_f = n as f64;
        values.push(((2.0 * n_f + 1.0) * x * values[n] - n_f * values[n - 1]) / (n_f + 1.0));
    }
    values.iter().enumerate().map(|(n, value)| value * (2.0 * n as f64 + 1.0).sqrt()).collect()
}

/// A place of a grid in [-1, 1] x [-1, 1].
pub(super) fn normalised(place: [usize; 2], grid: [usize; 2]) -> [f64; 2] {
    std::array::from_fn(|k| (place[k] as f64 + 0.5) / grid[k] as f64 * 2.0 - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_orthonormal_over_the_square() {
        let side = 200;
        let mut gram = [[0.0; 21]; 21];
        for k in 0..side * side {
            let values = legendre_products(normalised([k % side, k / side], [side, side]), 0, 5);
            for (i, a) in values.iter().enumerate() {
                for (j, b) in values.iter().enumerate() {
                    gram[i][j] += a * b / (side * side) as f64;
                }
            }
        }
        for (i, row) in gram.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                let expected = f64::from(u8::from(i == j));
                assert!((value - expected).abs() < 2e-3, "{i}, {j}: {value}");
            }
        }
    }
}
