//! The whole room on woven cloth that is made here: known colours, known relief.

use super::*;
use weavelight_calibration::description::{Cfa, Image};

/// Steps along each side of a photosite.
const FINE: usize = 4;

struct Cloth {
    mosaic: Image<f32>,
    normal: Image<[f32; 3]>,
    mask: Image<u8>,
    truth: Image<[f32; 3]>,
    cfa: Cfa,
}

impl Cloth {
    /// Plain weave of round yarns, `pitch_px` apart; warp and weft of two dyes. A photosite's value is its mean dye times the
    /// length of its mean normal, as without shadows.
    fn woven(size: [usize; 2], pitch_px: f64, dyes: [[f64; 3]; 2], cfa: Cfa) -> Self {
        let [width, height] = size;
        let at = |u: f64, v: f64| {
            let (a, b) = (u / pitch_px, v / pitch_px * 0.97);
            let warp = (a.floor() + b.floor()) as i64 % 2 == 0;
            let (across, along) = if warp { (a, b) } else { (b, a) };
            // The weft lies straighter, as in most cloth: relief then tells the yarns apart.
            let (steep, bent) = if warp { (1.4, 1.1) } else { (1.0, 0.3) };
            let round = steep * (across.fract() - 0.5);
            let crimp = bent * (along.fract() - 0.5);
            let (n_u, n_v) = if warp { (round, crimp) } else { (crimp, round) };
            let length = (n_u * n_u + n_v * n_v + 1.0_f64).sqrt();
            ([n_u / length, -n_v / length, 1.0 / length], dyes[usize::from(!warp)])
        };
        let mut cloth = Self {
            mosaic: Image::filled(width, height, 0.0),
            normal: Image::filled(width, height, [0.0; 3]),
            mask: Image::filled(width, height, 255),
            truth: Image::filled(width, height, [0.0; 3]),
            cfa,
        };
        for k in 0..width * height {
            let (mut n, mut dye) = ([0.0; 3], [0.0; 3]);
            for j in 0..FINE * FINE {
                let place = |c: usize, d: usize| c as f64 + (d as f64 + 0.5) / FINE as f64;
                let (normal, colour) = at(place(k % width, j % FINE), place(k / width, j / FINE));
                for c in 0..3 {
                    n[c] += normal[c] / (FINE * FINE) as f64;
                    dye[c] += colour[c] / (FINE * FINE) as f64;
                }
            }
            let length = n.iter().map(|c| c * c).sum::<f64>().sqrt();
            cloth.normal.data[k] = n.map(|c| (c / length) as f32);
            cloth.truth.data[k] = dye.map(|c| c as f32);
            let channel = cfa.channel(k % width, k / width) as usize;
            cloth.mosaic.data[k] = (dye[channel] * length) as f32;
        }
        cloth
    }

    fn linen(size: [usize; 2]) -> Self {
        Self::woven(size, 5.3, [[0.5, 0.42, 0.3]; 2], Cfa::RGGB)
    }

    fn input(&self) -> Input<'_> {
        Input { mosaic: &self.mosaic, cfa: self.cfa, normal: &self.normal, mask: &self.mask }
    }

    fn found(&self) -> Colours {
        find_colours(&self.input()).unwrap()
    }

    /// RMS over what is solved of the log of colour over truth, and of that less its mean over the channels.
    fn errors(&self, colours: &Colours) -> [f64; 2] {
        let (mut all, mut hue, mut count) = (0.0, 0.0, 0.0);
        let pixels = colours.reflectance.data.iter().zip(&self.truth.data).zip(&self.mask.data);
        for ((found, truth), _) in pixels.filter(|(_, mask)| **mask != 0) {
            let off = [0, 1, 2].map(|c| f64::from(found[c].max(2e-3) / truth[c]).ln());
            let mean = off.iter().sum::<f64>() / 3.0;
            all += off.iter().map(|off| off * off).sum::<f64>();
            hue += off.iter().map(|off| (off - mean).powi(2)).sum::<f64>();
            count += 3.0;
        }
        [(all / count).sqrt(), (hue / count).sqrt()]
    }

    /// What interpolation makes of it.
    fn interpolated(&self) -> Colours {
        let mut colours = self.found();
        colours.reflectance = crate::raw::demosaic(&self.mosaic, self.cfa, &|_, _| true);
        colours
    }
}

