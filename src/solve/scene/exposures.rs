//! Whether the manifest's exposures are those that the files state.

use crate::raw::Frame;
use crate::session::{FrameEntry, Session};

/// Files round to thirds of a stop, and name 1/60 what is 1/64 of a second.
const MOST_STOPS: f64 = 0.35;

/// Frames that are named.
const NAMED: usize = 3;

/// Sentences on frames whose file states another exposure time or ISO than the manifest.
pub(crate) fn contradictions(session: &Session, frames: &[Frame]) -> Vec<String> {
    let found: Vec<String> =
        session.frames.iter().zip(frames).filter_map(|(entry, frame)| of(entry, frame)).collect();
    if found.is_empty() {
        return Vec::new();
    }
    let more = match found.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!("; so do {more} more"),
    };
    let named = found[..found.len().min(NAMED)].join("; ");
    vec![format!(
        "{named}{more}. Signals are divided by the numbers of {}: where the files are right, correct them there.",
        session.manifest_path().display()
    )]
}

fn of(entry: &FrameEntry, frame: &Frame) -> Option<String> {
    let metadata = &frame.metadata;
    let differs = |stated: Option<f64>, written: f64| {
        stated.filter(|stated| (stated / written).log2().abs() > MOST_STOPS)
    };
    let seconds = differs(metadata.exposure_s, entry.exposure_s).map(|stated| {
        format!("exposure_s = {} but the file states {}", entry.exposure_s, rounded(stated))
    });
    let iso = differs(metadata.iso, entry.iso)
        .map(|stated| format!("iso = {} but the file states {}", entry.iso, rounded(stated)));
    let what: Vec<String> = seconds.into_iter().chain(iso).collect();
    (!what.is_empty()).then(|| format!("{}: {}", entry.file.display(), what.join(", ")))
}

/// Six digits: files hold fractions.
fn rounded(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raw::{Layout, Metadata, Samples};
    use crate::session::Kind;

    fn check(written: [f64; 2], stated: [Option<f64>; 2], expected: Option<&str>) {
        let mut session = Session::new("s", Kind::Swatch, "s");
        session.frames.push(FrameEntry::new("a.nef", Some(0), written[0], written[1]));
        let metadata = Metadata { exposure_s: stated[0], iso: stated[1], ..Metadata::default() };
        let frame = Frame {
            width: 1,
            height: 1,
            layout: Layout::Grey,
            samples: Samples::U16(vec![0]),
            black: [0.0; 4],
            saturation: [1.0; 4],
            metadata,
        };
        let found = contradictions(&session, &[frame]);
        assert_eq!(found.len(), usize::from(expected.is_some()), "{written:?} {stated:?}");
        if let Some(expected) = expected {
            assert!(found[0].contains(expected), "{}", found[0]);
        }
    }

    #[test]
    fn only_what_rounding_does_not_explain() {
        check([1.0 / 64.0, 100.0], [Some(1.0 / 60.0), Some(100.0)], None);
        check([0.33, 100.0], [Some(1.0 / 3.0), None], None);
        check([0.01, 100.0], [Some(1.0 / 125.0), None], None);
        check([1.0, 100.0], [None, None], None);
        check(
            [1.0, 100.0],
            [Some(0.25), Some(100.0)],
            Some("a.nef: exposure_s = 1 but the file states 0.25."),
        );
        check(
            [1.0, 100.0],
            [Some(1.0), Some(400.0)],
            Some("a.nef: iso = 100 but the file states 400."),
        );
    }
}
