//! A scan with real parts: does what the sequencer says, and tells it what happened.

use super::ScanError;
use super::assess::Assessor;
use super::control::{Control, Wish};
use super::exposure::meter;
use super::judge::{Judge, Seen};
use super::plan::{Plan, Step};
use super::sequencer::{Action, Ending, Input, Judgement, Sequencer, Trouble};
use super::shoot::{Shot, Told, shoot};
use super::store::{About, Begin, Place, Store, Taken, check_room};
use super::subject::Subject;
use super::summary::{Event, Seconds, Summary};
use crate::device::board::{Board, BoardError, Failure};
use crate::device::camera::{Camera, CameraError, Cure, Release, Settings};
use crate::files::{FileError, InputKind, Setting, read_input, shown};
use crate::instrument::Rig;
use crate::raw;
use crate::session::{FrameEntry, Session};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// What to scan and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The capture session's folder.
    pub folder: PathBuf,
    /// What is photographed.
    pub subject: Subject,
    /// What it will say.
    pub about: About,
    /// Whether it may be there already.
    pub begin: Begin,
    /// Exposure time; found with test shots where absent (or, with a camera that is set by hand, read from its files).
    pub exposure_s: Option<f64>,
    /// Sensitivity.
    pub iso: f64,
    /// Further exposures of each light, relative to the scan's.
    pub bracket: Vec<f64>,
}

/// The board's parts of a frame may take this long to come back after unplugging.
const BOARD_BACK: Duration = Duration::from_secs(20);
/// Before a frame is tried again.
const BREATH: Duration = Duration::from_millis(300);
/// How often wishes are looked for while nothing else is to do.
const LOOK: Duration = Duration::from_millis(50);
/// A file's exposure may differ from what was set by so much: cameras round.
const EXPOSURE_SLACK: f64 = 1.15;
/// Tilted by 20 degrees towards one light of a ring at 45 degrees of elevation, a sheet gets twice as much of it as of the
/// opposite one.
const UNKNOWN_LIE: f64 = 0.5;
/// A camera that is set by hand keeps one exposure.
const LINEARITY_BY_HAND: &str = "The sensor's linearity is not measured: this camera is set by hand. Tether it, or add frames of light 0 at several exposures to the capture session.";
/// How a JPEG file begins.
const JPEG: &[u8] = &[0xFF, 0xD8, 0xFF];
/// Exposure times that make sense, seconds: longer than that, the board turns the light off.
const EXPOSURES_S: [f64; 2] = [1e-5, 45.0];
/// Sensitivities that make sense.
const ISOS: [f64; 2] = [25.0, 102_400.0];

/// Scans a swatch, or photographs a calibration target. `tell` hears how it goes; `control` may pause or stop it.
///
/// # Errors
/// Where it cannot begin, or a frame cannot be taken. What is finished stays, and a scan that resumes goes on from there.
pub fn scan(
    rig: &Rig,
    options: &Options,
    board: &Board,
    camera: &mut dyn Camera,
    control: &Control,
    tell: &dyn Fn(&Event),
) -> Result<Summary, ScanError> {
    let start = Instant::now();
    let size_px = [rig.camera.width_px, rig.camera.height_px];
    let (foreseen, _) = check(rig, options, camera)?;
    check_room(&options.folder, size_px, foreseen.steps.len())?;
    let place = Place::take(&options.folder)?;
    // Another process may have added pictures until now.
    let (plan, left_out) = check(rig, options, camera)?;
    let whose = (&options.about, &options.subject);
    let (store, mut found) = Store::open(place, whose, options.begin, &plan)?;
    if left_out {
        found.warnings.push(LINEARITY_BY_HAND.to_owned());
    }
    let mut run = Run {
        rig,
        sequencer: Sequencer::new(&plan, &found.finished),
        assessor: Assessor::new(&plan),
        judge: Judge::start(size_px).map_err(ScanError::NoThread)?,
        base: found
            .settings
            .or(options.exposure_s.map(|s| Settings { exposure_s: s, iso: options.iso })),
        wanted: options.exposure_s.map(|s| Settings { exposure_s: s, iso: options.iso }),
        warnings: found.warnings,
        seconds: Seconds::default(),
        told: Told::default(),
        shot: None,
        error: None,
        resumed: found.finished.len(),
        plan,
        store,
        options,
        board,
        camera,
        control,
        tell,
        start,
    };
    for step in found.finished {
        run.judge.look_at(step, run.store.file(step));
    }
    let result = run.run();
    let _ = board.off();
    result
}

