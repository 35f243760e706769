//! Published demosaicers of whole mosaics, to compare with.

use super::interpolate::{Part, residual_interpolation};
use rayon::prelude::*;
use weavelight_calibration::description::{Cfa, Channel, Image};

/// Rows that a thread takes at a time.
const BAND: usize = 32;

/// A demosaicer of Bayer patterns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Demosaicer {
    /// Means of the two or four nearest photosites of a channel.
    Bilinear,
    /// Linear interpolation corrected by the gradient of the photosite's own channel: H. S. Malvar, L. He, R. Cutler,
    /// "High-quality linear interpolation for demosaicing of Bayer-patterned color images", ICASSP 2004, figure 2.
    Malvar,
    /// Residual interpolation, which also serves where cloth has no structure: D. Kiku, Y. Monno, M. Tanaka, M. Okutomi,
    /// "Residual interpolation for color image demosaicking", ICIP 2013; green along edges after D. Menon, S. Andriani,
    /// G. Calvagno, "Demosaicing with directional filtering and a posteriori decision", IEEE Trans. Image Processing 16(1),
    /// 2007.
    Residual,
}

impl Demosaicer {
    /// Every one.
    pub const ALL: [Self; 3] = [Self::Bilinear, Self::Malvar, Self::Residual];

    /// As tables call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bilinear => "bilinear",
            Self::Malvar => "malvar",
            Self::Residual => "residual",
        }
    }

    /// Red, green and blue of a mosaic with a Bayer pattern; 0 where `mask` is, and what is there lends nothing. Every
    /// photosite keeps its own value.
    pub fn demosaic(self, mosaic: &Image<f32>, cfa: Cfa, mask: &Image<u8>) -> Image<[f32; 3]> {
        let (width, height) = (mosaic.width, mosaic.height);
        let mut out = Image::filled(width, height, [0.0; 3]);
        let value = |x: usize, y: usize| {
            let at = y * width + x;
            (mask.data[at] != 0).then(|| mosaic.data[at])
        };
        out.data.par_chunks_mut(BAND * width.max(1)).enumerate().for_each(|(band, out)| {
            let rows = band * BAND..((band + 1) * BAND).min(height);
            let found = match self {
                Self::Residual => {
                    residual_interpolation([width, height], cfa, &value, &(0..width), &rows)
                }
                _ => {
                    let part = Part::new([width, height], cfa, &value, &(0..width), &rows);
                    let inside = (0..rows.len()).flat_map(|y| (0..width).map(move |x| [x, y]));
                    let one = |place| self.linear(&part, part.at(place));
                    inside.map(one).collect()
                }
            };
            let solved = &mask.data[rows.start * width..rows.end * width];
            for ((out, found), _) in
                out.iter_mut().zip(found).zip(solved).filter(|(_, solved)| **solved != 0)
            {
                *out = found;
            }
        });
        out
    }

    fn linear(self, part: &Part, at: usize) -> [f32; 3] {
        let around = Around { part, at, share: if self == Self::Malvar { 1.0 } else { 0.0 } };
        let own = part.own[at];
        let mut rgb = [own; 3];
        let [beside, below, diagonal] =
            [at + 1, at + part.width, at + part.width + 1].map(|at| usize::from(part.channel[at]));
        if usize::from(part.channel[at]) == Channel::G as usize {
            rgb[beside] = around.beside([1, 0], [0, 1]);
            rgb[below] = around.beside([0, 1], [1, 0]);
        } else {
            rgb[Channel::G as usize] = around.green();
            rgb[diagonal] = around.opposite();
        }
        rgb.map(|value| value.max(0.0))
    }
}

/// The neighbourhood of a photosite, and how much of the gradient's correction counts.
struct Around<'a> {
    part: &'a Part,
    at: usize,
    share: f32,
}

