//! Where the swatch is, found from the frames: a table around it is smooth, of one colour, shows in the corners of the frame,
//! and ends where the cloth begins. Wherever that cannot be told, everything counts as swatch: a little table costs time,
//! a lost thread costs the scan.

mod blocks;
mod region;

use crate::photometry::Maps;
use crate::solution::Scale;
use blocks::{Block, block_grid};
use region::{closed, dilated, flood, with_holes_filled, without_specks};
use std::path::PathBuf;
use weavelight_calibration::description::Image;

/// Where the swatch is: the table around it is not solved.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum MaskChoice {
    /// In the capture session's own mask; everywhere if it has none.
    #[default]
    OfSession,
    /// Everywhere.
    Everything,
    /// Where it is found in the frames; everywhere if it cannot be told from the table.
    Found,
    /// In a picture of the frames' size, where it is not black.
    File(PathBuf),
}

/// Photosites along the side of a block, over which roughness is taken.
const BLOCK_PX: usize = 8;
/// Fewer blocks than this along a side and nothing can be told.
const LEAST_BLOCKS: usize = 12;
/// A corner's patch, as a share of the frame's shorter side.
const CORNER: f64 = 0.06;
/// A rougher corner (RMS of the normals within a block) is no table.
const SMOOTH_DEG: f64 = 4.0;
/// A corner whose blocks lean more differently than this (median) is no table.
const LEVEL_DEG: f64 = 2.0;
/// A corner that leans more against the plane of the swatch is no table.
const ALONG_DEG: f64 = 15.0;
/// Corners of one table differ at most by this: lean, and albedo in octaves.
const SAME_LEAN_DEG: f64 = 6.0;
const SAME_OCTAVES: f64 = 0.4;
/// Blocks of the table differ from it at least by this before they count as something else.
const LEAST_LEAN_DEG: f64 = 4.0;
const LEAST_OCTAVES: f64 = 0.2;
const LEAST_ROUGHNESS_DEG: f64 = 1.0;
/// ... and at least by this multiple of what is usual in the corners.
const SPREADS: f64 = 6.0;
/// Gaps in the cloth are closed up to twice this, blocks.
const CLOSING: usize = 3;
/// What stands out alone in fewer blocks is dust.
const LEAST_SWATCH: usize = 6;
/// Rim of table that is kept around the cloth, blocks.
const RIM: usize = 2;
/// A table that makes up less is not worth a mask.
const LEAST_TABLE: f64 = 0.03;
/// The cloth must be rougher than the table by this factor and this much.
const ROUGHER: f64 = 2.0;
const ROUGHER_DEG: f64 = 1.0;
/// Share of the outline along which colour or roughness must change at once.
const SHARP: f64 = 0.7;
/// What counts as a change there.
const STEP_OCTAVES: f64 = 0.3;
/// How far apart the two sides of the outline are compared, blocks.
const STEP_BLOCKS: usize = 2;

/// Where the swatch is.
#[derive(Clone, Debug, PartialEq)]
pub struct Swatch {
    /// True where it is, frame size; with a rim, so that no thread is lost.
    pub mask: Image<bool>,
    /// Share of the frame that is left out.
    pub table_share: f64,
    /// What was found, one sentence.
    pub said: String,
}

/// Photosites that a pixel of the maps spans, each way, in which the swatch is looked for.
pub const SCALE: Scale = Scale::Half;

impl Swatch {
    /// Whether frames of this size are large enough to tell a table in them; what is kept instead, where they are not.
    pub fn of_size((width, height): (usize, usize)) -> Option<Self> {
        (width.min(height) < LEAST_BLOCKS * BLOCK_PX).then(|| {
            Self::everything((width, height), "the frame is too small to tell a table from it")
        })
    }

    /// Finds the swatch in the maps of frames of this size, solved at [`SCALE`]; `along` is the normal of the table, rig frame.
    /// Where no table can be told from it, the mask is the whole frame and the sentence says why.
    pub fn in_maps(maps: &Maps, size_px: (usize, usize), along: [f64; 3]) -> Self {
        let blocks = block_grid(maps, BLOCK_PX / SCALE as usize);
        match table_around(&blocks, along) {
            Ok(table) => Self::around(size_px, &table),
            Err(why) => Self::everything(size_px, why),
        }
    }