/// The plan, and whether exposures were left out of it; or what can be seen to be wrong before anything moves.
fn check(rig: &Rig, options: &Options, camera: &dyn Camera) -> Result<(Plan, bool), ScanError> {
    in_range(Setting("exposure-s"), options.exposure_s.unwrap_or(1.0), EXPOSURES_S)?;
    in_range(Setting("iso"), options.iso, ISOS)?;
    let by_hand = camera.describe().release == Release::Outside;
    if !options.bracket.is_empty() && by_hand {
        return Err(ScanError::BracketByHand);
    }
    // What cannot be read is told when the capture session is opened.
    let there = Session::load(&options.folder).map_or(Vec::new(), |session| session.frames);
    let plan = Plan::of(rig, &options.subject, &options.bracket, &there)?;
    Ok(if by_hand { plan.without_other_exposures() } else { (plan, false) })
}

fn in_range(option: Setting, value: f64, [least, most]: [f64; 2]) -> Result<(), ScanError> {
    // Written so that NaN is out of any range.
    if value >= least && value <= most {
        return Ok(());
    }
    Err(ScanError::Option { option, value, least, most })
}

struct Run<'a> {
    rig: &'a Rig,
    plan: Plan,
    options: &'a Options,
    board: &'a Board,
    camera: &'a mut dyn Camera,
    control: &'a Control,
    tell: &'a dyn Fn(&Event),
    sequencer: Sequencer,
    assessor: Assessor,
    judge: Judge,
    store: Store,
    /// The scan's exposure, once known.
    base: Option<Settings>,
    /// As asked for on the command line.
    wanted: Option<Settings>,
    told: Told,
    shot: Option<Shot>,
    /// What went wrong last.
    error: Option<String>,
    warnings: Vec<String>,
    seconds: Seconds,
    resumed: usize,
    start: Instant,
}

