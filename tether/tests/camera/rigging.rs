//! A fake camera, and the program's end of the tether.

use crate::fake::{FakeCamera, Scene, Still};
use std::path::Path;
use std::time::Duration;
use weavelight::device::camera::tethered::{Tether, TetheredCamera};
use weavelight::device::camera::{Applied, Camera, CameraError, Settings, Shutter};

/// Long enough to be an exposure, short enough for a test.
pub(crate) const SETTINGS: Settings = Settings { exposure_s: 0.02, iso: 100.0 };

/// As the program reaches a camera, but with less patience.
pub(crate) fn tether_to(camera: &FakeCamera, home: &Path) -> Tether {
    Tether {
        helper: Path::new(env!("CARGO_BIN_EXE_weavelight-tether")).to_owned(),
        home: home.to_owned(),
        patience: Duration::from_secs(20),
        picture_within: Duration::from_secs(1),
        ..Tether::new(Some(camera.port()))
    }
}

/// A camera, a folder for frames, and one in place of the user's home.
pub(crate) struct Bench {
    pub(crate) camera: FakeCamera,
    folder: tempfile::TempDir,
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self::with(Still(b"a picture, as far as anybody here can tell".to_vec()))
    }

    pub(crate) fn with(scene: impl Scene + 'static) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("frames")).unwrap();
        Self { camera: FakeCamera::start(scene), folder }
    }

    pub(crate) fn frames(&self) -> std::path::PathBuf {
        self.folder.path().join("frames")
    }

    pub(crate) fn home(&self) -> std::path::PathBuf {
        self.folder.path().join("home")
    }

    pub(crate) fn tether(&self) -> Tether {
        tether_to(&self.camera, &self.home())
    }

    pub(crate) fn open(&self) -> Result<TetheredCamera, CameraError> {
        TetheredCamera::open(self.tether())
    }

    /// Opened and set up.
    pub(crate) fn ready(&self) -> TetheredCamera {
        let mut camera = self.open().unwrap();
        assert_eq!(camera.configure(SETTINGS).unwrap(), Applied::Set(SETTINGS));
        camera
    }

    /// Takes a frame and reads it.
    pub(crate) fn shoot(&self, camera: &mut TetheredCamera) -> Result<Vec<u8>, CameraError> {
        self.shoot_and_tell(camera, &mut ())
    }

    pub(crate) fn shoot_and_tell(
        &self,
        camera: &mut TetheredCamera,
        shutter: &mut dyn Shutter,
    ) -> Result<Vec<u8>, CameraError> {
        let file = camera.capture(&self.frames(), shutter)?;
        assert_eq!(file.parent().unwrap(), self.frames());
        Ok(std::fs::read(file).unwrap())
    }

    /// Names in the frames' folder.
    pub(crate) fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.frames()).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}
