//! OpenEXR out: 32-bit float scan lines, uncompressed.
//!
//! Measured on normals and albedo of 4928 x 3264 with realistic noise (`cargo bench --bench encode`): the noise fills the
//! mantissa, so ZIP takes 10 to 18 s to save 1 to 6 % and PIZ 6 to 11 s to save 14 to 28 %, where uncompressed lines take
//! a third of a second. Written here rather than by the `exr` crate, which takes half again as long for the same bytes.
//!
//! "OpenEXR file layout", Academy Software Foundation.

use crate::files::FileError;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use weavelight_calibration::description::Image;

/// Bytes gathered before they go to the file.
const BUFFER: usize = 1 << 20;

/// Writes R, G, B, 32-bit float. The file grows in place: whoever must not show half a file writes it elsewhere first.
///
/// # Errors
/// No space, or not allowed.
pub fn write_exr_rgb(path: &Path, image: &Image<[f32; 3]>) -> Result<(), FileError> {
    write_exr(path, [image.width, image.height], &["R", "G", "B"], |channel, y, row| {
        row.iter_mut().zip(image.row(y)).for_each(|(value, pixel)| *value = pixel[channel]);
    })
}

/// Writes Y, 32-bit float; see [`write_exr_rgb`].
///
/// # Errors
/// No space, or not allowed.
pub fn write_exr_y(path: &Path, image: &Image<f32>) -> Result<(), FileError> {
    write_exr(path, [image.width, image.height], &["Y"], |_, y, row| {
        row.copy_from_slice(image.row(y));
    })
}

/// Writes any channels, 32-bit float, row by row as `fill` gives them: `fill(channel, y, row)` with the channel's place in
/// `names`. Memory holds about a megabyte.
///
/// # Errors
/// No space, or not allowed.
pub fn write_exr(
    path: &Path,
    size: [usize; 2],
    names: &[&str],
    fill: impl Fn(usize, usize, &mut [f32]),
) -> Result<(), FileError> {
    let failed = |source| FileError::write(path, source);
    let mut file = File::create(path).map_err(failed)?;
    encode_exr(&mut file, size, names, fill).map_err(failed)
}

/// [`write_exr`] into anything.
///
/// # Errors
/// What `out` reports.
pub fn encode_exr(
    out: &mut impl Write,
    [width, height]: [usize; 2],
    names: &[&str],
    fill: impl Fn(usize, usize, &mut [f32]),
) -> std::io::Result<()> {
    let mut buffer = preamble([width, height], names)?;
    let order = in_order(names);
    let row_bytes = (width * names.len() * 4) as i32;
    let mut row = vec![0.0; width];
    for y in 0..height {
        buffer.extend((y as i32).to_le_bytes());
        buffer.extend(row_bytes.to_le_bytes());
        for &channel in &order {
            fill(channel, y, &mut row);
            buffer.extend(row.iter().flat_map(|value| value.to_le_bytes()));
        }
        if buffer.len() >= BUFFER {
            out.write_all(&buffer)?;
            buffer.clear();
        }
    }
    out.write_all(&buffer)?;
    out.flush()
}

/// The format wants channels in the order of their names.
fn in_order(names: &[&str]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..names.len()).collect();
    order.sort_by_key(|&channel| names[channel]);
    order
}

/// Everything before the rows: header and table of the rows' places.
pub(super) fn preamble([width, height]: [usize; 2], names: &[&str]) -> std::io::Result<Vec<u8>> {
    let too_large = |_| {
        std::io::Error::new(std::io::ErrorKind::InvalidInput, "the picture is too large for EXR")
    };
    let row_bytes = i32::try_from(width * names.len() * 4).map_err(too_large)?;
    i32::try_from(height).map_err(too_large)?;
    let order = in_order(names);
    let mut buffer = header([width, height], order.iter().map(|&channel| names[channel]));
    let first = buffer.len() + 8 * height;
    let chunk = 8 + row_bytes as usize;
    (0..height).for_each(|y| buffer.extend(((first + y * chunk) as u64).to_le_bytes()));
    Ok(buffer)
}

/// Magic number, version and the attributes that every file must have.
fn header<'a>([width, height]: [usize; 2], names: impl Iterator<Item = &'a str>) -> Vec<u8> {
    let mut bytes = vec![0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
    let mut channels = Vec::new();
    for name in names {
        channels.extend(name.bytes().chain([0]));
        // 2: 32-bit float; not perceptually linear, three reserved bytes; every pixel in x and y.
        for number in [2_u32, 0, 1, 1] {
            channels.extend(number.to_le_bytes());
        }
    }
    channels.push(0);
    let window: Vec<u8> = [0, 0, width as i32 - 1, height as i32 - 1]
        .iter()
        .flat_map(|edge| edge.to_le_bytes())
        .collect();
    let one = 1_f32.to_le_bytes();
    for (name, kind, value) in [
        ("channels", "chlist", channels.as_slice()),
        ("compression", "compression", &[0]),
        ("dataWindow", "box2i", &window),
        ("displayWindow", "box2i", &window),
        ("lineOrder", "lineOrder", &[0]),
        ("pixelAspectRatio", "float", &one),
        ("screenWindowCenter", "v2f", &[0; 8]),
        ("screenWindowWidth", "float", &one),
    ] {
        bytes.extend(name.bytes().chain([0]).chain(kind.bytes()).chain([0]));
        bytes.extend((value.len() as u32).to_le_bytes());
        bytes.extend(value);
    }
    bytes.push(0);
    bytes
}

#[cfg(test)]
mod tests {
    use super::super::decode_exr;
    use super::*;

    fn value(channel: usize, x: usize, y: usize) -> f32 {
        (channel as f32 + 1.0) * 1e-3 + x as f32 - 7.5 * y as f32
    }

    fn check(size: [usize; 2], names: &[&str]) {
        let mut bytes = Vec::new();
        let fill = |channel, y, row: &mut [f32]| {
            row.iter_mut().enumerate().for_each(|(x, pixel)| *pixel = value(channel, x, y));
        };
        encode_exr(&mut bytes, size, names, fill).unwrap();
        let read = decode_exr(&bytes).unwrap();
        assert_eq!([read.width, read.height], size);
        assert_eq!(read.channels.len(), names.len());
        for (channel, name) in names.iter().enumerate() {
            let expected: Vec<f32> =
                (0..size[0] * size[1]).map(|i| value(channel, i % size[0], i / size[0])).collect();
            assert_eq!(read.channel(name), Some(expected.as_slice()), "{name}");
        }
    }

    /// Through the `exr` crate's reader, which is another's view of the format.
    #[test]
    fn what_is_written_is_read() {
        check([1, 1], &["Y"]);
        check([5, 3], &["R", "G", "B"]);
        check([300, 700], &["R", "G", "B"]);
        check([3, 5], &["depth.Z", "B", "normal.X", "A"]);
    }

    #[test]
    fn special_values_survive() {
        let values =
            [f32::NAN, f32::INFINITY, -f32::INFINITY, -0.0, f32::MIN_POSITIVE / 2.0, f32::MAX];
        let mut bytes = Vec::new();
        encode_exr(&mut bytes, [6, 1], &["Y"], |_, _, row| row.copy_from_slice(&values)).unwrap();
        let read = decode_exr(&bytes).unwrap();
        let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(read.channel("Y").unwrap()), bits(&values));
    }
}
