//! Picture sets from elsewhere as capture sessions: RTI `.lp` files, DiLiGenT folders, plain lists of directions. Axes: x
//! right, y up, z to the viewer, which are the rig's own.

mod exposures;
mod lights;
mod lists;
mod looks;
mod names;
mod natural;
mod numbers;
mod pairs;
mod pictures;
#[cfg(test)]
mod tests;

use self::exposures::{Exposure, Stated};
use self::lights::LightList;
use self::numbers::{Gathered, encoding_of};
use self::pairs::Pair;
use self::pictures::Frame;
use super::{Encoding, FrameEntry, Kind, Session, SessionError};
use crate::files::{
    FileError, Input, OutputKind, Provenance, Setting, StagedFolder, sha256_of_file,
};
use crate::instrument::{
    COLOR_FILE, CalibratedLight, Color, LIGHT_COUNT, write_color, write_lights,
};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use weavelight_calibration::description::{Cfa, DirectionalLight, Light};

/// The calibration's folder in an imported capture session.
pub const CALIBRATION: &str = "calibration";

/// A capture session as an output folder: pictures are precious, so one is never replaced.
const OUTPUT: OutputKind = OutputKind { name: "capture session", marker: None };

/// What to import.
#[derive(Clone, Debug)]
pub struct Options {
    /// List of light directions: `.lp`, or one direction a line.
    pub lights: PathBuf,
    /// The pictures; may be empty where the list names them.
    pub images: Vec<PathBuf>,
    /// The capture session to write.
    pub out: PathBuf,
    /// How the pictures encode light; 8-bit pictures must say.
    pub encoding: Option<Encoding>,
    /// The mosaic of pictures that are a colour sensor's samples and do not say so.
    pub cfa: Option<Cfa>,
    /// Whether all pictures count as equally exposed, whatever their files state: for sets that were normalised already.
    pub same_exposure: bool,
    /// A picture that is not 0 where the object is.
    pub mask: Option<PathBuf>,
}

/// What was imported.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// The capture session.
    pub session: PathBuf,
    /// The calibration in it.
    pub calibration: PathBuf,
    /// Pictures, which is lights.
    pub frames: usize,
    /// Lights of the list, of which the pictures may choose some.
    pub lights_in_list: usize,
    /// Exposure times and sensitivities, where the files state any.
    pub exposures: Option<String>,
    /// Width and height.
    pub size_px: [usize; 2],
    /// Sentences for the user.
    pub warnings: Vec<String>,
}

