use super::{Directions, dot, half_way};
use std::f32::consts::PI;

/// pi times the GGX microfacet BRDF with height-correlated Smith masking and Schlick's Fresnel term.
///
/// Walter, Marschner, Li, Torrance, "Microfacet models for refraction through rough surfaces", EGSR 2007; Heitz,
/// "Understanding the masking-shadowing function", JCGT 3(2), 2014. Zero where light or view is below the surface.
#[inline]
pub(super) fn gloss(directions: &Directions, f0: f32, alpha: f32) -> f32 {
    let (n_l, n_v) =
        (dot(directions.normal, directions.light), dot(directions.normal, directions.view));
    let Some(half) = half_way(directions.light, directions.view) else { return 0.0 };
    if n_l <= 0.0 || n_v <= 0.0 {
        return 0.0;
    }
    let n_h = dot(directions.normal, half);
    let a2 = alpha * alpha;
    let denominator = n_h * n_h * (a2 - 1.0) + 1.0;
    let distribution = a2 / (PI * denominator * denominator);
    let root = |c: f32| (a2 + (1.0 - a2) * c * c).sqrt();
    let visibility = 0.5 / (n_l * root(n_v) + n_v * root(n_l));
    let grazing = (1.0 - dot(directions.light, half)).clamp(0.0, 1.0);
    let grazing2 = grazing * grazing;
    let fresnel = f0 + (1.0 - f0) * grazing2 * grazing2 * grazing;
    PI * distribution * visibility * fresnel
}
