//! Strokes of a mask that were not saved yet. They stay whichever way the picture is left: with their steps as long as the
//! window is open, as a picture in the user's configuration folder after that.

use crate::texts::shell::{no_thread, threads};
use crate::viewer::mask::Painting;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::sync::mpsc::{Receiver, Sender};
use std::thread::JoinHandle;
use std::time::Duration;
use weavelight::files::{FileError, sha256_hex, write_atomic};
use weavelight::machine::spawn;
use weavelight::raster::encode_png_grey8;
use weavelight::session::Session;
use weavelight_calibration::description::Image;

/// So long nothing must have changed before it is written: a picture takes its time.
const QUIET: Duration = Duration::from_millis(200);

/// Unsaved strokes.
#[derive(Debug, Default)]
pub(crate) struct Drafts {
    /// Of pictures that are not looked at now, by key.
    aside: HashMap<String, Painting>,
    writer: Option<Writer>,
}

/// Writes on a thread of its own, so that no frame waits for the disk.
#[derive(Debug)]
struct Writer {
    folder: PathBuf,
    changes: Option<Sender<Change>>,
    troubles: Receiver<String>,
    thread: Option<JoinHandle<()>>,
}

/// What is to stand in a file; `None`: nothing.
type Change = (PathBuf, Option<Image<bool>>);

/// What stays the same about a capture session while its mask is edited, and is another one when it is taken again.
pub(crate) fn key(session: &Session) -> String {
    let folder = session.folder.canonicalize().unwrap_or_else(|_| session.folder.clone());
    let mut text = format!("{}\n{:?}", folder.display(), session.captured);
    for frame in &session.frames {
        text.push('\n');
        text.push_str(&frame.file.to_string_lossy());
        text.push_str(frame.sha256.as_deref().unwrap_or_default());
    }
    sha256_hex(text.as_bytes())
}

/// The strokes in a file; `None` where there are none. Unlike a mask they may leave everything out.
pub(crate) fn read(file: &Path) -> Option<Image<bool>> {
    let picture = image::open(file).ok()?.into_luma8();
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let data = picture.into_raw().into_iter().map(|grey| grey > 0).collect();
    Some(Image { width, height, data })
}

impl Drafts {
    /// Puts a painting aside while another picture is looked at.
    pub(crate) fn put_aside(&mut self, key: String, painting: Painting) {
        self.aside.insert(key, painting);
    }

    /// Takes it up again.
    pub(crate) fn take(&mut self, key: &str) -> Option<Painting> {
        self.aside.remove(key)
    }

    /// The file of a picture's strokes, in this folder.
    pub(crate) fn file(folder: &Path, key: &str) -> PathBuf {
        folder.join(format!("{key}.png"))
    }

    /// Keeps strokes as they are now.
    pub(crate) fn keep(&mut self, folder: &Path, key: &str, mask: &Image<bool>) {
        self.change(folder, (Self::file(folder, key), Some(mask.clone())));
    }

    /// They were saved.
    pub(crate) fn forget(&mut self, folder: &Path, key: &str) {
        self.aside.remove(key);
        self.change(folder, (Self::file(folder, key), None));
    }

    fn change(&mut self, folder: &Path, change: Change) {
        if self.writer.as_ref().is_none_or(|writer| writer.folder != folder) {
            self.writer = Some(Writer::start(folder.to_owned()));
        }
        if let Some(changes) = self.writer.as_ref().and_then(|writer| writer.changes.as_ref()) {
            // The thread lives as long as the writer.
            let _ = changes.send(change);
        }
    }

    /// Why they could not be kept, once.
    pub(crate) fn trouble(&self) -> Option<String> {
        self.writer.as_ref()?.troubles.try_recv().ok()
    }
}

