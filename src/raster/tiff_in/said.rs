//! What a TIFF says of its numbers.

use super::super::encoding::{Curve, Said, Tone};
use super::super::icc::said_by_icc;
use super::super::primaries::linear_srgb_from;
use super::directory::{Directory, tag};
use super::layout::{Colors, Layout};

/// The ICC profile, else the older tags.
pub(super) fn said(page: &Directory, layout: &Layout) -> Said {
    if let Some(profile) = page.bytes(tag::ICC_PROFILE) {
        return said_by_icc(profile);
    }
    if page.has(tag::GRAY_RESPONSE_CURVE) {
        return Said::unreadable("it gives densities of ink", "its GrayResponseCurve tag");
    }
    let primaries = (layout.colors == Colors::Rgb).then(|| primaries(page)).flatten();
    match page.integers(tag::TRANSFER_FUNCTION) {
        Some(table) => transfer_function(&table, layout).with_primaries(primaries),
        None if primaries.is_none() => Said::default(),
        None => Said { by: "its PrimaryChromaticities tag".to_owned(), ..Said::default() }
            .with_primaries(primaries),
    }
}

/// TIFF 6.0, section 20: one table, or one for each of red, green and blue.
fn transfer_function(table: &[u64], layout: &Layout) -> Said {
    let by = "its TransferFunction tag";
    let length = 1_usize << layout.bits.min(16);
    let tone = |table: &[u64]| Tone::Table(table.iter().map(|&v| v.min(65_535) as u16).collect());
    let tones = match table.len() {
        n if n == length => [table; 3],
        n if n == 3 * length => [0, 1, 2].map(|c| &table[c * length..(c + 1) * length]),
        n => return Said::unreadable(format!("it has {n} entries"), by),
    };
    let tones = tones.map(tone);
    if tones.iter().all(Tone::is_sound) {
        Said::known(Curve::from_tones(tones), by)
    } else {
        Said::unreadable("it is no curve from black to white", by)
    }
}

fn primaries(page: &Directory) -> Option<[[f64; 3]; 3]> {
    let corners: [f64; 6] = page.ratios(tag::PRIMARY_CHROMATICITIES)?.try_into().ok()?;
    let white: [f64; 2] = page.ratios(tag::WHITE_POINT)?.try_into().ok()?;
    let [rx, ry, gx, gy, bx, by] = corners;
    linear_srgb_from([[rx, ry], [gx, gy], [bx, by]], white)
}

/// Where a file of 16 bits gives a largest sample of all ones: that many.
pub(super) fn significant_bits(page: &Directory, layout: &Layout) -> Option<u8> {
    let largest = [tag::S_MAX_SAMPLE_VALUE, tag::MAX_SAMPLE_VALUE]
        .into_iter()
        .find_map(|tag| page.integers(tag)?.into_iter().max())?;
    let bits = (9..16).find(|bits| largest == (1 << bits) - 1)?;
    (layout.bits == 16).then_some(bits)
}
