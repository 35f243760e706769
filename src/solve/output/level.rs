//! The level of the albedo from one reading of a spectrophotometer, where the photographs cannot tell it.

use crate::albedo::BRIGHTEST;
use crate::quantity::{LAB_AB, LAB_L};
use crate::solution::ReferenceReport;
use crate::solution::{AlbedoKind, Finished};
use crate::solve::{Options, SolveError};
use nalgebra::Vector3;
use palette::color_difference::Ciede2000;
use palette::white_point::D50;
use rayon::prelude::*;
use weavelight_calibration::color::lab_d50_from_linear_srgb;

/// Darkest reading whose ratio to a mean says anything.
const LEAST_L: f64 = 1.0;
/// A level that is off by more is not that of unresolved yarns.
const USUAL: std::ops::RangeInclusive<f64> = 0.8..=1.35;
/// Colour difference at equal lightness above which the reading is of another cloth, or the colours are not calibrated.
const SAME_CLOTH: f64 = 5.0;

/// Whether the options' reading can be used, before any work; `has_matrix`: whether the calibration's colours are calibrated.
///
/// # Errors
/// What is wrong with it.
pub(crate) fn check_reference(options: &Options, has_matrix: bool) -> Result<(), SolveError> {
    let Some([l, a, b]) = options.reference_lab else { return Ok(()) };
    let refused = |what: String| Err(SolveError::Reference { what });
    let range = LAB_L.check(l).and(LAB_AB.check(a)).and(LAB_AB.check(b));
    if let Err(what) = range {
        return refused(what);
    }
    if l < LEAST_L {
        return refused(format!(
            "has L* {l}; give a reading of the cloth, L* is {LEAST_L} at least"
        ));
    }
    if options.albedo == AlbedoKind::Appearance {
        return refused(
            "scales reflectance, and appearance was asked for; leave out one of the two".to_owned(),
        );
    }
    if !has_matrix {
        return refused(format!(
            "needs calibrated colours, and {} has no colour matrix; run `weavelight calibrate color` with a colour chart",
            options.calibration.display()
        ));
    }
    Ok(())
}

/// Scales the albedo so that the luminance of its mean over all solved pixels is that of the reading, and the shade the
/// other way: their product stays what the frames show. The report says by how much. Sentences where that is unusual.
///
/// # Errors
/// Where nothing is solved, or what is solved is black.
pub(crate) fn scale_to_reference(
    maps: &mut Finished,
    lab: [f64; 3],
) -> Result<Vec<String>, SolveError> {
    let black = || {
        SolveError::Reference {
        what: "has nothing to be compared with: no photosite is solved, or all are black; leave it out"
            .to_owned(),
    }
    };
    let mean = mean_of_solved(maps).ok_or_else(black)?;
    let found = lab_d50_from_linear_srgb(&mean);
    let factor = luminance(lab[0]) / luminance(found[0]);
    if !(factor.is_finite() && factor > 0.0 && found[0] > 0.0) {
        return Err(black());
    }
    let scale = factor as f32;
    let clamped: u64 = maps
        .albedo
        .data
        .par_iter_mut()
        .map(|rgb| {
            let scaled = rgb.map(|value| value * scale);
            *rgb = scaled.map(|value| value.min(BRIGHTEST));
            u64::from(*rgb != scaled)
        })
        .sum();
    maps.shade.data.par_iter_mut().for_each(|shade| *shade /= scale);
    maps.albedo_report.clamped += clamped;
    let remaining = ciede2000(lab_d50_from_linear_srgb(&(mean * factor)), lab);
    maps.albedo_report.reference =
        Some(ReferenceReport { lab_d50: lab, factor, remaining_de2000: remaining });
    Ok(unusual(factor, remaining))
}

fn unusual(factor: f64, remaining: f64) -> Vec<String> {
    let mut said = Vec::new();
    if !USUAL.contains(&factor) {
        said.push(format!(
            "The reference scales the albedo by {factor:.2}, more than unresolved yarns explain; check that it was read on this \
             cloth, under D50, and that the lights are calibrated."
        ));
    }
    if remaining > SAME_CLOTH {
        said.push(format!(
            "At equal lightness the cloth's colour is {remaining:.1} CIEDE2000 away from the reference; check that it was read \
             on this cloth, and calibrate the colours with a chart."
        ));
    }
    said
}

/// Linear sRGB; in an order that no thread count changes.
fn mean_of_solved(maps: &Finished) -> Option<Vector3<f64>> {
    let width = maps.mask.width.max(1);
    let rows = maps.albedo.data.par_chunks(width).zip(maps.mask.data.par_chunks(width));
    let sums: Vec<(Vector3<f64>, f64)> = rows
        .map(|(albedo, mask)| {
            let solved = albedo.iter().zip(mask).filter(|(_, mask)| **mask != 0);
            solved.fold((Vector3::zeros(), 0.0), |(sum, count), (rgb, _)| {
                (sum + Vector3::from(*rgb).cast::<f64>(), count + 1.0)
            })
        })
        .collect();
    let (sum, count) =
        sums.into_iter().fold((Vector3::zeros(), 0.0), |(s, n), (sum, count)| (s + sum, n + count));
    (count > 0.0).then(|| sum / count)
}

