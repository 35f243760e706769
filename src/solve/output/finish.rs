//! From maps on the mosaic to the maps of a solution: colour, and the grid that was asked for.

use super::colour::colour;
use crate::instrument::Color;
use crate::photometry::Outcome;
use crate::photometry::{Maps, is_solved};
use crate::solution::{AlbedoKind, Finished, Outputs};
use nalgebra::Matrix3;
use rayon::prelude::*;
use weavelight_calibration::description::{Camera, Image};
use weavelight_calibration::projection::Projector;

/// What R, G, B mean.
pub(crate) fn color_space(color: &Color) -> &'static str {
    match color.camera_to_linear_srgb {
        Some(_) => "linear sRGB",
        None => "white-balanced camera RGB",
    }
}

/// Gives the albedo, if it is wanted, its hidden channels and the colour space of the calibration.
pub(crate) fn finish(maps: Maps, color: &Color, outputs: Outputs, kind: AlbedoKind) -> Finished {
    let Maps { normal, albedo, expected_error_deg, outcome, .. } = maps;
    let width = outcome.width;
    let mask = |outcome: &Outcome| if is_solved(*outcome) { 255 } else { 0 };
    let mask =
        Image { width, height: outcome.height, data: outcome.data.par_iter().map(mask).collect() };
    let coloured = colour(albedo, &normal, &mask, color, (outputs, kind));
    Finished {
        normal,
        albedo: coloured.albedo,
        shade: coloured.shade,
        confidence: expected_error_deg,
        mask,
        albedo_report: coloured.report,
        said: coloured.said,
    }
}

/// Makes photosites unsolved whose normal, albedo or error left the range of float32: files hold no NaN and no infinity.
/// A sentence if there were any.
pub(crate) fn leave_out_what_is_not_finite(maps: &mut Finished) -> Option<String> {
    // Without an albedo its rows are empty.
    let mut no_albedo: Vec<[f32; 3]> =
        vec![[0.0; 3]; if maps.albedo.data.is_empty() { maps.mask.data.len() } else { 0 }];
    let albedo = if no_albedo.is_empty() { &mut maps.albedo.data } else { &mut no_albedo };
    let pixels = maps.normal.data.par_iter_mut().zip(albedo);
    let pixels = pixels.zip(&mut maps.confidence.data).zip(&mut maps.mask.data);
    let left_out: usize = pixels
        .map(|(((normal, albedo), confidence), mask)| {
            let finite = normal.iter().chain(albedo.iter()).all(|value| value.is_finite());
            if finite && confidence.is_finite() {
                return 0;
            }
            (*normal, *albedo, *confidence) = ([0.0; 3], [0.0; 3], 0.0);
            usize::from(std::mem::replace(mask, 0) != 0)
        })
        .sum();
    let shade = maps.shade.data.par_iter_mut().zip(&maps.mask.data);
    shade.filter(|(_, mask)| **mask == 0).for_each(|(shade, _)| *shade = 0.0);
    (left_out > 0).then(|| {
        format!(
            "{left_out} photosites gave numbers that a map cannot hold and were left out; check exposures, \
             intensities and the colour matrix."
        )
    })
}

pub(crate) fn convert(albedo: &mut Image<[f32; 3]>, matrix: &Matrix3<f64>) {
    let matrix = matrix.cast::<f32>();
    albedo
        .data
        .par_iter_mut()
        .for_each(|rgb| *rgb = (matrix * nalgebra::Vector3::from(*rgb)).into());
}

/// Resamples one value a pixel, NaN where there is none, as [`undistort`] does.
pub(crate) fn undistort_values(values: &Image<f32>, camera: &Camera) -> Image<f32> {
    let (width, height) = (values.width, values.height);
    let projector = Projector::new(camera);
    let known = values.data.par_iter().map(|value| if value.is_nan() { 0 } else { 255 });
    let known = Image { width, height, data: known.collect() };
    let mut out = Image::filled(width, height, f32::NAN);
    out.data.par_chunks_mut(width.max(1)).enumerate().for_each(|(v, row)| {
        for (u, value) in row.iter_mut().enumerate() {
            if let Some(taps) = taps_of_undistorted(&known, camera, &projector, [u, v]) {
                *value = taps.mean_of(|at| [values.data[at], 0.0, 0.0])[0];
            }
        }
    });
    out
}

/// The pixels around the place that pixel (u, v) of the camera without distortion looks at.
fn taps_of_undistorted(
    mask: &Image<u8>,
    camera: &Camera,
    projector: &Projector,
    [u, v]: [usize; 2],
) -> Option<Taps> {
    let undistorted = [(u as f64 - camera.cx) / camera.fx, (v as f64 - camera.cy) / camera.fy];
    projector.pixel_of_undistorted(undistorted).and_then(|pixel| Taps::new(mask, pixel))
}

