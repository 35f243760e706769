//! What the surface is like in blocks of pixels: mean normal and albedo, and how rough it is within.

use crate::photometry::{Albedo, Maps, is_solved};
use nalgebra::Vector3;
use rayon::prelude::*;
use weavelight_calibration::description::Image;

/// Albedos below this count as this: octaves of nothing would be endless.
const LEAST_ALBEDO: f64 = 1e-3;

/// One block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Block {
    /// Direction of the mean normal, rig frame; zero where most of the block is unsolved.
    pub(crate) normal: [f64; 3],
    /// Binary logarithm of the mean albedo, R, G, B.
    pub(crate) octaves: [f64; 3],
    /// RMS angle between the pixels' normals and the mean, less what their noise makes of it, degrees.
    pub(crate) roughness_deg: f64,
}

impl Block {
    /// Where most pixels have no normal.
    pub(crate) const UNSOLVED: Self =
        Self { normal: [0.0; 3], octaves: [0.0; 3], roughness_deg: 0.0 };

    pub(crate) fn is_solved(&self) -> bool {
        self.normal != [0.0; 3]
    }

    /// Angle between the mean normals of two blocks.
    pub(crate) fn lean_from_deg(&self, other: &Self) -> f64 {
        let (a, b) = (Vector3::from(self.normal), Vector3::from(other.normal));
        a.cross(&b).norm().atan2(a.dot(&b)).to_degrees()
    }

    /// The largest difference of albedo over the channels, octaves.
    pub(crate) fn octaves_from(&self, other: &Self) -> f64 {
        let apart = self.octaves.iter().zip(other.octaves).map(|(a, b)| (a - b).abs());
        apart.fold(0.0, f64::max)
    }
}

/// Blocks of `side` pixels; the last of a row or column may be smaller.
pub(crate) fn block_grid(maps: &Maps, side: usize) -> Image<Block> {
    let (width, height) = (maps.outcome.width.div_ceil(side), maps.outcome.height.div_ceil(side));
    let blocks = (0..width * height).into_par_iter();
    let data = blocks.map(|at| block(maps, side, at % width, at / width)).collect();
    Image { width, height, data }
}

fn block(maps: &Maps, side: usize, column: usize, row: usize) -> Block {
    let (width, height) = (maps.outcome.width, maps.outcome.height);
    let columns = column * side..((column + 1) * side).min(width);
    let rows = row * side..((row + 1) * side).min(height);
    let all = columns.len() * rows.len();
    let places = rows.flat_map(|y| columns.clone().map(move |x| y * width + x));
    let places: Vec<usize> = places.filter(|&at| is_solved(maps.outcome.data[at])).collect();
    if 2 * places.len() <= all {
        return Block::UNSOLVED;
    }
    let normal = |at: usize| Vector3::from(maps.normal.data[at]).cast::<f64>();
    let mean = places.iter().map(|&at| normal(at)).sum::<Vector3<f64>>().normalize();
    let count = places.len() as f64;
    let scatter = |at: usize| normal(at).cross(&mean).norm_squared();
    let noise = |at: usize| f64::from(maps.expected_error_deg.data[at]).to_radians().powi(2);
    let sum = |of: &dyn Fn(usize) -> f64| places.iter().map(|&at| of(at)).sum::<f64>() / count;
    // The mean takes its share of the noise with it.
    let left = 1.0 - 1.0 / count;
    let albedo = [0, 1, 2].map(|channel| sum(&|at| albedo(&maps.albedo, at, channel)));
    Block {
        normal: mean.into(),
        octaves: albedo.map(|albedo| albedo.max(LEAST_ALBEDO).log2()),
        roughness_deg: (sum(&scatter) - left * sum(&noise))
            .clamp(0.0, 1.0)
            .sqrt()
            .asin()
            .to_degrees(),
    }
}

fn albedo(albedo: &Albedo, at: usize, channel: usize) -> f64 {
    f64::from(match albedo {
        Albedo::Mosaic(image, _) | Albedo::Grey(image) => image.data[at],
        Albedo::Rgb(image) => image.data[at][channel],
    })
}
