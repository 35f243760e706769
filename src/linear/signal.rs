//! Normalised signals of one row: every light's linear signal divided by its exposure, intensity and gain map, ambient
//! light removed, exposures of the same light merged. Made right before the kernel reads them, so that no frame is ever
//! copied as floating point.

use super::exposure::{Exposure, Photographs};
use super::gain::GainRows;
use super::reading::{GREY, Reading, intensity_of_places};
use crate::instrument::Defects;
use crate::raw::Layout;
use rayon::prelude::*;
use std::ops::Range;

/// How every row of the frames is normalised.
pub(crate) struct Normalizer<'a> {
    layout: Layout,
    channels: usize,
    lights: Vec<LightPlan<'a>>,
    /// Ambient frames with the factors that make their sum a rate per second at ISO 100.
    ambient: Vec<(Reading<'a>, [f32; 4])>,
    defects: &'a Defects,
    frame_px: (usize, usize),
}

struct LightPlan<'a> {
    exposures: Vec<ExposurePlan<'a>>,
    /// Per channel: 1 / intensity, per place of the 2 x 2 cell.
    per_intensity: Vec<[f32; 4]>,
    gain: Option<GainRows<'a>>,
}

struct ExposurePlan<'a> {
    reading: Reading<'a>,
    /// Per channel: 1 / (seconds x intensity), per place of the 2 x 2 cell.
    factor: Vec<[f32; 4]>,
    /// Share in the mean of several exposures.
    weight: f32,
}

/// The rows of one band, reused from row to row.
#[derive(Default)]
pub(crate) struct SignalRows {
    /// Per light and channel (light-major): y. NaN where unusable.
    pub(crate) planes: Vec<Vec<f32>>,
    /// Colour pictures only, per light: grey value of the planes.
    grey: Vec<Vec<f32>>,
    /// Per photosite: 1 / mean gain; empty where no light has a gain map.
    noise_scale: Vec<f32>,
    /// Per photosite: at least one sample clipped.
    pub(crate) saturated: Vec<bool>,
    /// Per light with several exposures: bit e set where exposure e counts. Empty for the others.
    pub(crate) used: Vec<Vec<u64>>,
    ambient: Vec<Vec<f32>>,
    gain: Vec<f32>,
    one: Vec<Vec<f32>>,
    total_weight: Vec<f32>,
}

impl<'a> Normalizer<'a> {
    /// `weights`: per light and exposure, the share in the mean.
    pub(crate) fn new(of: &Photographs<'a>, weights: &[Vec<f64>]) -> Self {
        let channels = of.layout.channels();
        let frame_px = of.size_px;
        let lights = of.lights.iter().zip(weights).map(|(light, weights)| {
            let intensity = light.calibrated.light.intensity();
            let places = |channel| intensity_of_places(of.layout, channel, intensity);
            let exposures = light.exposures.iter().zip(weights);
            LightPlan {
                exposures: exposures
                    .map(|(e, &weight)| exposure_plan(of, e, &places, weight))
                    .collect(),
                per_intensity: (0..channels).map(|c| places(c).map(|i| (1.0 / i) as f32)).collect(),
                gain: light.calibrated.gain_map.as_ref().map(|map| GainRows::new(map, frame_px)),
            }
        });
        Self {
            layout: of.layout,
            channels,
            lights: lights.collect(),
            ambient: ambient_plan(of),
            defects: of.defects,
            frame_px,
        }
    }

    /// Fills `rows` with columns `columns` (from an even one on) of row `y`.
    pub(crate) fn row(&self, y: usize, columns: Range<usize>, rows: &mut SignalRows) {
        rows.resize(self, columns.len());
        self.ambient_row(y, columns.clone(), rows);
        for (light, plan) in self.lights.iter().enumerate() {
            self.light_row(light, plan, y, columns.clone(), rows);
        }
        self.divide_by_gain(y, columns.clone(), rows);
        self.leave_out_defects(y, columns, rows);
        if self.layout == Layout::Rgb {
            rows.mix_grey();
        }
    }

    fn ambient_row(&self, y: usize, columns: Range<usize>, rows: &mut SignalRows) {
        let SignalRows { ambient, one, .. } = rows;
        for (channel, rate) in ambient.iter_mut().enumerate() {
            rate.fill(0.0);
            for (reading, factor) in &self.ambient {
                reading.row(y, channel, columns.clone(), *factor, &mut one[channel]);
                rate.iter_mut().zip(&one[channel]).for_each(|(rate, value)| *rate += value);
            }
        }
    }