    fn everything((width, height): (usize, usize), why: &str) -> Self {
        Self {
            mask: Image::filled(width, height, true),
            table_share: 0.0,
            said: format!("Everything is kept: {why}."),
        }
    }

    fn around((width, height): (usize, usize), table: &Image<bool>) -> Self {
        let data = (0..width * height)
            .map(|at| !table.at(at % width / BLOCK_PX, at / width / BLOCK_PX))
            .collect::<Vec<bool>>();
        let left_out = data.iter().filter(|inside| !**inside).count();
        let table_share = left_out as f64 / data.len() as f64;
        Self {
            mask: Image { width, height, data },
            table_share,
            said: format!("{:.0} % of the frame are table and are left out.", 100.0 * table_share),
        }
    }
}

/// True where the table is, whose normal is about `along`; else why it cannot be told.
fn table_around(blocks: &Image<Block>, along: [f64; 3]) -> Result<Image<bool>, &'static str> {
    let (table, corners) = Table::in_corners(blocks, along)?;
    let similar = map(blocks, |block| table.resembles(block));
    let reached = flood(&similar, &corners);
    let cloth = without_specks(&with_holes_filled(&closed(&not(&reached), CLOSING)), LEAST_SWATCH);
    if !cloth.data.contains(&true) {
        return Err(
            "nothing stands out from the corners of the frame, so that the swatch seems to fill it",
        );
    }
    if !is_rougher(blocks, &table, &cloth) {
        return Err(
            "what stands out is as smooth as its surroundings and may be a pattern of the cloth",
        );
    }
    if outline_sharpness(blocks, &table, &cloth) < SHARP {
        return Err("no clear outline of a swatch shows");
    }
    let rest = not(&dilated(&cloth, RIM));
    let count = rest.data.iter().filter(|table| **table).count();
    if (count as f64) < LEAST_TABLE * rest.data.len() as f64 {
        return Err("the swatch fills the frame");
    }
    Ok(rest)
}

fn map(blocks: &Image<Block>, of: impl Fn(&Block) -> bool) -> Image<bool> {
    let data = blocks.data.iter().map(of).collect();
    Image { width: blocks.width, height: blocks.height, data }
}

fn not(image: &Image<bool>) -> Image<bool> {
    let data = image.data.iter().map(|value| !value).collect();
    Image { width: image.width, height: image.height, data }
}

/// What the table looks like: medians over its blocks, and how far blocks of it may be from them.
struct Table {
    look: Block,
    lean_deg: f64,
    octaves: f64,
    roughness_deg: f64,
}

