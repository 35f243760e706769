//! Maps from files of any kind: OpenEXR as it is, integers decoded by what the map holds.

use super::{CompareError, Kind, has_value, is_unit};
use crate::files::FileError;
use crate::raster::{
    Choice, Curve, Exr, Format, Picture, PictureError, Role, SaidCurve, Values, decode_exr,
    decode_picture,
};
use std::path::{Path, PathBuf};
use weavelight_calibration::description::Image;

/// A vector of integers that is shorter is none: programs fill what is empty with black or with grey.
const SHORTEST: f32 = 0.1;
/// How far the length of a normal of 8 bits may be from 1: half a step in each of three components, and what resampling and
/// hand painting do.
const LENGTH_SLACK: f32 = 0.06;

/// A file's content before it is known what it holds.
pub(super) struct Source {
    path: PathBuf,
    content: Content,
}

enum Content {
    Exr(Exr),
    Picture(Picture, Format),
}

impl Source {
    /// # Errors
    /// Where it cannot be read.
    pub(super) fn open(path: &Path) -> Result<Self, CompareError> {
        let bytes = crate::files::read_input(path, crate::files::InputKind::Picture)
            .map_err(|source| FileError::read(path, source))?;
        let content = match Format::sniff(&bytes) {
            Some(Format::Exr) => decode_exr(&bytes).map(Content::Exr),
            format => decode_picture(&bytes)
                .map(|picture| Content::Picture(picture, format.unwrap_or(Format::Tiff))),
        };
        let content = content.map_err(|source| failed(path, &source))?;
        Ok(Self { path: path.to_owned(), content })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn size(&self) -> [usize; 2] {
        match &self.content {
            Content::Exr(exr) => [exr.width, exr.height],
            Content::Picture(picture, _) => [picture.width, picture.height],
        }
    }

    /// What its numbers make likely: for an integer picture certain enough, for floating point what is negative or a unit
    /// vector.
    pub(super) fn suggests(&self) -> Suggestion {
        match &self.content {
            Content::Exr(exr) => match exr.choose(Choice::Any) {
                Ok(group) if group.role == Role::Xyz => Suggestion::Sure(Kind::Normal),
                Ok(group) => {
                    let [r, g, b] = exr.planes(&group);
                    of_floats(r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]))
                }
                Err(_) => Suggestion::Likely(Kind::Color),
            },
            Content::Picture(picture, _) if picture.channels == 1 => Suggestion::Sure(Kind::Color),
            Content::Picture(picture, _) if picture.full_scale.is_finite() => {
                let mut normals = normals(picture).into_iter().filter(has_value).peekable();
                let some = normals.peek().is_some();
                let unit = |n: [f32; 3]| (length(n) - 1.0).abs() < LENGTH_SLACK;
                let normal = some && normals.all(unit);
                Suggestion::Sure(if normal { Kind::Normal } else { Kind::Color })
            }
            Content::Picture(picture, _) => of_floats(triples(picture)),
        }
    }

    /// The map.
    ///
    /// # Errors
    /// A file that holds no map of this kind, or does not say how it encodes colour.
    pub(super) fn map(self, kind: Kind) -> Result<Image<[f32; 3]>, CompareError> {
        let [width, height] = self.size();
        let data = match (self.content, kind) {
            (Content::Exr(exr), kind) => of_exr(&exr, kind),
            (Content::Picture(picture, _), Kind::Normal) if picture.channels == 1 => {
                Err(PictureError::unsupported("a grey picture as normals", "give three channels"))
            }
            (Content::Picture(picture, _), Kind::Normal) if picture.full_scale.is_finite() => {
                Ok(normals(&picture))
            }
            (Content::Picture(picture, _), Kind::Normal) => Ok(triples(&picture).collect()),
            (Content::Picture(picture, format), Kind::Color) => colors(&picture, format),
        };
        let data = data.map_err(|source| failed(&self.path, &source))?;
        Ok(Image { width, height, data })
    }
}

/// How sure numbers are of what they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Suggestion {
    Sure(Kind),
    Likely(Kind),
}

fn failed(path: &Path, source: &PictureError) -> CompareError {
    FileError::Content { path: path.to_owned(), what: source.to_string() }.into()
}

