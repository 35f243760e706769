//! TIFF and BigTIFF in.
//!
//! Written here because the `tiff` crate refuses 9 to 15 and 24 bits, palettes and ZSTD, and undoes predictors over the wrong
//! number of channels where there is more than colour. It is asked where a picture is compressed as JPEG.
//!
//! Adobe, "TIFF revision 6.0", 1992, and its technical notes.

mod directory;
mod layout;
mod library;
mod page;
mod said;
mod samples;
mod segments;

use self::directory::{Directory, File, tag};
use self::layout::{Colors, Format, Layout};
use self::samples::Stored;
use self::segments::Segments;
use super::picture::{Alpha, Picture, Values};
use super::{PictureError, limits};

/// # Errors
/// Anything that is no sound TIFF of one picture, grey or RGB.
pub(super) fn decode(bytes: &[u8]) -> Result<Picture, PictureError> {
    let no_tiff = || PictureError::damaged("it has no TIFF directory");
    let file = File::new(bytes).ok_or_else(no_tiff)?;
    let directories = file.directories();
    if directories.is_empty() {
        return Err(no_tiff());
    }
    let page = page::picture(&directories, bytes.len())?;
    if page.integer(tag::COMPRESSION) == Some(7) {
        return library::decode(bytes, std::ptr::eq(page, &directories[0]), page);
    }
    let layout = Layout::parse(page)?;
    check_size(&layout, bytes.len())?;
    let segments = Segments::parse(file, page, &layout)?;
    let (values, full_scale, alpha) = match (layout.format, layout.bits) {
        (Format::Unsigned, ..=8) => {
            let (colors, alpha) = colors::<u8>(file, page, &layout, &segments)?;
            let full = if layout.colors == Colors::Palette { 255.0 } else { full_scale(&layout) };
            (Values::U8(colors), full as f32, alpha)
        }
        (Format::Unsigned, ..=16) => {
            let (colors, alpha) = colors::<u16>(file, page, &layout, &segments)?;
            (Values::U16(colors), full_scale(&layout) as f32, alpha)
        }
        (Format::Unsigned, _) => {
            let (colors, alpha) = colors::<u32>(file, page, &layout, &segments)?;
            let share = |value: u32| (f64::from(value) / full_scale(&layout)) as f32;
            (Values::F32(colors.into_iter().map(share).collect()), 1.0, alpha)
        }
        (Format::Float, _) => {
            let (colors, alpha) = colors::<u32>(file, page, &layout, &segments)?;
            (Values::F32(colors.into_iter().map(f32::from_bits).collect()), f32::INFINITY, alpha)
        }
    };
    let channels = if layout.colors == Colors::Palette { 3 } else { layout.colors.count() };
    Ok(Picture {
        alpha,
        said: said::said(page, &layout),
        significant_bits: said::significant_bits(page, &layout),
        ..Picture::plain([layout.width, layout.height], channels, values, full_scale)
    })
}

/// The colours of each pixel, black as zero, palettes expanded; and the alpha.
fn colors<T: Stored>(
    file: File,
    page: &Directory,
    layout: &Layout,
    segments: &Segments,
) -> Result<(Vec<T>, Option<Alpha>), PictureError> {
    let mut samples = samples::read(file, layout, segments)?;
    let alpha = alpha(layout, &samples);
    if layout.colors == Colors::Palette {
        samples = expand(page.integers(tag::COLOR_MAP), layout, &samples)?;
    } else {
        keep_colors(layout, &mut samples);
    }
    Ok((samples, alpha))
}

/// Nothing is allocated that the file cannot fill. ZSTD has no bound of its own.
fn check_size(layout: &Layout, bytes: usize) -> Result<(), PictureError> {
    let size = [layout.width as u64, layout.height as u64];
    match layout.compression {
        50_000 => limits::check(size[0], size[1], layout.samples, usize::MAX),
        _ if layout.bits < 8 => {
            let row =
                size[0].saturating_mul(layout.samples as u64 * u64::from(layout.bits)).div_ceil(8);
            limits::check_packed(size, row, bytes)
        }
        _ => limits::check(size[0], size[1], layout.samples, bytes),
    }
}

/// The largest number that a sample can hold; 1 for floating point.
fn full_scale(layout: &Layout) -> f64 {
    match layout.format {
        Format::Float => 1.0,
        Format::Unsigned => f64::from(u32::MAX >> (32 - layout.bits)),
    }
}

fn alpha<T: Stored>(layout: &Layout, samples: &[T]) -> Option<Alpha> {
    let (at, premultiplied) = layout.alpha?;
    let opacity = |value: u32| match layout.format {
        Format::Float => f32::from_bits(value),
        Format::Unsigned => (f64::from(value) / full_scale(layout)) as f32,
    };
    let values =
        samples.iter().skip(at).step_by(layout.samples).map(|value| opacity(value.number()));
    let values: Vec<f32> = values.collect();
    // A channel that is not named and empty is a filler.
    let counts = layout.alpha_named || values.iter().any(|&alpha| alpha > 0.0);
    counts.then_some(Alpha { values, premultiplied })
}

/// Leaves the colours of each pixel, black as zero.
fn keep_colors<T: Stored>(layout: &Layout, samples: &mut Vec<T>) {
    let count = layout.colors.count();
    if count < layout.samples {
        let pixels = samples.len() / layout.samples;
        for k in 0..pixels * count {
            samples[k] = samples[k / count * layout.samples + k % count];
        }
        samples.truncate(pixels * count);
    }
    if layout.colors == Colors::InvertedGrey {
        let full = full_scale(layout) as u32;
        samples.iter_mut().for_each(|value| *value = T::from_number(full - value.number()));
    }
}

/// TIFF 6.0, section 5: all reds, all greens, all blues, 65535 for full.
fn expand<T: Stored>(
    table: Option<Vec<u64>>,
    layout: &Layout,
    samples: &[T],
) -> Result<Vec<T>, PictureError> {
    let colors = 1_usize << layout.bits;
    let table = table.filter(|table| layout.bits <= 8 && table.len() == 3 * colors);
    let table = table.ok_or_else(|| PictureError::damaged("its palette does not fit its bits"))?;
    // Old programs wrote bytes into the table.
    let step = if table.iter().all(|&value| value < 256) { 1 } else { 257 };
    let byte = |value: u64| T::from_number(((value + step / 2) / step).min(255) as u32);
    let indices = samples.iter().step_by(layout.samples);
    Ok(indices
        .flat_map(|k| [0, 1, 2].map(|c| byte(table[c * colors + k.number() as usize])))
        .collect())
}
