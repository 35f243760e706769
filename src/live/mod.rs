//! Maps while a scan is still running: per-pixel sums to which every frame is added as it arrives, at full resolution or
//! binned.
//!
//! Plain least squares is linear: with light vectors l_i and signals y_i, albedo times normal is N^-1 b, where
//! N = sum l_i l_i^T needs no picture and b = sum l_i y_i grows frame by frame. The last frame costs no more than the first.

use crate::instrument::Calibration;
use crate::linear::{Exposure, Normalizer, PhotographedLight, SignalRows};
use crate::photometry::{FieldRow, LightSet};
use crate::raw::{Frame, Layout, demosaic};
use crate::solution::Scale;
use crate::solve::SolveError;
use crate::solve::light_field::{FieldRows, LightField};
use crate::solve::scene::check::{check_frames, describe};
use crate::solve::scene::checked::{light_field, unseen_pixel};
use crate::solve::scene::{Origin, Scene};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use weavelight_calibration::description::{Cfa, Image, Plane};

/// The sums.
#[derive(Debug)]
pub struct Accumulator {
    /// The calibration and the ambient frame; the light that is being added, for as long as that takes.
    scene: Scene,
    calibration: Calibration,
    scale: usize,
    width: usize,
    height: usize,
    /// Per channel that a pixel has: sum of l y, row by row.
    sums: Vec<Vec<[f32; 3]>>,
    /// Per pixel: the lights that clipped.
    lost: Vec<LightSet>,
    /// Lights that were added, ascending.
    arrived: Vec<usize>,
}

/// What the sums show.
#[derive(Clone, Debug, PartialEq)]
pub struct Preview {
    /// Unit normals, rig frame; zero where unsolved.
    pub normal: Image<[f32; 3]>,
    /// Linear RGB as in a solution without colour profile; zero where unsolved.
    pub albedo: Image<[f32; 3]>,
    /// The lights that it rests on.
    pub lights: Vec<usize>,
}

impl Accumulator {
    /// Empty sums for frames like `like` (its size and layout), of the surface `plane`.
    pub fn new(calibration: Calibration, plane: Plane, like: &Frame, scale: Scale) -> Self {
        let scale = scale as usize;
        let (width, height) = (like.width.div_ceil(scale), like.height.div_ceil(scale));
        let scene = Scene {
            width: like.width,
            height: like.height,
            layout: like.layout,
            lights: vec![],
            ambient: vec![],
            camera: calibration.camera.clone(),
            plane,
            color: calibration.color.clone(),
            defects: calibration.defects.clone(),
            mask: None,
            origin: Origin { session: "the scan".into(), calibration: calibration.folder.clone() },
        };
        let channels = match like.layout {
            Layout::Mosaic(_) if scale == 1 => 1,
            Layout::Grey => 1,
            Layout::Mosaic(_) | Layout::Rgb => 3,
        };
        Self {
            scene,
            calibration,
            scale,
            width,
            height,
            sums: vec![vec![[0.0; 3]; width * height]; channels],
            lost: vec![LightSet::NONE; width * height],
            arrived: vec![],
        }
    }

    /// Takes a frame with every LED off. It is subtracted from the lights that come after it.
    ///
    /// # Errors
    /// Where it does not fit the other frames.
    pub fn add_ambient(&mut self, exposure: Exposure) -> Result<(), SolveError> {
        self.check_fit(&exposure)?;
        self.scene.ambient.push(exposure);
        let checked = check_frames(&self.scene);
        if checked.is_err() {
            self.scene.ambient.pop();
        }
        checked
    }

