//! The sensor's response, black level and noise, from grey patches.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// Mean of one patch under one CFA place at one exposure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Readings with the same number show the same patch through the same filter under the same light.
    pub series: usize,
    /// Exposure time times ISO / 100, seconds.
    pub exposure: f64,
    /// The mean: raw numbers for [`fit_black`]; (raw - black) / (saturation - black) for [`fit_response`].
    pub value: f64,
    /// One sigma of the mean, same unit.
    pub sigma: f64,
}

/// How the sensor's numbers follow the light.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// linear = sum c_i x^i, c_0 = 0, the sum is 1; `[0, 1]` where the sensor is linear within the tolerance.
    pub coefficients: Vec<f64>,
    /// Largest departure from proportionality over the used range, relative to the straight line through black and the top
    /// of the range, of the sensor as measured (before any correction).
    pub deviation: f64,
    /// One sigma of `deviation`.
    pub deviation_sigma: f64,
    /// Lowest and highest x that the patches reached.
    pub range: [f64; 2],
}

/// Departure from proportionality that is not worth a correction.
pub const LINEAR_ENOUGH: f64 = 0.002;

/// Black level: where the readings of every series, taken at several exposures, meet at exposure zero.
///
/// Straight lines by weighted least squares, one slope a series, one common intercept; returns it with its sigma. `None`
/// where no series has two different exposures. Give only dark patches: the response must be straight that far.
pub fn fit_black(readings: &[Reading]) -> Option<[f64; 2]> {
    let (mut weight, mut sum) = (0.0, 0.0);
    for series in by_series(readings) {
        let w = |r: &Reading| r.sigma.powi(-2);
        let tt: f64 = series.iter().map(|r| w(r) * r.exposure * r.exposure).sum();
        let t1: f64 = series.iter().map(|r| w(r) * r.exposure).sum();
        let tv: f64 = series.iter().map(|r| w(r) * r.exposure * r.value).sum();
        // The slope eliminated: what the series says of the intercept alone.
        weight += series.iter().map(w).sum::<f64>() - t1 * t1 / tt;
        sum += series.iter().map(|r| w(r) * r.value).sum::<f64>() - t1 * tv / tt;
    }
    let steepest = readings.iter().map(|r| r.sigma.powi(-2)).sum::<f64>();
    (weight > 1e-9 * steepest && weight.is_finite()).then(|| [sum / weight, weight.sqrt().recip()])
}

/// Fits linear = x + c2 (x^2 - x) + c3 (x^3 - x) so that every series is proportional to its exposure.
///
/// Each series has its own unknown slope, eliminated. The cubic term is kept only where it is worth three sigma, the whole
/// correction only where the departure exceeds [`LINEAR_ENOUGH`] and three of its own sigma. `None` where no series has
/// two usable exposures.
pub fn fit_response(readings: &[Reading]) -> Option<Response> {
    let usable: Vec<Reading> =
        readings.iter().copied().filter(|r| r.value > 0.0 && r.sigma > 0.0).collect();
    let range = usable
        .iter()
        .fold([f64::INFINITY, 0.0], |[low, high], r| [low.min(r.value), high.max(r.value)]);
    let (normal, right) = normal_equations(&usable)?;
    let quadratic = [right[0] / normal[(0, 0)], 0.0];
    let both = solve_two(&normal, &right);
    let gain = |c: [f64; 2]| c[0] * right[0] + c[1] * right[1];
    let terms = match both {
        Some(both) if gain(both) - gain(quadratic) > 9.0 => both,
        _ => quadratic,
    };
    let deviation = departure(terms, range);
    let deviation_sigma = departure([normal[(0, 0)].sqrt().recip(), 0.0], range).abs();
    let worth = deviation > LINEAR_ENOUGH && deviation > 3.0 * deviation_sigma;
    let coefficients = match (worth, terms) {
        (false, _) => vec![0.0, 1.0],
        (true, [c2, 0.0]) => vec![0.0, 1.0 - c2, c2],
        (true, [c2, c3]) => vec![0.0, 1.0 - c2 - c3, c2, c3],
    };
    Some(Response { coefficients, deviation, deviation_sigma, range })
}

