//! DNG: one uncompressed 16-bit mosaic with what a raw converter wants to know about it.
//!
//! Adobe, "Digital Negative (DNG) specification", version 1.4, over TIFF 6.0 and Exif 2.3. Little-endian, because a
//! widespread reader swaps the bytes of big-endian 16-bit files without a word.

use std::io::{self, Write};
use weavelight_calibration::description::Cfa;

/// One frame and what its file says about it.
#[derive(Clone, Debug)]
pub struct Dng<'a> {
    /// Photosites in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Raw numbers, row by row.
    pub samples: &'a [u16],
    /// Colour filters.
    pub cfa: Cfa,
    /// Raw number of no light, row-major 2 x 2.
    pub black: [u16; 4],
    /// Raw number of saturation.
    pub white: u16,
    /// Who made the camera.
    pub make: &'a str,
    /// Which camera.
    pub model: &'a str,
    /// What wrote the file.
    pub software: &'a str,
    /// "YYYY:MM:DD HH:MM:SS".
    pub date_time: &'a str,
    /// Seconds.
    pub exposure_s: f64,
    /// Sensitivity.
    pub iso: f64,
    /// Millimetres.
    pub focal_length_mm: f64,
    /// The lens's name.
    pub lens: &'a str,
    /// The camera's answer to white: R, G, B, green = 1.
    pub neutral: [f64; 3],
    /// CIE XYZ to camera RGB under D65, rows.
    pub camera_from_xyz: [[f64; 3]; 3],
}

/// A field of an image file directory: tag, type, count, bytes.
struct Field {
    tag: u16,
    kind: u16,
    count: usize,
    bytes: Vec<u8>,
}

const BYTE: u16 = 1;
const ASCII: u16 = 2;
const SHORT: u16 = 3;
const LONG: u16 = 4;
const RATIONAL: u16 = 5;
const UNDEFINED: u16 = 7;
const SRATIONAL: u16 = 10;

const STRIP_OFFSETS: u16 = 273;
const EXIF_IFD: u16 = 34665;
const HEADER_BYTES: usize = 8;
/// Samples start here and there only, so that they are aligned for any reader.
const DATA_ALIGNMENT: usize = 512;

impl Dng<'_> {
    /// Writes the file.
    ///
    /// # Errors
    /// What `out` says, or `InvalidInput` where the samples do not fill the frame or it exceeds TIFF's 4 GiB.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let bytes = self.samples.len() * 2;
        if self.samples.len() != self.width * self.height || bytes + 65_536 > u32::MAX as usize {
            let message = format!(
                "{} samples cannot fill a DNG of {} x {}",
                self.samples.len(),
                self.width,
                self.height
            );
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        out.write_all(&self.header())?;
        let mut buffer = Vec::with_capacity(1 << 16);
        for chunk in self.samples.chunks(1 << 15) {
            buffer.clear();
            buffer.extend(chunk.iter().flat_map(|sample| sample.to_le_bytes()));
            out.write_all(&buffer)?;
        }
        Ok(())
    }

    /// All that precedes the samples.
    fn header(&self) -> Vec<u8> {
        let (mut main, exif) = (self.main_fields(), self.exif_fields());
        let exif_at = HEADER_BYTES + directory_bytes(&main);
        let data_at = (exif_at + directory_bytes(&exif)).next_multiple_of(DATA_ALIGNMENT);
        for field in &mut main {
            match field.tag {
                STRIP_OFFSETS => field.bytes = (data_at as u32).to_le_bytes().to_vec(),
                EXIF_IFD => field.bytes = (exif_at as u32).to_le_bytes().to_vec(),
                _ => {}
            }
        }
        let mut header = b"II\x2a\0".to_vec();
        header.extend((HEADER_BYTES as u32).to_le_bytes());
        append_directory(&mut header, &main);
        append_directory(&mut header, &exif);
        header.resize(data_at, 0);
        header
    }

    fn main_fields(&self) -> Vec<Field> {
        let (width, height) = (self.width as u32, self.height as u32);
        let filters: Vec<u8> = self.cfa.cell.iter().map(|&channel| channel as u8).collect();
        let matrix: Vec<f64> = self.camera_from_xyz.iter().flatten().copied().collect();
        vec![
            longs(254, &[0]),
            longs(256, &[width]),
            longs(257, &[height]),
            shorts(258, &[16]),
            shorts(259, &[1]),
            shorts(262, &[32803]),
            text(271, self.make),
            text(272, self.model),
            longs(STRIP_OFFSETS, &[0]),
            shorts(274, &[1]),
            shorts(277, &[1]),
            longs(278, &[height]),
            longs(279, &[(self.samples.len() * 2) as u32]),
            shorts(284, &[1]),
            text(305, self.software),
            text(306, self.date_time),
            shorts(33421, &[2, 2]),
            bytes(33422, BYTE, &filters),
            longs(EXIF_IFD, &[0]),
            bytes(50706, BYTE, &[1, 4, 0, 0]),
            bytes(50707, BYTE, &[1, 1, 0, 0]),
            text(50708, &format!("{} {}", self.make, self.model)),
            bytes(50710, BYTE, &[0, 1, 2]),
            shorts(50711, &[1]),
            shorts(50713, &[2, 2]),
            shorts(50714, &self.black),
            longs(50717, &[u32::from(self.white)]),
            longs(50719, &[0, 0]),
            longs(50720, &[width, height]),
            signed_rationals(50721, &matrix),
            rationals(50728, &self.neutral),
            shorts(50778, &[21]),
            longs(50829, &[0, 0, height, width]),
        ]
    }

    fn exif_fields(&self) -> Vec<Field> {
        vec![
            rationals(33434, &[self.exposure_s]),
            shorts(34855, &[self.iso.round().clamp(0.0, 65535.0) as u16]),
            bytes(36864, UNDEFINED, b"0230"),
            text(36867, self.date_time),
            rationals(37386, &[self.focal_length_mm]),
            text(42036, self.lens),
        ]
    }
}

