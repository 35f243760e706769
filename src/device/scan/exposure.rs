//! Test shots: how long to expose, and a preview for the technician.

use super::ScanError;
use super::shoot::{Shot, Told, shoot};
use crate::device::board::Board;
use crate::device::camera::{Camera, Settings};
use crate::device::look::Look;
use crate::files::{InputKind, read_input};
use crate::raw::{Frame, Hint, decode};
use std::ops::RangeInclusive;
use std::path::Path;

/// The first test shot's exposure time, seconds.
const FIRST_S: f64 = 0.1;
/// Exposure times between which the program looks by itself, seconds.
const SEARCHED_S: RangeInclusive<f64> = 0.0005..=30.0;
/// Test shots at most: from far off, two find the order of magnitude, and two refine.
const MOST_SHOTS: usize = 6;
/// Where the brightest half per cent should begin, as a fraction of the range: room for lights that are brighter than the one
/// that is tried.
const AIM: f64 = 0.6;
/// Close enough to the aim.
const CLOSE: RangeInclusive<f64> = 0.5..=0.72;
/// Above this, the brightest samples may clip, and say only that it is too much.
const TOO_MUCH: f64 = 0.95;
/// Below this, noise and black level spoil the estimate.
const TOO_LITTLE: f64 = 0.02;
/// What the exposure advice calls good.
const GOOD: RangeInclusive<f64> = 0.5..=0.9;
/// What it aims at.
const GOOD_AIM: f64 = 0.7;

/// What a test shot shows.
#[derive(Clone, Debug)]
pub struct Preview {
    /// The picture.
    pub frame: Frame,
    /// The light that was on.
    pub light: usize,
    /// How it was exposed, as far as camera or file say so.
    pub settings: Settings,
    /// Histogram, levels and focus measure.
    pub look: Look,
    /// A better exposure time, where this one is not good; seconds.
    pub better_exposure_s: Option<f64>,
    /// The same as a sentence.
    pub advice: String,
}

/// Takes one picture under `light` (at the board's `output`) and says what to do about the exposure.
///
/// # Errors
/// Where board or camera fail, or the picture cannot be read.
pub fn preview(
    board: &Board,
    camera: &mut dyn Camera,
    (light, output): (usize, u8),
    wanted: Settings,
) -> Result<Preview, ScanError> {
    let folder = tempfile::tempdir()
        .map_err(|source| crate::files::FileError::write(&std::env::temp_dir(), source))?;
    let (frame, settings) = test_shot(board, camera, output, wanted, folder.path())?;
    let look = Look::at(&frame);
    let better_exposure_s = better(settings.exposure_s, &look);
    Ok(Preview {
        frame,
        advice: advice(settings, &look, better_exposure_s),
        light,
        settings,
        look,
        better_exposure_s,
    })
}

fn better(exposure_s: f64, look: &Look) -> Option<f64> {
    let high = look.high();
    if GOOD.contains(&high) {
        return None;
    }
    // A clipped picture does not say by how much; a dark one by how much is uncertain.
    let factor = if high > TOO_MUCH { 0.25 } else { GOOD_AIM / high.max(GOOD_AIM / 64.0) };
    Some(three_digits(exposure_s * factor))
}

fn advice(settings: Settings, look: &Look, better: Option<f64>) -> String {
    let at = format!(
        "at {} s and ISO {} the brightest samples reach {:.0} % of full scale",
        settings.exposure_s,
        settings.iso,
        100.0 * look.high().min(1.0)
    );
    match better {
        None => format!("{at}: good"),
        Some(better) if look.high() > TOO_MUCH => {
            format!("{at}: too much; try {better} s and look again")
        }
        Some(better) => format!("{at}: 50 to 90 % is good; try {better} s"),
    }
}

