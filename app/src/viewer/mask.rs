//! Painting what belongs to the swatch: brush and lasso, with every step undone and redone.

use std::ops::Range;
use std::sync::Arc;
use weavelight_calibration::description::Image;

/// Steps that can be undone.
pub(crate) const MOST_STEPS: usize = 100;

/// A mask that is being painted.
#[derive(Clone, Debug)]
pub struct Painting {
    mask: Image<bool>,
    undone: Vec<Step>,
    done: Vec<Step>,
    /// Counts changes, so that a drawing of it knows when to follow.
    pub version: u64,
    /// Whether it differs from what is on the disk.
    pub changed: bool,
    /// The change up to which unsaved strokes are kept.
    pub(crate) kept: u64,
    /// Pixels that are left out.
    left_out: usize,
}

/// What a step turned over: runs of pixels, row by row. Turned over again it is undone.
type Step = Vec<Range<usize>>;

impl Painting {
    /// Begins with a mask, or with everything inside.
    pub fn new(size: [usize; 2], mask: Option<&Arc<Image<bool>>>) -> Self {
        let fits = mask.filter(|mask| [mask.width, mask.height] == size);
        let mask = fits.map_or_else(|| Image::filled(size[0], size[1], true), |m| (**m).clone());
        let left_out = mask.data.iter().filter(|inside| !**inside).count();
        let (undone, done) = (Vec::new(), Vec::new());
        Self { mask, undone, done, version: 0, changed: false, kept: 0, left_out }
    }

    /// The mask.
    pub fn mask(&self) -> &Image<bool> {
        &self.mask
    }

    /// Whether everything is left out.
    pub fn is_empty(&self) -> bool {
        self.left_out == self.mask.data.len()
    }

    /// How many steps can be undone, and redone.
    pub(crate) fn steps(&self) -> [usize; 2] {
        [self.done.len(), self.undone.len()]
    }

    /// Another mask of the same size, as one step. True where that changes something.
    pub(crate) fn replace(&mut self, mask: &Image<bool>) -> bool {
        if [mask.width, mask.height] != [self.mask.width, self.mask.height] {
            return false;
        }
        let mut step = Step::new();
        for y in 0..mask.height {
            for (x, inside) in mask.row(y).iter().enumerate() {
                self.set(y, [x as f64, x as f64], *inside, &mut step);
            }
        }
        self.did(step)
    }

    /// Paints along a stroke (pixel coordinates) with a round brush. True where that changes something.
    pub fn brush(&mut self, stroke: &[[f64; 2]], radius_px: f64, inside: bool) -> bool {
        let mut step = Step::new();
        let dot = stroke.first().map(|at| [*at, *at]);
        let lines = stroke.windows(2).map(|ends| [ends[0], ends[1]]);
        for ends in dot.into_iter().chain(lines) {
            for y in self.rows(&ends, radius_px) {
                if let Some(across) = capsule_across(ends, radius_px, y as f64) {
                    self.set(y, across, inside, &mut step);
                }
            }
        }
        self.did(step)
    }

    /// Fills a closed line (pixel coordinates). True where that changes something.
    pub fn lasso(&mut self, line: &[[f64; 2]], inside: bool) -> bool {
        let mut step = Step::new();
        let rows = if line.len() > 2 { self.rows(line, 0.0) } else { 0..0 };
        for y in rows {
            let mut crossings = crossings(line, y as f64);
            crossings.sort_by(f64::total_cmp);
            for between in crossings.chunks_exact(2) {
                // A pixel right on the left edge is outside, on the right edge inside, as a ray to the left says.
                self.set(y, [between[0].floor() + 1.0, between[1]], inside, &mut step);
            }
        }
        self.did(step)
    }

    /// Everything inside, or nothing. True where that changes something.
    pub fn fill(&mut self, inside: bool) -> bool {
        let mut step = Step::new();
        for y in 0..self.mask.height {
            self.set(y, [0.0, self.mask.width as f64], inside, &mut step);
        }
        self.did(step)
    }

    /// Takes the last step back.
    pub fn undo(&mut self) {
        if let Some(step) = self.done.pop() {
            self.turn_over(&step);
            self.undone.push(step);
        }
    }

    /// Does it again.
    pub fn redo(&mut self) {
        if let Some(step) = self.undone.pop() {
            self.turn_over(&step);
            self.done.push(step);
        }
    }

