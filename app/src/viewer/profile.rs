//! What lies along a line on the cloth.

use crate::viewer::maps::Maps;
use nalgebra::Vector3;

/// Samples of a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Length, millimetres.
    pub length_mm: f64,
    /// Place along the line (mm) and slope along it (degrees, rising positive), where solved.
    pub slope: Vec<[f64; 2]>,
    /// Place along the line (mm) and height over its first point (mm): the slope summed up, level where nothing is solved.
    pub height: Vec<[f64; 2]>,
}

/// Most samples of a line.
const MOST_SAMPLES: usize = 4000;

/// What lies between two places of the maps (pixel coordinates): a sample every half pixel of the line.
pub fn along(maps: &Maps, [from, to]: [[f64; 2]; 2]) -> Profile {
    let geometry = &maps.geometry;
    let length_px = (to[0] - from[0]).hypot(to[1] - from[1]);
    let steps = ((2.0 * length_px).ceil() as usize).clamp(1, MOST_SAMPLES);
    let (start, end) = (geometry.on_plane(from), geometry.on_plane(to));
    let length_mm = (end - start).norm();
    let direction = (end - start).try_normalize(0.0).unwrap_or_else(Vector3::x);
    let step_mm = length_mm / steps as f64;
    let mut profile = Profile { length_mm, slope: Vec::new(), height: vec![[0.0, 0.0]] };
    let mut height_mm = 0.0;
    for k in 0..steps {
        let share = (k as f64 + 0.5) / steps as f64;
        let at = [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * share);
        let along_mm = share * length_mm;
        if let Some(rise) = rise_at(maps, at, &direction) {
            profile.slope.push([along_mm, rise.atan().to_degrees()]);
            height_mm += rise * step_mm;
        }
        profile.height.push([(k + 1) as f64 * step_mm, height_mm]);
    }
    profile
}

/// Millimetres up per millimetre along: a surface with normal n rises by -(n . d) / (n . m) over a plane with normal m.
fn rise_at(maps: &Maps, at: [f64; 2], direction: &Vector3<f64>) -> Option<f64> {
    let [x, y] = at.map(f64::round);
    if x < 0.0 || y < 0.0 {
        return None;
    }
    let sample = maps.sample(x as usize, y as usize)?;
    let normal = Vector3::from(sample.normal).cast::<f64>();
    Some(-normal.dot(direction) / normal.dot(&maps.geometry.plane().normal).max(1e-3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::geometry::Geometry;
    use weavelight_calibration::description::Plane;

    /// 100 mm wide; a bump h = a cos(2 pi x / 25 mm).
    fn bump() -> Maps {
        let normal = |k: usize| {
            let x_mm = ((k % 400) as f32 - 199.5) * 0.25;
            let slope = -0.4 * (std::f32::consts::TAU * x_mm / 25.0).sin();
            let length = (1.0 + slope * slope).sqrt();
            [-slope / length, 0.0, 1.0 / length]
        };
        let geometry = Geometry::new([400, 40], None, Plane::table(), 1);
        Maps::new(geometry, &normal, &|_| 0.0, &|_| [0.5; 3])
    }

    #[test]
    fn heights_are_the_slopes_summed_up() {
        let amplitude = 0.4 * 25.0 / std::f64::consts::TAU;
        // From a crest (x = 0) to a trough half a wave on, and back.
        let profile = along(&bump(), [[199.5, 20.0], [249.5, 20.0]]);
        assert!((profile.length_mm - 12.5).abs() < 1e-9);
        let [at, fallen] = *profile.height.last().unwrap();
        assert!((at - 12.5).abs() < 1e-9);
        assert!((fallen + 2.0 * amplitude).abs() < 0.01 * amplitude, "{fallen}");
        let back = along(&bump(), [[249.5, 20.0], [199.5, 20.0]]);
        assert!((back.height.last().unwrap()[1] - 2.0 * amplitude).abs() < 0.01 * amplitude);
        let steepest = profile.slope.iter().map(|s| s[1]).fold(0.0, f64::min);
        assert!((steepest + 0.4_f64.atan().to_degrees()).abs() < 0.1, "{steepest}");
    }

    #[test]
    fn lines_across_the_slope_and_beyond_the_picture_are_level() {
        let check = |line: [[f64; 2]; 2], samples: usize| {
            let profile = along(&bump(), line);
            assert!(profile.slope.iter().all(|s| s[1].abs() < 0.05), "{line:?}");
            assert_eq!(profile.slope.len(), samples, "{line:?}");
        };
        check([[230.0, 5.0], [230.0, 35.0]], 60);
        check([[-50.0, 5.0], [-20.0, 5.0]], 0);
        assert_eq!(along(&bump(), [[10.0, 5.0]; 2]).length_mm, 0.0);
    }
}
