//! Where the samples of picture files clip, if that is below the files' full scale: 12 bits of a camera in 16 bits of a file.

use super::{Frame, Samples};
use rayon::prelude::*;

/// The numbers in a set of pictures: how often each occurs, over all frames of integers that other programs wrote.
#[derive(Clone, Debug)]
pub struct Histogram {
    counts: Vec<u64>,
    /// Per frame: its largest number.
    largest: Vec<u16>,
    /// The lowest full scale of the files.
    full_scale: u16,
    /// What the files say, where all say the same.
    significant_bits: Option<u8>,
}

/// A level at which samples clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ceiling {
    /// From this number on samples are clipped.
    pub level: u16,
    /// The files' full scale, which none of them reaches.
    pub full_scale: u16,
    /// Samples at or above the level.
    pub clipped: u64,
}

/// Samples at the largest number before that says anything.
const FEWEST: u64 = 16;
/// Numbers just below the largest whose frequency it is held against.
const NEIGHBOURS: usize = 32;
/// Of these there must be so many, within a quarter of the largest number: pictures of a few flat tones have no tail.
const FEWEST_NEIGHBOURS: usize = 12;
/// How many times as often as its most frequent neighbour the largest number occurs where pictures clip, if it is the largest
/// number of so and so many bits.
const PILE_AT_BITS: u64 = 4;
/// The same for any other number: a process that clips there is rarer, so it takes more.
const PILE_ANYWHERE: u64 = 24;
/// Frames that must share such a largest number.
const FEWEST_FRAMES: usize = 2;

impl Histogram {
    /// Of the frames whose files leave it open where samples clip; `None` where there are none.
    pub fn of<'a>(frames: impl IntoParallelIterator<Item = &'a Frame>) -> Option<Self> {
        frames.into_par_iter().filter_map(Self::of_frame).reduce_with(Self::with)
    }

    /// Of one frame; `None` where its format says where samples clip.
    pub fn of_frame(frame: &Frame) -> Option<Self> {
        let Samples::U16(samples) = &frame.samples else { return None };
        let numbers = &frame.metadata.numbers;
        if !numbers.may_clip_below || samples.is_empty() {
            return None;
        }
        let mut counts = vec![0_u64; 1 << 16];
        samples.iter().for_each(|&sample| counts[usize::from(sample)] += 1);
        let largest = samples.iter().copied().max().unwrap_or(0);
        let full_scale = frame.saturation[0].clamp(0.0, 65_535.0) as u16;
        Some(Self {
            counts,
            largest: vec![largest],
            full_scale,
            significant_bits: numbers.significant_bits,
        })
    }

    /// Both together.
    #[must_use]
    pub fn with(mut self, other: Self) -> Self {
        self.counts.iter_mut().zip(&other.counts).for_each(|(count, more)| *count += more);
        self.largest.extend(other.largest);
        self.full_scale = self.full_scale.min(other.full_scale);
        self.significant_bits =
            self.significant_bits.filter(|bits| other.significant_bits == Some(*bits));
        self
    }

    /// Where the samples clip, if that is below full scale: where the files say so and the samples agree, or where they pile up.
    pub fn ceiling(&self) -> Option<Ceiling> {
        let largest = self.largest.iter().copied().max()?;
        let level = self.stated(largest).or_else(|| self.piled_up(largest))?;
        let clipped = self.counts[usize::from(level)..].iter().sum();
        (level < self.full_scale).then_some(Ceiling { level, full_scale: self.full_scale, clipped })
    }

    /// The files' word. PNG scales samples up to all bits, many cameras' programs leave them where they are.
    fn stated(&self, largest: u16) -> Option<u16> {
        let bits = u32::from(self.significant_bits?);
        let spare = 16 - bits;
        let low = ((1_u32 << bits) - 1) as u16;
        let high = low << spare;
        let scaled = |value: u16| value & !high == 0 || value & !high == value >> bits & !high;
        let all_scaled =
            (0..=largest).all(|value| self.counts[usize::from(value)] == 0 || scaled(value));
        if largest <= low && !(all_scaled && largest > 0) {
            return Some(low);
        }
        (all_scaled && largest > low).then_some(high)
    }

    fn piled_up(&self, largest: u16) -> Option<u16> {
        let pile = self.counts[usize::from(largest)];
        let lowest = largest - largest / 4;
        let below = (lowest..largest).rev().map(|value| self.counts[usize::from(value)]);
        let neighbours: Vec<u64> = below.filter(|&count| count > 0).take(NEIGHBOURS).collect();
        if pile < FEWEST || neighbours.len() < FEWEST_NEIGHBOURS {
            return None;
        }
        let frames = self.largest.iter().filter(|&&other| other == largest).count();
        let wanted = if is_all_ones(largest) {
            PILE_AT_BITS
        } else if frames >= FEWEST_FRAMES {
            PILE_ANYWHERE
        } else {
            return None;
        };
        let most = neighbours.iter().copied().max().unwrap_or(0);
        (pile >= wanted * most).then_some(largest)
    }
}

/// The largest number of 8 to 15 bits, at either end of 16.
fn is_all_ones(value: u16) -> bool {
    let aligned = value >> value.trailing_zeros().min(15);
    let bits = aligned.count_ones();
    let ones = u32::from(aligned) == (1_u32 << bits) - 1;
    ones && (8..16).contains(&bits) && (aligned == value || value.leading_zeros() == 0)
}

