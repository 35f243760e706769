//! The board's end of the protocol as a state machine, for rigs without hardware: bytes and time in, bytes out. It keeps to
//! `firmware/PROTOCOL.md` as the firmware does; the same exchanges are replayed on both.

use super::wire::{
    BACK_LIGHT_BIT, BOARD_NAME, LIGHTS_MAX, LINE_MAX, PROTOCOL, REFUSALS, Refusal, Setting,
    TRIGGER_BIT, crc8, seal,
};
use std::time::Duration;

/// Everything goes dark when the host has said nothing valid for so long.
const HOST_SILENCE: Duration = Duration::from_millis(500);
const TRIGGER_MOST_MS: u16 = 5000;
/// Name, least, most and standard value, as `firmware/weavelight/settings.cpp` has them.
const SETTINGS: [(Setting, u16, u16, u16); 3] = [
    (Setting::SettleMs, 0, 30, 2),
    (Setting::MaxOnMs, 100, 65_000, 60_000),
    (Setting::RestMs, 0, 65_000, 2000),
];

/// A board in software. Its lights settle at once.
#[derive(Clone, Debug)]
pub struct BoardModel {
    lights: u8,
    settings: [u16; 3],
    started: Duration,
    now: Duration,
    /// Which bit is on, and since when.
    on: Option<(u32, Duration)>,
    rest_until: Duration,
    trigger_until: Option<Duration>,
    spoken_to: Duration,
    only_checksummed: bool,
    last_seq: Option<u16>,
    partial: Vec<u8>,
    output: String,
}

struct Words<'a> {
    seq: u16,
    verb: &'a str,
    arguments: Vec<&'a str>,
}

impl BoardModel {
    /// A board with so many lights (16 at most), switched on just now.
    pub fn new(lights: u8, now: Duration) -> Self {
        Self {
            lights: lights.min(LIGHTS_MAX),
            settings: SETTINGS.map(|setting| setting.3),
            started: now,
            now,
            on: None,
            rest_until: now,
            trigger_until: None,
            spoken_to: now,
            only_checksummed: false,
            last_seq: None,
            partial: Vec::new(),
            output: format!("\n{}", seal("! BOOT POWER")),
        }
    }

    /// The reset button: everything off, and only the settings are kept.
    pub fn reset(&mut self, now: Duration) {
        let settings = self.settings;
        *self = Self {
            settings,
            output: format!("\n{}", seal("! BOOT RESET")),
            ..Self::new(self.lights, now)
        };
    }

    /// Lets time pass.
    pub fn advance(&mut self, now: Duration) {
        self.now = now;
        self.trigger_until = self.trigger_until.filter(|until| now < *until);
        let longest = Duration::from_millis(self.settings[1].into());
        if self.on.is_some_and(|(_, since)| now >= since + longest) {
            self.go_dark("MAXON");
            self.rest_until = now + Duration::from_millis(self.settings[2].into());
        } else if (self.on.is_some() || self.trigger_until.is_some())
            && now >= self.spoken_to + HOST_SILENCE
        {
            self.go_dark("SILENCE");
        }
    }

    /// Takes what the host sends, cut into pieces in any way.
    pub fn receive(&mut self, bytes: &[u8], now: Duration) {
        self.advance(now);
        for &byte in bytes {
            match byte {
                b'\n' | b'\r' => {
                    let line = std::mem::take(&mut self.partial);
                    if !line.is_empty() {
                        self.answer(&line);
                    }
                }
                // One byte more than fits is enough to know.
                _ if self.partial.len() <= LINE_MAX => self.partial.push(byte),
                _ => {}
            }
        }
    }

