//! The light field: every light's vector where each pixel really looks, on a coarse grid in float64.

mod grid;

use crate::photometry::FieldRow;
use grid::node_grid;
use nalgebra::{Point3, Vector3};
use weavelight_calibration::description::{Camera, Light, Plane};
use weavelight_calibration::irradiance::light_vector_in_rig;
use weavelight_calibration::projection::Projector;

/// Grids tried, widest first, pixels between nodes.
const STEPS: [usize; 11] = [32, 24, 20, 16, 12, 8, 6, 4, 3, 2, 1];
/// Vectors held at most; a finer grid is computed row by row when it is reached.
const MOST_VECTORS: usize = 6_000_000;
/// How far linear interpolation between nodes may be off, relative to the vector's length: 1e-5 rad is 0.0006 deg.
const INTERPOLATION_ERROR: f64 = 1e-5;
/// Vectors shorter than this share of the light's longest are compared with it instead: their error does no harm.
const NEGLIGIBLE: f64 = 1e-3;
/// Cells checked along each side of the frame.
const CHECKED_CELLS: usize = 20;

/// All lights over the whole frame.
pub(crate) struct LightField<'a> {
    lights: Vec<&'a Light>,
    view: View<'a>,
    width: usize,
    height: usize,
    step: usize,
    /// Every node's vectors, row by row; `None` where they are too many.
    grid: Option<Vec<[f64; 3]>>,
}

/// Where pixels look.
enum View<'a> {
    /// Through a camera at a plane.
    Plane { projector: Projector<'a>, plane: &'a Plane },
    /// Far lights only: the place does not matter.
    Anywhere,
}

/// A pixel of the frame that shows no point of the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Unseen {
    /// The pixel (u, v).
    pub(crate) pixel: [f64; 2],
}

impl<'a> LightField<'a> {
    /// Chooses the grid: the widest on which linear interpolation is accurate. `camera` may be missing where every light
    /// is far away.
    pub(crate) fn new(
        lights: Vec<&'a Light>,
        camera: Option<&'a Camera>,
        plane: &'a Plane,
        size_px: (usize, usize),
    ) -> Result<Self, Unseen> {
        let all_far = lights.iter().all(|light| matches!(light, Light::Directional(_)));
        let view = match camera {
            Some(camera) if !all_far => View::Plane { projector: Projector::new(camera), plane },
            _ => View::Anywhere,
        };
        let (width, height) = size_px;
        let mut field = Self { lights, view, width, height, step: 1, grid: None };
        for step in STEPS {
            field.step = step;
            if step > 1 && field.is_accurate() {
                break;
            }
        }
        field.check_corners()?;
        let vectors = field.nodes() * field.node_rows() * field.lights.len();
        field.grid = (vectors <= MOST_VECTORS).then(|| node_grid(&field));
        Ok(field)
    }

    /// Pixels between nodes.
    pub(crate) fn step(&self) -> usize {
        self.step
    }

    /// The least columns to which a piece of a row can be aligned: on a node, at an even column.
    pub(crate) fn alignment(&self) -> usize {
        if self.step.is_multiple_of(2) { self.step } else { 2 * self.step }
    }

    /// Lights of the field.
    pub(crate) fn light_count(&self) -> usize {
        self.lights.len()
    }

    /// Every light's vector at a pixel, exactly; `None` where the pixel shows no point of the plane.
    pub(crate) fn exact(&self, pixel: [f64; 2]) -> Option<Vec<Vector3<f64>>> {
        let point = self.point_in_rig_mm(pixel)?;
        Some(self.lights.iter().map(|light| light_vector_in_rig(light, &point)).collect())
    }

    fn point_in_rig_mm(&self, pixel: [f64; 2]) -> Option<Point3<f64>> {
        match &self.view {
            View::Plane { projector, plane } => projector.on_plane(pixel, plane),
            View::Anywhere => Some(Point3::origin()),
        }
    }

    fn check_corners(&self) -> Result<(), Unseen> {
        let (right, bottom) = ((self.width - 1) as f64, (self.height - 1) as f64);
        let corners = [[0.0, 0.0], [right, 0.0], [0.0, bottom], [right, bottom]];
        match corners.into_iter().find(|&corner| self.point_in_rig_mm(corner).is_none()) {
            Some(pixel) => Err(Unseen { pixel }),
            None => Ok(()),
        }
    }

    /// Compares interpolated with exact vectors in the middle of cells and of their edges, over the whole frame.
    fn is_accurate(&self) -> bool {
        let (columns, rows) = (self.checked_cells(self.width), self.checked_cells(self.height));
        rows.iter().all(|&row| columns.iter().all(|&column| self.cell_is_accurate(column, row)))
    }

