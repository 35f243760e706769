use super::Pair;
use palette::color_difference::Ciede2000;
use palette::white_point::D65;
use palette::{FromColor, Lab, LinSrgb};
use rayon::prelude::*;
use serde::Serialize;

/// Differences between two colour maps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ColorFigures {
    /// Mean CIEDE2000.
    pub mean_de2000: f64,
    /// Root mean square difference of the linear values, over pixels and channels.
    pub rms: f64,
    /// 20 log10(1 / rms); `None` (null in JSON) where the maps are equal.
    pub psnr_db: Option<f64>,
    /// Pixels that counted.
    pub pixels: u64,
}

/// CIEDE2000 between two linear sRGB colours under D65, by way of CIE Lab.
///
/// Sharma, Wu, Dalal, "The CIEDE2000 color-difference formula", Color Research & Application 30(1), 2005.
fn ciede2000(a: [f64; 3], b: [f64; 3]) -> f64 {
    let lab = |[r, g, b]: [f64; 3]| Lab::<D65, f64>::from_color(LinSrgb::new(r, g, b));
    lab(a).difference(lab(b))
}

/// Figures over pixels that have a colour in both maps; `None` of nothing.
pub fn compare_colors(pairs: &[Pair]) -> Option<ColorFigures> {
    if pairs.is_empty() {
        return None;
    }
    let differences: Vec<(f64, f64)> = pairs
        .par_iter()
        .map(|(a, b)| (ciede2000(*a, *b), (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>()))
        .collect();
    let count = differences.len() as f64;
    let rms = (differences.iter().map(|(_, square)| square).sum::<f64>() / (3.0 * count)).sqrt();
    Some(ColorFigures {
        mean_de2000: differences.iter().map(|(difference, _)| difference).sum::<f64>() / count,
        rms,
        psnr_db: (rms > 0.0).then(|| -20.0 * rms.log10()),
        pixels: pairs.len() as u64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// L, a, b of both colours and the difference: table 1 of Sharma, Wu, Dalal 2005.
    const SHARMA: [[f64; 7]; 34] = [
        [50.0, 2.6772, -79.7751, 50.0, 0.0, -82.7485, 2.0425],
        [50.0, 3.1571, -77.2803, 50.0, 0.0, -82.7485, 2.8615],
        [50.0, 2.8361, -74.0200, 50.0, 0.0, -82.7485, 3.4412],
        [50.0, -1.3802, -84.2814, 50.0, 0.0, -82.7485, 1.0000],
        [50.0, -1.1848, -84.8006, 50.0, 0.0, -82.7485, 1.0000],
        [50.0, -0.9009, -85.5211, 50.0, 0.0, -82.7485, 1.0000],
        [50.0, 0.0, 0.0, 50.0, -1.0, 2.0, 2.3669],
        [50.0, -1.0, 2.0, 50.0, 0.0, 0.0, 2.3669],
        [50.0, 2.4900, -0.0010, 50.0, -2.4900, 0.0009, 7.1792],
        [50.0, 2.4900, -0.0010, 50.0, -2.4900, 0.0010, 7.1792],
        [50.0, 2.4900, -0.0010, 50.0, -2.4900, 0.0011, 7.2195],
        [50.0, 2.4900, -0.0010, 50.0, -2.4900, 0.0012, 7.2195],
        [50.0, -0.0010, 2.4900, 50.0, 0.0009, -2.4900, 4.8045],
        [50.0, -0.0010, 2.4900, 50.0, 0.0010, -2.4900, 4.8045],
        [50.0, -0.0010, 2.4900, 50.0, 0.0011, -2.4900, 4.7461],
        [50.0, 2.5, 0.0, 50.0, 0.0, -2.5, 4.3065],
        [50.0, 2.5, 0.0, 73.0, 25.0, -18.0, 27.1492],
        [50.0, 2.5, 0.0, 61.0, -5.0, 29.0, 22.8977],
        [50.0, 2.5, 0.0, 56.0, -27.0, -3.0, 31.9030],
        [50.0, 2.5, 0.0, 58.0, 24.0, 15.0, 19.4535],
        [50.0, 2.5, 0.0, 50.0, 3.1736, 0.5854, 1.0000],
        [50.0, 2.5, 0.0, 50.0, 3.2972, 0.0, 1.0000],
        [50.0, 2.5, 0.0, 50.0, 1.8634, 0.5757, 1.0000],
        [50.0, 2.5, 0.0, 50.0, 3.2592, 0.3350, 1.0000],
        [60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644],
        [63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630],
        [61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731],
        [35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645],
        [22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373],
        [36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146],
        [90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441],
        [90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381],
        [6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377],
        [2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082],
    ];

    #[test]
    fn the_published_pairs() {
        for (k, [l1, a1, b1, l2, a2, b2, expected]) in SHARMA.into_iter().enumerate() {
            let found = Lab::<D65, f64>::new(l1, a1, b1).difference(Lab::new(l2, a2, b2));
            // The table is rounded to four places.
            assert!((found - expected).abs() < 5.1e-5, "pair {}: {found}, not {expected}", k + 1);
        }
    }

    #[test]
    fn srgb_primaries_in_lab() {
        // CIE Lab (D65) of sRGB's primaries and white, as every colour table has them.
        let check = |rgb: [f64; 3], expected: [f64; 3]| {
            let [r, g, b] = rgb;
            let lab = Lab::<D65, f64>::from_color(LinSrgb::new(r, g, b));
            let off = [lab.l - expected[0], lab.a - expected[1], lab.b - expected[2]];
            assert!(off.iter().all(|off| off.abs() < 0.02), "{rgb:?}: {lab:?}");
        };
        check([1.0, 0.0, 0.0], [53.24, 80.09, 67.20]);
        check([0.0, 1.0, 0.0], [87.73, -86.18, 83.18]);
        check([0.0, 0.0, 1.0], [32.30, 79.19, -107.86]);
        check([1.0, 1.0, 1.0], [100.0, 0.0, 0.0]);
    }

    #[test]
    fn figures_of_a_known_set() {
        let pairs = [([0.5; 3], [0.6; 3]), ([0.2; 3], [0.2; 3])];
        let found = compare_colors(&pairs).unwrap();
        assert!((found.rms - 0.1 / 2f64.sqrt()).abs() < 1e-15, "{found:?}");
        assert!((found.psnr_db.unwrap() - 23.010_299_956).abs() < 1e-6, "{found:?}");
        assert!(found.mean_de2000 > 1.0 && found.mean_de2000 < 4.0, "{found:?}");
        let equal = compare_colors(&pairs[1..]).unwrap();
        assert_eq!((equal.mean_de2000, equal.rms, equal.psnr_db), (0.0, 0.0, None));
        // Albedo may exceed 1 and noise may go below 0.
        assert!(
            compare_colors(&[([1.2, -0.01, 0.5], [1.1, 0.0, 0.5])])
                .unwrap()
                .mean_de2000
                .is_finite()
        );
    }
}
