//! A fence around decoders that other people wrote: whatever they do with the bytes, the program sees an error.

use super::PictureError;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::{Mutex, Once, PoisonError};

thread_local! {
    /// True on a thread while a guarded decoder runs: its panics become errors and are not printed.
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Runs a decoder on this thread; a panic in it becomes an error and prints nothing.
pub(crate) fn guarded<T, E: From<PictureError>>(
    decoder: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    install_hook();
    let before = QUIET.replace(true);
    let outcome = catch_unwind(AssertUnwindSafe(decoder));
    QUIET.set(before);
    outcome.unwrap_or_else(|_| Err(PictureError::damaged(GAVE_UP).into()))
}

/// Like [`guarded`] for a decoder that uses rayon itself: it gets a pool of one thread of its own, so that its panics are
/// known wherever they happen, and so that the caller's thread waits instead of taking up another frame (which would
/// hold several frames' memory at once).
pub(crate) fn guarded_pool<T: Send, E: From<PictureError> + Send>(
    decoder: impl FnOnce() -> Result<T, E> + Send,
) -> Result<T, E> {
    install_hook();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .stack_size(8 << 20)
        .start_handler(|_| QUIET.set(true))
        .build();
    // Where no thread is to be had, the decoder shares ours.
    let Ok(pool) = pool else { return guarded(decoder) };
    // Who starts the waiting thread in vain has the decoder back.
    let decoder = Mutex::new(Some(decoder));
    let take = || decoder.lock().unwrap_or_else(PoisonError::into_inner).take();
    let waited = std::thread::scope(|scope| {
        let work = || take().map(|d| pool.install(|| catch_unwind(AssertUnwindSafe(d))));
        let waiting = std::thread::Builder::new().spawn_scoped(scope, work).ok()?;
        waiting.join().ok().flatten()
    });
    match (waited, take()) {
        (Some(outcome), _) => {
            outcome.unwrap_or_else(|_| Err(PictureError::damaged(GAVE_UP).into()))
        }
        (None, Some(decoder)) => guarded(decoder),
        (None, None) => Err(PictureError::damaged(GAVE_UP).into()),
    }
}

const GAVE_UP: &str = "its decoder gave up";

/// The process's one panic hook, wrapped once: silent on threads that are [`QUIET`], unchanged on all others.
fn install_hook() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let previous = take_hook();
        set_hook(Box::new(move |panic| {
            if !QUIET.get() {
                previous(panic);
            }
        }));
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    #[test]
    fn a_panic_becomes_an_error_and_leaves_the_thread_loud() {
        assert!(guarded::<(), PictureError>(|| panic!("on this thread")).is_err());
        assert!(!QUIET.get());
        assert_eq!(guarded(|| Ok::<_, PictureError>(7)), Ok(7));
    }

    #[test]
    fn a_panic_of_a_parallel_decoder_becomes_an_error() {
        let outcome = guarded_pool(|| {
            (0..100).into_par_iter().for_each(|i| assert!(i != 57, "inside the pool"));
            Ok::<_, PictureError>(())
        });
        assert!(outcome.is_err());
        assert_eq!(
            guarded_pool(|| Ok::<_, PictureError>((0..100).into_par_iter().sum::<i32>())),
            Ok(4950)
        );
    }
}
