//! Blur of lens and low-pass filter: in linear light, over the samples of the surface, before the photosites and their
//! filters see it. Photosites keep no more of a fine weave than optics bring them.

use super::bounce::gather;
use super::fabric::{Beam, Hit, TileScene, sky_over};
use super::{Bounce, Signals, Tile};
use crate::reflectance::dot;

/// Beyond this many standard deviations lies less than half a percent of the light.
const REACH: f64 = 2.8;
/// Parts of a photosite's side over which the Gaussian is averaged.
const PARTS: usize = 16;

/// Weights of the samples of a photosite and of those around it, along one axis: a Gaussian over a square aperture. The
/// two-dimensional weight is the product of two.
#[derive(Clone, Debug)]
pub(crate) struct Kernel {
    margin: usize,
    weights: Vec<f32>,
}

impl Kernel {
    /// Of a standard deviation in photosites, for samples that lie `per_side` to a photosite's side.
    pub(crate) fn new(sigma_px: f64, per_side: usize) -> Self {
        let margin = if sigma_px > 0.0 { (REACH * sigma_px).ceil() as usize } else { 0 };
        let count = (2 * margin + 1) * per_side;
        let weight = |k: usize| {
            let place = (k as f64 + 0.5) / per_side as f64 - (margin as f64 + 0.5);
            let part = |j: usize| (j as f64 + 0.5) / PARTS as f64 - 0.5;
            let gauss = |off: f64| (-0.5 * (off / sigma_px).powi(2)).exp();
            (0..PARTS).map(|j| gauss(place - part(j))).sum::<f64>()
        };
        let weights = match margin {
            0 => vec![1.0; count],
            _ => (0..count).map(weight).collect(),
        };
        let total: f64 = weights.iter().sum();
        Self { margin, weights: weights.iter().map(|w| (w / total) as f32).collect() }
    }

    /// Photosites around one that lend it light.
    pub(crate) fn margin(&self) -> usize {
        self.margin
    }

    /// From the first sample of the photosite that lies [`margin`](Self::margin) before on.
    pub(crate) fn weights(&self) -> &[f32] {
        &self.weights
    }
}

/// Planes of the truth: normal, albedo, height.
const TRUTH: usize = 7;

/// Rows of samples, each plane by itself: three channels of every light and of the ambient light, then the truth.
struct Planes {
    lights: usize,
    count: usize,
    width: usize,
    values: Vec<f32>,
}

impl Planes {
    fn new(lights: usize, with_truth: bool, width: usize, rows: usize) -> Self {
        let count = 3 * (lights + 1) + if with_truth { TRUTH } else { 0 };
        Self { lights, count, width, values: vec![0.0; count * width * rows] }
    }

    fn plane(&self, row: usize, plane: usize) -> &[f32] {
        let start = (row * self.count + plane) * self.width;
        &self.values[start..start + self.width]
    }

    fn plane_mut(&mut self, row: usize, plane: usize) -> &mut [f32] {
        let start = (row * self.count + plane) * self.width;
        &mut self.values[start..start + self.width]
    }

    fn truth(&self, k: usize) -> usize {
        3 * (self.lights + 1) + k
    }

    fn row_mut(&mut self, row: usize) -> &mut [f32] {
        let size = self.count * self.width;
        &mut self.values[row * size..(row + 1) * size]
    }

    fn row(&self, row: usize) -> &[f32] {
        let size = self.count * self.width;
        &self.values[row * size..(row + 1) * size]
    }
}

/// Exposes a tile row by row of photosites: each row's samples are spread downwards over the rows that see them, and a row
/// that has received all is spread sideways.
pub(super) fn expose_blurred(
    scene: &TileScene,
    kernel: &Kernel,
    tile: Tile,
    signals: &mut Signals,
) {
    let (margin, per_side) = (kernel.margin, scene.samples);
    let width = (tile.width + 2 * margin) * per_side;
    let lights = scene.stage.lights.len();
    let planes = |rows: usize| Planes::new(lights, signals.truth.is_some(), width, rows);
    let (mut samples, mut sums) = (planes(per_side), planes(2 * margin + 1));
    let ring = 2 * margin + 1;
    for row in 0..tile.height + 2 * margin {
        samples.values.fill(0.0);
        sample_row(scene, tile, margin, row, &mut samples, signals);
        // The first sight of an output row finds its sums used by one that is done.
        if row < tile.height {
            sums.row_mut(row % ring).fill(0.0);
        }
        for to in row.saturating_sub(2 * margin)..(row + 1).min(tile.height) {
            for k in 0..per_side {
                let weight = kernel.weights[(row - to) * per_side + k];
                let out = sums.row_mut(to % ring).iter_mut();
                out.zip(samples.row(k)).for_each(|(out, value)| *out += weight * value);
            }
        }
        if row >= 2 * margin {
            let done = row - 2 * margin;
            finish_row(scene, kernel, tile, done, (&sums, done % ring), signals);
        }
    }
}

