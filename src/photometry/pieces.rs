//! A row cut into pieces on which the light vectors L (n x 3) are linear in the column, with N = (L^T L)^-1 interpolated
//! linearly, both as float32 coefficients.
//!
//! L is linear between the field's nodes by contract, N is not. A piece is halved until I - N L^T L is small in its middle;
//! one refinement of g = N L^T y on the residual then leaves the square of that, and samples that are not Lambertian
//! cannot add to it, because L^T of the least-squares residual is zero.

use nalgebra::Matrix3;

use super::reference::inverse_if_conditioned;
use super::row::FieldRow;

/// Largest norm of I - N L^T L. Least squares keeps its square. A weighted solve starts from the unrefined solution, so its
/// weights are off by as much, its result by that share of the noise: less than 0.0005 degrees where noise makes half of one.
const LARGEST_MIX_ERROR: f64 = 1e-3;

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

/// A symmetric 3 x 3 matrix (xx, xy, xz, yy, yz, zz) on a piece: value at its start and slope per column.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LinearMatrix {
    pub(crate) at_start: [f32; 6],
    pub(crate) per_column: [f32; 6],
}

/// Columns `start..end`; light i's coefficients stand at `first + i` of [`Pieces::light`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    pub(crate) start: usize,
    pub(crate) end: usize,
    pub(crate) first: usize,
    /// Whether float32 carries this piece.
    pub(crate) float32: bool,
    /// (L^T L)^-1.
    pub(crate) inverse: LinearMatrix,
}

/// The pieces of a row. Light vectors are divided by `unit`, a power of two near the longest, so that float32 neither
/// overflows nor underflows.
#[derive(Default)]
pub(crate) struct Pieces {
    pub(crate) list: Vec<Piece>,
    pub(crate) light: Vec<Linear>,
    pub(crate) unit: f64,
    left: Node,
    right: Node,
}

/// Light vectors and (L^T L)^-1 at one column; plain arrays, because a row has a hundred nodes.
#[derive(Clone, Default)]
struct Node {
    column: usize,
    light: Vec<[f64; 3]>,
    /// L^T L: xx, xy, xz, yy, yz, zz.
    squares: [f64; 6],
    inverse: [f64; 6],
    /// At least the condition number; infinite where the lights lie in a plane.
    condition: f64,
}

impl Pieces {
    /// Cuts a row of `width` columns.
    pub(crate) fn cut(&mut self, field: &FieldRow, width: usize) {
        self.list.clear();
        self.light.clear();
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
        let straight = conditioned && mix_error(left, right) < LARGEST_MIX_ERROR;
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
        let first = self.light.len();
        let inverse = LinearMatrix {
            at_start: left.inverse.map(|v| v as f32),
            per_column: std::array::from_fn(|i| {
                ((right.inverse[i] - left.inverse[i]) * per_column) as f32
            }),
        };
        self.list.push(Piece { start, end, first, float32, inverse });
        let lights = left.light.iter().zip(&right.light);
        self.light.extend(lights.map(|(a, b)| Linear::between(a, b, per_column)));
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
        self.square();
        let [xx, xy, xz, yy, yz, zz] = self.squares;
        let inverse = inverse_if_conditioned(&Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
        self.condition =
            inverse.map_or(f64::INFINITY, |inverse| ((xx + yy + zz) * inverse.trace()).sqrt());
        let inverse = inverse.unwrap_or_default();
        self.inverse = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|place| inverse[place]);
    }

    fn square(&mut self) {
        self.squares = [0.0; 6];
        for &[x, y, z] in &self.light {
            for (sum, product) in
                self.squares.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z])
            {
                *sum += product;
            }
        }
    }
}

/// At least the norm of I - N L^T L in the middle, N being the mean of those at the ends. With M = L^T L, and as L is linear,
/// I - N M = (N (L1 - L0)^T (L1 - L0) - (N0 - N1) (M1 - M0)) / 4.
fn mix_error(left: &Node, right: &Node) -> f64 {
    let norm = |entry: &dyn Fn(usize) -> f64| {
        let weights = [1.0, 2.0, 2.0, 1.0, 2.0, 1.0].into_iter().enumerate();
        weights.map(|(i, weight)| weight * entry(i).powi(2)).sum::<f64>().sqrt()
    };
    let inverses = norm(&|i| 0.5 * (left.inverse[i] + right.inverse[i]));
    let inverse_change = norm(&|i| right.inverse[i] - left.inverse[i]);
    let squares_change = norm(&|i| right.squares[i] - left.squares[i]);
    let lights = left.light.iter().zip(&right.light);
    let light_change: f64 = lights
        .map(|(a, b)| (b[0] - a[0]).powi(2) + (b[1] - a[1]).powi(2) + (b[2] - a[2]).powi(2))
        .sum();
    0.25 * (inverses * light_change + inverse_change * squares_change)
}

/// The power of two at or below the longest component at the row's ends; 1 without a finite non-zero number there. (Somewhere
/// else it may be much longer: what float32 does not carry then goes to float64.)
fn unit_of(field: &FieldRow) -> f64 {
    let ends = field.vectors.len().saturating_sub(field.lights);
    let of_ends = field.vectors.iter().take(field.lights).chain(&field.vectors[ends..]);
    let longest = of_ends
        .flatten()
        .fold(0.0_f64, |longest, c| if c.is_finite() { longest.max(c.abs()) } else { longest });
    if longest > 0.0 { longest.log2().floor().clamp(-1000.0, 1000.0).exp2() } else { 1.0 }
}
