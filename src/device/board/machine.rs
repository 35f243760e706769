//! The protocol as a state machine: bytes and time in, bytes and events out. It does no input or output and has no clock:
//! whoever drives it tells it the time, as the time since any fixed moment.

use super::wire::{Answer, Line, Outputs, Refusal, Request};
use std::collections::VecDeque;
use std::time::Duration;

/// An unanswered request is sent again after this; ten round trips.
pub const RETRY: Duration = Duration::from_millis(50);
/// A damaged answer is reason enough to send again at once, but never sooner than this after the last time.
pub const RETRY_AT_ONCE: Duration = Duration::from_millis(5);
/// How long a request is retried. At 1 % damaged bytes a third of the exchanges fail: a few tries would not be enough.
pub const BUDGET: Duration = Duration::from_secs(3);
/// A board resets when its port is opened, and says nothing for a while.
pub const IDENTIFY_RETRY: Duration = Duration::from_millis(200);
/// How long a board may take to say who it is.
pub const IDENTIFY_BUDGET: Duration = Duration::from_secs(5);
/// The board turns the light off after 500 ms without a word: this leaves room for four lost ones.
pub const KEEP_ALIVE: Duration = Duration::from_millis(100);
/// No line is so long; what comes without a line end is noise.
const PARTIAL_MAX: usize = 256;
/// The board's clock starts again at 2^32 ms: a step from this close to the end to this close to the start is no restart.
const CLOCK_WRAP_MS: u32 = 60_000;

/// The host's end of the protocol. At most one request waits for its answer.
#[derive(Debug)]
pub struct LightBoard {
    seq: u16,
    partial: Vec<u8>,
    output: Vec<u8>,
    events: VecDeque<Event>,
    waiting: Option<Waiting>,
    keep_alive: KeepAlive,
    last_sent: Duration,
    /// What the lights should be, where known.
    lights: Option<u32>,
    board_ms: Option<u32>,
    heard: Option<String>,
}

/// What happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A request was carried out, and the outputs read as they should.
    Done {
        /// What was asked.
        request: Request,
        /// The board's answer.
        answer: Answer,
        /// How often it had to be sent.
        tries: u32,
    },
    /// A request was refused, or else given up: then the board was told to go dark, and keep-alives have stopped, so that
    /// it does in any case.
    Failed {
        /// What was asked.
        request: Request,
        /// Why.
        why: Failure,
    },
    /// Something that makes the frame being taken void.
    Interrupted(Interruption),
}

/// Why a request was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// Not one answer.
    NoAnswer,
    /// Answers, but none undamaged.
    Noise,
    /// The board will not.
    Refused(Refusal),
    /// The outputs do not read as asked.
    PinsDiffer {
        /// As asked.
        asked: u32,
        /// As read.
        read: u32,
    },
}

