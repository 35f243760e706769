//! What is photographed, in which order.

use super::ScanError;
use super::store::is_of;
use super::subject::{Pose, Subject};
use crate::device::board::wire::LIGHTS_MAX;
use crate::instrument::Rig;
use crate::session::FrameEntry;

/// One frame to take.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Its file's name without ending.
    pub stem: String,
    /// The rig's light; `None`: every LED off.
    pub light: Option<usize>,
    /// The board's output of that light.
    pub output: Option<u8>,
    /// Exposure relative to the scan's.
    pub factor: f64,
    /// The first light again, to see drift.
    pub drift_check: bool,
    /// A picture of a chessboard: its light is not recorded, since what counts is its shape.
    pub board: Option<Pose>,
}

/// The frames of a scan, in order: ambient light, each light (at each exposure of a bracket), the first light again; of a grey
/// chart one light at several exposures before that; of a chessboard one picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// In the order in which they are taken.
    pub steps: Vec<Step>,
}

/// The widest bracket that makes sense: beyond, one of two exposures is black or white.
const FACTORS: std::ops::RangeInclusive<f64> = 1.0 / 1024.0..=1024.0;

/// Exposures of the light that a grey chart is photographed under at several, relative to the common one.
const LINEARITY: [f64; 6] = [0.03125, 0.0625, 0.125, 0.25, 0.5, 1.5];
/// Stems of a board's pictures.
const TABLE_STEM: &str = "board-table";
const FREE_STEM: &str = "board-";

impl Step {
    /// The light as the capture session records it.
    pub fn recorded_light(&self) -> Option<usize> {
        self.light.filter(|_| self.board.is_none())
    }

    /// The outputs while its shutter is open: one bit, or none.
    pub fn pins(&self) -> u32 {
        self.output.map_or(0, |output| 1u32.checked_shl(output.into()).unwrap_or(0))
    }

    /// As in "light 4" or "the ambient frame".
    pub fn name(&self) -> String {
        match (self.board, self.light) {
            (Some(Pose::Table), _) => "the board on the table".to_owned(),
            (Some(Pose::Free), _) => format!("the board's picture {}", self.stem),
            (None, None) => "the ambient frame".to_owned(),
            (None, Some(light)) if self.drift_check => format!("light {light} again"),
            (None, Some(light)) if self.factor != 1.0 => {
                format!("light {light} at {} times the exposure", self.factor)
            }
            (None, Some(light)) => format!("light {light}"),
        }
    }
}

impl Plan {
    /// A scan with `rig`; `bracket`: further exposures of each light, relative to the scan's own.
    ///
    /// # Errors
    /// Where a light hangs on an output that no board has, or the bracket makes no sense.
    pub fn new(rig: &Rig, bracket: &[f64]) -> Result<Self, ScanError> {
        check_bracket(bracket)?;
        let mut steps = vec![step("ambient".to_owned(), None)];
        for light in 0..rig.lights.len() {
            steps.push(step(format!("light-{light:02}"), Some(light)));
            let further = bracket.iter().enumerate().map(|(k, &factor)| Step {
                factor,
                ..step(format!("light-{light:02}-exposure-{}", k + 1), Some(light))
            });
            steps.extend(further);
        }
        steps.push(Step { drift_check: true, ..step("drift-check".to_owned(), Some(0)) });
        Self { steps }.wired(rig)
    }

    /// The pictures of `subject` that are to be taken with `rig`; `there`: the frames that its capture session has already.
    ///
    /// # Errors
    /// As [`Plan::new`], and where the bracket or the board's light make no sense.
    pub fn of(
        rig: &Rig,
        subject: &Subject,
        bracket: &[f64],
        there: &[FrameEntry],
    ) -> Result<Self, ScanError> {
        if let (Subject::Grey { .. } | Subject::Board { .. }, false) = (subject, bracket.is_empty())
        {
            return Err(ScanError::BracketOfTarget);
        }
        match subject {
            Subject::Swatch | Subject::White(_) => Self::new(rig, bracket),
            Subject::Grey { .. } => {
                let mut plan = Self::new(rig, &[])?;
                let one = |(k, &factor): (usize, &f64)| Step {
                    factor,
                    ..step(format!("light-00-exposure-{k}"), Some(0))
                };
                let before_last = plan.steps.len() - 1;
                let linearity = LINEARITY.iter().enumerate().map(one);
                plan.steps.splice(before_last..before_last, linearity);
                plan.wired(rig)
            }
            Subject::Board { pose, light, .. } => {
                if *light >= rig.lights.len() {
                    let last = rig.lights.len().saturating_sub(1);
                    return Err(ScanError::NoSuchLight { light: *light, last });
                }
                let stem = match pose {
                    Pose::Table => TABLE_STEM.to_owned(),
                    Pose::Free => format!("{FREE_STEM}{:02}", next_number(there)),
                };
                let picture = Step { board: Some(*pose), ..step(stem, Some(*light)) };
                Self { steps: vec![picture] }.wired(rig)
            }
        }
    }

