//! The pictures that were taken before: a second one of an earlier light must not count as the next light's.

use crate::device::look::{Look, difference};
use crate::files::sha256_hex;
use crate::raw::Frame;

/// Sketches of one light differ by less: two frames' noise, averaged over 64 photosites, is some 0.5 %. Cloth under two lamps
/// of a rig differs by more than 3 %.
const ALIKE: f64 = 0.01;
/// A picture that is brighter than the unlit one by no more than this, as a fraction of the range, shows no light.
const NO_LIGHT: f64 = 5e-4;

/// What is remembered of a picture.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    sha256: String,
    mean: f64,
    sketch: Vec<f64>,
}

impl Seen {
    pub(super) fn new(bytes: &[u8], frame: &Frame) -> Self {
        let look = Look::at(frame);
        let sketch = look.sketch.iter().map(|value| f64::from(*value)).collect();
        Self { sha256: sha256_hex(bytes), mean: look.mean(), sketch }
    }

    fn shows_the_same_as(&self, other: &Self) -> bool {
        self.sha256 == other.sha256 || difference(&self.sketch, &other.sketch) < ALIKE
    }
}

/// What a new picture is, seen from those that were taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Relation {
    /// Of this light, as far as can be seen.
    New,
    /// The very file of an earlier picture under other outputs.
    Copy,
    /// It shows what an earlier picture under other outputs shows.
    LikeAnother,
}

/// The pictures that were taken, each with the outputs that were lit.
#[derive(Debug, Default)]
pub(super) struct Earlier {
    taken: Vec<(Option<u32>, Seen)>,
    /// Like an earlier picture, and rejected for that; where the next try shows it again, it is what these outputs give.
    doubted: Option<(u32, Seen)>,
}

impl Earlier {
    /// Compares a picture that arrived while `lit` was on with those under other outputs.
    pub(super) fn relation(&self, seen: &Seen, lit: Option<u32>) -> Relation {
        let Some(lit) = lit else { return Relation::New };
        let others = || {
            self.taken.iter().filter_map(|(was, earlier)| {
                was.filter(|was| *was != lit).map(|was| (was, earlier))
            })
        };
        if others().any(|(_, earlier)| earlier.sha256 == seen.sha256) {
            return Relation::Copy;
        }
        let like = |(was, earlier): (u32, &Seen)| {
            earlier.shows_the_same_as(seen) || (was == 0 && seen.mean - earlier.mean < NO_LIGHT)
        };
        let doubted_before = self
            .doubted
            .as_ref()
            .is_some_and(|(was, doubted)| *was == lit && doubted.shows_the_same_as(seen));
        if !doubted_before && others().any(like) { Relation::LikeAnother } else { Relation::New }
    }

    /// Remembers a picture that counts.
    pub(super) fn take(&mut self, seen: Seen, lit: Option<u32>) {
        self.doubted = None;
        self.taken.push((lit, seen));
    }

    /// Remembers a picture that was rejected because it is like an earlier one.
    pub(super) fn doubt(&mut self, seen: Seen, lit: Option<u32>) {
        self.doubted = lit.map(|lit| (lit, seen));
    }
}

/// Whether all of these pictures show the same.
pub(super) fn all_alike(pictures: &[&Seen]) -> bool {
    pictures.windows(2).all(|pair| pair[0].shows_the_same_as(pair[1]))
}
