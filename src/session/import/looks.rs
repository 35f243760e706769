//! What pictures look like that they should not: copies of each other, or an undemosaiced mosaic.

use crate::files::Setting;
use crate::raw::{Frame, Layout, Samples};
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};

/// Tiles per side over which a mosaic's pattern must be the same.
const TILES: usize = 4;

/// Least relative difference between the places of a 2 x 2 cell that makes a mosaic.
const LEAST_CONTRAST: f64 = 0.04;

/// Share of the tiles with signal that must agree on the darkest and the brightest place.
const AGREEING: f64 = 0.9;

/// What is kept of a picture to compare it with others.
pub(super) struct Look {
    path: PathBuf,
    sha256: String,
    samples: u64,
    mosaic: Option<Pattern>,
    is_grey: bool,
}

/// How the places of the 2 x 2 cell differ all over a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pattern {
    /// (largest - least) / mean.
    contrast: f64,
    darkest: usize,
    brightest: usize,
}

impl Look {
    pub(super) fn new(path: &Path, sha256: &str, frame: &Frame) -> Self {
        let is_grey = frame.layout == Layout::Grey;
        Self {
            path: path.to_owned(),
            sha256: sha256.to_owned(),
            samples: hash(frame),
            mosaic: is_grey.then(|| pattern(frame)).flatten(),
            is_grey,
        }
    }
}

fn hash(frame: &Frame) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write_usize(frame.width);
    match &frame.samples {
        Samples::U16(samples) => {
            for part in samples.chunks(4096) {
                let bytes: Vec<u8> = part.iter().flat_map(|value| value.to_le_bytes()).collect();
                hasher.write(&bytes);
            }
        }
        Samples::F32(samples) => samples.iter().for_each(|value| hasher.write_u32(value.to_bits())),
    }
    hasher.finish()
}

/// Sentences on pictures that are the same under several lights.
pub(super) fn copies(looks: &[Look]) -> Vec<String> {
    let mut first_of: HashMap<u64, usize> = HashMap::new();
    let mut found = Vec::new();
    for (light, look) in looks.iter().enumerate() {
        let first = *first_of.entry(look.samples).or_insert(light);
        if first == light {
            continue;
        }
        let (a, b) = (looks[first].path.display(), look.path.display());
        found.push(if looks[first].path == look.path {
            format!("{a} is given for lights {first} and {light}; every light needs its own picture")
        } else if looks[first].sha256 == look.sha256 {
            format!("{a} and {b} (lights {first} and {light}) are the same picture; every light needs its own")
        } else {
            format!("{a} and {b} (lights {first} and {light}) hold the same picture in different files; every light needs its own")
        });
    }
    const SHOWN: usize = 8;
    let more = found.len().saturating_sub(SHOWN);
    found.truncate(SHOWN);
    if more > 0 {
        found.push(format!("{more} more pictures are copies of others"));
    }
    found
}

/// A sentence where grey pictures look like a colour sensor's mosaic in every frame.
pub(super) fn mosaic(looks: &[Look]) -> Option<String> {
    let mut least = f64::INFINITY;
    let mut places: Option<(usize, usize)> = None;
    for look in looks {
        if !look.is_grey {
            return None;
        }
        let pattern = look.mosaic?;
        least = least.min(pattern.contrast);
        let of_this = (pattern.darkest, pattern.brightest);
        if *places.get_or_insert(of_this) != of_this {
            return None;
        }
    }
    places?;
    Some(format!(
        "the grey pictures look like a colour sensor's mosaic: the four places of every 2 x 2 cell differ by {:.0} % or \
         more, the same way in every picture; if they are one, import again with {} RGGB (or as the camera has it)",
        100.0 * least,
        Setting("cfa")
    ))
}

/// How the places of the cell differ, where they do so in all parts of the frame alike.
fn pattern(frame: &Frame) -> Option<Pattern> {
    let (columns, rows) = (frame.width / 2, frame.height / 2);
    if columns < 2 * TILES || rows < 2 * TILES {
        return None;
    }
    let mut whole = [0.0_f64; 4];
    let mut tiles = Vec::with_capacity(TILES * TILES);
    for tile in 0..TILES * TILES {
        let across = span(tile % TILES, columns);
        let down = span(tile / TILES, rows);
        let mut sums = [0.0_f64; 4];
        for row in down {
            for column in across.clone() {
                for (place, sum) in sums.iter_mut().enumerate() {
                    let at = (2 * row + place / 2) * frame.width + 2 * column + place % 2;
                    *sum += sample(frame, at);
                }
            }
        }
        whole.iter_mut().zip(sums).for_each(|(all, sum)| *all += sum);
        tiles.push(sums);
    }
    let of_all = Pattern::of(&whole)?;
    if of_all.contrast < LEAST_CONTRAST {
        return None;
    }
    let brightest_tile = tiles.iter().map(|tile| tile.iter().sum::<f64>()).fold(0.0, f64::max);
    let lit: Vec<&[f64; 4]> =
        tiles.iter().filter(|tile| tile.iter().sum::<f64>() > 0.05 * brightest_tile).collect();
    let agrees = |tile: &&&[f64; 4]| {
        tile[of_all.brightest] > tile[of_all.darkest] * (1.0 + 0.25 * LEAST_CONTRAST)
    };
    let agreeing = lit.iter().filter(agrees).count();
    (agreeing as f64 >= AGREEING * lit.len() as f64).then_some(of_all)
}

fn span(tile: usize, cells: usize) -> std::ops::Range<usize> {
    tile * cells / TILES..(tile + 1) * cells / TILES
}

impl Pattern {
    fn of(sums: &[f64; 4]) -> Option<Self> {
        let order = |a: &usize, b: &usize| sums[*a].total_cmp(&sums[*b]);
        let (darkest, brightest) = ((0..4).min_by(order)?, (0..4).max_by(order)?);
        let mean = sums.iter().sum::<f64>() / 4.0;
        let contrast = (sums[brightest] - sums[darkest]) / mean;
        (mean > 0.0 && contrast.is_finite()).then_some(Self { contrast, darkest, brightest })
    }
}

fn sample(frame: &Frame, at: usize) -> f64 {
    match &frame.samples {
        Samples::U16(samples) => f64::from(samples[at]),
        Samples::F32(samples) => f64::from(samples[at]),
    }
}
