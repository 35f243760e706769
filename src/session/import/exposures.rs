//! How long and how sensitively pictures were taken, from their files.

use super::{ImportError, Options};
use crate::files::Setting;
use crate::quantity::{EXPOSURE_S, ISO};
use crate::raw::Metadata;
use std::path::{Path, PathBuf};

/// What one is taken as where no file states it: then only ratios matter, and all are equal.
const UNSTATED: Exposure = Exposure { seconds: 1.0, iso: 100.0 };

/// Stops by which apertures may differ: files round them.
const SAME_APERTURE: f64 = 0.12;

/// Relative difference of numbers that count as one.
const SAME: f64 = 1e-3;

/// Of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Exposure {
    pub(super) seconds: f64,
    pub(super) iso: f64,
}

/// What a picture's file states.
#[derive(Clone, Debug, Default)]
pub(super) struct Stated {
    pub(super) path: PathBuf,
    pub(super) seconds: Option<f64>,
    pub(super) iso: Option<f64>,
    pub(super) f_number: Option<f64>,
}

impl Stated {
    pub(super) fn new(path: &Path, metadata: &Metadata) -> Self {
        Self {
            path: path.to_owned(),
            seconds: metadata.exposure_s.filter(|value| EXPOSURE_S.check(*value).is_ok()),
            iso: metadata.iso.filter(|value| ISO.check(*value).is_ok()),
            f_number: metadata.f_number.filter(|value| *value > 0.1 && *value < 1000.0),
        }
    }
}

/// The exposures, and sentences for the user.
///
/// # Errors
/// Pictures that cannot be compared: of several apertures, or some with differing exposures and some that state none.
pub(super) fn settle(
    stated: &[Stated],
    has_intensities: bool,
    options: &Options,
) -> Result<(Vec<Exposure>, Vec<String>), ImportError> {
    let all = |exposure: Exposure| vec![exposure; stated.len()];
    if options.same_exposure {
        let first = |of: fn(&Stated) -> Option<f64>| stated.iter().find_map(of);
        let seconds = first(|s| s.seconds).unwrap_or(UNSTATED.seconds);
        let iso = first(|s| s.iso).unwrap_or(UNSTATED.iso);
        return Ok((all(Exposure { seconds, iso }), Vec::new()));
    }
    check_apertures(stated)?;
    let mut warnings = Vec::new();
    let seconds = fill(stated, |s| s.seconds, UNSTATED.seconds, "exposure time", &mut warnings)?;
    let iso = fill(stated, |s| s.iso, UNSTATED.iso, "ISO", &mut warnings)?;
    let differ = [&seconds, &iso].iter().any(|values| differing(values.iter().copied()).is_some());
    if has_intensities && differ {
        warnings.push(format!(
            "the files state different exposures, and signals are divided by them and by \
             light_intensities.txt; if these pictures or intensities already include the exposure, \
             import with {}",
            Setting("same-exposure")
        ));
    }
    let exposures = seconds.into_iter().zip(iso);
    Ok((exposures.map(|(seconds, iso)| Exposure { seconds, iso }).collect(), warnings))
}

/// One number a picture: what its file states, or what the others agree on.
fn fill(
    stated: &[Stated],
    of: fn(&Stated) -> Option<f64>,
    otherwise: f64,
    what: &'static str,
    warnings: &mut Vec<String>,
) -> Result<Vec<f64>, ImportError> {
    let silent: Vec<&Stated> = stated.iter().filter(|s| of(s).is_none()).collect();
    let Some(common) = stated.iter().find_map(of) else { return Ok(vec![otherwise; stated.len()]) };
    let Some(first) = silent.first() else { return Ok(stated.iter().filter_map(of).collect()) };
    if let Some([low, high]) = differing(stated.iter().filter_map(of)) {
        return Err(ImportError::ExposureMixed {
            path: first.path.clone(),
            what,
            low: shown(low, what),
            high: shown(high, what),
        });
    }
    let others = match silent.len() {
        1 => String::new(),
        count => format!(" (nor do {} others)", count - 1),
    };
    warnings.push(format!(
        "{} states no {what}{others}; taken as {}, which all others state",
        first.path.display(),
        shown(common, what)
    ));
    Ok(vec![common; stated.len()])
}

/// The least and the largest, where they differ.
fn differing(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let [low, high] = values
        .fold([f64::INFINITY, 0.0_f64], |[low, high], value| [low.min(value), high.max(value)]);
    (high > low * (1.0 + SAME)).then_some([low, high])
}

/// Light goes with 1 / N^2, but so do depth of field and the fall-off to the corners: no one number corrects that.
fn check_apertures(stated: &[Stated]) -> Result<(), ImportError> {
    let mut known = stated.iter().filter_map(|s| Some((s, s.f_number?)));
    let Some((first, expected)) = known.next() else { return Ok(()) };
    match known.find(|(_, found)| 2.0 * (found / expected).log2().abs() > SAME_APERTURE) {
        None => Ok(()),
        Some((other, found)) => Err(ImportError::Aperture {
            path: other.path.clone(),
            found,
            first: first.path.clone(),
            expected,
        }),
    }
}

fn shown(value: f64, what: &str) -> String {
    match what {
        "ISO" => format!("ISO {value}"),
        _ => seconds(value),
    }
}

/// "1/4 s", "2.5 s".
pub(super) fn seconds(value: f64) -> String {
    let inverse = 1.0 / value;
    let whole = inverse.round();
    if value < 0.9 && (inverse / whole - 1.0).abs() < 0.01 {
        format!("1/{whole} s")
    } else {
        format!("{} s", (value * 1e6).round() / 1e6)
    }
}

/// What was found, for the user; `None` where no file states anything.
pub(super) fn summary(stated: &[Stated], exposures: &[Exposure]) -> Option<String> {
    if stated.iter().all(|s| s.seconds.is_none() && s.iso.is_none()) {
        return None;
    }
    let times = match differing(exposures.iter().map(|exposure| exposure.seconds)) {
        Some([low, high]) => format!("{} to {}", seconds(low), seconds(high)),
        None => seconds(exposures.first()?.seconds),
    };
    let isos = match differing(exposures.iter().map(|exposure| exposure.iso)) {
        Some([low, high]) => format!("ISO {low} to {high}"),
        None => format!("ISO {}", exposures.first()?.iso),
    };
    Some(format!("{times}, {isos}"))
}