    fn light_row(
        &self,
        light: usize,
        plan: &LightPlan,
        y: usize,
        columns: Range<usize>,
        rows: &mut SignalRows,
    ) {
        let own = light * self.channels..(light + 1) * self.channels;
        match plan.exposures.as_slice() {
            [only] => self.single_exposure(only, y, columns, own.clone(), rows),
            several => self.merge_exposures(light, several, y, columns, rows),
        }
        if self.ambient.is_empty() {
            return;
        }
        let SignalRows { planes, ambient, .. } = rows;
        for ((plane, rate), factor) in
            planes[own].iter_mut().zip(ambient.iter()).zip(&plan.per_intensity)
        {
            let factor = [factor[(y & 1) * 2], factor[(y & 1) * 2 + 1]];
            for (column, (value, rate)) in plane.iter_mut().zip(rate).enumerate() {
                *value -= rate * factor[column & 1];
            }
        }
    }

    fn single_exposure(
        &self,
        plan: &ExposurePlan,
        y: usize,
        columns: Range<usize>,
        own: Range<usize>,
        rows: &mut SignalRows,
    ) {
        let mut clipped = false;
        for (channel, plane) in rows.planes[own].iter_mut().enumerate() {
            plan.reading.row(y, channel, columns.clone(), plan.factor[channel], plane);
            clipped |= plane.iter().fold(false, |any, value| any | value.is_nan());
        }
        if clipped {
            plan.reading.mark_saturated(y, columns, &mut rows.saturated);
        }
    }

    /// Weighted mean of the exposures that do not clip. A colour pixel counts only where no channel clips.
    fn merge_exposures(
        &self,
        light: usize,
        plans: &[ExposurePlan],
        y: usize,
        columns: Range<usize>,
        rows: &mut SignalRows,
    ) {
        let SignalRows { planes, saturated, used, one, total_weight, .. } = rows;
        let planes = &mut planes[light * self.channels..(light + 1) * self.channels];
        planes.iter_mut().for_each(|plane| plane.fill(0.0));
        total_weight.fill(0.0);
        used[light].clear();
        used[light].resize(columns.len(), 0);
        for (bit, plan) in plans.iter().enumerate() {
            for (channel, one) in one.iter_mut().enumerate() {
                plan.reading.row(y, channel, columns.clone(), plan.factor[channel], one);
            }
            plan.reading.mark_saturated(y, columns.clone(), saturated);
            for column in 0..columns.len() {
                if one.iter().all(|channel| !channel[column].is_nan()) {
                    used[light][column] |= 1 << bit.min(63);
                    total_weight[column] += plan.weight;
                    planes
                        .iter_mut()
                        .zip(one.iter())
                        .for_each(|(plane, one)| plane[column] += plan.weight * one[column]);
                }
            }
        }
        for plane in planes {
            // 0 / 0, not a number, where every exposure clips.
            plane.iter_mut().zip(total_weight.iter()).for_each(|(value, total)| *value /= total);
        }
    }

    /// A defective photosite measures no light: no sample of it is usable, and that one of them clips says nothing.
    fn leave_out_defects(&self, y: usize, columns: Range<usize>, rows: &mut SignalRows) {
        for column in self.defects.columns(y, columns.start).take_while(|x| *x < columns.end) {
            let at = column - columns.start;
            rows.planes.iter_mut().for_each(|plane| plane[at] = f32::NAN);
            rows.saturated[at] = false;
        }
    }

    fn divide_by_gain(&self, y: usize, columns: Range<usize>, rows: &mut SignalRows) {
        if self.lights.iter().all(|light| light.gain.is_none()) {
            rows.noise_scale.clear();
            return;
        }
        let SignalRows { planes, gain, noise_scale, .. } = rows;
        noise_scale.clear();
        noise_scale.resize(columns.len(), 0.0);
        let channels_of_row = |channel: usize| match self.layout {
            Layout::Mosaic(cfa) => [cfa.channel(0, y) as usize, cfa.channel(1, y) as usize],
            Layout::Grey => [1, 1],
            Layout::Rgb => [channel, channel],
        };
        for (light, planes) in self.lights.iter().zip(planes.chunks_exact_mut(self.channels)) {
            for (channel, plane) in planes.iter_mut().enumerate() {
                match &light.gain {
                    Some(map) => map.row(y, columns.clone(), channels_of_row(channel), gain),
                    None => gain.fill(1.0),
                }
                for ((value, gain), sum) in
                    plane.iter_mut().zip(gain.iter()).zip(noise_scale.iter_mut())
                {
                    *sum += gain;
                    *value = if *gain > 0.0 { *value / gain } else { f32::NAN };
                }
            }
        }
        let count = (self.lights.len() * self.channels) as f32;
        noise_scale.iter_mut().for_each(|sum| *sum = if *sum > 0.0 { count / *sum } else { 1.0 });
    }

