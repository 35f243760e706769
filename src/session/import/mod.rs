//! Picture sets from elsewhere as capture sessions: RTI `.lp` files, DiLiGenT folders, plain lists of directions. Axes: x
//! right, y up, z to the viewer, which are the rig's own.

mod error;
mod exposures;
mod lights;
mod lists;
mod looks;
mod names;
mod natural;
mod numbers;
mod options;
mod pairs;
mod pictures;
#[cfg(test)]
mod tests;

pub use error::ImportError;
pub use options::Options;

use self::exposures::{Exposure, Stated};
use self::lights::LightList;
use self::numbers::{Gathered, encoding_of};
use self::pairs::Pair;
use self::pictures::Frame;
use super::{FrameEntry, Kind, Session};
use crate::files::{FileError, Input, OutputKind, Provenance, StagedFolder, sha256_of_file};
use crate::instrument::{COLOR_FILE, CalibratedLight, Color, write_color, write_lights};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use weavelight_calibration::description::{DirectionalLight, Light};

/// The calibration's folder in an imported capture session.
pub const CALIBRATION: &str = "calibration";

/// A capture session as an output folder: pictures are precious, so one is never replaced.
const OUTPUT: OutputKind = OutputKind { name: "capture session", marker: None };

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
