//! The one way to open a file that somebody else wrote: an ordinary file of a sensible size, or an error.

use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::Path;

/// What a file is read as. It says how large the file may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputKind {
    /// TOML, JSON, a list of directions: text that people could read.
    Text,
    /// A picture in any format.
    Picture,
}

impl InputKind {
    /// The most bytes that are read. A list of a million defective photosites takes 14 MB; the largest picture that is
    /// decoded (see `raster::limits`) takes 1.6 GB.
    pub const fn most_bytes(self) -> u64 {
        match self {
            Self::Text => 16 << 20,
            Self::Picture => 2 << 30,
        }
    }

    const fn what(self) -> &'static str {
        match self {
            Self::Text => "a text file",
            Self::Picture => "a picture",
        }
    }
}

/// A file without a size of its own (in /proc, or on some network shares) is read up to here.
const UNSIZED_BYTES: u64 = 1 << 20;

/// Why something is not read, although the system would.
#[derive(Debug, thiserror::Error)]
pub(super) enum Refused {
    #[error("is {0}, not a file; copy what it holds to a file and name that")]
    NotAFile(&'static str),
    #[error("has {}, too much for {what} (at most {}); check that this is the right file", size(*.bytes), size(*.most))]
    TooLarge { bytes: u64, most: u64, what: &'static str },
    #[error(
        "does not say its size and holds over {}; copy what is needed to a file and name that",
        size(UNSIZED_BYTES)
    )]
    Endless,
    #[error("needs {} of memory, which is not to be had; close other programs or raise the memory limit", size(*.0))]
    Memory(u64),
}

/// Reads a whole file.
///
/// # Errors
/// Where there is none, it is not an ordinary file (a folder, named pipe, device or socket; links are followed), it is
/// larger than its kind allows, or it cannot be read.
pub fn read_input(path: &Path, kind: InputKind) -> io::Result<Vec<u8>> {
    let (file, metadata) = open(path)?;
    read_within(file, metadata.len(), kind)
}

/// Reads what is there, as far as its kind allows; `size`: what the system says of it, 0 where it says nothing.
fn read_within(file: impl Read, size: u64, kind: InputKind) -> io::Result<Vec<u8>> {
    let most = kind.most_bytes();
    if size > most {
        return Err(refuse(Refused::TooLarge { bytes: size, most, what: kind.what() }));
    }
    let limit = if size == 0 { UNSIZED_BYTES } else { most };
    let mut bytes = Vec::new();
    let room = usize::try_from(size).unwrap_or(usize::MAX);
    bytes.try_reserve_exact(room).map_err(|_| refuse(Refused::Memory(size)))?;
    // One byte more than allowed shows that there is more.
    file.take(limit + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 {
        found if found <= limit => Ok(bytes),
        _ if size == 0 => Err(refuse(Refused::Endless)),
        found => Err(refuse(Refused::TooLarge { bytes: found, most, what: kind.what() })),
    }
}

/// Reads a whole text file.
///
/// # Errors
/// As [`read_input`], and where it is not UTF-8 ([`io::ErrorKind::InvalidData`]).
pub fn read_input_text(path: &Path) -> io::Result<String> {
    String::from_utf8(read_input(path, InputKind::Text)?)
        .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error.utf8_error()))
}

/// Opens an ordinary file to be read piece by piece.
///
/// # Errors
/// As [`read_input`], but of any size.
pub fn open_input(path: &Path) -> io::Result<File> {
    open(path).map(|(file, _)| file)
}

/// Copies an ordinary file.
///
/// # Errors
/// As [`open_input`], or where `to` cannot be written.
pub fn copy_input(from: &Path, to: &Path) -> io::Result<()> {
    check_input(from)?;
    std::fs::copy(from, to).map(drop)
}

/// Sees that `path` is an ordinary file, without opening it.
///
/// # Errors
/// Where it is not, or is not there.
pub fn check_input(path: &Path) -> io::Result<()> {
    check(&std::fs::metadata(path)?)
}

fn open(path: &Path) -> io::Result<(File, Metadata)> {
    // Opening alone may do something: a serial port resets its board, a named pipe waits for the other side.
    check_input(path)?;
    let file = open_without_waiting(path)?;
    // It may have been replaced meanwhile.
    let metadata = file.metadata()?;
    check(&metadata)?;
    Ok((file, metadata))
}

#[cfg(unix)]
fn open_without_waiting(path: &Path) -> io::Result<File> {
    use std::os::unix::fs::OpenOptionsExt;
    let flags = rustix::fs::OFlags::NONBLOCK | rustix::fs::OFlags::NOCTTY;
    let flags = i32::try_from(flags.bits()).unwrap_or(0);
    File::options().read(true).custom_flags(flags).open(path)
}

#[cfg(not(unix))]
fn open_without_waiting(path: &Path) -> io::Result<File> {
    File::open(path)
}

fn check(metadata: &Metadata) -> io::Result<()> {
    match what_else(metadata) {
        None => Ok(()),
        Some("a folder") => Err(io::ErrorKind::IsADirectory.into()),
        Some(what) => Err(refuse(Refused::NotAFile(what))),
    }
}

