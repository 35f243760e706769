//! The frames that the Look room asked about last.

use crate::jobs::look::capture::Sources;
use weavelight::solve::Scene;

/// The frames that were looked at last, decoded.
#[derive(Debug, Default)]
pub struct Frames {
    pub(crate) sources: Sources,
    pub(crate) scene: Option<Box<Scene>>,
}
