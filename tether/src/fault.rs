//! From libgphoto2's errors, and what it logged before them, to faults with a name.

use crate::recent::Log;
use gphoto2::error::ErrorKind;
use std::collections::VecDeque;
use std::time::Duration;
use weavelight::device::camera::tethered::protocol::Fault;

/// What was going on: the same error means different things.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Doing {
    /// Taking hold of the camera.
    Opening,
    /// Anything later.
    Using,
}

/// What cameras answer with (ISO 15740, and Nikon's own from 0xA000).
mod code {
    pub(super) const NO_DEVICE: u16 = 0x02F9; // this and the next two: libgphoto2's own, where there is no answer
    pub(super) const TIMEOUT: u16 = 0x02FA;
    pub(super) const IO: u16 = 0x02FF;
    pub(super) const STORE_FULL: u16 = 0x200C;
    pub(super) const STORE_READ_ONLY: u16 = 0x200E;
    pub(super) const STORE_NOT_AVAILABLE: u16 = 0x2013;
    pub(super) const OUT_OF_FOCUS: u16 = 0xA002;
}

/// Over a network the library waits for so long, and then reports whatever error it finds; over USB it waits longer and says so.
const SILENT: Duration = Duration::from_secs(2);

/// The fault behind an error; `log`: what was logged since the request began.
pub(crate) fn of(error: &gphoto2::Error, log: &Log, doing: Doing) -> Fault {
    fault_of(&error.kind(), &error.to_string(), log, doing)
}

fn fault_of(kind: &ErrorKind, text: &str, log: &Log, doing: Doing) -> Fault {
    let recent = &log.lines;
    let logged = |words: &str| recent.iter().any(|line| line.contains(words));
    let opening = doing == Doing::Opening;
    if let Some(named) = recent.iter().rev().find_map(|line| named(code_in(line)?)) {
        return named;
    }
    if logged("insufficient permissions") || logged("Access denied (") {
        return Fault::Permission;
    }
    // 5 is the refusal of the hand-shake.
    if logged("LIBUSB_ERROR_BUSY") || (opening && logged("bad type returned 5")) {
        return Fault::Claimed;
    }
    if logged("read PTPIP data") {
        return Fault::LinkCut;
    }
    if let (Some(fault), false) = (of_link(log), opening) {
        return fault;
    }
    match kind {
        ErrorKind::IoUsbClaim | ErrorKind::IoLock => Fault::Claimed,
        ErrorKind::IoUsbFind | ErrorKind::ModelNotFound | ErrorKind::UnknownPort => Fault::NoCamera,
        ErrorKind::CameraBusy => Fault::Busy,
        ErrorKind::Timeout => Fault::Asleep,
        ErrorKind::Io if log.silence >= SILENT => Fault::Asleep,
        ErrorKind::Io | ErrorKind::IoRead | ErrorKind::IoWrite if opening => Fault::NoCamera,
        ErrorKind::Io | ErrorKind::IoRead | ErrorKind::IoWrite | ErrorKind::IoUpdate => {
            Fault::LinkCut
        }
        _ => Fault::Other { reason: reason(text, recent) },
    }
}

/// The fault that an answer stands for by itself.
fn named(code: u16) -> Option<Fault> {
    match code {
        code::OUT_OF_FOCUS => Some(Fault::OutOfFocus),
        code::STORE_FULL | code::STORE_READ_ONLY | code::STORE_NOT_AVAILABLE => {
            Some(Fault::CardFull)
        }
        _ => None,
    }
}

/// The link's failure, if there was one: the library passes over it where it looks for a setting, and says that there is no such
/// setting.
pub(crate) fn of_link(log: &Log) -> Option<Fault> {
    log.lines.iter().rev().find_map(|line| match code_in(line) {
        Some(code::TIMEOUT) => Some(Fault::Asleep),
        Some(code::IO) if log.silence >= SILENT => Some(Fault::Asleep),
        Some(code::IO | code::NO_DEVICE) => Some(Fault::LinkCut),
        _ => line.contains("End of stream").then_some(Fault::LinkCut),
    })
}

