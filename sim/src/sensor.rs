//! Photons to raw numbers.

use crate::random::Key;

/// A sensor: 14 bit by default, as the reference camera's.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Raw number of no light, row-major 2 x 2 from the top left.
    pub black: [u16; 4],
    /// Raw number at which the analogue-to-digital converter ends.
    pub saturation: u16,
    /// Electrons at `saturation`.
    pub full_well_e: f64,
    /// Standard deviation of reading, electrons.
    pub read_noise_e: f64,
    /// Relative standard deviation of the photosites' sensitivities.
    pub prnu: f64,
    /// Bend of the response: light = (1 - b) x + b x^2 with x = (raw - black) / (saturation - black).
    pub bend: f64,
    /// Share of photosites that are stuck: half at black, half at saturation.
    pub defects: f64,
    /// Whether photons and reading scatter; without, the sensor only quantises (for tests).
    pub noise: Noise,
    /// Which piece of silicon this is.
    pub seed: u64,
}

/// Whether a sensor scatters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Noise {
    /// Photons, reading, sensitivities.
    On,
    /// Only quantisation.
    Off,
}

/// Below this mean number of electrons photons are counted, above their scatter is Gaussian.
const COUNTED_E: f32 = 24.0;

/// What is fixed about a photosite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Photosite {
    /// Relative sensitivity.
    Works(f32),
    /// Always this raw number.
    Stuck(u16),
}

impl Default for Sensor {
    fn default() -> Self {
        Self {
            black: [600; 4],
            saturation: 16383,
            full_well_e: 40_000.0,
            read_noise_e: 4.0,
            prnu: 0.005,
            bend: 0.0,
            defects: 0.0,
            noise: Noise::On,
            seed: 0,
        }
    }
}

impl Sensor {
    /// Electrons per raw number, green photosites.
    pub fn electrons_per_dn(&self) -> f64 {
        self.full_well_e / f64::from(self.saturation - self.black[1])
    }

    /// What is fixed about the photosite at an index of the frame.
    pub(crate) fn photosite(&self, index: usize, cell: usize) -> Photosite {
        let key = Key::new(self.seed).with(0x517e).with(index as u64);
        if self.defects > 0.0 {
            let lot = key.with(1).unit();
            if lot < self.defects {
                return Photosite::Stuck(if lot < 0.5 * self.defects {
                    self.black[cell]
                } else {
                    self.saturation
                });
            }
        }
        match self.noise {
            Noise::On => Photosite::Works(1.0 + self.prnu as f32 * key.gaussian()),
            Noise::Off => Photosite::Works(1.0),
        }
    }

    /// The raw number of one reading. `light`: expected signal as a fraction of the range from black to saturation;
    /// `key`: of the frame and the photosite.
    #[inline]
    pub(crate) fn read(&self, photosite: Photosite, cell: usize, light: f32, key: Key) -> u16 {
        let sensitivity = match photosite {
            Photosite::Works(sensitivity) => sensitivity,
            Photosite::Stuck(number) => return number,
        };
        let full_well = self.full_well_e as f32;
        let mean = light * sensitivity * full_well;
        let electrons = match self.noise {
            Noise::On => self.scatter(mean, key),
            Noise::Off => mean,
        };
        let x = self.unbend(electrons / full_well);
        let range = f32::from(self.saturation - self.black[cell]);
        let number = f32::from(self.black[cell]) + x * range;
        // Rounded half up; a cast truncates, and `round` is a call where the processor's own instruction may be missing.
        (number.clamp(0.0, f32::from(self.saturation)) + 0.5) as u16
    }

    /// Photons are Poisson; reading is Gaussian.
    #[inline]
    fn scatter(&self, mean: f32, key: Key) -> f32 {
        let read = self.read_noise_e as f32;
        if mean >= COUNTED_E {
            return mean + (mean + read * read).sqrt() * key.gaussian();
        }
        count(mean, key.with(1)) + read * key.gaussian()
    }