    /// What the board sends.
    pub fn take_output(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.output).into_bytes()
    }

    /// Bit n is output n.
    pub fn pins(&self) -> u32 {
        let trigger = if self.trigger_until.is_some() { 1 << TRIGGER_BIT } else { 0 };
        self.on.map_or(0, |(bit, _)| 1 << bit) | trigger
    }

    fn go_dark(&mut self, reason: &str) {
        self.on = None;
        self.trigger_until = None;
        self.output += &seal(&format!("! SAFE {reason}"));
    }

    fn answer(&mut self, line: &[u8]) {
        let answer = match self.read(line) {
            Ok(words) => {
                self.spoken_to = self.now;
                let result = self.run(&words);
                if result.is_ok() {
                    self.last_seq = Some(words.seq);
                }
                format!("{} {}", words.seq, result.unwrap_or_else(error))
            }
            Err((seq, refusal)) => {
                format!("{} {}", seq.map_or("?".to_owned(), |seq| seq.to_string()), error(refusal))
            }
        };
        self.output += &seal(&answer);
    }

    /// The words of an undamaged line; else what is wrong, with the number where it can be trusted.
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Words<'a>, (Option<u16>, Refusal)> {
        if line.len() > LINE_MAX {
            return Err((None, Refusal::TooLong));
        }
        let line = std::str::from_utf8(line).map_err(|_| (None, Refusal::Checksum))?;
        let (text, checksum) =
            line.split_once('*').map_or((line, None), |(text, sum)| (text, Some(sum)));
        if checksum.is_some_and(|checksum| checksum != format!("{:02X}", crc8(text.as_bytes()))) {
            return Err((None, Refusal::Checksum));
        }
        let mut words = text.split(' ');
        let seq = words
            .next()
            .and_then(|word| number(word, word.len()))
            .ok_or((None, Refusal::Syntax))?;
        let trusted = checksum.map(|_| seq);
        let rest: Vec<&str> = words.collect();
        match rest[..] {
            [verb, ref arguments @ ..]
                if arguments.len() <= 2 && rest.iter().all(|word| !word.is_empty()) =>
            {
                self.only_checksummed |= checksum.is_some();
                if self.only_checksummed && checksum.is_none() {
                    return Err((None, Refusal::Checksum));
                }
                Ok(Words { seq, verb, arguments: arguments.to_vec() })
            }
            _ => Err((trusted, Refusal::Syntax)),
        }
    }

    fn run(&mut self, words: &Words<'_>) -> Result<String, Refusal> {
        match (words.verb, &words.arguments[..]) {
            ("ID?", []) => Ok(format!("OK {BOARD_NAME} 1.0.0 {PROTOCOL} {} LBT", self.lights)),
            ("LIGHT", [light, rest @ ..]) => {
                let light = number(light, 2).ok_or(Refusal::Syntax)?;
                if light >= u16::from(self.lights) {
                    return Err(Refusal::Range);
                }
                self.show(light.into(), rest)
            }
            ("BACK", rest) if rest.len() <= 1 => self.show(BACK_LIGHT_BIT, rest),
            ("OFF", []) => {
                self.on = None;
                self.trigger_until = None;
                Ok(self.outputs())
            }
            ("PING", []) => Ok(self.outputs()),
            ("TRIG", [duration]) => {
                self.trigger(number(duration, 5).ok_or(Refusal::Syntax)?, words.seq)
            }
            ("GET", [name]) => Ok(format!("OK {}", self.settings[setting_named(name)?])),
            ("SET", [name, value]) => self.set(name, number(value, 5).ok_or(Refusal::Syntax)?),
            ("ID?" | "LIGHT" | "BACK" | "OFF" | "PING" | "TRIG" | "GET" | "SET", _) => {
                Err(Refusal::Syntax)
            }
            _ => Err(Refusal::Verb),
        }
    }

    fn outputs(&self) -> String {
        let ms = (self.now - self.started).as_millis() % (1 << 32);
        format!("OK {:05X} {ms:010}", self.pins())
    }

    fn show(&mut self, bit: u32, level: &[&str]) -> Result<String, Refusal> {
        if let [level] = level
            && !(1..=255).contains(&number(level, 3).ok_or(Refusal::Syntax)?)
        {
            return Err(Refusal::Range);
        }
        if self.now < self.rest_until {
            return Err(Refusal::Interlock);
        }
        if self.on.is_none_or(|(before, _)| before != bit) {
            self.on = Some((bit, self.now));
        }
        Ok(self.outputs())
    }

    fn trigger(&mut self, duration_ms: u16, seq: u16) -> Result<String, Refusal> {
        if !(1..=TRIGGER_MOST_MS).contains(&duration_ms) {
            return Err(Refusal::Range);
        }
        // A pulse cannot be taken back, so a retry must not start another.
        if self.last_seq != Some(seq) {
            if self.trigger_until.is_some() {
                return Err(Refusal::Interlock);
            }
            self.trigger_until = Some(self.now + Duration::from_millis(duration_ms.into()));
        }
        Ok(self.outputs())
    }

    fn set(&mut self, name: &str, value: u16) -> Result<String, Refusal> {
        let index = setting_named(name)?;
        let (_, least, most, _) = SETTINGS[index];
        if !(least..=most).contains(&value) {
            return Err(Refusal::Range);
        }
        self.settings[index] = value;
        Ok(format!("OK {value}"))
    }
}

fn setting_named(name: &str) -> Result<usize, Refusal> {
    SETTINGS.iter().position(|setting| setting.0.name() == name).ok_or(Refusal::Range)
}

/// Exactly `width` digits.
fn number(text: &str, width: usize) -> Option<u16> {
    let digits = text.len() == width && text.bytes().all(|byte| byte.is_ascii_digit());
    text.parse().ok().filter(|_| digits)
}

fn error(refusal: Refusal) -> String {
    let name = REFUSALS.iter().find(|known| known.0 == refusal).map_or("", |known| known.1);
    format!("ERR {} {name}", refusal as u8)
}
