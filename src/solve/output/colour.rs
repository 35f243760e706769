//! From the albedo of the layout of the frames to linear RGB, and the shade beside it.

use crate::albedo::{self, Figures, Input};
use crate::files::Setting;
use crate::instrument::Color;
use crate::photometry::Albedo;
use crate::raw::demosaic;
use crate::solution::{AlbedoKind, AlbedoReport, Outputs};
use crate::solve::output::finish::convert;
use rayon::prelude::*;
use weavelight_calibration::description::{Cfa, Image};

/// Albedo and shade; without a pixel where they are not asked for.
pub(crate) struct Coloured {
    pub(crate) albedo: Image<[f32; 3]>,
    pub(crate) shade: Image<f32>,
    pub(crate) report: AlbedoReport,
    /// Sentences.
    pub(crate) said: Vec<String>,
}

/// Colours in the calibration's space, none that no reflectance has.
pub(crate) fn colour(
    albedo: Albedo,
    normal: &Image<[f32; 3]>,
    mask: &Image<u8>,
    color: &Color,
    (outputs, kind): (Outputs, AlbedoKind),
) -> Coloured {
    let wanted = outputs.albedo || outputs.shade;
    let mut found = match albedo {
        _ if !wanted => return nothing(kind),
        Albedo::Mosaic(mosaic, cfa) => of_mosaic(&mosaic, cfa, normal, mask, kind),
        Albedo::Grey(grey) => {
            let data = grey.data.par_iter().map(|&value| [value; 3]).collect();
            let rgb = Image { width: grey.width, height: grey.height, data };
            as_it_appears(rgb, mask, kind, "the frames have no colour filters")
        }
        Albedo::Rgb(rgb) => {
            as_it_appears(rgb, mask, kind, "the frames have their three colours at every pixel")
        }
    };
    if let Some(matrix) = &color.camera_to_linear_srgb {
        convert(&mut found.albedo, matrix);
    }
    found.report.clamped += limit(&mut found.albedo);
    if !outputs.albedo {
        found.albedo = Image::filled(0, 0, [0.0; 3]);
    }
    if !outputs.shade {
        found.shade = Image::filled(0, 0, 0.0);
    }
    found
}

fn nothing(kind: AlbedoKind) -> Coloured {
    Coloured {
        albedo: Image::filled(0, 0, [0.0; 3]),
        shade: Image::filled(0, 0, 0.0),
        report: report(kind),
        said: vec![],
    }
}

fn report(kind: AlbedoKind) -> AlbedoReport {
    AlbedoReport {
        kind: kind.name().to_owned(),
        level_sigma: None,
        dyes: None,
        gated_share: 0.0,
        clamped: 0,
        yarns_px: None,
        reference: None,
    }
}

fn of_mosaic(
    mosaic: &Image<f32>,
    cfa: Cfa,
    normal: &Image<[f32; 3]>,
    mask: &Image<u8>,
    kind: AlbedoKind,
) -> Coloured {
    let colours = match albedo::find_colours(&Input { mosaic, cfa, normal, mask }) {
        Ok(colours) => colours,
        Err(refused) => {
            let width = mosaic.width;
            let rgb = demosaic(mosaic, cfa, &|x, y| mask.data[y * width + x] != 0);
            return as_it_appears(rgb, mask, kind, &refused.to_string());
        }
    };
    let albedo::Colours { mut reflectance, mut shade, figures } = colours;
    // What is no number goes on as it is: the photosite is left out where the maps are complete.
    let solved = mosaic.data.par_iter().zip(&mask.data);
    let sites = reflectance.data.par_iter_mut().zip(&mut shade.data).zip(solved);
    sites.for_each(|((rgb, shade), (value, solved))| {
        if *solved != 0 && *rgb == [0.0; 3] {
            (*rgb, *shade) = ([*value; 3], 1.0);
        }
        if kind == AlbedoKind::Appearance {
            rgb.iter_mut().for_each(|value| *value *= *shade);
            *shade = if *solved != 0 { 1.0 } else { 0.0 };
        }
    });
    let yarns_px = albedo::yarn_pitch(normal, mask);
    let mut said = level_warning(&figures, kind);
    said.extend(yarns_px.and_then(capture_advice));
    let report = AlbedoReport {
        yarns_px,
        level_sigma: Some(figures.level_sigma),
        dyes: Some(if figures.several_share > 0.5 { 2 } else { 1 }),
        gated_share: figures.gated_share,
        clamped: figures.limited as u64,
        ..report(kind)
    };
    Coloured { albedo: reflectance, shade, report, said }
}

/// Above this share, that the level reads low is worth a sentence.
const WORTH_SAYING: f64 = 0.05;

