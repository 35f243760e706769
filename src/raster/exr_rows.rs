//! OpenEXR out, row by row in any order: for maps that come in bands from several threads and never stand in memory as a
//! whole.

use super::exr_out::preamble;
use crate::files::FileError;
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// An EXR file of one 32-bit float channel, Y, under construction. Once each row is written it has the bytes that
/// [`write_exr_y`](super::write_exr_y) would have written.
#[derive(Debug)]
pub struct ExrRows {
    path: PathBuf,
    file: Mutex<File>,
    /// Where the rows begin.
    first: usize,
    width: usize,
}

/// Row number and byte count before the samples of a row.
const ROW_HEADER: usize = 8;

impl ExrRows {
    /// Starts a file. It grows in place: whoever must not show half a file writes it elsewhere first.
    ///
    /// # Errors
    /// No space, not allowed, or too large for the format.
    pub fn create(path: &Path, [width, height]: [usize; 2]) -> Result<Self, FileError> {
        let failed = |source| FileError::write(path, source);
        let mut file = File::create(path).map_err(failed)?;
        let start = preamble([width, height], &["Y"]).map_err(failed)?;
        file.write_all(&start).map_err(failed)?;
        let (path, first) = (path.to_owned(), start.len());
        Ok(Self { path, file: Mutex::new(file), first, width })
    }

    /// Writes row `y`, as many values as the file is wide.
    ///
    /// # Errors
    /// No space.
    pub fn write_row(&self, y: usize, values: &[f32]) -> Result<(), FileError> {
        debug_assert_eq!(values.len(), self.width, "row {y} of {}", self.path.display());
        let mut bytes = Vec::with_capacity(ROW_HEADER + 4 * self.width);
        bytes.extend((y as i32).to_le_bytes());
        bytes.extend((4 * self.width as i32).to_le_bytes());
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        let at = self.first + y * (ROW_HEADER + 4 * self.width);
        // A writer that panicked has left a row unwritten, which its own thread reports.
        let mut file = self.file.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        file.seek(SeekFrom::Start(at as u64))
            .and_then(|_| file.write_all(&bytes))
            .map_err(|source| FileError::write(&self.path, source))
    }
}

#[cfg(test)]
mod tests {
    use super::super::write_exr_y;
    use super::*;
    use rayon::prelude::*;
    use weavelight_calibration::description::Image;

    #[test]
    fn rows_in_any_order_make_the_same_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for (width, height) in [(1, 1), (5, 3), (300, 70), (7, 1), (1, 9)] {
            let data = (0..width * height).map(|i| (i as f32).sin() - 0.5).collect();
            let image = Image { width, height, data };
            write_exr_y(&path("whole.exr"), &image).unwrap();
            let rows = ExrRows::create(&path("rows.exr"), [width, height]).unwrap();
            let write = |y: usize| rows.write_row(y, image.row(y)).unwrap();
            (0..height).into_par_iter().rev().for_each(write);
            let read = |name: &str| std::fs::read(path(name)).unwrap();
            assert!(read("rows.exr") == read("whole.exr"), "{width} x {height}");
        }
    }

    #[test]
    fn a_folder_that_is_not_there_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let error = ExrRows::create(&folder.path().join("no/a.exr"), [2, 2]).unwrap_err();
        assert!(error.to_string().contains("a.exr"), "{error}");
    }
}
