use super::machine::Failure;
use super::wire::{PROTOCOL, Refusal, Request};
use std::path::PathBuf;

/// What goes wrong with the light board. Each message says what, where, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BoardError {
    /// No port that could be a board's.
    #[error(
        "no light board found: there is no USB serial port; connect the board, or name its port in rig.toml: [controller] port = \"...\""
    )]
    NoPort,
    /// Ports, but no board of ours behind any.
    #[error("no light board found. {}", .tried.join("; "))]
    NoneAnswers {
        /// What each port had to say: whole sentences.
        tried: Vec<String>,
    },
    /// The system gives no thread to talk to the board.
    #[error(
        "no thread can be started for the light board ({reason}); close other programs or raise the limit (ulimit -u)"
    )]
    NoThread {
        /// As the system says.
        reason: String,
    },
    /// The port is not there.
    #[error("{}: there is no such port; connect the light board, or correct [controller] port in rig.toml", .port.display())]
    PortMissing {
        /// The port.
        port: PathBuf,
    },
    /// Another program has the port.
    #[error("{}: another program is using this port; close it (the Arduino IDE's serial monitor, another scan), then try again", .port.display())]
    PortBusy {
        /// The port.
        port: PathBuf,
    },
    /// This user may not open the port.
    #[error("{}: permission denied; add yourself to the group that owns it (on Debian: sudo usermod -aG dialout $USER), then log in again", .port.display())]
    Permission {
        /// The port.
        port: PathBuf,
    },
    /// The port cannot be used.
    #[error("{}: cannot be used as a serial port ({reason}); check [controller] port in rig.toml", .port.display())]
    PortUnusable {
        /// The port.
        port: PathBuf,
        /// As the system says.
        reason: String,
    },
    /// Nothing answers behind the port.
    #[error("{}: nothing answers; is this the light board, and is its firmware loaded (firmware/README.md)?", .port.display())]
    Silent {
        /// The port.
        port: PathBuf,
    },
    /// Something else answers.
    #[error("{}: this is not a Weavelight light board (it says {said:?}); choose another port, or load the firmware (firmware/README.md)", .port.display())]
    Foreign {
        /// The port.
        port: PathBuf,
        /// The last line it sent.
        said: String,
    },
    /// The board speaks another version of the protocol.
    #[error(
        "{}: the board's firmware {firmware} speaks protocol {found}, this program {PROTOCOL}; {}",
        .port.display(),
        if *.found < PROTOCOL { "load the firmware that came with this program (firmware/README.md)" } else { "update this program" }
    )]
    Protocol {
        /// The port.
        port: PathBuf,
        /// Version of the board's firmware.
        firmware: String,
        /// Version of its protocol.
        found: u32,
    },
    /// The board has another number of lights than the rig.
    #[error("{}: the board has {board} lights, rig.toml has {rig}; correct rig.toml, or LIGHT_COUNT in firmware/weavelight/config.h and load it again", .port.display())]
    LightCount {
        /// The port.
        port: PathBuf,
        /// As the board says.
        board: usize,
        /// As the rig says.
        rig: usize,
    },
    /// The board is not connected at the moment.
    #[error("the light board at {} is not connected; plug it in again (the scan goes on from there)", .port.display())]
    Unplugged {
        /// Where it was.
        port: PathBuf,
    },
    /// A request was given up.
    #[error("{}", describe_failure(*.request, *.why))]
    GivenUp {
        /// What was asked.
        request: Request,
        /// Why.
        why: Failure,
    },
}

fn describe_failure(request: Request, why: Failure) -> String {
    let what = describe_request(request);
    match why {
        Failure::NoAnswer => format!(
            "{what}: the light board does not answer; it goes dark by itself. Check its USB cable and power"
        ),
        Failure::Noise => format!(
            "{what}: the light board's answers arrive damaged; use a shorter or better USB cable, away from motors and mains leads"
        ),
        Failure::PinsDiffer { asked, read } => format!(
            "{what}: the outputs read {read:05X} instead of {asked:05X}; look for a short circuit or a broken output at the board"
        ),
        Failure::Refused(Refusal::Interlock) => format!(
            "{what}: refused; a light was on for longer than allowed (or the trigger is still closed). Wait a few seconds, then try again"
        ),
        Failure::Refused(Refusal::Range) => {
            format!(
                "{what}: refused; the board does not have that output or value. Compare rig.toml with the wiring"
            )
        }
        Failure::Refused(_) => format!(
            "{what}: refused; the board's firmware was built without it. See firmware/weavelight/config.h"
        ),
    }
}

fn describe_request(request: Request) -> String {
    match request {
        Request::Identify => "identifying the light board".to_owned(),
        Request::Light { light, .. } => format!("output {light} of the light board"),
        Request::BackLight { .. } => "the back light".to_owned(),
        Request::Off => "switching the lights off".to_owned(),
        Request::Ping => "reading the light board's outputs".to_owned(),
        Request::Trigger { .. } => "the camera's trigger".to_owned(),
        Request::Get(setting) | Request::Set(setting, _) => {
            format!("the light board's setting {}", setting.name())
        }
    }
}