    /// Raw x whose light is `light`: solves (1 - b) x + b x^2 = light.
    #[inline]
    fn unbend(&self, light: f32) -> f32 {
        if self.bend == 0.0 {
            return light;
        }
        let (b, one_b) = (self.bend as f32, 1.0 - self.bend as f32);
        let root = (one_b * one_b + 4.0 * b * light).max(0.0).sqrt();
        // The form without cancellation: exact for b near 0 and for negative light.
        2.0 * light / (one_b + root)
    }
}

/// A Poisson count by inversion of its distribution (Devroye, "Non-uniform random variate generation", 1986, X.3.3).
fn count(mean: f32, key: Key) -> f32 {
    if mean <= 0.0 {
        return 0.0;
    }
    let mean = f64::from(mean);
    let lot = key.unit();
    let (mut probability, mut k) = ((-mean).exp(), 0.0);
    let mut sum = probability;
    while lot > sum && k < 200.0 {
        k += 1.0;
        probability *= mean / k;
        sum += probability;
    }
    k as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean and variance of the readings of one photosite, in electrons.
    fn statistics(sensor: &Sensor, mean_e: f64) -> (f64, f64) {
        let n = 200_000u64;
        let gain = sensor.electrons_per_dn();
        let light = (mean_e / sensor.full_well_e) as f32;
        let readings: Vec<f64> = (0..n)
            .map(|i| sensor.read(Photosite::Works(1.0), 0, light, Key::new(9).with(i)))
            .map(|number| (f64::from(number) - f64::from(sensor.black[0])) * gain)
            .collect();
        let mean = readings.iter().sum::<f64>() / n as f64;
        (mean, readings.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1) as f64)
    }

    #[test]
    fn photons_scatter_as_they_must() {
        let sensor = Sensor::default();
        for mean_e in [0.0, 1.0, 5.0, 20.0, 23.9, 24.1, 100.0, 3000.0, 20_000.0] {
            let (mean, variance) = statistics(&sensor, mean_e);
            let expected =
                mean_e + sensor.read_noise_e.powi(2) + sensor.electrons_per_dn().powi(2) / 12.0;
            let standard_error = (expected / 200_000.0).sqrt();
            assert!((mean - mean_e).abs() < 5.0 * standard_error, "{mean_e}: mean {mean}");
            assert!(
                (variance / expected - 1.0).abs() < 0.03,
                "{mean_e}: variance {variance}, expected {expected}"
            );
        }
    }

    #[test]
    fn counts_are_poisson() {
        let n = 300_000u64;
        let counts: Vec<f64> = (0..n).map(|i| f64::from(count(2.5, Key::new(1).with(i)))).collect();
        for (k, expected) in
            [(0.0, 0.082_085), (1.0, 0.205_212), (2.0, 0.256_516), (7.0, 0.009_941)]
        {
            let share = counts.iter().filter(|&&c| c == k).count() as f64 / n as f64;
            assert!((share - expected).abs() < 5.0 * (expected / n as f64).sqrt(), "{k}: {share}");
        }
    }

    #[test]
    fn it_clips_and_bends() {
        let mut sensor = Sensor { noise: Noise::Off, ..Sensor::default() };
        let read =
            |sensor: &Sensor, light| sensor.read(Photosite::Works(1.0), 0, light, Key::new(0));
        assert_eq!(
            [read(&sensor, 0.0), read(&sensor, 0.5), read(&sensor, 3.0)],
            [600, 8492, 16383]
        );
        for bend in [-0.02, 0.01, 0.05] {
            sensor.bend = bend;
            for light in [0.0, 0.1, 0.5, 0.9, 1.0] {
                let x = f64::from(read(&sensor, light) - 600) / 15783.0;
                let back = (1.0 - bend) * x + bend * x * x;
                assert!(
                    (back - f64::from(light)).abs() < 1e-4,
                    "bend {bend}: {light} reads as {back}"
                );
            }
        }
    }
}
