//! Exchanges between host and board as text: the notation of `firmware/PROTOCOL.md`, and its replay on the host's end.

use std::collections::VecDeque;
use std::time::Duration;
use weavelight::device::board::wire::{
    Answer, LIGHTS_MAX, REFUSALS, Refusal, Request, Setting, crc8,
};
use weavelight::device::board::{Event, Failure, Interruption, LightBoard};

/// One line of an exchange.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Step {
    /// The program asks its end of the protocol.
    Ask(Request),
    /// The host sends, the board receives.
    ToBoard(String),
    /// The board sends, the host receives.
    FromBoard(String),
    /// The program learns.
    Told(String),
    /// Time passes; keep-alives go on.
    Wait(Duration),
    /// Time passes without a word from the host.
    Silence(Duration),
    /// The board's reset button.
    Reset,
    /// What the board's outputs are.
    Pins(u32),
}

/// Reads an exchange: steps on lines of their own, or separated by `|`.
pub(crate) fn parse(text: &str) -> Vec<Step> {
    let lines = text.split(['\n', '|']).map(str::trim).filter(|line| !line.is_empty());
    lines.map(|line| parse_step(line).unwrap_or_else(|| panic!("not a step: {line}"))).collect()
}

fn parse_step(line: &str) -> Option<Step> {
    if line == "reset" {
        return Some(Step::Reset);
    }
    let (kind, rest) = line.split_once(' ')?;
    Some(match kind {
        "ask" => Step::Ask(parse_request(rest)?),
        ">" => Step::ToBoard(sealed(rest)),
        "<" => Step::FromBoard(rest.to_owned()),
        "=" => Step::Told(rest.to_owned()),
        "wait" => Step::Wait(milliseconds(rest)?),
        "silence" => Step::Silence(milliseconds(rest)?),
        "pins" => Step::Pins(u32::from_str_radix(rest, 16).ok()?),
        _ => return None,
    })
}

fn milliseconds(text: &str) -> Option<Duration> {
    Some(Duration::from_millis(text.strip_suffix(" ms")?.parse().ok()?))
}

fn parse_request(text: &str) -> Option<Request> {
    let words: Vec<&str> = text.split(' ').collect();
    let level = |text: &str| Some(Some(text.parse().ok()?));
    Some(match words[..] {
        ["identify"] => Request::Identify,
        ["off"] => Request::Off,
        ["ping"] => Request::Ping,
        ["light", light] => Request::Light { light: light.parse().ok()?, level: None },
        ["light", light, "at", l] => {
            Request::Light { light: light.parse().ok()?, level: level(l)? }
        }
        ["back", "light"] => Request::BackLight { level: None },
        ["trigger", duration] => Request::Trigger { duration_ms: duration.parse().ok()? },
        ["get", name] => Request::Get(setting(name)?),
        ["set", name, value] => Request::Set(setting(name)?, value.parse().ok()?),
        _ => return None,
    })
}

fn setting(name: &str) -> Option<Setting> {
    [Setting::SettleMs, Setting::MaxOnMs, Setting::RestMs]
        .into_iter()
        .find(|setting| setting.name() == name)
}

/// Puts the right checksum in the place of `*HH`.
pub(crate) fn sealed(line: &str) -> String {
    match line.strip_suffix("*HH") {
        Some(text) => format!("{text}*{:02X}", crc8(text.as_bytes())),
        None => line.to_owned(),
    }
}

/// `pattern` with the clock of `line` in the place of `<ms>`, and the right checksum in that of `*HH`.
pub(crate) fn filled_in(pattern: &str, line: &str) -> String {
    let Some((before, after)) = pattern.split_once("<ms>") else { return sealed(pattern) };
    let clock: String =
        line.chars().skip(before.len()).take(10).filter(char::is_ascii_digit).collect();
    sealed(&format!("{before}{clock:0>10}{after}"))
}

/// With ten digits in the clock's place, where the line may have fewer, or `<ms>` for `now`.
pub(crate) fn with_clock(line: &str, now: Duration) -> String {
    let line = line.replace("<ms>", &now.as_millis().to_string());
    let Some((text, checksum)) = line.split_once('*') else { return line };
    match text.split(' ').collect::<Vec<_>>()[..] {
        [seq, "OK", pins, ms] => format!("{seq} OK {pins} {ms:0>10}*{checksum}"),
        _ => line,
    }
}

