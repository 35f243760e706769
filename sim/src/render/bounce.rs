use super::fabric::{Beam, Fabric, Hit, unit_normal};
use super::relief::HeightGrid;
use crate::random::Key;
use crate::reflectance::dot;
use std::f32::consts::TAU;

/// Directions a sample looks into for light that bounced.
const DIRECTIONS: u64 = 8;

/// Adds the light that neighbouring yarns throw onto a photosite's samples: diffuse, one bounce, by cosine-weighted
/// directions, in some channels. `add(light, signals)` is called once a light.
///
/// With directions drawn in proportion to the cosine, the irradiance is the mean of the radiosities seen.
pub(super) fn gather<const N: usize>(
    fabric: &Fabric,
    grid: &HeightGrid,
    (rows, channels): (&[[f32; 3]; 3], [usize; N]),
    hits: &[Hit],
    beams: &[Beam],
    mut add: impl FnMut(usize, [f32; N]),
) {
    let mut sums = vec![[0.0f32; N]; beams.len()];
    for hit in hits {
        let key = Key::new(hit.x_mm.to_bits()).with(hit.y_mm.to_bits());
        for k in 0..DIRECTIONS {
            let towards = cosine_direction(hit.normal, key.with(k), k);
            let Some([x, y]) = grid.first_hit(hit.x_mm, hit.y_mm, hit.height_mm, towards) else {
                continue;
            };
            let surface = fabric.surface(x, y);
            let normal = unit_normal(surface.slope);
            if dot(normal, towards) >= 0.0 {
                continue; // the grid's chord was met from behind
            }
            let passed_on = channels.map(|c| hit.albedo[c] * dot(rows[c], surface.albedo));
            for (sum, beam) in sums.iter_mut().zip(beams) {
                let facing = dot(normal, beam.towards);
                if facing > 0.0 && grid.is_open(x, y, surface.height_mm as f32, beam.towards) {
                    (0..N).for_each(|k| sum[k] += passed_on[k] * facing);
                }
            }
        }
    }
    let share = 1.0 / (hits.len() as f32 * DIRECTIONS as f32);
    for (i, (sum, beam)) in sums.iter().zip(beams).enumerate() {
        add(i, sum.map(|sum| sum * share * beam.strength));
    }
}

/// A direction around `normal` with density cos / pi; the k-th of a stratified set.
fn cosine_direction(normal: [f32; 3], key: Key, k: u64) -> [f32; 3] {
    let ring = ((k as f32 + key.with(1).unit() as f32) / DIRECTIONS as f32).sqrt();
    let (sin, cos) = (TAU * key.with(2).unit() as f32).sin_cos();
    let up = (1.0 - ring * ring).max(0.0).sqrt();
    let [tangent, bitangent] = frame(normal);
    std::array::from_fn(|c| ring * (cos * tangent[c] + sin * bitangent[c]) + up * normal[c])
}

/// Two unit vectors across a unit vector with z > -1 (Frisvad, "Building an orthonormal basis from a 3D unit vector
/// without normalization", JGT 16(3), 2012).
fn frame([x, y, z]: [f32; 3]) -> [[f32; 3]; 2] {
    let a = 1.0 / (1.0 + z.max(-0.999));
    let b = -x * y * a;
    [[1.0 - x * x * a, b, -x], [b, 1.0 - y * y * a, -y]]
}
