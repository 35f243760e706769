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

    /// What is being done, for people.
    pub fn what(self) -> &'static str {
        match self {
            Stage::Read => "reading frames",
            Stage::Solve => "solving",
            Stage::Colour => "finding colours",
            Stage::Write => "writing maps",
            Stage::Page => "writing the page",
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

impl Progress {
    /// The share of the whole run that is done, 0 to 1; the stages' lengths are about those of a full-size run.
    pub fn share(&self) -> f64 {
        let (start, length) = match self.stage {
            Stage::Read => (0.0, 0.3),
            Stage::Solve => (0.3, 0.4),
            Stage::Colour => (0.7, 0.1),
            Stage::Write => (0.8, 0.15),
            Stage::Page => (0.95, 0.05),
        };
        start + length * self.done as f64 / self.total.max(1) as f64
    }
}