/// The fast path, in float32 with histograms and tables, against its definitions in float64.
#[test]
fn the_fast_path_agrees_with_float64() {
    let mut cloth = Cloth::woven([250, 240], 5.3, [[0.5, 0.42, 0.3]; 2], Cfa::RGGB);
    // Yarns of one hue in many shades: nothing is flat.
    for k in 0..250 * 240 {
        let yarn = ((k % 250) as f64 / 5.3) as usize * 7 + ((k / 250) as f64 / 5.5) as usize * 5;
        cloth.mosaic.data[k] *= 0.7 + 0.05 * (yarn % 11) as f32;
    }
    let found = cloth.found();
    assert_eq!((found.figures.limited, found.figures.several_share), (0, 0.0));
    assert_eq!(found.figures.gated_share, 0.0);
    let expected = reference::colours(&cloth.input());
    let (mut square, mut worst) = (0.0f64, 0.0f64);
    for k in 0..250 * 240 {
        let shade = f64::from(found.shade.data[k]) / expected.shade.data[k];
        assert!((shade - 1.0).abs() < 2e-4, "{k}: {}", found.shade.data[k]);
        for c in 0..3 {
            let off = f64::from(found.reflectance.data[k][c]) / expected.reflectance.data[k][c];
            square += (off - 1.0).powi(2);
            worst = worst.max((off - 1.0).abs());
        }
    }
    let rms = (square / (3.0 * 250.0 * 240.0)).sqrt();
    println!("rms {rms}, worst {worst}");
    assert!(rms < 1e-4 && worst < 5e-4, "rms {rms}, worst {worst}");
}

#[test]
fn one_dye_has_one_hue_and_no_shade_in_it() {
    let cloth = Cloth::linen([300, 280]);
    let [all, hue] = cloth.errors(&cloth.found());
    let [all_before, hue_before] = cloth.errors(&cloth.interpolated());
    assert!(hue < 0.004 && hue < 0.25 * hue_before, "hue {hue}, interpolated {hue_before}");
    assert!(all < 0.02 && all < 0.4 * all_before, "all {all}, interpolated {all_before}");
}

#[test]
fn yarns_in_step_with_the_mosaic_give_no_bands() {
    for pitch in [1.97, 2.0, 2.6, 4.0] {
        let cloth = Cloth::woven([560, 540], pitch, [[0.5, 0.42, 0.3]; 2], Cfa::RGGB);
        let [_, hue] = cloth.errors(&cloth.found());
        let [_, before] = cloth.errors(&cloth.interpolated());
        println!("{pitch} px: {hue}, interpolated {before}");
        assert!(hue < 0.015, "{pitch} px: {hue}, interpolated {before}");
    }
}

#[test]
fn two_dyes_stay_two() {
    let indigo = [[0.06, 0.09, 0.2], [0.75, 0.73, 0.65]];
    let opposite = [[0.5, 0.12, 0.1], [0.12, 0.4, 0.15]];
    for (dyes, share) in [(indigo, 0.5), (opposite, 0.6)] {
        let cloth = Cloth::woven([400, 400], 4.3, dyes, Cfa::RGGB);
        let found = cloth.found();
        assert!(found.figures.several_share > 0.9, "{dyes:?}: {:?}", found.figures);
        assert!(found.shade.data.iter().all(|shade| *shade > 0.99), "dye was taken for shade");
        let [_, hue] = cloth.errors(&found);
        let [_, before] = cloth.errors(&cloth.interpolated());
        assert!(hue < share * before, "{dyes:?}: {hue}, interpolated {before}");
    }
}

