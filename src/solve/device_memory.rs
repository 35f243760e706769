//! What was measured of a graphics processor, remembered for the next run: a file among the user's cached ones.

use super::current::REVISION;
use crate::files::{PROGRAM, write_atomic};
use crate::gpu::Adapter;
use serde::{Deserialize, Serialize};
use std::path::Path;

const SCHEMA: i64 = 1;
/// A graphics processor must be this much faster, or it is not worth the trouble.
const FASTER: f64 = 0.9;
/// Where drivers and devices are named.
const DRIVER_FOLDERS: [&str; 3] = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/dev/dri"];

/// Everything measured on this machine with this program.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Memory {
    schema: i64,
    program: String,
    /// Drivers and devices that were there. With others, nothing measured counts.
    drivers: Vec<String>,
    measured: Vec<Measured>,
}

/// One measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Measured {
    /// Method, lights and threads.
    pub(super) kind: String,
    pub(super) adapter: Adapter,
    /// Nanoseconds a photosite.
    pub(super) processor_ns: f64,
    /// The same, transfers included.
    pub(super) gpu_ns: f64,
}

impl Default for Memory {
    fn default() -> Self {
        // Another revision may be faster on either.
        let program = format!("{PROGRAM}, solve {REVISION}");
        Self { schema: SCHEMA, program, drivers: drivers(), measured: vec![] }
    }
}

impl Memory {
    /// What the file remembers; nothing where there is none, or it is of another machine, program or format.
    pub(super) fn read(path: &Path) -> Self {
        let now = Self::default();
        let text = crate::files::read_input_text(path).unwrap_or_default();
        let before = serde_json::from_str::<Self>(&text).ok();
        let same = |before: &Self| {
            (before.schema, &before.program, &before.drivers)
                == (now.schema, &now.program, &now.drivers)
        };
        before.filter(same).unwrap_or(now)
    }

    /// Writes the file; where that fails the next run measures again.
    pub(super) fn write(&self, path: &Path) {
        if let (Ok(text), Some(folder)) = (serde_json::to_string_pretty(self), path.parent()) {
            let _ = std::fs::create_dir_all(folder);
            let _ = write_atomic(path, text.as_bytes());
        }
    }

    pub(super) fn of(&self, kind: &str) -> Option<&Measured> {
        self.measured.iter().find(|measured| measured.kind == kind)
    }

    pub(super) fn remember(&mut self, measured: Measured) {
        self.measured.retain(|before| before.kind != measured.kind);
        self.measured.push(measured);
    }
}

impl Measured {
    pub(super) fn gpu_is_faster(&self) -> bool {
        self.gpu_ns < FASTER * self.processor_ns
    }

    /// For the report.
    pub(super) fn text(&self) -> String {
        format!(
            "{:.1} ns a photosite on {} with transfers, {:.1} on the processor",
            self.gpu_ns, self.adapter.name, self.processor_ns
        )
    }
}

/// Names of Vulkan drivers and of graphics devices, without opening any.
fn drivers() -> Vec<String> {
    let names = |folder: &&str| -> Vec<String> {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        entries.map(|entry| entry.path().display().to_string()).collect()
    };
    let mut all: Vec<String> = DRIVER_FOLDERS.iter().flat_map(names).collect();
    all.sort();
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(kind: &str, gpu_ns: f64) -> Measured {
        let adapter = Adapter { name: "card".into(), driver: "1.0".into(), software: false };
        Measured { kind: kind.into(), adapter, processor_ns: 10.0, gpu_ns }
    }

    #[test]
    fn what_is_remembered_comes_back_and_counts_for_this_machine_only() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cache").join("gpu.json");
        assert_eq!(Memory::read(&path), Memory::default());
        let mut memory = Memory::default();
        memory.remember(measured("a", 5.0));
        memory.remember(measured("b", 9.5));
        memory.remember(measured("a", 20.0));
        memory.write(&path);
        assert_eq!(Memory::read(&path), memory);
        assert_eq!(memory.of("a"), Some(&measured("a", 20.0)));
        assert_eq!(memory.of("c"), None);
        let elsewhere = Memory { drivers: vec!["another".into()], ..memory };
        elsewhere.write(&path);
        assert_eq!(Memory::read(&path), Memory::default());
        std::fs::write(&path, "{").unwrap();
        assert_eq!(Memory::read(&path), Memory::default());
    }

    #[test]
    fn only_the_clearly_faster_is_faster() {
        for (gpu_ns, expected) in [(5.0, true), (8.9, true), (9.5, false), (20.0, false)] {
            assert_eq!(measured("a", gpu_ns).gpu_is_faster(), expected, "{gpu_ns}");
        }
        assert!(!measured("a", f64::NAN).gpu_is_faster());
    }
}
