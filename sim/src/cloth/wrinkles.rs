use crate::random::Key;
use std::f64::consts::TAU;

/// Large-scale waves of a cloth that does not lie flat: a few sines of random directions and lengths.
#[derive(Clone, Debug, PartialEq)]
pub struct Wrinkles {
    waves: Vec<Wave>,
}

#[derive(Clone, Debug, PartialEq)]
struct Wave {
    /// Radians per mm along x and y.
    frequency: [f64; 2],
    phase: f64,
    amplitude_mm: f64,
}

const WAVES: u64 = 5;
const SHORTEST_MM: f64 = 28.0;
const LONGEST_MM: f64 = 110.0;

impl Wrinkles {
    /// Waves whose heights stay within `amplitude_mm` of the plane.
    pub fn new(amplitude_mm: f64, seed: u64) -> Self {
        let lengths =
            |k: u64| SHORTEST_MM * (LONGEST_MM / SHORTEST_MM).powf(k as f64 / (WAVES - 1) as f64);
        let total: f64 = (0..WAVES).map(lengths).sum();
        let waves = (0..WAVES).map(|k| {
            let key = Key::new(seed).with(0x3a).with(k);
            let (sin, cos) = (TAU * key.with(0).unit()).sin_cos();
            let length = lengths(k);
            Wave {
                frequency: [TAU / length * cos, TAU / length * sin],
                phase: TAU * key.with(1).unit(),
                // Heights in proportion to lengths: short waves are no steeper than long ones.
                amplitude_mm: amplitude_mm * length / total,
            }
        });
        Self { waves: waves.collect() }
    }

    /// Height in mm and slope at a place.
    pub(crate) fn at(&self, x: f64, y: f64) -> (f64, [f64; 2]) {
        self.waves.iter().fold((0.0, [0.0; 2]), |(height, slope), wave| {
            let (sin, cos) = (wave.frequency[0] * x + wave.frequency[1] * y + wave.phase).sin_cos();
            let steep = wave.amplitude_mm * cos;
            (
                height + wave.amplitude_mm * sin,
                [slope[0] + steep * wave.frequency[0], slope[1] + steep * wave.frequency[1]],
            )
        })
    }

    pub(crate) fn amplitude_mm(&self) -> f64 {
        self.waves.iter().map(|wave| wave.amplitude_mm).sum()
    }

    pub(crate) fn steepest(&self) -> f64 {
        self.waves
            .iter()
            .map(|wave| wave.amplitude_mm * wave.frequency[0].hypot(wave.frequency[1]))
            .sum()
    }
}
