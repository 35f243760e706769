//! The one action that would improve a calibration most. The command line says it in these words; the window has its own.

use std::fmt;

/// What to do next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// Photograph the chessboard.
    Boards,
    /// Photograph it again: too few, or the camera fits them badly.
    BetterBoards,
    /// Photograph the chart.
    Chart,
    /// Photograph a chart whose colours are known.
    ColorChart,
    /// Photograph the white sheet.
    FlatSheet,
    /// Photograph it at several poses.
    MoreSheets,
    /// Photograph it once more, in the pose after which the lights' places would be known best.
    Sheet(SheetPose),
    /// Calibrate the lights again: the camera was calibrated after them.
    LightsAgain,
    /// Nothing is left to improve; verify it.
    Check,
}

/// How a white sheet is to lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SheetPose {
    /// On the table.
    Flat,
    /// Level, this high over it.
    Raised {
        /// Millimetres.
        mm: f64,
    },
    /// Facing a light.
    Tilted {
        /// Which.
        light: usize,
        /// By how much.
        deg: f64,
    },
}

impl fmt::Display for SheetPose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flat => f.write_str("flat on the table"),
            Self::Raised { mm } => write!(f, "raised by about {mm:.0} mm"),
            Self::Tilted { light, deg } => {
                write!(f, "tilted towards light {light} by about {deg:.0} degrees")
            }
        }
    }
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Boards => {
                "photograph the chessboard 12 to 16 times: once flat in the middle of the table, then tilted by 20 to 40 degrees in all directions and out to the corners; then `calibrate camera`"
            }
            Self::BetterBoards => {
                "photograph the chessboard again, sharp and whole, tilted by 20 to 40 degrees and out to the corners; then `calibrate camera`"
            }
            Self::Chart => {
                "photograph the grey or colour chart under every light, one light at several exposures, and once in the dark; then `calibrate color`"
            }
            Self::ColorChart => {
                "photograph a colour chart whose patches state lab_d50; then `calibrate color`"
            }
            Self::FlatSheet => {
                "photograph a white sheet flat on the table under every light, the brightest at 50 to 90 % of full scale; then `calibrate lights`"
            }
            Self::MoreSheets => {
                "photograph the white sheet also raised by 100 mm and tilted by 20 degrees in four directions"
            }
            Self::Sheet(pose) => {
                return write!(
                    f,
                    "photograph the white sheet {pose}, and give it to `calibrate lights` with the others"
                );
            }
            Self::LightsAgain => {
                "run `calibrate lights` again on the same white sheets: the camera was calibrated after them, and the lights still stand in its old frame"
            }
            Self::Check => {
                "nothing: verify with `calibrate check` on a tilted sheet that the fit has not seen"
            }
        })
    }
}
