//! The lines between host and board, as `firmware/PROTOCOL.md` describes them: requests to bytes, lines to answers.

/// The protocol that this program speaks.
pub const PROTOCOL: u32 = 1;
/// What a board of ours calls itself.
pub const BOARD_NAME: &str = "WEAVELIGHT";
/// The longest line in either direction, checksum included, line end not.
pub const LINE_MAX: usize = 48;
/// Bit of the back light in [`Outputs::pins`]; lights have the bits below, by their output number.
pub const BACK_LIGHT_BIT: u32 = 16;
/// Bit of the trigger output in [`Outputs::pins`].
pub const TRIGGER_BIT: u32 = 17;
/// How many lights a board can have.
pub const LIGHTS_MAX: u8 = 16;

/// What the host asks of the board. Each sets a whole state, so that repeating it does no harm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Who are you?
    Identify,
    /// This light and no other.
    Light {
        /// Output of the board, from 0.
        light: u8,
        /// 1 to 255; `None` is full, without pulses.
        level: Option<u8>,
    },
    /// The back light and no other.
    BackLight {
        /// 1 to 255; `None` is full, without pulses.
        level: Option<u8>,
    },
    /// Everything off.
    Off,
    /// Nothing, but the host is alive.
    Ping,
    /// Close the camera's remote contact for so long.
    Trigger {
        /// 1 to 5000 milliseconds.
        duration_ms: u16,
    },
    /// A setting's value.
    Get(Setting),
    /// Change a setting.
    Set(Setting, u16),
}

/// What can be set on a board; it keeps it without power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting {
    /// From a light's switching on to its acknowledgement, milliseconds.
    SettleMs,
    /// The longest that one light may stay on, milliseconds.
    MaxOnMs,
    /// How long lights stay off after one reached its longest time, milliseconds.
    RestMs,
}

/// Why a board does not do what a line asks; the numbers are the protocol's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The line is not of the protocol's form.
    Syntax = 1,
    /// The checksum is wrong, or missing where it is needed.
    Checksum = 2,
    /// The board does not know this request.
    Verb = 3,
    /// A number beyond what this board has or allows.
    Range = 4,
    /// The line is too long.
    TooLong = 5,
    /// Not now: lights rest after one was on for too long, or the trigger is still closed.
    Interlock = 6,
}

/// The protocol's names for [`Refusal`], by number.
pub const REFUSALS: [(Refusal, &str); 6] = [
    (Refusal::Syntax, "SYNTAX"),
    (Refusal::Checksum, "CHECKSUM"),
    (Refusal::Verb, "VERB"),
    (Refusal::Range, "RANGE"),
    (Refusal::TooLong, "TOOLONG"),
    (Refusal::Interlock, "INTERLOCK"),
];

/// What a board says of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Version of its firmware, as in "1.0.0".
    pub firmware: String,
    /// Version of its protocol.
    pub protocol: u32,
    /// How many lights it has; `None` where another protocol says it in another way.
    pub lights: Option<u8>,
    /// It dims lights.
    pub levels: bool,
    /// It has an output for a back light.
    pub back_light: bool,
    /// It has a trigger output.
    pub trigger: bool,
}

/// The outputs as the board read them back, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outputs {
    /// Bit n is output n: lights from 0, then [`BACK_LIGHT_BIT`] and [`TRIGGER_BIT`].
    pub pins: u32,
    /// The board's clock: milliseconds since its start, modulo 2^32.
    pub board_ms: u32,
}

/// What a board answers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Done; the outputs are now so.
    Outputs(Outputs),
    /// A setting's value.
    Value(u16),
    /// Who it is.
    Identity(Identity),
    /// Not done.
    Refused(Refusal),
}

/// One undamaged line from the board.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Line {
    /// An answer, with the request's number unless the board could not read it.
    Answer(Option<u16>, Answer),
    /// The board has started.
    Booted {
        /// POWER, RESET, BROWNOUT, WATCHDOG or UNKNOWN.
        cause: String,
    },
    /// The board has turned the lights off by itself.
    WentDark {
        /// SILENCE or MAXON.
        reason: String,
    },
}

/// CRC-8 with polynomial x^8 + x^2 + x + 1 (0x07), start 0, not reflected ("CRC-8/SMBUS"): finds every error of up to three
/// bits in 14 bytes (Koopman and Chakravarty, "Cyclic redundancy code polynomial selection for embedded networks", 2004).
pub fn crc8(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |crc, byte| {
        (0..8).fold(crc ^ byte, |crc: u8, _| (crc << 1) ^ if crc & 0x80 != 0 { 0x07 } else { 0 })
    })
}

