//! What drivers print is not for users of a program that found another way.

#[cfg(unix)]
pub use unix::Quiet;

/// Elsewhere nothing of the kind is known.
#[cfg(not(unix))]
#[derive(Debug)]
pub struct Quiet;

#[cfg(not(unix))]
impl Quiet {
    /// Nothing is held back.
    pub fn begin() -> Option<Self> {
        None
    }
}

#[cfg(unix)]
mod unix {
    use std::fs::File;
    use std::io::{Read, Seek, Write};
    use std::os::fd::OwnedFd;
    use std::path::Path;
    use std::sync::{Mutex, PoisonError};

    /// Holds the standard error stream back while it lives, and then passes it on without the one line that Mesa's device
    /// selection has libwayland print where there is no desktop: "error: XDG_RUNTIME_DIR is invalid or not set in the
    /// environment." Setting the variable instead is unsound while threads run. Of several that live at once, the last one
    /// passes it on.
    #[derive(Debug)]
    pub struct Quiet(());

    struct Held {
        /// How many want it.
        count: usize,
        stderr: OwnedFd,
        held_back: File,
    }

    static HELD: Mutex<Option<Held>> = Mutex::new(None);

    impl Quiet {
        /// `None` where the line is not to be expected, or the stream cannot be held back.
        pub fn begin() -> Option<Self> {
            let folder = std::env::var_os("XDG_RUNTIME_DIR").unwrap_or_default();
            if Path::new(&folder).is_absolute() {
                return None;
            }
            let mut held = HELD.lock().unwrap_or_else(PoisonError::into_inner);
            match held.as_mut() {
                Some(held) => held.count += 1,
                None => *held = Some(Held::begin()?),
            }
            Some(Self(()))
        }
    }

    impl Drop for Quiet {
        fn drop(&mut self) {
            let mut held = HELD.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(inner) = held.as_mut() {
                inner.count -= 1;
            }
            if let Some(done) = held.take_if(|held| held.count == 0) {
                done.pass_on();
            }
        }
    }

    impl Held {
        fn begin() -> Option<Self> {
            let held_back = tempfile::tempfile().ok()?;
            let stderr = rustix::io::dup(rustix::stdio::stderr()).ok()?;
            rustix::stdio::dup2_stderr(&held_back).ok()?;
            Some(Self { count: 1, stderr, held_back })
        }

        /// What cannot be put back or passed on is only a message of a driver.
        fn pass_on(mut self) {
            let _ = rustix::stdio::dup2_stderr(&self.stderr);
            let mut said = vec![];
            let read = self.held_back.rewind().and_then(|()| self.held_back.read_to_end(&mut said));
            if read.is_ok() {
                let _ = std::io::stderr().write_all(&without_the_line(&said));
            }
        }
    }

    fn without_the_line(said: &[u8]) -> Vec<u8> {
        let expected = |line: &&[u8]| !line.starts_with(b"error: XDG_RUNTIME_DIR");
        said.split_inclusive(|byte| *byte == b'\n').filter(expected).flatten().copied().collect()
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn only_the_one_line_is_kept_back() {
            let said = b"warning: one\nerror: XDG_RUNTIME_DIR is invalid or not set in the environment.\nerror: two";
            assert_eq!(without_the_line(said), b"warning: one\nerror: two");
            assert_eq!(without_the_line(b""), b"");
        }
    }
}