    /// Rows of the picture that a line of some width touches.
    fn rows(&self, line: &[[f64; 2]], margin: f64) -> Range<usize> {
        let top = line.iter().map(|at| at[1]).fold(f64::INFINITY, f64::min) - margin;
        let bottom = line.iter().map(|at| at[1]).fold(f64::NEG_INFINITY, f64::max) + margin;
        pixels([top, bottom], self.mask.height)
    }

    /// Sets the pixels of a row between two places and notes which ones that changes.
    fn set(&mut self, y: usize, across: [f64; 2], inside: bool, step: &mut Step) {
        let start = y * self.mask.width;
        let columns = pixels(across, self.mask.width);
        for at in start + columns.start..start + columns.end {
            if self.mask.data[at] == inside {
                continue;
            }
            self.mask.data[at] = inside;
            self.left_out = if inside { self.left_out - 1 } else { self.left_out + 1 };
            match step.last_mut().filter(|run| run.end == at) {
                Some(run) => run.end += 1,
                None => step.push(at..at + 1),
            }
        }
    }

    fn did(&mut self, step: Step) -> bool {
        if step.is_empty() {
            return false;
        }
        self.done.push(step);
        self.undone.clear();
        if self.done.len() > MOST_STEPS {
            self.done.remove(0);
        }
        self.touch();
        true
    }

    fn turn_over(&mut self, step: &[Range<usize>]) {
        for run in step {
            let pixels = &mut self.mask.data[run.clone()];
            let were_out = pixels.iter().filter(|inside| !**inside).count();
            pixels.iter_mut().for_each(|pixel| *pixel = !*pixel);
            self.left_out = self.left_out + pixels.len() - 2 * were_out;
        }
        self.touch();
    }

    fn touch(&mut self) {
        self.version += 1;
        self.changed = true;
    }
}

/// Pixels from the first to the last place, both included, of a row or column of `length`.
fn pixels([from, to]: [f64; 2], length: usize) -> Range<usize> {
    let first = from.ceil().max(0.0) as usize;
    let end = ((to.floor() + 1.0).max(0.0) as usize).min(length);
    first.min(end)..end
}

/// From where to where a thick line with round ends lies on a row: it is convex, so that the outermost places of its two
/// discs and of the rectangle between them say it.
fn capsule_across([a, b]: [[f64; 2]; 2], radius: f64, y: f64) -> Option<[f64; 2]> {
    let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut take = |x: f64| (from, to) = (from.min(x), to.max(x));
    for [x, centre] in [a, b] {
        let half = (radius * radius - (y - centre) * (y - centre)).sqrt();
        if half.is_finite() {
            take(x - half);
            take(x + half);
        }
    }
    let length = (b[0] - a[0]).hypot(b[1] - a[1]);
    if length > 0.0 {
        let aside = [(a[1] - b[1]) / length * radius, (b[0] - a[0]) / length * radius];
        let corner = |at: [f64; 2], side: f64| [at[0] + side * aside[0], at[1] + side * aside[1]];
        let corners = [corner(a, 1.0), corner(b, 1.0), corner(b, -1.0), corner(a, -1.0)];
        crossings(&corners, y).into_iter().for_each(take);
    }
    (from <= to).then_some([from, to])
}