    /// Adds the frame of a light; a second one of the same light changes nothing. Frames may come in any order.
    ///
    /// # Errors
    /// Where the light is unknown, or the frame does not fit the calibration or the other frames.
    pub fn add(&mut self, light: usize, exposure: Exposure) -> Result<(), SolveError> {
        let Some(calibrated) =
            self.calibration.lights.get(light).filter(|_| !self.arrived.contains(&light))
        else {
            return Ok(());
        };
        self.check_fit(&exposure)?;
        self.scene.lights = vec![PhotographedLight {
            index: light,
            calibrated: calibrated.clone(),
            exposures: vec![exposure],
        }];
        let added = check_frames(&self.scene).and_then(|()| self.add_rows(light));
        self.scene.lights.clear();
        added?;
        self.arrived.push(light);
        self.arrived.sort_unstable();
        Ok(())
    }

    fn check_fit(&self, exposure: &Exposure) -> Result<(), SolveError> {
        let (frame, scene) = (&exposure.frame, &self.scene);
        if (frame.width, frame.height, frame.layout) == (scene.width, scene.height, scene.layout) {
            return Ok(());
        }
        let expected = describe(scene.width, scene.height, scene.layout);
        Err(SolveError::DifferentFrames {
            a: exposure.path.clone(),
            a_is: describe(frame.width, frame.height, frame.layout),
            b: "the frame before it".into(),
            b_is: expected,
        })
    }

    fn add_rows(&mut self, light: usize) -> Result<(), SolveError> {
        let scene = &self.scene;
        let field = light_field(scene)?;
        let normalizer = Normalizer::new(&scene.photographs(), &[vec![1.0]]);
        let (width, scale) = (self.width, self.scale);
        let mut channels = self.sums.iter_mut();
        let first = channels.next().into_iter().flat_map(|sums| sums.chunks_mut(width));
        let mut rows: Vec<Vec<&mut [[f32; 3]]>> = first.map(|row| vec![row]).collect();
        for channel in channels {
            rows.iter_mut().zip(channel.chunks_mut(width)).for_each(|(rows, row)| rows.push(row));
        }
        let bands = rows
            .par_chunks_mut(BAND_ROWS)
            .zip(self.lost.par_chunks_mut(BAND_ROWS * width))
            .enumerate();
        bands.for_each(|(band, (rows, lost))| {
            let mut worker = Worker {
                field: FieldRows::new(&field),
                signals: SignalRows::default(),
                bins: vec![],
            };
            for (k, (sums, lost)) in rows.iter_mut().zip(lost.chunks_mut(width)).enumerate() {
                worker.add_row(
                    scene,
                    &normalizer,
                    scale,
                    band * BAND_ROWS + k,
                    sums,
                    (lost, light),
                );
            }
        });
        Ok(())
    }

    /// The maps as far as the frames go; `None` before three lights that span a volume.
    ///
    /// # Errors
    /// Where a pixel shows no point of the plane.
    pub fn preview(&self) -> Result<Option<Preview>, SolveError> {
        if self.arrived.len() < 3 {
            return Ok(None);
        }
        let lights =
            self.arrived.iter().map(|&light| &self.calibration.lights[light].light).collect();
        let size = (self.scene.width, self.scene.height);
        let field = LightField::new(lights, self.scene.camera.as_ref(), &self.scene.plane, size)
            .map_err(|unseen| unseen_pixel(&self.scene, unseen))?;
        let mut normal = Image::filled(self.width, self.height, [0.0; 3]);
        let mut colour = Image::filled(self.width, self.height, [0.0; 3]);
        let bands = normal
            .data
            .par_chunks_mut(BAND_ROWS * self.width)
            .zip(colour.data.par_chunks_mut(BAND_ROWS * self.width));
        bands.enumerate().for_each(|(band, (normal, colour))| {
            let mut field = FieldRows::new(&field);
            let rows = normal.chunks_mut(self.width).zip(colour.chunks_mut(self.width));
            for (k, (normal, colour)) in rows.enumerate() {
                let y = band * BAND_ROWS + k;
                self.solve_row(
                    field.row(centre(y, self.scale, self.scene.height), 0),
                    y,
                    normal,
                    colour,
                );
            }
        });
        let albedo = match self.scene.layout {
            Layout::Mosaic(cfa) if self.scale == 1 => self.coloured(&colour, cfa, &normal),
            _ => colour,
        };
        Ok(Some(Preview { normal, albedo, lights: self.arrived.clone() }))
    }

