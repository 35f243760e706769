//! The published way: a singular value decomposition for every photosite, four times over (one solve for each colour and
//! one for their grey).
//!
//! Neubelt and Pettineo, "Crafting a Next-Gen Material Pipeline for The Order: 1886", 2013, section 3, eq. 26-30. A
//! photosite of the mosaic has one colour, so its samples are solved four times: the cost of the published solve, and the
//! error of one that need not demosaic first.

use super::photosite::Photosite;
use nalgebra::{DMatrix, DVector, Vector3};
use std::hint::black_box;

/// Solves that the publication makes for a pixel.
const SOLVES: usize = 4;
/// Singular values below this share of one count as zero.
const LEAST_SINGULAR: f64 = 1e-12;

/// Least squares by singular values, four times.
pub(super) fn four_solves(photosite: &Photosite) -> Option<Vector3<f64>> {
    // The compiler must not see that all four are the same.
    let mut g = None;
    for _ in 0..SOLVES {
        g = black_box(solve(black_box(photosite)));
    }
    g
}

fn solve(photosite: &Photosite) -> Option<Vector3<f64>> {
    let lights = DMatrix::from_fn(photosite.lights.len(), 3, |i, axis| photosite.lights[i][axis]);
    let y = DVector::from_column_slice(&photosite.y);
    let g = lights.svd(true, true).solve(&y, LEAST_SINGULAR).ok()?;
    Some(Vector3::new(g[0], g[1], g[2]))
}
