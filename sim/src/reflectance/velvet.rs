use super::{Directions, dot, half_way};

/// pi times a microfacet BRDF of fibres that stand up: normals spread as sin^(1/alpha) of the angle to the surface normal,
/// with the soft visibility 1 / (4 (n.l + n.v - n.l n.v)).
///
/// Estevez and Kulla, "Production friendly microfacet sheen BRDF", SIGGRAPH courses 2017 (distribution); Neubelt and
/// Pettineo, "Crafting a next-gen material pipeline", SIGGRAPH courses 2013 (visibility).
#[inline]
pub(super) fn gloss(directions: &Directions, alpha: f32) -> f32 {
    let (n_l, n_v) =
        (dot(directions.normal, directions.light), dot(directions.normal, directions.view));
    let Some(half) = half_way(directions.light, directions.view) else { return 0.0 };
    if n_l <= 0.0 || n_v <= 0.0 {
        return 0.0;
    }
    let n_h = dot(directions.normal, half);
    let sin_squared = (1.0 - n_h * n_h).max(0.0);
    // D = (2 + 1/alpha) sin^(1/alpha) / (2 pi)
    let distribution = 0.5 * (2.0 + 1.0 / alpha) * sin_squared.powf(0.5 / alpha);
    distribution / (4.0 * (n_l + n_v - n_l * n_v))
}
