//! Problems that the window shows.

use weavelight::files::one_line;

/// Something that went wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// What was to be done, as in "Scan".
    pub title: String,
    /// What is wrong, where, and what to do: the library's own words.
    pub text: String,
    /// Whether the work failed, or is done and this ought to be known.
    pub severity: Severity,
    /// What it belongs to; `None` where that is not known.
    pub area: Option<Area>,
}

/// What a problem belongs to: the next try there shows whether it is still one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Area {
    /// Opening a rig.
    Opening,
    /// Board, camera and lights.
    Rig,
    /// Calibrating.
    Calibrate,
    /// Scanning and solving.
    Scan,
    /// Looking at a solution.
    Look,
    /// The gallery of scans.
    Scans,
    /// Saving the settings.
    Settings,
}

/// Characters of a problem: names of files and what is in them may be any length.
const LONGEST: usize = 1500;

impl Problem {
    /// Work that failed.
    pub fn error(title: impl Into<String>, text: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            text: one_line(&text.into(), LONGEST),
            severity: Severity::Error,
            area: None,
        }
    }

    /// The same, of an area.
    pub fn of(self, area: Area) -> Self {
        Self { area: Some(area), ..self }
    }

    /// Something that ought to be known.
    pub fn warning(title: impl Into<String>, text: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            text: one_line(&text.into(), LONGEST),
            severity: Severity::Warning,
            area: None,
        }
    }
}

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The work is done; this ought to be known.
    Warning,
    /// The work failed.
    Error,
}