/// In one channel the dyes are equal: only relief tells there.
#[test]
fn dyes_that_are_equal_in_green_are_no_worse_than_interpolated() {
    for pitch in [2.6, 4.1] {
        let tan_and_blue = [[0.45, 0.3, 0.15], [0.12, 0.3, 0.45]];
        let cloth = Cloth::woven([400, 400], pitch, tan_and_blue, Cfa::RGGB);
        let [_, hue] = cloth.errors(&cloth.found());
        let [_, before] = cloth.errors(&cloth.interpolated());
        println!("{pitch} px: {hue}, interpolated {before}");
        assert!(hue < before, "{pitch} px: {hue}, interpolated {before}");
    }
}

/// Patches of a chart, and grey paper, both with noise: no structure that the method may take for cloth.
#[test]
fn charts_and_paper_are_no_worse_than_interpolated() {
    let mut state = 17u64;
    let mut noise = || {
        let mut one = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f32 / 16_777_216.0 - 0.5
        };
        0.012 * (one() + one() + one())
    };
    let patch = |k: usize| {
        let column = k % 300 / 50;
        let hue = (k / 300 / 50 * 6 + column) as f64;
        [0.0, 2.1, 4.2].map(|shift| 0.42 + 0.36 * (1.7 * hue + shift).sin())
    };
    for (name, colour) in [("chart", &patch as &dyn Fn(usize) -> [f64; 3]), ("grey", &|_| [0.5; 3])]
    {
        let mut cloth = Cloth::linen([300, 300]);
        cloth.normal.data.fill([0.0, 0.0, 1.0]);
        for k in 0..300 * 300 {
            let truth = colour(k).map(|c| c as f32);
            cloth.truth.data[k] = truth;
            let channel = cloth.cfa.channel(k % 300, k / 300) as usize;
            cloth.mosaic.data[k] = truth[channel] * (1.0 + noise());
        }
        let found = cloth.found();
        assert!(found.shade.data.iter().all(|shade| *shade > 0.999), "{name}: ink taken for shade");
        let [all, hue] = cloth.errors(&found);
        let [all_before, hue_before] = cloth.errors(&cloth.interpolated());
        println!("{name}: {all} {hue}, interpolated {all_before} {hue_before}");
        // Residual interpolation keeps a photosite's own noise in all three channels: less of it turns into colour, which an
        // eye sees, and a little more stays in lightness.
        assert!(hue < hue_before && all < 1.08 * all_before, "{name}: {all} {hue}");
    }
}

#[test]
fn the_place_of_the_pattern_does_not_matter() {
    let all = ["RGGB", "GRBG", "GBRG", "BGGR"].map(|name| {
        let cfa = Cfa::parse(name).unwrap();
        let cloth = Cloth::woven([300, 280], 5.3, [[0.5, 0.42, 0.3]; 2], cfa);
        cloth.errors(&cloth.found())
    });
    for errors in all {
        assert!((errors[0] - all[0][0]).abs() < 0.003, "{all:?}");
        assert!((errors[1] - all[0][1]).abs() < 0.002, "{all:?}");
    }
}

#[test]
fn own_value_is_reflectance_times_shade() {
    let cloth = Cloth::linen([200, 180]);
    let found = cloth.found();
    assert_eq!(found.figures.limited, 0);
    for (k, value) in cloth.mosaic.data.iter().enumerate() {
        let channel = cloth.cfa.channel(k % 200, k / 200) as usize;
        let back = found.reflectance.data[k][channel] * found.shade.data[k];
        assert!((back / value - 1.0).abs() < 1e-5, "{k}: {back} and {value}");
    }
}

