//! Kinds of file that are known by name and not read.

/// What to do with a picture of another kind.
const SAVE_AS: &str = "save it as a 16-bit TIFF or PNG";

/// First bytes of a kind: where, which, its name.
const SIGNATURES: [(usize, &[u8], &str); 32] = [
    (0, b"\0\0\0\x0cjP  \r\n\x87\n", "a JPEG 2000 picture"),
    (0, b"\xff\x4f\xff\x51", "a JPEG 2000 picture"),
    (0, b"\0\0\0\x0cJXL \r\n\x87\n", "a JPEG XL picture"),
    (0, b"\xff\x0a", "a JPEG XL picture"),
    (4, b"ftypavif", "an AVIF picture"),
    (4, b"ftypavis", "an AVIF picture"),
    (4, b"ftyphei", "a HEIC picture"),
    (4, b"ftyphev", "a HEIC picture"),
    (4, b"ftypmif1", "a HEIF picture"),
    (4, b"ftypmsf1", "a HEIF picture"),
    (0, b"8BPS", "a Photoshop document"),
    (0, b"GIF8", "a GIF picture"),
    (0, b"qoif", "a QOI picture"),
    (0, b"gimp xcf", "a GIMP document"),
    (0, b"DDS ", "a DDS texture"),
    (0, b"\xabKTX ", "a KTX texture"),
    (0, b"#?RADIANCE", "a Radiance HDR picture"),
    (0, b"#?RGBE", "a Radiance HDR picture"),
    (0, b"SIMPLE  =", "a FITS picture"),
    (0, b"SDPX", "a DPX picture"),
    (0, b"XPDS", "a DPX picture"),
    (0, b"\x80\x2a\x5f\xd7", "a Cineon picture"),
    (0, b"XISF0100", "a XISF picture"),
    (0, b"BPG\xfb", "a BPG picture"),
    (0, b"FLIF", "a FLIF picture"),
    (0, b"farbfeld", "a farbfeld picture"),
    (4, b"ftypqt  ", "a film"),
    (4, b"ftypisom", "a film"),
    (4, b"ftypmp4", "a film"),
    (0, b"%PDF-", "a PDF document"),
    (0, b"PK\x03\x04", "a ZIP archive"),
    (0, b"\x1f\x8b\x08", "a gzip archive"),
];

/// A kind that is not read, and what to do; `None` for what is not known by name.
pub(crate) fn kind_not_read(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let begins =
        |at: usize, with: &[u8]| bytes.get(at..).is_some_and(|rest| rest.starts_with(with));
    let signed =
        SIGNATURES.iter().find(|(at, with, _)| begins(*at, with)).map(|(_, _, name)| *name);
    let name = signed.or_else(|| match bytes {
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some("a WebP picture"),
        [b'B', b'M', ..] if is_bmp(bytes) => Some("a BMP picture"),
        [b'P', b'1'..=b'7' | b'F' | b'f', white, ..] if white.is_ascii_whitespace() => {
            Some("a PNM picture")
        }
        // The signature in the last 26 bytes of newer Targa files, and the header of older ones.
        _ if bytes.ends_with(b"TRUEVISION-XFILE.\0") || is_targa(bytes) => Some("a Targa picture"),
        _ => None,
    })?;
    let remedy = match name {
        "a film" => "take its frames out as 16-bit TIFF or PNG",
        "a PDF document" => "give the pictures themselves",
        "a ZIP archive" | "a gzip archive" => "unpack it and give the pictures",
        _ => SAVE_AS,
    };
    Some((name, remedy))
}

/// Two reserved fields of zero, and a header of a size that there is.
fn is_bmp(bytes: &[u8]) -> bool {
    let header = bytes.get(6..18).map(|b| (b[..4] == [0; 4], b[8], b[9..] == [0; 3]));
    matches!(header, Some((true, 12 | 40 | 52 | 56 | 64 | 108 | 124, true)))
}

/// A file as long as its header says: kind 2 (RGB) or 3 (grey), no colour map, whole bytes.
fn is_targa(bytes: &[u8]) -> bool {
    let Some(header) = bytes.first_chunk::<18>() else { return false };
    let [id, 0, 2 | 3, 0, 0, 0, 0, 0, ..] = *header else { return false };
    let side = |at: usize| usize::from(u16::from_le_bytes([header[at], header[at + 1]]));
    let whole = matches!(header[16], 8 | 16 | 24 | 32);
    let data = side(12) * side(14) * usize::from(header[16] / 8);
    whole && data > 0 && bytes.len() == 18 + usize::from(id) + data
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_by_its_first_bytes() {
        let check = |bytes: &[u8], expected: Option<&str>| {
            assert_eq!(kind_not_read(bytes).map(|(name, _)| name), expected, "{bytes:?}");
        };
        check(b"\0\0\0\x1cftypavif\0\0\0\0", Some("an AVIF picture"));
        check(b"\0\0\0\x18ftypheic\0\0\0\0", Some("a HEIC picture"));
        check(b"RIFF\x24\0\0\0WEBPVP8 ", Some("a WebP picture"));
        check(b"RIFF\x24\0\0\0WAVEfmt ", None);
        check(b"8BPS\0\x01", Some("a Photoshop document"));
        check(b"\xff\x0a\x02", Some("a JPEG XL picture"));
        check(b"\0\0\0\x0cjP  \r\n\x87\n\0", Some("a JPEG 2000 picture"));
        check(b"P6\n4 4\n255\n", Some("a PNM picture"));
        check(b"Paper and cloth", None);
        let mut targa = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 0, 3, 0, 24, 0];
        targa.extend([9; 36]);
        check(&targa, Some("a Targa picture"));
        targa.push(0);
        check(&targa, None);
        let mut bmp = b"BM\x36\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0".to_vec();
        check(&bmp, Some("a BMP picture"));
        bmp[7] = 1;
        check(&bmp, None);
        // Canon's CR3 is a RAW file, whose reader knows more.
        check(b"\0\0\0\x18ftypcrx \0\0\0\x01", None);
        check(b"", None);
    }
}
