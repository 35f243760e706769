//! A solution's maps, ready to be drawn.

use crate::viewer::geometry::Geometry;
use crate::viewer::pyramid::{Pyramid, Texel};
use half::f16;
use std::sync::Arc;
use weavelight::live::Preview;

/// Maps of one surface, all of one size.
#[derive(Clone, Debug)]
pub struct Maps {
    /// Normals, expected errors and what is solved; see [`Sample`].
    pub surface: Arc<Pyramid>,
    /// Linear RGB; what was divided out of it; all times the covered share, which the surface holds.
    pub albedo: Arc<Pyramid>,
    /// Where the pixels are.
    pub geometry: Arc<Geometry>,
}

/// What a pixel says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Unit normal, rig frame.
    pub normal: [f32; 3],
    /// Expected error of the normal, degrees; 0 where unknown.
    pub error_deg: f32,
    /// Linear RGB.
    pub albedo: [f32; 3],
    /// What the albedo is to be multiplied by for the picture under a light; 1 where nothing was divided out.
    pub shade: f32,
}

impl Sample {
    /// Angle between the normal and straight up, degrees.
    pub fn slope_deg(&self) -> f32 {
        let [x, y, z] = self.normal;
        x.hypot(y).atan2(z).to_degrees()
    }
}

impl Maps {
    /// Maps from what is at pixel `y * width + x`: the normal (zero where unsolved), its expected error in degrees, linear RGB.
    pub fn new(
        geometry: Geometry,
        normal: &(impl Fn(usize) -> [f32; 3] + Sync),
        error_deg: &(impl Fn(usize) -> f32 + Sync),
        albedo: &(impl Fn(usize) -> [f32; 3] + Sync),
    ) -> Self {
        let size = geometry.size();
        Self::over(surface(size, normal, error_deg), albedo, &|_| 1.0, geometry)
    }

    /// Maps over a surface that is there already; `shade` is what was divided out of the albedo.
    pub fn over(
        surface: Arc<Pyramid>,
        albedo: &(impl Fn(usize) -> [f32; 3] + Sync),
        shade: &(impl Fn(usize) -> f32 + Sync),
        geometry: Geometry,
    ) -> Self {
        let [width, _] = surface.size();
        let covered = |k: usize| match surface.texel(k % width, k / width) {
            Some(texel) => texel[3].to_f32(),
            None => 0.0,
        };
        let albedo = under_light(surface.size(), albedo, shade, &covered);
        Self { surface, albedo, geometry: Arc::new(geometry) }
    }

    /// What a running scan shows so far. `geometry` is that of the preview's pixels.
    pub fn of_preview(preview: &Preview, geometry: Geometry) -> Self {
        let (normal, albedo) = (&preview.normal.data, &preview.albedo.data);
        Self::new(geometry, &|k| normal[k], &|_| 0.0, &|k| albedo[k])
    }

    /// Pixels across and down.
    pub fn size(&self) -> [usize; 2] {
        self.surface.size()
    }

    /// What a pixel says; `None` outside and where nothing is solved. Half precision: normals to 0.03 degrees.
    pub fn sample(&self, x: usize, y: usize) -> Option<Sample> {
        let (normal, error_deg) = normal_of(self.surface.texel(x, y)?)?;
        let [r, g, b, shade] = self.albedo.texel(x, y)?.map(f16::to_f32);
        Some(Sample { normal, error_deg, albedo: [r, g, b], shade })
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.surface.bytes() + self.albedo.bytes()
    }
}

