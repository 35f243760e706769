//! OpenEXR files of several parts, levels, line orders and windows, through the `exr` crate's writer.

use super::check_unsupported;
use crate::raster::{decode_exr, decode_picture};
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds,
    Layer, LayerAttributes, LineOrder, SmallVec, Vec2, WritableImage, f16,
};
use std::io::Cursor;

fn value(channel: usize, k: usize) -> f32 {
    channel as f32 + 0.25 * k as f32
}

fn layer(
    name: &str,
    names: &[&str],
    size: [usize; 2],
    encoding: Encoding,
) -> Layer<AnyChannels<FlatSamples>> {
    let channel = |(c, name): (usize, &&str)| {
        let values = (0..size[0] * size[1]).map(|k| value(c, k)).collect();
        AnyChannel::new(*name, FlatSamples::F32(values))
    };
    let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> =
        names.iter().enumerate().map(channel).collect();
    let attributes = LayerAttributes::named(name);
    Layer::new((size[0], size[1]), attributes, encoding, AnyChannels::sort(channels))
}

fn bytes(attributes: ImageAttributes, layers: Vec<Layer<AnyChannels<FlatSamples>>>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let layers: SmallVec<[_; 2]> = layers.into_iter().collect();
    Image::from_layers(attributes, layers).write().non_parallel().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

fn window(width: usize, height: usize) -> ImageAttributes {
    ImageAttributes::new(IntegerBounds::new((0, 0), (width, height)))
}

const RGB: [&str; 3] = ["B", "G", "R"];

#[test]
fn parts_have_their_names_before_their_channels() {
    let encoding = Encoding::FAST_LOSSLESS;
    let file = bytes(
        window(4, 3),
        vec![
            layer("beauty", &RGB, [4, 3], encoding),
            layer("normal", &["X", "Y", "Z"], [4, 3], encoding),
        ],
    );
    let exr = decode_exr(&file).unwrap();
    assert!(exr.channel("beauty.R").is_some() && exr.channel("normal.X").is_some(), "{exr:?}");
    // One of the two is a photograph.
    assert_eq!(decode_picture(&file).unwrap().channels, 3);
    let file = bytes(
        window(4, 3),
        vec![layer("a", &RGB, [4, 3], encoding), layer("b", &RGB, [4, 3], encoding)],
    );
    check_unsupported(&file, "several layers (a, b)");
}

#[test]
fn tiles_and_decreasing_lines() {
    let tiles = Encoding { blocks: Blocks::Tiles(Vec2(16, 16)), ..Encoding::FAST_LOSSLESS };
    let down = Encoding { line_order: LineOrder::Decreasing, ..Encoding::SMALL_LOSSLESS };
    for encoding in [tiles, down, Encoding::UNCOMPRESSED] {
        let exr = decode_exr(&bytes(window(40, 21), vec![layer("", &["Y"], [40, 21], encoding)]))
            .unwrap();
        let expected: Vec<f32> = (0..40 * 21).map(|k| value(0, k)).collect();
        assert_eq!(exr.channel("Y"), Some(expected.as_slice()), "{encoding:?}");
    }
}

#[test]
fn halves_and_integers_become_floats() {
    let file = |samples: FlatSamples| {
        let channels = AnyChannels::sort([AnyChannel::new("Y", samples)].into_iter().collect());
        let layer =
            Layer::new((2, 1), LayerAttributes::default(), Encoding::UNCOMPRESSED, channels);
        bytes(window(2, 1), vec![layer])
    };
    let half = file(FlatSamples::F16(vec![f16::from_f32(0.5), f16::INFINITY]));
    assert_eq!(decode_exr(&half).unwrap().channel("Y"), Some(&[0.5, f32::INFINITY][..]));
    let whole = file(FlatSamples::U32(vec![7, 1 << 20]));
    assert_eq!(decode_exr(&whole).unwrap().channel("Y"), Some(&[7.0, 1_048_576.0][..]));
}

#[test]
fn a_window_that_is_not_filled_is_no_frame() {
    let place = |at: [i32; 2], size: [usize; 2]| {
        let mut layer = layer("", &["Y"], size, Encoding::UNCOMPRESSED);
        layer.attributes.layer_position = Vec2(at[0], at[1]);
        decode_picture(&bytes(window(4, 3), vec![layer])).unwrap().no_frame
    };
    assert_eq!(place([0, 0], [4, 3]), None);
    assert_eq!(place([-2, -1], [8, 6]), None);
    for (at, size) in [([1, 0], [4, 3]), ([0, 0], [4, 2]), ([9, 9], [4, 3]), ([-9, 0], [4, 3])] {
        let what = place(at, size).unwrap();
        assert!(what.contains("covers only part of its display window (4 x 3)"), "{what}");
    }
    let mut attributes = window(4, 3);
    attributes.pixel_aspect = 2.0;
    let wide = bytes(attributes, vec![layer("", &["Y"], [4, 3], Encoding::UNCOMPRESSED)]);
    let what = decode_picture(&wide).unwrap().no_frame.unwrap();
    assert!(what.contains("2 times as wide as high"), "{what}");
}

#[test]
fn alpha_of_zero_everywhere_is_none() {
    let file = |alpha: f32| {
        let plane = |value: f32| FlatSamples::F32(vec![value; 2]);
        let mut a = vec![alpha; 2];
        a[1] = alpha.min(0.5);
        let channels =
            [("A", FlatSamples::F32(a)), ("B", plane(1.0)), ("G", plane(1.0)), ("R", plane(1.0))];
        let channels = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples));
        let layer = Layer::new(
            (2, 1),
            LayerAttributes::default(),
            Encoding::UNCOMPRESSED,
            AnyChannels::sort(channels.collect()),
        );
        decode_picture(&bytes(window(2, 1), vec![layer])).unwrap().alpha
    };
    assert_eq!(file(0.0), None);
    let alpha = file(1.0).unwrap();
    assert_eq!((alpha.values, alpha.premultiplied), (vec![1.0, 0.5], true));
}

#[test]
fn other_kinds_are_named() {
    let mut deep = bytes(window(4, 3), vec![layer("", &["Y"], [4, 3], Encoding::UNCOMPRESSED)]);
    deep[5] |= 0x08;
    check_unsupported(&deep, "a deep OpenEXR picture");
    let chroma =
        bytes(window(4, 4), vec![layer("", &["BY", "RY", "Y"], [4, 4], Encoding::UNCOMPRESSED)]);
    check_unsupported(&chroma, "luminance and chroma");
    let vector =
        bytes(window(4, 4), vec![layer("", &["X", "Y", "Z"], [4, 4], Encoding::UNCOMPRESSED)]);
    check_unsupported(&vector, "a vector or CIE XYZ");
}
