use super::{Signals, Stage, Subject, Tile};
use crate::random::Key;
use crate::sensor::{Noise, Sensor};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// One exposure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// Which light is on; `None` for none.
    pub light: Option<usize>,
    /// Exposure time in seconds times ISO / 100.
    pub exposure: f64,
    /// Strength of the light now relative to what it is calibrated to (drift, a dead LED).
    pub strength: f64,
    /// Number of the shot in the instrument's life: shots of different numbers have different noise.
    pub number: u64,
}

/// Raw numbers, one frame a shot, row by row.
pub type Frames = Vec<Vec<u16>>;

/// What is in the picture, per photosite, on the sensor's own grid.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// Unit mean of the normals over the photosite's footprint, rig frame.
    pub normal: Vec<[f32; 3]>,
    /// Mean diffuse reflectance, linear sRGB.
    pub albedo: Vec<[f32; 3]>,
    /// Mean height over the swatch's plane, millimetres.
    pub height_mm: Vec<f32>,
}

impl Truth {
    pub(super) fn sized(pixels: usize) -> Self {
        Self {
            normal: vec![[0.0; 3]; pixels],
            albedo: vec![[0.0; 3]; pixels],
            height_mm: vec![0.0; pixels],
        }
    }
}

/// Side of a tile, pixels.
const TILE: usize = 64;

/// Photographs a subject. `progress` is told the share done (0..1), from several threads.
pub fn shoot(
    subject: &dyn Subject,
    stage: &Stage,
    sensor: &Sensor,
    shots: &[Shot],
    progress: &(dyn Fn(f64) + Sync),
) -> Frames {
    expose_all(subject, stage, sensor, shots, None, progress)
}

/// [`shoot`], and what is in the picture.
pub fn shoot_with_truth(
    subject: &dyn Subject,
    stage: &Stage,
    sensor: &Sensor,
    shots: &[Shot],
    progress: &(dyn Fn(f64) + Sync),
) -> (Frames, Truth) {
    let mut truth = Truth::sized(stage.view.camera.width_px * stage.view.camera.height_px);
    let frames = expose_all(subject, stage, sensor, shots, Some(&mut truth), progress);
    (frames, truth)
}

/// The rows of one band of every frame, and of the truth.
struct Band<'a> {
    top: usize,
    height: usize,
    frames: Vec<&'a mut [u16]>,
    truth: Option<BandTruth<'a>>,
}

struct BandTruth<'a> {
    normal: &'a mut [[f32; 3]],
    albedo: &'a mut [[f32; 3]],
    height_mm: &'a mut [f32],
}

fn expose_all(
    subject: &dyn Subject,
    stage: &Stage,
    sensor: &Sensor,
    shots: &[Shot],
    truth: Option<&mut Truth>,
    progress: &(dyn Fn(f64) + Sync),
) -> Frames {
    let (width, height) = (stage.view.camera.width_px, stage.view.camera.height_px);
    let mut frames: Frames = shots.iter().map(|_| vec![0u16; width * height]).collect();
    let bands = bands(&mut frames, truth, width, height);
    let (count, done) = (bands.len(), AtomicUsize::new(0));
    bands.into_par_iter().for_each(|mut band| {
        expose_band(subject, stage, sensor, shots, &mut band);
        let finished = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress(finished as f64 / count as f64);
    });
    frames
}

fn bands<'a>(
    frames: &'a mut Frames,
    truth: Option<&'a mut Truth>,
    width: usize,
    height: usize,
) -> Vec<Band<'a>> {
    let rows = TILE * width;
    let mut bands: Vec<Band> = (0..height.div_ceil(TILE))
        .map(|k| Band {
            top: k * TILE,
            height: TILE.min(height - k * TILE),
            frames: Vec::new(),
            truth: None,
        })
        .collect();
    for frame in frames {
        for (band, slice) in bands.iter_mut().zip(frame.chunks_mut(rows)) {
            band.frames.push(slice);
        }
    }
    if let Some(truth) = truth {
        let slices = truth
            .normal
            .chunks_mut(rows)
            .zip(truth.albedo.chunks_mut(rows))
            .zip(truth.height_mm.chunks_mut(rows))
            .map(|((normal, albedo), height_mm)| BandTruth { normal, albedo, height_mm });
        for (band, slice) in bands.iter_mut().zip(slices) {
            band.truth = Some(slice);
        }
    }
    bands
}

