//! OpenEXR in, through the `exr` crate.
//!
//! "OpenEXR file layout" and "Technical introduction to OpenEXR", Academy Software Foundation: a picture is its display window;
//! the data window says where in it (or beyond it) there are values.

use super::encoding::Said;
use super::error::content_error;
use super::exr_layers::{Choice, choose};
use super::guard::guarded;
use super::picture::{Alpha, Format, Picture, Values, not_a_picture};
use super::primaries::linear_srgb_from;
use super::{Group, PictureError, limits};
use crate::files::FileError;
use exr::meta::header::Header;
use exr::prelude::{AnyChannel, FlatSamples, MetaData, ReadChannels, ReadLayers, read};
use std::io::Cursor;
use std::path::Path;

/// The channels of an EXR file over its display window: all layers and parts. Values outside the data window are 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Exr {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Name and `width * height` values of each, in the file's order; may hold NaN and infinities. In a file of several parts
    /// the part's name stands before the channel's.
    pub channels: Vec<(String, Vec<f32>)>,
    /// x and y of red, green, blue and white, where the file says.
    pub chromaticities: Option<[[f64; 2]; 4]>,
    /// Width of a pixel over its height.
    pub pixel_aspect: f32,
    /// The data window of each channel, where it leaves part of the display window empty.
    gaps: Vec<Option<String>>,
}

impl Exr {
    /// The values of a channel.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|(other, _)| other == name).map(|(_, values)| values.as_slice())
    }

    /// The group of channels that is meant.
    ///
    /// # Errors
    /// None, or several.
    pub(crate) fn choose(&self, choice: Choice) -> Result<Group, PictureError> {
        let names: Vec<&str> = self.channels.iter().map(|(name, _)| name.as_str()).collect();
        choose(&names, choice)
    }

    /// Linear Rec. 709 from the file's RGB, where the file says its primaries.
    pub(crate) fn linear_srgb_from_rgb(&self) -> Option<[[f64; 3]; 3]> {
        let [red, green, blue, white] = self.chromaticities?;
        linear_srgb_from([red, green, blue], white)
    }

    /// The values of a group, one channel's after the other's.
    pub(crate) fn planes(&self, group: &Group) -> [&[f32]; 3] {
        group.channels.map(|at| self.channels[at].1.as_slice())
    }

    /// A layer's opacity, where not all of it is opaque. Programs that know no alpha may write 0 everywhere.
    pub(crate) fn alpha(&self, group: &Group) -> Option<Alpha> {
        let values = &self.channels[group.alpha?].1;
        let counts =
            values.iter().any(|&alpha| alpha < 1.0) && values.iter().any(|&alpha| alpha > 0.0);
        counts.then(|| Alpha { values: values.clone(), premultiplied: true })
    }

    /// R, G, B interleaved, or Y.
    pub(crate) fn into_picture(self) -> Result<Picture, PictureError> {
        let group = self.choose(Choice::Colors)?;
        let [red, green, blue] = self.planes(&group);
        let (channels, values) = match group.role {
            super::Role::Grey => (1, red.to_vec()),
            _ => {
                let pixels = red.iter().zip(green).zip(blue);
                (3, pixels.flat_map(|((&r, &g), &b)| [r, g, b]).collect())
            }
        };
        let matrix = self.linear_srgb_from_rgb().filter(|_| channels == 3);
        let said = Said { by: "its chromaticities".to_owned(), ..Said::default() };
        let size = [self.width, self.height];
        Ok(Picture {
            alpha: self.alpha(&group),
            said: said.with_primaries(matrix),
            no_frame: self.no_frame(&group),
            ..Picture::plain(size, channels, Values::F32(values), f32::INFINITY)
        })
    }

    fn no_frame(&self, group: &Group) -> Option<String> {
        let gap = group.channels.iter().find_map(|&at| self.gaps[at].clone());
        let square = (self.pixel_aspect - 1.0).abs() < 0.01;
        let wide =
            || format!("an OpenEXR picture of pixels {} times as wide as high", self.pixel_aspect);
        gap.or_else(|| (!square).then(wide))
    }
}

/// Reads an EXR file; see [`decode_exr`].
///
/// # Errors
/// [`FileError`] with the path.
pub fn read_exr(path: &Path) -> Result<Exr, FileError> {
    let bytes = crate::files::read_input(path, crate::files::InputKind::Picture)
        .map_err(|source| FileError::read(path, source))?;
    decode_exr(&bytes).map_err(|source| content_error(path, &source))
}

/// Decodes the flat layers of an EXR file: half, float and unsigned channels, scan lines or tiles (the largest level), any
/// compression but HTJ2K.
///
/// # Errors
/// Anything that is no sound EXR file of flat layers at full size; never panics.
pub fn decode_exr(bytes: &[u8]) -> Result<Exr, PictureError> {
    if Format::sniff(bytes) != Some(Format::Exr) {
        return Err(not_a_picture(bytes, "an OpenEXR file"));
    }
    guarded(|| decode(bytes))
}

/// Bit of the version field that says that a part is deep.
const DEEP: u8 = 0x08;

