//! Colour of a finished mosaic: the two channels that each photosite's filter hides, from its neighbours.

use rayon::prelude::*;
use weavelight_calibration::description::{Cfa, Channel, Image};

/// How much of the gradient correction is applied. Albedo has no shading in it: its channels rise together on cloth of
/// one hue (where all of the correction is best) and against each other where yarns of different dyes meet (where none
/// is). Over denim, linen, grey, tan on blue and red on green at 5 to 21 px a yarn, with a pixel of blur, half is never more
/// than 1.4 times as far off as the better of the two, where none and all are up to 2.8 and 1.9 times.
const CORRECTION: f32 = 0.5;

/// Red, green and blue at every photosite of a white-balanced mosaic.
///
/// `known` says which photosites have a value; the others come out as zero and lend nothing to their neighbours. Every
/// photosite keeps its own value. Where the 5 x 5 neighbourhood is whole, the hidden channels come from linear
/// interpolation corrected by half the gradient of the channel that is there (after Malvar, He and Cutler, "High-quality
/// linear interpolation for demosaicing of Bayer-patterned color images", ICASSP 2004); elsewhere, and for patterns other than
/// Bayer's, from the known neighbours of that channel, the nearer the heavier. A photosite without any takes its own value.
pub fn demosaic(
    mosaic: &Image<f32>,
    cfa: Cfa,
    known: &(dyn Fn(usize, usize) -> bool + Sync),
) -> Image<[f32; 3]> {
    let (width, height) = (mosaic.width, mosaic.height);
    let mut rgb = Image::filled(width, height, [0.0; 3]);
    if width == 0 {
        return rgb;
    }
    let whole_row: Vec<bool> =
        (0..height).into_par_iter().map(|y| (0..width).all(|x| known(x, y))).collect();
    let bayer = Bayer::new(cfa);
    rgb.data.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let surrounded = y >= 2 && y + 2 < height && width >= 5;
        let whole = surrounded && whole_row[y - 2..=y + 2].iter().all(|&whole| whole);
        for (x, out) in row.iter_mut().enumerate() {
            let inside = surrounded && x >= 2 && x + 2 < width;
            *out = match &bayer {
                _ if !whole && !known(x, y) => [0.0; 3],
                Some(bayer) if inside && (whole || is_whole(x, y, known)) => {
                    bayer.corrected(mosaic, x, y)
                }
                _ => averaged(mosaic, cfa, known, x, y),
            };
        }
    });
    rgb
}

fn is_whole(x: usize, y: usize, known: &(dyn Fn(usize, usize) -> bool + Sync)) -> bool {
    (y - 2..=y + 2).all(|y| (x - 2..=x + 2).all(|x| known(x, y)))
}

/// A Bayer pattern: green on one diagonal of the cell, red and blue on the other.
struct Bayer {
    cfa: Cfa,
}

impl Bayer {
    fn new(cfa: Cfa) -> Option<Self> {
        use Channel::{B, G, R};
        let is_bayer =
            matches!(cfa.cell, [R, G, G, B] | [B, G, G, R] | [G, R, B, G] | [G, B, R, G]);
        is_bayer.then_some(Self { cfa })
    }

    /// At a photosite with two neighbours on every side.
    fn corrected(&self, mosaic: &Image<f32>, x: usize, y: usize) -> [f32; 3] {
        let around = Around { mosaic, x, y };
        let own = *mosaic.at(x, y);
        let mut rgb = [own; 3];
        match self.cfa.channel(x, y) {
            Channel::G => {
                rgb[self.cfa.channel(x + 1, y) as usize] = around.beside(own, true);
                rgb[self.cfa.channel(x, y + 1) as usize] = around.beside(own, false);
            }
            _ => {
                rgb[Channel::G as usize] = around.green(own);
                rgb[self.cfa.channel(x + 1, y + 1) as usize] = around.opposite(own);
            }
        }
        // The correction overshoots at edges; less than no light does not come back.
        rgb.map(|value| value.max(0.0))
    }
}

/// The neighbourhood of one photosite, with sums over symmetric neighbours.
struct Around<'a> {
    mosaic: &'a Image<f32>,
    x: usize,
    y: usize,
}

