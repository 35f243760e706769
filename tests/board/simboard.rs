//! The simulated board: the real firmware in libsimavr, in a process of its own.

#[allow(dead_code, unreachable_pub, clippy::print_stdout, reason = "test programs share it")]
#[path = "../support/skip.rs"]
pub(crate) mod skip;

use crate::exchange::filled_in;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Debian's image of the Uno's bootloader.
pub(crate) const BOOTLOADER: &str =
    "/usr/share/arduino/hardware/arduino/avr/bootloaders/optiboot/optiboot_atmega328.hex";

fn firmware_folder() -> PathBuf {
    // Also from a package in a folder of the workspace.
    let folders = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let mut firmware = folders.map(|folder| folder.join("firmware"));
    firmware.find(|firmware| firmware.is_dir()).unwrap()
}

/// Builds firmware and simulated board.
fn build() -> Result<(), String> {
    static BUILT: OnceLock<Result<(), String>> = OnceLock::new();
    BUILT.get_or_init(|| {
        let needed = ["/usr/bin/avr-gcc", "/usr/include/simavr/sim_avr.h", "/usr/include/libelf.h", BOOTLOADER];
        if let Some(missing) = needed.iter().find(|path| !Path::new(path).exists()) {
            return Err(format!("{missing} is missing; `make test` installs it (gcc-avr, avr-libc, arduino-core-avr, libsimavr-dev, libelf-dev)"));
        }
        // Several test processes may come here at once.
        let make = Command::new("flock").arg(firmware_folder()).args(["make", "-s", "-C"]).arg(firmware_folder()).output();
        let make = make.unwrap();
        assert!(make.status.success(), "make -C firmware: {}", String::from_utf8_lossy(&make.stderr));
        Ok(())
    }).clone()
}

/// The process and its control socket. It ends with this value, whatever happens: its standard input closes.
pub(crate) struct SimBoard {
    child: Child,
    control: BufReader<UnixStream>,
    folder: tempfile::TempDir,
}