fn decode(bytes: &[u8]) -> Result<Exr, PictureError> {
    if bytes.get(5).is_some_and(|flags| flags & DEEP != 0) {
        return Err(PictureError::unsupported("a deep OpenEXR picture", "flatten it"));
    }
    let headers = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(wrong)?.headers;
    check(&headers, bytes.len())?;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(wrong)?;
    let display = image.attributes.display_window;
    let several = image.layer_data.len() > 1;
    let mut exr = Exr {
        width: display.size.width(),
        height: display.size.height(),
        channels: Vec::new(),
        chromaticities: image
            .attributes
            .chromaticities
            .map(|c| [c.red, c.green, c.blue, c.white].map(|at| [at.x(), at.y()].map(f64::from))),
        pixel_aspect: image.attributes.pixel_aspect,
        gaps: Vec::new(),
    };
    for layer in image.layer_data {
        let place = layer.attributes.layer_position - display.position;
        let window = Window {
            place: [place.x(), place.y()],
            size: [layer.size.width(), layer.size.height()],
        };
        let part = layer.attributes.layer_name.filter(|_| several).map(|name| name.to_string());
        for channel in layer.channel_data.list {
            let name = channel.name.to_string();
            let name = match &part {
                Some(part) if !name.starts_with(&format!("{part}.")) => format!("{part}.{name}"),
                _ => name,
            };
            exr.gaps.push(window.gap([exr.width, exr.height]));
            exr.channels.push((name, window.placed(floats(channel), [exr.width, exr.height])));
        }
    }
    Ok(exr)
}

fn wrong(error: exr::error::Error) -> PictureError {
    match error {
        exr::error::Error::NotSupported(what) => PictureError::unsupported(
            format!("an OpenEXR picture of a rare kind ({what})"),
            "save it as flat scan lines with ZIP compression",
        ),
        error => PictureError::damaged(error.to_string()),
    }
}

/// Sizes before anything is allocated, and what would come out wrong.
fn check(headers: &[Header], bytes: usize) -> Result<(), PictureError> {
    let channels = headers.iter().map(|header| header.channels.list.len()).sum();
    for header in headers {
        let display = header.shared_attributes.display_window.size;
        for size in [header.layer_size, display] {
            limits::check(size.width() as u64, size.height() as u64, channels, bytes)?;
        }
        let list = &header.channels.list;
        if list.iter().all(|channel| (channel.sampling.x(), channel.sampling.y()) == (1, 1)) {
            continue;
        }
        let names: Vec<String> = list.iter().map(|channel| channel.name.to_string()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        // Luminance and chroma have a name of their own.
        choose(&names, Choice::Colors)?;
        return Err(PictureError::unsupported(
            "an OpenEXR picture with subsampled channels",
            "save all channels at full size",
        ));
    }
    Ok(())
}

fn floats(channel: AnyChannel<FlatSamples>) -> Vec<f32> {
    match channel.sample_data {
        FlatSamples::F32(values) => values,
        FlatSamples::F16(values) => values.into_iter().map(exr::prelude::f16::to_f32).collect(),
        FlatSamples::U32(values) => values.into_iter().map(|value| value as f32).collect(),
    }
}

/// A data window, counted from the display window's top left.
struct Window {
    place: [i32; 2],
    size: [usize; 2],
}

impl Window {
    /// Columns or rows of the display window that it covers, and the first of its own among them.
    fn overlap(&self, axis: usize, display: usize) -> (std::ops::Range<usize>, usize) {
        let place = i64::from(self.place[axis]);
        let inside = |at: i64| at.clamp(0, display as i64) as usize;
        let (start, end) = (inside(place), inside(place + self.size[axis] as i64));
        (start..end, (start as i64 - place).max(0) as usize)
    }

    /// In words, where it leaves part of the display window empty.
    fn gap(&self, display: [usize; 2]) -> Option<String> {
        let covers = [0, 1]
            .into_iter()
            .all(|axis| self.overlap(axis, display[axis]).0.len() == display[axis]);
        let [x, y] = self.place;
        let [width, height] = self.size;
        let what = || {
            format!(
                "an OpenEXR picture whose data window ({width} x {height} from {x}, {y}) covers only part of its display \
                 window ({} x {})",
                display[0], display[1]
            )
        };
        (!covers).then(what)
    }

    /// Values over the display window, 0 where there are none.
    fn placed(&self, values: Vec<f32>, display: [usize; 2]) -> Vec<f32> {
        if self.place == [0, 0] && self.size == display {
            return values;
        }
        let (columns, left) = self.overlap(0, display[0]);
        let (rows, top) = self.overlap(1, display[1]);
        let rows = if columns.is_empty() { 0..0 } else { rows };
        let mut placed = vec![0.0; display[0] * display[1]];
        for (row, from) in rows.zip(top..) {
            let source = from * self.size[0] + left;
            let target = row * display[0] + columns.start;
            placed[target..target + columns.len()]
                .copy_from_slice(&values[source..source + columns.len()]);
        }
        placed
    }
}
