use super::{Point, Top};

/// The tilts of the facets, degrees from the plane.
pub const FACET_TILTS_DEG: [f64; 4] = [0.0, 30.0, 45.0, 60.0];
/// Directions in which facets fall, around the plane's normal.
const AZIMUTHS: i64 = 8;
/// Facets stay within this distance of the plane, millimetres.
pub(crate) const HALF_RISE_MM: f64 = 0.25;

/// Square patches, each of one tilt and one direction: a target whose normals are known exactly.
///
/// Within a patch the surface is a saw-tooth of parallel tilted planes that never leaves the plane by more than a quarter
/// of a millimetre, so that a patch is lit as if it lay on the plane. The risers between the teeth have no extent and
/// let light and sight pass: **a facet neither shadows nor hides another, by construction**, and its only shadow is
/// its own, where it faces away from a light. This is what the statistical limit of a solver is measured on.
#[derive(Clone, Debug, PartialEq)]
pub struct Facets {
    /// Side of a patch, millimetres.
    pub patch_mm: f64,
    /// Reflectance, linear sRGB.
    pub albedo: [f32; 3],
}

impl Facets {
    /// Tilt in degrees and the azimuth in degrees towards which the normal leans, of the patch at (x, y).
    pub fn orientation_deg(&self, x_mm: f64, y_mm: f64) -> (f64, f64) {
        let (column, row) =
            ((x_mm / self.patch_mm).floor() as i64, (y_mm / self.patch_mm).floor() as i64);
        let tilt = FACET_TILTS_DEG[(column + 2 * row).rem_euclid(4) as usize];
        let azimuth = (3 * column.div_euclid(2) + 5 * row.div_euclid(2) + row).rem_euclid(AZIMUTHS);
        (tilt, 360.0 / AZIMUTHS as f64 * (azimuth as f64 + 0.25))
    }

    pub(crate) fn point(&self, x: f64, y: f64) -> Point {
        let (tilt, azimuth) = self.orientation_deg(x, y);
        let steepness = tilt.to_radians().tan();
        if steepness == 0.0 {
            return Point { height_mm: 0.0, slope: [0.0; 2], top: Top::Ground };
        }
        let (sin, cos) = azimuth.to_radians().sin_cos();
        let tooth_mm = 2.0 * HALF_RISE_MM / steepness;
        let place = (x * cos + y * sin) / tooth_mm;
        let within = place - place.round();
        Point {
            height_mm: -steepness * within * tooth_mm,
            slope: [-steepness * cos, -steepness * sin],
            top: Top::Ground,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn every_tilt_occurs_in_every_direction_within_a_hand() {
        let facets = Facets { patch_mm: 10.0, albedo: [0.5; 3] };
        let seen: HashSet<(i64, i64)> = (0..20)
            .flat_map(|i| {
                (0..20).map(move |j| (10.0 * f64::from(i) - 95.0, 10.0 * f64::from(j) - 95.0))
            })
            .map(|(x, y)| facets.orientation_deg(x, y))
            .map(|(tilt, azimuth)| (tilt as i64, azimuth as i64))
            .collect();
        assert_eq!(seen.len(), 4 * 8, "{seen:?}");
    }

    #[test]
    fn the_normal_leans_towards_the_stated_azimuth() {
        let facets = Facets { patch_mm: 10.0, albedo: [0.5; 3] };
        for (x, y) in [(3.0, 4.0), (13.0, 4.0), (25.0, -31.0), (-44.0, 8.0)] {
            let (tilt, azimuth) = facets.orientation_deg(x, y);
            let [sx, sy] = facets.point(x, y).slope;
            let norm = (sx * sx + sy * sy + 1.0).sqrt();
            assert!((1.0 / norm - tilt.to_radians().cos()).abs() < 1e-12);
            assert!(
                (-sx / norm - tilt.to_radians().sin() * azimuth.to_radians().cos()).abs() < 1e-12
            );
            assert!(
                (-sy / norm - tilt.to_radians().sin() * azimuth.to_radians().sin()).abs() < 1e-12
            );
        }
    }
}
