//! What libraries read from the environment as soon as they start.

/// Puts variables right that would make libraries take more than makes sense, by starting the program again in its own place:
///
/// - `RAYON_NUM_THREADS`: decoders make pools of their own that take its word.
/// - `MALLOC_ARENA_MAX`: where the address space is limited, the GNU allocator would set 64 MB of it aside for every thread.
///
/// Comes first in `main`. Where the program cannot be started again, it goes on as it is.
#[cfg(target_os = "linux")]
pub fn correct_environment() {
    use std::os::unix::process::CommandExt;
    let is_limited = rustix::process::getrlimit(rustix::process::Resource::As).current.is_some();
    let corrections = corrections(|name| std::env::var_os(name), is_limited);
    let mut arguments = std::env::args_os();
    let (Some(name), Ok(program)) = (arguments.next(), std::env::current_exe()) else { return };
    if !corrections.is_empty() {
        // Comes back only where it failed.
        let _ =
            std::process::Command::new(program).arg0(name).args(arguments).envs(corrections).exec();
    }
}

#[cfg(not(target_os = "linux"))]
/// Nothing is known to be put right here.
pub fn correct_environment() {}

/// Names and values that differ from what they should be.
#[cfg(any(target_os = "linux", test))]
fn corrections(
    get: impl Fn(&str) -> Option<std::ffi::OsString>,
    address_space_is_limited: bool,
) -> Vec<(&'static str, String)> {
    const THREADS: &str = "RAYON_NUM_THREADS";
    const ARENAS: &str = "MALLOC_ARENA_MAX";
    let asked = get(THREADS).and_then(|text| text.to_str()?.parse::<usize>().ok());
    let most = asked.map(|asked| super::thread_count(Some(asked)));
    let threads = most.filter(|most| asked.is_some_and(|asked| asked > *most));
    let threads = threads.map(|most| (THREADS, most.to_string()));
    let arenas =
        (address_space_is_limited && get(ARENAS).is_none()).then(|| (ARENAS, "1".to_owned()));
    threads.into_iter().chain(arenas).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::OsString;

    #[test]
    fn only_what_is_wrong_is_corrected_and_once() {
        let found = |threads: Option<&str>, arenas: Option<&str>, is_limited| {
            let get = |name: &str| match name {
                "RAYON_NUM_THREADS" => threads.map(OsString::from),
                _ => arenas.map(OsString::from),
            };
            corrections(get, is_limited)
        };
        for threads in [None, Some("0"), Some("1"), Some("2"), Some("many"), Some("-1")] {
            assert_eq!(found(threads, None, false), [], "{threads:?}");
        }
        let most = crate::machine::thread_count(Some(1000)).to_string();
        assert_eq!(found(Some("1000"), None, false), [("RAYON_NUM_THREADS", most.clone())]);
        assert_eq!(found(Some(&most), None, false), []);
        assert_eq!(found(None, None, true), [("MALLOC_ARENA_MAX", "1".to_owned())]);
        assert_eq!(found(None, Some("3"), true), []);
    }
}