    fn coloured(
        &self,
        own: &Image<[f32; 3]>,
        cfa: Cfa,
        normal: &Image<[f32; 3]>,
    ) -> Image<[f32; 3]> {
        let data = own.data.iter().map(|rgb| rgb[0]).collect();
        let mosaic = Image { width: self.width, height: self.height, data };
        demosaic(&mosaic, cfa, &|x, y| normal.at(x, y)[2] > 0.0)
    }

    fn solve_row(
        &self,
        field: FieldRow,
        y: usize,
        normal: &mut [[f32; 3]],
        colour: &mut [[f32; 3]],
    ) {
        let matrices: Vec<[Matrix3<f32>; 2]> =
            (0..2 * field.nodes() - 1).map(|half| matrices_at(&field, half)).collect();
        for x in 0..self.width {
            let at = y * self.width + x;
            let column = centre(x, self.scale, self.scene.width);
            let exact = (!self.lost[at].is_empty())
                .then(|| self.matrices_without_lost(&field, column, &self.lost[at]));
            let [n, inverse] = exact.unwrap_or_else(|| between(&matrices, field.step, column));
            let b = |channel: usize| Vector3::from(self.sums[channel][at]);
            let g = inverse * (0..self.sums.len()).map(b).sum::<Vector3<f32>>();
            let length = g.norm();
            if length.is_finite() && length > 0.0 && g.z > 0.0 {
                let direction = g / length;
                let strength = (n * direction).dot(&direction);
                normal[x] = direction.into();
                colour[x] =
                    [0, 1, 2].map(|c| b(c.min(self.sums.len() - 1)).dot(&direction) / strength);
            }
        }
    }

    /// N and its inverse over the lights that did not clip at a pixel.
    fn matrices_without_lost(
        &self,
        field: &FieldRow,
        column: usize,
        lost: &LightSet,
    ) -> [Matrix3<f32>; 2] {
        let kept = self.arrived.iter().enumerate().filter(|(_, light)| !lost.contains(**light));
        let vectors: Vec<Vector3<f64>> =
            kept.map(|(position, _)| field.at(column, position)).collect();
        match vectors.len() {
            0..3 => [Matrix3::repeat(f32::NAN); 2],
            _ => with_inverse(vectors.iter().map(|l| l * l.transpose()).sum()),
        }
    }
}

/// Rows of preview pixels that a thread takes at a time.
const BAND_ROWS: usize = 32;

struct Worker<'f, 'a> {
    field: FieldRows<'f, 'a>,
    signals: SignalRows,
    /// Per channel: mean signal of every preview pixel.
    bins: Vec<Vec<f32>>,
}

impl Worker<'_, '_> {
    fn add_row(
        &mut self,
        scene: &Scene,
        normalizer: &Normalizer,
        scale: usize,
        row: usize,
        sums: &mut [&mut [[f32; 3]]],
        (lost, light): (&mut [LightSet], usize),
    ) {
        self.bin(scene, normalizer, scale, row, sums.len(), lost.len());
        let field = self.field.row(centre(row, scale, scene.height), 0);
        for (channel, sums) in sums.iter_mut().enumerate() {
            for (x, (sum, y)) in sums.iter_mut().zip(&self.bins[channel]).enumerate() {
                if y.is_finite() {
                    let l = vector_at(&field, centre(x, scale, scene.width));
                    (0..3).for_each(|axis| sum[axis] += l[axis] * y);
                }
            }
        }
        for (x, lost) in lost.iter_mut().enumerate() {
            if self.bins.iter().any(|bins| !bins[x].is_finite()) {
                lost.insert(light);
            }
        }
    }