fn level_warning(figures: &Figures, kind: AlbedoKind) -> Vec<String> {
    if kind == AlbedoKind::Appearance || figures.reads_low < WORTH_SAYING {
        return vec![];
    }
    let why = match figures.several_share > 0.5 {
        true => "the shade of yarns of several dyes cannot be told from the dyes and stays in it",
        false => "the sensor does not resolve the yarns",
    };
    let percent = 100.0 * figures.reads_low;
    vec![format!(
        "The albedo reads up to {percent:.0} % low: {why}. One reading of a spectrophotometer on the same cloth ({}), or the \
         cloth photographed beside a white card, gives the factor that is missing.",
        Setting("reference-lab")
    )]
}

/// Yarns nearer to each other than this are near the Nyquist frequency of the mosaic, whose red and blue photosites lie two
/// apart: a period of four.
const FINE_YARNS_PX: f64 = 4.5;
/// Mean CIEDE2000 of plain weaves of one dye by the distance of their yarns, photosites: `bench --colors`, lens blur of
/// 0.7 px. Most of it is lightness.
const EXPECTED_ERROR: [[f64; 2]; 3] = [[2.0, 5.9], [2.6, 5.1], [5.3, 1.4]];

/// What to do where yarns are too fine for their colours.
fn capture_advice(yarns_px: f64) -> Option<String> {
    let error = EXPECTED_ERROR.windows(2).find(|pair| yarns_px < pair[1][0]).map(|pair| {
        let share = ((yarns_px - pair[0][0]) / (pair[1][0] - pair[0][0])).max(0.0);
        pair[0][1] + share * (pair[1][1] - pair[0][1])
    })?;
    (yarns_px < FINE_YARNS_PX).then(|| {
        format!(
            "Yarns of {yarns_px:.1} px are near the limit of the sensor's colour filters: move the camera nearer, until they \
             are {FINE_YARNS_PX} px apart, or accept colours that are off by about {error:.1} CIEDE2000."
        )
    })
}

/// The albedo with its shading; says why, where reflectance was asked for.
fn as_it_appears(
    albedo: Image<[f32; 3]>,
    mask: &Image<u8>,
    kind: AlbedoKind,
    why: &str,
) -> Coloured {
    let shade = |&solved: &u8| if solved != 0 { 1.0 } else { 0.0 };
    let shade = Image {
        width: mask.width,
        height: mask.height,
        data: mask.data.par_iter().map(shade).collect(),
    };
    let said = match kind {
        AlbedoKind::Appearance => vec![],
        AlbedoKind::Reflectance => vec![format!(
            "The albedo is as it appears, with the shading of relief that is not resolved: {why}."
        )],
    };
    Coloured { albedo, shade, report: report(AlbedoKind::Appearance), said }
}

