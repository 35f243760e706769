//! How fibres reflect. Every function here is pi times a BRDF, in units of a perfect white diffuser: a surface lit with
//! irradiance E shows `E (n . l) (albedo + gloss)`.
//!
//! These models are the simulator's own; nothing of the program's material side is used, so that a recovered
//! reflectance proves more than that one program agrees with itself.

mod satin;
mod velvet;

/// Directions at a surface point, unit vectors away from it.
#[derive(Clone, Copy, Debug)]
pub struct Directions {
    /// Surface normal.
    pub normal: [f32; 3],
    /// To the light.
    pub light: [f32; 3],
    /// To the camera.
    pub view: [f32; 3],
}

/// A model of reflectance over the diffuse albedo that the cloth states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reflectance {
    /// Diffuse only.
    Lambert,
    /// GGX over Lambert.
    Satin {
        /// Reflectance of the gloss at normal incidence.
        f0: f32,
        /// GGX roughness alpha.
        alpha: f32,
    },
    /// Fibres standing up: light scattered off their sides brightens the edges.
    Velvet {
        /// Strength of the scattering per channel R, G, B.
        sheen: [f32; 3],
        /// Spread of the fibres' directions, 0..1.
        alpha: f32,
    },
}

impl Reflectance {
    /// What is added to the diffuse albedo in channel `channel` (0 red, 1 green, 2 blue).
    #[inline]
    pub fn gloss(&self, directions: &Directions, channel: usize) -> f32 {
        match self {
            Reflectance::Lambert => 0.0,
            Reflectance::Satin { f0, alpha } => satin::gloss(directions, *f0, *alpha),
            Reflectance::Velvet { sheen, alpha } => {
                sheen[channel] * velvet::gloss(directions, *alpha)
            }
        }
    }
}

#[inline]
pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The unit vector half-way between light and view; `None` where they oppose each other.
#[inline]
fn half_way(light: [f32; 3], view: [f32; 3]) -> Option<[f32; 3]> {
    let sum = [light[0] + view[0], light[1] + view[1], light[2] + view[2]];
    let norm = dot(sum, sum).sqrt();
    (norm > 1e-6).then(|| sum.map(|c| c / norm))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODELS: [Reflectance; 4] = [
        Reflectance::Lambert,
        Reflectance::Satin { f0: 0.05, alpha: 0.28 },
        Reflectance::Satin { f0: 0.08, alpha: 0.1 },
        Reflectance::Velvet { sheen: [0.45, 0.12, 0.16], alpha: 0.35 },
    ];

    fn direction(polar: f64, azimuth: f64) -> [f32; 3] {
        [
            (polar.sin() * azimuth.cos()) as f32,
            (polar.sin() * azimuth.sin()) as f32,
            polar.cos() as f32,
        ]
    }

    #[test]
    fn light_and_view_may_be_exchanged() {
        for model in MODELS {
            for k in 0..200 {
                let k = f64::from(k);
                let (light, view) =
                    (direction(0.007 * k, 0.9 * k), direction(1.5 - 0.006 * k, 1.7 * k));
                let normal = [0.0, 0.0, 1.0];
                let there = model.gloss(&Directions { normal, light, view }, 0);
                let back = model.gloss(&Directions { normal, light: view, view: light }, 0);
                assert!(
                    there >= 0.0 && (there - back).abs() <= 1e-4 * there.max(1e-3),
                    "{model:?}: {there} {back}"
                );
            }
        }
    }

    /// Share of the light from `polar` that the gloss sends back, by quadrature over the hemisphere.
    fn directional_albedo(model: Reflectance, polar: f64) -> f64 {
        let (steps, turns) = (400, 400);
        let light = direction(polar, 0.0);
        let mut sum = 0.0;
        for i in 0..steps {
            // Equal shares of sin^2: cosine-weighted rings.
            let ring = ((f64::from(i) + 0.5) / f64::from(steps)).sqrt().asin();
            for j in 0..turns {
                let view = direction(
                    ring,
                    std::f64::consts::TAU * (f64::from(j) + 0.5) / f64::from(turns),
                );
                sum +=
                    f64::from(model.gloss(&Directions { normal: [0.0, 0.0, 1.0], light, view }, 0));
            }
        }
        sum / f64::from(steps * turns)
    }

    #[test]
    fn no_gloss_gives_more_light_than_it_gets() {
        for model in MODELS {
            for polar_deg in [0.0, 20.0, 45.0, 60.0, 75.0] {
                let share = directional_albedo(model, f64::to_radians(polar_deg));
                assert!(share < 0.4, "{model:?} at {polar_deg} deg: {share}");
            }
        }
        let smooth = Reflectance::Satin { f0: 1.0, alpha: 0.15 };
        let share = directional_albedo(smooth, f64::to_radians(30.0));
        assert!((0.95..=1.001).contains(&share), "a smooth mirror-like lobe returns {share}");
    }
}