/// Where a closed line crosses a row; an even number of places.
fn crossings(line: &[[f64; 2]], y: f64) -> Vec<f64> {
    let next = line.iter().cycle().skip(1);
    let edges = line.iter().zip(next).filter(|(a, b)| (a[1] > y) != (b[1] > y));
    edges.map(|(a, b)| a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outside(painting: &Painting) -> usize {
        let counted = painting.mask().data.iter().filter(|inside| !**inside).count();
        assert_eq!(painting.left_out, counted);
        assert_eq!(painting.is_empty(), counted == painting.mask().data.len());
        counted
    }

    fn steps(painting: &Painting) -> [bool; 2] {
        [!painting.done.is_empty(), !painting.undone.is_empty()]
    }

    #[test]
    fn every_step_is_undone_and_redone() {
        let mut painting = Painting::new([40, 30], None);
        painting.brush(&[[10.0, 10.0]], 3.0, false);
        // The 29 points of the grid within 3 of one of its points.
        assert_eq!(outside(&painting), 29);
        painting.brush(&[[10.0, 10.0], [20.0, 10.0]], 3.0, false);
        assert_eq!(outside(&painting), 29 + 7 * 10);
        painting.lasso(&[[-5.0, -5.0], [60.0, -5.0], [60.0, 4.5], [-5.0, 4.5]], false);
        let most = outside(&painting);
        assert_eq!(most, 29 + 70 + 5 * 40);
        (0..5).for_each(|_| painting.undo());
        assert_eq!((outside(&painting), steps(&painting)), (0, [false, true]));
        (0..5).for_each(|_| painting.redo());
        assert_eq!((outside(&painting), steps(&painting)), (most, [true, false]));
        painting.undo();
        painting.fill(true);
        assert_eq!((outside(&painting), steps(&painting)), (0, [true, false]));
    }

    #[test]
    fn another_mask_is_one_step() {
        let mut other = Painting::new([40, 30], None);
        other.brush(&[[10.0, 10.0]], 3.0, false);
        let mut painting = Painting::new([40, 30], None);
        painting.fill(false);
        assert!(painting.replace(other.mask()));
        assert_eq!((outside(&painting), painting.steps()), (29, [2, 0]));
        painting.undo();
        assert_eq!((outside(&painting), painting.is_empty()), (40 * 30, true));
        painting.redo();
        assert!(!painting.replace(other.mask()), "the same");
        assert!(!painting.replace(&Image::filled(30, 40, true)), "of another size");
        assert_eq!(outside(&painting), 29);
    }

    /// Square of the distance from a point to a line of several points: the plain meaning of the brush.
    fn distance_squared(line: &[[f64; 2]], [x, y]: [f64; 2]) -> f64 {
        let to_segment = |a: [f64; 2], b: [f64; 2]| {
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let along = ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy);
            let t = if along.is_finite() { along.clamp(0.0, 1.0) } else { 0.0 };
            (x - a[0] - t * dx).powi(2) + (y - a[1] - t * dy).powi(2)
        };
        let first = line.first().map_or(f64::INFINITY, |a| to_segment(*a, *a));
        line.windows(2).map(|ends| to_segment(ends[0], ends[1])).fold(first, f64::min)
    }

    /// Whether a point lies inside a closed line: a ray to the left crosses it an odd number of times. The plain meaning of the
    /// lasso.
    fn is_within(line: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
        let next = line.iter().cycle().skip(1);
        let crosses = line.iter().zip(next).filter(|(a, b)| {
            (a[1] > y) != (b[1] > y) && x > a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        });
        crosses.count() % 2 == 1
    }

    #[test]
    fn rows_at_once_paint_what_pixel_by_pixel_does() {
        let check = |name: &str, painting: &Painting, within: &dyn Fn([f64; 2]) -> bool| {
            let width = painting.mask().width;
            for (k, inside) in painting.mask().data.iter().enumerate() {
                let at = [(k % width) as f64, (k / width) as f64];
                assert_eq!(*inside, !within(at), "{name}: {at:?}");
            }
        };
        for turn in 0..40 {
            // Places that no pixel's centre lies on, some of them outside; and one line that folds back.
            let place = |k: usize| {
                let spread = |step: f64, length: f64| {
                    ((turn * 8 + k) as f64 * step).fract() * (length + 20.37) - 10.13
                };
                [spread(0.618_034, 60.0), spread(0.754_878, 45.0)]
            };
            let line: Vec<[f64; 2]> = (0..turn % 7).map(place).chain([place(0)]).collect();
            let radius = 0.3 + turn as f64 * 0.27;
            let name = format!("{line:?}, radius {radius}");
            let mut painting = Painting::new([60, 45], None);
            painting.brush(&line, radius, false);
            check(&name, &painting, &|at| distance_squared(&line, at) <= radius * radius);
            let mut painting = Painting::new([60, 45], None);
            painting.lasso(&line, false);
            check(&name, &painting, &|at| line.len() > 2 && is_within(&line, at));
        }
    }

    #[test]
    fn strokes_beside_the_picture_change_nothing() {
        let mut painting = Painting::new([40, 30], None);
        assert!(!painting.brush(&[[-50.0, 10.0]], 3.0, false));
        assert!(!painting.lasso(&[[1.0, 1.0], [5.0, 5.0]], false));
        assert!(!painting.brush(&[], 3.0, false));
        assert!(!painting.fill(true));
        assert_eq!((outside(&painting), painting.changed), (0, false));
    }
}