    /// Mean ambient light over the frame, fraction of full scale per second at ISO 100; 0 without ambient frames.
    pub(crate) fn mean_ambient_rate(&self) -> f64 {
        if self.ambient.is_empty() {
            return 0.0;
        }
        let (width, height) = self.frame_px;
        // Sums of rows, added in order: the same whatever the number of threads.
        let of_rows: Vec<(f64, f64)> = (0..height)
            .into_par_iter()
            .map_init(SignalRows::default, |rows, y| {
                rows.resize(self, width);
                self.ambient_row(y, 0..width, rows);
                let rates = rows.ambient.iter().flatten().filter(|rate| rate.is_finite());
                rates.fold((0.0, 0.0), |(sum, count), &rate| (sum + f64::from(rate), count + 1.0))
            })
            .collect();
        let (sum, count) =
            of_rows.iter().fold((0.0, 0.0), |(sum, count), (s, n)| (sum + s, count + n));
        if count > 0.0 { sum / count } else { 0.0 }
    }
}

fn exposure_plan<'a>(
    of: &Photographs,
    exposure: &'a Exposure,
    places: &impl Fn(usize) -> [f64; 4],
    weight: f64,
) -> ExposurePlan<'a> {
    let seconds = exposure.seconds_at_iso_100();
    let factor = |channel| places(channel).map(|intensity| (1.0 / (seconds * intensity)) as f32);
    ExposurePlan {
        reading: Reading::new(&exposure.frame, of.color),
        factor: (0..of.layout.channels()).map(factor).collect(),
        weight: weight as f32,
    }
}

fn ambient_plan<'a>(of: &Photographs<'a>) -> Vec<(Reading<'a>, [f32; 4])> {
    let seconds: f64 = of.ambient.iter().map(Exposure::seconds_at_iso_100).sum();
    let factor = [(1.0 / seconds) as f32; 4];
    of.ambient.iter().map(|exposure| (Reading::new(&exposure.frame, of.color), factor)).collect()
}

impl SignalRows {
    fn resize(&mut self, plan: &Normalizer, columns: usize) {
        let fit = |rows: &mut Vec<Vec<f32>>, count: usize| {
            rows.resize(count, vec![]);
            rows.iter_mut().for_each(|row| row.resize(columns, 0.0));
        };
        let lights = plan.lights.len();
        fit(&mut self.planes, lights * plan.channels);
        fit(&mut self.one, plan.channels);
        fit(&mut self.ambient, if plan.ambient.is_empty() { 0 } else { plan.channels });
        fit(&mut self.grey, if plan.layout == Layout::Rgb { lights } else { 0 });
        self.gain.resize(columns, 1.0);
        self.total_weight.resize(columns, 0.0);
        self.used.resize(lights, vec![]);
        self.saturated.clear();
        self.saturated.resize(columns, false);
    }

    fn mix_grey(&mut self) {
        for (grey, planes) in self.grey.iter_mut().zip(self.planes.chunks_exact(3)) {
            for (column, grey) in grey.iter_mut().enumerate() {
                *grey = (0..3).map(|channel| GREY[channel] * planes[channel][column]).sum();
            }
        }
    }

    /// What the kernels fit: one row a light.
    pub(crate) fn signals(&self) -> &[Vec<f32>] {
        if self.grey.is_empty() { &self.planes } else { &self.grey }
    }

    /// Per photosite: 1 / mean gain, where any light has a gain map.
    pub(crate) fn noise_scale(&self) -> Option<&[f32]> {
        (!self.noise_scale.is_empty()).then_some(&self.noise_scale)
    }

    /// Makes photosites outside the mask unusable.
    pub(crate) fn blank(&mut self, inside: &[bool]) {
        let rows = if self.grey.is_empty() { &mut self.planes } else { &mut self.grey };
        for row in rows {
            row.iter_mut()
                .zip(inside)
                .for_each(|(value, &inside)| *value = if inside { *value } else { f32::NAN });
        }
    }
}