    /// Means over the photosites of each channel; not finite where one of the block is not.
    fn bin(
        &mut self,
        scene: &Scene,
        normalizer: &Normalizer,
        scale: usize,
        row: usize,
        channels: usize,
        width: usize,
    ) {
        let mut counts = vec![vec![0.0_f32; width]; channels];
        self.bins.resize(channels, vec![]);
        self.bins.iter_mut().for_each(|bins| {
            bins.clear();
            bins.resize(width, 0.0);
        });
        for y in row * scale..((row + 1) * scale).min(scene.height) {
            normalizer.row(y, 0..scene.width, &mut self.signals);
            let channel_of = |plane: usize, x: usize| match scene.layout {
                Layout::Mosaic(cfa) if channels == 3 => cfa.channel(x, y) as usize,
                _ => plane,
            };
            // A defective photosite counts for nothing, not even as clipped.
            for x in scene.defects.columns(y, 0).take_while(|x| *x < scene.width) {
                for (plane, signal) in self.signals.planes.iter_mut().enumerate() {
                    signal[x] = 0.0;
                    counts[channel_of(plane, x)][x / scale] -= 1.0;
                }
            }
            for (plane, signal) in self.signals.planes.iter().enumerate() {
                for (x, value) in signal.iter().enumerate() {
                    let channel = channel_of(plane, x);
                    self.bins[channel][x / scale] += value;
                    counts[channel][x / scale] += 1.0;
                }
            }
        }
        for (bins, counts) in self.bins.iter_mut().zip(&counts) {
            // A channel without a photosite (at the border) adds nothing.
            bins.iter_mut().zip(counts).for_each(|(bin, count)| *bin /= count.max(1.0));
        }
        // One clipped filter would change the mixture of colours from light to light.
        for x in 0..width {
            if self.bins.iter().any(|bins| !bins[x].is_finite()) {
                self.bins.iter_mut().for_each(|bins| bins[x] = f32::NAN);
            }
        }
    }
}

/// The photosite in the middle of preview pixel (or row) `k`.
fn centre(k: usize, scale: usize, length: usize) -> usize {
    (k * scale + (scale - 1) / 2).min(length - 1)
}

/// The only light's vector at a column, float32.
fn vector_at(field: &FieldRow, column: usize) -> [f32; 3] {
    let (node, t) = (column / field.step, (column % field.step) as f64 / field.step as f64);
    let (a, b) = (field.vectors[node], field.vectors[(node + 1).min(field.vectors.len() - 1)]);
    [0, 1, 2].map(|axis| (a[axis] + (b[axis] - a[axis]) * t) as f32)
}

/// At a node, or half-way to the next: the inverse bends more than the vectors it is made of.
fn matrices_at(field: &FieldRow, half_nodes: usize) -> [Matrix3<f32>; 2] {
    let node = |node: usize| &field.vectors[node * field.lights..][..field.lights];
    let (before, after) = (node(half_nodes / 2), node(half_nodes.div_ceil(2)));
    let middle = |(a, b): (&[f64; 3], &[f64; 3])| (Vector3::from(*a) + Vector3::from(*b)) / 2.0;
    with_inverse(before.iter().zip(after).map(middle).map(|l| l * l.transpose()).sum())
}

/// A matrix and its inverse; not a number where it has none.
fn with_inverse(n: Matrix3<f64>) -> [Matrix3<f32>; 2] {
    let inverse = n.try_inverse().unwrap_or(Matrix3::repeat(f64::NAN));
    [n.cast(), inverse.cast()]
}

/// Linear between the matrices at every half node.
fn between(halves: &[[Matrix3<f32>; 2]], step: usize, column: usize) -> [Matrix3<f32>; 2] {
    let (half, t) = (2 * column / step, (2 * column % step) as f32 / step as f32);
    let (a, b) = (&halves[half], &halves[(half + 1).min(halves.len() - 1)]);
    [0, 1].map(|k| a[k] + (b[k] - a[k]) * t)
}
