/// What a run is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Reading and decoding frames; counted in frames.
    Read,
    /// Solving; counted in rows.
    Solve,
    /// Finding the hidden channels of the albedo, undoing the distortion.
    Colour,
    /// Encoding and writing files; counted in files.
    Write,
    /// Making the page; not counted.
    Page,
}

impl Stage {
    /// The stage's key in `report.json`'s `seconds`.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Read => "read",
            Stage::Solve => "solve",
            Stage::Colour => "colour",
            Stage::Write => "write",
            Stage::Page => "page",
        }
    }
}

/// How far a run is. Told from several threads at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// What is being done.
    pub stage: Stage,
    /// Steps finished.
    pub done: usize,
    /// Steps in all.
    pub total: usize,
}
