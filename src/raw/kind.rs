//! Cameras' formats by name, for what no decoder here reads.

use super::DecodeError;
use super::error::CONVERT_TO_DNG;
use super::tags::{Directory, Tiff, tag};

/// Beginning of Fujifilm's files.
pub(crate) const RAF: &[u8] = b"FUJIFILMCCD-RAW";

/// What Fujifilm's compressed sensor data begin with.
const RAF_COMPRESSED: &[u8] = b"IS\x01";

/// First bytes of formats that are not TIFF: where, which, name.
const SIGNATURES: [(usize, &[u8], &str); 14] = [
    (4, b"ftypcrx ", "a Canon CR3 file"),
    (6, b"HEAPCCDR", "a Canon CRW file"),
    (0, RAF, "a Fujifilm RAF file"),
    (0, b"FOVb", "a Sigma X3F file"),
    (0, b"\0MRM", "a Minolta MRW file"),
    (0, b"IIRO", "an Olympus ORF file"),
    (0, b"IIRS", "an Olympus ORF file"),
    (0, b"MMOR", "an Olympus ORF file"),
    (0, b"IIU\0", "a Panasonic RW2 file"),
    (8, b"IIII", "a Phase One IIQ file"),
    (8, b"MMMM", "a Phase One IIQ file"),
    (0, b"ARRI", "an ARRIRAW file"),
    (4, b"RED1", "a RED R3D film"),
    (4, b"RED2", "a RED R3D film"),
];

/// Makers whose TIFF-like files have a name of their own.
const MAKERS: [(&str, &str); 14] = [
    ("nikon", "a Nikon NEF file"),
    ("canon", "a Canon CR2 file"),
    ("sony", "a Sony ARW file"),
    ("pentax", "a Pentax PEF file"),
    ("ricoh", "a Ricoh PEF file"),
    ("samsung", "a Samsung SRW file"),
    ("hasselblad", "a Hasselblad 3FR or FFF file"),
    ("leaf", "a Leaf MOS file"),
    ("mamiya", "a Mamiya MEF file"),
    ("seiko epson", "an Epson ERF file"),
    ("eastman kodak", "a Kodak DCR or KDC file"),
    ("kodak", "a Kodak DCR or KDC file"),
    ("phase one", "a Phase One IIQ file"),
    ("olympus", "an Olympus ORF file"),
];

/// TIFF compressions of sensor data that only their makers' programs write, and others without a decoder here.
const COMPRESSIONS: [(u32, &str); 15] = [
    (9, "VC-5 compression"),
    (99, "JPEG compression"),
    (262, "Kodak's compression"),
    (32_767, "Sony's lossy compression"),
    (32_769, "a camera's own packing"),
    (32_770, "Samsung's compression"),
    (32_772, "Samsung's compression"),
    (32_773, "a camera's own packing"),
    (32_867, "Kodak's compression"),
    (34_316, "Panasonic's compression"),
    (34_713, "Nikon's compression"),
    (34_892, "lossy JPEG compression"),
    (52_546, "JPEG XL compression"),
    (65_000, "Kodak's compression"),
    (65_535, "Pentax's compression"),
];

/// What to do with the files of sensors with three layers, which no DNG converter reads.
const FOVEON: &str = "save it as a 16-bit linear TIFF, or have the camera write DNG";

/// The format's name, and the camera's where the file says it; `None` for what is no camera's.
pub(crate) fn name(bytes: &[u8], tiff: Option<&Tiff>) -> Option<String> {
    let begins =
        |at: usize, with: &[u8]| bytes.get(at..).is_some_and(|rest| rest.starts_with(with));
    let signed =
        SIGNATURES.iter().find(|(at, with, _)| begins(*at, with)).map(|(_, _, name)| *name);
    let text = |tag| tiff.and_then(|tiff| tiff.with(tag)).and_then(|found| found.text(tag));
    let (make, model) = (text(tag::MAKE), text(tag::MODEL));
    let made = || {
        let make = make.as_deref()?.to_lowercase();
        MAKERS.iter().find(|(start, _)| make.starts_with(start)).map(|(_, name)| *name)
    };
    let name = signed.or_else(made).or_else(|| make.as_ref().map(|_| "a camera's RAW file"))?;
    let model = model.or_else(|| raf_model(bytes)).map(|model| short(&model));
    let of = match (name, model) {
        (_, None) => String::new(),
        ("a camera's RAW file", Some(model)) => {
            format!(" ({} {model})", short(make.as_deref().unwrap_or_default()))
        }
        (_, Some(model)) => format!(" ({model})"),
    };
    Some(format!("{name}{of}"))
}

