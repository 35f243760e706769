//! PNG in, through the `png` crate. PNG specification, third edition, 2025: what says more about colour goes before what says
//! less (4.3: cICP, iCCP, sRGB, then gAMA and cHRM).

use super::encoding::{Curve, Said, Tone};
use super::icc::said_by_icc;
use super::picture::{Picture, Values, color_channels, split_alpha};
use super::primaries::{BT_709, D65, linear_srgb_from};
use super::{PictureError, limits};
use png::{BitDepth, CodingIndependentCodePoints, ColorType, Info, ScaledFloat};
use std::io::Cursor;

/// # Errors
/// Anything that is no sound PNG.
pub(super) fn decode(bytes: &[u8]) -> Result<Picture, PictureError> {
    let damaged = |error: png::DecodingError| PictureError::damaged(error.to_string());
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    let header = decoder.read_header_info().map_err(damaged)?;
    let row = header.raw_row_length() as u64;
    limits::check_packed([header.width.into(), header.height.into()], row, bytes.len())?;
    decoder.set_limits(png::Limits { bytes: 64 << 20 });
    let mut reader = decoder.read_info().map_err(damaged)?;
    let info = reader.info();
    let (said, significant_bits) = (said(info), significant_bits(info));
    let size =
        reader.output_buffer_size().ok_or_else(|| PictureError::damaged("its size overflows"))?;
    let mut data = vec![0; size];
    let frame = reader.next_frame(&mut data).map_err(damaged)?;
    data.truncate(frame.buffer_size());
    let (width, height, stored) =
        (frame.width as usize, frame.height as usize, frame.color_type.samples());
    let (values, alpha, full_scale) = match frame.bit_depth {
        BitDepth::Sixteen => {
            let words = data.as_chunks().0.iter().map(|&two| u16::from_be_bytes(two)).collect();
            let (values, alpha) = split_alpha(words, stored, |alpha| f32::from(alpha) / 65_535.0);
            (Values::U16(values), alpha, 65_535.0)
        }
        _ => {
            let (values, alpha) = split_alpha(data, stored, |alpha| f32::from(alpha) / 255.0);
            (Values::U8(values), alpha, 255.0)
        }
    };
    let picture = Picture::plain([width, height], color_channels(stored), values, full_scale);
    Ok(Picture { alpha, said, significant_bits, ..picture })
}

/// Of 16, where the file says fewer in every colour channel.
fn significant_bits(info: &Info) -> Option<u8> {
    let colors = match info.color_type {
        ColorType::Grayscale | ColorType::GrayscaleAlpha => 1,
        ColorType::Rgb | ColorType::Rgba => 3,
        ColorType::Indexed => return None,
    };
    let bits = info.sbit.as_ref()?.get(..colors)?.iter().copied().max()?;
    (info.bit_depth == BitDepth::Sixteen && (1..16).contains(&bits)).then_some(bits)
}

fn said(info: &Info) -> Said {
    let numbers = |(x, y): (ScaledFloat, ScaledFloat)| {
        [x, y].map(|value| f64::from(value.into_scaled()) / 100_000.0)
    };
    if let Some(points) = &info.coding_independent_code_points {
        return said_by_code_points(points);
    }
    if let Some(profile) = &info.icc_profile {
        return said_by_icc(profile);
    }
    if info.srgb.is_some() {
        let primaries = linear_srgb_from(BT_709, D65);
        return Said::known(Curve::Srgb, "its sRGB chunk").with_primaries(primaries);
    }
    let primaries = info.chrm_chunk.as_ref().and_then(|chunk| {
        let corners = [chunk.red, chunk.green, chunk.blue].map(numbers);
        linear_srgb_from(corners, numbers(chunk.white))
    });
    let said = match info.gama_chunk.map(ScaledFloat::into_scaled) {
        None if primaries.is_none() => return Said::default(),
        None => Said { by: "its cHRM chunk".to_owned(), ..Said::default() },
        Some(0) => Said::unreadable("it is 0", "its gAMA chunk"),
        Some(100_000) => Said::known(Curve::Linear, "its gAMA chunk"),
        // 1/2.2 is what sRGB pictures say (specification, 11.3.2.5).
        Some(45_454..=45_456) => Said::known(Curve::Srgb, "its gAMA chunk"),
        Some(scaled) => {
            let tone = || Tone::Gamma(100_000.0 / f64::from(scaled));
            Said::known(Curve::from_tones([tone(), tone(), tone()]), "its gAMA chunk")
        }
    };
    said.with_primaries(primaries)
}

/// ITU-T H.273, tables 2 and 3.
fn said_by_code_points(points: &CodingIndependentCodePoints) -> Said {
    let by = "its cICP chunk";
    let tone = |tone: Tone| Curve::from_tones([tone.clone(), tone.clone(), tone]);
    let curve = match points.transfer_function {
        1 | 6 | 14 | 15 => tone(Tone::bt_709()),
        4 => tone(Tone::Gamma(2.2)),
        5 => tone(Tone::Gamma(2.8)),
        8 => Curve::Linear,
        13 => Curve::Srgb,
        16 => return Said::unreadable("PQ is not read", by),
        18 => return Said::unreadable("HLG is not read", by),
        other => return Said::unreadable(format!("transfer function {other} is not read"), by),
    };
    if !points.is_video_full_range_image {
        return Said::unreadable("narrow range is not read", by);
    }
    let primaries = match points.color_primaries {
        1 => Some((BT_709, D65)),
        5 => Some(([[0.64, 0.33], [0.29, 0.60], [0.15, 0.06]], D65)),
        6 | 7 => Some(([[0.630, 0.340], [0.310, 0.595], [0.155, 0.070]], D65)),
        9 => Some(([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]], D65)),
        11 => Some(([[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]], [0.314, 0.351])),
        12 => Some(([[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]], D65)),
        _ => None,
    };
    let matrix = primaries.and_then(|(corners, white)| linear_srgb_from(corners, white));
    Said::known(curve, by).with_primaries(matrix)
}
