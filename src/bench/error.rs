use crate::compare::CompareError;
use crate::files::FileError;
use crate::simulate::SimulateError;
use crate::solve::SolveError;
use std::path::PathBuf;

/// What goes wrong with a benchmark.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// The output folder, or a temporary one.
    #[error(transparent)]
    File(#[from] FileError),
    /// A simulated fabric.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// A capture session or its solve.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A truth that cannot be read.
    #[error(transparent)]
    Truth(#[from] CompareError),
    /// A truth of another size than the frames.
    #[error("{}: is {} x {}, but the frames are {} x {}; give the true normals of these frames", .path.display(), .truth[0], .truth[1], .frames[0], .frames[1])]
    Size {
        /// The truth.
        path: PathBuf,
        /// Its width and height.
        truth: [usize; 2],
        /// The frames' width and height.
        frames: [usize; 2],
    },
    /// A truth that says nothing where there is something to solve.
    #[error(
        "set {set}: no photosite inside the mask has a true normal; check that truth and capture session belong together"
    )]
    Nothing {
        /// The set.
        set: String,
    },
}