/// Largest relative distance of f(x) / x from its value at the top of the range.
fn departure([c2, c3]: [f64; 2], [low, high]: [f64; 2]) -> f64 {
    let slope = |x: f64| 1.0 + c2 * (x - 1.0) + c3 * (x * x - 1.0);
    let off = |k: i32| (slope(low + (high - low) * f64::from(k) / 50.0) / slope(high) - 1.0).abs();
    (0..=50).map(off).fold(0.0, f64::max)
}

/// How far black may be off, as a share of the range: it is estimated too, and its error is common to all readings.
const BLACK_SIGMA: f64 = 3e-5;

/// Normal equations of (c2, c3); every series' own slope and a common error of black eliminated.
fn normal_equations(readings: &[Reading]) -> Option<(Matrix2<f64>, Vector2<f64>)> {
    let (mut normal, mut right) = (Matrix3::<f64>::zeros(), Vector3::<f64>::zeros());
    normal[(2, 2)] = BLACK_SIGMA.powi(-2);
    for series in by_series(readings) {
        let terms =
            |r: &Reading| [r.value, r.value.powi(2) - r.value, r.value.powi(3) - r.value, 1.0];
        let mut on_t = [0.0; 4];
        let mut tt = 0.0;
        for r in &series {
            let w = r.sigma.powi(-2);
            tt += w * r.exposure * r.exposure;
            terms(r).iter().zip(&mut on_t).for_each(|(term, sum)| *sum += w * r.exposure * term);
        }
        for r in &series {
            let w = r.sigma.powi(-2);
            let free: [f64; 4] = std::array::from_fn(|k| terms(r)[k] - on_t[k] / tt * r.exposure);
            for i in 0..3 {
                right[i] -= w * free[i + 1] * free[0];
                for j in 0..3 {
                    normal[(i, j)] += w * free[i + 1] * free[j + 1];
                }
            }
        }
    }
    let black = normal.fixed_view::<2, 1>(0, 2) / normal[(2, 2)];
    let left = normal.fixed_view::<2, 2>(0, 0) - black * normal.fixed_view::<1, 2>(2, 0);
    let right = right.xy() - black * right.z;
    (left[(0, 0)] > 0.0 && left[(0, 0)].is_finite()).then_some((left, right))
}

fn solve_two(normal: &Matrix2<f64>, right: &Vector2<f64>) -> Option<[f64; 2]> {
    let correlated = normal[(0, 1)].powi(2) / (normal[(0, 0)] * normal[(1, 1)]);
    let solution = (correlated < 0.9999).then(|| normal.try_inverse())?? * right;
    Some([solution[0], solution[1]])
}

fn by_series(readings: &[Reading]) -> Vec<Vec<Reading>> {
    let most = readings.iter().map(|r| r.series).max().map_or(0, |most| most + 1);
    let mut series = vec![Vec::new(); most];
    readings.iter().for_each(|r| series[r.series].push(*r));
    series.retain(|s| s.iter().any(|r| r.exposure != s[0].exposure));
    series
}

/// Gain, read noise and pixel non-uniformity of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorNoise {
    /// Electrons per raw number.
    pub electrons_per_dn: f64,
    /// Read noise, electrons; quantisation (1/12 raw number squared) is not part of it.
    pub read_noise_e: f64,
    /// Relative spread of the photosites' sensitivities.
    pub nonuniformity: f64,
}

/// Mean above black and variance of one patch, raw numbers, and how many samples the variance rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Variance.
    pub variance: f64,
    /// Samples.
    pub count: f64,
}

