use super::PROGRAM;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::Path;

/// Who holds a [`super::Lock`], as its file records it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Holder {
    /// Executable and version, as in "weavelight-app 0.1.0".
    pub program: String,
    /// What for, as in "scan".
    #[serde(default)]
    pub purpose: String,
    /// Process number on its host.
    pub pid: u32,
    /// The computer's name; empty where the system does not say.
    #[serde(default)]
    pub host: String,
    /// When it was taken, RFC 3339, UTC.
    #[serde(default)]
    pub since: String,
}

impl Holder {
    pub(super) fn this_process(purpose: &str) -> Self {
        Self {
            program: program(),
            purpose: purpose.to_owned(),
            pid: std::process::id(),
            host: host(),
            since: jiff::Timestamp::now().strftime("%Y-%m-%dT%H:%M:%SZ").to_string(),
        }
    }

    /// `None` where the file is not there or half written.
    pub(super) fn read(lock_file: &Path) -> Option<Self> {
        Self::parse(&std::fs::read_to_string(lock_file).ok()?)
    }

    pub(super) fn parse(text: &str) -> Option<Self> {
        toml::from_str(text).ok()
    }

    /// A process that has not recorded itself yet.
    pub(super) fn unknown() -> Self {
        let (program, purpose) = ("another program".to_owned(), String::new());
        Self { program, purpose, pid: 0, host: String::new(), since: String::new() }
    }

    /// Whether it is this process.
    pub fn is_this_process(&self) -> bool {
        self.pid == std::process::id() && self.host == host()
    }

    /// Whether the process may be running, as far as it can be seen from here. For file systems without locks only.
    pub(super) fn may_live(&self) -> bool {
        // A number of our own is left over from before: containers give the same numbers again and again.
        self.host != host() || (self.pid != std::process::id() && is_alive(self.pid))
    }
}

/// As in `weavelight 0.1.0 (scan, process 4242 on bench, since 2026-11-30 10:00:00 UTC)`.
impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.pid == 0 {
            return f.write_str(&self.program);
        }
        if self.is_this_process() {
            write!(f, "{} (this program: ", self.program)?;
        } else {
            write!(f, "{} (", self.program)?;
        }
        if !self.purpose.is_empty() {
            write!(f, "{}, ", self.purpose)?;
        }
        write!(f, "process {}", self.pid)?;
        if !self.host.is_empty() {
            write!(f, " on {}", self.host)?;
        }
        if !self.since.is_empty() {
            write!(f, ", since {}", self.since.replace('T', " ").replace('Z', " UTC"))?;
        }
        f.write_str(")")
    }
}

/// The executable that is running: the command line and the window are one library.
fn program() -> String {
    let executable = std::env::current_exe().ok();
    let name = executable.as_deref().and_then(Path::file_stem).map(|name| name.to_string_lossy());
    name.map_or_else(|| PROGRAM.to_owned(), |name| format!("{name} {}", env!("CARGO_PKG_VERSION")))
}

#[cfg(unix)]
pub(super) fn host() -> String {
    rustix::system::uname().nodename().to_string_lossy().into_owned()
}

#[cfg(not(unix))]
pub(super) fn host() -> String {
    std::env::var("COMPUTERNAME").unwrap_or_default()
}

#[cfg(unix)]
fn is_alive(pid: u32) -> bool {
    let pid = i32::try_from(pid).ok().and_then(rustix::process::Pid::from_raw);
    // Another user's process may not be signalled, but is there.
    pid.is_some_and(|pid| rustix::process::test_kill_process(pid) != Err(rustix::io::Errno::SRCH))
}

#[cfg(not(unix))]
fn is_alive(_pid: u32) -> bool {
    true
}