    /// Further exposures of each light as the frames of a scan have them, relative to the scan's own: what [`Plan::new`] was
    /// made with. Empty where there are none, or the frames are no scan's.
    pub fn bracket_of(there: &[FrameEntry]) -> Vec<f64> {
        let signal = |entry: &FrameEntry| entry.exposure_s * entry.iso;
        let factor = |further: usize| {
            there.iter().find_map(|entry| {
                let light = entry.light?;
                let is = |stem: String| {
                    move |entry: &&FrameEntry| is_of(entry, &step(stem.clone(), Some(light)))
                };
                let own = there.iter().find(is(format!("light-{light:02}")))?;
                let other =
                    there.iter().find(is(format!("light-{light:02}-exposure-{further}")))?;
                Some(signal(other) / signal(own))
            })
        };
        (1..).map_while(factor).collect()
    }

    /// The frames that a scan of a swatch with `rig` still lacks, of which `there` are recorded; `None` where these are no
    /// scan's, but were imported or simulated under other names.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn missing(rig: &Rig, there: &[FrameEntry]) -> Result<Option<Vec<Step>>, ScanError> {
        let plan = Self::new(rig, &Self::bracket_of(there))?;
        let known = |entry: &FrameEntry| plan.steps.iter().any(|step| is_of(entry, step));
        if !there.iter().all(known) {
            return Ok(None);
        }
        let lacks = |step: &Step| !there.iter().any(|entry| is_of(entry, step));
        Ok(Some(plan.steps.into_iter().filter(lacks).collect()))
    }

    /// Without the exposures that a camera which is set by hand cannot take; whether there were any.
    pub(super) fn without_other_exposures(mut self) -> (Self, bool) {
        let before = self.steps.len();
        self.steps.retain(|step| step.factor == 1.0);
        let left_out = self.steps.len() < before;
        (self, left_out)
    }

    fn wired(mut self, rig: &Rig) -> Result<Self, ScanError> {
        for step in &mut self.steps {
            step.output = step.light.map(|light| output(rig, light)).transpose()?;
        }
        Ok(self)
    }
}

fn step(stem: String, light: Option<usize>) -> Step {
    Step { stem, light, output: None, factor: 1.0, drift_check: false, board: None }
}

/// The number of a board's next picture: no earlier one is overwritten.
fn next_number(there: &[FrameEntry]) -> usize {
    let number = |entry: &FrameEntry| {
        let stem = entry.file.file_stem()?.to_str()?;
        let digits = stem.strip_prefix(FREE_STEM)?.split('-').next()?;
        digits.parse::<usize>().ok()
    };
    there.iter().filter_map(number).max().unwrap_or(0).saturating_add(1)
}

fn output(rig: &Rig, light: usize) -> Result<u8, ScanError> {
    let channel = rig.channel(light);
    u8::try_from(channel)
        .ok()
        .filter(|output| *output < LIGHTS_MAX)
        .ok_or(ScanError::Output { light, channel })
}