/// The photon-transfer curve: variance = floor + mean / gain + (nonuniformity mean)^2, by reweighted least squares.
///
/// Janesick, "Photon Transfer", SPIE 2007. `None` where the patches span too little to tell.
pub fn fit_noise(spreads: &[Spread]) -> Option<SensorNoise> {
    let mut model = Vector3::new(0.0, 0.0, 0.0);
    for round in 0..6 {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for s in spreads.iter().filter(|s| s.count > 10.0 && s.variance > 0.0 && s.mean.is_finite())
        {
            let row = Vector3::new(1.0, s.mean.max(0.0), s.mean.powi(2));
            let expected = if round == 0 { s.variance } else { row.dot(&model).max(1e-3) };
            let weight = s.count / (2.0 * expected * expected);
            normal += row * row.transpose() * weight;
            right += row * (weight * s.variance);
        }
        // Columns of very different size: solve in units of their own.
        let scale = Vector3::from_fn(|k, _| normal[(k, k)].sqrt().recip());
        let scaled = Matrix3::from_fn(|i, j| normal[(i, j)] * scale[i] * scale[j]);
        model = (scaled.try_inverse()? * right.component_mul(&scale)).component_mul(&scale);
        model[2] = model[2].max(0.0);
    }
    let electrons_per_dn = model[1].recip();
    let read_dn2 = (model[0] - 1.0 / 12.0).max(0.0);
    let good = electrons_per_dn.is_finite() && electrons_per_dn > 0.0;
    good.then(|| SensorNoise {
        electrons_per_dn,
        read_noise_e: read_dn2.sqrt() * electrons_per_dn,
        nonuniformity: model[2].sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Patches of reflectance `levels` at exposures doubling up to 1, x = inverse response of light, exact.
    fn readings(levels: &[f64], x_of: impl Fn(f64) -> f64) -> Vec<Reading> {
        let mut out = Vec::new();
        for (series, level) in levels.iter().enumerate() {
            for k in 0..7 {
                let exposure = 2f64.powi(k - 6);
                out.push(Reading { series, exposure, value: x_of(level * exposure), sigma: 2e-5 });
            }
        }
        out
    }

    /// Inverse of light = (1 - b) x + b x^2.
    fn bent(b: f64) -> impl Fn(f64) -> f64 {
        move |light| {
            if b == 0.0 {
                light
            } else {
                (((1.0 - b).powi(2) + 4.0 * b * light).sqrt() - (1.0 - b)) / (2.0 * b)
            }
        }
    }

    fn check(bend: f64, corrected: bool) {
        let x_of = bent(bend);
        let response = fit_response(&readings(&[0.9, 0.5, 0.1], &x_of)).unwrap();
        assert_eq!(response.coefficients.len() > 2, corrected, "{bend}: {response:?}");
        let linear = |x: f64| response.coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c);
        let top = linear(x_of(0.9)) / 0.9;
        for light in [0.01, 0.1, 0.3, 0.9] {
            let off = linear(x_of(light)) / light / top - 1.0;
            assert!(
                off.abs() < if corrected { 1e-4 } else { 2.1e-3 },
                "bend {bend}, light {light}: {off}"
            );
        }
    }

    #[test]
    fn a_bend_is_found_and_taken_out_where_it_matters() {
        check(0.0, false);
        check(0.001, false);
        check(0.01, true);
        check(-0.02, true);
        check(0.1, true);
    }

    #[test]
    fn one_exposure_says_nothing() {
        let one = [Reading { series: 0, exposure: 1.0, value: 0.5, sigma: 1e-4 }; 3];
        assert_eq!(fit_response(&one), None);
        assert_eq!(fit_black(&one), None);
        assert_eq!(fit_black(&[]), None);
    }

    #[test]
    fn black_is_where_the_exposures_meet() {
        let mut all = readings(&[200.0, 900.0], |light| 600.25 + light);
        all.iter_mut().for_each(|r| r.sigma = 0.1);
        let [black, sigma] = fit_black(&all).unwrap();
        assert!((black - 600.25).abs() < 1e-9 && sigma < 0.1, "{black} {sigma}");
    }

    #[test]
    fn the_photon_transfer_curve_gives_gain_read_noise_and_nonuniformity() {
        let (gain, read, prnu) = (2.6, 4.0, 0.005);
        let spread = |mean: f64| Spread {
            mean,
            variance: (mean * gain + read * read) / (gain * gain)
                + 1.0 / 12.0
                + (prnu * mean).powi(2),
            count: 5000.0,
        };
        let noise = fit_noise(&[0.0, 30.0, 200.0, 1000.0, 4000.0, 9000.0].map(spread)).unwrap();
        assert!((noise.electrons_per_dn / gain - 1.0).abs() < 1e-6, "{noise:?}");
        assert!((noise.read_noise_e - read).abs() < 1e-3, "{noise:?}");
        assert!((noise.nonuniformity - prnu).abs() < 1e-6, "{noise:?}");
        assert_eq!(fit_noise(&[spread(100.0)]), None);
    }
}