fn of_floats(pixels: impl Iterator<Item = [f32; 3]>) -> Suggestion {
    let (mut negative, mut unit, mut some) = (false, true, false);
    for pixel in pixels {
        negative |= pixel.iter().any(|value| *value < 0.0);
        if has_value(&pixel) {
            some = true;
            unit &= is_unit(&pixel);
        }
    }
    Suggestion::Likely(if negative || (some && unit) { Kind::Normal } else { Kind::Color })
}

fn of_exr(exr: &Exr, kind: Kind) -> Result<Vec<[f32; 3]>, PictureError> {
    let choice = match kind {
        Kind::Normal => Choice::Vectors,
        Kind::Color => Choice::Colors,
    };
    let group = exr.choose(choice)?;
    let [r, g, b] = exr.planes(&group);
    let mut pixels: Vec<[f32; 3]> =
        r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]).collect();
    if kind == Kind::Normal {
        return Ok(pixels);
    }
    if let Some(alpha) = exr.alpha(&group) {
        for (pixel, alpha) in pixels.iter_mut().zip(alpha.values) {
            if alpha > 0.0 && alpha < 1.0 {
                *pixel = pixel.map(|value| value / alpha);
            }
        }
    }
    if group.role == Role::Rgb {
        to_rec_709(&mut pixels, exr.linear_srgb_from_rgb());
    }
    Ok(pixels)
}

fn to_rec_709(pixels: &mut [[f32; 3]], matrix: Option<[[f64; 3]; 3]>) {
    let Some(matrix) = matrix else { return };
    for pixel in pixels {
        let rgb = pixel.map(f64::from);
        *pixel = matrix.map(|row| (row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2]) as f32);
    }
}

fn triples(picture: &Picture) -> impl Iterator<Item = [f32; 3]> {
    let channels = picture.channels;
    (0..picture.width * picture.height)
        .map(move |k| [0, 1, 2].map(|c| picture.fraction(k * channels + c.min(channels - 1))))
}

/// Whether a pixel is there: not transparent.
fn opaque(picture: &Picture, pixel: usize) -> bool {
    picture.alpha.as_ref().is_none_or(|alpha| alpha.values[pixel] > 0.0)
}

/// 0 to full scale is -1 to 1, whatever the file says of colours; no normal where it is black, grey or transparent.
fn normals(picture: &Picture) -> Vec<[f32; 3]> {
    let decoded = |(k, stored): (usize, [f32; 3])| {
        let normal = stored.map(|value| 2.0 * value - 1.0);
        let there = opaque(picture, k) && stored != [0.0; 3] && length(normal) >= SHORTEST;
        if there { normal } else { [0.0; 3] }
    };
    triples(picture).enumerate().map(decoded).collect()
}

fn length(vector: [f32; 3]) -> f32 {
    vector.iter().map(|value| value * value).sum::<f32>().sqrt()
}

/// Linear Rec. 709 by the file's own curve and primaries; PNG and JPEG that say nothing are sRGB.
fn colors(picture: &Picture, format: Format) -> Result<Vec<[f32; 3]>, PictureError> {
    let whole = matches!(picture.values, Values::F32(_));
    let curve = match &picture.said.curve {
        SaidCurve::Known(curve) => curve.clone(),
        SaidCurve::Unreadable(why) => {
            let what = format!(
                "a picture of which {} says how it encodes colour ({why})",
                picture.said.by
            );
            return Err(PictureError::unsupported(what, "convert it to sRGB"));
        }
        SaidCurve::Silent if whole => Curve::Linear,
        SaidCurve::Silent if format == Format::Tiff => {
            return Err(PictureError::unsupported(
                "a TIFF that does not say how it encodes colour",
                "save it as PNG (sRGB) or OpenEXR (linear)",
            ));
        }
        SaidCurve::Silent => Curve::Srgb,
    };
    let light = |(k, stored): (usize, [f32; 3])| {
        let channels = [0, 1, 2].map(|c| curve.linear(c, stored[c].into()) as f32);
        if opaque(picture, k) { channels } else { [0.0; 3] }
    };
    let mut pixels: Vec<[f32; 3]> = triples(picture).enumerate().map(light).collect();
    to_rec_709(&mut pixels, picture.said.linear_srgb_from_rgb);
    Ok(pixels)
}
