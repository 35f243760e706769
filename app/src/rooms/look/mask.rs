//! Painting what belongs to the swatch: brush and lasso, with every step undone and redone.

use std::sync::Arc;
use weavelight_calibration::description::Image;

/// Steps that can be undone.
const MOST_STEPS: usize = 100;

/// A mask that is being painted.
#[derive(Clone, Debug)]
pub struct Painting {
    mask: Image<bool>,
    undone: Vec<Step>,
    done: Vec<Step>,
    /// Counts changes, for whoever draws it.
    pub version: u64,
    /// Whether it differs from what is on the disk.
    pub changed: bool,
}

/// A rectangle as it was before.
#[derive(Clone, Debug)]
struct Step {
    left: usize,
    top: usize,
    width: usize,
    before: Vec<bool>,
}

impl Painting {
    /// Begins with a mask, or with everything inside.
    pub fn new(size: [usize; 2], mask: Option<&Arc<Image<bool>>>) -> Self {
        let fits = mask.filter(|mask| [mask.width, mask.height] == size);
        let mask = fits.map_or_else(|| Image::filled(size[0], size[1], true), |m| (**m).clone());
        Self { mask, undone: Vec::new(), done: Vec::new(), version: 0, changed: false }
    }

    /// The mask.
    pub fn mask(&self) -> &Image<bool> {
        &self.mask
    }

    /// Paints along a stroke (pixel coordinates) with a round brush.
    pub fn brush(&mut self, stroke: &[[f64; 2]], radius_px: f64, inside: bool) {
        let Some(bounds) = self.bounds(stroke, radius_px) else { return };
        let near = |x: usize, y: usize| {
            let at = [x as f64, y as f64];
            distance_squared(stroke, at) <= radius_px * radius_px
        };
        self.paint(bounds, near, inside);
    }

    /// Fills a closed line (pixel coordinates).
    pub fn lasso(&mut self, line: &[[f64; 2]], inside: bool) {
        let Some(bounds) = self.bounds(line, 0.0).filter(|_| line.len() > 2) else { return };
        self.paint(bounds, |x, y| is_within(line, [x as f64, y as f64]), inside);
    }

    /// Everything inside, or nothing.
    pub fn fill(&mut self, inside: bool) {
        let bounds = [0, 0, self.mask.width, self.mask.height];
        self.paint(bounds, |_, _| true, inside);
    }

    /// Whether something can be undone, and redone.
    pub fn steps(&self) -> [bool; 2] {
        [!self.done.is_empty(), !self.undone.is_empty()]
    }

    /// Takes the last step back.
    pub fn undo(&mut self) {
        if let Some(step) = self.done.pop() {
            let back = self.exchange(step);
            self.undone.push(back);
        }
    }

    /// Does it again.
    pub fn redo(&mut self) {
        if let Some(step) = self.undone.pop() {
            let back = self.exchange(step);
            self.done.push(back);
        }
    }

    /// Left, top, width and height of what a line touches; `None` outside the picture.
    fn bounds(&self, line: &[[f64; 2]], margin: f64) -> Option<[usize; 4]> {
        let range = |axis: usize, length: usize| {
            let of_axis = || line.iter().map(|at| at[axis]);
            let from = of_axis().fold(f64::INFINITY, f64::min) - margin;
            let to = of_axis().fold(f64::NEG_INFINITY, f64::max) + margin;
            let first = from.floor().max(0.0) as usize;
            let end = ((to.ceil() + 1.0).max(0.0) as usize).min(length);
            (first < end).then(|| (first, end - first))
        };
        let ((left, width), (top, height)) =
            (range(0, self.mask.width)?, range(1, self.mask.height)?);
        Some([left, top, width, height])
    }

    fn paint(
        &mut self,
        [left, top, width, height]: [usize; 4],
        touched: impl Fn(usize, usize) -> bool,
        inside: bool,
    ) {
        let mut before = Vec::with_capacity(width * height);
        let mut changed = false;
        for y in top..top + height {
            let row = &mut self.mask.data[y * self.mask.width + left..][..width];
            before.extend_from_slice(row);
            for (k, pixel) in row.iter_mut().enumerate() {
                if *pixel != inside && touched(left + k, y) {
                    *pixel = inside;
                    changed = true;
                }
            }
        }
        if changed {
            self.done.push(Step { left, top, width, before });
            self.undone.clear();
            if self.done.len() > MOST_STEPS {
                self.done.remove(0);
            }
            self.touch();
        }
    }

    fn exchange(&mut self, mut step: Step) -> Step {
        for (k, row) in step.before.chunks_mut(step.width).enumerate() {
            let at = (step.top + k) * self.mask.width + step.left;
            self.mask.data[at..at + step.width].swap_with_slice(row);
        }
        self.touch();
        step
    }

    fn touch(&mut self) {
        self.version += 1;
        self.changed = true;
    }
}

/// Square of the distance from a point to a line of several points.
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

/// Whether a point lies inside a closed line: a ray to the left crosses it an odd number of times.
fn is_within(line: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let next = line.iter().cycle().skip(1);
    let crosses = line.iter().zip(next).filter(|(a, b)| {
        (a[1] > y) != (b[1] > y) && x > a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
    });
    crosses.count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outside(painting: &Painting) -> usize {
        painting.mask().data.iter().filter(|inside| !**inside).count()
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
        assert_eq!((outside(&painting), painting.steps()), (0, [false, true]));
        (0..5).for_each(|_| painting.redo());
        assert_eq!((outside(&painting), painting.steps()), (most, [true, false]));
        painting.undo();
        painting.fill(true);
        assert_eq!((outside(&painting), painting.steps()), (0, [true, false]));
    }

    #[test]
    fn strokes_beside_the_picture_change_nothing() {
        let mut painting = Painting::new([40, 30], None);
        painting.brush(&[[-50.0, 10.0]], 3.0, false);
        painting.lasso(&[[1.0, 1.0], [5.0, 5.0]], false);
        painting.brush(&[], 3.0, false);
        assert_eq!((outside(&painting), painting.changed), (0, false));
    }
}