/// Relative luminance of a lightness: CIE 15:2018, 8.2.1.
fn luminance(lightness: f64) -> f64 {
    let f = (lightness + 16.0) / 116.0;
    let edge = 6.0 / 29.0;
    if f > edge { f.powi(3) } else { 3.0 * edge * edge * (f - 4.0 / 29.0) }
}

fn ciede2000(a: [f64; 3], b: [f64; 3]) -> f64 {
    let lab = |[l, a, b]: [f64; 3]| palette::Lab::<D50, f64>::new(l, a, b);
    lab(a).difference(lab(b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solution::AlbedoReport;
    use weavelight_calibration::description::Image;

    fn maps(albedo: [f32; 3]) -> Finished {
        let image = |value: f32| Image { width: 40, height: 30, data: vec![value; 1200] };
        let mut maps = Finished {
            normal: Image { width: 40, height: 30, data: vec![[0.0, 0.0, 1.0]; 1200] },
            albedo: Image { width: 40, height: 30, data: vec![albedo; 1200] },
            shade: image(0.9),
            confidence: image(1.0),
            mask: Image { width: 40, height: 30, data: vec![255; 1200] },
            albedo_report: AlbedoReport {
                kind: "reflectance".to_owned(),
                level_sigma: None,
                dyes: None,
                gated_share: 0.0,
                clamped: 0,
                yarns_px: None,
                reference: None,
            },
            said: vec![],
        };
        // What is unsolved has no part.
        for k in 0..100 {
            (maps.mask.data[k], maps.albedo.data[k], maps.shade.data[k]) = (0, [0.0; 3], 0.0);
        }
        maps
    }

    #[test]
    fn the_level_is_that_of_the_reading() {
        let truth = Vector3::new(0.5, 0.42, 0.3);
        let lab = lab_d50_from_linear_srgb(&truth);
        let mut low = maps([0.45, 0.378, 0.27]);
        assert_eq!(scale_to_reference(&mut low, lab).unwrap(), Vec::<String>::new());
        let report = low.albedo_report.reference.clone().unwrap();
        assert!((report.factor - 1.0 / 0.9).abs() < 1e-6, "{report:?}");
        assert!(report.remaining_de2000 < 1e-4, "{report:?}");
        for (k, (rgb, shade)) in low.albedo.data.iter().zip(&low.shade.data).enumerate().skip(100) {
            assert!((0..3).all(|c| (f64::from(rgb[c]) - truth[c]).abs() < 1e-6), "{k}: {rgb:?}");
            assert!((rgb[0] * shade - 0.45 * 0.9).abs() < 1e-6, "{k}: {shade}");
        }
        assert_eq!((low.albedo.data[0], low.shade.data[0]), ([0.0; 3], 0.0));
    }

    #[test]
    fn another_cloth_is_told() {
        let blue = lab_d50_from_linear_srgb(&Vector3::new(0.1, 0.2, 0.6));
        let said = scale_to_reference(&mut maps([0.45, 0.378, 0.27]), blue).unwrap();
        assert_eq!(said.len(), 2, "{said:?}");
        assert!(said[0].contains("more than unresolved yarns explain"), "{said:?}");
        assert!(said[1].contains("CIEDE2000 away from the reference"), "{said:?}");
        let black = scale_to_reference(&mut maps([0.0; 3]), blue).unwrap_err().to_string();
        assert!(black.contains("nothing to be compared with"), "{black}");
    }

    #[test]
    fn what_cannot_be_used_is_refused() {
        let check = |lab, albedo, expected: &str| {
            let mut options = Options::new("swatch", "calibration", "maps");
            (options.reference_lab, options.albedo) = (lab, albedo);
            let error = check_reference(&options, false).unwrap_err();
            assert!(error.to_string().contains(expected), "{error}");
        };
        let some = Some([60.0, 2.0, 8.0]);
        check(Some([f64::NAN, 0.0, 0.0]), AlbedoKind::Reflectance, "reference lab is NaN");
        check(Some([50.0, 300.0, 0.0]), AlbedoKind::Reflectance, "is 300; a* and b*");
        check(Some([0.0; 3]), AlbedoKind::Reflectance, "L* is 1 at least");
        check(some, AlbedoKind::Appearance, "leave out one of the two");
        check(some, AlbedoKind::Reflectance, "has no colour matrix");
    }
}
