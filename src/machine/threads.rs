//! As many threads as make sense and are to be had.

use super::memory::threads_that_fit;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::io;
use std::num::NonZeroUsize;
use std::thread::{Builder, JoinHandle};

/// The stack of every thread that we start: neither `ulimit -s` nor `RUST_MIN_STACK` changes it.
const STACK_BYTES: usize = 8 << 20;
/// More threads than this on each core only wait for each other, and each takes memory.
const MOST_PER_CORE: usize = 4;
/// Results are compared for other thread counts than a small machine has cores.
const ALWAYS_ALLOWED: usize = 16;
/// Threads that are left to others: a decoder's own, the light board's.
const SPARE: usize = 4;

/// How many threads work when `asked` are asked for: one a core where nothing is asked, and no more than make sense.
pub fn thread_count(asked: Option<usize>) -> usize {
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    match asked {
        None | Some(0) => cores,
        Some(count) => count.min((MOST_PER_CORE * cores).max(ALWAYS_ALLOWED)),
    }
}

/// Makes the process's common thread pool, as many threads as `RAYON_NUM_THREADS` asks for. Where the system gives fewer
/// threads, it has fewer; where it gives none, the calling thread does all the work.
pub fn start() {
    let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|text| text.trim().parse().ok());
    let fit = threads_that_fit();
    let wanted = thread_count(asked).min(fit.unwrap_or(usize::MAX));
    // What the allocator sets aside for a thread it keeps when the thread ends: where address space is scarce, trying out
    // more threads than will work would use it up.
    let spare = if fit.is_some() { 0 } else { SPARE };
    let count = match to_be_had(wanted + spare) {
        all if all == wanted + spare && all > 1 => wanted,
        0 | 1 => 0,
        few => few.saturating_sub(spare).max(1),
    };
    // A pool that is there already (in a test) will do.
    let _ = match count {
        // The calling thread works for others only while it waits for its own work: not where there can be others.
        0 => builder(1).use_current_thread().build_global(),
        count => builder(count).build_global(),
    };
}

/// A pool for one run; the common one where the system gives no more threads.
#[derive(Debug)]
pub struct Pool(Option<ThreadPool>);

impl Pool {
    /// With as many threads as are `asked` for, make sense and are to be had.
    pub fn new(asked: Option<usize>) -> Self {
        let mut count = match (asked, threads_that_fit()) {
            // Threads beside those that are there would take the address space from the work.
            (_, Some(few)) if few < 2 * rayon::current_num_threads() => 0,
            // The common pool has the right number, and perhaps fewer because there were no more.
            (None, _) => rayon::current_num_threads(),
            (Some(count), _) => thread_count(Some(count)),
        };
        while count > 0 {
            if let Ok(pool) = builder(count).build() {
                return Self(Some(pool));
            }
            count /= 2;
        }
        Self(None)
    }

    /// Does something on this pool.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        match &self.0 {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }
}

/// Starts a thread beside the pools.
///
/// # Errors
/// Where the system gives no more.
pub fn spawn<T: Send + 'static>(
    name: &str,
    work: impl FnOnce() -> T + Send + 'static,
) -> io::Result<JoinHandle<T>> {
    Builder::new().name(name.to_owned()).stack_size(STACK_BYTES).spawn(work)
}

fn builder(count: usize) -> ThreadPoolBuilder {
    ThreadPoolBuilder::new().num_threads(count).stack_size(STACK_BYTES)
}

/// How many of `count` threads can be there at once: a pool that cannot be made whole is not made at all.
fn to_be_had(count: usize) -> usize {
    let (release, hold) = std::sync::mpsc::channel::<()>();
    let hold = std::sync::Mutex::new(hold);
    std::thread::scope(|scope| {
        let wait = || {
            // Ends when the sender is dropped.
            let _ = hold.lock().map(|hold| hold.recv());
        };
        let started = (0..count)
            .map_while(|_| Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, wait).ok())
            .count();
        drop(release);
        started
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thread_counts_are_sensible_whatever_is_asked() {
        let cores = thread_count(None);
        assert!(cores >= 1);
        assert_eq!(thread_count(Some(0)), cores);
        assert_eq!(thread_count(Some(3)), 3);
        assert!(thread_count(Some(1000)) <= (4 * cores).max(16));
    }

    #[test]
    fn a_pool_has_the_threads_asked_for() {
        for count in [1, 2, 7] {
            assert_eq!(Pool::new(Some(count)).install(rayon::current_num_threads), count);
        }
        assert_eq!(Pool(None).install(|| 5), 5);
        assert_eq!(to_be_had(3), 3);
        assert_eq!(spawn("test", || 4).unwrap().join().unwrap(), 4);
    }
}
