//! The order of a scan as a state machine: what happened and the time in, what to do next out. It does no input or output
//! and has no clock.
//!
//! A frame counts only if its light was acknowledged before the shutter opened, the outputs read the same and right at shutter
//! open and close, and nothing interrupted the board in between. Everything else is taken again, with the reason noted.

use super::plan::{Plan, Step};
use crate::device::board::Interruption;
use crate::device::board::wire::TRIGGER_BIT;
use std::time::Duration;

/// How often a frame is tried.
pub const MOST_ATTEMPTS: u32 = 5;
/// How often the light of a frame that came out dark is tried: a dead LED does not wake up.
pub const MOST_DARK: u32 = 2;

/// What to do next. Steps are indices into the plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// Switch the step's light on and every other off; tell [`Input::Lit`] or [`Input::NotLit`].
    Light(usize),
    /// Take the picture; tell [`Input::Exposed`] or [`Input::NotExposed`].
    Expose(usize),
    /// Make the picture safe on disk and record it; tell [`Input::Kept`] or [`Input::NotKept`].
    Keep(usize),
    /// Take the frame back out of the record, for good: its light stays dark. Nothing to tell.
    Drop(usize),
    /// Wait until the board is there again; tell [`Input::BoardBack`] or [`Input::BoardLost`].
    FindBoard,
    /// Wait for the next [`Input::Judged`].
    AwaitJudgement,
    /// Everything off, and wait for [`Input::Continue`].
    Rest,
    /// Everything off; it is over.
    End(Ending),
}

/// How a scan ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ending {
    /// Every frame is there.
    Complete,
    /// These steps stay without a frame; the others are there.
    Incomplete(Vec<usize>),
    /// A step cannot go on; what the last try said is with whoever told it.
    Failed(usize),
    /// As asked.
    Aborted,
}

/// What happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Input {
    /// The board acknowledged the light.
    Lit,
    /// It did not.
    NotLit(Trouble),
    /// The shutter opened and closed, and a file is there.
    Exposed {
        /// Outputs at shutter open; `None`: could not be read.
        open: Option<u32>,
        /// At shutter close.
        close: Option<u32>,
        /// What happened to the board since the light was acknowledged.
        interruptions: Vec<Interruption>,
    },
    /// There is no picture.
    NotExposed(Trouble),
    /// The frame is safe.
    Kept,
    /// It cannot be stored.
    NotKept(Trouble),
    /// A frame that was kept has been looked at.
    Judged(usize, Judgement),
    /// The board is there.
    BoardBack,
    /// It does not come back.
    BoardLost,
    /// Stop after this frame.
    Pause,
    /// Go on.
    Continue,
    /// Stop now, keeping what is finished.
    Abort,
}

/// Why something was not done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// Trying again may help; a sentence.
    Passing(String),
    /// The board is gone; a sentence.
    NoBoard(String),
    /// Somebody has to do something first.
    Lasting,
}

/// What a kept frame is worth.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Judgement {
    /// It is as planned.
    Good,
    /// Its light is missing in it; a sentence.
    Dark(String),
    /// It is damaged, or not as asked; a sentence.
    Bad(String),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Progress {
    Waiting,
    Kept,
    GivenUp,
}

/// What became of one step so far.
#[derive(Clone, Debug)]
struct Track {
    step: Step,
    progress: Progress,
    attempts: u32,
    dark: u32,
    judged: bool,
    reasons: Vec<String>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum State {
    /// Between frames.
    Ready,
    Lighting(usize),
    Exposing(usize),
    Keeping(usize),
    Searching(usize),
    Over(Ending),
}

/// A scan in progress.
#[derive(Clone, Debug)]
pub struct Sequencer {
    tracks: Vec<Track>,
    state: State,
    paused: bool,
    drops: Vec<usize>,
    /// When the frame under way began.
    begun: Duration,
    /// Time spent on frames that were kept, and their number.
    spent: Duration,
    taken: u32,
}

impl Sequencer {
    /// A scan of which the steps in `finished` are there already.
    pub fn new(plan: &Plan, finished: &[usize]) -> Self {
        let track = |(k, step): (usize, &Step)| Track {
            step: step.clone(),
            progress: if finished.contains(&k) { Progress::Kept } else { Progress::Waiting },
            attempts: 0,
            dark: 0,
            judged: false,
            reasons: Vec::new(),
        };
        Self {
            tracks: plan.steps.iter().enumerate().map(track).collect(),
            state: State::Ready,
            paused: false,
            drops: Vec::new(),
            begun: Duration::ZERO,
            spent: Duration::ZERO,
            taken: 0,
        }
    }

    /// What to do now. Asking again changes nothing, but for the frames in [`Action::Drop`], which are named once.
    pub fn next(&mut self, now: Duration) -> Action {
        if let Some(step) = self.drops.pop() {
            return Action::Drop(step);
        }
        if self.state == State::Ready && !self.paused {
            self.begin(now);
        }
        match &self.state {
            State::Ready if self.paused => Action::Rest,
            State::Ready => Action::AwaitJudgement,
            State::Lighting(step) => Action::Light(*step),
            State::Exposing(step) => Action::Expose(*step),
            State::Keeping(step) => Action::Keep(*step),
            State::Searching(_) => Action::FindBoard,
            State::Over(ending) => Action::End(ending.clone()),
        }
    }

    /// Starts the next frame, or ends where there is none and nothing is left to be judged.
    fn begin(&mut self, now: Duration) {
        let waiting = self.tracks.iter().position(|track| track.progress == Progress::Waiting);
        let unjudged =
            self.tracks.iter().any(|track| track.progress == Progress::Kept && !track.judged);
        match waiting {
            Some(step) => {
                self.begun = now;
                self.state = State::Lighting(step);
            }
            None if unjudged => {}
            None => self.state = State::Over(self.ending()),
        }
    }

