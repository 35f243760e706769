//! A scene at a fraction of its resolution: every pixel is the mean of a block of photosites, channel by channel. Solved by
//! the same run as the full scene, it gives a preview at a fraction of the time.

use crate::instrument::{Color, Noise};
use crate::linear::{Exposure, GREY, PhotographedLight, Reading};
use crate::raw::{Frame, Layout, Samples};
use crate::solution::Scale;
use crate::solve::scene::Scene;
use rayon::prelude::*;
use std::ops::Range;
use weavelight_calibration::description::{Camera, Image};

impl Scene {
    /// The scene of a sensor whose pixels are blocks of this one's: means of linear light over the photosites of each channel
    /// that are inside the mask and not defective. A block in which one of these clips has no sample, as a clipped filter
    /// would change its mixture of colours from light to light. Mosaics become colour pictures.
    pub fn reduced(&self, scale: Scale) -> Scene {
        if scale == Scale::Full {
            return self.clone();
        }
        let blocks = Blocks::new(self, scale as usize);
        let light = |light: &PhotographedLight| PhotographedLight {
            index: light.index,
            calibrated: light.calibrated.clone(),
            exposures: light.exposures.iter().map(|e| blocks.exposure(e)).collect(),
        };
        Scene {
            width: blocks.width,
            height: blocks.height,
            layout: blocks.layout(),
            lights: self.lights.iter().map(light).collect(),
            ambient: self.ambient.iter().map(|exposure| blocks.exposure(exposure)).collect(),
            camera: self.camera.as_ref().map(|camera| reduced_camera(camera, scale)),
            plane: self.plane.clone(),
            color: blocks.color(),
            defects: Default::default(),
            mask: self.mask.as_ref().map(|mask| blocks.mask(mask)),
            origin: self.origin.clone(),
        }
    }
}

/// The camera of a reduced picture: the middle of its first pixel is the middle of the first block.
pub(crate) fn reduced_camera(camera: &Camera, scale: Scale) -> Camera {
    let side = scale as usize;
    let (size, shift) = (side as f64, (side as f64 - 1.0) / 2.0);
    Camera {
        width_px: camera.width_px.div_ceil(side),
        height_px: camera.height_px.div_ceil(side),
        fx: camera.fx / size,
        fy: camera.fy / size,
        cx: (camera.cx - shift) / size,
        cy: (camera.cy - shift) / size,
        ..camera.clone()
    }
}

/// How a scene's photosites fall into blocks.
struct Blocks<'a> {
    scene: &'a Scene,
    side: usize,
    width: usize,
    height: usize,
    /// Per parity of the row.
    rows: [RowOfPhotosites; 2],
}

/// Which mean each photosite of a row belongs to.
struct RowOfPhotosites {
    /// Column, and place in a row of means (of the first channel, where a photosite has several).
    places: Vec<[usize; 2]>,
    /// Photosites in each mean.
    counts: Vec<f32>,
}

impl<'a> Blocks<'a> {
    fn new(scene: &'a Scene, side: usize) -> Self {
        let (width, height) = (scene.width.div_ceil(side), scene.height.div_ceil(side));
        let rows = [0, 1].map(|parity| RowOfPhotosites::new(scene, side, parity));
        Self { scene, side, width, height, rows }
    }

    fn layout(&self) -> Layout {
        reduced_layout(self.scene.layout)
    }

    fn mask(&self, mask: &Image<bool>) -> Image<bool> {
        let inside = |row: usize, column: usize| {
            let columns = span(column, self.side, mask.width);
            span(row, self.side, mask.height).any(|y| mask.row(y)[columns.clone()].contains(&true))
        };
        let data = (0..self.width * self.height).map(|k| inside(k / self.width, k % self.width));
        Image { width: self.width, height: self.height, data: data.collect() }
    }

    fn exposure(&self, exposure: &Exposure) -> Exposure {
        let frame = &exposure.frame;
        let layout = self.layout();
        let reading = Reading::new(frame, &self.scene.color);
        // Raw numbers from black to saturation: those of the first photosite.
        let range = reading.range()[0];
        let mut samples = vec![0.0; self.width * self.height * layout.channels()];
        let rows = samples.par_chunks_mut(self.width * layout.channels()).enumerate();
        rows.for_each(|(row, out)| self.mean_row(&reading, range, row, out));
        let frame = Frame {
            width: self.width,
            height: self.height,
            layout,
            samples: Samples::F32(samples),
            black: [0.0; 4],
            saturation: [range; 4],
            metadata: frame.metadata.clone(),
        };
        Exposure { frame, path: exposure.path.clone(), ..*exposure }
    }