/// The camera's answer that a line of the log tells of: over USB and in errors `... failed: ... (0x2002)`, over a network
/// `PTPIP_CMD_RESPONSE (result=0x2002, ...)`.
fn code_in(line: &str) -> Option<u16> {
    let digits = match line.split_once("(result=0x") {
        Some((_, rest)) => rest,
        None if line.contains("failed") => line.rsplit_once("(0x")?.1,
        None => return None,
    };
    let end = digits.find(|digit: char| !digit.is_ascii_hexdigit()).unwrap_or(digits.len());
    u16::from_str_radix(&digits[..end], 16).ok()
}

/// In the camera's words where it said some: `PTP General Error (0x2002)`.
fn reason(text: &str, recent: &VecDeque<String>) -> String {
    let line = recent.iter().rev().find(|line| code_in(line).is_some());
    let words = |line: &String| match line.rsplit_once("failed: ") {
        Some((_, words)) => words.trim().replace('\'', ""),
        None => format!("{text}, code {:04X}", code_in(line).unwrap_or_default()),
    };
    line.map_or_else(|| text.to_owned(), words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_log_names_the_fault() {
        let check = |kind: ErrorKind, doing: Doing, lines: &[&str], expected: Fault| {
            let lines: VecDeque<String> = lines.iter().map(|line| (*line).to_owned()).collect();
            let log = Log { lines, ..Log::new() };
            assert_eq!(fault_of(&kind, "Unspecified error", &log, doing), expected, "{log:?}");
        };
        let using = |kind, lines, expected| check(kind, Doing::Using, lines, expected);
        using(
            ErrorKind::Other,
            &["PTP_OC 0x9207 receiving resp failed: Out of Focus (0xa002)"],
            Fault::OutOfFocus,
        );
        using(
            ErrorKind::Other,
            &["PTPIP_CMD_RESPONSE (result=0x200c, tid=0x0000001f)"],
            Fault::CardFull,
        );
        using(
            ErrorKind::Other,
            &["PTPIP_CMD_RESPONSE (result=0x200a, tid=0x1)", "'ret' failed: 'Store full' (0x200c)"],
            Fault::CardFull,
        );
        using(
            ErrorKind::Other,
            &["End of stream after reading 0 bytes of ptpipheader"],
            Fault::LinkCut,
        );
        using(
            ErrorKind::BadParameters,
            &["'ptp_generic_getdevicepropdesc' failed: PTP Timeout (0x02fa)"],
            Fault::Asleep,
        );
        using(ErrorKind::IoRead, &[], Fault::LinkCut);
        using(
            ErrorKind::Other,
            &["'ptp_getobject (params)' failed: 'PTP General Error' (0x2002)", "failed: -1"],
            Fault::Other { reason: "PTP General Error (0x2002)".into() },
        );
        using(
            ErrorKind::Other,
            &["PTPIP_CMD_RESPONSE (result=0xa004, tid=0x1)"],
            Fault::Other { reason: "Unspecified error, code A004".into() },
        );
        using(ErrorKind::Other, &[], Fault::Other { reason: "Unspecified error".into() });
        let opening = |kind, lines, expected| check(kind, Doing::Opening, lines, expected);
        opening(ErrorKind::Io, &[], Fault::NoCamera);
        opening(ErrorKind::IoUsbClaim, &[], Fault::Claimed);
        opening(ErrorKind::Other, &["bad type returned 5"], Fault::Claimed);
        opening(
            ErrorKind::Io,
            &["libusb_open (d, &pl->dh) failed: Access denied (insufficient permissions) (-3)"],
            Fault::Permission,
        );
        opening(ErrorKind::Timeout, &[], Fault::Asleep);
    }

    #[test]
    fn a_camera_that_says_nothing_is_asleep_whatever_the_error() {
        let check = |silence_s: u64, expected: Fault| {
            let log = Log { silence: Duration::from_secs(silence_s), ..Log::new() };
            assert_eq!(fault_of(&ErrorKind::Io, "", &log, Doing::Using), expected);
        };
        check(0, Fault::LinkCut);
        check(2, Fault::Asleep);
    }

    #[test]
    fn codes_are_read_where_they_are_and_nowhere_else() {
        let check =
            |line: &str, expected: Option<u16>| assert_eq!(code_in(line), expected, "{line}");
        check("PTPIP_CMD_RESPONSE (result=0xa002, tid=0x1)", Some(0xA002));
        check("'x' failed: 'PTP Access Denied' (0x200f)", Some(0x200F));
        check("failed to scan (0x", None);
        check("Sending PTP_OC 0x9207 (InitiateCapture) (0xffffffff,0x1) request...", None);
        check("", None);
    }
}