/// The same camera without its distortion.
pub(crate) fn pinhole(camera: &Camera) -> Camera {
    Camera { distortion: [0.0; 5], ..camera.clone() }
}

/// Resamples the maps to the picture of a camera without distortion. Each pixel is the bilinear mean of the solved ones
/// around its place; it is solved where they make up at least half.
pub(crate) fn undistort(maps: &Finished, camera: &Camera) -> Finished {
    let (width, height) = (maps.mask.width, maps.mask.height);
    let projector = Projector::new(camera);
    let mut out = Finished {
        normal: Image::filled(width, height, [0.0; 3]),
        albedo: Image::filled(maps.albedo.width, maps.albedo.height, [0.0; 3]),
        shade: Image::filled(maps.shade.width, maps.shade.height, 0.0),
        confidence: Image::filled(width, height, 0.0),
        mask: Image::filled(width, height, 0),
        albedo_report: maps.albedo_report.clone(),
        said: maps.said.clone(),
    };
    let Finished { normal, albedo, shade, confidence, mask, .. } = &mut out;
    // Without an albedo or a shade their rows are empty.
    let mut albedo_rows: Vec<&mut [[f32; 3]]> = albedo.data.chunks_mut(width).collect();
    albedo_rows.resize_with(height, || &mut []);
    let mut shade_rows: Vec<&mut [f32]> = shade.data.chunks_mut(width).collect();
    shade_rows.resize_with(height, || &mut []);
    let colours: Vec<_> = albedo_rows.into_iter().zip(shade_rows).collect();
    let rows = normal.data.par_chunks_mut(width).zip(colours);
    let rows = rows.zip(confidence.data.par_chunks_mut(width)).zip(mask.data.par_chunks_mut(width));
    rows.enumerate().for_each(|(v, (((normal, (albedo, shade)), confidence), mask))| {
        for u in 0..width {
            let Some(taps) = taps_of_undistorted(&maps.mask, camera, &projector, [u, v]) else {
                continue;
            };
            let mean_normal = nalgebra::Vector3::from(taps.mean(&maps.normal));
            let length = mean_normal.norm();
            if length > 0.0 {
                normal[u] = (mean_normal / length).into();
                if let Some(albedo) = albedo.get_mut(u) {
                    *albedo = taps.mean(&maps.albedo);
                }
                if let Some(shade) = shade.get_mut(u) {
                    *shade = taps.mean_of(|at| [maps.shade.data[at], 0.0, 0.0])[0];
                }
                confidence[u] = taps.mean_of(|at| [maps.confidence.data[at], 0.0, 0.0])[0];
                mask[u] = 255;
            }
        }
    });
    out
}

/// The solved pixels around a place and their shares.
struct Taps {
    at: [(usize, f32); 4],
}

impl Taps {
    fn new(mask: &Image<u8>, [u, v]: [f64; 2]) -> Option<Self> {
        let (right, bottom) = ((mask.width - 1) as f64, (mask.height - 1) as f64);
        // Half a pixel beyond the outermost centres still lies on the sensor.
        if !(-0.5..=right + 0.5).contains(&u) || !(-0.5..=bottom + 0.5).contains(&v) {
            return None;
        }
        let (u, v) = (u.clamp(0.0, right), v.clamp(0.0, bottom));
        let (x, y) = (u.floor() as usize, v.floor() as usize);
        let (fu, fv) = ((u - x as f64) as f32, (v - y as f64) as f32);
        let tap = |dx: usize, dy: usize, weight: f32| {
            let at = (y + dy).min(mask.height - 1) * mask.width + (x + dx).min(mask.width - 1);
            (at, if mask.data[at] == 0 { 0.0 } else { weight })
        };
        let mut at = [
            tap(0, 0, (1.0 - fu) * (1.0 - fv)),
            tap(1, 0, fu * (1.0 - fv)),
            tap(0, 1, (1.0 - fu) * fv),
            tap(1, 1, fu * fv),
        ];
        let total: f32 = at.iter().map(|(_, weight)| weight).sum();
        at.iter_mut().for_each(|(_, weight)| *weight /= total);
        (total >= 0.5).then_some(Self { at })
    }

    fn mean(&self, image: &Image<[f32; 3]>) -> [f32; 3] {
        self.mean_of(|at| image.data[at])
    }

    fn mean_of(&self, value: impl Fn(usize) -> [f32; 3]) -> [f32; 3] {
        let mut sum = [0.0; 3];
        // What is unsolved has no share, and may hold anything.
        for (at, weight) in self.at.into_iter().filter(|(_, weight)| *weight > 0.0) {
            let value = value(at);
            sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += weight * value);
        }
        sum
    }
}
