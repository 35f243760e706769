//! Which processor solves. What was measured of a graphics processor is remembered for the next run: a file among the user's cached ones.

use super::Gpu;
use crate::files::write_atomic;
use crate::gpu::Adapter;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;

const SCHEMA: i64 = 1;
/// A graphics processor must be this much faster, or it is not worth the trouble.
const FASTER: f64 = 0.9;
/// Where drivers and devices are named.
const DRIVER_FOLDERS: [&str; 3] = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/dev/dri"];

/// Who solves the photosites that have all their samples. All answers agree within 0.001 degrees.
#[derive(Clone, Debug, Default)]
pub enum Device {
    /// The processor.
    #[default]
    Cpu,
    /// The graphics processor, or an error.
    Gpu,
    /// This graphics processor.
    Opened(Arc<Gpu>),
    /// Whichever was measured to be faster on this machine; the processor where nothing can be measured.
    Auto {
        /// The file that remembers what was measured; `None`: measured every time.
        memory: Option<PathBuf>,
    },
}

/// Everything measured on this machine with this program.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Memory {
    schema: i64,
    program: String,
    /// Drivers and devices that were there. With others, nothing measured counts.
    drivers: Vec<String>,
    measured: Vec<Measured>,
}

/// One measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Measured {
    /// Method, lights and threads.
    pub(crate) kind: String,
    pub(crate) adapter: Adapter,
    /// Nanoseconds a photosite.
    pub(crate) processor_ns: f64,
    /// The same, transfers included.
    pub(crate) gpu_ns: f64,
}

impl Memory {
    /// Nothing measured yet, with this program on this machine.
    pub(crate) fn new(program: String) -> Self {
        Self { schema: SCHEMA, program, drivers: drivers(), measured: vec![] }
    }

    /// What the file remembers; nothing where there is none, or it is of another machine, program or format.
    pub(crate) fn read(path: &Path, program: String) -> Self {
        let now = Self::new(program);
        let text = crate::files::read_input_text(path).unwrap_or_default();
        let before = serde_json::from_str::<Self>(&text).ok();
        let same = |before: &Self| {
            (before.schema, &before.program, &before.drivers)
                == (now.schema, &now.program, &now.drivers)
        };
        before.filter(same).unwrap_or(now)
    }

    /// Writes the file; where that fails the next run measures again.
    pub(crate) fn write(&self, path: &Path) {
        if let (Ok(text), Some(folder)) = (serde_json::to_string_pretty(self), path.parent()) {
            let _ = std::fs::create_dir_all(folder);
            let _ = write_atomic(path, text.as_bytes());
        }
    }

    pub(crate) fn of(&self, kind: &str) -> Option<&Measured> {
        self.measured.iter().find(|measured| measured.kind == kind)
    }

    pub(crate) fn remember(&mut self, measured: Measured) {
        self.measured.retain(|before| before.kind != measured.kind);
        self.measured.push(measured);
    }
}

impl Measured {
    pub(crate) fn gpu_is_faster(&self) -> bool {
        self.gpu_ns < FASTER * self.processor_ns
    }

    /// For the report.
    pub(crate) fn text(&self) -> String {
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

    fn none() -> Memory {
        Memory::new("one".into())
    }

    fn measured(kind: &str, gpu_ns: f64) -> Measured {
        let adapter = Adapter { name: "card".into(), driver: "1.0".into(), software: false };
        Measured { kind: kind.into(), adapter, processor_ns: 10.0, gpu_ns }
    }

    #[test]
    fn what_is_remembered_comes_back_and_counts_for_this_machine_only() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cache").join("gpu.json");
        assert_eq!(Memory::read(&path, "one".into()), none());
        let mut memory = none();
        memory.remember(measured("a", 5.0));
        memory.remember(measured("b", 9.5));
        memory.remember(measured("a", 20.0));
        memory.write(&path);
        assert_eq!(Memory::read(&path, "one".into()), memory);
        assert_eq!(memory.of("a"), Some(&measured("a", 20.0)));
        assert_eq!(memory.of("c"), None);
        let elsewhere = Memory { drivers: vec!["another".into()], ..memory };
        elsewhere.write(&path);
        assert_eq!(Memory::read(&path, "one".into()), none());
        std::fs::write(&path, "{").unwrap();
        assert_eq!(Memory::read(&path, "one".into()), none());
    }

    #[test]
    fn only_the_clearly_faster_is_faster() {
        for (gpu_ns, expected) in [(5.0, true), (8.9, true), (9.5, false), (20.0, false)] {
            assert_eq!(measured("a", gpu_ns).gpu_is_faster(), expected, "{gpu_ns}");
        }
        assert!(!measured("a", f64::NAN).gpu_is_faster());
    }
}
