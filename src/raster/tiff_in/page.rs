//! Which picture of a TIFF file is the one: never a thumbnail, and none of many.

use super::super::PictureError;
use super::directory::{Directory, tag};

/// NewSubfileType: a reduced copy of another picture of the file.
const REDUCED: u64 = 1;
/// NewSubfileType: a transparency mask for another picture of the file.
const TRANSPARENCY: u64 = 4;
/// A picture with this many times fewer pixels than another in its file is a copy of it, whether it says so or not.
const THUMBNAIL: u64 = 4;
/// A picture that would fill this part of its file, or less, is not what the file is about.
const SMALLEST_SHARE: u64 = 16;
/// Files up to this length may hold anything beside a tiny picture.
const SMALL_FILE: u64 = 1 << 16;

/// The directory of the picture.
///
/// # Errors
/// None, several, or nothing but a thumbnail.
pub(super) fn picture<'a>(
    directories: &'a [Directory<'a>],
    file_bytes: usize,
) -> Result<&'a Directory<'a>, PictureError> {
    let kind = |directory: &Directory| directory.integer(tag::NEW_SUBFILE_TYPE).unwrap_or(0);
    let area = |directory: &Directory| {
        directory.size().map_or(0, |[width, height]| width.saturating_mul(height))
    };
    let pictures: Vec<&Directory> = directories
        .iter()
        .filter(|directory| directory.size().is_some() && kind(directory) & TRANSPARENCY == 0)
        .collect();
    let largest = pictures.iter().map(|page| area(page)).max().unwrap_or(0);
    let full: Vec<&Directory> = pictures
        .iter()
        .copied()
        .filter(|page| kind(page) & REDUCED == 0 && area(page) > largest / THUMBNAIL)
        .collect();
    match full[..] {
        [only] => not_a_thumbnail(only, file_bytes as u64).map(|()| only),
        [] if pictures.is_empty() => match directories.iter().find(|page| page.size().is_some()) {
            Some(_) => Err(PictureError::unsupported(
                "a TIFF of nothing but a transparency mask",
                "save the picture itself",
            )),
            None => Err(PictureError::damaged("it has no directory of a picture")),
        },
        [] => Err(only_a_thumbnail(pictures[0])),
        _ => {
            let what = format!("a TIFF of {} pictures", full.len());
            Err(PictureError::unsupported(what, "save each picture as a file of its own"))
        }
    }
}

fn only_a_thumbnail(page: &Directory) -> PictureError {
    let [width, height] = page.size().unwrap_or_default();
    PictureError::unsupported(
        format!("a TIFF whose only picture is a reduced copy ({width} x {height})"),
        "convert it to DNG if it is a RAW file, or save the picture itself as a 16-bit TIFF",
    )
}

/// RAW files of unknown kind hold a small picture to look at, and the sensor's data where no reader of pictures finds them.
fn not_a_thumbnail(page: &Directory, file_bytes: u64) -> Result<(), PictureError> {
    let [width, height] = page.size().unwrap_or_default();
    let samples = page.integer(tag::SAMPLES_PER_PIXEL).unwrap_or(1);
    let bits = page.integer(tag::BITS_PER_SAMPLE).unwrap_or(1);
    let pixels = width.saturating_mul(height);
    let picture = pixels.saturating_mul(samples).saturating_mul(bits) / 8;
    // Profiles and an editor's layers say nothing of sensor data.
    let beside = [
        tag::TRANSFER_FUNCTION,
        tag::COLOR_MAP,
        tag::ICC_PROFILE,
        tag::XMP,
        tag::IPTC,
        tag::PHOTOSHOP,
        tag::PHOTOSHOP_LAYERS,
    ];
    let beside: usize = beside.iter().filter_map(|&tag| page.bytes(tag)).map(<[u8]>::len).sum();
    let rest = file_bytes.saturating_sub(beside as u64);
    if rest > SMALL_FILE && picture < rest / SMALLEST_SHARE {
        return Err(only_a_thumbnail(page));
    }
    Ok(())
}
