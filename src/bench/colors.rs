//! Colour of the albedo against the truth, over cloths, sizes and lens blur, beside published demosaicers.

use super::BenchError;
use super::cloths::ColorCloth;
use crate::albedo::Demosaicer;
use crate::compare::{ColorFigures, ColorPairs, compare_colors, read_map};
use crate::files::FileError;
use crate::gpu::Device;
use crate::photometry::{Albedo, Method};
use crate::simulate::{self, Flaws, Instrument, Part};
use crate::solution::{ALBEDO_EXR, AlbedoKind, Outputs};
use crate::solve::{Scene, finish};
use serde::Serialize;
use std::path::Path;
use weavelight_calibration::description::Image;

/// Side of the crops of which the worst is stated.
const CROP: usize = 512;

/// What to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct ColorOptions {
    /// The cloths.
    pub cloths: Vec<ColorCloth>,
    /// Sizes of the frame over the rig's whole field of view.
    pub sizes_px: Vec<[usize; 2]>,
    /// Of such a frame only the middle, where it is larger than this; `None`: all of it.
    pub middle_px: Option<[usize; 2]>,
    /// Lens blur, photosites.
    pub psf_px: Vec<f64>,
    /// Everything random in a picture follows from one.
    pub seeds: Vec<u64>,
}

/// A cloth at a size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ColorRow {
    /// Its name.
    pub cloth: String,
    /// Of the frame over the whole field of view.
    pub size_px: [usize; 2],
    /// Lens blur, photosites.
    pub psf_px: f64,
    /// Of the picture.
    pub seed: u64,
    /// Of everything that was photographed.
    pub figures: ColorFigures,
    /// The largest of each figure over crops of 512 x 512.
    pub worst_crop: Worst,
    /// Of published demosaicers on the same albedo, by name.
    pub demosaicers: Vec<(String, ColorFigures)>,
    /// What the solve says of the albedo.
    pub said: Vec<String>,
    /// Share that the level may read low.
    pub level_sigma: Option<f64>,
}

/// The largest of each figure over several crops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Worst {
    /// Mean CIEDE2000.
    pub mean_de2000: f64,
    /// 95 % of the pixels lie below.
    pub p95_de2000: f64,
    /// Of means over 4 x 4 pixels.
    pub mean_de2000_4x4: f64,
    /// Standard deviation of the error of a*, b*.
    pub false_color: f64,
}

/// Photographs, solves and compares; `progress` gets the share done (0 to 1) and what is being done.
///
/// # Errors
/// Where a cloth cannot be simulated or solved.
pub fn measure_colors(
    options: &ColorOptions,
    progress: &(dyn Fn(f64, &str) + Sync),
) -> Result<Vec<ColorRow>, BenchError> {
    let mut rows = Vec::new();
    let per_cloth = options.sizes_px.len() * options.psf_px.len() * options.seeds.len();
    let total = (options.cloths.len() * per_cloth).max(1) as f64;
    for cloth in &options.cloths {
        for size_px in &options.sizes_px {
            for psf_px in &options.psf_px {
                for seed in &options.seeds {
                    progress(rows.len() as f64 / total, cloth.name);
                    rows.push(of_cloth(cloth, (*size_px, options.middle_px), *psf_px, *seed)?);
                }
            }
        }
    }
    Ok(rows)
}

