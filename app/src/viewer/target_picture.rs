//! What the camera saw, and what was found in it.

use crate::ui::theme::meaning;
use crate::viewer::picture::test_shot;
use eframe::egui;
use eframe::egui::{Color32, ColorImage, Pos2, Rect, Stroke, vec2};
use weavelight::raw::Frame;

/// A picture with what was found.
#[derive(Debug)]
pub struct Picture {
    /// Small enough for the screen.
    pub image: ColorImage,
    /// Width and height of the frame itself.
    pub size_px: [usize; 2],
    /// What was found, in the frame's pixels.
    pub marks: Marks,
    /// What to know of it, as a sentence.
    pub note: String,
    /// Whether it serves.
    pub good: bool,
}

/// What was found in a picture, pixels of the frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Marks {
    /// Nothing.
    None,
    /// Inner corners of a board, row by row.
    Corners {
        /// Where.
        px: Vec<[f64; 2]>,
        /// How many make a row.
        columns: usize,
    },
    /// Patches of a chart: u0, v0, u1, v1.
    Patches(Vec<[f64; 4]>),
    /// Cells of a sheet that are measured.
    Cells {
        /// Their middles.
        px: Vec<[f64; 2]>,
        /// Their side.
        side_px: f64,
    },
}

/// Longest side on the screen, pixels.
const SHOWN: usize = 1200;

impl Picture {
    /// Of a frame.
    pub(crate) fn new(frame: &Frame, marks: Marks, note: String, good: bool) -> Self {
        let image = test_shot(frame, SHOWN, false);
        Self { image, size_px: [frame.width, frame.height], marks, note, good }
    }
}

/// Where a pixel of a frame of this size lies in `rect`.
fn place(rect: Rect, [width, height]: [usize; 2], [u, v]: [f64; 2]) -> Pos2 {
    let share = vec2((u + 0.5) as f32 / width as f32, (v + 0.5) as f32 / height as f32);
    rect.min + share * rect.size()
}

impl Marks {
    /// Draws them over a picture that fills `rect`.
    pub(crate) fn paint(&self, painter: &egui::Painter, rect: Rect, size_px: [usize; 2]) {
        let at = |px: [f64; 2]| place(rect, size_px, px);
        match self {
            Marks::None => {}
            Marks::Corners { px, columns } => {
                for row in px.chunks((*columns).max(1)) {
                    let line: Vec<Pos2> = row.iter().map(|corner| at(*corner)).collect();
                    painter.line(line, Stroke::new(1.5, meaning::ACTIVE));
                }
                for corner in px {
                    painter.circle(
                        at(*corner),
                        3.5,
                        meaning::LIT,
                        Stroke::new(1.0, Color32::BLACK),
                    );
                }
            }
            Marks::Patches(rects) => {
                for [u0, v0, u1, v1] in rects {
                    let patch = Rect::from_two_pos(at([*u0, *v0]), at([*u1, *v1]));
                    outline(painter, patch);
                }
            }
            Marks::Cells { px, side_px } => {
                let side = (*side_px / size_px[0] as f64) as f32 * rect.width();
                let fill = meaning::ACTIVE.gamma_multiply(0.28);
                for cell in px {
                    let square = Rect::from_center_size(at(*cell), vec2(side, side));
                    painter.rect_filled(square.shrink(0.7), 0.0, fill);
                }
            }
        }
    }
}

fn outline(painter: &egui::Painter, rect: Rect) {
    for (width, color) in [(3.5, Color32::BLACK), (1.5, meaning::LIT)] {
        painter.rect_stroke(rect, 0.0, Stroke::new(width, color), egui::StrokeKind::Middle);
    }
}

/// The corners of all earlier pictures, faintly.
pub(crate) fn paint_earlier(
    painter: &egui::Painter,
    rect: Rect,
    size_px: [usize; 2],
    corners: &[[f64; 2]],
) {
    for corner in corners {
        let dot = place(rect, size_px, *corner);
        painter.circle_filled(dot, 1.5, meaning::GOOD.gamma_multiply(0.8));
    }
}
