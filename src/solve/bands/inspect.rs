//! A solve looked at closely: which lights a photosite's normal rests on, and what each light's frames say beside what the
//! solution predicts.

use crate::linear::SignalRows;
use crate::photometry::is_solved;
use crate::photometry::{Part, Photosite, Sample, Support};
use crate::raw::{Layout, demosaic};
use crate::solve::bands::rows::Rows;
use crate::solve::output::finish::convert;
use nalgebra::Vector3;
use rayon::prelude::*;
use weavelight_calibration::description::Image;

impl Rows<'_> {
    /// Solves one photosite again, as the whole run does. `None` outside the frames.
    pub fn photosite(&self, [x, y]: [usize; 2]) -> Option<Photosite> {
        let scene = self.0.scene;
        if x >= scene.width || y >= scene.height {
            return None;
        }
        let align = self.0.field.alignment();
        let mut found = None;
        self.0.solve_some(y, x / align * align..x + 1, |column, lone| {
            found = (column == x).then_some(lone);
        });
        let lone = found?;
        let solved = is_solved(lone.outcome);
        let (normal, support) = (Vector3::from(lone.normal).cast::<f64>(), lone.support);
        let samples = scene.lights.iter().enumerate().map(|(k, light)| {
            let measured = Some(lone.signal[k]).filter(|y| y.is_finite());
            let shading = normal.dot(&Vector3::from(lone.vectors[k])) as f32;
            let predicted = solved.then_some(lone.albedo * shading);
            Sample {
                light: light.index,
                measured,
                predicted: predicted.map(|p| p.max(0.0)),
                part: part(measured, predicted, &support, k),
            }
        });
        Some(Photosite {
            outcome: lone.outcome,
            normal: lone.normal,
            albedo: lone.albedo,
            expected_error_deg: lone.expected_error_deg,
            residual: lone.residual,
            samples: samples.collect(),
        })
    }

    /// What the frames of the light at `position` of the scene's lights show: linear RGB in the colour space of the albedo, as
    /// albedo times the light vector; exposure, intensity, gain map and ambient light are taken out. Zero where it clips.
    ///
    /// # Panics
    /// Where the scene has no such light.
    pub fn picture_of(&self, position: usize) -> Image<[f32; 3]> {
        let scene = self.0.scene;
        let (width, height, channels) = (scene.width, scene.height, scene.layout.channels());
        let mut picture = Image::filled(width, height, [f32::NAN; 3]);
        picture.data.par_chunks_mut(width).enumerate().for_each_init(
            SignalRows::default,
            |rows, (y, line)| {
                self.0.normalizer.row(y, 0..width, rows);
                let planes = &rows.planes[position * channels..][..channels];
                for (x, pixel) in line.iter_mut().enumerate() {
                    *pixel = [0, 1, 2].map(|c: usize| planes[c.min(channels - 1)][x]);
                }
            },
        );
        if let Layout::Mosaic(cfa) = scene.layout {
            let data = picture.data.iter().map(|pixel| pixel[0]).collect();
            let mosaic = Image { width, height, data };
            picture = demosaic(&mosaic, cfa, &|x, y| mosaic.at(x, y).is_finite());
        }
        if let Some(matrix) = &scene.color.camera_to_linear_srgb {
            convert(&mut picture, matrix);
        }
        let clipped = picture.data.par_iter_mut().filter(|p| p.iter().any(|c| !c.is_finite()));
        clipped.for_each(|pixel| *pixel = [0.0; 3]);
        picture
    }

    /// What the light at `position` of the scene's lights measures over what the solution predicts, in units of albedo times
    /// the light vector; shadowed side predicted as 0. NaN where unsolved or clipped.
    ///
    /// # Panics
    /// Where the scene has no such light.
    pub fn residual_of(&self, position: usize) -> Image<f32> {
        let (width, height) = (self.0.scene.width, self.0.scene.height);
        let mut residual = Image::filled(width, height, f32::NAN);
        residual.data.par_chunks_mut(width).enumerate().for_each(|(y, line)| {
            self.0.solve_some(y, 0..width, |x, lone| {
                if is_solved(lone.outcome) {
                    let normal = Vector3::from(lone.normal).cast::<f64>();
                    let shading = normal.dot(&Vector3::from(lone.vectors[position])).max(0.0);
                    line[x] = lone.signal[position] - lone.albedo * shading as f32;
                }
            });
        });
        residual
    }
}

/// What the solver did with a sample; `predicted` is negative where the surface turns away, `light` the light's place in the scene.
fn part(measured: Option<f32>, predicted: Option<f32>, support: &Support, light: usize) -> Part {
    match (measured, predicted) {
        (None, _) => Part::Unusable,
        (_, None) => Part::Unsolved,
        _ if support.kept.contains(light) => Part::Used,
        _ if !support.dropped.contains(light) => Part::TurnedAway,
        (Some(measured), Some(predicted)) if measured > predicted => Part::TooBright,
        _ => Part::TooDark,
    }
}
