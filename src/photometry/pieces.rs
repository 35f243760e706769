//! A row cut into pieces on which light vectors and pseudo-inverses are linear in the column, as float32 coefficients.
//!
//! The light vectors L (n x 3) are linear between the field's nodes by contract. Their pseudo-inverse P is not; but with
//! P0 L0 = P1 L1 = I, the linear mix P(t) = (1 - t) P0 + t P1 gives
//!
//!   P(t) L(t) - I = t (1 - t) (P0 - P1) (L1 - L0),
//!
//! so the error that the mix makes on a Lambertian photosite is known exactly: it is taken off to first order, and a piece is
//! halved until what it does to the rest of the samples is small too.

use nalgebra::Matrix3;

use super::reference::inverse_if_conditioned;
use super::row::FieldRow;

/// Largest error, relative to g, that interpolating pseudo-inverses may make before it is taken off. What remains is its
/// square, and its like on what is not Lambertian in the samples (at most half of them in effect): 0.0009 degrees.
const LARGEST_MIX_ERROR: f64 = 3e-5;

/// Pieces are not cut below this many columns; what is still too curved then goes to float64.
const SHORTEST_PIECE: usize = 8;

/// Beyond this condition number of the light vectors, float32 misses the reference by more than 0.001 degrees.
const FLOAT32_CONDITION: f64 = 40.0;

/// Coefficients of one light on a piece: value at the piece's start and slope per column, x, y, z each.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Linear {
    pub(crate) at_start: [f32; 3],
    pub(crate) per_column: [f32; 3],
}

/// Columns `start..end`; light i's coefficients stand at `first + i` of [`Pieces::light`] and [`Pieces::inverse`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    pub(crate) start: usize,
    pub(crate) end: usize,
    pub(crate) first: usize,
    /// Whether float32 carries this piece.
    pub(crate) float32: bool,
    /// 1 / columns between the nodes at its ends.
    pub(crate) per_column: f32,
    /// (P0 - P1) (L1 - L0).
    pub(crate) bend: [[f32; 3]; 3],
}

/// The pieces of a row. Light vectors are divided by `unit`, a power of two near the longest, so that float32 neither
/// overflows nor underflows.
#[derive(Default)]
pub(crate) struct Pieces {
    pub(crate) list: Vec<Piece>,
    pub(crate) light: Vec<Linear>,
    pub(crate) inverse: Vec<Linear>,
    pub(crate) unit: f64,
    needs: Needs,
    left: Node,
    right: Node,
}

/// What a method reads of the pieces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Needs {
    /// Light vectors alone, which are linear anyway.
    #[default]
    Lights,
    /// Pseudo-inverses too.
    Inverse,
}

/// Light vectors and their pseudo-inverse at one column; plain arrays, because a row has a hundred nodes.
#[derive(Clone, Default)]
struct Node {
    column: usize,
    light: Vec<[f64; 3]>,
    inverse: Vec<[f64; 3]>,
    /// At least the condition number; infinite where the lights lie in a plane.
    condition: f64,
}

impl Pieces {
    /// Cuts a row of `width` columns.
    pub(crate) fn cut(&mut self, field: &FieldRow, width: usize, needs: Needs) {
        self.needs = needs;
        self.list.clear();
        self.light.clear();
        self.inverse.clear();
        self.unit = unit_of(field);
        let step = field.step.max(1);
        let mut left = std::mem::take(&mut self.left);
        let mut right = std::mem::take(&mut self.right);
        left.place(field, 0, self.unit);
        for start in (0..width).step_by(step) {
            right.place(field, start + step, self.unit);
            self.cut_between(field, &left, &right, width);
            std::mem::swap(&mut left, &mut right);
        }
        (self.left, self.right) = (left, right);
    }

