//! How much memory is left, by whatever limits it first.

use crate::files::{read_input_text, size};
use std::path::{Path, PathBuf};

/// Memory that any run needs beside what is foreseen: buffers of bands and rows, files being encoded.
const BESIDE_BYTES: u64 = 64 << 20;
/// Address space that the allocator sets aside and uses only in part, with one arena ([`super::correct_environment`]).
const SET_ASIDE_BYTES: u64 = 16 << 20;

/// Something that needs more memory than there is.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} needs about {} of memory, but {} are available ({limit}); {remedy}", size(*.needed), size(*.available))]
pub struct NoMemory {
    /// As in "decoding 20 frames of 4928 x 3264".
    pub what: String,
    /// Bytes.
    pub needed: u64,
    /// Bytes.
    pub available: u64,
    /// What limits it, as in "ulimit -v".
    pub limit: &'static str,
    /// What to do.
    pub remedy: String,
}

/// Sees that `needed` bytes are to be had.
///
/// # Errors
/// Where they are not. Where the system does not say what there is, anything is.
pub fn check_memory(
    what: impl FnOnce() -> String,
    needed: u64,
    remedy: impl Into<String>,
) -> Result<(), NoMemory> {
    let Some((available, limit)) = available_bytes() else { return Ok(()) };
    let needed = needed.saturating_add(BESIDE_BYTES);
    if needed <= available {
        return Ok(());
    }
    Err(NoMemory { what: what(), needed, available, limit, remedy: remedy.into() })
}

/// Bytes that this process may still take, and what limits them; `None` where the system does not say.
pub fn available_bytes() -> Option<(u64, &'static str)> {
    [of_address_space(), of_data(), of_cgroup(), of_machine()]
        .into_iter()
        .flatten()
        .min_by_key(|left| left.0)
}

#[cfg(unix)]
fn of_address_space() -> Option<(u64, &'static str)> {
    use rustix::process::{Resource, getrlimit};
    let limit = getrlimit(Resource::As).current?;
    let left = limit.saturating_sub(in_use(0)?).saturating_sub(SET_ASIDE_BYTES);
    Some((left, "the address space is limited, see ulimit -v"))
}

#[cfg(unix)]
fn of_data() -> Option<(u64, &'static str)> {
    use rustix::process::{Resource, getrlimit};
    let limit = getrlimit(Resource::Data).current?;
    let left = limit.saturating_sub(in_use(5)?).saturating_sub(SET_ASIDE_BYTES);
    Some((left, "memory for data is limited, see ulimit -d"))
}

/// Bytes that number `place` of statm says: 0 address space, 5 data and stacks.
#[cfg(unix)]
fn in_use(place: usize) -> Option<u64> {
    let statm = read_input_text(Path::new("/proc/self/statm")).ok()?;
    let pages: u64 = statm.split(' ').nth(place)?.trim().parse().ok()?;
    Some(pages.saturating_mul(rustix::param::page_size() as u64))
}

#[cfg(not(unix))]
fn of_address_space() -> Option<(u64, &'static str)> {
    None
}

#[cfg(not(unix))]
fn of_data() -> Option<(u64, &'static str)> {
    None
}

/// The tightest limit of the control groups that the process is in: a container's, a service's.
fn of_cgroup() -> Option<(u64, &'static str)> {
    let groups = read_input_text(Path::new("/proc/self/cgroup")).ok()?;
    let left = groups.lines().filter_map(|line| {
        let mut parts = line.splitn(3, ':');
        let (_, controllers, path) = (parts.next()?, parts.next()?, parts.next()?);
        let (root, most, used) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max", "memory.current"),
            "memory" => ("/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes"),
            _ => return None,
        };
        left_below(Path::new(root), path.trim_start_matches('/'), most, used)
    });
    left.min().map(|left| (left, "the control group's limit"))
}

/// Every group from the process's own up to the root: in a container the root itself is the container's.
fn left_below(root: &Path, path: &str, most: &str, used: &str) -> Option<u64> {
    let number = |file: PathBuf| read_input_text(&file).ok()?.trim().parse::<u64>().ok();
    let own = root.join(path);
    let groups = own.ancestors().take_while(|group| group.starts_with(root));
    let left = groups.filter_map(|group| {
        let most = number(group.join(most))?;
        // Pages of files count as used, but make room.
        let reclaimable = reclaimable(&group.join("memory.stat"));
        Some(most.saturating_sub(number(group.join(used))?.saturating_sub(reclaimable)))
    });
    left.min()
}

fn reclaimable(stat: &Path) -> u64 {
    let text = read_input_text(stat).unwrap_or_default();
    let of = |name: &str| -> u64 {
        let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
        line.and_then(|number| number.trim().parse().ok()).unwrap_or(0)
    };
    of("inactive_file") + of("active_file")
}

fn of_machine() -> Option<(u64, &'static str)> {
    let text = read_input_text(Path::new("/proc/meminfo")).ok()?;
    let kilobytes = |name: &str| -> Option<u64> {
        let line = text.lines().find_map(|line| line.strip_prefix(name))?;
        line.trim().strip_suffix("kB")?.trim().parse().ok()
    };
    // Slow, but there.
    let swap = kilobytes("SwapFree:").unwrap_or(0);
    let free = kilobytes("MemAvailable:")?.saturating_add(swap);
    Some((free.saturating_mul(1024), "all that is free on this machine"))
}

/// Address space of a thread: its stack, and what it works on.
const BYTES_PER_THREAD: u64 = 64 << 20;

/// How many threads fit into what is left; at least one. `None` where neither address space nor data are limited.
pub(super) fn threads_that_fit() -> Option<usize> {
    let (left, _) =
        [of_address_space(), of_data()].into_iter().flatten().min_by_key(|left| left.0)?;
    Some(usize::try_from(left / BYTES_PER_THREAD).unwrap_or(usize::MAX).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_needed_is_compared_with_what_there_is() {
        let what = || "a giant picture".to_owned();
        assert_eq!(check_memory(what, 1 << 10, "x"), Ok(()));
        if let Some((available, _)) = available_bytes() {
            assert!(available > 0);
            let error = check_memory(what, 1 << 50, "use --preview 8").unwrap_err().to_string();
            assert!(
                error.starts_with("a giant picture needs about 1125.9 TB of memory, but ")
                    && error.ends_with("use --preview 8"),
                "{error}"
            );
        }
    }

    #[test]
    fn the_tightest_group_counts() {
        let home = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = home.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        let left = || left_below(home.path(), "a/b", "memory.max", "memory.current");
        assert_eq!(left(), None);
        write("a/b/memory.max", "max\n");
        write("a/b/memory.current", "100\n");
        assert_eq!(left(), None);
        write("a/memory.max", "1000\n");
        write("a/memory.current", "700\n");
        write("a/memory.stat", "anon 400\ninactive_file 200\nactive_file 50\n");
        assert_eq!(left(), Some(550));
        write("memory.max", "600\n");
        write("memory.current", "800\n");
        assert_eq!(left(), Some(0));
    }
}