/// `text` with its checksum and line end.
pub fn seal(text: &str) -> String {
    format!("{text}*{:02X}\n", crc8(text.as_bytes()))
}

impl Setting {
    /// The protocol's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::SettleMs => "SETTLE",
            Self::MaxOnMs => "MAXON",
            Self::RestMs => "REST",
        }
    }
}

impl Request {
    /// The line that asks for this, line end included.
    pub fn line(&self, seq: u16) -> String {
        let level = |level: Option<u8>| level.map(|l| format!(" {l:03}")).unwrap_or_default();
        let words = match *self {
            Self::Identify => "ID?".to_owned(),
            Self::Light { light, level: l } => format!("LIGHT {light:02}{}", level(l)),
            Self::BackLight { level: l } => format!("BACK{}", level(l)),
            Self::Off => "OFF".to_owned(),
            Self::Ping => "PING".to_owned(),
            Self::Trigger { duration_ms } => format!("TRIG {duration_ms:05}"),
            Self::Get(setting) => format!("GET {}", setting.name()),
            Self::Set(setting, value) => format!("SET {} {value:05}", setting.name()),
        };
        seal(&format!("{seq} {words}"))
    }

    /// The lights and the back light after this, where it decides that.
    pub fn lights_after(&self) -> Option<u32> {
        match *self {
            Self::Light { light, .. } => 1u32.checked_shl(light.into()),
            Self::BackLight { .. } => Some(1 << BACK_LIGHT_BIT),
            Self::Off => Some(0),
            _ => None,
        }
    }
}

impl Outputs {
    /// The lights and the back light alone.
    pub fn lights(self) -> u32 {
        self.pins & !(1 << TRIGGER_BIT)
    }
}

impl Line {
    /// Reads one line, its end removed. `None`: damaged, or not of this protocol.
    pub fn parse(line: &[u8]) -> Option<Self> {
        let line = std::str::from_utf8(line).ok()?;
        let (text, checksum) = line.rsplit_once('*')?;
        if line.len() > LINE_MAX || checksum != format!("{:02X}", crc8(text.as_bytes())) {
            return None;
        }
        let words: Vec<&str> = text.split(' ').collect();
        match words[..] {
            ["!", "BOOT", cause] => Some(Self::Booted { cause: cause.to_owned() }),
            ["!", "SAFE", reason] => Some(Self::WentDark { reason: reason.to_owned() }),
            ["?", ref rest @ ..] => Some(Self::Answer(None, parse_answer(rest)?)),
            [seq, ref rest @ ..] => {
                Some(Self::Answer(Some(seq.parse().ok()?), parse_answer(rest)?))
            }
            [] => None,
        }
    }
}

fn parse_answer(words: &[&str]) -> Option<Answer> {
    match *words {
        ["ERR", number, name] => {
            let number: u8 = number.parse().ok()?;
            let known = REFUSALS
                .iter()
                .find(|(refusal, known)| *refusal as u8 == number && *known == name)?;
            Some(Answer::Refused(known.0))
        }
        ["OK", value] => Some(Answer::Value(value.parse().ok()?)),
        // A lost digit must not make another number: see PROTOCOL.md.
        ["OK", pins, board_ms] if pins.len() == 5 && board_ms.len() == 10 => {
            let pins = u32::from_str_radix(pins, 16).ok()?;
            Some(Answer::Outputs(Outputs { pins, board_ms: board_ms.parse().ok()? }))
        }
        ["OK", BOARD_NAME, firmware, protocol, ref rest @ ..] => {
            Some(Answer::Identity(parse_identity(firmware, protocol.parse().ok()?, rest)))
        }
        _ => None,
    }
}

/// Name, firmware and protocol keep their places in every version; what follows is this protocol's.
fn parse_identity(firmware: &str, protocol: u32, rest: &[&str]) -> Identity {
    let features = rest.get(1).copied().unwrap_or_default();
    Identity {
        firmware: firmware.to_owned(),
        protocol,
        lights: rest.first().and_then(|lights| lights.parse().ok()),
        levels: features.contains('L'),
        back_light: features.contains('B'),
        trigger: features.contains('T'),
    }
}