impl Around<'_> {
    fn at(&self, dx: isize, dy: isize) -> f32 {
        let (x, y) = (self.x.wrapping_add_signed(dx), self.y.wrapping_add_signed(dy));
        self.mosaic.data[y * self.mosaic.width + x]
    }

    fn across(&self, d: isize) -> f32 {
        self.at(-d, 0) + self.at(d, 0)
    }

    fn along(&self, d: isize) -> f32 {
        self.at(0, -d) + self.at(0, d)
    }

    fn corners(&self) -> f32 {
        self.at(-1, -1) + self.at(1, -1) + self.at(-1, 1) + self.at(1, 1)
    }

    /// Green at red or blue.
    fn green(&self, own: f32) -> f32 {
        let gradient = (4.0 * own - self.across(2) - self.along(2)) / 8.0;
        (self.across(1) + self.along(1)) / 4.0 + CORRECTION * gradient
    }

    /// At green, the channel whose photosites are left and right of it (or above and below).
    fn beside(&self, own: f32, horizontal: bool) -> f32 {
        let (near, far, sideways) = match horizontal {
            true => (self.across(1), self.across(2), self.along(2)),
            false => (self.along(1), self.along(2), self.across(2)),
        };
        let gradient = (5.0 * own - far - self.corners() + 0.5 * sideways) / 8.0;
        near / 2.0 + CORRECTION * gradient
    }

    /// Blue at red, red at blue.
    fn opposite(&self, own: f32) -> f32 {
        let gradient = (6.0 * own - 1.5 * (self.across(2) + self.along(2))) / 8.0;
        self.corners() / 4.0 + CORRECTION * gradient
    }
}

/// From the known neighbours of each channel within one, two, then four photosites.
fn averaged(
    mosaic: &Image<f32>,
    cfa: Cfa,
    known: &(dyn Fn(usize, usize) -> bool + Sync),
    x: usize,
    y: usize,
) -> [f32; 3] {
    let own = *mosaic.at(x, y);
    let mut rgb = [own; 3];
    for channel in [Channel::R, Channel::G, Channel::B] {
        if cfa.channel(x, y) == channel {
            continue;
        }
        let found = [1, 2, 4]
            .into_iter()
            .find_map(|reach| mean_of_channel(mosaic, cfa, known, (x, y), channel, reach));
        rgb[channel as usize] = found.unwrap_or(own);
    }
    rgb
}

