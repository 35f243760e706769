//! The sensor's noise from the pictures themselves, where the calibration does not state it.
//!
//! Which photosites are asked, their own raw numbers say: the same ones however the pictures are turned, mirrored or shifted,
//! and in whatever order lights and frames come. So the estimate, and with it the maps, do not depend on the layout.

use super::exposure::{Exposure, Photographs};
use super::noise::{AmbientNoise, LinearNoise, exposure_variances, variance_of_row};
use super::signal::{Normalizer, SignalRows};
use crate::photometry::{NoiseEvidence, NoiseSample, VarianceModel, estimate_noise};
use crate::raw::Samples;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::ops::Range;
use weavelight_calibration::description::Image;

/// About as many photosites are asked; all of a small picture.
const ASKED: usize = 40_000;
/// Rows that a thread takes at once.
const BAND_ROWS: usize = 64;
/// Distance of the next photosite of the same colour.
const SAME_COLOR: usize = 2;

/// What is known of a photosite besides its samples.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    /// True where the swatch is; `None`: everywhere.
    pub(crate) mask: Option<&'a Image<bool>>,
    /// Every light's vector at a pixel; `None` where it shows no point of the plane.
    pub(crate) vectors: &'a (dyn Fn([f64; 2]) -> Option<Vec<Vector3<f64>>> + Sync),
}

/// Shot noise, floor and kappa in fractions of full scale; `None` where the pictures do not tell (three lights, too few
/// photosites).
pub(crate) fn noise_of_residuals(of: &Photographs, around: Surroundings) -> Option<LinearNoise> {
    let iso = of.exposures().next()?.iso;
    let (width, height) = of.size_px;
    if width <= 2 * SAME_COLOR || height <= 2 * SAME_COLOR {
        return None;
    }
    let evidence = Questions::new(*of, around, iso).evidence();
    let found = estimate_noise(evidence, of.lights.len())?;
    let (shot, floor) = (f64::from(found.shot), f64::from(found.floor));
    Some(LinearNoise { shot, floor, kappa: f64::from(found.kappa), iso })
}

/// What every photosite is asked with.
struct Questions<'a> {
    photographs: Photographs<'a>,
    around: Surroundings<'a>,
    normalizer: Normalizer<'a>,
    /// Per place of the 2 x 2 cell and light: one unit of each term.
    units: [Vec<VarianceModel>; 4],
}

impl<'a> Questions<'a> {
    fn new(photographs: Photographs<'a>, around: Surroundings<'a>, iso: f64) -> Self {
        // One unit of each term: the estimate says how many there are.
        let unit = LinearNoise { shot: 1.0, floor: 1.0, kappa: 1.0, iso };
        let units = exposure_variances(&photographs, unit, AmbientNoise::default());
        let equal: Vec<Vec<f64>> =
            photographs.lights.iter().map(|light| vec![1.0; light.exposures.len()]).collect();
        let of_place = |place: usize| {
            let lights = units.iter().zip(&equal);
            let of_row = lights.map(|(of, equal)| variance_of_row(of, equal, place / 2, u64::MAX));
            of_row.map(|columns| columns[place % 2]).collect()
        };
        let normalizer = Normalizer::new(&photographs, &equal);
        Self { photographs, around, normalizer, units: [0, 1, 2, 3].map(of_place) }
    }

    fn evidence(&self) -> Vec<NoiseEvidence> {
        let rows = SAME_COLOR..self.photographs.size_px.1 - SAME_COLOR;
        let bands = (rows.start..rows.end).into_par_iter().step_by(BAND_ROWS);
        bands
            .flat_map_iter(|first| self.evidence_of(first..(first + BAND_ROWS).min(rows.end)))
            .collect()
    }

    fn evidence_of(&self, rows: Range<usize>) -> Vec<NoiseEvidence> {
        let above = rows.start - SAME_COLOR;
        let sums: Vec<Vec<u32>> = (above..rows.end + SAME_COLOR).map(|y| self.sums(y)).collect();
        let mut buffers = Buffers::new(self.photographs.lights.len());
        let mut evidence = vec![];
        for y in rows {
            let around = [y - SAME_COLOR, y, y + SAME_COLOR].map(|y| sums[y - above].as_slice());
            let columns = self.columns(around);
            evidence.extend(columns.into_iter().filter_map(|x| self.ask([x, y], &mut buffers)));
        }
        evidence
    }

