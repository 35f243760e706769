use crate::session::Encoding;
use std::path::PathBuf;
use weavelight_calibration::description::Cfa;

/// What to import.
#[derive(Clone, Debug)]
pub struct Options {
    /// List of light directions: `.lp`, or one direction a line.
    pub lights: PathBuf,
    /// The pictures; may be empty where the list names them.
    pub images: Vec<PathBuf>,
    /// The capture session to write.
    pub out: PathBuf,
    /// How the pictures encode light; 8-bit pictures must say.
    pub encoding: Option<Encoding>,
    /// The mosaic of pictures that are a colour sensor's samples and do not say so.
    pub cfa: Option<Cfa>,
    /// Whether all pictures count as equally exposed, whatever their files state: for sets that were normalised already.
    pub same_exposure: bool,
    /// A picture that is not 0 where the object is.
    pub mask: Option<PathBuf>,
}