fn expose_band(
    subject: &dyn Subject,
    stage: &Stage,
    sensor: &Sensor,
    shots: &[Shot],
    band: &mut Band,
) {
    let width = stage.view.camera.width_px;
    for x in (0..width).step_by(TILE) {
        let tile = Tile { x, y: band.top, width: TILE.min(width - x), height: band.height };
        let mut signals = blank_signals(stage, tile);
        signals.truth = band.truth.is_some().then(|| Truth::sized(tile.pixels()));
        subject.expose(stage, tile, &mut signals);
        read_tile(sensor, stage, shots, tile, &signals, band);
        if let (Some(seen), Some(truth)) = (signals.truth, &mut band.truth) {
            for row in 0..tile.height {
                let (from, to) = (row * tile.width, row * width + x);
                truth.normal[to..to + tile.width]
                    .copy_from_slice(&seen.normal[from..from + tile.width]);
                truth.albedo[to..to + tile.width]
                    .copy_from_slice(&seen.albedo[from..from + tile.width]);
                truth.height_mm[to..to + tile.width]
                    .copy_from_slice(&seen.height_mm[from..from + tile.width]);
            }
        }
    }
}

fn blank_signals(stage: &Stage, tile: Tile) -> Signals {
    let blank = vec![0.0; tile.pixels()];
    Signals { lights: vec![blank.clone(); stage.lights.len()], ambient: blank, truth: None }
}

fn read_tile(
    sensor: &Sensor,
    stage: &Stage,
    shots: &[Shot],
    tile: Tile,
    signals: &Signals,
    band: &mut Band,
) {
    let width = stage.view.camera.width_px;
    let keys: Vec<Key> =
        shots.iter().map(|shot| Key::new(sensor.seed).with(0xf3a).with(shot.number)).collect();
    for row in 0..tile.height {
        for column in 0..tile.width {
            let (x, y) = (tile.x + column, tile.y + row);
            let (index, cell) = (y * width + x, (y & 1) * 2 + (x & 1));
            let photosite = sensor.photosite(index, cell);
            let at = row * tile.width + column;
            for ((shot, key), frame) in shots.iter().zip(&keys).zip(&mut band.frames) {
                let lamp = shot
                    .light
                    .map_or(0.0, |light| signals.lights[light][at] * shot.strength as f32);
                let light = (lamp + signals.ambient[at]) * shot.exposure as f32;
                frame[row * width + x] =
                    sensor.read(photosite, cell, light, key.with(index as u64));
            }
        }
    }
}

/// The exposure (seconds times ISO / 100) at which the brightest light's `quantile` of the photosites reaches `level` of
/// the sensor's range, from a regular sample of tiles; rounded to three digits. `None` where no light comes back.
pub fn auto_exposure(
    subject: &dyn Subject,
    stage: &Stage,
    lights: &[usize],
    quantile: f64,
    level: f64,
) -> Option<f64> {
    let tiles = sample_tiles(stage);
    let exposed: Vec<Signals> = tiles
        .into_par_iter()
        .map(|tile| {
            let mut signals = blank_signals(stage, tile);
            subject.expose(stage, tile, &mut signals);
            signals
        })
        .collect();
    let high = |pick: &dyn Fn(&Signals, usize) -> f32| {
        let mut all: Vec<f32> = exposed
            .iter()
            .flat_map(|signals| (0..signals.ambient.len()).map(|i| pick(signals, i)))
            .collect();
        all.sort_unstable_by(f32::total_cmp);
        all.get(((all.len() as f64 - 1.0) * quantile).round() as usize).copied().unwrap_or(0.0)
    };
    let brightest = if lights.is_empty() {
        high(&|signals, i| signals.ambient[i])
    } else {
        let each = lights
            .iter()
            .map(|&light| high(&|signals, i| signals.lights[light][i] + signals.ambient[i]));
        each.fold(0.0, f32::max)
    };
    (brightest > 0.0 && brightest.is_finite()).then(|| three_digits(level / f64::from(brightest)))
}

/// Small tiles spread over the frame: about one photosite in fifty of a large frame, all of a small one's.
fn sample_tiles(stage: &Stage) -> Vec<Tile> {
    let (width, height) = (stage.view.camera.width_px, stage.view.camera.height_px);
    let side = 16;
    let stride = |length: usize| (length / 36).max(side);
    let starts =
        |length: usize| (0..length).step_by(stride(length)).map(move |at| (at & !1, length));
    let tiles = starts(height).flat_map(|(y, height)| {
        starts(width).map(move |(x, width)| Tile {
            x,
            y,
            width: side.min(width - x),
            height: side.min(height - y),
        })
    });
    tiles.collect()
}

fn three_digits(value: f64) -> f64 {
    // Through decimal text: the shortest number that says what was meant.
    format!("{value:.2e}").parse().unwrap_or(value)
}

impl Sensor {
    /// This sensor without scatter, for tests of what reaches it.
    pub fn without_noise(&self) -> Self {
        Self { noise: Noise::Off, prnu: 0.0, ..self.clone() }
    }
}
