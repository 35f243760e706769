//! A piece of cloth under the reference rig, small enough for a test and at the size of a pixel that a real scan has.

use std::path::{Path, PathBuf};
use weavelight::simulate::{self, Flaws, Material, Part};
use weavelight::solve::Scene;
use weavelight_sim::rig::REFERENCE_LIGHTS_MM;

/// Lights of the reference rig.
pub(crate) const LIGHTS: usize = REFERENCE_LIGHTS_MM.len();

/// What of the table the camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Field {
    /// A small piece, 0.083 mm a pixel, as a full-size frame has it.
    Close,
    /// All that the reference camera sees, in large pixels.
    Whole,
}

/// A simulated scan on disk.
pub(crate) struct Scan {
    folder: tempfile::TempDir,
}

impl Scan {
    /// Photographs a swatch; `change` has the last word on the options.
    pub(crate) fn new(
        field: Field,
        [width, height]: [usize; 2],
        material: Material,
        change: impl Fn(&mut simulate::Options),
    ) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let rig = folder.path().join("close.toml");
        write_close_rig(&rig, [width, height]);
        let mut options = simulate::Options {
            out: folder.path().join("rig"),
            rig: (field == Field::Close).then_some(rig),
            size_px: (field == Field::Whole).then_some([width, height]),
            only: vec![Part::Swatch],
            material,
            flaws: Flaws { psf_px: 0.0, ..Flaws::default() },
            ..simulate::Options::default()
        };
        change(&mut options);
        simulate::run(&options, &|_, _| {}).unwrap();
        Self { folder }
    }

    /// The folder that `simulate` wrote.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join("rig").join(name)
    }

    /// The scan in memory, as a solve sees it, with the warnings.
    pub(crate) fn load(&self) -> (Scene, Vec<String>) {
        Scene::load(&self.path("swatch"), &self.path("calibration")).unwrap()
    }
}

/// The reference rig with a camera that sees a small piece of the table, at the reference's size of a pixel.
fn write_close_rig(path: &Path, [width, height]: [usize; 2]) {
    let mut text = format!(
        "schema = 1\nname = \"close\"\n\n[camera]\nkind = \"simulated\"\nmodel = \"Nikon D5100\"\nwidth_px = {width}\n\
         height_px = {height}\nfocal_length_mm = 35.0\npixel_pitch_um = 4.78\nheight_mm = 610.0\n"
    );
    for position in REFERENCE_LIGHTS_MM {
        text += &format!("\n[[lights]]\nposition_mm = {position:?}\n");
    }
    std::fs::write(path, text).unwrap();
}