    /// Columns of a row whose photosites are asked: those whose own raw numbers and those of their four neighbours, summed
    /// over all frames, come to a hash that is low enough.
    fn columns(&self, [above, here, below]: [&[u32]; 3]) -> Vec<usize> {
        let (width, height) = self.photographs.size_px;
        let columns = SAME_COLOR..width - SAME_COLOR;
        let all = columns.len() * (height - 2 * SAME_COLOR);
        if all <= ASKED {
            return columns.collect();
        }
        let limit = (u64::MAX as f64 * (ASKED as f64 / all as f64)) as u64;
        let asked = |x: &usize| {
            let left_right = here[x - SAME_COLOR].wrapping_add(here[x + SAME_COLOR]);
            let around = above[*x].wrapping_add(below[*x]).wrapping_add(left_right);
            hash(u64::from(here[*x]) << 32 | u64::from(around)) < limit
        };
        columns.filter(asked).collect()
    }

    /// Sum of the raw numbers of all frames and channels at every photosite of a row.
    fn sums(&self, y: usize) -> Vec<u32> {
        let width = self.photographs.size_px.0;
        let mut sums = vec![0_u32; width];
        self.photographs.exposures().for_each(|exposure| add_row(exposure, y, width, &mut sums));
        sums
    }

    fn ask(&self, [x, y]: [usize; 2], buffers: &mut Buffers) -> Option<NoiseEvidence> {
        let Buffers { rows, signal, difference } = buffers;
        let first = (x - SAME_COLOR) & !1;
        let columns = first..x + SAME_COLOR + 1;
        let mut noise_scale = 1.0;
        signal.fill(0.0);
        difference.fill(0.0);
        for (row, own) in [(y - SAME_COLOR, false), (y, true), (y + SAME_COLOR, false)] {
            self.normalizer.row(row, columns.clone(), rows);
            if let Some(mask) = self.around.mask {
                rows.blank(&mask.row(row)[columns.clone()]);
            }
            for (light, values) in rows.signals().iter().enumerate() {
                let at = |column: usize| f64::from(values[column - first]);
                if own {
                    signal[light] = at(x);
                    difference[light] += 4.0 * at(x) - (at(x - SAME_COLOR) + at(x + SAME_COLOR));
                } else {
                    difference[light] -= at(x);
                }
            }
            if own {
                noise_scale = rows.noise_scale().map_or(1.0, |scale| f64::from(scale[x - first]));
            }
        }
        let vectors = (self.around.vectors)([x as f64, y as f64])?;
        NoiseEvidence::of(&NoiseSample {
            vectors: &vectors,
            signal,
            difference,
            variance: &self.units[(y & 1) * 2 + (x & 1)],
            noise_scale,
        })
    }
}

/// What a thread keeps from photosite to photosite.
struct Buffers {
    rows: SignalRows,
    signal: Vec<f64>,
    difference: Vec<f64>,
}

impl Buffers {
    fn new(lights: usize) -> Self {
        let values = || vec![0.0; lights];
        Self { rows: SignalRows::default(), signal: values(), difference: values() }
    }
}

fn add_row(exposure: &Exposure, y: usize, width: usize, sums: &mut [u32]) {
    let channels = exposure.frame.layout.channels();
    let row = y * width * channels..(y + 1) * width * channels;
    let add = |sum: &mut u32, value: u32| *sum = sum.wrapping_add(value);
    match &exposure.frame.samples {
        Samples::U16(samples) if channels == 1 => {
            sums.iter_mut().zip(&samples[row]).for_each(|(sum, &v)| add(sum, u32::from(v)));
        }
        Samples::U16(samples) => {
            let pixels = sums.iter_mut().zip(samples[row].chunks_exact(channels));
            pixels.for_each(|(sum, pixel)| pixel.iter().for_each(|&v| add(sum, u32::from(v))));
        }
        Samples::F32(samples) => {
            let pixels = sums.iter_mut().zip(samples[row].chunks_exact(channels));
            pixels.for_each(|(sum, pixel)| pixel.iter().for_each(|v| add(sum, v.to_bits())));
        }
    }
}

/// SplitMix64's finaliser: neighbouring numbers come far apart.
fn hash(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
