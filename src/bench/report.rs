//! The figures, as `bench.json` has them.

use super::colors::ColorRow;
use super::curves::Curve;
use serde::Serialize;

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Of this format.
    pub schema: i64,
    /// Which program measured.
    pub program: String,
    /// Threads that solved.
    pub threads: usize,
    /// One a picture set.
    pub sets: Vec<SetReport>,
    /// Time over megapixels and lights; empty where not asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub curves: Vec<Curve>,
    /// Colours of the albedo; empty where not asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub colors: Vec<ColorRow>,
}

/// One picture set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SetReport {
    /// Its name.
    pub name: String,
    /// What it shows.
    pub about: String,
    /// Width and height.
    pub size_px: [usize; 2],
    /// Lights that were solved with.
    pub lights: usize,
    /// Errors are of rows 0, `rows_step`, 2 `rows_step`, ...; slow methods solve only these.
    pub rows_step: usize,
    /// Photosites with a truth in these rows.
    pub compared: usize,
    /// The bound that times are held against.
    pub touch: Touch,
    /// One a method.
    pub methods: Vec<MethodReport>,
    /// What the solve warns of.
    pub warnings: Vec<String>,
}

/// Reading every sample and writing every value of the maps once.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Touch {
    /// Bytes read and written.
    pub bytes: usize,
    /// Median time.
    pub milliseconds: f64,
    /// Median processor time, all threads together.
    pub processor_milliseconds: f64,
}

/// One method on one set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodReport {
    /// Its name.
    pub name: String,
    /// What it does.
    pub about: String,
    /// Median processor time over that of touching the bytes once; on the wall, both, where a graphics processor takes part.
    pub times_touch: f64,
    /// The graphics processor that takes part.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adapter: Option<String>,
    /// Median time of a whole frame; of slow methods, extrapolated from the rows solved.
    pub milliseconds: f64,
    /// Median processor time, all threads together.
    pub processor_milliseconds: f64,
    /// Runs that the median is of.
    pub repeats: usize,
    /// Angle to the true normal, mean, degrees; unsolved photosites count 90.
    pub mean_deg: f64,
    /// Median.
    pub median_deg: f64,
    /// Root mean square.
    pub rms_deg: f64,
    /// 95 % are below.
    pub p95_deg: f64,
    /// Share of the photosites with a truth that were left unsolved.
    pub unsolved_share: f64,
    /// Share of the photosites that the subset test changed, where there is one.
    pub robust_share: Option<f64>,
    /// Whether no other method is both faster and nearer to the truth.
    pub on_front: bool,
}

impl Report {
    /// As `bench.json` holds it.
    pub fn json(&self) -> String {
        // Numbers, strings and lists of them: nothing that could fail to be written.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }
}
