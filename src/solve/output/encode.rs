//! The files of a solution's maps.

use crate::files::FileError;
use crate::raster::{
    PngContent, srgb, write_exr_rgb, write_exr_y, write_png_grey8, write_png_rgb16,
};
use crate::solution::{self, Finished, NormalY, Outputs};
use crate::solve::options::Options;
use crate::solve::progress::{Progress, Stage};
use rayon::prelude::*;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use weavelight_calibration::description::Image;

/// Names of the files in which these maps are.
pub(crate) fn map_files(outputs: Outputs) -> Vec<&'static str> {
    let Outputs { normal, albedo, shade, confidence, png } = outputs;
    let files = [
        (normal, solution::NORMAL_EXR),
        (albedo, solution::ALBEDO_EXR),
        (shade, solution::SHADE_EXR),
        (confidence, solution::CONFIDENCE_EXR),
        (normal && png, solution::NORMAL_PNG),
        (albedo && png, solution::ALBEDO_PNG),
        (true, solution::MASK_PNG),
    ];
    files.into_iter().filter(|(wanted, _)| *wanted).map(|(_, name)| name).collect()
}

/// Writes the maps that are asked for into `folder`, several files at a time.
pub(crate) fn write_maps(
    folder: &Path,
    maps: &Finished,
    options: &Options,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<(), FileError> {
    let table = srgb::Encode16::default();
    let write = |name: &str| {
        let path = folder.join(name);
        match name {
            solution::NORMAL_EXR => write_exr_rgb(&path, &maps.normal),
            solution::ALBEDO_EXR => write_exr_rgb(&path, &maps.albedo),
            solution::SHADE_EXR => write_exr_y(&path, &maps.shade),
            solution::CONFIDENCE_EXR => write_exr_y(&path, &maps.confidence),
            solution::NORMAL_PNG => {
                let encode = |n| png_normal(n, options.normal_y);
                write_png(&path, &maps.normal, PngContent::Data, encode)
            }
            solution::ALBEDO_PNG => {
                let encode = |rgb: [f32; 3]| rgb.map(|linear| table.encode(linear));
                write_png(&path, &maps.albedo, PngContent::Srgb, encode)
            }
            _ => write_png_grey8(&path, &maps.mask),
        }
    };
    let files = map_files(options.outputs);
    let finished = AtomicUsize::new(0);
    let total = files.len();
    let results: Vec<Result<(), FileError>> = files
        .par_iter()
        .with_max_len(1)
        .map(|name| {
            let result = write(name);
            let done = finished.fetch_add(1, Ordering::Relaxed) + 1;
            progress(Progress { stage: Stage::Write, done, total });
            result
        })
        .collect();
    results.into_iter().collect()
}

fn write_png(
    path: &Path,
    image: &Image<[f32; 3]>,
    content: PngContent,
    encode: impl Fn([f32; 3]) -> [u16; 3],
) -> Result<(), FileError> {
    write_png_rgb16(path, [image.width, image.height], content, |y, row| {
        row.iter_mut().zip(image.row(y)).for_each(|(out, value)| *out = encode(*value));
    })
}

/// 16-bit encoding of a normal: -1 to 1 becomes 0 to 65535. Where there is none, it points straight up, as engines need a
/// unit vector everywhere; the mask tells.
fn png_normal(normal: [f32; 3], normal_y: NormalY) -> [u16; 3] {
    let [x, y, z] = if normal == [0.0; 3] { [0.0, 0.0, 1.0] } else { normal };
    let y = match normal_y {
        NormalY::Up => y,
        NormalY::Down => -y,
    };
    [x, y, z].map(|component| to_u16(component * 0.5 + 0.5))
}

fn to_u16(share: f32) -> u16 {
    // Casting clamps, and turns not-a-number into 0; rounding by hand, as `round` is a call of its own.
    (share * 65535.0 + 0.5) as u16
}