/// What goes wrong with an import. Each message says what, where, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A file.
    #[error(transparent)]
    File(#[from] FileError),
    /// The capture session that was to be written.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// An 8-bit picture whose encoding is not declared.
    #[error("{}: has 8 bits and does not say how they encode light; add {encoding} srgb (most cameras) or {encoding} linear", .0.display(), encoding = Setting("encoding"))]
    EncodingUnknown(PathBuf),
    /// A picture whose file names a curve that cannot be applied.
    #[error("{}: {by} says how it encodes light, but {why}; add {encoding} srgb or {encoding} linear, or save it as sRGB or linear", .path.display(), encoding = Setting("encoding"))]
    EncodingUnreadable {
        /// The picture.
        path: PathBuf,
        /// As in "its ICC profile".
        by: String,
        /// As in "it holds lookup tables instead of a curve".
        why: String,
    },
    /// Directions and pictures do not pair.
    #[error("{}: {lights} directions, but {what}; give one picture for each direction", .path.display())]
    Count {
        /// The list.
        path: PathBuf,
        /// Directions in it.
        lights: usize,
        /// What there is of the other.
        what: String,
    },
    /// A RAW or floating-point picture that is said to be sRGB-encoded.
    #[error("{}: {format} holds linear values; leave out {} srgb", .path.display(), Setting("encoding"))]
    EncodingContradicted {
        /// The picture.
        path: PathBuf,
        /// As in "a RAW file".
        format: &'static str,
    },
    /// A picture that is no mosaic, or another than the one given.
    #[error("{}: {cfa} {declared} is given, but this file holds {found}; leave out {cfa}, or correct it", .path.display(), cfa = Setting("cfa"))]
    CfaContradicted {
        /// The picture.
        path: PathBuf,
        /// As in "RGGB".
        declared: String,
        /// From the file.
        found: String,
    },
    /// Exposures of which some are known and differ, and some are not.
    #[error("{}: states no {what}, but the others state {low} to {high}; give pictures that all state it, or {} if all were equally exposed", .path.display(), Setting("same-exposure"))]
    ExposureMixed {
        /// The picture that is silent.
        path: PathBuf,
        /// What is not stated.
        what: &'static str,
        /// The least that others state.
        low: String,
        /// The most that others state.
        high: String,
    },
    /// Pictures of several apertures.
    #[error("{}: was taken at f/{found}, but {} at f/{expected}; take all pictures at one aperture, or give {} if they were normalised already", .path.display(), .first.display(), Setting("same-exposure"))]
    Aperture {
        /// The odd one.
        path: PathBuf,
        /// Its f-number.
        found: f64,
        /// The first one.
        first: PathBuf,
        /// Its f-number.
        expected: f64,
    },
    /// A picture that the list names for two lights.
    #[error("{}:{line}: names {name}, {place}", .path.display())]
    NamedTwice {
        /// The list.
        path: PathBuf,
        /// Line of the second.
        line: usize,
        /// The picture.
        name: String,
        /// Which was the first, and what to do.
        place: String,
    },
    /// A picture that the list names is not there.
    #[error("{}:{line}: names {name}, which is not {place}; correct the list or give that picture", .path.display())]
    NamedMissing {
        /// The list.
        path: PathBuf,
        /// Its line.
        line: usize,
        /// The picture.
        name: String,
        /// Where it was looked for.
        place: String,
    },
    /// Too few or too many lights.
    #[error("{}: {what}; a solve takes {} to {}", .path.display(), LIGHT_COUNT.start(), LIGHT_COUNT.end())]
    LightCount {
        /// The list.
        path: PathBuf,
        /// How many there are.
        what: String,
    },
    /// Pictures of different size.
    #[error("{}: is {} x {}, but {} is {} x {}; all pictures must be of one size", .path.display(), .size[0], .size[1], .first.display(), .expected[0], .expected[1])]
    Size {
        /// The odd one.
        path: PathBuf,
        /// Its width and height.
        size: [usize; 2],
        /// The first one.
        first: PathBuf,
        /// Its width and height.
        expected: [usize; 2],
    },
}

/// Writes pictures and light directions as a capture session with its calibration. `progress` hears the finished share.
///
/// # Errors
/// Where lists or pictures cannot be read or do not pair, or the target cannot be written; then nothing is.
pub fn run(options: &Options, progress: &dyn Fn(f64, &str)) -> Result<Summary, ImportError> {
    let list = LightList::read(&options.lights)?;
    let (pairs, mut warnings) = pairs::pair(&list, options)?;
    warnings.splice(0..0, list.warnings.iter().cloned());
    warnings.extend(list.lights_behind(&pairs));
    let staged = StagedFolder::create(&options.out, OUTPUT)?;
    let name = name_of(&options.lights, staged.target());
    let mut session = Session::new(staged.path(), Kind::Swatch, name);
    let mut names = Names::default();
    let mut first: Option<(PathBuf, [usize; 2])> = None;
    let mut gathered = Gathered::default();
    let (mut looks, mut stated) = (Vec::new(), Vec::new());
    for (k, pair) in pairs.iter().enumerate() {
        progress(k as f64 / pairs.len() as f64, "copying pictures");
        let picture = pictures::read_frame(&pair.image, options)?;
        let (path, expected) = first.get_or_insert_with(|| (pair.image.clone(), picture.size_px));
        check_size(&pair.image, picture.size_px, path, *expected)?;
        let encoding = options.encoding.or_else(|| encoding_of(&picture.metadata.numbers));
        let name = copy(&staged, &mut names, pair, &picture)?;
        gathered.add(&pair.image, &picture.metadata.numbers, picture.histogram);
        let mut frame = FrameEntry::new(name, Some(k), 1.0, 100.0);
        frame.sha256 = Some(picture.sha256);
        (frame.encoding, frame.cfa) = (encoding, options.cfa);
        session.frames.push(frame);
        if let Some(what) = picture.assumed.filter(|_| k == 0) {
            warnings.push(format!(
                "{}: {what} in {CALIBRATION}/{COLOR_FILE} of the capture session",
                pair.image.display()
            ));
        }
        stated.push(Stated::new(&pair.image, &picture.metadata));
        looks.push(picture.look);
    }
    let (exposures, of_exposures) = exposures::settle(&stated, list.has_intensities, options)?;
    for (frame, Exposure { seconds, iso }) in session.frames.iter_mut().zip(&exposures) {
        (frame.exposure_s, frame.iso) = (*seconds, *iso);
    }
    warnings.extend(of_exposures);
    warnings.extend(looks::copies(&looks));
    warnings.extend(looks::mosaic(&looks));
    let size_px = first.map_or([0, 0], |(_, size)| size);
    if let Some(mask) = &options.mask {
        let picture = pictures::read_mask(mask)?;
        check_size(mask, picture.size_px, &pairs[0].image, size_px)?;
        let name = names.free("mask.png");
        picture.write(&staged.join(&name))?;
        session.mask = Some(name.into());
    }
    session.save()?;
    warnings.extend(gathered.warnings());
    write_calibration(&staged.join(CALIBRATION), &list, &pairs, &gathered.color())?;
    let target = staged.target().to_owned();
    staged.commit()?;
    progress(1.0, "done");
    Ok(Summary {
        calibration: target.join(CALIBRATION),
        session: target,
        frames: pairs.len(),
        lights_in_list: list.directions.len(),
        exposures: exposures::summary(&stated, &exposures),
        size_px,
        warnings,
    })
}