    /// Means over one row of blocks, channels interleaved, raw numbers above black; infinite where one of the photosites
    /// clips, not a number where none counts.
    fn mean_row(&self, reading: &Reading, range: f32, row: usize, out: &mut [f32]) {
        let (width, planes) = (self.scene.width, self.scene.layout.channels());
        let mut counts = vec![0.0_f32; out.len()];
        let mut light = vec![0.0_f32; width];
        // Rows under the same filters are added up before their photosites are sorted into blocks.
        let mut sums = [vec![0.0_f32; width * planes], vec![0.0_f32; width * planes]];
        for y in span(row, self.side, self.scene.height) {
            let of_row = &self.rows[y & 1];
            counts.iter_mut().zip(&of_row.counts).for_each(|(sum, count)| *sum += count);
            let excluded = self.excluded(y);
            for (plane, sum) in sums[y & 1].chunks_mut(width).enumerate() {
                reading.row(y, plane, 0..width, [range; 4], &mut light);
                excluded.iter().for_each(|&column| light[column] = 0.0);
                sum.iter_mut().zip(&light).for_each(|(sum, light)| *sum += light);
            }
            self.forget(&excluded, of_row, &mut counts);
        }
        for (of_row, sums) in self.rows.iter().zip(&sums) {
            for (plane, sum) in sums.chunks(width).enumerate() {
                of_row.places.iter().for_each(|&[x, at]| out[at + plane] += sum[x]);
            }
        }
        out.iter_mut().zip(&counts).for_each(|(mean, count)| *mean /= count);
        let channels = self.layout().channels();
        for (pixel, counts) in out.chunks_mut(channels).zip(counts.chunks(channels)) {
            if pixel.iter().any(|value| !value.is_finite()) {
                let whole = counts.iter().all(|&count| count > 0.0);
                pixel.fill(if whole { f32::INFINITY } else { f32::NAN });
            }
        }
    }

    /// Columns of a row that do not count: defective, or outside the mask.
    fn excluded(&self, y: usize) -> Vec<usize> {
        let defects = self.scene.defects.columns(y, 0).take_while(|x| *x < self.scene.width);
        match &self.scene.mask {
            None => defects.collect(),
            Some(mask) => {
                let mut inside = mask.row(y).to_vec();
                defects.for_each(|x| inside[x] = false);
                (0..inside.len()).filter(|&x| !inside[x]).collect()
            }
        }
    }

    fn forget(&self, excluded: &[usize], row: &RowOfPhotosites, counts: &mut [f32]) {
        if excluded.is_empty() {
            return;
        }
        let gone = row.places.iter().filter(|[x, _]| excluded.binary_search(x).is_ok());
        let planes = self.scene.layout.channels();
        gone.for_each(|[_, at]| (0..planes).for_each(|plane| counts[at + plane] -= 1.0));
    }

    /// What the calibration says of the reduced frames: linear, and calmer by the number of photosites in a mean.
    fn color(&self) -> Color {
        let color = &self.scene.color;
        let photosites = self.photosites_in_grey();
        let calmer = |noise: Noise| {
            let quantisation = noise.electrons_per_dn.powi(2) / 12.0;
            let electrons_per_dn = photosites * noise.electrons_per_dn;
            // Means have no steps of their own; what the model adds for them is taken out of the read noise.
            let read_e2 = photosites * (noise.read_noise_e.powi(2) + quantisation)
                - electrons_per_dn.powi(2) / 12.0;
            Noise { electrons_per_dn, read_noise_e: read_e2.max(0.0).sqrt(), ..noise }
        };
        Color {
            black_level: None,
            saturation_level: None,
            clip_level: None,
            response: vec![0.0, 1.0],
            noise: color.noise.map(calmer),
            ..color.clone()
        }
    }

    /// Photosites over which noise is averaged: in a grey value made of red, green and blue means of unequal numbers, those
    /// that give its variance.
    fn photosites_in_grey(&self) -> f64 {
        let area = (self.side * self.side) as f64;
        if !matches!(self.scene.layout, Layout::Mosaic(_)) {
            return area;
        }
        let squares = GREY.map(|weight| f64::from(weight * weight));
        let of_means = 4.0 * squares[0] + 2.0 * squares[1] + 4.0 * squares[2];
        area * squares.iter().sum::<f64>() / of_means
    }
}

impl RowOfPhotosites {
    fn new(scene: &Scene, side: usize, parity: usize) -> Self {
        let (layout, planes) = (reduced_layout(scene.layout), scene.layout.channels());
        let blocks = scene.width.div_ceil(side);
        let channel = |x: usize| match scene.layout {
            Layout::Mosaic(cfa) => cfa.channel(x, parity) as usize,
            Layout::Grey | Layout::Rgb => 0,
        };
        let places: Vec<[usize; 2]> = (0..blocks)
            .flat_map(|block| span(block, side, scene.width).map(move |x| (block, x)))
            .map(|(block, x)| [x, block * layout.channels() + channel(x)])
            .collect();
        let mut counts = vec![0.0; blocks * layout.channels()];
        for &[_, at] in &places {
            counts[at..at + planes].iter_mut().for_each(|count| *count += 1.0);
        }
        Self { places, counts }
    }
}

fn reduced_layout(layout: Layout) -> Layout {
    match layout {
        Layout::Grey => Layout::Grey,
        Layout::Mosaic(_) | Layout::Rgb => Layout::Rgb,
    }
}

/// Photosites of block `k` along a side of `length`. The last block is never narrower than two, if it has to reach into its
/// neighbour: it needs every filter of the mosaic.
fn span(k: usize, side: usize, length: usize) -> Range<usize> {
    let end = ((k + 1) * side).min(length);
    (k * side).min(end.saturating_sub(2))..end
}