impl Ceiling {
    /// A sentence for the user.
    pub fn sentence(&self) -> String {
        let Self { level, full_scale, clipped } = self;
        let bits = u32::from(*level) + 1;
        let of = if bits.is_power_of_two() {
            format!(" ({} bits in a file of more)", bits.ilog2())
        } else {
            String::new()
        };
        format!(
            "The pictures clip at {level}{of}, not at {full_scale}: {clipped} samples from {level} on are left out as clipped."
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raw::{Layout, Metadata, Numbers};

    fn frame(samples: Vec<u16>, bits: Option<u8>) -> Frame {
        let numbers =
            Numbers { may_clip_below: true, significant_bits: bits, ..Numbers::default() };
        Frame {
            width: samples.len(),
            height: 1,
            layout: Layout::Grey,
            samples: Samples::U16(samples),
            black: [0.0; 4],
            saturation: [65_535.0; 4],
            metadata: Metadata { numbers, ..Metadata::default() },
        }
    }

    /// A smooth object: brightness like the cosine over a sphere, up to `peak`, with a little noise.
    fn sphere(peak: f64) -> Vec<f64> {
        (0..40_000)
            .map(|k| {
                let (x, y) = (f64::from(k % 200) / 100.0 - 1.0, f64::from(k / 200) / 100.0 - 1.0);
                let cosine = (1.0 - x * x - y * y).max(0.0).sqrt();
                let noise = f64::from((k * 7919 + 13) % 101) / 101.0 - 0.5;
                peak * cosine + 6.0 * noise * cosine
            })
            .collect()
    }

    fn shot(peak: f64, step: f64, most: f64) -> Frame {
        frame(
            sphere(peak)
                .iter()
                .map(|v| ((v / step).floor() * step).clamp(0.0, most) as u16)
                .collect(),
            None,
        )
    }

    fn check(frames: &[Frame], expected: Option<u16>) {
        let found = Histogram::of(frames).and_then(|histogram| histogram.ceiling());
        assert_eq!(found.map(|ceiling| ceiling.level), expected, "{found:?}");
    }

    #[test]
    fn a_pile_at_the_top_is_a_ceiling() {
        // 12, 10 and 14 bits, at the lower and the upper end of 16.
        check(&[shot(4500.0, 1.0, 4095.0), shot(3000.0, 1.0, 4095.0)], Some(4095));
        check(&[shot(1040.0, 1.0, 1023.0), shot(900.0, 1.0, 1023.0)], Some(1023));
        check(&[shot(70_000.0, 16.0, 65_520.0), shot(60_000.0, 16.0, 65_520.0)], Some(65_520));
        check(&[shot(17_000.0, 1.0, 16_383.0)], Some(16_383));
        // A converter that clips somewhere else, in two frames.
        let odd = [shot(16_000.0, 1.0, 15_311.0), shot(17_000.0, 1.0, 15_311.0)];
        check(&odd, Some(15_311));
        let sentence = Histogram::of(&odd[..]).unwrap().ceiling().unwrap().sentence();
        assert!(sentence.starts_with("The pictures clip at 15311, not at 65535: "), "{sentence}");
    }

    #[test]
    fn a_largest_number_alone_is_none() {
        check(&[shot(4000.0, 1.0, 65_535.0), shot(3000.0, 1.0, 65_535.0)], None);
        check(&[shot(4092.0, 1.0, 4095.0), shot(4092.0, 1.0, 4095.0)], None);
        check(&[shot(30_000.0, 1.0, 65_535.0), shot(30_000.0, 1.0, 65_535.0)], None);
        // Clipped at full scale, which the format says.
        check(&[shot(80_000.0, 1.0, 65_535.0)], None);
        // One frame that ends at an odd number may show a flat bright patch.
        check(&[shot(16_000.0, 1.0, 15_311.0), shot(9_000.0, 1.0, 65_535.0)], None);
        // Flat tones: synthetic pictures, black frames, 8 bits stretched to 16.
        check(&[frame(vec![30_000; 5000], None), frame(vec![30_000; 5000], None)], None);
        check(&[frame((0..40_000).map(|k| k % 10 * 400).collect(), None)], None);
        check(&[frame(vec![0; 100], None)], None);
        check(&[shot(20_000.0, 257.0, 65_535.0), shot(20_000.0, 257.0, 65_535.0)], None);
    }

    #[test]
    fn what_the_file_says_counts_where_the_samples_agree() {
        check(&[frame(vec![0, 17, 40_000], Some(12))], None);
        check(&[frame(vec![0, 17, 3811], Some(12))], Some(4095));
        // Scaled up to 16 bits, with zeros or with the high bits repeated.
        check(&[frame(vec![0, 16, 40_000, 65_520], Some(12))], Some(65_520));
        check(&[frame(vec![0, 0x1231, 0xffff, 0xabca], Some(12))], Some(65_520));
        check(&[frame(vec![0, 17, 3811], Some(12)), frame(vec![0, 17, 3811], None)], None);
    }

    #[test]
    fn a_raw_file_says_where_it_clips() {
        let mut raw = shot(4500.0, 1.0, 4095.0);
        raw.metadata.numbers = Numbers::default();
        check(&[raw], None);
    }
}
