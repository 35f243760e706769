//! A picture of any size at every scale, in pieces small enough to be handed to the graphics card while the mouse moves.

use half::f16;
use rayon::prelude::*;
use std::sync::Arc;

/// Four half-precision numbers.
pub type Texel = [f16; 4];

/// Texels along a tile's side.
pub(super) const TILE: usize = 256;
/// Texels of the neighbours around a tile, so that a filter never meets its edge.
pub(super) const BORDER: usize = 1;
/// Texels along the side of a tile with its border.
pub(super) const SLOT: usize = TILE + 2 * BORDER;

/// A picture at full size and at halves of it, down to one tile.
#[derive(Debug)]
pub struct Pyramid {
    levels: Vec<Level>,
}

/// One scale.
#[derive(Debug)]
struct Level {
    width: usize,
    height: usize,
    texels: Vec<Texel>,
}

/// A tile's place: level 0 is full size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Place {
    pub(super) level: usize,
    pub(super) x: usize,
    pub(super) y: usize,
}

impl Place {
    /// The tile of the next coarser level that covers this one.
    pub(super) fn parent(self) -> Self {
        Self { level: self.level + 1, x: self.x / 2, y: self.y / 2 }
    }
}

impl Pyramid {
    /// A picture of `width` x `height` pixels. `value` says what is at a pixel, weighted with how much of the pixel it covers;
    /// a coarser level has the mean of what it covers, so that holes do not darken their surroundings. `encode` makes texels.
    pub fn new<const N: usize>(
        [width, height]: [usize; 2],
        value: &(impl Fn(usize, usize) -> [f32; N] + Sync),
        encode: fn([f32; N]) -> Texel,
    ) -> Arc<Self> {
        let mut levels = vec![level([width, height], &|x, y| value(x, y), encode)];
        let mut finer = ([width, height], Vec::new());
        while finer.0.iter().any(|length| *length > TILE) {
            let [w, h] = finer.0;
            let coarser = [w.div_ceil(2), h.div_ceil(2)];
            let of_finer = |x: usize, y: usize| match finer.1.is_empty() {
                true => value(x, y),
                false => finer.1[y * w + x],
            };
            let mut means = vec![[0.0; N]; coarser[0] * coarser[1]];
            means.par_chunks_mut(coarser[0]).enumerate().for_each(|(y, row)| {
                row.iter_mut().enumerate().for_each(|(x, m)| *m = mean(&of_finer, [w, h], x, y));
            });
            levels.push(level(coarser, &|x, y| means[y * coarser[0] + x], encode));
            finer = (coarser, means);
        }
        Arc::new(Self { levels })
    }

    /// Pixels across and down.
    pub fn size(&self) -> [usize; 2] {
        [self.levels[0].width, self.levels[0].height]
    }

    /// Halvings down to one tile.
    pub(super) fn coarsest(&self) -> usize {
        self.levels.len() - 1
    }

    /// Tiles across and down at a level.
    pub(super) fn tiles(&self, level: usize) -> [usize; 2] {
        let level = &self.levels[level];
        [level.width.div_ceil(TILE), level.height.div_ceil(TILE)]
    }

    /// The texel of a pixel at full size; `None` outside.
    pub fn texel(&self, x: usize, y: usize) -> Option<Texel> {
        let full = &self.levels[0];
        (x < full.width && y < full.height).then(|| full.texels[y * full.width + x])
    }

    /// Copies a tile with its border, [`SLOT`] x [`SLOT`] texels; what is beyond the picture repeats its edge.
    pub(super) fn cut(&self, place: Place, to: &mut Vec<Texel>) {
        let Level { width, height, texels } = &self.levels[place.level];
        let (left, top) = (place.x * TILE, place.y * TILE);
        let inside = |at: usize, length: usize| at.saturating_sub(BORDER).min(length - 1);
        to.clear();
        for row in 0..SLOT {
            let row = &texels[inside(top + row, *height) * width..][..*width];
            let first = inside(left, *width);
            let last = (left + SLOT - BORDER).min(*width);
            if left == 0 {
                to.push(row[0]);
            }
            to.extend_from_slice(&row[first..last]);
            let missing = to.len().next_multiple_of(SLOT) - to.len();
            to.extend(std::iter::repeat_n(row[last - 1], missing));
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|level| size_of_val(level.texels.as_slice())).sum()
    }
}

fn level<const N: usize>(
    [width, height]: [usize; 2],
    value: &(impl Fn(usize, usize) -> [f32; N] + Sync),
    encode: fn([f32; N]) -> Texel,
) -> Level {
    let mut texels = vec![[f16::ZERO; 4]; width * height];
    texels.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        row.iter_mut().enumerate().for_each(|(x, texel)| *texel = encode(value(x, y)));
    });
    Level { width, height, texels }
}

/// The mean of the up to four pixels under one of the next coarser level.
fn mean<const N: usize>(
    of_finer: &impl Fn(usize, usize) -> [f32; N],
    [width, height]: [usize; 2],
    x: usize,
    y: usize,
) -> [f32; N] {
    let (mut sum, mut count) = ([0.0; N], 0.0);
    for y in 2 * y..(2 * y + 2).min(height) {
        for x in 2 * x..(2 * x + 2).min(width) {
            sum.iter_mut().zip(of_finer(x, y)).for_each(|(sum, value)| *sum += value);
            count += 1.0;
        }
    }
    sum.map(|sum| sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(value: [f32; 4]) -> Texel {
        value.map(f16::from_f32)
    }

    #[test]
    fn every_level_has_the_mean_of_what_it_covers() {
        let pyramid = Pyramid::new([601, 300], &|x, _| [x as f32, 1.0, 0.0, 0.0], plain);
        assert_eq!((pyramid.coarsest(), pyramid.tiles(0), pyramid.tiles(2)), (2, [3, 2], [1, 1]));
        let at = |level: usize, x: usize| pyramid.levels[level].texels[x][0].to_f32();
        assert_eq!((at(1, 0), at(1, 100), at(2, 10)), (0.5, 200.5, 41.5));
        // The last column stands alone.
        assert_eq!(at(1, 300), 600.0);
        assert!(pyramid.levels.iter().flat_map(|l| &l.texels).all(|t| t[1] == f16::ONE));
    }

    #[test]
    fn tiles_carry_their_neighbours_and_repeat_the_edge() {
        let check = |size: [usize; 2], place: [usize; 2], texel: [usize; 2], expected: [f32; 2]| {
            let pyramid = Pyramid::new(size, &|x, y| [x as f32, y as f32, 0.0, 0.0], plain);
            let mut tile = Vec::new();
            pyramid.cut(Place { level: 0, x: place[0], y: place[1] }, &mut tile);
            assert_eq!(tile.len(), SLOT * SLOT, "{size:?} {place:?}");
            let found = tile[texel[1] * SLOT + texel[0]];
            assert_eq!([found[0].to_f32(), found[1].to_f32()], expected, "{size:?} {place:?}");
        };
        check([300, 270], [0, 0], [0, 0], [0.0, 0.0]);
        check([300, 270], [0, 0], [1, 1], [0.0, 0.0]);
        check([300, 270], [0, 0], [257, 257], [256.0, 256.0]);
        check([300, 270], [1, 1], [0, 0], [255.0, 255.0]);
        check([300, 270], [1, 1], [44, 14], [299.0, 269.0]);
        check([300, 270], [1, 1], [257, 257], [299.0, 269.0]);
        check([1, 1], [0, 0], [200, 100], [0.0, 0.0]);
    }
}