/// What it is, if it is not an ordinary file, as in "a named pipe".
pub(super) fn what_else(metadata: &Metadata) -> Option<&'static str> {
    let kind = metadata.file_type();
    if kind.is_file() {
        return None;
    }
    if kind.is_dir() {
        return Some("a folder");
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return Some("a named pipe");
        }
        if kind.is_socket() {
            return Some("a socket");
        }
        if kind.is_char_device() || kind.is_block_device() {
            return Some("a device");
        }
    }
    Some("something else")
}

fn refuse(why: Refused) -> io::Error {
    let kind = match why {
        Refused::NotAFile(_) => io::ErrorKind::InvalidInput,
        Refused::TooLarge { .. } | Refused::Endless => io::ErrorKind::FileTooLarge,
        Refused::Memory(_) => io::ErrorKind::OutOfMemory,
    };
    io::Error::new(kind, why)
}

/// A number of bytes for a message, as in "2.1 GB".
pub(crate) fn size(bytes: u64) -> String {
    match bytes as f64 {
        few if few < 1e3 => format!("{bytes} bytes"),
        kilo if kilo < 1e6 => format!("{:.1} kB", kilo / 1e3),
        mega if mega < 1e9 => format!("{:.1} MB", mega / 1e6),
        giga if giga < 1e12 => format!("{:.1} GB", giga / 1e9),
        more => format!("{:.1} TB", more / 1e12),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::FileError;

    /// The error of reading `path`, as a user sees it.
    fn error(path: &Path, kind: InputKind) -> String {
        FileError::read(path, read_input(path, kind).unwrap_err()).to_string()
    }

    #[test]
    fn ordinary_files_are_read_also_through_links() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("a");
        std::fs::write(&path, "abc").unwrap();
        assert_eq!(read_input(&path, InputKind::Text).unwrap(), b"abc");
        std::fs::write(home.path().join("empty"), "").unwrap();
        assert_eq!(read_input_text(&home.path().join("empty")).unwrap(), "");
        #[cfg(unix)]
        {
            let link = home.path().join("link");
            std::os::unix::fs::symlink(&path, &link).unwrap();
            assert_eq!(read_input_text(&link).unwrap(), "abc");
        }
    }

    #[test]
    fn what_is_missing_a_folder_or_too_large_is_named() {
        let home = tempfile::tempdir().unwrap();
        assert!(error(&home.path().join("none"), InputKind::Text).contains("not found"));
        assert!(error(home.path(), InputKind::Picture).contains("is a folder where a file"));
        let path = home.path().join("large");
        // Sparse: it takes no room.
        File::create(&path).unwrap().set_len(5 << 30).unwrap();
        let said = error(&path, InputKind::Text);
        assert!(
            said.contains("large: has 5.4 GB, too much for a text file (at most 16.8 MB);"),
            "{said}"
        );
        let said = error(&path, InputKind::Picture);
        assert!(said.contains("has 5.4 GB, too much for a picture (at most 2.1 GB);"), "{said}");
        std::fs::write(&path, [0xff, 0xfe]).unwrap();
        let said = FileError::read(&path, read_input_text(&path).unwrap_err()).to_string();
        assert!(said.contains("is not UTF-8 text"), "{said}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn pipes_sockets_and_devices_are_refused_at_once() {
        let home = tempfile::tempdir().unwrap();
        let (pipe, socket) = (home.path().join("pipe"), home.path().join("socket"));
        rustix::fs::mknodat(
            rustix::fs::CWD,
            &pipe,
            rustix::fs::FileType::Fifo,
            rustix::fs::Mode::RUSR,
            0,
        )
        .unwrap();
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        let link = home.path().join("link");
        std::os::unix::fs::symlink(&pipe, &link).unwrap();
        for (path, what) in [
            (pipe.as_path(), "pipe: is a named pipe, not a file; copy what it holds to a file"),
            (&link, "link: is a named pipe, not a file"),
            (&socket, "socket: is a socket, not a file"),
            (Path::new("/dev/zero"), "/dev/zero: is a device, not a file"),
            (Path::new("/dev/null"), "/dev/null: is a device, not a file"),
        ] {
            for kind in [InputKind::Text, InputKind::Picture] {
                let said = error(path, kind);
                assert!(said.contains(what), "{said}");
            }
            assert!(open_input(path).is_err(), "{}", path.display());
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn files_without_a_size_are_read_up_to_a_limit() {
        assert!(!read_input_text(Path::new("/proc/self/status")).unwrap().is_empty());
        let endless = read_within(io::repeat(7), 0, InputKind::Picture).unwrap_err().to_string();
        assert!(endless.contains("does not say its size and holds over 1.0 MB"), "{endless}");
        let growing = read_within(io::repeat(7), 1, InputKind::Text).unwrap_err().to_string();
        assert!(growing.contains("too much for a text file"), "{growing}");
    }
}