impl Run<'_> {
    fn run(&mut self) -> Result<Summary, ScanError> {
        loop {
            self.take_wishes();
            self.take_judgements(Duration::ZERO)?;
            let now = self.start.elapsed();
            let input = match self.sequencer.next(now) {
                Action::Light(step) => self.light(step)?,
                Action::Expose(step) => self.expose(step),
                Action::Keep(step) => self.keep(step),
                Action::FindBoard => self.find_board(),
                Action::Drop(step) => {
                    self.store.drop_frame(step)?;
                    continue;
                }
                Action::AwaitJudgement => {
                    self.take_judgements(LOOK)?;
                    continue;
                }
                Action::Rest => {
                    self.rest();
                    continue;
                }
                Action::End(ending) => return self.end(ending),
            };
            self.sequencer.tell(input, self.start.elapsed());
        }
    }

    fn take_wishes(&mut self) {
        let input = match self.control.wish() {
            Wish::GoOn => Input::Continue,
            Wish::Pause => Input::Pause,
            Wish::Stop => Input::Abort,
        };
        self.sequencer.tell(input, self.start.elapsed());
    }

    fn take_judgements(&mut self, wait: Duration) -> Result<(), ScanError> {
        while let Some((step, seen)) = self.judge.next(wait) {
            let judgements = match seen {
                Seen::Look(look) => self.assessor.add(step, look),
                Seen::Damaged(why) => vec![(step, Judgement::Bad(why))],
                Seen::Size { found, expected } => {
                    let file = self.store.file(step).unwrap_or_default().display().to_string();
                    self.store.drop_frame(step)?;
                    return Err(ScanError::Size { file, found, expected });
                }
            };
            for (step, judgement) in judgements {
                if let Judgement::Dark(why) | Judgement::Bad(why) = &judgement {
                    self.tell_again(step, why.clone());
                }
                self.sequencer.tell(Input::Judged(step, judgement), self.start.elapsed());
            }
            if self.assessor.nothing_is_lit() {
                return Err(self.nothing_lit());
            }
        }
        Ok(())
    }

    /// The dark frames leave the record: what resumes begins with another exposure.
    fn nothing_lit(&mut self) -> ScanError {
        let shown = self.base.unwrap_or(Settings { exposure_s: 0.0, iso: self.options.iso });
        for step in 0..self.plan.steps.len() {
            if let Err(error) = self.store.drop_frame(step) {
                return error;
            }
        }
        ScanError::NothingLit { exposure_s: shown.exposure_s, iso: shown.iso }
    }

    fn tell_again(&self, step: usize, why: String) {
        (self.tell)(&Event::Again { frame: self.plan.steps[step].name(), why });
    }

    /// The light of a step; before the first, the exposure is found.
    fn light(&mut self, step: usize) -> Result<Input, ScanError> {
        if self.base.is_none() && self.camera.describe().release == Release::Itself {
            (self.tell)(&Event::Metering);
            self.base = Some(self.meter()?);
        }
        let begun = Instant::now();
        (self.tell)(&Event::Frame {
            frame: self.plan.steps[step].name(),
            done: self.sequencer.kept(),
            total: self.sequencer.total(),
            left: self.sequencer.time_left(),
        });
        let shown = match self.plan.steps[step].output {
            Some(output) => self.board.light(output, None),
            None => self.board.off(),
        };
        let input = match shown {
            Ok(_) => {
                self.board.take_interruptions();
                Input::Lit
            }
            Err(error) => Input::NotLit(self.board_trouble(step, &error)),
        };
        self.seconds.lights += begun.elapsed().as_secs_f64();
        Ok(input)
    }

    fn meter(&mut self) -> Result<Settings, ScanError> {
        let (subject, about) = (&self.options.subject, &self.options.about);
        let light = subject.metered_light(self.rig, about.thickness_mm);
        let lit = |step: &&Step| step.light == Some(light);
        let output = self.plan.steps.iter().find(lit).and_then(|step| step.output);
        let place = (light, output.unwrap_or_default());
        let settings =
            meter(self.board, self.camera, place, self.options.iso, self.store.incoming())?;
        // A sheet that nobody has measured may face any of the lights.
        let room = if subject.lies_unknown(about.thickness_mm) { UNKNOWN_LIE } else { 1.0 };
        Ok(Settings { exposure_s: settings.exposure_s * room, ..settings })
    }

    fn board_trouble(&mut self, step: usize, error: &BoardError) -> Trouble {
        let why = error.to_string();
        self.error = Some(why.clone());
        let trouble = match error {
            BoardError::GivenUp { why: Failure::PinsDiffer { .. }, .. } => Trouble::Passing(why),
            BoardError::GivenUp { why: Failure::Refused(refusal), .. } => {
                use crate::device::board::wire::Refusal;
                if *refusal == Refusal::Interlock {
                    Trouble::Passing(why)
                } else {
                    Trouble::Lasting
                }
            }
            _ => Trouble::NoBoard(why),
        };
        self.breathe(step, &trouble);
        trouble
    }

    fn breathe(&self, step: usize, trouble: &Trouble) {
        if let Trouble::Passing(why) | Trouble::NoBoard(why) = trouble {
            self.tell_again(step, why.clone());
            std::thread::sleep(BREATH);
        }
    }

    /// What a step is to be exposed with. Before the first file of a camera that is set by hand, nothing is known.
    fn settings(&self, step: usize) -> Settings {
        let base = self.base.unwrap_or(Settings { exposure_s: 0.0, iso: self.options.iso });
        Settings { exposure_s: base.exposure_s * self.plan.steps[step].factor, ..base }
    }

    fn expose(&mut self, step: usize) -> Input {
        self.store.clear_incoming();
        let wanted = self.settings(step);
        let told = (wanted, &mut self.told);
        let (frame, tell) = (self.plan.steps[step].name(), self.tell);
        let (done, total) = (self.sequencer.kept(), self.sequencer.total());
        let waiting = |what: &str| {
            tell(&Event::Waiting { frame: frame.clone(), what: what.to_owned(), done, total });
        };
        match shoot(self.board, self.camera, told, self.store.incoming(), &waiting) {
            Ok(shot) => {
                self.seconds.exposing += shot.exposing.as_secs_f64();
                self.seconds.transfer += shot.transfer.as_secs_f64();
                let (open, close) = (shot.open.map(|o| o.pins), shot.close.map(|o| o.pins));
                self.shot = Some(shot);
                let interruptions = self.board.take_interruptions();
                if let Some(why) = interruptions.first() {
                    self.error = Some(format!(
                        "interrupted again and again ({why:?}); check the light board's cable and power"
                    ));
                }
                Input::Exposed { open, close, interruptions }
            }
            Err(error) => Input::NotExposed(self.camera_trouble(step, &error)),
        }
    }

    fn camera_trouble(&mut self, step: usize, error: &CameraError) -> Trouble {
        let why = error.to_string();
        self.error = Some(why.clone());
        let trouble = match error.cure() {
            Cure::Again => Trouble::Passing(why),
            Cure::Hands => Trouble::Lasting,
        };
        self.breathe(step, &trouble);
        trouble
    }

    fn keep(&mut self, step: usize) -> Input {
        let begun = Instant::now();
        let Some(shot) = self.shot.take() else { return Input::NotKept(Trouble::Lasting) };
        let bytes = match read_input(&shot.path, InputKind::Picture) {
            Ok(bytes) => bytes,
            Err(error) => {
                let error = FileError::read(&shot.path, error).to_string();
                return Input::NotKept(Trouble::Passing(error));
            }
        };
        let settings = match self.exposed(step, &shot, &bytes) {
            Ok(settings) => settings,
            Err(error) => {
                self.error = Some(error.to_string());
                return Input::NotKept(Trouble::Lasting);
            }
        };
        let entry = self.entry(step, &shot, settings);
        let taken = Taken { step, path: &shot.path, bytes: &bytes, entry };
        let input = match self.store.keep(&self.plan, taken) {
            Ok(()) => {
                self.judge.look_at(step, self.store.file(step));
                self.tell_kept(step, settings);
                Input::Kept
            }
            Err(error) => {
                self.error = Some(error.to_string());
                Input::NotKept(Trouble::Lasting)
            }
        };
        self.seconds.disk += begun.elapsed().as_secs_f64();
        input
    }

    fn tell_kept(&self, step: usize, settings: Settings) {
        let Some(file) = self.store.file(step) else { return };
        let planned = &self.plan.steps[step];
        let (light, drift_check) = (planned.light, planned.drift_check);
        (self.tell)(&Event::Kept { light, drift_check, file, settings });
    }

    /// How a frame was exposed, if it is a RAW file: as set, else as its file says. The first file of a camera that is set by hand sets the scan's
    /// exposure.
    fn exposed(&mut self, step: usize, shot: &Shot, bytes: &[u8]) -> Result<Settings, ScanError> {
        if bytes.starts_with(JPEG) {
            return Err(CameraError::NotRaw { found: "JPEG".to_owned() }.into());
        }
        let said = raw::metadata(bytes);
        let wanted = shot.settings.or(self.base).or(self.wanted);
        let found = match (said.exposure_s, said.iso, wanted) {
            (Some(exposure_s), iso, _) => {
                Settings { exposure_s, iso: iso.unwrap_or(self.options.iso) }
            }
            (None, _, Some(wanted)) => wanted,
            (None, _, None) => {
                let file = shown(&shot.path).display().to_string();
                return Err(ScanError::ExposureUnknown { file });
            }
        };
        let wanted = wanted.unwrap_or(found);
        let ratio = found.exposure_s * found.iso / (wanted.exposure_s * wanted.iso);
        if !(1.0 / EXPOSURE_SLACK..=EXPOSURE_SLACK).contains(&ratio) {
            let say = |s: Settings| format!("{} s at ISO {}", s.exposure_s, s.iso);
            return Err(CameraError::Exposure { found: say(found), wanted: say(wanted) }.into());
        }
        let settings = shot.settings.unwrap_or(found);
        if self.plan.steps[step].factor == 1.0 {
            self.base.get_or_insert(settings);
        }
        Ok(settings)
    }

    fn entry(&self, step: usize, shot: &Shot, settings: Settings) -> FrameEntry {
        FrameEntry {
            captured: Some(jiff::Timestamp::now()),
            attempts: Some(self.sequencer.attempts(step) + 1),
            retries: self.sequencer.reasons(step).to_vec(),
            pins_open: shot.open.map(|outputs| outputs.pins),
            pins_close: shot.close.map(|outputs| outputs.pins),
            board_ms: shot.open.map(|outputs| outputs.board_ms.into()),
            ..FrameEntry::new(
                "",
                self.plan.steps[step].recorded_light(),
                settings.exposure_s,
                settings.iso,
            )
        }
    }

    fn find_board(&mut self) -> Input {
        (self.tell)(&Event::BoardLost);
        match self.board.wait_until_connected(BOARD_BACK) {
            Ok(()) => Input::BoardBack,
            Err(error) => {
                self.error = Some(error.to_string());
                Input::BoardLost
            }
        }
    }

    fn rest(&mut self) {
        let _ = self.board.off();
        (self.tell)(&Event::Paused);
        while self.control.wish() == Wish::Pause {
            std::thread::sleep(LOOK);
        }
    }

    fn end(&mut self, ending: Ending) -> Result<Summary, ScanError> {
        let Some(kept) = self.store.safe_frames() else {
            return Err(ScanError::FolderGone { folder: self.options.folder.clone() });
        };
        match ending {
            Ending::Complete => Ok(self.summary()),
            Ending::Aborted => Err(ScanError::Aborted { kept }),
            Ending::Failed(step) => {
                let last = self.sequencer.reasons(step).last().cloned();
                let tried =
                    last.map(|why| format!("{why}; tried {} times", self.sequencer.attempts(step)));
                let why = self.error.take().or(tried).unwrap_or_default();
                Err(ScanError::Frame { frame: self.plan.steps[step].name(), why, kept })
            }
            Ending::Incomplete(steps) => {
                let mut why: Vec<String> = steps
                    .iter()
                    .filter_map(|&step| {
                        let last = self.sequencer.reasons(step).last().cloned();
                        self.assessor.why_left_out(step).or(last)
                    })
                    .collect();
                why.dedup();
                Err(ScanError::Incomplete { why, kept })
            }
        }
    }

    fn summary(&mut self) -> Summary {
        self.seconds.total = self.start.elapsed().as_secs_f64();
        let retries = self.plan.steps.iter().enumerate().flat_map(|(step, planned)| {
            let reasons = self.sequencer.reasons(step).iter();
            reasons.map(move |why| (planned.name(), why.clone())).collect::<Vec<_>>()
        });
        Summary {
            folder: self.options.folder.clone(),
            frames: self.store.session().frames.len(),
            resumed: self.resumed,
            settings: self.base,
            retries: retries.collect(),
            warnings: [std::mem::take(&mut self.warnings), self.assessor.advice()].concat(),
            seconds: self.seconds,
        }
    }
}
