//! Frames and how they were exposed.

use crate::instrument::{CalibratedLight, Color, Defects};
use crate::raw::{Frame, Layout};
use std::path::PathBuf;

/// A light and its frames.
#[derive(Clone, Debug)]
pub struct PhotographedLight {
    /// Its number in the rig, from 0.
    pub index: usize,
    /// What the calibration says of it.
    pub calibrated: CalibratedLight,
    /// At least one; by ascending exposure, then by content, so that nothing depends on the order of the files.
    pub exposures: Vec<Exposure>,
}

/// One frame and how it was exposed.
#[derive(Clone, Debug)]
pub struct Exposure {
    /// The picture.
    pub frame: Frame,
    /// Exposure time, seconds.
    pub exposure_s: f64,
    /// Sensitivity.
    pub iso: f64,
    /// Where it came from, for messages.
    pub path: PathBuf,
}

impl Exposure {
    /// Seconds at ISO 100 that give the same signal.
    pub fn seconds_at_iso_100(&self) -> f64 {
        seconds_at_iso_100(self.exposure_s, self.iso)
    }
}

/// Seconds at ISO 100 that give the same signal as `exposure_s` seconds at the sensitivity `iso`.
pub fn seconds_at_iso_100(exposure_s: f64, iso: f64) -> f64 {
    exposure_s * iso / 100.0
}

/// The frames of a capture session with what is known of lights and sensor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Photographs<'a> {
    pub(crate) layout: Layout,
    /// Width and height of every frame.
    pub(crate) size_px: (usize, usize),
    pub(crate) lights: &'a [PhotographedLight],
    /// Frames with every LED off.
    pub(crate) ambient: &'a [Exposure],
    pub(crate) color: &'a Color,
    pub(crate) defects: &'a Defects,
}

impl<'a> Photographs<'a> {
    /// The frames of the lights, then those with every LED off.
    pub(crate) fn exposures(&self) -> impl Iterator<Item = &'a Exposure> + use<'a> {
        self.lights.iter().flat_map(|light| &light.exposures).chain(self.ambient)
    }
}
