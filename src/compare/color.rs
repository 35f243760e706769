use super::{Pair, percentile};
use palette::color_difference::Ciede2000;
use palette::white_point::D65;
use palette::{FromColor, Lab, LinSrgb};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;

/// Differences between two colour maps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ColorFigures {
    /// Mean CIEDE2000.
    pub mean_de2000: f64,
    /// CIEDE2000 below which 95 % of the pixels lie.
    pub p95_de2000: f64,
    /// Mean CIEDE2000 between means over 4 x 4 pixels, which is what an eye sees of fine patterns; `None` (null in JSON) where
    /// no block has a value in at least half of its pixels.
    pub mean_de2000_4x4: Option<f64>,
    /// False colour: standard deviation of the error of a* and b* together. An error that is the same everywhere is none.
    pub false_color: f64,
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
    lab(a).difference(lab(b))
}

fn lab([r, g, b]: [f64; 3]) -> Lab<D65, f64> {
    Lab::from_color(LinSrgb::new(r, g, b))
}

/// Pixels that have a colour in both maps, and where they are.
#[derive(Clone, Debug, Default)]
pub struct ColorPairs {
    /// Pixels in a row of the maps.
    pub width: usize,
    /// Place of each, row-major, ascending.
    pub places: Vec<usize>,
    /// Their colours.
    pub pairs: Vec<Pair>,
}

/// Side of the blocks whose means are compared.
const BLOCK: usize = 4;

/// Mean difference between the blocks' mean colours.
fn mean_of_blocks(pixels: &ColorPairs) -> Option<f64> {
    let columns = pixels.width.div_ceil(BLOCK).max(1);
    let mut blocks: BTreeMap<usize, ([f64; 6], f64)> = BTreeMap::new();
    for (place, (a, b)) in pixels.places.iter().zip(&pixels.pairs) {
        let (x, y) = (place % pixels.width.max(1), place / pixels.width.max(1));
        let (sum, count) = blocks.entry(y / BLOCK * columns + x / BLOCK).or_default();
        sum.iter_mut().zip(a.iter().chain(b)).for_each(|(sum, value)| *sum += value);
        *count += 1.0;
    }
    let half = (BLOCK * BLOCK / 2) as f64;
    let of_block = |([r, g, b, s, t, u], count): &([f64; 6], f64)| {
        ciede2000([r / count, g / count, b / count], [s / count, t / count, u / count])
    };
    let found: Vec<f64> =
        blocks.values().filter(|(_, count)| *count >= half).map(of_block).collect();
    (!found.is_empty()).then(|| found.iter().sum::<f64>() / found.len() as f64)
}

/// Figures over pixels that have a colour in both maps; `None` of nothing.
pub fn compare_colors(pixels: &ColorPairs) -> Option<ColorFigures> {
    let pairs = &pixels.pairs;
    if pairs.is_empty() {
        return None;
    }
    let differences: Vec<[f64; 4]> = pairs
        .par_iter()
        .map(|(a, b)| {
            let square = (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>();
            let (lab_a, lab_b) = (lab(*a), lab(*b));
            [lab_a.difference(lab_b), square, lab_a.a - lab_b.a, lab_a.b - lab_b.b]
        })
        .collect();
    let count = differences.len() as f64;
    let mean = |k: usize| differences.iter().map(|d| d[k]).sum::<f64>() / count;
    let rms = (mean(1) / 3.0).sqrt();
    let variance = |k: usize| {
        let middle = mean(k);
        differences.iter().map(|d| (d[k] - middle).powi(2)).sum::<f64>() / count
    };
    let mut sorted: Vec<f64> = differences.iter().map(|d| d[0]).collect();
    sorted.par_sort_unstable_by(f64::total_cmp);
    Some(ColorFigures {
        mean_de2000: mean(0),
        p95_de2000: percentile(&sorted, 0.95)?,
        mean_de2000_4x4: mean_of_blocks(pixels),
        false_color: (variance(2) + variance(3)).sqrt(),
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
        let of = |pairs: &[Pair]| {
            let places = (0..pairs.len()).collect();
            compare_colors(&ColorPairs { width: 8, places, pairs: pairs.to_vec() })
        };
        let found = of(&pairs).unwrap();
        assert!((found.rms - 0.1 / 2f64.sqrt()).abs() < 1e-15, "{found:?}");
        assert!((found.psnr_db.unwrap() - 23.010_299_956).abs() < 1e-6, "{found:?}");
        assert!(found.mean_de2000 > 1.0 && found.mean_de2000 < 4.0, "{found:?}");
        let equal = of(&pairs[1..]).unwrap();
        assert_eq!((equal.mean_de2000, equal.rms, equal.psnr_db), (0.0, 0.0, None));
        // Albedo may exceed 1 and noise may go below 0.
        assert!(of(&[([1.2, -0.01, 0.5], [1.1, 0.0, 0.5])]).unwrap().mean_de2000.is_finite());
    }

    #[test]
    fn patterns_finer_than_a_block_and_false_colours_have_figures_of_their_own() {
        let grey = [0.4; 3];
        let chequered = |k: usize| (k % 16 + k / 16).is_multiple_of(2);
        let check = |colour: &dyn Fn(usize) -> [f64; 3]| {
            let pairs = (0..256).map(|k| (colour(k), grey)).collect();
            let pixels = ColorPairs { width: 16, places: (0..256).collect(), pairs };
            compare_colors(&pixels).unwrap()
        };
        let light = check(&|k| if chequered(k) { [0.5; 3] } else { [0.3; 3] });
        assert!(light.mean_de2000 > 5.0 && light.mean_de2000_4x4.unwrap() < 1e-9, "{light:?}");
        assert!(light.false_color < 1e-2, "{light:?}");
        let tinted = check(&|k| if chequered(k) { [0.45, 0.4, 0.4] } else { [0.35, 0.4, 0.4] });
        assert!((3.0..4.5).contains(&tinted.false_color), "{tinted:?}");
        let even = check(&|_| [0.45, 0.4, 0.4]);
        assert!(even.false_color < 1e-9 && even.mean_de2000 > 3.0, "{even:?}");
        assert_eq!(
            even.mean_de2000_4x4.map(|d| (d * 1e9).round()),
            Some((even.mean_de2000 * 1e9).round())
        );
        assert!((even.p95_de2000 - even.mean_de2000).abs() < 1e-9);
        // A block of which less than half counts is left out.
        let few = ColorPairs { width: 16, places: vec![0, 1], pairs: vec![(grey, grey); 2] };
        assert_eq!(compare_colors(&few).unwrap().mean_de2000_4x4, None);
    }
}