    fn ending(&self) -> Ending {
        let missing: Vec<usize> = (0..self.tracks.len())
            .filter(|&step| self.tracks[step].progress == Progress::GivenUp)
            .collect();
        if missing.is_empty() { Ending::Complete } else { Ending::Incomplete(missing) }
    }

    /// Says what happened. What does not fit the state (an answer that is late) is let go.
    pub fn tell(&mut self, input: Input, now: Duration) {
        match (input, self.state.clone()) {
            (Input::Judged(step, judgement), _) => self.take_judgement(step, judgement),
            (Input::Pause, _) => self.paused = true,
            (Input::Continue, _) => self.paused = false,
            (_, State::Over(_)) => {}
            (Input::Abort, _) => self.state = State::Over(Ending::Aborted),
            (Input::Lit, State::Lighting(step)) => self.state = State::Exposing(step),
            (Input::Exposed { open, close, interruptions }, State::Exposing(step)) => {
                match self.why_void(step, open, close, &interruptions) {
                    None => self.state = State::Keeping(step),
                    Some(reason) => self.again(step, reason),
                }
            }
            (Input::Kept, State::Keeping(step)) => self.note_kept(step, now),
            (Input::NotLit(trouble), State::Lighting(step))
            | (Input::NotExposed(trouble), State::Exposing(step))
            | (Input::NotKept(trouble), State::Keeping(step)) => self.take_trouble(step, trouble),
            (Input::BoardBack, State::Searching(_)) => self.state = State::Ready,
            (Input::BoardLost, State::Searching(step)) => {
                self.state = State::Over(Ending::Failed(step));
            }
            _ => {}
        }
    }

    fn why_void(
        &self,
        step: usize,
        open: Option<u32>,
        close: Option<u32>,
        interruptions: &[Interruption],
    ) -> Option<String> {
        let expected = self.tracks[step].step.pins();
        let wrong = |pins: Option<u32>| pins.map(|p| p & !(1 << TRIGGER_BIT)) != Some(expected);
        if let Some(interruption) = interruptions.first() {
            return Some(describe(interruption));
        }
        let when = match (wrong(open), wrong(close)) {
            (true, _) => ("open", open),
            (_, true) => ("close", close),
            _ => return None,
        };
        let read = when.1.map_or("nothing".to_owned(), |pins| format!("{pins:05X}"));
        Some(format!("at shutter {} the outputs read {read} instead of {expected:05X}", when.0))
    }

    fn note_kept(&mut self, step: usize, now: Duration) {
        let track = &mut self.tracks[step];
        track.progress = Progress::Kept;
        track.judged = false;
        track.attempts += 1;
        self.spent += now.saturating_sub(self.begun);
        self.taken += 1;
        self.state = State::Ready;
    }

    fn take_trouble(&mut self, step: usize, trouble: Trouble) {
        match trouble {
            Trouble::Passing(reason) => self.again(step, reason),
            Trouble::NoBoard(reason) => {
                self.again(step, reason);
                if self.state == State::Ready {
                    self.state = State::Searching(step);
                }
            }
            Trouble::Lasting => self.state = State::Over(Ending::Failed(step)),
        }
    }

    fn again(&mut self, step: usize, reason: String) {
        let track = &mut self.tracks[step];
        track.attempts += 1;
        track.reasons.push(reason);
        let more = track.attempts < MOST_ATTEMPTS;
        self.state = if more { State::Ready } else { State::Over(Ending::Failed(step)) };
    }

    fn take_judgement(&mut self, step: usize, judgement: Judgement) {
        let Some(track) = self.tracks.get_mut(step) else { return };
        if track.progress != Progress::Kept {
            return; // it is being taken again already
        }
        let (reason, most) = match judgement {
            Judgement::Good => {
                track.judged = true;
                return;
            }
            Judgement::Dark(reason) => {
                track.dark += 1;
                (reason, track.dark < MOST_DARK)
            }
            Judgement::Bad(reason) => (reason, true),
        };
        track.reasons.push(reason);
        if most && track.attempts < MOST_ATTEMPTS {
            track.progress = Progress::Waiting;
        } else {
            track.progress = Progress::GivenUp;
            self.drops.push(step);
        }
    }

    /// How often a step was tried, the try under way not counted.
    pub fn attempts(&self, step: usize) -> u32 {
        self.tracks[step].attempts
    }

    /// Why a step was tried again, each time.
    pub fn reasons(&self, step: usize) -> &[String] {
        &self.tracks[step].reasons
    }

    /// How many frames are there.
    pub fn kept(&self) -> usize {
        self.tracks.iter().filter(|track| track.progress == Progress::Kept).count()
    }

    /// How many frames there will be.
    pub fn total(&self) -> usize {
        self.tracks.len()
    }

    /// Time left, from the frames so far; `None` before the first.
    pub fn time_left(&self) -> Option<Duration> {
        let left = self.tracks.iter().filter(|track| track.progress == Progress::Waiting).count();
        let each = self.spent.checked_div(self.taken)?;
        Some(each * u32::try_from(left).unwrap_or(u32::MAX))
    }
}

fn describe(interruption: &Interruption) -> String {
    match interruption {
        Interruption::Booted { cause } => format!("the light board restarted ({cause})"),
        Interruption::WentDark { reason } => format!("the light board went dark ({reason})"),
        Interruption::LightsChanged { expected, read } => {
            format!("the outputs changed from {expected:05X} to {read:05X}")
        }
        Interruption::Silent => "the light board did not answer".to_owned(),
        Interruption::Unplugged => "the light board was unplugged".to_owned(),
    }
}

#[cfg(test)]
mod tests;