impl Writer {
    fn start(folder: PathBuf) -> Self {
        let (changes, inbox) = mpsc::channel();
        let (outbox, troubles) = mpsc::channel();
        let failure = outbox.clone();
        let thread = spawn("drafts", move || write_all(&inbox, &outbox));
        let thread = thread.inspect_err(|error| {
            let _ = failure.send(no_thread(threads::STROKES, error));
        });
        let thread = thread.ok();
        Self { folder, changes: Some(changes), troubles, thread }
    }
}

impl Drop for Writer {
    /// Returns when the last stroke is on the disk.
    fn drop(&mut self) {
        self.changes = None;
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

fn write_all(inbox: &Receiver<Change>, troubles: &Sender<String>) {
    while let Ok((file, mask)) = inbox.recv() {
        let mut newest = HashMap::from([(file, mask)]);
        while let Ok((file, mask)) = inbox.recv_timeout(QUIET) {
            newest.insert(file, mask);
        }
        for (file, mask) in newest {
            if let Err(error) = write(&file, mask.as_ref()) {
                // The window may be closed.
                let _ = troubles.send(error.to_string());
            }
        }
    }
}

fn write(file: &Path, mask: Option<&Image<bool>>) -> Result<(), FileError> {
    let Some(mask) = mask else {
        return match std::fs::remove_file(file) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(FileError::write(file, error))
            }
            _ => Ok(()),
        };
    };
    let folder = file.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(|error| FileError::write(folder, error))?;
    let bytes = encode_png_grey8(&in_grey(mask)).map_err(|error| FileError::write(file, error))?;
    write_atomic(file, &bytes)
}

/// White inside.
pub(crate) fn in_grey(mask: &Image<bool>) -> Image<u8> {
    let data = mask.data.iter().map(|inside| if *inside { 255 } else { 0 }).collect();
    Image { width: mask.width, height: mask.height, data }
}

#[cfg(test)]
mod tests {
    use super::*;
    use weavelight::session::{FrameEntry, Kind};

    #[test]
    fn the_last_strokes_are_on_the_disk_when_the_window_is_closed() {
        let home = tempfile::tempdir().unwrap();
        let folder = home.path().join("config/drafts");
        let mut mask = Image::filled(7, 5, true);
        let mut drafts = Drafts::default();
        for k in 0..3 {
            mask.data[k] = false;
            drafts.keep(&folder, "a", &mask);
        }
        let nothing = Image::filled(3, 2, false);
        drafts.keep(&folder, "b", &nothing);
        drop(drafts);
        assert_eq!(read(&Drafts::file(&folder, "a")), Some(mask));
        let mut drafts = Drafts::default();
        drafts.forget(&folder, "a");
        drafts.forget(&folder, "never there");
        drop(drafts);
        assert_eq!(read(&Drafts::file(&folder, "a")), None);
        assert_eq!(read(&Drafts::file(&folder, "b")), Some(nothing));
    }

    #[test]
    fn what_cannot_be_kept_is_reported() {
        let home = tempfile::tempdir().unwrap();
        let blocked = home.path().join("a file");
        std::fs::write(&blocked, "").unwrap();
        let mut drafts = Drafts::default();
        drafts.keep(&blocked.join("drafts"), "a", &Image::filled(2, 2, true));
        let begun = std::time::Instant::now();
        let trouble = loop {
            assert!(begun.elapsed() < Duration::from_secs(60), "not reported");
            if let Some(trouble) = drafts.trouble() {
                break trouble;
            }
            std::thread::yield_now();
        };
        assert!(trouble.contains("drafts"), "{trouble}");
    }

    #[test]
    fn a_scan_that_is_taken_again_has_strokes_of_its_own() {
        let mut session = Session::new("/scans/linen", Kind::Swatch, "linen");
        session.frames.push(FrameEntry::new("light-00.dng", Some(0), 0.1, 100.0));
        let first = key(&session);
        session.mask = Some("mask.png".into());
        session.name = "linen, washed".to_owned();
        assert_eq!(key(&session), first);
        session.frames[0].sha256 = Some("another".to_owned());
        assert_ne!(key(&session), first);
    }
}