fn of_cloth(
    cloth: &ColorCloth,
    (size_px, middle_px): ([usize; 2], Option<[usize; 2]>),
    psf_px: f64,
    seed: u64,
) -> Result<ColorRow, BenchError> {
    let folder =
        tempfile::tempdir().map_err(|source| FileError::write(&std::env::temp_dir(), source))?;
    let rig = folder.path().join("cut.toml");
    let mm_per_px = write_rig(&rig, size_px, middle_px)?;
    let options = simulate::Options {
        out: folder.path().join("rig"),
        rig: Some(rig),
        seed,
        only: vec![Part::Swatch],
        material: cloth.material(mm_per_px),
        flaws: Flaws { psf_px, ..Flaws::default() },
        ..simulate::Options::default()
    };
    simulate::run(&options, &|_, _| {})?;
    let truth = read_map(&options.out.join("truth").join(ALBEDO_EXR))?;
    let (scene, _) = Scene::load(&options.out.join("swatch"), &options.out.join("calibration"))?;
    let maps = scene.check()?.solve(Method::Auto, &Device::Cpu, None, &|_| {})?.maps;
    let demosaicers = published(&maps.albedo, &scene, &truth);
    let outputs = Outputs { albedo: true, shade: true, ..Outputs::NONE };
    let found = finish(maps, &scene.color, outputs, AlbedoKind::Reflectance);
    Ok(ColorRow {
        cloth: cloth.name.to_owned(),
        size_px,
        psf_px,
        seed,
        figures: compare(&found.albedo, &truth, whole(&truth))
            .ok_or_else(|| BenchError::Nothing { set: cloth.name.to_owned() })?,
        worst_crop: worst_crop(&found.albedo, &truth),
        demosaicers,
        said: found.said,
        level_sigma: found.albedo_report.level_sigma,
    })
}

/// The reference rig with a frame of this size, or with the middle of that frame; gives the size of a photosite on the table.
fn write_rig(
    path: &Path,
    size_px: [usize; 2],
    middle_px: Option<[usize; 2]>,
) -> Result<f64, BenchError> {
    let options = simulate::Options { size_px: Some(size_px), ..simulate::Options::default() };
    let instrument = Instrument::from_options(&options)?;
    let mut rig = instrument.rig;
    if let Some([width, height]) = middle_px {
        rig.camera.width_px = rig.camera.width_px.min(width);
        rig.camera.height_px = rig.camera.height_px.min(height);
    }
    rig.save(path)?;
    Ok(instrument.stage.view.mm_per_px())
}

/// Left, top, right and bottom.
type Window = [usize; 4];

fn whole(map: &Image<[f32; 3]>) -> Window {
    [0, 0, map.width, map.height]
}

fn compare(
    found: &Image<[f32; 3]>,
    truth: &Image<[f32; 3]>,
    [left, top, right, bottom]: Window,
) -> Option<ColorFigures> {
    let width = right - left;
    let mut pixels = ColorPairs { width, ..ColorPairs::default() };
    for (k, y) in (top..bottom).enumerate() {
        for x in left..right {
            let (a, b) = (found.at(x, y), truth.at(x, y));
            if *a != [0.0; 3] && *b != [0.0; 3] {
                pixels.places.push(k * width + x - left);
                pixels.pairs.push((a.map(f64::from), b.map(f64::from)));
            }
        }
    }
    compare_colors(&pixels)
}

fn worst_crop(found: &Image<[f32; 3]>, truth: &Image<[f32; 3]>) -> Worst {
    // The last crop ends where the picture does.
    let starts = |length: usize| {
        let last = length.saturating_sub(CROP);
        (0..last).step_by(CROP).chain([last])
    };
    let mut worst = Worst::default();
    for top in starts(truth.height) {
        for left in starts(truth.width) {
            let window =
                [left, top, (left + CROP).min(truth.width), (top + CROP).min(truth.height)];
            if let Some(figures) = compare(found, truth, window) {
                let larger = |worst: &mut f64, value: f64| *worst = worst.max(value);
                larger(&mut worst.mean_de2000, figures.mean_de2000);
                larger(&mut worst.p95_de2000, figures.p95_de2000);
                larger(&mut worst.mean_de2000_4x4, figures.mean_de2000_4x4.unwrap_or(0.0));
                larger(&mut worst.false_color, figures.false_color);
            }
        }
    }
    worst
}