/// What an event tells the program, in words.
pub(crate) fn told(event: &Event) -> String {
    match event {
        Event::Done { request, answer, tries } => {
            let times = if *tries == 1 { String::new() } else { format!(" in {tries} tries") };
            told_done(*request, answer) + &times
        }
        Event::Failed { why, .. } => match why {
            Failure::NoAnswer => "gave up: no answer".to_owned(),
            Failure::Noise => "gave up: noise".to_owned(),
            Failure::Refused(refusal) => format!("refused: {}", refusal_name(*refusal)),
            Failure::PinsDiffer { asked, read } => {
                format!("gave up: asked {asked:05X}, reads {read:05X}")
            }
        },
        Event::Interrupted(interruption) => match interruption {
            Interruption::Booted { cause } => format!("restarted: {cause}"),
            Interruption::WentDark { reason } => format!("went dark: {reason}"),
            Interruption::LightsChanged { expected, read } => {
                format!("changed: {expected:05X} to {read:05X}")
            }
            Interruption::Silent => "silent".to_owned(),
            Interruption::Unplugged => "unplugged".to_owned(),
        },
    }
}

fn refusal_name(refusal: Refusal) -> &'static str {
    REFUSALS.iter().find(|(known, _)| *known == refusal).unwrap().1
}

fn told_done(request: Request, answer: &Answer) -> String {
    match (request, answer) {
        (Request::Identify, Answer::Identity(board)) => {
            let lights = board.lights.map_or("?".to_owned(), |lights| lights.to_string());
            format!("board {}, protocol {}, {lights} lights", board.firmware, board.protocol)
        }
        (_, Answer::Value(value)) => format!("value {value}"),
        (Request::Light { light, .. }, _) => format!("lit {light}"),
        (Request::BackLight { .. }, _) => "back light".to_owned(),
        (Request::Off, _) => "dark".to_owned(),
        (Request::Trigger { .. }, _) => "triggered".to_owned(),
        (Request::Ping, Answer::Outputs(outputs)) => format!("outputs {:05X}", outputs.pins),
        other => panic!("an answer that does not fit: {other:?}"),
    }
}

/// The host's end with a clock of its own.
pub(crate) struct Host {
    board: LightBoard,
    now: Duration,
    sent: VecDeque<String>,
    last_sent: Option<String>,
}

impl Host {
    pub(crate) fn new() -> Self {
        Self {
            board: LightBoard::new(0),
            now: Duration::ZERO,
            sent: VecDeque::new(),
            last_sent: None,
        }
    }

    fn collect(&mut self) {
        let output = String::from_utf8(self.board.take_output()).unwrap();
        self.sent.extend(output.lines().filter(|line| !line.is_empty()).map(str::to_owned));
    }

    /// Lets time pass, with everything that is due on the way.
    fn wait(&mut self, end: Duration) {
        while let Some(due) = self.board.wakeup().filter(|due| *due <= end) {
            self.now = self.now.max(due);
            self.board.expire(self.now);
            self.collect();
        }
        self.now = end;
    }

    /// The next line that the host sends by itself; `None` where it has nothing to ask for.
    fn next_line(&mut self) -> Option<String> {
        if self.sent.is_empty() && self.board.is_busy() {
            self.wait(self.board.wakeup().unwrap());
        }
        self.last_sent = self.sent.pop_front().or(self.last_sent.take());
        self.last_sent.clone()
    }

    /// Replays one step; the event's words where the step is one. Panics where host and exchange disagree.
    pub(crate) fn replay(&mut self, step: &Step) {
        match step {
            Step::Ask(request) => {
                self.board.ask(*request, self.now).unwrap();
                self.collect();
            }
            // The line after the last is a retry that the exchange shows for the board's sake.
            Step::ToBoard(line) => assert_eq!(self.next_line().as_ref(), Some(line)),
            Step::FromBoard(line) => {
                self.now += Duration::from_millis(4);
                let line = sealed(&with_clock(line, self.now));
                self.board.receive(format!("{line}\n").as_bytes(), self.now);
                self.collect();
            }
            Step::Told(words) => assert_eq!(self.next_words().as_ref(), Some(words)),
            Step::Wait(duration) => {
                self.wait(self.now + *duration);
                self.sent.retain(|line| !line.contains("PING"));
            }
            Step::Silence(_) | Step::Reset | Step::Pins(_) => {}
        }
    }

    pub(crate) fn next_words(&mut self) -> Option<String> {
        self.board.next_event().as_ref().map(told)
    }
}

/// The exchanges of PROTOCOL.md, each with its number for messages.
pub(crate) fn of_protocol() -> Vec<(usize, Vec<Step>)> {
    let text = include_str!("../../firmware/PROTOCOL.md");
    let blocks = text.split("```exchange\n").skip(1).map(|rest| rest.split("```").next().unwrap());
    let exchanges: Vec<_> = blocks.map(parse).enumerate().collect();
    assert!(exchanges.len() > usize::from(LIGHTS_MAX) / 2, "PROTOCOL.md has lost its exchanges");
    exchanges
}