fn check_bracket(bracket: &[f64]) -> Result<(), ScanError> {
    let bad = |(k, factor): (usize, &f64)| {
        !FACTORS.contains(factor) || *factor == 1.0 || bracket[..k].contains(factor)
    };
    match bracket.iter().enumerate().find(|&(k, factor)| bad((k, factor))) {
        Some((_, &factor)) => Err(ScanError::Bracket { factor }),
        None => Ok(()),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::simulate::{Instrument, Options};

    pub(in crate::device::scan) fn reference_rig() -> Rig {
        let options = Options { size_px: Some([32, 32]), ..Options::default() };
        Instrument::from_options(&options).unwrap().rig
    }

    #[test]
    fn ambient_light_each_light_and_the_first_again() {
        let plan = Plan::new(&reference_rig(), &[]).unwrap();
        let stems: Vec<&str> = plan.steps.iter().map(|step| step.stem.as_str()).collect();
        assert_eq!(
            (stems[0], stems[1], stems[10], stems[11]),
            ("ambient", "light-00", "light-09", "drift-check")
        );
        let pins: Vec<u32> = plan.steps.iter().map(Step::pins).collect();
        assert_eq!(pins, [0, 1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1]);
        assert!(
            plan.steps[11].drift_check && plan.steps[..11].iter().all(|step| !step.drift_check)
        );
    }

    #[test]
    fn outputs_are_those_of_the_rig() {
        let mut rig = reference_rig();
        rig.lights[2].channel = Some(13);
        assert_eq!(Plan::new(&rig, &[]).unwrap().steps[3].pins(), 1 << 13);
        rig.lights[2].channel = Some(16);
        let error = Plan::new(&rig, &[]).unwrap_err().to_string();
        assert!(error.contains("light 2 is on channel 16"), "{error}");
    }

    fn grey() -> Subject {
        Subject::Grey { patches: Vec::new() }
    }

    #[test]
    fn a_grey_chart_has_one_light_at_several_exposures() {
        let plan = Plan::of(&reference_rig(), &grey(), &[], &[]).unwrap();
        assert_eq!(plan.steps.len(), 1 + 10 + 6 + 1);
        assert!(plan.steps.last().unwrap().drift_check);
        let linearity: Vec<_> = plan.steps.iter().filter(|step| step.factor != 1.0).collect();
        assert!(linearity.iter().all(|step| step.light == Some(0) && step.pins() == 1));
        let (by_hand, left_out) = plan.clone().without_other_exposures();
        assert!(left_out);
        assert_eq!(by_hand, Plan::new(&reference_rig(), &[]).unwrap());
        let error = Plan::of(&reference_rig(), &grey(), &[0.5], &[]).unwrap_err().to_string();
        assert!(error.contains("bracket is for swatches"), "{error}");
    }

    #[test]
    fn a_board_is_photographed_once_more() {
        let board = crate::session::Board { columns: 9, rows: 6, square_mm: 25.0 };
        let check = |pose: Pose, there: &[&str], expected: &str| {
            let there: Vec<FrameEntry> =
                there.iter().map(|name| FrameEntry::new(*name, None, 0.1, 100.0)).collect();
            let subject = Subject::Board { board, pose, light: 3 };
            let plan = Plan::of(&reference_rig(), &subject, &[], &there).unwrap();
            let [step] = plan.steps.as_slice() else { panic!("{plan:?}") };
            assert_eq!((step.stem.as_str(), step.pins()), (expected, 8));
            assert_eq!((step.light, step.recorded_light()), (Some(3), None));
        };
        check(Pose::Table, &[], "board-table");
        check(Pose::Free, &[], "board-01");
        check(Pose::Free, &["board-table.dng", "board-07-take-2.nef", "other.nef"], "board-08");
        let subject = Subject::Board { board, pose: Pose::Free, light: 10 };
        let error = Plan::of(&reference_rig(), &subject, &[], &[]).unwrap_err().to_string();
        assert!(error.contains("light is 10; the rig has lights 0 to 9"), "{error}");
    }

    #[test]
    fn what_a_scan_lacks_follows_from_its_plan() {
        let rig = reference_rig();
        let frames = |bracket: &[f64]| -> Vec<FrameEntry> {
            let plan = Plan::new(&rig, bracket).unwrap();
            let entry = |step: &Step| FrameEntry {
                drift_check: step.drift_check,
                ..FrameEntry::new(
                    format!("{}.nef", step.stem),
                    step.light,
                    0.1 * step.factor,
                    100.0,
                )
            };
            plan.steps.iter().map(entry).collect()
        };
        let lacks = |there: &[FrameEntry]| {
            let missing = Plan::missing(&rig, there).unwrap();
            missing.map(|steps| steps.into_iter().map(|step| step.stem).collect::<Vec<_>>())
        };
        assert_eq!(lacks(&frames(&[])), Some(Vec::new()));
        assert_eq!(lacks(&[]).unwrap().len(), 12);
        assert_eq!(lacks(&frames(&[])[..11]), Some(vec!["drift-check".to_owned()]));
        let mut bracketed = frames(&[0.25, 4.0]);
        assert_eq!(Plan::bracket_of(&bracketed), [0.25, 4.0]);
        assert_eq!(lacks(&bracketed), Some(Vec::new()));
        // Light 9 has one of its two further exposures, under the name of its second try.
        bracketed[29].file = "light-09-exposure-1-take-2.nef".into();
        bracketed.remove(30);
        assert_eq!(lacks(&bracketed), Some(vec!["light-09-exposure-2".to_owned()]));
        // A name that only looks like an exposure's, and pictures from elsewhere.
        let elsewhere = [FrameEntry::new("long-exposure-7.tif", Some(0), 0.1, 100.0)];
        assert_eq!(lacks(&elsewhere), None);
    }

    #[test]
    fn a_bracket_adds_exposures_of_each_light() {
        let plan = Plan::new(&reference_rig(), &[0.25, 4.0]).unwrap();
        assert_eq!(plan.steps.len(), 1 + 10 * 3 + 1);
        let names: Vec<String> = plan.steps[4..7].iter().map(Step::name).collect();
        assert_eq!(
            names,
            ["light 1", "light 1 at 0.25 times the exposure", "light 1 at 4 times the exposure"]
        );
        for bad in [&[1.0][..], &[0.0], &[-2.0], &[f64::NAN], &[4.0, 4.0], &[1e6]] {
            assert!(Plan::new(&reference_rig(), bad).is_err(), "{bad:?}");
        }
    }
}