impl Table {
    /// The table that shows in two or more corners, with the blocks of these corners.
    fn in_corners(
        blocks: &Image<Block>,
        along: [f64; 3],
    ) -> Result<(Self, Vec<usize>), &'static str> {
        let plane = Block { normal: along, ..Block::UNSOLVED };
        let is_table = |look: &Block| {
            look.roughness_deg <= SMOOTH_DEG && look.lean_from_deg(&plane) <= ALONG_DEG
        };
        let patches = corner_patches(blocks.width, blocks.height);
        let smooth: Vec<(Self, Vec<usize>)> = patches
            .into_iter()
            .filter_map(|patch| {
                let of_patch: Vec<&Block> = patch.iter().map(|&at| &blocks.data[at]).collect();
                Some((Self::of(&of_patch)?, patch)).filter(|(table, _)| is_table(&table.look))
            })
            .collect();
        if smooth.len() < 2 {
            return Err("no smooth table shows in two corners of the frame");
        }
        let agree = |a: &Self, b: &Self| {
            a.look.lean_from_deg(&b.look) <= SAME_LEAN_DEG
                && a.look.octaves_from(&b.look) <= SAME_OCTAVES
        };
        if !smooth.iter().all(|(table, _)| agree(table, &smooth[0].0)) {
            return Err("the corners of the frame differ, so that no one table can be told");
        }
        let corners: Vec<usize> = smooth.into_iter().flat_map(|(_, patch)| patch).collect();
        let all: Vec<&Block> = corners.iter().map(|&at| &blocks.data[at]).collect();
        let table = Self::of(&all).ok_or("no smooth table shows in two corners of the frame")?;
        Ok((table, corners))
    }

    /// Of some blocks; `None` where most are unsolved or lean differently.
    fn of(blocks: &[&Block]) -> Option<Self> {
        let solved: Vec<&&Block> = blocks.iter().filter(|block| block.is_solved()).collect();
        if 4 * solved.len() < 3 * blocks.len() {
            return None;
        }
        let middle = |of: &dyn Fn(&Block) -> f64| median(solved.iter().map(|b| of(b)).collect());
        let look = Block {
            normal: [0, 1, 2].map(|axis| middle(&|block| block.normal[axis])),
            octaves: [0, 1, 2].map(|channel| middle(&|block| block.octaves[channel])),
            roughness_deg: middle(&|block| block.roughness_deg),
        };
        let lean = middle(&|block| block.lean_from_deg(&look));
        let octaves = middle(&|block| block.octaves_from(&look));
        let roughness = middle(&|block| (block.roughness_deg - look.roughness_deg).abs());
        Some(Self {
            lean_deg: (SPREADS * lean).max(LEAST_LEAN_DEG),
            octaves: (SPREADS * octaves).max(LEAST_OCTAVES),
            roughness_deg: (SPREADS * roughness).max(LEAST_ROUGHNESS_DEG),
            look,
        })
        .filter(|_| lean <= LEVEL_DEG)
    }

    fn resembles(&self, block: &Block) -> bool {
        block.is_solved()
            && block.lean_from_deg(&self.look) <= self.lean_deg
            && block.octaves_from(&self.look) <= self.octaves
            && block.roughness_deg <= self.look.roughness_deg + self.roughness_deg
    }

    /// How much a block differs from a plane: its own roughness, and how far it leans. What cannot be solved is no matt plane.
    fn relief_deg(&self, block: &Block) -> f64 {
        if !block.is_solved() {
            return 90.0;
        }
        block.roughness_deg.hypot(block.lean_from_deg(&self.look))
    }
}

/// Places of the blocks in the four corners of a grid.
fn corner_patches(width: usize, height: usize) -> [Vec<usize>; 4] {
    let side = ((CORNER * width.min(height) as f64).round() as usize).max(3);
    [(0, 0), (width - side, 0), (0, height - side), (width - side, height - side)].map(|(x, y)| {
        (y..y + side).flat_map(|y| (x..x + side).map(move |x| y * width + x)).collect()
    })
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    match values.is_empty() {
        true => 0.0,
        false => *values.select_nth_unstable_by(middle, f64::total_cmp).1,
    }
}

fn is_rougher(blocks: &Image<Block>, table: &Table, cloth: &Image<bool>) -> bool {
    let relief = |inside: bool| {
        let of = blocks.data.iter().zip(&cloth.data).filter(|(_, cloth)| **cloth == inside);
        median(of.map(|(block, _)| table.relief_deg(block)).collect())
    };
    relief(true) >= ROUGHER * relief(false) + ROUGHER_DEG
}

/// Share of the outline at which albedo or roughness differs clearly between a block a little outside and one a little inside.
fn outline_sharpness(blocks: &Image<Block>, table: &Table, cloth: &Image<bool>) -> f64 {
    let (mut sharp, mut all) = (0_usize, 0_usize);
    let (width, height) = (blocks.width as isize, blocks.height as isize);
    let at = |x: isize, y: isize| {
        ((0..width).contains(&x) && (0..height).contains(&y)).then(|| (y * width + x) as usize)
    };
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let (Some(out), Some(edge)) = (at(x, y), at(x + dx, y + dy)) else { continue };
            if cloth.data[out] || !cloth.data[edge] {
                continue;
            }
            let further = STEP_BLOCKS as isize;
            let inside = (0..=further).filter_map(|k| at(x + dx * (1 + k), y + dy * (1 + k)));
            all += 1;
            sharp += usize::from(
                inside
                    .into_iter()
                    .any(|inside| table.is_step(&blocks.data[out], &blocks.data[inside])),
            );
        }
    }
    sharp as f64 / all.max(1) as f64
}

