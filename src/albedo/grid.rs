//! The picture in cells of about equal size, and windows of two by two cells that overlap by half.

use std::ops::Range;

/// One axis: bounds of the cells, and the nodes between which windows are blended.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    bounds: Vec<usize>,
}

/// Places with the same two windows, and how they are blended there.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Span {
    /// Columns or rows.
    pub(super) places: Range<usize>,
    /// The windows before and after.
    pub(super) nodes: [usize; 2],
    /// Share of the second window at the first place.
    pub(super) first: f32,
    /// By how much that share grows from place to place.
    pub(super) step: f32,
}

impl Axis {
    /// `length` places in cells of about `cell`, never smaller unless the axis is.
    pub(super) fn new(length: usize, cell: usize) -> Self {
        let cells = (length / cell.max(1)).max(1);
        Self { bounds: (0..=cells).map(|k| k * length / cells).collect() }
    }

    pub(super) fn cells(&self) -> usize {
        self.bounds.len() - 1
    }

    pub(super) fn cell(&self, k: usize) -> Range<usize> {
        self.bounds[k]..self.bounds[k + 1]
    }

    /// How many windows there are.
    pub(super) fn nodes(&self) -> usize {
        (self.cells() - 1).max(1)
    }

    /// The cells of a window.
    pub(super) fn cells_of(&self, node: usize) -> Range<usize> {
        node..(node + 2).min(self.cells())
    }

    /// The places of a window.
    pub(super) fn window(&self, node: usize) -> Range<usize> {
        let cells = self.cells_of(node);
        self.bounds[cells.start]..self.bounds[cells.end]
    }

    /// The windows that share a place with `places`.
    pub(super) fn windows_around(&self, places: &Range<usize>) -> Range<usize> {
        let last = places.end.max(places.start + 1) - 1;
        self.between(places.start).0[0]..self.between(last).0[1] + 1
    }

    /// The window whose middle is nearest.
    pub(super) fn nearest(&self, place: usize) -> usize {
        let (before, share) = self.between(place);
        if share < 0.5 { before[0] } else { before[1] }
    }

    /// The two windows around a place and the share of the second.
    pub(super) fn between(&self, place: usize) -> ([usize; 2], f32) {
        let last = self.nodes() - 1;
        let after = self.bounds[1..self.cells().max(2)].partition_point(|&b| b <= place);
        if self.cells() == 1 || after == 0 {
            return ([0, 0], 0.0);
        }
        if after > last {
            return ([last, last], 0.0);
        }
        let [start, end] = [self.bounds[after], self.bounds[after + 1]];
        ([after - 1, after], (place as f32 + 0.5 - start as f32) / (end - start) as f32)
    }

    /// The whole axis in spans of at most `longest` places.
    pub(super) fn spans(&self, longest: usize) -> Vec<Span> {
        let mut spans = Vec::new();
        let mut start = 0;
        let length = self.bounds[self.cells()];
        while start < length {
            let (nodes, first) = self.between(start);
            let ends = self.bounds.iter().copied().find(|&b| b > start).unwrap_or(length);
            let end = ends.min(start + longest);
            let step = match nodes[0] == nodes[1] {
                true => 0.0,
                false => 1.0 / (self.bounds[nodes[1] + 1] - self.bounds[nodes[1]]) as f32,
            };
            spans.push(Span { places: start..end, nodes, first, step });
            start = end;
        }
        spans
    }
}

/// Both axes.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub(super) x: Axis,
    pub(super) y: Axis,
}

impl Grid {
    pub(super) fn new([width, height]: [usize; 2], cell: usize) -> Self {
        Self { x: Axis::new(width, cell), y: Axis::new(height, cell) }
    }

    pub(super) fn nodes(&self) -> usize {
        self.x.nodes() * self.y.nodes()
    }

    /// Column and row of a window.
    pub(super) fn place_of(&self, node: usize) -> [usize; 2] {
        [node % self.x.nodes(), node / self.x.nodes()]
    }

    /// Blends one value a window at a place.
    pub(super) fn blend(&self, values: &[f32], [x, y]: [usize; 2]) -> f32 {
        let ([left, right], u) = self.x.between(x);
        let ([top, bottom], v) = self.y.between(y);
        let columns = self.x.nodes();
        let along = |row: usize| {
            let (a, b) = (values[row * columns + left], values[row * columns + right]);
            a + (b - a) * u
        };
        let (a, b) = (along(top), along(bottom));
        a + (b - a) * v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_overlap_by_half_and_cover_every_place() {
        for (length, cell) in [(1848, 256), (100, 256), (512, 256), (513, 32), (1, 8)] {
            let axis = Axis::new(length, cell);
            let last = axis.nodes() - 1;
            assert_eq!((axis.window(0).start, axis.window(last).end), (0, length));
            let spans = axis.spans(64);
            assert_eq!(spans.iter().map(|span| span.places.len()).sum::<usize>(), length);
            for span in spans {
                for (k, place) in span.places.clone().enumerate() {
                    let (nodes, share) = axis.between(place);
                    assert_eq!(nodes, span.nodes, "{length} {cell} {place}");
                    let found = span.first + span.step * k as f32;
                    assert!((share - found).abs() < 1e-4 && (0.0..=1.0).contains(&share));
                    assert!(nodes.iter().all(|&node| axis.window(node).contains(&place)));
                }
            }
        }
    }

    #[test]
    fn blending_is_continuous() {
        let grid = Grid::new([640, 512], 128);
        let values: Vec<f32> = (0..grid.nodes()).map(|k| (k * k % 7) as f32).collect();
        let mut before = grid.blend(&values, [0, 200]);
        for x in 1..640 {
            let now = grid.blend(&values, [x, 200]);
            assert!((now - before).abs() < 0.06, "{x}: {before}, {now}");
            before = now;
        }
    }
}