/// The exposure for a scan, found with test shots under one light.
pub(super) fn meter(
    board: &Board,
    camera: &mut dyn Camera,
    (light, output): (usize, u8),
    iso: f64,
    folder: &Path,
) -> Result<Settings, ScanError> {
    let mut exposure_s = FIRST_S;
    for _ in 0..MOST_SHOTS {
        let wanted = Settings { exposure_s, iso };
        let (frame, settings) = test_shot(board, camera, output, wanted, folder)?;
        let look = Look::at(&frame);
        match next_exposure(settings.exposure_s, look.high()) {
            None => return Ok(settings),
            Some(next) => exposure_s = next,
        }
        if exposure_s == *SEARCHED_S.end() && look.high() < TOO_LITTLE {
            return Err(ScanError::Dark { light, exposure_s: settings.exposure_s });
        }
    }
    Ok(Settings { exposure_s, iso })
}

/// `None`: this one is right, or nothing better can be had.
fn next_exposure(exposure_s: f64, high: f64) -> Option<f64> {
    if CLOSE.contains(&high) {
        return None;
    }
    let factor = match high {
        _ if high > TOO_MUCH => 0.125,
        _ if high < TOO_LITTLE => 8.0,
        _ => AIM / high,
    };
    let next = three_digits((exposure_s * factor).clamp(*SEARCHED_S.start(), *SEARCHED_S.end()));
    (next != exposure_s).then_some(next)
}

fn three_digits(value: f64) -> f64 {
    // Through decimal text: the shortest number that says what was meant.
    format!("{value:.2e}").parse().unwrap_or(value)
}

fn test_shot(
    board: &Board,
    camera: &mut dyn Camera,
    output: u8,
    wanted: Settings,
    folder: &Path,
) -> Result<(Frame, Settings), ScanError> {
    board.light(output, None)?;
    let shot = shoot(board, camera, (wanted, &mut Told::default()), folder, &|_| ());
    board.off()?;
    let Shot { path, settings, .. } = shot?;
    let bytes = read_input(&path, InputKind::Picture)
        .map_err(|e| crate::files::FileError::read(&path, e))?;
    let _ = std::fs::remove_file(&path);
    let frame = decode(&bytes, &Hint::default())
        .map_err(|error| ScanError::TestShot { why: error.to_string() })?;
    let of_file =
        |said: Option<f64>, set: f64| if settings.is_some() { set } else { said.unwrap_or(set) };
    let actual = settings.unwrap_or(wanted);
    let settings = Settings {
        exposure_s: of_file(frame.metadata.exposure_s, actual.exposure_s),
        iso: of_file(frame.metadata.iso, actual.iso),
    };
    Ok((frame, settings))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many test shots find the exposure, on a swatch that reaches full scale after `full_s`.
    fn shots(full_s: f64) -> (usize, f64) {
        let mut exposure_s = FIRST_S;
        for shot in 1..=MOST_SHOTS {
            let high = (exposure_s / full_s).min(1.0);
            match next_exposure(exposure_s, high) {
                None => return (shot, high),
                Some(next) => exposure_s = next,
            }
        }
        (MOST_SHOTS, (exposure_s / full_s).min(1.0))
    }

    #[test]
    fn the_exposure_is_found_in_a_few_shots() {
        for full_s in [0.002, 0.01, 0.05, 0.16, 0.5, 2.0, 10.0, 45.0] {
            let (count, high) = shots(full_s);
            assert!(CLOSE.contains(&high), "{full_s}: {high} after {count}");
        }
    }

    #[test]
    fn advice_for_a_test_shot() {
        let check = |high: f64, better_s: Option<f64>, expected: &str| {
            let channel = crate::device::look::Channel { name: "G", high, ..Default::default() };
            let look =
                Look { size_px: [1, 1], channels: vec![channel], sharpness: 0.0, sketch: vec![] };
            let settings = Settings { exposure_s: 0.5, iso: 100.0 };
            assert_eq!(better(0.5, &look), better_s, "{high}");
            let said = advice(settings, &look, better_s);
            assert!(said.ends_with(expected), "{said}");
        };
        check(0.6, None, "reach 60 % of full scale: good");
        check(0.35, Some(1.0), "35 % of full scale: 50 to 90 % is good; try 1 s");
        check(0.92, Some(0.38), "try 0.38 s");
        check(1.02, Some(0.125), "100 % of full scale: too much; try 0.125 s and look again");
        check(0.0, Some(32.0), "try 32 s");
    }
}
