//! How far apart yarns are, from the spectrum of the normals: whether the mosaic can show their colours.

use std::f32::consts::TAU;
use weavelight_calibration::description::Image;

/// Photosites of a run along a row or a column.
const RUN: usize = 128;
/// Runs along each axis that are looked at, at most.
const MOST_RUNS: usize = 400;
/// Fewer say nothing.
const LEAST_RUNS: usize = 8;
/// Longest period looked for, in periods a run.
const LONGEST: usize = 6;
/// A period stands out by this factor from what is around it in the spectrum.
const PROMINENT: f64 = 4.0;
/// A period with less of the power than this share of the strongest one's is an overtone.
const OVERTONE: f64 = 0.3;

/// Distance of the yarns in photosites, of the finer family; `None` where the normals show no period.
///
/// Periods below 2 photosites show as their alias, which is never below 2 either: they too are reported as fine.
pub fn yarn_pitch(normal: &Image<[f32; 3]>, mask: &Image<u8>) -> Option<f64> {
    let along_rows = |run: usize, k: usize| (run, k);
    let along_columns = |run: usize, k: usize| (k, run);
    let rows = pitch_along(normal, mask, [normal.width, normal.height], 0, &along_rows);
    let columns = pitch_along(normal, mask, [normal.height, normal.width], 1, &along_columns);
    match (rows, columns) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

/// `place` gives row and column of the k-th photosite of a line.
fn pitch_along(
    normal: &Image<[f32; 3]>,
    mask: &Image<u8>,
    [length, lines]: [usize; 2],
    axis: usize,
    place: &dyn Fn(usize, usize) -> (usize, usize),
) -> Option<f64> {
    let in_line = length / RUN;
    let every = (lines * in_line).div_ceil(MOST_RUNS).max(1);
    let mut power = vec![0.0f64; RUN / 2];
    let mut runs = 0;
    let waves = Waves::new();
    for run in (0..lines * in_line).step_by(every) {
        let start = run % in_line * RUN;
        let mut values = [0.0f32; RUN];
        let mut whole = true;
        for (k, value) in values.iter_mut().enumerate() {
            let (row, column) = place(run / in_line, start + k);
            let at = row * normal.width + column;
            *value = normal.data[at][axis];
            whole &= mask.data[at] != 0 && value.is_finite();
        }
        if whole {
            waves.add_power(&mut values, &mut power);
            runs += 1;
        }
    }
    if runs < LEAST_RUNS { None } else { strongest(&power) }
}

/// Sines of all phases.
struct Waves {
    sine: [f32; RUN],
}

impl Waves {
    fn new() -> Self {
        Self { sine: std::array::from_fn(|k| (TAU * k as f32 / RUN as f32).sin()) }
    }

    fn add_power(&self, values: &mut [f32; RUN], power: &mut [f64]) {
        let mean = values.iter().sum::<f32>() / RUN as f32;
        for (k, value) in values.iter_mut().enumerate() {
            // Hann's window.
            *value = (*value - mean) * (0.5 - 0.5 * (TAU * (k as f32 + 0.5) / RUN as f32).cos());
        }
        for (frequency, power) in power.iter_mut().enumerate().skip(1) {
            let (mut real, mut imaginary) = (0.0f32, 0.0f32);
            for (k, value) in values.iter().enumerate() {
                let phase = frequency * k;
                real += value * self.sine[(phase + RUN / 4) % RUN];
                imaginary += value * self.sine[phase % RUN];
            }
            *power += f64::from(real * real + imaginary * imaginary);
        }
    }
}

/// Period of the finest peak that is not an overtone.
fn strongest(power: &[f64]) -> Option<f64> {
    let median = |range: std::ops::Range<usize>| {
        let mut values: Vec<f64> = power[range].to_vec();
        values.sort_unstable_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let prominent = |k: usize| {
        let below = median(k.saturating_sub(9).max(1)..k - 3);
        let above =
            if k + 6 < power.len() { median(k + 4..(k + 10).min(power.len())) } else { 0.0 };
        let next = power.get(k + 1).copied().unwrap_or(0.0);
        power[k] >= power[k - 1] && power[k] >= next && power[k] > PROMINENT * below.max(above)
    };
    let peaks: Vec<usize> = (LONGEST..power.len()).filter(|k| prominent(*k)).collect();
    let most = peaks.iter().map(|k| power[*k]).fold(0.0, f64::max);
    let finest = *peaks.iter().rfind(|k| power[**k] >= OVERTONE * most)?;
    Some(RUN as f64 / (finest as f64 + between(power, finest)))
}

/// Where a peak lies between the frequencies, by a parabola through the logs of three powers.
fn between(power: &[f64], k: usize) -> f64 {
    let Some(after) = power.get(k + 1) else { return 0.0 };
    let [a, b, c] = [power[k - 1], power[k], *after].map(|p| p.max(1e-30).ln());
    let bend = a - 2.0 * b + c;
    if bend < -1e-9 { (0.5 * (a - c) / bend).clamp(-0.5, 0.5) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloth(size: [usize; 2], slope: impl Fn(usize, usize) -> [f32; 2]) -> Image<[f32; 3]> {
        let data = (0..size[0] * size[1])
            .map(|k| {
                let [a, b] = slope(k % size[0], k / size[0]);
                let length = (a * a + b * b + 1.0).sqrt();
                [-a / length, -b / length, 1.0 / length]
            })
            .collect();
        Image { width: size[0], height: size[1], data }
    }

    fn noise(state: &mut u64) -> f32 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (*state >> 40) as f32 / 16_777_216.0 - 0.5
    }

    #[test]
    fn the_period_of_a_weave_is_found() {
        let mask = Image { width: 300, height: 280, data: vec![255; 300 * 280] };
        for pitch in [2.1, 2.31, 2.6, 4.0, 5.3, 9.7] {
            let mut state = 5;
            let noise: Vec<f32> = (0..300 * 280).map(|_| 0.2 * noise(&mut state)).collect();
            // Round yarns, whose slopes are a saw with overtones.
            let saw = |k: usize| ((k as f32 + 0.5) / pitch).fract() - 0.5;
            let normal =
                cloth([300, 280], |x, y| [saw(x) + noise[y * 300 + x], 0.4 * saw(y + x / 64)]);
            let found = yarn_pitch(&normal, &mask).unwrap();
            assert!((found / f64::from(pitch) - 1.0).abs() < 0.03, "{pitch}: {found}");
        }
    }

    #[test]
    fn noise_waves_and_holes_have_none() {
        let mask = Image { width: 300, height: 280, data: vec![255; 300 * 280] };
        let mut state = 11;
        let rough: Vec<[f32; 2]> =
            (0..300 * 280).map(|_| [noise(&mut state), noise(&mut state)]).collect();
        let normal = cloth([300, 280], |x, y| rough[y * 300 + x]);
        assert_eq!(yarn_pitch(&normal, &mask), None);
        let normal = cloth([300, 280], |x, y| [(x as f32 / 40.0).sin(), (y as f32 / 30.0).cos()]);
        assert_eq!(yarn_pitch(&normal, &mask), None);
        let woven = cloth([300, 280], |x, y| [(x as f32 * 2.0).sin(), (y as f32 * 2.0).cos()]);
        let mut thin = Image { width: 300, height: 280, data: vec![255; 300 * 280] };
        (0..300 * 280).filter(|k| k % 50 == 0).for_each(|k| thin.data[k] = 0);
        assert!(yarn_pitch(&woven, &mask).is_some());
        let found = yarn_pitch(&woven, &thin);
        assert!(found.is_none_or(|pitch| (pitch - std::f64::consts::PI).abs() < 0.1), "{found:?}");
        let empty = Image { width: 300, height: 280, data: vec![0; 300 * 280] };
        assert_eq!(yarn_pitch(&woven, &empty), None);
        let small = Image { width: 40, height: 30, data: vec![255; 1200] };
        assert_eq!(yarn_pitch(&cloth([40, 30], |_, _| [0.1, 0.2]), &small), None);
    }
}