fn check_size(
    path: &Path,
    size: [usize; 2],
    first: &Path,
    expected: [usize; 2],
) -> Result<(), ImportError> {
    if size == expected {
        return Ok(());
    }
    Err(ImportError::Size { path: path.to_owned(), size, first: first.to_owned(), expected })
}

/// A picture set is known by its folder; where that has no name, by the capture session's.
fn name_of(lights: &Path, target: &Path) -> String {
    let folder = lights.parent().and_then(Path::file_name).or(target.file_name());
    folder.map_or_else(|| "imported".to_owned(), |name| name.to_string_lossy().into_owned())
}

/// Copies a picture into the capture session; returns its name there.
fn copy(
    staged: &StagedFolder,
    names: &mut Names,
    pair: &Pair,
    picture: &Frame,
) -> Result<String, FileError> {
    let file_name = pair.image.file_name().unwrap_or_default().to_string_lossy();
    let name = names.free(&file_name);
    let path = staged.join(&name);
    std::fs::write(&path, &picture.bytes).map_err(|source| FileError::write(&path, source))?;
    Ok(name)
}

/// Names already given in the folder: pictures from several folders may share one.
#[derive(Default)]
struct Names(HashSet<String>);

impl Names {
    fn free(&mut self, wanted: &str) -> String {
        let numbered = |k: usize| if k == 0 { wanted.to_owned() } else { format!("{k}-{wanted}") };
        let ours = |name: &str| name == super::MANIFEST || name == CALIBRATION;
        let hidden = |name: &str| name.starts_with(".weavelight-");
        let taken = |name: &String| self.0.contains(name) || ours(name) || hidden(name);
        let name = (0..).map(numbered).find(|name| !taken(name)).unwrap_or_default();
        self.0.insert(name.clone());
        name
    }
}

/// Far lights of which a picture's number divided by the intensity is the albedo times the cosine.
fn write_calibration(
    folder: &Path,
    list: &LightList,
    pairs: &[Pair],
    color: &Color,
) -> Result<(), ImportError> {
    let light = |&Pair { light, .. }: &Pair| {
        let (direction, intensity) = (list.directions[light], list.intensities[light]);
        CalibratedLight::new(Light::Directional(DirectionalLight { direction, intensity }))
    };
    let lights: Vec<CalibratedLight> = pairs.iter().map(light).collect();
    let mut inputs = Vec::new();
    for path in &list.files {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        inputs.push(Input { name, sha256: sha256_of_file(path)? });
    }
    let provenance = Provenance::of_this_program(None, inputs, toml::Table::new());
    write_lights(folder, &lights, &provenance)?;
    write_color(folder, color, &provenance)?;
    Ok(())
}

impl LightList {
    fn lights_behind(&self, pairs: &[Pair]) -> Option<String> {
        let behind = pairs.iter().filter(|pair| self.directions[pair.light].z <= 0.0).count();
        let path = self.files[0].display();
        (behind > 0).then(|| format!("{path}: {behind} lights come from behind the picture (z <= 0); z points to the viewer"))
    }
}