/// Limits colours to what a reflectance can be; how many pixels that changed.
fn limit(albedo: &mut Image<[f32; 3]>) -> u64 {
    let limit = |rgb: &mut [f32; 3]| {
        let mut changed = 0;
        for value in rgb.iter_mut().filter(|value| value.is_finite()) {
            let limited = value.clamp(0.0, albedo::BRIGHTEST);
            if limited != *value {
                changed = 1;
                *value = limited;
            }
        }
        changed
    };
    albedo.data.par_iter_mut().map(limit).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A weave of one dye, its relief, and where it is solved.
    struct Cloth {
        mosaic: Image<f32>,
        cfa: Cfa,
        normal: Image<[f32; 3]>,
        mask: Image<u8>,
    }

    fn cloth(width: usize, height: usize) -> Cloth {
        let cfa = Cfa::RGGB;
        let slope = |k: usize| 1.2 * ((k as f32 + 0.5) / 5.3).fract() - 0.6;
        let normal = |k: usize| {
            let [a, b] = [slope(k % width), 0.5 * slope(k / width)];
            let length = (a * a + b * b + 1.0).sqrt();
            [-a / length, -b / length, 1.0 / length]
        };
        let value = |k: usize| {
            let dye = [0.5, 0.4, 0.3][cfa.channel(k % width, k / width) as usize];
            dye * (0.6 + 0.4 * normal(k)[2])
        };
        let image = |data| Image { width, height, data };
        Cloth {
            mosaic: image((0..width * height).map(value).collect()),
            cfa,
            normal: Image { width, height, data: (0..width * height).map(normal).collect() },
            mask: Image { width, height, data: vec![255; width * height] },
        }
    }

    impl Cloth {
        fn coloured(&self, color: &Color) -> Coloured {
            let albedo = Albedo::Mosaic(self.mosaic.clone(), self.cfa);
            let wanted = (Outputs::ALL, AlbedoKind::Reflectance);
            colour(albedo, &self.normal, &self.mask, color, wanted)
        }

        /// Nothing but interpolation, and a line that says why.
        fn check_refused(&self, why: &str) {
            let found = self.coloured(&Color::default());
            let width = self.mosaic.width;
            let known = |x: usize, y: usize| self.mask.data[y * width + x] != 0;
            let mut expected = demosaic(&self.mosaic, self.cfa, &known);
            limit(&mut expected);
            let bits = |image: &Image<[f32; 3]>| -> Vec<u32> {
                image.data.iter().flatten().map(|value| value.to_bits()).collect()
            };
            assert!(bits(&found.albedo) == bits(&expected), "{why}: not interpolated");
            let [said] = &found.said[..] else { panic!("{why}: {:?}", found.said) };
            assert!(said.starts_with("The albedo is as it appears"), "{said}");
            assert!(said.contains(why), "{said}");
            assert_eq!(found.report.kind, "appearance");
            for (shade, mask) in found.shade.data.iter().zip(&self.mask.data) {
                assert_eq!(*shade, if *mask != 0 { 1.0 } else { 0.0 });
            }
        }
    }

    #[test]
    fn a_weave_is_not_refused() {
        let found = cloth(200, 180).coloured(&Color::default());
        assert_eq!(found.report.kind, "reflectance");
        let pitch = found.report.yarns_px.unwrap();
        assert!((pitch - 5.3).abs() < 0.1, "{pitch}");
        let shaded = found.shade.data.iter().filter(|shade| **shade < 0.97).count();
        assert!(shaded > 200 * 180 / 10, "{shaded}");
    }

    #[test]
    fn what_cannot_be_done_is_done_as_before_and_told() {
        cloth(120, 300).check_refused("smaller than 128 x 128");
        let mut slivers = cloth(300, 300);
        (0..300 * 300).filter(|k| k % 300 % 3 == 2).for_each(|k| slivers.mask.data[k] = 0);
        slivers.check_refused("too thin or too few");
        let mut small = cloth(300, 300);
        (0..300 * 300).filter(|k| k % 300 > 90).for_each(|k| small.mask.data[k] = 0);
        (0..300 * 300).filter(|k| k / 300 > 90).for_each(|k| small.mask.data[k] = 0);
        small.check_refused("smaller than 128 x 128");
        let mut without = cloth(200, 200);
        let blue = |k: usize| k % 2 == 1 && k / 200 % 2 == 1;
        (0..200 * 200).filter(|k| blue(*k)).for_each(|k| without.mask.data[k] = 0);
        without.check_refused("no photosite has a value in blue");
        let mut other = cloth(200, 200);
        other.cfa = Cfa::parse("RGBG").unwrap();
        other.check_refused("not in a Bayer pattern");
        let mut unknown = cloth(200, 200);
        unknown.normal.data.fill([f32::NAN; 3]);
        unknown.check_refused("smaller than 128 x 128");
    }

    #[test]
    fn frames_without_a_mosaic_say_so() {
        let made = cloth(200, 180);
        let kinds = [
            (Albedo::Grey(made.mosaic.clone()), "no colour filters"),
            (Albedo::Rgb(Image::filled(200, 180, [0.4; 3])), "three colours at every pixel"),
        ];
        for (albedo, why) in kinds {
            let wanted = (Outputs::ALL, AlbedoKind::Reflectance);
            let found = colour(albedo, &made.normal, &made.mask, &Color::default(), wanted);
            assert!(found.said[0].contains(why), "{:?}", found.said);
            assert_eq!(found.report.kind, "appearance");
        }
    }

    /// Single normals that are no numbers are single holes; one without a matrix keeps the camera's colours.
    #[test]
    fn holes_in_the_normals_spread_nowhere() {
        let (clean, mut holed) = (cloth(220, 200), cloth(220, 200));
        let hole = |k: usize| k.is_multiple_of(997);
        (0..220 * 200).filter(|k| hole(*k)).for_each(|k| holed.normal.data[k] = [f32::NAN; 3]);
        let (a, b) = (clean.coloured(&Color::default()), holed.coloured(&Color::default()));
        assert_eq!(b.report.kind, "reflectance");
        for (k, (a, b)) in a.albedo.data.iter().zip(&b.albedo.data).enumerate() {
            let apart = (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
            assert!(b.iter().all(|value| value.is_finite()), "{k}: {b:?}");
            assert!(hole(k) || apart < 0.03, "{k}: {a:?} and {b:?}");
        }
    }

    #[test]
    fn fine_yarns_are_advised_against() {
        let said = capture_advice(2.3).unwrap();
        assert!(said.starts_with("Yarns of 2.3 px are near the limit"), "{said}");
        assert!(said.ends_with("about 5.5 CIEDE2000."), "{said}");
        assert!(capture_advice(1.9).unwrap().ends_with("about 5.9 CIEDE2000."));
        assert_eq!((capture_advice(4.6), capture_advice(40.0)), (None, None));
    }
}