/// Normals and expected errors: n_x, n_y, error and 1, times the covered share. Coarser levels have unit mean normals.
pub fn surface(
    [width, height]: [usize; 2],
    normal: &(impl Fn(usize) -> [f32; 3] + Sync),
    error_deg: &(impl Fn(usize) -> f32 + Sync),
) -> Arc<Pyramid> {
    let value = |x: usize, y: usize| match (normal(y * width + x), error_deg(y * width + x)) {
        (n, error) if is_solved(n) => [n[0], n[1], n[2], error, 1.0],
        _ => [0.0; 5],
    };
    Pyramid::new([width, height], &value, |[x, y, z, error, covered]| {
        let length = (x * x + y * y + z * z).sqrt();
        let scale = if length > 0.0 { covered / length } else { 0.0 };
        [x * scale, y * scale, error, covered].map(f16::from_f32)
    })
}

/// A picture in linear RGB, and a value beside it in place of the covered share.
fn under_light(
    [width, height]: [usize; 2],
    rgb: &(impl Fn(usize) -> [f32; 3] + Sync),
    shade: &(impl Fn(usize) -> f32 + Sync),
    covered: &(impl Fn(usize) -> f32 + Sync),
) -> Arc<Pyramid> {
    let value = |x: usize, y: usize| {
        let (k, share) = (y * width + x, covered(y * width + x));
        let [r, g, b] = rgb(k).map(|value| finite(value) * share);
        [r, g, b, finite(shade(k)) * share]
    };
    Pyramid::new([width, height], &value, |texel| texel.map(f16::from_f32))
}

/// Half precision ends at 65504.
fn finite(value: f32) -> f32 {
    if value.is_finite() { value.clamp(-6e4, 6e4) } else { 0.0 }
}

/// A picture in linear RGB.
pub fn picture(
    [width, height]: [usize; 2],
    rgb: &(impl Fn(usize) -> [f32; 3] + Sync),
    covered: &(impl Fn(usize) -> f32 + Sync),
) -> Arc<Pyramid> {
    let value = |x: usize, y: usize| {
        let (k, share) = (y * width + x, covered(y * width + x));
        let [r, g, b] = rgb(k).map(|value| finite(value) * share);
        [r, g, b, share]
    };
    Pyramid::new([width, height], &value, |texel| texel.map(f16::from_f32))
}

/// Normal and expected error of a surface's texel; `None` where nothing is solved.
pub fn normal_of(texel: Texel) -> Option<([f32; 3], f32)> {
    let [x, y, error, covered] = texel.map(f16::to_f32);
    let (x, y, error) = (x / covered, y / covered, error / covered);
    (covered > 0.0).then(|| ([x, y, (1.0 - x * x - y * y).max(0.0).sqrt()], error))
}

fn is_solved(n: [f32; 3]) -> bool {
    n.iter().all(|c| c.is_finite()) && n[2] > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use weavelight_calibration::description::Plane;

    #[test]
    fn samples_come_back_to_half_precision_and_holes_stay_holes() {
        let tilted = [0.6, -0.48, 0.64];
        let normal = |k: usize| if k == 0 { [0.0; 3] } else { tilted };
        let geometry = Geometry::new([300, 2], None, Plane::table(), 1);
        let maps = Maps::new(geometry, &normal, &|_| 1.5, &|_| [0.25, 0.5, 1.0]);
        assert_eq!((maps.sample(0, 0), maps.sample(300, 0)), (None, None));
        let sample = maps.sample(7, 1).unwrap();
        assert!((0..3).all(|c| (sample.normal[c] - tilted[c]).abs() < 5e-4), "{sample:?}");
        assert_eq!((sample.error_deg, sample.albedo, sample.shade), (1.5, [0.25, 0.5, 1.0], 1.0));
        let surface = maps.surface.clone();
        let geometry = Geometry::new([300, 2], None, Plane::table(), 1);
        let shaded = Maps::over(surface, &|_| [0.25, 0.5, 1.0], &|_| 0.75, geometry);
        assert_eq!(shaded.sample(7, 1).unwrap().shade, 0.75);
        assert_eq!(shaded.sample(7, 1).unwrap().albedo, [0.25, 0.5, 1.0]);
        assert!((sample.slope_deg() - 50.208).abs() < 0.05, "{}", sample.slope_deg());
    }
}
