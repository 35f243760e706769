//! How finely a view is drawn while something is dragged: where a frame takes too long, at half resolution, so that the lamp
//! keeps up with the hand; at full resolution again when it is let go.

/// A frame that takes longer lags visibly behind the hand, seconds.
const TOO_SLOW_S: f32 = 1.0 / 25.0;
/// So many slow frames in a row are no accident.
const IN_A_ROW: u32 = 2;

/// What is known of the renderer's speed.
#[derive(Clone, Debug, Default)]
pub(super) struct Pace {
    /// Full frames are too slow.
    slow: bool,
    slow_frames: u32,
    /// The last frame was followed by this one at once, so that the time between them is the time that a frame takes.
    timed: bool,
    /// Pixels of the view when it was measured.
    pixels: f32,
}

/// How this frame is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Drawn {
    pub(super) coarse: bool,
    /// Another frame is wanted right after it, to measure the time.
    pub(super) again: bool,
}

impl Pace {
    /// The next frame, `dt_s` seconds after the last one, of a view of so many pixels. `dragged`: something is being dragged;
    /// `moved`: the mouse has moved since.
    pub(super) fn next(&mut self, (dragged, moved): (bool, bool), dt_s: f32, pixels: f32) -> Drawn {
        // Another size is another renderer.
        if (self.pixels / pixels.max(1.0) - 1.0).abs() > 0.2 {
            *self = Self { pixels, ..Self::default() };
        }
        if dragged && self.timed {
            self.slow_frames = if dt_s > TOO_SLOW_S { self.slow_frames + 1 } else { 0 };
            self.slow |= self.slow_frames >= IN_A_ROW;
        }
        self.timed = dragged && moved;
        Drawn { coarse: dragged && self.slow, again: self.timed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEW: f32 = 800_000.0;
    const DRAG: (bool, bool) = (true, true);
    const HOLD: (bool, bool) = (true, false);

    fn coarse(pace: &mut Pace, frames: &[((bool, bool), f32)]) -> Vec<bool> {
        frames.iter().map(|(hand, dt_s)| pace.next(*hand, *dt_s, VIEW).coarse).collect()
    }

    #[test]
    fn slow_frames_are_drawn_coarsely_until_the_hand_lets_go() {
        let mut pace = Pace::default();
        let slow = [(DRAG, 0.2), (DRAG, 0.1), (DRAG, 0.1), (DRAG, 0.02), (HOLD, 0.02)];
        assert_eq!(coarse(&mut pace, &slow), [false, false, true, true, true]);
        assert_eq!(coarse(&mut pace, &[((false, false), 0.02)]), [false]);
        // The next drag knows.
        assert_eq!(coarse(&mut pace, &[(DRAG, 0.5)]), [true]);
        // A smaller view is measured again.
        assert!(!pace.next(DRAG, 0.02, VIEW / 4.0).coarse);
    }

    #[test]
    fn a_hand_that_rests_is_no_slow_renderer() {
        let mut pace = Pace::default();
        let calm =
            [(DRAG, 0.02), (HOLD, 0.015), (DRAG, 2.0), (HOLD, 0.015), (DRAG, 3.0), (DRAG, 0.015)];
        assert_eq!(coarse(&mut pace, &calm), [false; 6]);
        assert!(pace.next(DRAG, 0.015, VIEW).again && !pace.next(HOLD, 0.015, VIEW).again);
    }
}