    fn cut_between(&mut self, field: &FieldRow, left: &Node, right: &Node, width: usize) {
        if left.column >= width {
            return;
        }
        let conditioned = left.condition.max(right.condition) < FLOAT32_CONDITION;
        let length = right.column - left.column;
        let bent =
            |n: Needs| n == Needs::Inverse && mix_error(&bend(left, right)) >= LARGEST_MIX_ERROR;
        let straight = conditioned && !bent(self.needs);
        if straight || !conditioned || length < 2 * SHORTEST_PIECE {
            self.push(left, right, width, straight);
            return;
        }
        let mut middle = Node::default();
        middle.place(field, left.column + length / 2, self.unit);
        self.cut_between(field, left, &middle, width);
        self.cut_between(field, &middle, right, width);
    }

    fn push(&mut self, left: &Node, right: &Node, width: usize, float32: bool) {
        let (start, end) = (left.column, right.column.min(width));
        let per_column = 1.0 / (right.column - left.column) as f64;
        let bend = bend(left, right).map(|row| row.map(|v| v as f32));
        let first = self.light.len();
        self.list.push(Piece { start, end, first, float32, per_column: per_column as f32, bend });
        let between = |a: &[[f64; 3]], b: &[[f64; 3]], to: &mut Vec<Linear>| {
            to.extend(a.iter().zip(b).map(|(a, b)| Linear::between(a, b, per_column)));
        };
        between(&left.light, &right.light, &mut self.light);
        between(&left.inverse, &right.inverse, &mut self.inverse);
    }
}

impl Linear {
    #[inline(always)]
    fn between(a: &[f64; 3], b: &[f64; 3], per_column: f64) -> Self {
        let slope = |axis: usize| ((b[axis] - a[axis]) * per_column) as f32;
        Self { at_start: a.map(|v| v as f32), per_column: [slope(0), slope(1), slope(2)] }
    }
}

impl Node {
    fn place(&mut self, field: &FieldRow, column: usize, unit: f64) {
        self.column = column;
        field.copy_at(column, 1.0 / unit, &mut self.light);
        let mut sums = [0.0; 6];
        for &[x, y, z] in &self.light {
            for (sum, product) in sums.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
                *sum += product;
            }
        }
        let [xx, xy, xz, yy, yz, zz] = sums;
        let inverse = inverse_if_conditioned(&Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
        self.condition =
            inverse.map_or(f64::INFINITY, |inverse| ((xx + yy + zz) * inverse.trace()).sqrt());
        let inverse = inverse.unwrap_or_default();
        let rows: [[f64; 3]; 3] =
            [0, 1, 2].map(|r| [inverse[(r, 0)], inverse[(r, 1)], inverse[(r, 2)]]);
        self.inverse.clear();
        self.inverse.extend(
            self.light.iter().map(|[x, y, z]| rows.map(|r| r[0] * x + r[1] * y + r[2] * z)),
        );
    }
}

/// (P0 - P1) (L1 - L0), see the head of this file.
fn bend(left: &Node, right: &Node) -> [[f64; 3]; 3] {
    let mut bend = [[0.0; 3]; 3];
    let lights = left.light.iter().zip(&right.light);
    for ((p0, p1), (l0, l1)) in left.inverse.iter().zip(&right.inverse).zip(lights) {
        for row in 0..3 {
            for column in 0..3 {
                bend[row][column] += (p0[row] - p1[row]) * (l1[column] - l0[column]);
            }
        }
    }
    bend
}

/// Norm of the mix's error in the middle of a piece.
fn mix_error(bend: &[[f64; 3]; 3]) -> f64 {
    bend.iter().flatten().map(|e| e * e).sum::<f64>().sqrt() / 4.0
}

/// The power of two at or below the longest component; 1 for a field without a finite non-zero number.
fn unit_of(field: &FieldRow) -> f64 {
    let components = field.vectors.iter().flatten();
    let longest = components
        .fold(0.0_f64, |longest, c| if c.is_finite() { longest.max(c.abs()) } else { longest });
    if longest > 0.0 { longest.log2().floor().clamp(-1000.0, 1000.0).exp2() } else { 1.0 }
}
