//! The files of a solution's maps.

use super::finish::Finished;
use super::options::NormalY;
use super::progress::{Progress, Stage};
use crate::files::FileError;
use crate::solution;
use exr::prelude::{
    Compression, Encoding, Layer, LayerAttributes, LineOrder, SpecificChannels, Vec2, WritableImage,
};
use rayon::prelude::*;
use std::io::Write;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use weavelight_calibration::description::Image;

type Encoder<'a> = Box<dyn Fn() -> Result<(), FileError> + Send + Sync + 'a>;

/// Writes all maps into `folder`, several files at a time.
pub(crate) fn write_maps(
    folder: &Path,
    maps: &Finished,
    normal_y: NormalY,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<(), FileError> {
    let path = |name: &str| folder.join(name);
    let jobs: Vec<Encoder> = vec![
        Box::new(|| write_exr_rgb(&path(solution::NORMAL_EXR), &maps.normal)),
        Box::new(|| write_exr_rgb(&path(solution::ALBEDO_EXR), &maps.albedo)),
        Box::new(|| write_exr_y(&path(solution::CONFIDENCE_EXR), &maps.confidence)),
        Box::new(|| {
            write_png_rgb16(&path(solution::NORMAL_PNG), &maps.normal, |n| png_normal(n, normal_y))
        }),
        Box::new(|| write_png_rgb16(&path(solution::ALBEDO_PNG), &maps.albedo, png_albedo)),
        Box::new(|| write_png_grey8(&path(solution::MASK_PNG), &maps.mask)),
    ];
    let finished = AtomicUsize::new(0);
    let total = jobs.len();
    let results: Vec<Result<(), FileError>> = jobs
        .par_iter()
        .with_max_len(1)
        .map(|write| {
            let result = write();
            let done = finished.fetch_add(1, Ordering::Relaxed) + 1;
            progress(Progress { stage: Stage::Write, done, total });
            result
        })
        .collect();
    results.into_iter().collect()
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

fn png_albedo(rgb: [f32; 3]) -> [u16; 3] {
    rgb.map(|linear| to_u16(crate::raster::srgb::encode(linear.clamp(0.0, 1.0))))
}

fn to_u16(share: f32) -> u16 {
    // Casting clamps, and turns not-a-number into 0.
    (share * 65535.0).round() as u16
}

fn write_exr_rgb(path: &Path, image: &Image<[f32; 3]>) -> Result<(), FileError> {
    let channels = SpecificChannels::rgb(|place: Vec2<usize>| {
        let [r, g, b] = image.data[place.y() * image.width + place.x()];
        (r, g, b)
    });
    let layer =
        Layer::new((image.width, image.height), LayerAttributes::default(), LOSSLESS, channels);
    exr::image::Image::from_layer(layer)
        .write()
        .to_file(path)
        .map_err(|error| exr_error(path, &error))
}

fn write_exr_y(path: &Path, image: &Image<f32>) -> Result<(), FileError> {
    let channels = SpecificChannels::build()
        .with_channel("Y")
        .with_pixel_fn(|place: Vec2<usize>| (image.data[place.y() * image.width + place.x()],));
    let layer =
        Layer::new((image.width, image.height), LayerAttributes::default(), LOSSLESS, channels);
    exr::image::Image::from_layer(layer)
        .write()
        .to_file(path)
        .map_err(|error| exr_error(path, &error))
}

const LOSSLESS: Encoding = Encoding {
    compression: Compression::ZIP1,
    line_order: LineOrder::Increasing,
    ..Encoding::FAST_LOSSLESS
};

fn exr_error(path: &Path, error: &exr::error::Error) -> FileError {
    FileError::write(path, std::io::Error::other(error.to_string()))
}

fn write_png_rgb16(
    path: &Path,
    image: &Image<[f32; 3]>,
    encode: impl Fn([f32; 3]) -> [u16; 3],
) -> Result<(), FileError> {
    let row =
        |row: &[[f32; 3]]| row.iter().flat_map(|&p| encode(p)).flat_map(u16::to_be_bytes).collect();
    write_png(path, image, (png::ColorType::Rgb, png::BitDepth::Sixteen), row)
}

fn write_png_grey8(path: &Path, image: &Image<u8>) -> Result<(), FileError> {
    write_png(path, image, (png::ColorType::Grayscale, png::BitDepth::Eight), <[u8]>::to_vec)
}

fn write_png<T>(
    path: &Path,
    image: &Image<T>,
    (color, depth): (png::ColorType, png::BitDepth),
    bytes: impl Fn(&[T]) -> Vec<u8>,
) -> Result<(), FileError> {
    let io = |source| FileError::write(path, source);
    let png = |error: png::EncodingError| io(std::io::Error::other(error.to_string()));
    let file = std::io::BufWriter::new(std::fs::File::create(path).map_err(io)?);
    let mut encoder = png::Encoder::new(file, image.width as u32, image.height as u32);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header().map_err(png)?;
    let mut stream = writer.stream_writer().map_err(png)?;
    for row in image.data.chunks(image.width) {
        stream.write_all(&bytes(row)).map_err(io)?;
    }
    stream.finish().map_err(png)
}
