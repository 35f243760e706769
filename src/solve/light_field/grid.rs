//! All nodes of a light field at once: computed on every fourth node each way and cubic in between, where that is as good.

use crate::solve::light_field::LightField;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Nodes between computed ones.
const SPACING: usize = 4;
/// Smaller grids are computed node by node.
const WORTH_IT: usize = 2000;
/// How far a cubic node may be off, relative to the vector: a tenth of what linear interpolation between nodes may.
const CUBIC_ERROR: f64 = 1e-6;
/// Vectors shorter than this share of the longest are compared with it instead.
const NEGLIGIBLE: f64 = 1e-3;

/// Vectors of every node, row by row, node-major.
pub(crate) fn node_grid(field: &LightField) -> Vec<[f64; 3]> {
    let worth_it = field.nodes() * field.node_rows() > WORTH_IT;
    let cubic = if worth_it { cubic_grid(field) } else { None };
    cubic.filter(|grid| is_accurate(field, grid)).unwrap_or_else(|| {
        (0..field.node_rows()).into_par_iter().flat_map_iter(|row| field.node_row(row)).collect()
    })
}

/// `None` where one of the computed nodes, some of which stand outside the frame, shows no point of the plane.
fn cubic_grid(field: &LightField) -> Option<Vec<[f64; 3]>> {
    let (nodes, rows, lights) = (field.nodes(), field.node_rows(), field.light_count());
    let coarse = coarse_rows(field)?;
    let weights: Vec<[f64; 4]> =
        (0..SPACING).map(|k| lagrange(k as f64 / SPACING as f64)).collect();
    let fine_row = |row: usize| -> Vec<[f64; 3]> {
        let around = &coarse[row / SPACING..][..4];
        let down = weights[row % SPACING];
        let column: Vec<[f64; 3]> = (0..coarse[0].len())
            .map(|k| combine([0, 1, 2, 3].map(|i| around[i][k]), down))
            .collect();
        let node = |k: usize| {
            let (node, light) = (k / lights, k % lights);
            let at = |i: usize| column[(node / SPACING + i) * lights + light];
            combine([0, 1, 2, 3].map(at), weights[node % SPACING])
        };
        (0..nodes * lights).map(node).collect()
    };
    Some((0..rows).into_par_iter().flat_map_iter(fine_row).collect())
}

/// The computed nodes: one before the first cell each way, and two after the last.
fn coarse_rows(field: &LightField) -> Option<Vec<Vec<[f64; 3]>>> {
    let count = |nodes: usize| (nodes - 1) / SPACING + 4;
    let place = |node: usize| (node as f64 - 1.0) * (SPACING * field.step()) as f64;
    let row = |row: usize| {
        let vectors = (0..count(field.nodes())).map(|node| field.exact([place(node), place(row)]));
        let vectors: Option<Vec<Vec<Vector3<f64>>>> = vectors.collect();
        Some(vectors?.into_iter().flatten().map(<[f64; 3]>::from).collect())
    };
    (0..count(field.node_rows())).into_par_iter().map(row).collect()
}

/// Weights of the values at -1, 0, 1 and 2 in the cubic through them at `t`.
fn lagrange(t: f64) -> [f64; 4] {
    [
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    ]
}

fn combine(vectors: [[f64; 3]; 4], weights: [f64; 4]) -> [f64; 3] {
    [0, 1, 2].map(|axis| (0..4).map(|i| weights[i] * vectors[i][axis]).sum())
}

/// Compares a lattice of nodes, between the computed ones too, with the exact vectors.
fn is_accurate(field: &LightField, grid: &[[f64; 3]]) -> bool {
    let (nodes, rows, lights) = (field.nodes(), field.node_rows(), field.light_count());
    let places = |count: usize| (0..count).step_by((count / 16) | 1).chain([count - 1]);
    let node_is_accurate = |row: usize, node: usize| {
        let exact = field.exact([(node * field.step()) as f64, (row * field.step()) as f64]);
        exact.is_some_and(|exact| {
            let longest = exact.iter().map(Vector3::norm).fold(0.0, f64::max);
            exact.iter().zip(&grid[(row * nodes + node) * lights..]).all(|(exact, found)| {
                let off = (Vector3::from(*found) - exact).norm();
                off <= CUBIC_ERROR * exact.norm().max(NEGLIGIBLE * longest)
            })
        })
    };
    places(rows).all(|row| places(nodes).all(|node| node_is_accurate(row, node)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, UnitVector3};
    use weavelight_calibration::description::{Camera, Light, Plane, PointLight};

    #[test]
    fn cubic_nodes_agree_with_exact_ones_over_a_full_frame() {
        let camera = Camera {
            width_px: 2464,
            height_px: 1632,
            fx: 3661.0,
            fy: 3660.0,
            cx: 1235.0,
            cy: 814.0,
            distortion: [-0.12, 0.08, 0.0005, -0.0004, 0.01],
            camera_from_rig: Camera::looking_down(610.0),
        };
        let lamp = |position: [f64; 3]| {
            Light::Point(PointLight {
                position_mm: Point3::from(position),
                axis: UnitVector3::new_normalize(-Vector3::from(position)),
                exponent: 1.4,
                intensity: [1.0; 3],
            })
        };
        let lamps = [[400.0, 0.0, 380.0], [-150.0, 250.0, 500.0], [-90.0, -300.0, 250.0]].map(lamp);
        let plane = Plane::table();
        let field = LightField::new(lamps.iter().collect(), Some(&camera), &plane, (2464, 1632));
        let field = field.unwrap();
        assert!(field.nodes() * field.node_rows() > WORTH_IT, "the cubic way is not taken");
        let cubic = cubic_grid(&field).unwrap();
        assert!(is_accurate(&field, &cubic));
        for row in 0..field.node_rows() {
            let exact = field.node_row(row);
            for (exact, cubic) in exact.iter().zip(&cubic[row * exact.len()..]) {
                let off = (Vector3::from(*cubic) - Vector3::from(*exact)).norm();
                assert!(off < CUBIC_ERROR * Vector3::from(*exact).norm(), "row {row}: {off}");
            }
        }
    }
}
