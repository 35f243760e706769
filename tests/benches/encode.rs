//! Time, size and peak memory of every way to write a solution's maps: `cargo bench --bench encode [-- 4928x3264]`.
//!
//! Run it again when an encoder changes; `raster` names the choice and the figures it rests on.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and stops at the first error"
)]

use exr::prelude::{
    Blocks, Compression, Encoding, Image as ExrImage, Layer, LayerAttributes, LineOrder,
    SpecificChannels, Vec2, WritableImage,
};
use png::{DeflateCompression, Filter};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;
use weavelight::raster::{PngContent, write_exr_rgb, write_png_rgb16};
use weavelight_calibration::description::Image;

type Map = Image<[f32; 3]>;

fn main() {
    let size =
        std::env::args().nth(1).filter(|text| text.contains('x')).unwrap_or("4928x3264".into());
    let (width, height) = size.split_once('x').unwrap();
    let (width, height) = (width.parse().unwrap(), height.parse().unwrap());
    let folder = tempfile::tempdir().unwrap();
    for (name, map) in [("normal", normals(width, height)), ("albedo", albedo(width, height))] {
        println!("{name}, {width} x {height}");
        run("  EXR, ours", folder.path(), |path| write_exr_rgb(path, &map).unwrap());
        for compression in [
            Compression::Uncompressed,
            Compression::RLE,
            Compression::ZIP1,
            Compression::ZIP16,
            Compression::PIZ,
        ] {
            run(&format!("  EXR, crate, {compression}"), folder.path(), |path| {
                crate_exr(path, &map, compression);
            });
        }
        run("  PNG, ours", folder.path(), |path| {
            write_png_rgb16(path, [width, height], PngContent::Data, |y, row| {
                row.iter_mut().zip(map.row(y)).for_each(|(out, pixel)| *out = sixteen_bits(*pixel));
            })
            .unwrap();
        });
        for deflate in [
            DeflateCompression::NoCompression,
            DeflateCompression::FdeflateUltraFast,
            DeflateCompression::Level(1),
            DeflateCompression::Level(3),
        ] {
            for filter in [Filter::Sub, Filter::Up, Filter::Paeth, Filter::Adaptive] {
                let name = format!("  PNG, crate, {deflate:?}, {filter:?}");
                run(&name, folder.path(), |path| crate_png(path, &map, deflate, filter));
            }
        }
    }
}

fn run(name: &str, folder: &Path, write: impl FnOnce(&Path)) {
    let path = folder.join("map");
    let start = Instant::now();
    write(&path);
    let seconds = start.elapsed().as_secs_f64();
    let megabytes = std::fs::metadata(&path).unwrap().len() as f64 / 1e6;
    println!("{name:50} {seconds:7.2} s {megabytes:8.1} MB   peak memory {} MB", peak_memory_mb());
}

/// Linux only; 0 elsewhere. It never falls, so only the first writer that raises it shows.
fn peak_memory_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM"));
    line.and_then(|line| line.split_whitespace().nth(1)?.parse::<u64>().ok()).unwrap_or(0) / 1024
}

/// About normally distributed, variance 1; splitmix64 (Steele et al. 2014), four uniform summands.
fn noise(i: usize) -> f32 {
    let mut z = (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    let uniform = |k: u32| (z >> (16 * k) & 0xffff) as f32 / 65_535.0 - 0.5;
    (0..4).map(uniform).sum::<f32>() * 3_f32.sqrt()
}

/// A weave with the noise of ten lights: 0.4 degrees.
fn normals(width: usize, height: usize) -> Map {
    let pixel = |i: usize| {
        let (u, v) = ((i % width) as f32 * 0.31, (i / width) as f32 * 0.29);
        let x = 0.4 * u.sin() * v.cos() + 0.005 * noise(2 * i);
        let y = 0.4 * v.sin() * u.cos() + 0.005 * noise(2 * i + 1);
        let length = (x * x + y * y + 1.0).sqrt();
        [x / length, y / length, 1.0 / length]
    };
    Image { width, height, data: (0..width * height).map(pixel).collect() }
}

/// Stripes with a noise of 0.4 %.
fn albedo(width: usize, height: usize) -> Map {
    let pixel = |i: usize| {
        let level = 0.4 + 0.1 * ((i % width) as f32 * 0.15).sin();
        [1.0, 0.8, 0.6]
            .map(|tint| level * tint * (1.0 + 0.004 * noise(3 * i + (tint * 10.0) as usize)))
    };
    Image { width, height, data: (0..width * height).map(pixel).collect() }
}

fn sixteen_bits(pixel: [f32; 3]) -> [u16; 3] {
    pixel.map(|value| ((value * 0.5 + 0.5) * 65_535.0 + 0.5) as u16)
}

fn crate_exr(path: &Path, map: &Map, compression: Compression) {
    let channels = SpecificChannels::rgb(|place: Vec2<usize>| {
        let [r, g, b] = *map.at(place.x(), place.y());
        (r, g, b)
    });
    let encoding =
        Encoding { compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let layer = Layer::new((map.width, map.height), LayerAttributes::default(), encoding, channels);
    let file = BufWriter::with_capacity(1 << 20, File::create(path).unwrap());
    ExrImage::from_layer(layer).write().to_buffered(file).unwrap();
}

fn crate_png(path: &Path, map: &Map, deflate: DeflateCompression, filter: Filter) {
    let file = BufWriter::with_capacity(1 << 20, File::create(path).unwrap());
    let mut encoder = png::Encoder::new(file, map.width as u32, map.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.set_deflate_compression(deflate);
    encoder.set_filter(filter);
    let mut writer = encoder.write_header().unwrap();
    let mut stream = writer.stream_writer_with_size(1 << 18).unwrap();
    let mut bytes = Vec::new();
    for y in 0..map.height {
        bytes.clear();
        bytes.extend(
            map.row(y).iter().flat_map(|&pixel| sixteen_bits(pixel)).flat_map(u16::to_be_bytes),
        );
        stream.write_all(&bytes).unwrap();
    }
    stream.finish().unwrap();
}