/// Printable, and no longer than a name.
fn short(text: &str) -> String {
    text.chars().filter(|letter| !letter.is_control() && *letter != '"').take(40).collect()
}

fn raf_model(bytes: &[u8]) -> Option<String> {
    let text = bytes.strip_prefix(RAF)?.get(13..45)?.split(|&byte| byte == 0).next()?;
    let text = String::from_utf8_lossy(text).trim().to_owned();
    (!text.is_empty()).then_some(text)
}

/// The error for a camera's file that cannot be decoded; `why`, if known, as in "of a camera that is not known".
pub(crate) fn refused(bytes: &[u8], tiff: Option<&Tiff>, why: Option<&str>) -> DecodeError {
    let name = name(bytes, tiff).unwrap_or_else(|| "this RAW file".to_owned());
    let remedy = if bytes.starts_with(b"FOVb") { FOVEON } else { CONVERT_TO_DNG };
    let how = why.map(str::to_owned).or_else(|| {
        let directory = tiff?.sensor()?;
        compression(directory).map(|how| format!("with {how}"))
    });
    let how = how.map(|how| format!(" {how}")).unwrap_or_default();
    DecodeError::unsupported(format!("{name}{how}"), remedy)
}

/// Name of a directory's compression, where it is one that is not read.
pub(crate) fn compression(directory: &Directory) -> Option<&'static str> {
    let number = directory.integer(tag::COMPRESSION)?;
    COMPRESSIONS.iter().find(|(known, _)| *known == number).map(|(_, name)| *name)
}

/// Whether a TIFF-like file is a camera's container, of which a picture reader would find the thumbnail at best.
pub(crate) fn is_container(bytes: &[u8], tiff: &Tiff) -> bool {
    const VENDORS: [u32; 9] =
        [32_767, 32_769, 32_770, 32_772, 34_316, 34_713, 34_892, 65_000, 65_535];
    let sensor = |directory: &Directory| {
        matches!(directory.integer(tag::PHOTOMETRIC), Some(32_803 | 34_892))
            || directory.integer(tag::COMPRESSION).is_some_and(|number| VENDORS.contains(&number))
    };
    let signed =
        bytes.get(8..10) == Some(b"CR") || matches!(bytes.get(8..12), Some(b"IIII" | b"MMMM"));
    signed || tiff.directories.iter().any(sensor) || is_mostly_hidden(bytes, tiff)
}

/// Whether a camera's file holds much more than its directories say: a picture in it is not what the file is about.
fn is_mostly_hidden(bytes: &[u8], tiff: &Tiff) -> bool {
    /// Shorter files may be all head.
    const LEAST_BYTES: usize = 64 << 10;
    let has_maker = tiff.with(tag::MAKE).is_some();
    let said: usize = tiff.directories.iter().map(Directory::bytes_described).sum();
    has_maker && bytes.len() > LEAST_BYTES && said < bytes.len() / 4
}

/// Fujifilm's lossless and lossy compressed files, which rawloader would read as plain samples.
pub(crate) fn is_compressed_raf(bytes: &[u8]) -> bool {
    let number = |at: usize| {
        let four: [u8; 4] = bytes.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_be_bytes(four) as usize)
    };
    let data = || {
        let block = bytes.get(number(100)?..)?;
        let tiff = Tiff::parse(block).ok()?;
        let first = tiff.directories.first()?;
        let inner = first.integer(0xf000)? as usize;
        let (directory, _) = Directory::parse(tiff.block, inner)?;
        block.get(directory.integer(0xf007)? as usize..)
    };
    bytes.starts_with(RAF) && data().is_some_and(|data| data.starts_with(RAF_COMPRESSED))
}