/// Mean of the known photosites of `channel` at most `reach` away, weighted by a tent; `None` where there are none.
fn mean_of_channel(
    mosaic: &Image<f32>,
    cfa: Cfa,
    known: &(dyn Fn(usize, usize) -> bool + Sync),
    (x, y): (usize, usize),
    channel: Channel,
    reach: usize,
) -> Option<f32> {
    let tent = |a: usize, b: usize| (reach + 1 - a.abs_diff(b)) as f32;
    let (mut sum, mut total) = (0.0, 0.0);
    for v in y.saturating_sub(reach)..(y + reach + 1).min(mosaic.height) {
        for u in x.saturating_sub(reach)..(x + reach + 1).min(mosaic.width) {
            if cfa.channel(u, v) == channel && known(u, v) {
                let weight = tent(u, x) * tent(v, y);
                sum += weight * mosaic.at(u, v);
                total += weight;
            }
        }
    }
    (total > 0.0).then(|| sum / total)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mosaic_of(
        width: usize,
        height: usize,
        cfa: Cfa,
        colour: impl Fn(usize, usize) -> [f32; 3],
    ) -> Image<f32> {
        let value = |i: usize| {
            let (x, y) = (i % width, i / width);
            colour(x, y)[cfa.channel(x, y) as usize]
        };
        Image { width, height, data: (0..width * height).map(value).collect() }
    }

    fn everywhere(_: usize, _: usize) -> bool {
        true
    }

    #[test]
    fn an_even_colour_comes_back_in_every_pattern_at_every_size() {
        let colour = [0.2, 0.5, 0.3];
        for pattern in ["RGGB", "BGGR", "GRBG", "GBRG", "RGBG"] {
            let cfa = Cfa::parse(pattern).unwrap();
            for (width, height) in [(2, 2), (3, 7), (5, 5), (16, 9)] {
                let rgb = demosaic(&mosaic_of(width, height, cfa, |_, _| colour), cfa, &everywhere);
                for (i, found) in rgb.data.iter().enumerate() {
                    let off = (0..3).map(|c| (found[c] - colour[c]).abs()).fold(0.0, f32::max);
                    assert!(off < 1e-6, "{pattern} {width}x{height} pixel {i}: {found:?}");
                }
            }
        }
    }

    #[test]
    fn a_grey_ramp_is_exact_away_from_the_border() {
        let ramp = |x: usize, y: usize| [0.1 + 0.01 * x as f32 + 0.02 * y as f32; 3];
        let rgb = demosaic(&mosaic_of(12, 10, Cfa::RGGB, ramp), Cfa::RGGB, &everywhere);
        for (x, y) in [(2, 2), (3, 2), (5, 7), (9, 4)] {
            for c in 0..3 {
                assert!((rgb.at(x, y)[c] - ramp(x, y)[c]).abs() < 1e-6, "{x}, {y}, {c}");
            }
        }
    }

    #[test]
    fn unknown_photosites_stay_zero_and_lend_nothing() {
        let colour = [0.2, 0.5, 0.3];
        let mut mosaic = mosaic_of(9, 9, Cfa::RGGB, |_, _| colour);
        let known = |x: usize, y: usize| !(x * 5 + y * 3).is_multiple_of(4);
        for y in 0..9 {
            for x in 0..9 {
                if !known(x, y) {
                    mosaic.data[y * 9 + x] = 1e9;
                }
            }
        }
        let rgb = demosaic(&mosaic, Cfa::RGGB, &known);
        for y in 0..9 {
            for x in 0..9 {
                let expected = if known(x, y) { colour } else { [0.0; 3] };
                let found = *rgb.at(x, y);
                assert!(
                    (0..3).all(|c| (found[c] - expected[c]).abs() < 1e-6),
                    "{x}, {y}: {found:?}"
                );
            }
        }
    }

    #[test]
    fn a_photosite_alone_is_grey() {
        let alone = Image { width: 1, height: 1, data: vec![0.4] };
        assert_eq!(demosaic(&alone, Cfa::RGGB, &everywhere).data, [[0.4; 3]]);
    }

    #[test]
    fn nothing_is_darker_than_black() {
        let edge = |x: usize, _: usize| if x < 6 { [0.0; 3] } else { [1.0, 0.1, 0.1] };
        let rgb = demosaic(&mosaic_of(12, 12, Cfa::RGGB, edge), Cfa::RGGB, &everywhere);
        assert!(rgb.data.iter().flatten().all(|&value| value >= 0.0));
    }

    /// Root mean square error of the hidden channels on a weave of two dyes with a pixel of blur, with the gradient
    /// correction and without.
    fn errors_on_weave(dyes: [[f64; 3]; 2], yarn_px: f64) -> [f64; 2] {
        let sharp = |x: f64, y: f64| {
            let (u, v) = (x / yarn_px, y / yarn_px);
            let warp_above = (u.floor() + v.floor()) as i64 % 2 == 0;
            let across = if warp_above { u.fract() } else { v.fract() };
            let shade = 1.0 - 0.8 * (across - 0.5).powi(2);
            dyes[usize::from(!warp_above)].map(|value| value * shade)
        };
        let weave = |x: usize, y: usize| {
            let mut sum = [0.0; 3];
            for (dx, dy) in (0..3).flat_map(|dy| (0..3).map(move |dx| (dx, dy))) {
                let weight = [1.0, 2.0, 1.0][dx] * [1.0, 2.0, 1.0][dy] / 16.0;
                let colour = sharp((x + dx) as f64, (y + dy) as f64);
                sum.iter_mut().zip(colour).for_each(|(sum, value)| *sum += weight * value);
            }
            sum.map(|value| value as f32)
        };
        let mosaic = mosaic_of(120, 120, Cfa::RGGB, weave);
        let corrected = demosaic(&mosaic, Cfa::RGGB, &everywhere);
        let (mut squares, mut count) = ([0.0; 2], 0.0);
        for y in 2..118 {
            for x in 2..118 {
                let truth = weave(x, y);
                let plain = averaged(&mosaic, Cfa::RGGB, &everywhere, x, y);
                for (square, found) in squares.iter_mut().zip([corrected.at(x, y), &plain]) {
                    *square += (0..3).map(|c| f64::from(found[c] - truth[c]).powi(2)).sum::<f64>();
                }
                count += 2.0;
            }
        }
        squares.map(|square| (square / count).sqrt())
    }

    #[test]
    fn the_gradient_correction_gains_more_than_it_can_lose() {
        let check = |dyes: [[f64; 3]; 2], most: f64| {
            for yarn_px in [5.3, 9.1, 20.9] {
                let [corrected, plain] = errors_on_weave(dyes, yarn_px);
                let share = corrected / plain;
                assert!(
                    share < most,
                    "{dyes:?}, {yarn_px} px: {corrected} corrected, {plain} averaged"
                );
            }
        };
        check([[0.06, 0.09, 0.2], [0.75, 0.73, 0.65]], 0.6);
        check([[0.5, 0.45, 0.35], [0.6, 0.54, 0.43]], 0.6);
        check([[0.2; 3], [0.6; 3]], 0.6);
        check([[0.25, 0.35, 0.6], [0.7, 0.55, 0.35]], 1.45);
        check([[0.6, 0.1, 0.1], [0.15, 0.45, 0.15]], 1.45);
    }
}