/// What makes a frame void.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Interruption {
    /// The board has restarted.
    Booted {
        /// As the board says: POWER, RESET, BROWNOUT, WATCHDOG, UNKNOWN; CLOCK where only its clock tells.
        cause: String,
    },
    /// The board has turned the lights off: SILENCE or MAXON.
    WentDark {
        /// As the board says.
        reason: String,
    },
    /// The lights are not what they were asked to be.
    LightsChanged {
        /// As asked.
        expected: u32,
        /// As read.
        read: u32,
    },
    /// Keep-alives get no answer.
    Silent,
    /// The port has gone away, or is closed because nobody answers behind it (told by the link, not by the protocol).
    Unplugged,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum KeepAlive {
    Wanted,
    Stopped,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asker {
    Caller,
    KeepAlive,
}

#[derive(Debug)]
struct Waiting {
    request: Request,
    asker: Asker,
    seq: u16,
    asked: Duration,
    sent: Duration,
    resend: Duration,
    tries: u32,
    why: Failure,
    /// A refusal counts when it came twice: one may be a damaged line that passed for another.
    refused_before: Option<Refusal>,
}

/// A request is already waiting for its answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the light board is still busy with the request before; wait for its answer")]
pub struct Busy;

impl LightBoard {
    /// A board that nothing is known of. Requests are numbered from `first_seq`; another one in each run, so that a board
    /// that has not restarted cannot take a new request for a retry of an old one.
    pub fn new(first_seq: u16) -> Self {
        Self {
            seq: first_seq,
            partial: Vec::new(),
            output: Vec::new(),
            events: VecDeque::new(),
            waiting: None,
            keep_alive: KeepAlive::Stopped,
            last_sent: Duration::ZERO,
            lights: None,
            board_ms: None,
            heard: None,
        }
    }

    /// Asks for something. The answer comes as an event. A keep-alive under way gives way.
    pub fn ask(&mut self, request: Request, now: Duration) -> Result<(), Busy> {
        match &self.waiting {
            Some(waiting) if waiting.asker == Asker::Caller => Err(Busy),
            _ => {
                self.start(request, Asker::Caller, now);
                Ok(())
            }
        }
    }

    /// Takes what arrived, cut into pieces in any way.
    pub fn receive(&mut self, bytes: &[u8], now: Duration) {
        for &byte in bytes {
            match byte {
                b'\n' | b'\r' => {
                    let line = std::mem::take(&mut self.partial);
                    if !line.is_empty() {
                        self.take_line(&line, now);
                    }
                }
                _ if self.partial.len() < PARTIAL_MAX => self.partial.push(byte),
                _ => self.partial.clear(),
            }
        }
    }

    /// Does what is due: retries, keep-alives, giving up.
    pub fn expire(&mut self, now: Duration) {
        match &self.waiting {
            Some(waiting) if now >= waiting.asked + waiting.budget() => self.give_up(now),
            Some(waiting) if now >= waiting.resend => self.send_again(now),
            None if self.keep_alive == KeepAlive::Wanted && now >= self.last_sent + KEEP_ALIVE => {
                self.start(Request::Ping, Asker::KeepAlive, now);
            }
            _ => {}
        }
    }

    /// When [`LightBoard::expire`] has something to do next, if nothing arrives before.
    pub fn wakeup(&self) -> Option<Duration> {
        match &self.waiting {
            Some(waiting) => Some(waiting.resend.min(waiting.asked + waiting.budget())),
            None if self.keep_alive == KeepAlive::Wanted => Some(self.last_sent + KEEP_ALIVE),
            None => None,
        }
    }

    /// The bytes to send now.
    pub fn take_output(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.output)
    }

    /// The next event.
    pub fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// The last line that was not of this protocol: what a board that is not ours says.
    pub fn heard(&self) -> Option<&str> {
        self.heard.as_deref()
    }

    /// Is a request of the caller's under way?
    pub fn is_busy(&self) -> bool {
        self.waiting.as_ref().is_some_and(|waiting| waiting.asker == Asker::Caller)
    }

    fn start(&mut self, request: Request, asker: Asker, now: Duration) {
        self.seq = self.seq.wrapping_add(1);
        self.waiting = Some(Waiting {
            request,
            asker,
            seq: self.seq,
            asked: now,
            sent: now,
            resend: now,
            tries: 0,
            why: Failure::NoAnswer,
            refused_before: None,
        });
        self.send_again(now);
    }

    fn send_again(&mut self, now: Duration) {
        let Some(waiting) = &mut self.waiting else { return };
        if waiting.tries > 0 {
            // Ends what may be left of a line whose end got lost.
            self.output.push(b'\n');
        }
        self.output.extend(waiting.request.line(waiting.seq).bytes());
        waiting.tries += 1;
        waiting.sent = now;
        waiting.resend = now + waiting.retry();
        self.last_sent = now;
    }

    /// Sends again soon; if an answer is on its way after all, the second one does no harm.
    fn hurry(&mut self, now: Duration) {
        if let Some(waiting) = &mut self.waiting {
            waiting.resend = waiting.resend.min(now.max(waiting.sent + RETRY_AT_ONCE));
        }
    }

    fn take_line(&mut self, line: &[u8], now: Duration) {
        match Line::parse(line) {
            None => {
                self.heard = Some(
                    String::from_utf8_lossy(line).chars().filter(|c| !c.is_control()).collect(),
                );
                self.note_damage(now);
            }
            Some(Line::Booted { cause }) => self.note_restart(cause, now),
            Some(Line::WentDark { reason }) => {
                self.lights = Some(0);
                self.events.push_back(Event::Interrupted(Interruption::WentDark { reason }));
            }
            Some(Line::Answer(None, _)) => self.note_damage(now),
            Some(Line::Answer(Some(seq), answer)) => self.take_answer(seq, answer, now),
        }
    }

    fn note_damage(&mut self, now: Duration) {
        if let Some(waiting) = &mut self.waiting
            && waiting.why == Failure::NoAnswer
        {
            waiting.why = Failure::Noise;
        }
        self.hurry(now);
    }

    fn note_restart(&mut self, cause: String, now: Duration) {
        self.lights = Some(0);
        self.board_ms = None;
        self.events.push_back(Event::Interrupted(Interruption::Booted { cause }));
        self.hurry(now);
    }

    fn take_answer(&mut self, seq: u16, answer: Answer, now: Duration) {
        let Some(waiting) = self.waiting.take_if(|waiting| waiting.seq == seq) else {
            return; // late, of a request that is over
        };
        if let Answer::Outputs(outputs) = &answer {
            self.watch_clock(*outputs);
        }
        match (&answer, waiting.request) {
            (Answer::Refused(refusal), _) => self.take_refusal(*refusal, waiting, now),
            (Answer::Identity(_), Request::Identify)
            | (Answer::Value(_), Request::Get(_) | Request::Set(..)) => {
                self.finish(&waiting, answer);
            }
            (Answer::Outputs(outputs), request) if is_about_outputs(request) => {
                self.take_outputs(*outputs, waiting, now);
            }
            _ => self.wait_on(waiting, now),
        }
    }

    fn wait_on(&mut self, waiting: Waiting, now: Duration) {
        self.waiting = Some(waiting);
        self.note_damage(now);
    }

    fn take_refusal(&mut self, refusal: Refusal, mut waiting: Waiting, now: Duration) {
        let damaged = matches!(refusal, Refusal::Syntax | Refusal::Checksum | Refusal::TooLong);
        let again = waiting.refused_before.replace(refusal) == Some(refusal);
        waiting.why = Failure::Refused(refusal);
        self.waiting = Some(waiting);
        if again && !damaged { self.believe_refusal(refusal) } else { self.hurry(now) }
    }

    /// The board does not do it, and is otherwise well: its lights stay as they are.
    fn believe_refusal(&mut self, refusal: Refusal) {
        if let Some(Waiting { request, .. }) = self.waiting.take() {
            self.events.push_back(Event::Failed { request, why: Failure::Refused(refusal) });
        }
    }

    fn take_outputs(&mut self, outputs: Outputs, mut waiting: Waiting, now: Duration) {
        let read = outputs.lights();
        match (waiting.request.lights_after(), self.lights) {
            (Some(asked), _) if asked != read => {
                waiting.why = Failure::PinsDiffer { asked, read };
                self.waiting = Some(waiting);
                self.hurry(now);
                return;
            }
            (None, Some(expected)) if expected != read => {
                let changed = Interruption::LightsChanged { expected, read };
                self.events.push_back(Event::Interrupted(changed));
            }
            _ => {}
        }
        self.lights = Some(read);
        self.keep_alive = KeepAlive::Wanted;
        self.finish(&waiting, Answer::Outputs(outputs));
    }

    fn finish(&mut self, waiting: &Waiting, answer: Answer) {
        if waiting.asker == Asker::Caller {
            let Waiting { request, tries, .. } = *waiting;
            self.events.push_back(Event::Done { request, answer, tries });
        }
    }

    /// A restart whose message was lost shows in the board's clock.
    fn watch_clock(&mut self, outputs: Outputs) {
        let wrapped =
            |before: u32| before > u32::MAX - CLOCK_WRAP_MS && outputs.board_ms < CLOCK_WRAP_MS;
        let restarted =
            self.board_ms.is_some_and(|before| outputs.board_ms < before && !wrapped(before));
        self.board_ms = Some(outputs.board_ms);
        if restarted {
            self.lights = Some(0);
            let cause = "CLOCK".to_owned();
            self.events.push_back(Event::Interrupted(Interruption::Booted { cause }));
        }
    }

    fn give_up(&mut self, now: Duration) {
        let Some(waiting) = self.waiting.take() else { return };
        self.lights = None;
        self.keep_alive = KeepAlive::Stopped;
        self.seq = self.seq.wrapping_add(1);
        self.output.push(b'\n');
        self.output.extend(Request::Off.line(self.seq).bytes());
        self.last_sent = now;
        self.events.push_back(match waiting.asker {
            Asker::Caller => Event::Failed { request: waiting.request, why: waiting.why },
            Asker::KeepAlive => Event::Interrupted(Interruption::Silent),
        });
    }
}

fn is_about_outputs(request: Request) -> bool {
    !matches!(request, Request::Identify | Request::Get(_) | Request::Set(..))
}

impl Waiting {
    fn retry(&self) -> Duration {
        if self.request == Request::Identify { IDENTIFY_RETRY } else { RETRY }
    }

    fn budget(&self) -> Duration {
        if self.request == Request::Identify { IDENTIFY_BUDGET } else { BUDGET }
    }
}
