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
/// Mean CIEDE2000 of weaves of one dye by the distance of their yarns, photosites: simulated, lens blur of 0.7 px.
const EXPECTED_ERROR: [[f64; 2]; 4] = [[2.0, 3.5], [2.6, 2.9], [4.0, 1.8], [7.0, 0.7]];

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

    #[test]
    fn fine_yarns_are_advised_against() {
        let said = capture_advice(2.3).unwrap();
        assert!(said.starts_with("Yarns of 2.3 px are near the limit"), "{said}");
        assert!(said.ends_with("about 3.2 CIEDE2000."), "{said}");
        assert!(capture_advice(1.9).unwrap().ends_with("about 3.5 CIEDE2000."));
        assert_eq!((capture_advice(4.6), capture_advice(40.0)), (None, None));
    }
}
