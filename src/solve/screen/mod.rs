//! What is left out before a solve, and what is said of frames that contradict one another.

mod brightness;
mod copies;
mod dark;
mod drift;
mod idle;
mod witness;

pub(crate) use drift::drift_warnings;

use crate::solve::SolveError;
use crate::solve::scene::Scene;
use crate::solve::scene::check::check_frames;
use crate::solve::scene::checked::light_field;
use idle::leave_out_idle_frames;
use witness::question;

impl Scene {
    /// Leaves out frames that are copies of another or clip everywhere, and lights that stayed dark; warnings about these and
    /// about lights that contradict the others.
    ///
    /// # Errors
    /// As [`Scene::check`]; and where fewer than three lights remain, or an ambient frame is brighter than the lit ones.
    pub fn leave_out_what_adds_nothing(&mut self) -> Result<Vec<String>, SolveError> {
        check_frames(self)?;
        let mut warnings = leave_out_idle_frames(self)?;
        let verdict = question(self, &light_field(self)?);
        let mut position = 0;
        self.lights.retain(|_| {
            position += 1;
            !verdict.dark.contains(&(position - 1))
        });
        warnings.extend(verdict.warnings);
        Ok(warnings)
    }
}