fn published(
    albedo: &Albedo,
    scene: &Scene,
    truth: &Image<[f32; 3]>,
) -> Vec<(String, ColorFigures)> {
    let Albedo::Mosaic(mosaic, cfa) = albedo else { return vec![] };
    let known = |value: &f32| if value.is_finite() && *value > 0.0 { 255 } else { 0 };
    let (width, height) = (mosaic.width, mosaic.height);
    let mask = Image { width, height, data: mosaic.data.iter().map(known).collect() };
    let matrix = scene.color.camera_to_linear_srgb.map(|matrix| matrix.cast::<f32>());
    let of = |method: Demosaicer| {
        let mut rgb = method.demosaic(mosaic, *cfa, &mask);
        if let Some(matrix) = matrix {
            rgb.data
                .iter_mut()
                .for_each(|rgb| *rgb = (matrix * nalgebra::Vector3::from(*rgb)).into());
        }
        Some((method.name().to_owned(), compare(&rgb, truth, whole(truth))?))
    };
    Demosaicer::ALL.into_iter().filter_map(of).collect()
}

/// The rows as a Markdown table: mean / 95 % / 4 x 4 means / false colour of the whole picture and of the worst crop, and the
/// means of published demosaicers.
pub fn colors_markdown(rows: &[ColorRow]) -> String {
    let names: Vec<&str> =
        rows.first().iter().flat_map(|row| &row.demosaicers).map(|(name, _)| &name[..]).collect();
    let mut text = format!(
        "| cloth | size | PSF | seed | mean / 95 % / 4 x 4 / false colour | worst 512 crop | {} |\n|{}\n",
        names.join(" | "),
        " --- |".repeat(6 + names.len())
    );
    for row in rows {
        let [width, height] = row.size_px;
        let figures = &row.figures;
        let (worst, blocks) = (&row.worst_crop, figures.mean_de2000_4x4.unwrap_or(0.0));
        let means: Vec<String> =
            row.demosaicers.iter().map(|(_, of)| format!("{:.2}", of.mean_de2000)).collect();
        text.push_str(&format!(
            "| {} | {width} x {height} | {} | {} | {:.2} / {:.2} / {blocks:.2} / {:.2} | {:.2} / {:.2} / {:.2} / {:.2} | {} |\n",
            row.cloth,
            row.psf_px,
            row.seed,
            figures.mean_de2000,
            figures.p95_de2000,
            figures.false_color,
            worst.mean_de2000,
            worst.p95_de2000,
            worst.mean_de2000_4x4,
            worst.false_color,
            means.join(" | "),
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_a_line_of_the_table() {
        let figures = ColorFigures {
            mean_de2000: 1.234,
            p95_de2000: 3.0,
            mean_de2000_4x4: Some(0.5),
            false_color: 0.25,
            rms: 0.01,
            psnr_db: None,
            pixels: 9,
        };
        let row = ColorRow {
            cloth: "linen".to_owned(),
            size_px: [1848, 1224],
            psf_px: 0.7,
            seed: 2,
            figures,
            worst_crop: Worst {
                mean_de2000: 1.5,
                p95_de2000: 3.5,
                mean_de2000_4x4: 0.6,
                false_color: 0.3,
            },
            demosaicers: vec![("malvar".to_owned(), figures)],
            said: vec![],
            level_sigma: None,
        };
        let expected = "\
| cloth | size | PSF | seed | mean / 95 % / 4 x 4 / false colour | worst 512 crop | malvar |
| --- | --- | --- | --- | --- | --- | --- |
| linen | 1848 x 1224 | 0.7 | 2 | 1.23 / 3.00 / 0.50 / 0.25 | 1.50 / 3.50 / 0.60 / 0.30 | 1.23 |
";
        assert_eq!(colors_markdown(&[row]), expected);
    }

    #[test]
    fn the_worst_crop_is_found_wherever_it_is() {
        let truth = Image { width: 700, height: 530, data: vec![[0.4; 3]; 700 * 530] };
        let mut found = truth.clone();
        // In the last crop alone.
        found.data[529 * 700 + 699] = [0.9, 0.1, 0.1];
        let worst = worst_crop(&found, &truth);
        let all = compare(&found, &truth, whole(&truth)).unwrap();
        assert!(worst.mean_de2000 > 1.2 * all.mean_de2000, "{worst:?} {all:?}");
        assert_eq!(compare(&truth, &truth, [0, 0, 64, 64]).unwrap().mean_de2000, 0.0);
    }
}