/// Bytes of a directory with the values that do not fit into its entries.
fn directory_bytes(fields: &[Field]) -> usize {
    let outside = |field: &Field| {
        if field.bytes.len() > 4 { field.bytes.len().next_multiple_of(2) } else { 0 }
    };
    2 + 12 * fields.len() + 4 + fields.iter().map(outside).sum::<usize>()
}

fn append_directory(file: &mut Vec<u8>, fields: &[Field]) {
    let mut value_at = file.len() + 2 + 12 * fields.len() + 4;
    let mut values = Vec::new();
    file.extend((fields.len() as u16).to_le_bytes());
    for field in fields {
        file.extend(field.tag.to_le_bytes());
        file.extend(field.kind.to_le_bytes());
        file.extend((field.count as u32).to_le_bytes());
        if field.bytes.len() <= 4 {
            let mut inline = field.bytes.clone();
            inline.resize(4, 0);
            file.extend(inline);
        } else {
            file.extend((value_at as u32).to_le_bytes());
            let length = field.bytes.len().next_multiple_of(2);
            values.extend(&field.bytes);
            values.resize(values.len() + length - field.bytes.len(), 0);
            value_at += length;
        }
    }
    file.extend(0u32.to_le_bytes());
    file.extend(values);
}

fn bytes(tag: u16, kind: u16, values: &[u8]) -> Field {
    Field { tag, kind, count: values.len(), bytes: values.to_vec() }
}

fn text(tag: u16, value: &str) -> Field {
    let ascii = value.chars().map(|c| if c.is_ascii() && c != '\0' { c as u8 } else { b'?' });
    let bytes: Vec<u8> = ascii.chain([0]).collect();
    Field { tag, kind: ASCII, count: bytes.len(), bytes }
}

fn shorts(tag: u16, values: &[u16]) -> Field {
    let bytes = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    Field { tag, kind: SHORT, count: values.len(), bytes }
}

fn longs(tag: u16, values: &[u32]) -> Field {
    let bytes = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    Field { tag, kind: LONG, count: values.len(), bytes }
}

fn rationals(tag: u16, values: &[f64]) -> Field {
    let ratio = |v: f64| {
        let scale = scale_for(v, f64::from(u32::MAX));
        [(v.max(0.0) * scale).round() as u32, scale as u32]
    };
    let bytes = values.iter().flat_map(|&v| ratio(v)).flat_map(u32::to_le_bytes).collect();
    Field { tag, kind: RATIONAL, count: values.len(), bytes }
}

fn signed_rationals(tag: u16, values: &[f64]) -> Field {
    let ratio = |v: f64| {
        let scale = scale_for(v, f64::from(i32::MAX));
        [(v * scale).round() as i32, scale as i32]
    };
    let bytes = values.iter().flat_map(|&v| ratio(v)).flat_map(i32::to_le_bytes).collect();
    Field { tag, kind: SRATIONAL, count: values.len(), bytes }
}

/// The largest power of ten, at most a hundred million, with which a value still fits.
fn scale_for(value: f64, largest: f64) -> f64 {
    let mut scale = 1e8;
    while scale > 1.0 && value.abs() * scale > largest {
        scale /= 10.0;
    }
    scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::camera_from_xyz;
    use crate::random::Key;

    fn check(width: usize, height: usize, cfa: Cfa) {
        let samples: Vec<u16> = (0..width * height)
            .map(|i| (Key::new(1).with(i as u64).bits() % 16384) as u16)
            .collect();
        let m = camera_from_xyz([0.52, 1.0, 0.66]);
        let dng = Dng {
            width,
            height,
            samples: &samples,
            cfa,
            black: [600, 601, 602, 603],
            white: 16383,
            make: "Weavelight",
            model: "Simulated",
            software: "test",
            date_time: "2026:01:01 12:00:00",
            exposure_s: 0.437,
            iso: 100.0,
            focal_length_mm: 35.0,
            lens: "Bench 35 mm",
            neutral: [0.52, 1.0, 0.66],
            camera_from_xyz: std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)])),
        };
        let mut file = Vec::new();
        dng.write(&mut file).unwrap();
        let decoded = rawloader::decode(&mut std::io::Cursor::new(&file)).unwrap();
        let rawloader::RawImageData::Integer(data) = decoded.data else { panic!("floats") };
        assert_eq!((decoded.width, decoded.height, decoded.cpp), (width, height, 1));
        assert_eq!(data, samples);
        assert_eq!(decoded.crops, [0; 4]);
        assert_eq!(decoded.cfa.name, cfa.name());
        assert_eq!(decoded.whitelevels[0], 16383);
    }

    #[test]
    fn an_independent_reader_sees_the_same_samples() {
        for (width, height) in [(16, 12), (64, 48), (33, 21), (1232, 8)] {
            check(width, height, Cfa::RGGB);
        }
        check(20, 20, Cfa::parse("BGGR").unwrap());
    }

    #[test]
    fn too_few_samples_are_an_error() {
        let dng = Dng {
            width: 4,
            height: 4,
            samples: &[0; 15],
            cfa: Cfa::RGGB,
            black: [0; 4],
            white: 1,
            make: "",
            model: "",
            software: "",
            date_time: "",
            exposure_s: 1.0,
            iso: 100.0,
            focal_length_mm: 1.0,
            lens: "",
            neutral: [1.0; 3],
            camera_from_xyz: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        };
        assert!(dng.write(&mut Vec::new()).is_err());
    }
}