    /// First pixels of the cells to check along one side; the last cell among them.
    fn checked_cells(&self, length: usize) -> Vec<usize> {
        let last = (length - 1).div_ceil(self.step).saturating_sub(1);
        let mut cells: Vec<usize> =
            (0..CHECKED_CELLS).map(|i| last * i / (CHECKED_CELLS - 1) * self.step).collect();
        cells.dedup();
        cells
    }

    fn cell_is_accurate(&self, column: usize, row: usize) -> bool {
        let node = |right: usize, down: usize| {
            self.exact([(column + right * self.step) as f64, (row + down * self.step) as f64])
        };
        let (Some(a), Some(b), Some(c), Some(d)) = (node(0, 0), node(1, 0), node(0, 1), node(1, 1))
        else {
            return false;
        };
        [[0.5, 0.5], [0.5, 0.0], [0.0, 0.5]].into_iter().all(|[x, y]| {
            let pixel = [column as f64 + x * self.step as f64, row as f64 + y * self.step as f64];
            self.exact(pixel).is_some_and(|exact| {
                let longest = exact.iter().map(Vector3::norm).fold(0.0, f64::max);
                exact.iter().enumerate().all(|(i, exact)| {
                    let top = a[i] * (1.0 - x) + b[i] * x;
                    let interpolated = top * (1.0 - y) + (c[i] * (1.0 - x) + d[i] * x) * y;
                    (interpolated - exact).norm()
                        <= INTERPOLATION_ERROR * exact.norm().max(NEGLIGIBLE * longest)
                })
            })
        })
    }

    /// Nodes along a row: the last one stands at or beyond the last column.
    pub(crate) fn nodes(&self) -> usize {
        (self.width - 1).div_ceil(self.step) + 1
    }

    /// Rows of nodes: the last one stands at or beyond the last row.
    pub(crate) fn node_rows(&self) -> usize {
        (self.height - 1).div_ceil(self.step) + 1
    }

    /// Vectors of node row `row`, node-major, each exactly.
    pub(crate) fn node_row(&self, row: usize) -> Vec<[f64; 3]> {
        let v = (row * self.step) as f64;
        let mut vectors = Vec::with_capacity(self.nodes() * self.lights.len());
        for node in 0..self.nodes() {
            // Checked when the grid was chosen; a lone failure is dark, not fatal.
            let point = self.point_in_rig_mm([(node * self.step) as f64, v]);
            vectors.extend(self.lights.iter().map(|light| match &point {
                Some(point) => light_vector_in_rig(light, point).into(),
                None => [0.0; 3],
            }));
        }
        vectors
    }
}

/// Walks down the rows of a band.
pub(crate) struct FieldRows<'f, 'a> {
    field: &'f LightField<'a>,
    /// Two rows of nodes and the index of the first, where the field does not hold them.
    computed: Option<(usize, [Vec<[f64; 3]>; 2])>,
    row: Vec<[f64; 3]>,
}

impl<'f, 'a> FieldRows<'f, 'a> {
    pub(crate) fn new(field: &'f LightField<'a>) -> Self {
        Self { field, computed: None, row: vec![] }
    }

    /// Light vectors along picture row `y`, from column `first` (a multiple of the step) on.
    pub(crate) fn row(&mut self, y: usize, first: usize) -> FieldRow<'_> {
        let (index, offset) = (y / self.field.step, y % self.field.step);
        let weight = offset as f64 / self.field.step as f64;
        let lights = self.field.lights.len();
        let mut row = std::mem::take(&mut self.row);
        if let Some(grid) = &self.field.grid {
            let length = self.field.nodes() * lights;
            let below = (index + 1).min(self.field.node_rows() - 1);
            mix([index, below].map(|k| &grid[k * length..][..length]), weight, &mut row);
        } else {
            mix(self.computed_rows(index), weight, &mut row);
        }
        self.row = row;
        FieldRow {
            step: self.field.step,
            vectors: &self.row[first / self.field.step * lights..],
            lights,
        }
    }

    /// Node rows `index` and the next, computed where they are not at hand from the row before.
    fn computed_rows(&mut self, index: usize) -> [&[[f64; 3]]; 2] {
        let next = (index + 1).min(self.field.node_rows() - 1);
        let rows = match self.computed.take() {
            Some((held, rows)) if held == index => rows,
            Some((held, [_, above])) if held + 1 == index => [above, self.field.node_row(next)],
            _ => [index, next].map(|row| self.field.node_row(row)),
        };
        let (_, [above, below]) = self.computed.insert((index, rows));
        [above, below]
    }
}

/// Linear between two rows of nodes.
fn mix([above, below]: [&[[f64; 3]]; 2], weight: f64, out: &mut Vec<[f64; 3]>) {
    out.clear();
    let linear = |(a, b): (&[f64; 3], &[f64; 3])| {
        [0, 1, 2].map(|axis| a[axis] + (b[axis] - a[axis]) * weight)
    };
    out.extend(above.iter().zip(below).map(linear));
}