impl SimBoard {
    fn start(options: &[&str]) -> Option<Self> {
        skip::need("board", build())?;
        let folder = tempfile::tempdir().unwrap();
        let socket = folder.path().join("control");
        let build = firmware_folder().join("build");
        let child = Command::new(build.join("simboard"))
            .arg("--firmware")
            .arg(build.join("weavelight.elf"))
            .arg("--control")
            .arg(&socket)
            .args(options)
            .current_dir(folder.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let control = BufReader::new(connect(&socket));
        Some(Self { child, control, folder })
    }

    /// With its serial port as a pseudo-terminal.
    pub(crate) fn on_a_port(options: &[&str]) -> Option<Self> {
        Self::start(&[&["--link", "port"], options].concat())
    }

    /// The serial port.
    pub(crate) fn port(&self) -> PathBuf {
        self.folder.path().join("port")
    }

    /// Its control socket: several may use it at once.
    #[allow(dead_code, reason = "the scan's tests use it")]
    pub(crate) fn socket(&self) -> PathBuf {
        self.folder.path().join("control")
    }

    /// Sends one command and returns the first line of the reply.
    pub(crate) fn command(&mut self, command: &str) -> String {
        writeln!(self.control.get_mut(), "{command}").unwrap();
        self.line()
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.control.read_line(&mut line).unwrap();
        assert!(!line.starts_with("error") && !line.is_empty(), "simulated board: {line:?}");
        line.trim_end().to_owned()
    }

    /// Board's time in microseconds, and its outputs.
    pub(crate) fn pins(&mut self) -> (u64, u32) {
        parse_edge(&self.command("pins"))
    }

    /// Waits until the outputs are `pins`.
    pub(crate) fn wait_for_pins(&mut self, pins: u32) {
        let start = Instant::now();
        while self.pins().1 != pins {
            assert!(start.elapsed() < Duration::from_secs(30), "the outputs never were {pins:05X}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Every change of the outputs since the last call.
    pub(crate) fn edges(&mut self) -> Vec<(u64, u32)> {
        let count: usize = self.command("edges").parse().unwrap();
        (0..count).map(|_| parse_edge(&self.line())).collect()
    }
}

fn connect(socket: &Path) -> UnixStream {
    let start = Instant::now();
    loop {
        match UnixStream::connect(socket) {
            Ok(stream) => return stream,
            Err(error) => {
                assert!(start.elapsed() < Duration::from_secs(20), "simulated board: {error}");
            }
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn parse_edge(text: &str) -> (u64, u32) {
    let mut words = text.split(' ');
    let us = words.next().unwrap().parse().unwrap();
    (us, u32::from_str_radix(words.next().unwrap(), 16).unwrap())
}

impl Drop for SimBoard {
    fn drop(&mut self) {
        let _ended = self.child.kill().and_then(|()| self.child.wait());
    }
}

/// A board whose time passes only when the test says so: the same in every run, however busy the machine.
pub(crate) struct Stepped {
    board: SimBoard,
    now_us: u64,
    pins: u32,
    arrived: Vec<u8>,
}

impl Stepped {
    pub(crate) fn start() -> Option<Self> {
        Self::start_with(&[])
    }

    /// With Debian's optiboot in front of the firmware.
    pub(crate) fn start_with_bootloader() -> Option<Self> {
        Self::start_with(&["--bootloader", BOOTLOADER])
    }

    fn start_with(options: &[&str]) -> Option<Self> {
        let board = SimBoard::start(&[&["--stepped"], options].concat())?;
        Some(Self { board, now_us: 0, pins: 0, arrived: Vec::new() })
    }

    pub(crate) fn command(&mut self, command: &str) {
        self.board.command(command);
    }

    pub(crate) fn send(&mut self, bytes: &[u8]) {
        let hex: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
        if !hex.is_empty() {
            self.command(&format!("send {hex}"));
        }
    }

    fn pass(&mut self, command: &str, us: u64) {
        let reply = self.board.command(&format!("{command} {us}"));
        (self.now_us, self.pins) = parse_edge(&reply);
        let hex = reply.rsplit(' ').next().unwrap();
        let digits =
            (0..hex.len() / 2).map(|i| u8::from_str_radix(&hex[2 * i..2 * i + 2], 16).unwrap());
        self.arrived.extend(digits);
    }

    /// Lets time pass.
    pub(crate) fn run(&mut self, us: u64) {
        self.pass("run", us);
    }

    /// Lets time pass, at most to the end of a line, and returns all bytes that arrived.
    pub(crate) fn run_to_line(&mut self, us: u64) -> Vec<u8> {
        self.pass("line", us);
        std::mem::take(&mut self.arrived)
    }

    /// The next line, its end removed; `None` if none comes within `us`.
    pub(crate) fn next_line(&mut self, us: u64) -> Option<String> {
        loop {
            if !self.arrived.contains(&b'\n') {
                self.pass("line", us);
            }
            let end = self.arrived.iter().position(|byte| *byte == b'\n')?;
            let line = String::from_utf8(self.arrived.drain(..=end).collect()).unwrap();
            if line != "\n" {
                return Some(line.trim_end().to_owned());
            }
        }
    }

    /// The next line must be `pattern`, in which `<ms>` is any number and `*HH` the right checksum.
    pub(crate) fn expect_line(&mut self, pattern: &str) {
        let line =
            self.next_line(700_000).unwrap_or_else(|| panic!("no answer, but expected {pattern}"));
        assert_eq!(line, filled_in(pattern, &line));
    }

    pub(crate) fn pins(&self) -> u32 {
        self.pins
    }

    pub(crate) fn now_us(&self) -> u64 {
        self.now_us
    }

    pub(crate) fn edges(&mut self) -> Vec<(u64, u32)> {
        self.board.edges()
    }
}