impl Table {
    /// Whether colour or roughness change clearly from a block of the table to one of the cloth.
    fn is_step(&self, out: &Block, inside: &Block) -> bool {
        !inside.is_solved()
            || inside.octaves_from(out) >= STEP_OCTAVES
            || inside.roughness_deg >= ROUGHER * out.roughness_deg + ROUGHER_DEG
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid in which `cloth` tells the blocks of cloth from those of a table.
    fn grid(cloth: impl Fn(usize, usize) -> Option<Block>) -> Image<Block> {
        let (width, height) = (60, 40);
        let table = Block { normal: [0.0, 0.0, 1.0], octaves: [-4.0; 3], roughness_deg: 0.3 };
        let data = (0..width * height).map(|at| cloth(at % width, at / width).unwrap_or(table));
        Image { width, height, data: data.collect() }
    }

    fn around(blocks: &Image<Block>) -> Result<Image<bool>, &'static str> {
        table_around(blocks, [0.0, 0.0, 1.0])
    }

    const WOVEN: Block = Block { normal: [0.02, 0.0, 1.0], octaves: [-1.0; 3], roughness_deg: 9.0 };

    fn in_rectangle(x: usize, y: usize) -> bool {
        (15..40).contains(&x) && (10..30).contains(&y)
    }

    #[test]
    fn a_swatch_on_a_table_is_found_whatever_tells_them_apart() {
        let check = |what: &str, cloth: Block| {
            let found = around(&grid(|x, y| in_rectangle(x, y).then_some(cloth)));
            let table = found.unwrap_or_else(|why| panic!("{what}: {why}"));
            for (x, y) in (0..40).flat_map(|y| (0..60).map(move |x| (x, y))) {
                let near = (15 - RIM..40 + RIM).contains(&x) && (10 - RIM..30 + RIM).contains(&y);
                assert_eq!(*table.at(x, y), !near, "{what}: ({x}, {y})");
            }
        };
        check("colour and roughness", WOVEN);
        check("roughness alone", Block { octaves: [-4.0; 3], ..WOVEN });
        check("one channel", Block { octaves: [-4.0, -4.0, -2.0], ..WOVEN });
        check("never solved", Block::UNSOLVED);
    }

    #[test]
    fn what_cannot_be_told_is_kept() {
        let check = |expected: &str, blocks: &Image<Block>| match around(blocks) {
            Ok(_) => panic!("{expected}: something was cut"),
            Err(why) => assert!(why.contains(expected), "expected {expected:?}, got {why:?}"),
        };
        check("no smooth table", &grid(|_, _| Some(WOVEN)));
        check("no smooth table", &grid(|_, _| Some(Block::UNSOLVED)));
        let steep = Block { normal: [0.5, 0.0, 0.8], octaves: [-1.0; 3], roughness_deg: 0.1 };
        check("no smooth table", &grid(|x, y| (!in_rectangle(x, y)).then_some(steep)));
        check("nothing stands out", &grid(|_, _| None));
        let printed = Block { octaves: [-1.0; 3], roughness_deg: 0.3, ..WOVEN };
        check("may be a pattern", &grid(|x, y| in_rectangle(x, y).then_some(printed)));
        check("corners of the frame differ", &grid(|x, _| (x > 30).then_some(printed)));
        check("fills the frame", &grid(|x, y| (y >= 4 || (4..=55).contains(&x)).then_some(WOVEN)));
        // Waves: what leans more is no other material.
        let wave = |x: usize| (x as f64 / 59.0 * std::f64::consts::PI).sin().powi(2) * 0.25;
        let waves = grid(|x, _| {
            Some(Block { normal: [wave(x), 0.0, 1.0], octaves: [-1.0; 3], roughness_deg: 0.5 })
        });
        check("no clear outline", &waves);
    }

    #[test]
    fn several_swatches_with_holes_are_kept_whole() {
        let hole = |x: usize, y: usize| (24..28).contains(&x) && (18..22).contains(&y);
        let second = |x: usize, y: usize| (48..54).contains(&x) && (4..12).contains(&y);
        let cloth = |x, y| (in_rectangle(x, y) && !hole(x, y)) || second(x, y);
        let table = around(&grid(|x, y| cloth(x, y).then_some(WOVEN))).unwrap();
        for (x, y) in (0..40).flat_map(|y| (0..60).map(move |x| (x, y))) {
            if cloth(x, y) || hole(x, y) {
                assert!(!table.at(x, y), "({x}, {y}) is lost");
            }
        }
        assert!(*table.at(44, 20) && *table.at(2, 2));
    }
}
