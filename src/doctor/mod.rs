//! What of the machine and the instrument is there and usable, without touching any of it.

use crate::device::board::{BoardError, Identity, PortChoice, PortFinding, diagnose};
use crate::files::read_input_text;
use crate::gpu::{Adapter, Gpu};
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct Examination {
    /// Program and version.
    pub program: &'static str,
    /// Whether chessboard detection is built in.
    pub opencv: bool,
    /// The graphics processor that `solve --device` could use.
    pub graphics: Graphics,
    /// Cores that this process may use.
    pub cores: usize,
    /// Memory that can be had without swapping; `None` where the system does not say.
    pub available_memory_mb: Option<u64>,
    /// The folder asked about.
    #[serde(serialize_with = "crate::files::serialize_path")]
    pub folder: PathBuf,
    /// Why it cannot be written; `None` where it can.
    pub write_error: Option<String>,
    /// Free space in it for this user; `None` where the system does not say.
    pub free_space_mb: Option<u64>,
    /// Serial ports that may belong to a light controller.
    pub serial_ports: Vec<SerialPort>,
}

/// A graphics processor, or why there is none.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Graphics {
    /// What was found.
    pub adapter: Option<Adapter>,
    /// What is wrong and what to do; `None` where all is well.
    pub problem: Option<String>,
}

/// A serial port.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SerialPort {
    /// As in `/dev/ttyACM0`.
    #[serde(serialize_with = "crate::files::serialize_path")]
    pub path: PathBuf,
    /// Whether this user may open it.
    pub usable: bool,
}

/// A light board, or why a port has none.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LightBoard {
    /// Where.
    #[serde(serialize_with = "crate::files::serialize_path")]
    pub port: PathBuf,
    /// Version of its firmware, if one answers.
    pub firmware: Option<String>,
    /// How many lights it has.
    pub lights: Option<u8>,
    /// It has an output for a back light.
    pub back_light: bool,
    /// It has a trigger output for a camera.
    pub trigger: bool,
    /// What is wrong and what to do; `None` where all is well.
    pub problem: Option<String>,
}

/// Asks for light boards at the named port, or at every port that could be one's; `lights`: how many the rig has. Opening a port restarts the
/// board behind it; one in use by a scan is told as busy and left alone. Takes up to five seconds where nobody answers.
pub fn examine_boards(choice: &PortChoice, lights: Option<usize>) -> Vec<LightBoard> {
    diagnose(choice, lights).into_iter().map(light_board).collect()
}

fn light_board(finding: PortFinding) -> LightBoard {
    let PortFinding { port, result } = finding;
    let problem = result.as_ref().err().map(BoardError::to_string);
    let board = result.ok();
    LightBoard {
        port,
        lights: board.as_ref().and_then(|board| board.lights),
        back_light: board.as_ref().is_some_and(|board| board.back_light),
        trigger: board.as_ref().is_some_and(|board| board.trigger),
        firmware: board.map(|Identity { firmware, .. }| firmware),
        problem,
    }
}

/// Looks around. Ports are not opened: see [`examine_boards`].
pub fn examine(folder: &Path) -> Examination {
    Examination {
        program: crate::files::PROGRAM,
        opencv: cfg!(feature = "opencv"),
        graphics: graphics(),
        cores: std::thread::available_parallelism().map_or(1, usize::from),
        available_memory_mb: read_input_text(Path::new("/proc/meminfo"))
            .ok()
            .as_deref()
            .and_then(available_memory_mb),
        folder: folder.to_owned(),
        write_error: tempfile::tempfile_in(folder).err().map(|error| error.to_string()),
        free_space_mb: crate::files::free_bytes(folder).map(|bytes| bytes >> 20),
        serial_ports: serial_ports(Path::new("/dev")),
    }
}

/// Opens it as a solve would.
fn graphics() -> Graphics {
    let opened = Gpu::open();
    Graphics {
        problem: opened.as_ref().err().map(ToString::to_string),
        adapter: opened.ok().map(|gpu| gpu.adapter().clone()),
    }
}

/// From the text of `/proc/meminfo`.
fn available_memory_mb(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib / 1024)
}

/// USB serial ports, as Linux and macOS name them, in order.
fn serial_ports(devices: &Path) -> Vec<SerialPort> {
    let Ok(entries) = fs::read_dir(devices) else { return Vec::new() };
    let is_port =
        |name: &str| ["ttyACM", "ttyUSB", "cu.usb"].iter().any(|start| name.starts_with(start));
    let mut ports: Vec<SerialPort> = entries
        .filter_map(Result::ok)
        .filter(|entry| is_port(&entry.file_name().to_string_lossy()))
        .map(|entry| SerialPort { usable: may_open(&entry.path()), path: entry.path() })
        .collect();
    ports.sort_by(|a, b| a.path.cmp(&b.path));
    ports
}

#[cfg(unix)]
fn may_open(path: &Path) -> bool {
    use rustix::fs::Access;
    rustix::fs::access(path, Access::READ_OK | Access::WRITE_OK).is_ok()
}

#[cfg(not(unix))]
fn may_open(_path: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_read_from_the_kernels_text() {
        let check = |text: &str, expected: Option<u64>| {
            assert_eq!(available_memory_mb(text), expected, "{text:?}");
        };
        check("MemTotal: 16000000 kB\nMemAvailable:    2048000 kB\n", Some(2000));
        check("MemTotal: 16000000 kB\n", None);
        check("MemAvailable: lots\n", None);
    }

    #[test]
    fn ports_are_listed_in_order_and_nothing_else() {
        let devices = tempfile::tempdir().unwrap();
        for name in ["ttyUSB1", "ttyACM0", "tty0", "null"] {
            fs::write(devices.path().join(name), "").unwrap();
        }
        let found = serial_ports(devices.path());
        let names: Vec<_> =
            found.iter().map(|port| port.path.file_name().unwrap().to_owned()).collect();
        assert_eq!(names, ["ttyACM0", "ttyUSB1"]);
        assert!(found.iter().all(|port| port.usable));
    }

    #[test]
    fn a_folder_that_is_not_there_is_told() {
        let found = examine(Path::new("/no/such/folder"));
        assert!(found.write_error.is_some());
        assert_eq!(found.free_space_mb, None);
        assert!(examine(&std::env::temp_dir()).write_error.is_none());
    }
}