/// Samples a row of photosites, margins included. The light that arrives at those of the tile goes into `signals`, to be
/// multiplied with what is reflected.
fn sample_row(
    scene: &TileScene,
    tile: Tile,
    margin: usize,
    row: usize,
    samples: &mut Planes,
    signals: &mut Signals,
) {
    let (mut hits, mut beams) = (Vec::new(), Vec::new());
    let y = (tile.y + row) as f64 - margin as f64;
    for column in 0..tile.width + 2 * margin {
        let x = (tile.x + column) as f64 - margin as f64;
        let Some(seen) = scene.find_hits([x, y], &mut hits) else { continue };
        let inside = (margin..margin + tile.width).contains(&column)
            && (margin..margin + tile.height).contains(&row);
        if inside {
            let [x, y] = [tile.x + column - margin, tile.y + row - margin];
            let channel = scene.stage.cfa.channel(x, y) as usize;
            let passed = scene.stage.view.transmission(x as f64, y as f64);
            scene.find_beams(&seen.middle, channel, passed, &mut beams);
            let at = (row - margin) * tile.width + column - margin;
            for (beam, light) in beams.iter().zip(&mut signals.lights) {
                light[at] = beam.strength;
            }
            signals.ambient[at] = (scene.stage.ambient[channel] * passed) as f32;
        } else {
            scene.find_beams(&seen.middle, 0, 1.0, &mut beams);
        }
        // The strength of the light changes little over the blur: it is that of the photosite.
        beams.iter_mut().for_each(|beam| beam.strength = 1.0);
        let view = scene.towards_camera(&seen.middle);
        for (k, hit) in hits.iter().enumerate() {
            let at = [column * scene.samples + k % scene.samples, k / scene.samples];
            fill_sample(scene, hit, &beams, view, at, samples);
        }
    }
}

fn fill_sample(
    scene: &TileScene,
    hit: &Hit,
    beams: &[Beam],
    view: [f32; 3],
    [x, row]: [usize; 2],
    out: &mut Planes,
) {
    for (i, beam) in beams.iter().enumerate() {
        let facing = scene.facing(hit, beam);
        if facing > 0.0 {
            for c in 0..3 {
                out.plane_mut(row, 3 * i + c)[x] = facing * scene.reflected(hit, beam, view, c);
            }
        }
    }
    if let (Bounce::Once, Some(grid)) = (scene.fabric.bounce, &scene.grid) {
        let channels = (&scene.channels, [0, 1, 2]);
        let hit = std::slice::from_ref(hit);
        gather(scene.fabric, grid, channels, hit, beams, |i, more: [f32; 3]| {
            (0..3).for_each(|c| out.plane_mut(row, 3 * i + c)[x] += more[c]);
        });
    }
    let lights = out.lights;
    for c in 0..3 {
        out.plane_mut(row, 3 * lights + c)[x] = hit.albedo[c] * sky_over(hit);
    }
    if out.count > 3 * (lights + 1) {
        for c in 0..3 {
            let (normal, albedo) = (out.truth(c), out.truth(3 + c));
            out.plane_mut(row, normal)[x] = hit.normal[c];
            out.plane_mut(row, albedo)[x] = hit.reflectance[c];
        }
        let height = out.truth(6);
        out.plane_mut(row, height)[x] = hit.height_mm;
    }
}

/// Spreads a row's sums sideways, in each photosite's own channel.
fn finish_row(
    scene: &TileScene,
    kernel: &Kernel,
    tile: Tile,
    row: usize,
    (sums, slot): (&Planes, usize),
    signals: &mut Signals,
) {
    let per_side = scene.samples;
    for column in 0..tile.width {
        let at = row * tile.width + column;
        let channel = scene.stage.cfa.channel(tile.x + column, tile.y + row) as usize;
        let start = column * per_side;
        let across = |plane: usize| -> f32 {
            let values = &sums.plane(slot, plane)[start..start + kernel.weights.len()];
            values.iter().zip(&kernel.weights).map(|(value, weight)| value * weight).sum()
        };
        for (i, light) in signals.lights.iter_mut().enumerate() {
            light[at] *= across(3 * i + channel);
        }
        signals.ambient[at] *= across(3 * sums.lights + channel);
        if let Some(truth) = &mut signals.truth {
            let of = |k: usize| across(sums.truth(k));
            let normal = [of(0), of(1), of(2)];
            let norm = dot(normal, normal).sqrt().max(1e-12);
            truth.normal[at] = normal.map(|c| c / norm);
            truth.albedo[at] = [of(3), of(4), of(5)];
            truth.height_mm[at] = of(6);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_a_gaussian_over_an_aperture() {
        for (sigma, per_side) in [(0.7, 1), (0.7, 4), (1.3, 3), (0.4, 2)] {
            let kernel = Kernel::new(sigma, per_side);
            let weights: Vec<f64> = kernel.weights.iter().map(|w| f64::from(*w)).collect();
            assert_eq!(weights.len(), (2 * kernel.margin + 1) * per_side);
            let place =
                |k: usize| (k as f64 + 0.5) / per_side as f64 - (kernel.margin as f64 + 0.5);
            let sum: f64 = weights.iter().sum();
            let mean: f64 = weights.iter().enumerate().map(|(k, w)| w * place(k)).sum();
            let square: f64 = weights.iter().enumerate().map(|(k, w)| w * place(k).powi(2)).sum();
            assert!((sum - 1.0).abs() < 1e-6 && mean.abs() < 1e-6, "{sigma}: {sum}, {mean}");
            let expected = sigma * sigma + 1.0 / 12.0;
            assert!((square / expected - 1.0).abs() < 0.06, "{sigma}: {square}, not {expected}");
        }
        let none = Kernel::new(0.0, 4);
        assert_eq!((none.margin, none.weights), (0, vec![0.25; 4]));
    }
}
