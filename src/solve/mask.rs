//! The mask of a capture session as a picture that people can edit.

use crate::files::{
    FileError, Lock, clean_temporary, parent_of, sha256_hex, sha256_of_file, write_atomic,
};
use crate::gpu::Device;
use crate::instrument::Calibration;
use crate::photometry::Method;
use crate::raster::encode_png_grey8;
use crate::session::{MASK_FILE, Session};
use crate::solution::Reuse;
use crate::solve::scene::Scene;
use crate::solve::scene::load::{load, read_mask};
use crate::solve::{Options, Progress, SolveError};
use crate::swatch::{self, MaskChoice, Swatch};
use std::path::{Path, PathBuf};
use weavelight_calibration::description::Image;

/// Which mask to make.
#[derive(Clone, Debug)]
pub struct MaskOptions {
    /// The capture session's folder.
    pub session: PathBuf,
    /// The calibration's folder.
    pub calibration: PathBuf,
    /// The picture to write; [`MASK_FILE`] in the capture session where absent.
    pub out: Option<PathBuf>,
    /// Whether a picture that stands there already and differs is replaced.
    pub reuse: Reuse,
}

/// A mask that stands on disk.
#[derive(Clone, Debug, PartialEq)]
pub struct MaskMade {
    /// The picture.
    pub path: PathBuf,
    /// What it shows.
    pub swatch: Swatch,
    /// Whether the same picture was there already.
    pub up_to_date: bool,
    /// Whether the capture session names it, so that a solve heeds it.
    pub named: bool,
    /// What reading the frames had to say.
    pub warnings: Vec<String>,
}

/// Finds the swatch, writes it white on black, and names the picture in `session.toml` where it lies in the capture
/// session. A picture that differs from what would be written may have been edited, and is kept.
///
/// # Errors
/// Where the frames cannot be read or solved, the picture cannot be written, or another stands in its place.
pub fn make_mask(
    options: &MaskOptions,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<MaskMade, SolveError> {
    let path = options.out.clone().unwrap_or_else(|| options.session.join(MASK_FILE));
    let _locks = lock(&options.session, &path)?;
    let mut session = Session::load(&options.session)?;
    let calibration = Calibration::load(&options.calibration)?;
    let solving = Options {
        mask: MaskChoice::Everything,
        ..Options::new(&options.session, &options.calibration, "")
    };
    let loaded = load(&solving, &session, calibration, progress)?;
    let (mut scene, mut warnings) = (loaded.scene, loaded.warnings);
    let stands = (path.exists() && options.reuse == Reuse::IfCurrent)
        .then(|| read_mask(&path, &scene))
        .transpose()?;
    warnings.extend(scene.leave_out_what_adds_nothing()?);
    let swatch = scene.find_swatch(progress)?;
    let up_to_date = match stands {
        Some(mask) if mask != swatch.mask => return Err(SolveError::EditedMask { path }),
        Some(_) => true,
        None => {
            warnings.extend(write_mask(&path, &swatch.mask)?);
            false
        }
    };
    let named = name_in_session(&mut session, &path)?;
    Ok(MaskMade { path, swatch, up_to_date, named, warnings })
}

impl Scene {
    /// Finds the swatch. Where no table can be told from it, the mask is the whole frame and the sentence says why.
    ///
    /// # Errors
    /// As [`Scene::check`].
    pub fn find_swatch(&self, progress: &(dyn Fn(Progress) + Sync)) -> Result<Swatch, SolveError> {
        if let Some(everything) = Swatch::of_size(self.size_px()) {
            return Ok(everything);
        }
        let small = self.reduced(swatch::SCALE);
        let solved = small.check()?.solve(Method::LeastSquares, &Device::Cpu, None, progress)?;
        Ok(Swatch::in_maps(&solved.maps, self.size_px(), self.plane.normal.into_inner().into()))
    }
}

/// No other process may write the picture meanwhile, nor the manifest that will name it.
fn lock(session: &Path, path: &Path) -> Result<[Option<Lock>; 2], FileError> {
    let folder = |path: &Path| path.canonicalize().ok();
    let inside = match (folder(parent_of(path)), folder(session)) {
        (Some(parent), Some(session)) => parent.starts_with(session),
        _ => false,
    };
    let whole = inside.then(|| Lock::acquire(session, "mask")).transpose()?;
    if inside {
        clean_temporary(session);
    }
    let alone = (!inside).then(|| Lock::beside(path, "mask")).transpose()?;
    Ok([whole, alone])
}

/// Writes it; what stood there and differs is kept beside it, which the sentence says.
fn write_mask(path: &Path, mask: &Image<bool>) -> Result<Option<String>, FileError> {
    let data = mask.data.iter().map(|&inside| if inside { 255 } else { 0 }).collect();
    let picture = Image { width: mask.width, height: mask.height, data };
    let bytes = encode_png_grey8(&picture).map_err(|source| FileError::write(path, source))?;
    let kept = keep_aside(path, &bytes)?;
    write_atomic(path, &bytes)?;
    let said =
        |kept: PathBuf| format!("The picture that stood there is kept as {}.", kept.display());
    Ok(kept.map(said))
}

/// Gives a file that is about to be replaced by other bytes a second name: `mask-1.png`, or the next that is free.
fn keep_aside(path: &Path, bytes: &[u8]) -> Result<Option<PathBuf>, FileError> {
    // Through links, as it is replaced; what is no file is refused by the writing.
    let Ok(path) = path.canonicalize() else { return Ok(None) };
    if !path.is_file() || sha256_of_file(&path)? == sha256_hex(bytes) {
        return Ok(None);
    }
    let stem = path.file_stem().unwrap_or_default();
    for number in 1.. {
        let mut name = stem.to_owned();
        name.push(format!("-{number}.png"));
        let aside = path.with_file_name(name);
        match std::fs::hard_link(&path, &aside) {
            Ok(()) => return Ok(Some(aside)),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(FileError::write(&aside, error)),
        }
    }
    Ok(None)
}

/// Records the mask where it lies in the capture session's folder; true if it does.
fn name_in_session(session: &mut Session, path: &Path) -> Result<bool, SolveError> {
    let full = |path: &Path| path.canonicalize().map_err(|source| FileError::read(path, source));
    let (folder, path) = (full(&session.folder)?, full(path)?);
    let Ok(inside) = path.strip_prefix(&folder) else { return Ok(false) };
    if session.mask.as_deref() != Some(inside) {
        session.mask = Some(inside.to_owned());
        session.save()?;
    }
    Ok(true)
}