#[test]
fn threads_do_not_matter() {
    let mut cloth = Cloth::linen([310, 290]);
    // Prints, holes and flat parts: every way is taken.
    for (k, value) in cloth.mosaic.data.iter_mut().enumerate() {
        let (x, y) = (k % 310, k / 310);
        let blue = cloth.cfa.channel(x, y) as usize == 2;
        if (40..120).contains(&x) && (60..140).contains(&y) {
            *value *= if blue { 1.2 } else { 0.3 };
        }
        if x > 220 {
            (*value, cloth.normal.data[k]) = (0.4, [0.0, 0.0, 1.0]);
        }
        if k % 97 == 0 {
            cloth.mask.data[k] = 0;
        }
    }
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found = pool.install(|| cloth.found());
        let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        (bits(found.reflectance.data.as_flattened()), bits(&found.shade.data))
    };
    let one = with(1);
    assert!(one == with(2) && one == with(5));
}

#[test]
fn outliers_stay_where_they_are() {
    let clean = Cloth::linen([200, 180]);
    let mut spoilt = Cloth::linen([200, 180]);
    let at = 90 * 200 + 100;
    spoilt.mosaic.data[at] = 1739.0;
    let (before, after) = (clean.found(), spoilt.found());
    assert_eq!(after.figures.limited, 1);
    let pairs = before.reflectance.data.iter().zip(&after.reflectance.data).enumerate();
    let mut changed = 0;
    for (k, (a, b)) in pairs.filter(|(k, _)| *k != at) {
        let apart = (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
        changed += usize::from(apart > 2e-3);
        // The window's fit shifts by one of many thousand photosites; where an edge runs may then be decided otherwise.
        assert!(apart < 0.02, "{k}: {a:?} and {b:?}");
    }
    assert!(changed < 200 * 180 / 200, "{changed} photosites changed");
    assert!(after.reflectance.data[at].iter().all(|value| *value < 5.0));
}

#[test]
fn what_is_unsolved_is_zero_and_lends_nothing() {
    let mut cloth = Cloth::linen([220, 200]);
    for k in (0..220 * 200).filter(|k| k % 13 == 0 || k % 220 < 30) {
        (cloth.mask.data[k], cloth.mosaic.data[k]) = (0, 1e9);
        cloth.normal.data[k] = [f32::NAN; 3];
    }
    let found = cloth.found();
    for (k, mask) in cloth.mask.data.iter().enumerate().filter(|(_, mask)| **mask == 0) {
        assert_eq!((found.reflectance.data[k], found.shade.data[k]), ([0.0; 3], 0.0), "{mask}");
    }
    let [all, hue] = cloth.errors(&found);
    assert!(all < 0.04 && hue < 0.01, "{all} {hue}");
}

#[test]
fn bad_input_is_refused_by_name() {
    let refused = |cloth: &Cloth| find_colours(&cloth.input()).err();
    assert_eq!(refused(&Cloth::linen([100, 300])), Some(Refused::TooSmall));
    let fuji = Cfa::parse("RGBG").unwrap();
    let cloth = Cloth::woven([200, 200], 5.3, [[0.5; 3]; 2], fuji);
    assert_eq!(refused(&cloth), Some(Refused::NotBayer));
    let mut cloth = Cloth::linen([200, 200]);
    let red = |k: usize| (k % 200).is_multiple_of(2) && (k / 200).is_multiple_of(2);
    (0..200 * 200).filter(|k| red(*k)).for_each(|k| cloth.mask.data[k] = 0);
    assert_eq!(refused(&cloth), Some(Refused::Missing("red")));
    let mut cloth = Cloth::linen([300, 300]);
    (0..300 * 300).filter(|k| k % 300 % 3 == 2).for_each(|k| cloth.mask.data[k] = 0);
    assert_eq!(refused(&cloth), Some(Refused::NoWindow));
    let mut cloth = Cloth::linen([200, 200]);
    cloth.normal.data.fill([f32::NAN; 3]);
    assert_eq!(refused(&cloth), Some(Refused::TooSmall));
    let mut cloth = Cloth::linen([200, 200]);
    cloth.mosaic.data.fill(f32::NAN);
    assert_eq!(refused(&cloth), Some(Refused::TooSmall));
}