impl Around<'_> {
    fn value(&self, x: isize, y: isize) -> f32 {
        self.part.own[self.at.wrapping_add_signed(y * self.part.width as isize + x)]
    }

    /// Both photosites that lie [x, y] away.
    fn pair(&self, [x, y]: [isize; 2]) -> f32 {
        self.value(x, y) + self.value(-x, -y)
    }

    fn corners(&self) -> f32 {
        self.pair([1, 1]) + self.pair([1, -1])
    }

    /// Green at red or blue.
    fn green(&self) -> f32 {
        let gradient = 4.0 * self.value(0, 0) - self.pair([2, 0]) - self.pair([0, 2]);
        (self.pair([1, 0]) + self.pair([0, 1])) / 4.0 + self.share * gradient / 8.0
    }

    /// At green, the channel whose photosites lie `along`.
    fn beside(&self, along: [isize; 2], across: [isize; 2]) -> f32 {
        let far = |by: [isize; 2]| self.pair(by.map(|d| 2 * d));
        let gradient = 5.0 * self.value(0, 0) - self.corners() - far(along) + 0.5 * far(across);
        self.pair(along) / 2.0 + self.share * gradient / 8.0
    }

    /// Red at blue, or blue at red.
    fn opposite(&self) -> f32 {
        let gradient = 6.0 * self.value(0, 0) - 1.5 * (self.pair([2, 0]) + self.pair([0, 2]));
        self.corners() / 4.0 + self.share * gradient / 8.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_plane(cfa: Cfa, colour: impl Fn(usize, usize) -> [f32; 3]) -> Image<f32> {
        let value = |k: usize| colour(k % 40, k / 40)[cfa.channel(k % 40, k / 40) as usize];
        Image { width: 40, height: 36, data: (0..40 * 36).map(value).collect() }
    }

    #[test]
    fn slopes_of_one_hue_and_own_values_are_kept() {
        for name in ["RGGB", "GRBG", "GBRG", "BGGR"] {
            let cfa = Cfa::parse(name).unwrap();
            let colour = |x: usize, y: usize| {
                let level = 0.2 + 0.01 * x as f32 + 0.004 * y as f32;
                [level + 0.1, level, level - 0.05]
            };
            let mosaic = of_plane(cfa, colour);
            let mut mask = Image { width: 40, height: 36, data: vec![255; 40 * 36] };
            mask.data[0] = 0;
            for method in Demosaicer::ALL {
                let found = method.demosaic(&mosaic, cfa, &mask);
                assert_eq!(found.data[0], [0.0; 3]);
                for (x, y) in (4..36).flat_map(|x| (4..32).map(move |y| (x, y))) {
                    let (rgb, truth) = (found.at(x, y), colour(x, y));
                    for c in 0..3 {
                        let off = (rgb[c] - truth[c]).abs();
                        assert!(off < 2e-3, "{method:?} {name} {x} {y}: {rgb:?}, not {truth:?}");
                    }
                    let own = cfa.channel(x, y) as usize;
                    assert_eq!(rgb[own], mosaic.data[y * 40 + x], "{method:?}");
                }
            }
        }
    }

    /// A single bright red photosite is spread with the published coefficients.
    #[test]
    fn malvars_coefficients() {
        let mut mosaic = Image::filled(40, 36, 1.0f32);
        mosaic.data[16 * 40 + 16] = 9.0; // red in RGGB
        let mask = Image { width: 40, height: 36, data: vec![255; 40 * 36] };
        let found = Demosaicer::Malvar.demosaic(&mosaic, Cfa::RGGB, &mask);
        let more = |x: usize, y: usize, c: usize| found.at(x, y)[c] - 1.0;
        // 8 more, times the coefficient over 8.
        assert_eq!((more(16, 16, 1), more(16, 16, 2)), (4.0, 6.0));
        assert_eq!((more(17, 16, 0), more(16, 17, 0), more(17, 17, 0)), (4.0, 4.0, 2.0));
        assert_eq!((more(18, 16, 1), more(18, 16, 2)), (-1.0, -1.0));
        let flat = Demosaicer::Bilinear.demosaic(&mosaic, Cfa::RGGB, &mask);
        let more = |x: usize, y: usize, c: usize| flat.at(x, y)[c] - 1.0;
        assert_eq!((more(16, 16, 1), more(16, 16, 2)), (0.0, 0.0));
        assert_eq!((more(17, 16, 0), more(17, 17, 0), more(18, 16, 0)), (4.0, 2.0, 0.0));
    }
}
